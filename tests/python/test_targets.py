"""Views traced for a fit: what is cut from them, and what the rest of a picture costs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mirrorbake.bake.bake import bake
from mirrorbake.bake.targets import ViewTracer, bounds, pieces
from mirrorbake.pem.opened import open_pem
from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from pathlib import Path

    from mirrorbake.bake.targets import Window


@pytest.mark.parametrize(
    "inner", [(12, 22, 3, 4), (10, 20, 8, 6), (10, 20, 1, 1), (17, 25, 1, 1), (11, 20, 6, 6), None]
)
def test_pieces_cover_a_window_once(inner: Window | None) -> None:
    window = (10, 20, 8, 6)
    times = np.zeros((40, 40), int)
    for (left, top, width, height), is_inner in pieces(window, inner):
        times[top : top + height, left : left + width] += 1
        if is_inner and inner is not None:
            # With the pixels around it, where the window has them.
            assert left == max(inner[0] - 1, 10)
            assert top == max(inner[1] - 1, 20)
            assert left + width == min(inner[0] + inner[2] + 1, 18)
            assert top + height == min(inner[1] + inner[3] + 1, 26)
    assert times[20:26, 10:18].all()
    assert times.sum() == 48


def test_bounds_are_those_of_pixels_in_a_window() -> None:
    window = (5, 7, 10, 4)
    assert bounds(np.array([12, 23, 31]), window) == (6, 8, 3, 3)
    assert bounds(np.array([], int), window) is None


def test_a_draft_saves_samples_off_the_object_alone(tmp_path: Path) -> None:
    data = {
        "reflector": {"object": "teapot", "subdivisions": 8, "parts": "split"},
        "views": {"kind": "fixed", "size": [60, 44], "fov": 50.0},
        "maps": {"size": 16, "distant": "infinite"},
        "trace": {"samples": 64, "depth": 2, "indirect": "none"},
        "layers": {"local": False, "hull_split": False},
        "auto": {"quality": "draft"},
    }
    bake(parse_config(data, "scene"), tmp_path / "pem")
    pem = open_pem(tmp_path / "pem")
    draft = pem.stage
    auto = draft.config.auto.model_copy(update={"quality": "normal"})
    whole = replace(draft, config=draft.config.model_copy(update={"auto": auto}))
    camera = draft.built.cameras.camera(pem.space.sample(0))
    few, all_ = (ViewTracer(stage, pem.store.header).trace(stage, camera).images for stage in (draft, whole))
    # The same samples of the object, to the last bit.
    assert np.array_equal(few.coverage, all_.coverage)
    assert np.array_equal(few.object, all_.object)
    inside = all_.coverage > 0.5
    assert np.array_equal(few.background[inside], all_.background[inside])
    # Four samples for 64 leave noise, and no more: the same light in the mean.
    off = np.ones(inside.shape, bool)
    left, top, width, height = bounds(np.flatnonzero(all_.coverage), (0, 0, 60, 44)) or (0, 0, 0, 0)
    off[max(top - 2, 0) : top + height + 2, max(left - 2, 0) : left + width + 2] = False
    assert not np.array_equal(few.background[off], all_.background[off])
    assert few.background[off].mean() == pytest.approx(all_.background[off].mean(), rel=0.02)

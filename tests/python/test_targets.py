"""Views traced for a fit: what is cut from them, and what the rest of a picture costs."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mirrorbake.bake.bake import bake
from mirrorbake.bake.targets import BAND_ROWS, ViewTracer, bounds, pieces
from mirrorbake.pem.opened import open_pem
from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from pathlib import Path


@pytest.mark.parametrize(
    "seen",
    [
        [(12, 22), (14, 25)],
        [(10, 20)],
        [(17, 59)],
        # Wide above, narrow below, and nothing for a while between them.
        [(10, 21), (17, 22), (13, 58)],
        [(x, y) for x in range(10, 18) for y in range(20, 60)],
        [],
    ],
)
def test_pieces_cover_a_window_once_and_hold_what_is_near_pixels(seen: list[tuple[int, int]]) -> None:
    window = (10, 20, 8, 40)
    pixel = np.array([(y - 20) * 8 + x - 10 for x, y in seen], int)
    times, held = np.zeros((80, 40), int), np.zeros((80, 40), bool)
    for (left, top, width, height), holds in pieces(window, pixel):
        place = np.s_[top : top + height, left : left + width]
        times[place] += 1
        held[place] = holds
    assert (times[20:60, 10:18] == 1).all()
    assert times.sum() == 8 * 40
    for x, y in seen:
        assert held[max(y - 1, 20) : min(y + 2, 60), max(x - 1, 10) : min(x + 2, 18)].all()
    if len(seen) < 4:
        assert held.sum() <= len(seen) * (BAND_ROWS + 4) * 8


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
    # Two samples for 64 leave noise, and no more: the same light in the mean.
    off = np.ones(inside.shape, bool)
    left, top, width, height = bounds(np.flatnonzero(all_.coverage), (0, 0, 60, 44)) or (0, 0, 0, 0)
    off[max(top - 2, 0) : top + height + 2, max(left - 2, 0) : left + width + 2] = False
    assert not np.array_equal(few.background[off], all_.background[off])
    assert few.background[off].mean() == pytest.approx(all_.background[off].mean(), rel=0.02)

"""Bakes for renderers of which only pictures are to be had."""

from __future__ import annotations

import dataclasses
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.bake.bake import bake
from mirrorbake.bake.renderers import MapsView, drawn_by, register_renderer, software
from mirrorbake.errors import InputError, OptionError
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.pem.opened import open_pem
from mirrorbake.pem.store import PemStore
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from pathlib import Path

    from mirrorbake.bake.bake import BakeSummary
    from mirrorbake.bake.renderers import Draw

SMALL: dict[str, Any] = {
    "reflector": {"object": "teapot", "subdivisions": 8, "parts": "split"},
    "views": {"count": 1, "size": [96, 72]},
    "maps": {"size": 32, "distant": "box"},
    "layers": {"local": True},
    "trace": {"samples": 16, "noise": 0, "depth": 1, "indirect": "none"},
    "static": {"views": 0},
}

BLUR = _core.RunTimeModel(
    name="blur", places=_core.run_time_model("Web").places, footprint_scale=2.5, filter="trilinear"
)
"""An engine's filter that is not the library's."""


def blurred(view: MapsView) -> Draw:
    return drawn_by(view, BLUR)


def baked(directory: Path, infer: dict[str, Any]) -> BakeSummary:
    config = parse_config({**SMALL, "infer": infer}, "small")
    return bake(config, directory, stage=prepare_stage(config))


def decibels(directory: Path, model: _core.RunTimeModel) -> float:
    """Of the only sample, drawn by a run time, against its traced picture."""
    pem = open_pem(directory)
    images = pem.store.read_images(0)
    samples = pem.stage.visibility(0.0, model.places)
    drawn = pem.run_time.render("pem", 0.0, samples, model)
    return psnr(drawn, images.object, images.coverage > 0.99)


@pytest.fixture(scope="module")
def analytic(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("analytic") / "pem"
    assert not any("pictures" in note for note in baked(directory, {}).notes)
    return directory


def test_pictures_of_the_library_s_own_renderer_give_the_maps_of_its_formula(
    analytic: Path, tmp_path: Path
) -> None:
    summary = baked(tmp_path / "pem", {"matrix": "probed", "renderer": "software"})
    (note,) = (note for note in summary.notes if "pictures" in note)
    most = int(note.split("at most ")[1].split()[0])
    assert 16 <= most <= 64
    web = _core.run_time_model("Web")
    # A pixel that sees two parts, or a silhouette that a colour was missing for, tells less than the formula.
    assert abs(decibels(tmp_path / "pem", web) - decibels(analytic, web)) < 0.5


def test_a_bake_for_another_renderer_looks_better_in_it(analytic: Path, tmp_path: Path) -> None:
    register_renderer("blurred", blurred)
    baked(tmp_path / "pem", {"matrix": "probed", "renderer": "blurred"})
    assert decibels(tmp_path / "pem", BLUR) > decibels(analytic, BLUR) + 2.0


def test_a_renderer_is_given_the_window_that_it_has_to_draw(analytic: Path) -> None:
    pem = open_pem(analytic)
    header, stage = pem.store.header, pem.stage
    camera = stage.built.cameras.camera(header.space.sample(0))
    maps = [
        np.random.default_rng(number).random((topology.texels, 4), dtype=np.float32)
        for number, topology in enumerate(header.topologies)
    ]
    whole = MapsView(camera, (0, 0, 96, 72), stage, header, pem.store.read_local_triangles())
    part = dataclasses.replace(whole, window=(16, 24, 32, 16))
    np.testing.assert_array_equal(software(part)(maps), software(whole)(maps)[:, 24:40, 16:48])


def test_pictures_that_do_not_depend_on_the_maps_are_an_error(tmp_path: Path) -> None:
    def deaf(view: MapsView) -> Draw:
        draw = software(view)
        return lambda maps: np.ones_like(draw(maps))

    register_renderer("deaf", deaf)
    with pytest.raises(_core.InvalidArgument, match="the same for all maps"):
        baked(tmp_path / "pem", {"matrix": "probed", "renderer": "deaf"})


def test_an_unknown_renderer_is_named_before_anything_is_written(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match=r"infer\.renderer = 'nobody': expected one of .*software"):
        baked(tmp_path / "pem", {"matrix": "probed", "renderer": "nobody"})
    assert not (tmp_path / "pem").exists()


@pytest.mark.parametrize(
    "infer",
    [
        {"matrix": "probed"},
        {"renderer": "software"},
        {"matrix": "probed", "renderer": "software", "fit": "layers"},
    ],
)
def test_probing_needs_a_renderer_and_the_display_fit(infer: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="need"):
        parse_config({**SMALL, "infer": infer}, "small")


def test_each_view_of_a_static_set_would_be_probed_so_there_is_none_by_default(tmp_path: Path) -> None:
    config = parse_config(
        {**SMALL, "static": {}, "infer": {"matrix": "probed", "renderer": "software"}}, "small"
    )
    summary = bake(config, tmp_path / "pem", stage=prepare_stage(config))
    assert summary.plan.value("static.views") == 0
    assert PemStore.open(tmp_path / "pem").read_static_maps() is None

"""What an export leaves out of a sample's maps is not seen near it, over every kind of parameter space."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mirrorbake.bake.bake import bake
from mirrorbake.envmap import EnvMap
from mirrorbake.evaluate.metrics import decibels, mean_squared_error
from mirrorbake.pem.export.blocks import blocks_of, pixels_of
from mirrorbake.pem.export.images import ImageFormat
from mirrorbake.pem.export.radiance_code import atlas_shape, from_atlas
from mirrorbake.pem.export.source import ExportSource, export_source
from mirrorbake.pem.export.web import WebOptions, WebPem
from mirrorbake.pem.opened import open_pem
from mirrorbake.pem.run_time import shell_maps
from mirrorbake.scene.config_axes import arranged
from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

SMALL: dict[str, Any] = {
    "reflector": {"object": "teapot", "subdivisions": 3, "parts": "split"},
    "maps": {"size": 32},
    "trace": {"samples": 4, "indirect": "none"},
    "static": {"views": 2},
    "auto": {"quality": "draft"},
}
FIXED = {"kind": "fixed", "start": 20, "size": [48, 36]}
SPACES: dict[str, dict[str, Any]] = {
    "arc": {"views": {"count": 2, "degrees": 20, "size": [48, 36]}},
    "dome": {
        "views": {
            "kind": "dome",
            "count": 2,
            "degrees": 20,
            "rings": 2,
            "elevation": [15, 30],
            "size": [48, 36],
        }
    },
    "motion": {"views": FIXED, "motion": {"to": [0.02, 0.0, 0.01], "turn": 20.0, "count": 2}},
    "light": {"views": FIXED, "light": {"turn": 30.0, "count": 2}},
}


def put_together(source: ExportSource, sample: int, own: list[NDArray[np.bool_]]) -> list[FloatArray]:
    """The maps of a sample as a page has them: the static set's where a block is not the sample's own."""
    assert source.static_maps is not None
    maps = []
    for number, entry in enumerate(source.maps):
        blocks = blocks_of(own[number], entry.size, source.projection)
        pixels = pixels_of(blocks, *atlas_shape(entry.size, source.projection))
        kept = from_atlas(pixels[..., None].astype(np.uint8), entry.size, source.projection) > 0
        maps.append(np.where(kept, source.pyramid(sample, number), source.static_maps[number]))
    return maps


@pytest.mark.parametrize("kind", SPACES)
def test_a_trimmed_sample_is_drawn_as_the_whole_one(kind: str, tmp_path: Path) -> None:
    sections = dict(SPACES[kind])
    if kind == "light":
        sky = np.random.default_rng(5).uniform(0.2, 1.0, (16, 32, 3)).astype(np.float32)
        sections["surroundings"] = {"panorama": save_panorama(tmp_path, sky)}
    bake(parse_config({**SMALL, **sections}, kind), tmp_path / "pem")
    pem = open_pem(tmp_path / "pem")
    source = export_source(pem)
    assert source.reads is not None
    header, local = pem.store.header, pem.store.read_local_triangles()
    sample = 1
    point = pem.space.sample(sample)
    own = list(source.reads(sample))
    # There is something to leave out.
    assert np.mean([texels.mean() for texels in own]) < 0.8
    maps = put_together(source, sample, own)
    pose = arranged(pem.stage.config, header.space.scene_coordinates(point)).pose
    parts = shell_maps(
        header, lambda part, shell: np.ascontiguousarray(maps[header.map_of(part, shell)]), pose, local
    )
    seen = pem.stage.visibility(point, pem.run_time.places)
    whole = pem.run_time.render("pem", point, seen)
    trimmed = pem.run_time.render_parts(parts, seen, point)
    static = pem.run_time.render("static_set", point, seen)
    mask = np.asarray(whole).max(axis=2) > 0.0
    # What is left out is read by less than a hundredth of a pixel a texel; the static set is another picture.
    assert decibels(mean_squared_error(trimmed, whole, mask)) > 40.0
    assert decibels(mean_squared_error(static, whole, mask)) < 35.0


def test_a_pem_without_parameters_is_exported_whole(tmp_path: Path) -> None:
    views = {"kind": "none", "count": 3, "elevation": [0.0, 40.0], "size": [48, 36]}
    bake(parse_config({**SMALL, "views": views}, "none"), tmp_path / "pem")
    source = export_source(open_pem(tmp_path / "pem"))
    web = WebPem(source, WebOptions(ImageFormat(exact=False), fallback=False))
    (sample,) = json.loads(web.read("manifest.json"))["samples"]
    assert sample["blocks"] is None
    assert sample["parameter"] == []


def save_panorama(folder: Path, pixels: FloatArray) -> str:
    path = folder / "sky.exr"
    EnvMap.from_array(pixels, "latlong").save(path)
    return str(path)

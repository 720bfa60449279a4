"""Surfaces without thickness, seen from both sides: a bowl is not lit inside as it is outside."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.bake.bake import bake
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.pem.opened import open_pem
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from pathlib import Path


def bowl() -> tuple[np.ndarray, np.ndarray]:
    """Positions and triangles of the lower half of a unit sphere, its front outside."""
    sphere = _core.make_sphere((0.0, 0.0, 0.0), 1.0, 48)
    positions, triangles = np.asarray(sphere.positions), np.asarray(sphere.triangles)
    lower = (positions[triangles][:, :, 1] < 1e-4).all(axis=1)
    return positions, np.ascontiguousarray(triangles[lower])


def white_sky_above() -> np.ndarray:
    """Return a sky of radiance 1 above the horizon and 0.02 below."""
    sky = np.full((16, 32, 3), 1.0, np.float32)
    sky[8:] = 0.02
    return sky


def bowl_scene() -> tuple[_core.Scene, np.ndarray]:
    positions, triangles = bowl()
    scene = _core.Scene()
    coat = _core.Material(
        name="coat",
        albedo=(0.6, 0.6, 0.6),
        specular=True,
        fresnel=_core.Fresnel(model="dielectric", eta=(1.5, 1.5, 1.5)),
        layers="coated",
    )
    scene.add_object("bowl", _core.TriangleMesh(positions, triangles), scene.add_material(coat))
    scene.set_environment(white_sky_above(), 1.0, 0.0)
    return scene, triangles


CAMERA = _core.Camera(eye=(0.0, 2.5, 3.5), target=(0.0, -0.3, 0.0), width=48, height=36)


# Paths of 64 samples a pixel leave less than 1% in a mean, light at vertices is blurred. The cache follows
# three bounces of four, and leaves out the sky that the coat throws onto other places of the bowl.
TOLERANCE = {"path": 0.04, "cached": 0.08}


@pytest.mark.parametrize("indirect", ["cached", "path"])
def test_irradiance_of_both_sides_is_what_random_paths_find(
    indirect: Literal["cached", "path"],
) -> None:
    scene, triangles = bowl_scene()
    paths = _core.Tracer(scene, _core.TracerOptions(indirect="path"))
    options = _core.TraceOptions(samples_per_pixel=64)
    traced = paths.trace_layers(CAMERA, 0, options).samples
    tracer = _core.Tracer(scene, _core.TracerOptions(indirect=indirect))
    front, back = (np.asarray(tracer.vertex_irradiance(0, 512, 0, side)) for side in ("front", "back"))
    is_back = np.asarray(traced.back) == 1
    assert 0.1 < is_back.mean() < 0.9
    drawn = np.asarray(_core.diffuse_from_irradiance(traced, triangles, front, back))
    alone = np.asarray(_core.diffuse_from_irradiance(traced, triangles, front))
    expected = np.asarray(traced.diffuse)
    for side in (is_back, ~is_back):
        assert drawn[side].mean() == pytest.approx(expected[side].mean(), rel=TOLERANCE[indirect])
    # The outside, which looks down, is several times darker than what the inside shows.
    assert alone[is_back].mean() < 0.5 * expected[is_back].mean()


def test_cached_light_in_a_bowl_is_what_random_paths_find() -> None:
    scene, _ = bowl_scene()
    options = _core.TraceOptions(samples_per_pixel=64)
    sums = [
        np.asarray(_core.Tracer(scene, tracing).trace_layers(CAMERA, 0, options).samples.diffuse).mean()
        for tracing in (_core.TracerOptions(indirect="cached"), _core.TracerOptions(indirect="path"))
    ]
    assert sums[0] == pytest.approx(sums[1], rel=TOLERANCE["cached"])


def test_the_back_of_a_plate_in_a_white_world_gets_pi() -> None:
    scene = _core.Scene()
    plate = _core.TriangleMesh(
        np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], np.float32),
        np.array([[0, 1, 2], [0, 2, 3]], np.uint32),
    )
    scene.add_object("plate", plate, scene.add_material(_core.Material(name="m", albedo=(0.5, 0.5, 0.5))))
    sky = white_sky_above()
    sky[:8] = 0.0
    sky[8:] = 1.0
    scene.set_environment(sky, 1.0, 0.0)
    tracer = _core.Tracer(scene)
    back = np.asarray(tracer.vertex_irradiance(0, 4096, 0, "back"))
    np.testing.assert_allclose(back, np.pi, rtol=0.03)
    # What texels at the horizon leak to the other side.
    assert np.asarray(tracer.vertex_irradiance(0, 4096, 0)).max() < 0.1


def test_the_backs_of_a_closed_body_are_dark() -> None:
    scene = _core.Scene()
    ball = _core.make_sphere((0.0, 0.0, 0.0), 1.0, 24)
    scene.add_object("ball", ball, scene.add_material(_core.Material(name="m", albedo=(0.5, 0.5, 0.5))))
    scene.set_environment(white_sky_above(), 1.0, 0.0)
    assert not np.asarray(_core.Tracer(scene).vertex_irradiance(0, 256, 0, "back")).any()


def test_a_wrong_side_is_an_error() -> None:
    scene, _ = bowl_scene()
    with pytest.raises(_core.InvalidArgument, match=r"side is inside, expected front or back"):
        _core.Tracer(scene, _core.TracerOptions(indirect="none")).vertex_irradiance(0, 16, 0, "inside")  # type: ignore[arg-type]


def test_a_fine_mesh_shares_rays_and_gathers_the_same_light() -> None:
    """Above 16384 vertices each takes fewer rays, and the mean with its neighbours."""
    sums = []
    coat = _core.Material(
        albedo=(0.6, 0.6, 0.6),
        specular=True,
        fresnel=_core.Fresnel(model="dielectric", eta=(1.5, 1.5, 1.5)),
        layers="coated",
    )
    for segments in (96, 260):
        scene = _core.Scene()
        floor = scene.add_material(_core.Material(name="floor", albedo=(0.7, 0.7, 0.7)))
        scene.add_object("floor", _core.make_cylinder((0.0, -1.2, 0.0), 6.0, 0.1, 48), floor)
        ball = _core.make_sphere((0.0, 0.0, 0.0), 1.0, segments)
        scene.add_object("ball", ball, scene.add_material(coat))
        scene.set_environment(white_sky_above(), 1.0, 0.0)
        tracer = _core.Tracer(scene, _core.TracerOptions(indirect="cached"))
        options = _core.TraceOptions(samples_per_pixel=16)
        camera = _core.Camera(eye=(0.0, -0.5, 4.0), target=(0.0, 0.0, 0.0), width=32, height=24)
        sums.append(np.asarray(tracer.trace_layers(camera, 1, options).samples.diffuse).mean())
    assert sums[1] == pytest.approx(sums[0], rel=0.01)


def test_a_baked_bowl_shows_its_inside(tmp_path: Path) -> None:
    positions, triangles = bowl()
    lines = [f"v {x} {y} {z}" for x, y, z in positions]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in triangles]
    (tmp_path / "bowl.obj").write_text("\n".join(lines))
    _core.save_image(str(tmp_path / "sky.exr"), white_sky_above(), ["R", "G", "B"])
    scene = {
        "reflector": {
            "mesh": str(tmp_path / "bowl.obj"),
            "height": 0.5,
            "parts": 1,
        },
        "material": {"fresnel": "dielectric", "ior": 1.5, "albedo": [0.6, 0.6, 0.6], "layers": "coated"},
        "surroundings": {"panorama": str(tmp_path / "sky.exr")},
        "views": {"count": 1, "height": 1.5, "size": [64, 48]},
        "trace": {"samples": 16, "indirect": "cached"},
        "layers": {"diffuse": True},
        "maps": {"size": 32},
        "static": {"views": 0},
        "auto": {"quality": "draft"},
    }
    stage = prepare_stage(parse_config(scene, "bowl"))
    bake(stage.config, tmp_path / "pem", None, stage)
    pem = open_pem(tmp_path / "pem", stage)
    irradiance = pem.store.read_irradiance()
    assert irradiance is not None
    assert irradiance.shape == (len(stage.built.positions), 6)
    images = pem.store.read_images(0)
    mask = images.coverage >= 0.5
    drawn = pem.run_time.render("pem", 0.0, pem.stage.visibility(0.0))
    # With the outside's light inside, this was 11 dB.
    assert psnr(drawn, images.object, mask) > 25

"""Rough reflectors: their maps hold what the lobe makes of the surroundings, no finer than the lobe."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.bake.bake import bake
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.pem.opened import open_pem
from mirrorbake.pem.view_images import images_of_trace
from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from mirrorbake.pem.opened import OpenedPem

REFLECTANCE = 0.9
EXPONENT = 8.0


def rough_ball(folder: Path, sky: NDArray[np.float32], **sections: dict[str, Any]) -> OpenedPem:
    """Bake one view of a ball of 1 m under a panorama."""
    mesh = _core.make_sphere((0, 0.5, 0), 0.5, 64)
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.positions.tolist()]
    lines += [f"vn {x} {y - 0.5} {z}" for x, y, z in mesh.positions.tolist()]
    lines += ["f " + " ".join(f"{i + 1}//{i + 1}" for i in t) for t in mesh.triangles.tolist()]
    (folder / "ball.obj").write_text("\n".join(lines) + "\n")
    _core.save_image(str(folder / "sky.exr"), sky, ["R", "G", "B"], format="float32")
    scene: dict[str, dict[str, Any]] = {
        "reflector": {"mesh": str(folder / "ball.obj"), "height": 1.0, "parts": "joined"},
        "material": {"fresnel": "constant", "r0": REFLECTANCE, "lobe": "phong", "exponent": EXPONENT},
        "surroundings": {"panorama": str(folder / "sky.exr")},
        "views": {"count": 1, "size": [64, 64]},
        "layers": {"local": False},
        "trace": {"indirect": "none", "samples": 256, "noise": 0},
        "static": {"views": 0},
        "maps": {},
    }
    for name, section in sections.items():
        scene[name] = {**scene[name], **section}
    bake(parse_config(scene, "ball"), folder / "pem")
    return open_pem(folder / "pem")


def gradient(low: float, high: float) -> NDArray[np.float32]:
    """A panorama whose radiance goes with the direction's height: (low + high)/2 + (high - low)/2 · y."""
    rows = np.sin(np.pi * (0.5 - (np.arange(128) + 0.5) / 128))
    light = 0.5 * (low + high) + 0.5 * (high - low) * rows
    return np.ascontiguousarray(np.broadcast_to(light[:, None, None], (128, 256, 3)), np.float32)


# Phong's lobe about r shows of a + b·y the value a + b·(N + 1)/(N + 2)·r_y, the mean cosine of cos^N over a
# hemisphere, where the surface cuts off nothing worth mentioning: cos^9 of 50 degrees is below 2 %.
@pytest.mark.parametrize(("low", "high"), [(0.6, 0.6), (0.1, 0.9)])
def test_maps_under_a_gradient_hold_its_convolution_with_the_lobe(
    tmp_path: Path, low: float, high: float
) -> None:
    pem = rough_ball(tmp_path, gradient(low, high))
    samples = pem.stage.visibility(0.0, [(0.5, 0.5)])
    drawn = pem.run_time.render("pem", 0.0, samples).reshape(-1, 3)[np.asarray(samples.pixel)]
    reflection, normal = np.asarray(samples.reflection), np.asarray(samples.normal)
    middle = np.sum(reflection * normal, axis=1) > np.cos(np.radians(35.0))
    assert middle.sum() > 200
    blurred = 0.5 * (low + high) + 0.5 * (high - low) * (EXPONENT + 1.0) / (EXPONENT + 2.0) * reflection[:, 1]
    # 256 directions of a lobe that is some 50 degrees wide leave 2 % of the gradient in a pixel, on which
    # neighbouring pixels agree.
    error = drawn[middle, 0] / REFLECTANCE - blurred[middle]
    assert np.sqrt(np.mean(error**2)) < 0.005 + 0.02 * (high - low)
    assert abs(np.mean(error)) < 0.004


def test_a_rough_ball_looks_as_it_is_traced_from_maps_no_finer_than_its_lobe(tmp_path: Path) -> None:
    patches = np.random.default_rng(5).uniform(0.05, 1.0, (8, 16, 3)).repeat(16, 0).repeat(16, 1)
    decibels, sizes = {}, {}
    for size in ("auto", 128):
        folder = tmp_path / str(size)
        folder.mkdir()
        pem = rough_ball(folder, patches.astype(np.float32), maps={"size": size}, trace={"samples": 64})
        stage, options = pem.stage, pem.stage.options
        options.samples_per_pixel, options.seed = 1024, 9
        camera = stage.built.cameras.camera((0.0,))
        truth = images_of_trace(stage.tracer.trace_layers(camera, stage.built.reflector, options))
        samples = stage.visibility(0.0, pem.run_time.places)
        drawn = pem.run_time.render("pem", 0.0, samples)
        decibels[size] = psnr(drawn, truth.object, truth.coverage > 0.999)
        sizes[size] = pem.store.header.map_size
    assert sizes["auto"] == 16
    assert decibels["auto"] > 36.0
    # 64 times as many texels show nothing that the lobe has not blurred.
    assert decibels["auto"] > decibels[128] - 0.3

"""What a scene requires, for scenes of which it is known."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from typer.testing import CliRunner

from mirrorbake import _core
from mirrorbake.analyze import MAX_DEPTH, analyze
from mirrorbake.cli import app
from mirrorbake.config import load_config

if TYPE_CHECKING:
    from pathlib import Path


def scene_file(folder: Path, mesh: _core.TriangleMesh, albedo: tuple[float, float, float]) -> Path:
    """Write a scene of a mesh under a panorama, seen from a quarter circle."""
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.positions.tolist()]
    lines += ["f " + " ".join(str(i + 1) for i in t) for t in mesh.triangles.tolist()]
    (folder / "mesh.obj").write_text("\n".join(lines) + "\n")

    rows = np.linspace(0.2, 2.0, 16, dtype=np.float32)[:, None, None]
    _core.save_image(
        str(folder / "sky.exr"), np.ascontiguousarray(np.broadcast_to(rows, (16, 32, 3))), ["R", "G", "B"]
    )
    path = folder / "scene.toml"
    path.write_text(
        f"""[reflector]
mesh = "mesh.obj"
height = 1.0
[material]
fresnel = "constant"
r0 = [0.9, 0.9, 0.9]
albedo = {list(albedo)}
[surroundings]
panorama = "sky.exr"
[views]
count = 3
size = [64, 64]
[trace]
indirect = "none"
samples = 4
"""
    )
    return path


def found(folder: Path, mesh: Any, albedo: tuple[float, float, float] = (0, 0, 0)) -> Any:
    return analyze(load_config(scene_file(folder, mesh, albedo), []))


def test_a_convex_black_mirror_needs_the_distant_layer_alone(tmp_path: Path) -> None:
    analysis = found(tmp_path, _core.make_box((-0.5, 0, -0.5), (0.5, 1, 0.5)))
    assert {layer.subject: layer.needed for layer in analysis.layers} == {
        "diffuse": False,
        "local": False,
        "glossy": False,
    }
    assert all(layer.reason for layer in analysis.layers)
    # Nothing to reflect but the sky: the first reflection is the last.
    assert analysis.depth == 0
    assert analysis.depth_errors[0] == 0.0


def test_a_ring_reflects_itself_and_paint_is_diffuse(tmp_path: Path) -> None:
    analysis = found(tmp_path, _core.make_torus((0, 0.5, 0), 0.6, 0.3, 48), (0.5, 0.1, 0.1))
    needed = {layer.subject: layer.needed for layer in analysis.layers}
    assert needed == {"diffuse": True, "local": True, "glossy": False}
    assert 1 <= analysis.depth < MAX_DEPTH
    errors = analysis.depth_errors
    assert errors[analysis.depth] <= 0.01 < errors[analysis.depth - 1]
    assert errors[-1] == 0.0


def test_map_size_follows_the_curvature_of_the_mirror(tmp_path: Path) -> None:
    analysis = found(tmp_path, _core.make_sphere((0, 0.5, 0), 0.5, 96))
    # On a sphere of radius r a pixel of p metres turns the normal by p/r and the reflection by twice that in
    # the middle of the image, more towards the rim: the sphere fills 0.9 of 64 pixels.
    step = 2 * (1 / 0.9 / 64) / 0.5
    assert 2 / step / 2 <= analysis.map_size <= 2 * 2 / step
    assert analysis.map_size == 2 ** round(math.log2(analysis.map_size))


def test_the_command_prints_reasons_or_json(tmp_path: Path) -> None:
    path = scene_file(tmp_path, _core.make_box((-0.5, 0, -0.5), (0.5, 1, 0.5)), (0, 0, 0))
    runner = CliRunner()
    table = runner.invoke(app, ["analyze", str(path)])
    assert table.exit_code == 0, table.output
    assert "convex hull" in table.stdout
    printed = runner.invoke(app, ["analyze", str(path), "--json"])
    report = json.loads(printed.stdout)
    assert report["depth"] == 0
    assert [layer["subject"] for layer in report["layers"]] == ["diffuse", "local", "glossy"]
    assert runner.invoke(app, ["analyze", str(path), "--tolerance", "2"]).exit_code == 3


@pytest.mark.parametrize("tolerance", [0.0, 1.0, math.nan])
def test_a_tolerance_out_of_range_is_refused(tolerance: float, tmp_path: Path) -> None:
    path = scene_file(tmp_path, _core.make_box((-0.5, 0, -0.5), (0.5, 1, 0.5)), (0, 0, 0))
    with pytest.raises(_core.InvalidArgument, match="tolerance"):
        analyze(load_config(path, []), tolerance)

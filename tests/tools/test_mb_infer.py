"""mb-infer from the outside: maps from the layers that mb-trace writes, the same ones as from Python."""

import json
import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.envmap import EnvMap
from mirrorbake.inference import infer_maps
from programs import needs_program, run_program

pytestmark = [needs_program("mb-infer"), needs_program("mb-trace")]

VIEW = ["--reflector", "teapot", "--size", "48x32", "--spp", 4, "--depth", 1, "--indirect", "none"]
SHELLS = ["--shell", "local=sphere:0,0.07,0,0.16", "--shell", "distant=box:0,1.2,0,2,1.25,2@0,0.07,0"]


@pytest.fixture(scope="module")
def layers(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the layers of a small view of the teapot, with the lookups of the page."""
    path = tmp_path_factory.mktemp("layers") / "layers.exr"
    run_program("mb-trace", "layers", "teapot-room", "-o", path, *VIEW, "--lookups", "Web")
    return path


def infer(*arguments: object) -> dict[str, Any]:
    report: dict[str, Any] = json.loads(run_program("mb-infer", *arguments, "--size", 16, "--json"))
    return report


def test_lookups_stand_beside_the_layers(layers: Path) -> None:
    pixels, channels = _core.load_image(layers)
    part = np.asarray(pixels)[..., [channels.index(f"lookup.{n}.part") for n in range(4)]]
    coverage = np.asarray(pixels)[..., channels.index("coverage")]
    assert np.all(part.max(axis=-1)[coverage == 1.0] >= 0)
    reflection = np.asarray(pixels)[..., [channels.index(f"lookup.0.reflection.{a}") for a in "XYZ"]]
    length = np.linalg.norm(reflection[part[..., 0] >= 0], axis=-1)
    # Float32: half floats would be off by 3e-4.
    np.testing.assert_allclose(length, 1.0, atol=1e-6)


def test_maps_of_the_program_are_those_of_python(layers: Path, tmp_path: Path) -> None:
    path = tmp_path / "{}.ktx2"
    report = infer(layers, "-o", path, *SHELLS, "--format", "float32")
    assert report["outputs"] == [str(tmp_path / "local.ktx2"), str(tmp_path / "distant.ktx2")]
    assert report["converged"]
    assert 0.0 < report["residual"] < 0.2
    assert report["pixels"] > 100
    sphere = _core.Proxy.ellipsoid((0, 0.07, 0), (0.16, 0.16, 0.16))
    room = _core.Proxy.box((0, 1.2, 0), (2, 1.25, 2), origin=(0, 0.07, 0))
    same = infer_maps([layers], {"local": sphere, "distant": room}, size=16)
    assert (same.residual, same.iterations) == (report["residual"], report["iterations"])
    for name, channels in (("local", 4), ("distant", 3)):
        stored = EnvMap.load(tmp_path / f"{name}.ktx2")
        assert stored.levels == 5
        assert len(stored.channels) == channels
        np.testing.assert_array_equal(stored.values, same.maps[name].values)


def test_maps_of_several_views_show_them_all(layers: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.exr"
    eye = ["--eye", -0.3, 0.3, 0.3]
    run_program("mb-trace", "layers", "teapot-room", "-o", other, *VIEW, *eye, "--lookups", "Web")
    alone = infer(layers, "-o", tmp_path / "a.exr", *SHELLS)
    both = infer(layers, other, "-o", tmp_path / "b.exr", *SHELLS)
    assert both["pixels"] > 1.5 * alone["pixels"]
    assert both["texels"] > alone["texels"]


@pytest.mark.parametrize("projection", ["cube", "dual_paraboloid"])
def test_an_exr_file_holds_all_levels_of_all_maps(projection: str, layers: Path, tmp_path: Path) -> None:
    path = tmp_path / "maps.exr"
    infer(layers, "-o", path, *SHELLS, "--to", projection, "--format", "float32")
    pixels, channels = _core.load_image(path)
    assert sorted(channels) == sorted(
        ["local.R", "local.G", "local.B", "local.A", "distant.R", "distant.G", "distant.B"]
    )
    faces = 6 if projection == "cube" else 2
    assert np.asarray(pixels).shape == (16 * faces, 16, 7)
    maps = infer_maps(
        [layers],
        {
            "local": _core.Proxy.ellipsoid((0, 0.07, 0), (0.16, 0.16, 0.16)),
            "distant": _core.Proxy.box((0, 1.2, 0), (2, 1.25, 2), origin=(0, 0.07, 0)),
        },
        size=16,
        projection=projection,
    ).maps
    red = np.asarray(pixels)[..., channels.index("distant.R")]
    np.testing.assert_array_equal(red, maps["distant"].level(0)[..., 0].reshape(red.shape))
    oiiotool = shutil.which("oiiotool")
    if oiiotool is None:
        pytest.skip("oiiotool, which reads levels of EXR files, is not installed")
    for level in range(5):
        one = tmp_path / f"{level}.exr"
        subprocess.run([oiiotool, str(path), "--selectmip", str(level), "-o", str(one)], check=True)
        stored, names = _core.load_image(one)
        expected = maps["local"].level(level)
        np.testing.assert_array_equal(
            np.asarray(stored)[..., names.index("local.A")].reshape(expected.shape[:-1]), expected[..., 3]
        )


def test_a_solve_that_did_not_converge_is_said_with_the_remedy(layers: Path, tmp_path: Path) -> None:
    program = run_program("mb-infer", layers, "-o", tmp_path / "a.exr", "--size", 16, "--iterations", 2)
    assert "2 iterations, not converged" in program


def test_what_does_not_fit_is_refused(layers: Path, tmp_path: Path) -> None:
    out = tmp_path / "maps.exr"
    plain = tmp_path / "plain.exr"
    run_program("mb-trace", "layers", "teapot-room", "-o", plain, *VIEW)
    message = run_program("mb-infer", plain, "-o", out, status=3)
    assert "0 lookups a pixel, expected the 4 of the run time Web" in message
    assert "expected the 1 of" in run_program("mb-infer", layers, "-o", out, "--run-time", "Web1", status=3)
    assert "{} in the path" in run_program(
        "mb-infer", layers, "-o", tmp_path / "one.ktx2", "--size", 16, status=2
    )
    assert "holds no mip levels" in run_program("mb-infer", layers, "-o", tmp_path / "one.png", status=3)
    assert not list(tmp_path.glob("one*"))
    assert not out.exists()

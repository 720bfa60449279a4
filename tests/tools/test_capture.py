"""mb-trace capture from the outside: environment maps of a scene."""

import json
from pathlib import Path

import numpy as np
import pytest

from mirrorbake.envmap import EnvMap
from programs import needs_program, run_program

pytestmark = needs_program("mb-trace")

TRIANGLE = "v -1 -1 -2\nv 1 -1 -2\nv 0 1 -2\nf 1 2 3\n"


def capture(*arguments: object, status: int = 0) -> str:
    return run_program("mb-trace", "capture", *arguments, status=status)


@pytest.mark.parametrize(
    ("projection", "shape"),
    [
        ("cube", (6, 8, 8, 3)),
        ("dual_paraboloid", (2, 8, 8, 3)),
        ("latlong", (8, 16, 3)),
        ("angular", (8, 8, 3)),
    ],
)
def test_a_capture_is_a_map_that_loads(tmp_path: Path, projection: str, shape: tuple[int, ...]) -> None:
    scene = tmp_path / "triangle.obj"
    scene.write_text(TRIANGLE)
    out = tmp_path / "map.exr"
    told = json.loads(capture(scene, "-o", out, "--to", projection, "--size", 8, "--spp", 4, "--json"))
    assert (told["projection"], told["height"], told["width"]) == (projection, shape[-3], shape[-2])
    envmap = EnvMap.load(out, projection)
    assert envmap.level().shape == shape
    # Away from the object there is only the sky, or nothing.
    behind = envmap.sample(np.array([[0, 0.3, 1]], np.float32))
    np.testing.assert_allclose(behind, behind[0, 0], rtol=1e-3)


def test_capture_says_what_is_wrong(tmp_path: Path) -> None:
    scene = tmp_path / "triangle.obj"
    scene.write_text(TRIANGLE)
    out = tmp_path / "map.exr"
    assert "--hide" in capture(scene, "-o", out, "--hide", "teapot", status=2)
    assert "--size" in capture(scene, "-o", out, "--size", "eight", status=2)
    assert "height" in capture(scene, "-o", out, "--size", "8x4", status=2)
    assert "projection" in capture(scene, "-o", out, "--to", "octahedron", status=2)
    assert not out.exists()

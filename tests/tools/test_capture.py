"""mb-trace capture from the outside: environment maps of a scene."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from mirrorbake.envmap import EnvMap

ROOT = Path(__file__).parents[2]
NAME = "mb-trace"
BUILDS = [os.environ.get("MIRRORBAKE_TOOLS", ""), *(ROOT / "build").glob("*/cpp/tools")]
FOUND = [Path(folder) / NAME for folder in map(str, BUILDS) if folder and (Path(folder) / NAME).is_file()]

pytestmark = pytest.mark.skipif(
    not FOUND, reason=f"{NAME} is not built: cmake --build --preset dev --target {NAME}"
)

TRIANGLE = "v -1 -1 -2\nv 1 -1 -2\nv 0 1 -2\nf 1 2 3\n"


def capture(*arguments: object, status: int = 0) -> str:
    newest = max(FOUND, key=lambda path: path.stat().st_mtime)
    done = subprocess.run(
        [newest, "capture", *map(str, arguments)], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == status, done.stderr
    return done.stdout if status == 0 else done.stderr


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
    assert "--hide" in capture(scene, "-o", out, "--hide", "teapot", status=3)
    assert "--size" in capture(scene, "-o", out, "--size", "eight", status=3)
    assert "height" in capture(scene, "-o", out, "--size", "8x4", status=3)
    assert "projection" in capture(scene, "-o", out, "--to", "octahedron", status=3)
    assert not out.exists()

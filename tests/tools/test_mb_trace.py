"""mb-trace from the outside: what it writes, what it prints, how it fails."""

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mirrorbake import _core
from programs import find_program, needs_program, run_program

pytestmark = needs_program("mb-trace")

# A mirror that stands upright on a white floor, under a sky.
OBJ = """mtllib scene.mtl
o floor
v -1 0 1
v 1 0 1
v 1 0 -1
v -1 0 -1
usemtl white
f 1 2 3 4
o mirror
v -0.5 0 0
v 0.5 0 0
v 0.5 1 0
v -0.5 1 0
usemtl mirror
f 5 6 7 8
"""
MTL = """newmtl white
Kd 0.5 0.5 0.5
illum 1
newmtl mirror
Kd 0 0 0
Ks 0.9 0.8 0.7
illum 3
"""


def mb_trace(*arguments: object, status: int = 0) -> str:
    return run_program("mb-trace", *arguments, status=status)


def read(path: Path) -> tuple[Any, list[str]]:
    pixels, channels = _core.load_image(str(path))
    return np.asarray(pixels), channels


VIEW = ["--eye", 0.2, 0.8, 1.5, "--target", 0, 0.3, 0, "--size", "24x16", "--format", "float32"]


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "scene.mtl").write_text(MTL)
    path = tmp_path / "scene.obj"
    path.write_text(OBJ)
    return path


def test_beauty_writes_radiance_and_aovs(scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "beauty.exr"
    report = json.loads(mb_trace("beauty", scene, "-o", out, *VIEW, "--spp", 16, "--aovs", "--json"))
    assert (report["width"], report["height"], report["samples_per_pixel"]) == (24, 16, 16)
    assert report["noise"] is None
    pixels, channels = read(out)
    assert pixels.shape == (16, 24, len(channels))
    assert {"R", "G", "B", "A", "Z", "normal.X", "position.Y", "albedo.G", "object"} <= set(channels)

    def at(name: str) -> Any:
        return pixels[..., channels.index(name)]

    floor = (at("object") == 0) & (at("A") == 1) & (at("albedo.R") == 0.5)
    assert floor.sum() > 20
    # Albedo 0.5 under a white sky of radiance 1, of which the mirror dims a part.
    assert 0.4 < at("R")[floor].mean() < 0.5
    np.testing.assert_allclose(at("normal.Y")[floor], 1, atol=1e-6)
    np.testing.assert_allclose(at("position.Y")[floor], 0, atol=1e-6)


def test_layers_add_up_to_the_beauty(scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "layers.exr"
    report = json.loads(mb_trace("layers", scene, "-o", out, *VIEW, "--spp", 16, "--json"))
    assert [r["name"] for r in report["reflectors"]] == ["mirror"]
    pixels, channels = read(out)

    def rgb(name: str) -> Any:
        return pixels[..., [channels.index(f"{name}{c}") for c in "RGB"]]

    alpha = pixels[..., channels.index("specular_local.A")][..., None]
    total = rgb("diffuse.") + rgb("fresnel.") * (
        rgb("specular_local.") + (1 - alpha) * rgb("specular_distant.")
    )
    whole = pixels[..., channels.index("coverage")] == 1
    assert whole.sum() > 20
    np.testing.assert_allclose((total + rgb("covariance."))[whole], rgb("")[whole], rtol=1e-4, atol=1e-5)


def test_same_bits_whatever_the_threads_and_a_crop_is_a_part(scene: Path, tmp_path: Path) -> None:
    images = []
    for name, extra in (("one", ["--threads", 1]), ("all", []), ("part", ["--crop", "9x7+11+5"])):
        out = tmp_path / f"{name}.exr"
        mb_trace("beauty", scene, "-o", out, *VIEW, "--spp", 4, "--seed", 3, *extra)
        images.append(read(out)[0])
    np.testing.assert_array_equal(images[0], images[1])
    np.testing.assert_array_equal(images[0][5:12, 11:20], images[2])


def test_noise_is_reached_and_reported(scene: Path, tmp_path: Path) -> None:
    out = tmp_path / "beauty.exr"
    arguments = ["beauty", scene, "-o", out, *VIEW, "--spp", 4096, "--json"]
    coarse = json.loads(mb_trace(*arguments, "--noise", 0.05))
    fine = json.loads(mb_trace(*arguments, "--noise", 0.01))
    assert coarse["noise"] <= 0.05
    assert fine["noise"] <= 0.01
    assert fine["samples_per_pixel"] > coarse["samples_per_pixel"]
    assert fine["tiles_above_noise"] == 0
    # Where the budget ends first it says so.
    short = [*arguments[:-2], 16, "--json", "--noise", 1e-4]
    assert json.loads(mb_trace(*short))["tiles_above_noise"] > 0


def test_the_built_in_room_has_reflectors_to_choose_from(tmp_path: Path) -> None:
    out = tmp_path / "room.exr"
    options = ["--size", "32x24", "--spp", 1, "--indirect", "none", "--json"]
    report = json.loads(mb_trace("layers", "teapot-room", "-o", out, *options))
    names = [r["name"] for r in report["reflectors"]]
    assert "teapot" in names
    assert len(names) > 1
    assert f"{names[0]}.specular_local.A" in read(out)[1]
    report = json.loads(mb_trace("layers", "teapot-room", "-o", out, *options, "--reflector", "teapot"))
    assert [r["name"] for r in report["reflectors"]] == ["teapot"]
    assert "specular_local.A" in read(out)[1]


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (["beauty", "missing.obj", "-o", "OUT"], 3, "missing.obj"),
        (["beauty", "SCENE", "-o", "OUT", "--size", "0x4"], 2, "camera.width"),
        (["beauty", "SCENE", "-o", "OUT", "--size", "wide"], 2, "--size"),
        (["beauty", "SCENE", "-o", "OUT", "--crop", "600x4+0+0"], 2, "window"),
        (["beauty", "SCENE", "-o", "OUT", "--spp", "0"], 2, "--spp"),
        (["beauty", "SCENE", "-o", "OUT", "--noise", "2"], 2, "noise"),
        (["beauty", "SCENE", "-o", "OUT", "--noise", "0"], 2, "noise"),
        (["beauty", "SCENE", "-o", "OUT", "--noise", "nan"], 2, "noise"),
        (["beauty", "SCENE", "-o", "OUT", "--camera", "side"], 2, "--camera"),
        (["layers", "SCENE", "-o", "OUT", "--reflector", "lake"], 2, "mirror"),
        (["layers", "SCENE", "-o", "OUT", "--reflector", "floor"], 2, "specular"),
        (["beauty", "SCENE"], 2, "--output"),
        ([], 2, "subcommand"),
    ],
)
def test_unusable_arguments_end_with_their_status_and_no_file(
    arguments: list[str], status: int, message: str, scene: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out.exr"
    given = [{"SCENE": str(scene), "OUT": str(out)}.get(a, a) for a in arguments]
    assert message in mb_trace(*given, status=status)
    assert not out.exists()


def test_panoramas_that_undershoot_are_taken_as_black_and_said_so(scene: Path, tmp_path: Path) -> None:
    values = np.ones((8, 16, 3), np.float32)
    values[0, :4] = -0.25
    sky = tmp_path / "sky.exr"
    _core.save_image(str(sky), values, ["R", "G", "B"], "float32")
    out = tmp_path / "a.exr"
    program = find_program("mb-trace")
    assert program is not None
    arguments = ["beauty", scene, "-o", out, *VIEW, "--spp", 1, "--sky", sky]
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=True)
    assert f"{sky}: 12 negative values" in done.stderr
    assert out.exists()
    values[0, 0, 0] = np.nan
    _core.save_image(str(sky), values, ["R", "G", "B"], "float32")
    assert "sky.exr" in mb_trace("beauty", scene, "-o", out, *VIEW, "--sky", sky, status=3)


def test_outputs_are_checked_before_tracing(tmp_path: Path) -> None:
    nothing = tmp_path / "none.obj"
    for command in ("beauty", "layers", "capture"):
        for wish in (["-o", tmp_path / "a.doc"], ["-o", tmp_path / "a.exr", "--format", "uint8"]):
            message = mb_trace(command, nothing, *wish, status=3)
            assert "a." in message
            assert "none.obj" not in message
    assert "files" in mb_trace("capture", nothing, "-o", tmp_path / "a_{}.exr", "--layout", "cross", status=2)


def test_numbers_out_of_range_are_wrong_usage(scene: Path, tmp_path: Path) -> None:
    for option, value in (
        ("--spp", 0),
        ("--spp", 65537),
        ("--depth", -1),
        ("--depth", 65),
        ("--seed", -1),
        ("--seed", 2**64),
    ):
        assert option in mb_trace("beauty", scene, "-o", tmp_path / "a.exr", option, value, status=2)
    assert "--crop" in mb_trace("beauty", scene, "-o", tmp_path / "a.exr", "--crop", "0x0+0+0", status=2)
    far = ["--eye", 1e30, 0, 0]
    assert "camera.eye" in mb_trace("beauty", scene, "-o", tmp_path / "a.exr", *far, status=2)
    assert not (tmp_path / "a.exr").exists()

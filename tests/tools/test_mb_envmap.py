"""mb-envmap from the outside: what it prints, what it writes, how it fails."""

import base64
import json
import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from mirrorbake import load_image, save_image
from mirrorbake.envmap import EnvMap
from mirrorbake.prefilter.backgrounds import background, fisheye, perspective, rotation
from mirrorbake.projection import texel_directions
from mirrorbake.tone import displayed
from programs import find_program, needs_program, run_program

pytestmark = needs_program("mb-envmap")


def mb_envmap(*arguments: object, status: int = 0) -> str:
    return run_program("mb-envmap", *arguments, status=status)


@pytest.fixture
def panorama(tmp_path: Path) -> Path:
    path = tmp_path / "panorama.exr"
    values = np.random.default_rng(5).random((32, 64, 3), np.float32)
    EnvMap.from_array(values, "latlong").save(path, format="float32")
    return path


def test_without_the_library_for_other_files_exr_works_and_png_says_what_is_missing(
    panorama: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = find_program("mb-envmap")
    if program is not None and b"__asan_init" in program.read_bytes():
        pytest.skip("programs built with sanitizers search their run path first")
    # A library that cannot be loaded, in a folder that is searched before the run path.
    (tmp_path / "libmirrorbake_openimageio.so").write_text("no library")
    monkeypatch.setenv("LD_LIBRARY_PATH", str(tmp_path))
    mb_envmap("convert", panorama, "--to", "latlong", "--size", 16, "-o", tmp_path / "small.exr")
    png = tmp_path / "small.png"
    message = mb_envmap("convert", panorama, "--to", "latlong", "--size", 16, "-o", png, status=3)
    assert "libmirrorbake_openimageio.so: is needed for TIFF, PNG and JPEG files" in message
    assert "file too short" in message  # the loader's reason
    assert not png.exists()


def test_info_measures_the_map(panorama: Path) -> None:
    info = json.loads(mb_envmap("info", panorama, "--json"))
    assert (info["projection"], info["width"], info["height"], info["channels"]) == (
        "latlong",
        64,
        32,
        ["R", "G", "B"],
    )
    assert info["mean_radiance"] == pytest.approx(EnvMap.load(panorama).flux() / (4 * np.pi))
    assert "latlong" in mb_envmap("info", panorama)


def test_convert_does_what_the_library_does(panorama: Path, tmp_path: Path) -> None:
    out = tmp_path / "cube.exr"
    mb_envmap(
        "convert",
        panorama,
        "--to",
        "cube",
        "--size",
        16,
        "--layout",
        "cross",
        "--format",
        "float32",
        "-o",
        out,
    )
    expected = EnvMap.load(panorama).resample("cube", 16)
    np.testing.assert_array_equal(EnvMap.load(out).values, expected.values)
    mb_envmap(
        "convert",
        panorama,
        "--to",
        "cube",
        "--size",
        "8",
        "-o",
        tmp_path / "face_{}.png",
        "--layout",
        "files",
    )
    assert len(list(tmp_path.glob("face_*.png"))) == 6


def test_turning_moves_what_lay_ahead_to_the_right(tmp_path: Path) -> None:
    values = np.zeros((16, 32, 1), np.float32)
    values[:, 14:18] = 1.0  # around −Z
    EnvMap.from_array(values, "latlong").save(tmp_path / "in.exr")
    mb_envmap(
        "convert",
        tmp_path / "in.exr",
        "--to",
        "latlong",
        "--size",
        16,
        "--turn",
        90,
        "-o",
        tmp_path / "out.exr",
    )
    turned = EnvMap.load(tmp_path / "out.exr")
    assert turned.sample([1.0, 0.0, 0.0])[0] > 0.9
    assert turned.sample([0.0, 0.0, -1.0])[0] < 0.1


def test_turning_about_another_axis_and_exposure(tmp_path: Path) -> None:
    image = np.zeros((64, 128, 1), np.float32)
    image[28:36, 60:68] = 1  # ahead, −Z
    EnvMap.from_array(image, "latlong").save(tmp_path / "in.exr")
    arguments = ("--to", "latlong", "--size", 64, "--turn", 90, "--axis", 2, 0, 0, "--exposure", 3)
    mb_envmap("convert", tmp_path / "in.exr", *arguments, "-o", tmp_path / "out.exr")
    turned = EnvMap.load(tmp_path / "out.exr")
    assert turned.sample([0.0, -1.0, 0.0])[0] == pytest.approx(8, rel=0.05)
    assert turned.sample([0.0, 0.0, -1.0])[0] < 0.1
    nowhere = (*arguments[:6], "--axis", 0, 0, 0, "-o", tmp_path / "no.exr")
    assert "--axis is (0, 0, 0)" in mb_envmap("convert", tmp_path / "in.exr", *nowhere, status=2)


def test_mips_border_and_sample(panorama: Path, tmp_path: Path) -> None:
    mb_envmap("convert", panorama, "--to", "cube", "--size", 16, "-o", tmp_path / "cube.exr")
    mb_envmap("mips", tmp_path / "cube.exr", "-o", tmp_path / "cube.ktx2")
    assert EnvMap.load(tmp_path / "cube.ktx2").levels == 5
    mb_envmap("mips", tmp_path / "cube.exr", "-o", tmp_path / "level{}.exr")
    assert len(list(tmp_path.glob("level*.exr"))) == 5
    mb_envmap("border", tmp_path / "cube.exr", "--width", 2, "-o", tmp_path / "wide.exr")
    line = json.loads(mb_envmap("sample", tmp_path / "cube.ktx2", "--direction", 0, 2, 0, "--json"))
    expected = EnvMap.load(tmp_path / "cube.ktx2").sample([0.0, 2.0, 0.0])
    assert line["value"] == pytest.approx(expected)


def test_samples_over_a_footprint_use_the_levels(panorama: Path, tmp_path: Path) -> None:
    """As EnvMap.sample with the differentials of a square pixel of so many degrees."""
    mb_envmap("convert", panorama, "--to", "cube", "--size", 16, "-o", tmp_path / "cube.exr")
    mb_envmap("mips", tmp_path / "cube.exr", "-o", tmp_path / "cube.ktx2", "--format", "float32")
    levels = EnvMap.load(tmp_path / "cube.ktx2")
    width = 2 * 2 * math.tan(math.radians(10))
    for name in ("trilinear", "ewa"):
        expected = levels.sample([0, 2, 0], filter=name, ddx=[0, 0, -width], ddy=[width, 0, 0])
        for file in ("cube.ktx2", "cube.exr"):  # of one level: the others are made
            arguments = ("--filter", name, "--footprint", 20, "--direction", 0, 2, 0, "--json")
            line = json.loads(mb_envmap("sample", tmp_path / file, *arguments))
            assert line["value"] == pytest.approx(np.ravel(expected).tolist(), rel=2e-3), file
    wrong = ("--filter", "ewa", "--footprint", "nan", "--direction", 0, 2, 0)
    assert "--footprint is nan" in mb_envmap("sample", tmp_path / "cube.exr", *wrong, status=2)
    sharp = json.loads(mb_envmap("sample", tmp_path / "cube.exr", "--direction", 0, 2, 0, "--json"))
    assert line["value"] != pytest.approx(sharp["value"], rel=1e-2)


def test_compare_finds_no_difference_and_a_known_one(panorama: Path, tmp_path: Path) -> None:
    same = json.loads(mb_envmap("compare", panorama, panorama, "--json"))
    assert (same["max_error"], same["psnr"], same["flux_ratio"]) == (0, None, 1)
    brighter = EnvMap.from_array(EnvMap.load(panorama).level() * 2, "latlong")
    brighter.save(tmp_path / "brighter.exr", format="float32")
    found = json.loads(mb_envmap("compare", tmp_path / "brighter.exr", panorama, "--json"))
    assert found["relative_l2"] == pytest.approx(1.0)
    assert found["flux_ratio"] == pytest.approx(2.0)


def test_errors_say_what_is_wrong_and_write_nothing(panorama: Path, tmp_path: Path) -> None:
    before = sorted(tmp_path.iterdir())
    out = tmp_path / "out.exr"
    assert "does not exist" in mb_envmap("info", tmp_path / "none.exr", status=3)
    assert "projection is globe" in mb_envmap("convert", panorama, "--to", "globe", "-o", out, status=2)
    assert "--size is 12y" in mb_envmap(
        "convert", panorama, "--to", "cube", "--size", "12y", "-o", out, status=2
    )
    assert "folder" in mb_envmap(
        "convert", panorama, "--to", "cube", "-o", tmp_path / "no" / "out.exr", status=3
    )
    assert "KTX2" in mb_envmap("convert", panorama, "--to", "latlong", "-o", tmp_path / "a.ktx2", status=2)
    mb_envmap("convert", panorama, "-o", out, status=2)
    mb_envmap(status=2)
    mb_envmap("info", panorama, "--threads", "-1", status=2)
    assert sorted(tmp_path.iterdir()) == before


def test_random_bytes_never_crash_it(panorama: Path, tmp_path: Path) -> None:
    whole = bytearray(panorama.read_bytes())
    rng = np.random.default_rng(7)
    for trial in range(30):
        data = bytearray(rng.bytes(400)) if trial % 3 == 0 else bytearray(whole)
        if trial % 3:
            for position in rng.integers(0, min(len(data), 400), 6):
                data[position] = rng.integers(256)
        path = tmp_path / "broken.exr"
        path.write_bytes(data)
        program = find_program("mb-envmap")
        assert program is not None
        done = subprocess.run([program, "info", path], capture_output=True, timeout=60, check=False)
        assert done.returncode in (0, 3), done.stderr


def test_an_independent_reader_finds_every_level_of_a_ktx2(tmp_path: Path) -> None:
    """Reads the file with ktx-parse, the reader of three.js and glTF-Transform."""
    if shutil.which("node") is None or shutil.which("npm") is None:
        pytest.skip("needs node and npm")
    installed = subprocess.run(
        ["npm", "install", "--silent", "--no-fund", "--no-audit", "--prefix", tmp_path, "ktx-parse@1"],
        capture_output=True,
        timeout=120,
        check=False,
    )
    if installed.returncode != 0:
        pytest.skip("npm cannot install ktx-parse")
    values = np.random.default_rng(6).random((6, 8, 8, 3), np.float32)
    mips = EnvMap.from_array(values, "cube").mips()
    mips.save(tmp_path / "cube.ktx2")
    (tmp_path / "read.mjs").write_text(
        """
        import { readFileSync } from 'node:fs';
        import { read } from 'ktx-parse';
        const k = read(new Uint8Array(readFileSync('cube.ktx2')));
        const d = k.dataFormatDescriptor[0];
        console.log(JSON.stringify({
          format: k.vkFormat, width: k.pixelWidth, height: k.pixelHeight, faces: k.faceCount,
          levels: k.levels.map(l => Buffer.from(l.levelData).toString('base64')),
          transfer: d.transferFunction, samples: d.samples.length, keys: Object.keys(k.keyValue),
          swizzle: k.keyValue.KTXswizzle,
        }));
        """
    )
    done = subprocess.run(
        ["node", "read.mjs"], cwd=tmp_path, capture_output=True, text=True, timeout=60, check=True
    )
    found = json.loads(done.stdout)
    assert (found["format"], found["width"], found["height"], found["faces"]) == (97, 8, 8, 6)
    assert (found["transfer"], found["samples"]) == (1, 4)
    assert found["keys"] == ["KTXorientation", "KTXswizzle", "KTXwriter"]
    assert found["swizzle"].rstrip("\0") == "rgb1"
    assert len(found["levels"]) == 4
    for index, text in enumerate(found["levels"]):
        texels = np.frombuffer(base64.b64decode(text), np.float16).reshape(*mips.level(index).shape[:3], 4)
        np.testing.assert_array_equal(texels[..., :3], mips.level(index).astype(np.float16))
        assert np.all(texels[..., 3] == 1)


def test_a_ktx2_of_three_channels_compares_with_the_map_it_was_made_from(tmp_path: Path) -> None:
    values = np.random.default_rng(3).random((6, 8, 8, 3), np.float32)
    EnvMap.from_array(values, "cube").save(tmp_path / "a.exr", format="float32")
    mb_envmap("convert", tmp_path / "a.exr", "--to", "cube", "-o", tmp_path / "a.ktx2", "--format", "float32")
    assert (
        json.loads(mb_envmap("compare", tmp_path / "a.ktx2", tmp_path / "a.exr", "--json"))["max_error"] == 0
    )
    for status, *wish in ((2, "--layout", "cross"), (3, "--format", "uint8")):
        mb_envmap(
            "convert", tmp_path / "a.exr", "--to", "cube", "-o", tmp_path / "b.ktx2", *wish, status=status
        )
    assert not (tmp_path / "b.ktx2").exists()


def test_maps_that_cannot_be_compared_are_named(panorama: Path, tmp_path: Path) -> None:
    small = tmp_path / "small.exr"
    mb_envmap("convert", panorama, "--to", "latlong", "--size", 8, "-o", small)
    message = mb_envmap("compare", small, panorama, status=3)
    assert f"{small} (latlong, 16 x 8, 3 channels)" in message
    assert f"{panorama} (latlong, 64 x 32, 3 channels)" in message


def test_borders_go_into_any_layout_and_are_reported(tmp_path: Path) -> None:
    values = np.random.default_rng(4).random((6, 8, 8, 3), np.float32)
    cube = EnvMap.from_array(values, "cube")
    cube.save(tmp_path / "a.exr", format="float32")
    wide = cube.with_border(2)
    report = json.loads(
        mb_envmap(
            "border",
            tmp_path / "a.exr",
            "--width",
            2,
            "-o",
            tmp_path / "w_{}.exr",
            "--format",
            "float32",
            "--json",
        )
    )
    assert (report["width"], report["height"]) == (12, 12)
    faces = EnvMap.load(tmp_path / "w_{}.exr").values
    np.testing.assert_array_equal(faces.reshape(wide.shape), wide)
    assert "--output" in mb_envmap("border", tmp_path / "a.exr", "-o", tmp_path / "w.ktx2", status=2)


def test_directions_are_three_numbers_each(panorama: Path) -> None:
    assert "--direction" in mb_envmap("sample", panorama, "--direction", 0, 0, 1, 1, 0, 0, status=2)


def test_output_that_nobody_can_read_is_an_error(panorama: Path) -> None:
    program = find_program("mb-envmap")
    assert program is not None
    with Path("/dev/full").open("w") as full:
        run = subprocess.run(
            [program, "info", str(panorama)], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert run.returncode == 3
    assert "standard output" in run.stderr


def test_outputs_are_checked_before_the_input_is_read(tmp_path: Path) -> None:
    nothing = tmp_path / "none.exr"
    message = mb_envmap("convert", nothing, "--to", "cube", "-o", tmp_path / "a.doc", status=3)
    assert "a.doc" in message
    assert ".ktx2" in message
    assert "none.exr" not in message


def test_rotate_keeps_projection_and_size_and_a_turn_back_restores(tmp_path: Path) -> None:
    d = texel_directions("latlong", 64, 32)
    EnvMap.from_array((2 + d).astype(np.float32), "latlong").save(tmp_path / "in.exr", format="float32")
    axis = ("--axis", 1, 2, 3)
    there, back = tmp_path / "there.exr", tmp_path / "back.exr"
    mb_envmap("rotate", tmp_path / "in.exr", "--turn", 50, *axis, "--exposure", 1, "-o", there)
    turned = EnvMap.load(there)
    assert (turned.projection, turned.level().shape) == ("latlong", (32, 64, 3))
    # What lies on the axis stays, twice as bright.
    on_axis = np.array([1, 2, 3]) / 14**0.5
    np.testing.assert_allclose(turned.sample(on_axis), 2 * (2 + on_axis), atol=0.02)
    mb_envmap("rotate", there, "--turn", -50, *axis, "--exposure", -1, "-o", back)
    # Texels are 0.1 rad wide; two interpolations move the light by less than a third of that.
    np.testing.assert_allclose(EnvMap.load(back).values, (2 + d).ravel(), atol=0.03)


def test_a_fisheye_photograph_of_the_sky_is_brought_to_its_place(tmp_path: Path) -> None:
    # Taken straight up: red in the middle, green at its top, white elsewhere, the horizon on the rim.
    place = (np.arange(64) + 0.5) / 32 - 1
    x, y = np.meshgrid(place, -place)
    photograph = np.ones((64, 64, 3), np.float32)
    photograph[np.hypot(x, y) < 0.2] = [9, 0, 0]
    photograph[y > 0.8] = [0, 9, 0]
    EnvMap.from_array(photograph, "fisheye:180").save(tmp_path / "sky.exr", format="float32")
    upwards = ("--from", "fisheye:180", "--to", "latlong", "--axis", 1, 0, 0, "--turn", -90)
    mb_envmap("convert", tmp_path / "sky.exr", *upwards, "-o", tmp_path / "out.exr")
    directions = np.array([[0, 1, 0], [0, 0.2, 1], [0, 0.2, -1], [0, -1, 0]])
    seen = EnvMap.load(tmp_path / "out.exr").sample(directions)
    np.testing.assert_allclose(seen, [[9, 0, 0], [0, 9, 0], [1, 1, 1], [0, 0, 0]], atol=1e-5)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("--turn", "nan"), "--turn is"),
        (("--turn", 5, "--exposure", "nan"), "nan is not within -20 to 20 stops"),
        (("--turn", 5, "--exposure", 99), "99 is not within -20 to 20 stops"),
        (("--turn", 5, "--exposure", "1x"), "1x is not within -20 to 20 stops"),
        (("--turn", 5, "--exposure", "+-1"), "+-1 is not within -20 to 20 stops"),
    ],
)
def test_turns_and_exposures_that_are_no_numbers_are_refused(
    panorama: Path, tmp_path: Path, arguments: tuple[object, ...], expected: str
) -> None:
    out = tmp_path / "out.exr"
    assert expected in mb_envmap("rotate", panorama, *arguments, "-o", out, status=2)
    assert not out.exists()


def test_backgrounds_are_those_of_the_library(tmp_path: Path) -> None:
    d = texel_directions("latlong", 128, 64)
    source = EnvMap.from_array((2 + np.sin(5 * d)).astype(np.float32), "latlong")
    source.save(tmp_path / "in.exr", format="float32")
    out = tmp_path / "out.exr"
    picture = ("background", tmp_path / "in.exr", "--format", "float32", "-o", out)

    def made(*arguments: object) -> np.ndarray:
        mb_envmap(*picture, *arguments)
        return load_image(str(out))[0]

    still = background(source, perspective(24, 16, 45))
    np.testing.assert_allclose(made("--size", "24x16"), still, atol=1e-6)
    east = rotation([0, 1, 0], -90)
    dome = background(source, fisheye(20), east)
    np.testing.assert_allclose(made("--lens", "fisheye", "--size", 20, "--look", 1, 0, 0), dome, atol=1e-5)
    rolled = background(source, perspective(24, 16, 60), None, rotation([0, 0, 1], 30), steps=4)
    wide = ("--size", "24x16", "--fov", 60)
    np.testing.assert_allclose(made(*wide, "--end-roll", 30, "--steps", 4), rolled, atol=1e-5)
    panned = background(source, perspective(24, 16, 60), None, east)
    np.testing.assert_allclose(made(*wide, "--end-look", 1, 0, 0), panned, atol=1e-5)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("--look", 0, 0, 0), "--look"),
        (("--look", "nan", 0, 0), "--look"),
        (("--end-look", 0, 0, 1), "half a turn"),
        (("--fov", 180), "field_of_view"),
        (("--roll", "inf"), "--roll"),
        (("--steps", 0, "--end-roll", 5), "steps"),
        (("--lens", "perspective", "--fov", -3), "field_of_view"),
        (("--lens", "fisheye", "--fov", 361), "field_of_view"),
    ],
)
def test_cameras_that_there_are_not_are_refused(
    panorama: Path, tmp_path: Path, arguments: tuple[object, ...], expected: str
) -> None:
    out = tmp_path / "out.exr"
    message = mb_envmap("background", panorama, "--size", "8x8", *arguments, "-o", out, status=2)
    assert expected in message
    assert not out.exists()


def test_preview_is_tone_mapped_as_everywhere(tmp_path: Path) -> None:
    values = np.random.default_rng(3).random((16, 32, 3), np.float32) ** 4 * 20
    EnvMap.from_array(values, "latlong").save(tmp_path / "in.exr", format="float32")
    arguments = ("preview", tmp_path / "in.exr", "--size", 16, "--exposure", -1)
    for tone in ("neutral", "none"):
        mb_envmap(*arguments, "--tone-map", tone, "-o", tmp_path / "out.png")
        expected = np.clip(displayed(values, -1.0, tone), 0, 1)
        # Steps of 1/255 in sRGB are at most 0.009 of linear light.
        shown = EnvMap.load(tmp_path / "out.png").level()
        np.testing.assert_allclose(shown, expected, atol=0.006)


def test_mips_go_through_dds(tmp_path: Path) -> None:
    d = np.stack([texel_directions("cube", 16, 16, face) for face in range(6)])
    source = EnvMap.from_array((2 + d).astype(np.float32), "cube")
    source.save(tmp_path / "in.exr", format="float32")
    mb_envmap("mips", tmp_path / "in.exr", "--format", "float32", "-o", tmp_path / "out.dds")
    again = EnvMap.load(tmp_path / "out.dds")
    assert again.levels == 5
    np.testing.assert_array_equal(again.values, source.mips().values)


def test_values_that_are_not_finite_are_counted_and_repaired(tmp_path: Path) -> None:
    values = np.full((8, 16, 3), 2.0, np.float32)
    values[3, 4, 1], values[0, 15], values[5, 5, 2] = np.nan, np.inf, -np.inf
    path = tmp_path / "holes.exr"
    EnvMap.from_array(values, "latlong").save(path, format="float32")
    assert json.loads(mb_envmap("info", path, "--json"))["not_finite"] == 5
    cube = tmp_path / "cube.exr"
    convert = ("convert", path, "--to", "cube", "--size", 4, "-o", cube)
    mb_envmap(*convert, "--repair")
    np.testing.assert_allclose(np.asarray(EnvMap.load(cube)), 2.0, rtol=1e-3)
    assert "expected none; --repair fills them" in mb_envmap(
        "prefilter", path, "--model", "irradiance", "-o", cube, status=3
    )
    with pytest.warns(UserWarning, match="5 values are NaN or infinite; repair=True fills them"):
        EnvMap.load(path)
    np.testing.assert_array_equal(EnvMap.load(path, repair=True).level(), 2.0)


def test_a_layer_is_chosen_by_name(tmp_path: Path) -> None:
    path = tmp_path / "layers.exr"
    names = [f"{layer}.{colour}" for layer in ("sky", "sun") for colour in "RGB"]
    save_image(path, np.tile(np.arange(1, 7, dtype=np.float32), (2, 4, 1)), names)
    info = json.loads(mb_envmap("info", path, "--layer", "sun", "--json"))
    assert (info["channels"], info["max"]) == (["R", "G", "B"], [4, 5, 6])
    assert EnvMap.load(path, layer="sky").level().max(axis=(0, 1)).tolist() == [1, 2, 3]
    assert "has no layer 'moon', expected one of sky, sun" in mb_envmap(
        "info", path, "--layer", "moon", status=3
    )
    assert "has no part '2'" in mb_envmap("info", path, "--part", "2", status=3)

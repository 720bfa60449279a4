"""mb-envmap prefilter from the outside."""

import json
from pathlib import Path

import numpy as np
import pytest

from mirrorbake.envmap import EnvMap
from mirrorbake.prefilter import (
    Harmonics,
    ggx,
    ggx_chain,
    irradiance,
    phong,
    prefilter,
    split_sum_table,
    table,
)
from programs import needs_program, run_program

pytestmark = needs_program("mb-envmap")


def run(source: Path, *arguments: object, status: int = 0) -> str:
    return run_program("mb-envmap", "prefilter", source, *arguments, status=status)


@pytest.fixture
def panorama(tmp_path: Path) -> Path:
    path = tmp_path / "panorama.exr"
    values = np.random.default_rng(5).random((32, 64, 3), np.float32)
    values[5, 9] = 1e4
    EnvMap.from_array(values, "latlong").save(path, format="float32")
    return path


def test_models_are_those_of_the_library(panorama: Path, tmp_path: Path) -> None:
    source = EnvMap.load(panorama)
    out = tmp_path / "out.exr"
    (tmp_path / "lobe.txt").write_text("1, 0.5\n0.25 0")
    expected = {
        ("irradiance",): irradiance(source, 8),
        ("irradiance", "--scale", "mean"): prefilter(source, phong(1), 8),
        ("phong", "--exponent", 40): prefilter(source, phong(40), 8),
        ("phong", "--exponent", 40, "--scale", "sum"): prefilter(source, phong(40), 8, scale="sum"),
        ("ggx", "--alpha", 0.3): prefilter(source, ggx(0.3), 8),
        ("table", "--table", tmp_path / "lobe.txt", "--table-angle", 60): prefilter(
            source, table([1, 0.5, 0.25, 0], 60), 8
        ),
    }
    for arguments, result in expected.items():
        run(panorama, "--size", 8, "-o", out, "--format", "float32", "--model", *arguments)
        np.testing.assert_array_equal(EnvMap.load(out).values, result.values)


def test_chain_goes_to_one_ktx2_or_an_image_for_each_level(panorama: Path, tmp_path: Path) -> None:
    chain = ggx_chain(EnvMap.load(panorama), 16, 3)
    arguments = ("--model", "ggx", "--size", 16, "--levels", 3, "--format", "float32")
    run(panorama, *arguments, "-o", tmp_path / "chain.ktx2", "--split-sum", tmp_path / "table.exr")
    loaded = EnvMap.load(tmp_path / "chain.ktx2")
    np.testing.assert_array_equal(loaded.values, chain.values)
    run(panorama, *arguments, "-o", tmp_path / "level{}.exr")
    np.testing.assert_array_equal(EnvMap.load(tmp_path / "level2.exr").level(), chain.level(2))
    sums = EnvMap.load(tmp_path / "table.exr", "angular").level()
    np.testing.assert_allclose(sums, split_sum_table(128), atol=5e-4)  # half precision


def test_harmonics_are_written_as_json_coefficients_and_map(panorama: Path, tmp_path: Path) -> None:
    light = Harmonics.project(EnvMap.load(panorama), 3)
    run(panorama, "--model", "sh", "--order", 3, "-o", tmp_path / "sh.json")
    text = (tmp_path / "sh.json").read_text()
    np.testing.assert_array_equal(Harmonics.from_json(text).coefficients, light.coefficients)
    constants = json.loads(text)["shader_constants"]
    np.testing.assert_allclose(constants, light.shader_constants())
    row = tmp_path / "row.exr"
    run(panorama, "--model", "sh", "--order", 3, "--coefficients", "-o", row, "--format", "float32")
    np.testing.assert_allclose(EnvMap.load(row, "latlong").level()[0], light.coefficients, rtol=1e-6)
    image = tmp_path / "image.exr"
    run(panorama, "--model", "sh", "--size", 8, "--window", "sloan", "-o", image, "--format", "float32")
    expected = Harmonics.project(EnvMap.load(panorama)).irradiance().windowed("sloan").evaluate(8)
    np.testing.assert_allclose(EnvMap.load(image).values, expected.values, rtol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--model", "phong", "--exponent", 0.5), "exponent is 0.5"),
        (("--model", "ggx", "--alpha", 3), "alpha is 3"),
        (("--model", "ggx"), "{} for the number of the level"),
        (("--model", "ggx", "--to", "latlong"), "--to is latlong"),
        (("--model", "table"), "--table is missing"),
        (("--model", "sh", "--order", 9), "order is 9"),
        (("--model", "sh", "--window", "box"), "window is box"),
    ],
)
def test_bad_options_are_named(
    panorama: Path, tmp_path: Path, arguments: tuple[object, ...], message: str
) -> None:
    assert message in run(panorama, *arguments, "-o", tmp_path / "out.exr", status=2)
    assert not (tmp_path / "out.exr").exists()


def test_a_table_of_words_is_a_file_error(panorama: Path, tmp_path: Path) -> None:
    (tmp_path / "lobe.txt").write_text("1 half")
    arguments = ("--model", "table", "--table", tmp_path / "lobe.txt", "-o", tmp_path / "out.exr")
    assert "number 2 is not one" in run(panorama, *arguments, status=3)


def test_progress_goes_to_stderr_and_figures_to_stdout(panorama: Path, tmp_path: Path) -> None:
    printed = run(panorama, "--model", "ggx", "--size", 8, "-o", tmp_path / "c.ktx2", "--json")
    assert json.loads(printed)["levels"] == 2


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("irradiance", "--levels", 3), "--levels is given with --model irradiance, expected --model ggx"),
        (("ggx", "--exponent", 3), "--exponent is given with --model ggx, expected --model phong"),
        (("phong", "--coefficients"), "--coefficients is given with --model phong, expected --model sh"),
        (("sh", "--scale", "sum"), "--scale is given with --model sh"),
        (("ggx", "--scale", "sum"), "--scale is given for a chain, expected --alpha for one lobe"),
        (("ggx", "--alpha", 0.5, "--levels", 2), "--levels is given with --alpha, expected one of them"),
        (("ggx", "--alpha", 0.5, "--linear-roughness"), "--linear-roughness is given with --alpha"),
        (("sh", "--coefficients"), "--size is given for coefficients, expected a map of irradiance"),
        (("ggx", "--alpha", -0.5), "alpha is -0.5, expected 0.01 to 1"),
        (("ggx", "--alpha", "nan"), "alpha is nan, expected 0.01 to 1"),
    ],
)
def test_options_of_other_models_and_out_of_range_are_refused(
    panorama: Path, tmp_path: Path, arguments: tuple[object, ...], expected: str
) -> None:
    out = tmp_path / "out.exr"
    assert expected in run(panorama, "--size", 8, "-o", out, "--model", *arguments, status=2)
    assert not out.exists()


def test_files_that_are_no_good_are_named_before_the_work(panorama: Path, tmp_path: Path) -> None:
    chain = ("--model", "ggx", "--size", 16, "-o", tmp_path / "chain.dds")
    message = run(panorama, *chain, "--split-sum", tmp_path / "none" / "table.exr", status=3)
    assert "none does not exist" in message
    assert "level" not in message
    values = np.ones((16, 32, 3), np.float32)
    values[3, 4] = np.nan
    EnvMap.from_array(values, "latlong").save(tmp_path / "nan.exr", format="float32")
    assert "nan.exr: has 3 NaN or infinite values" in run(tmp_path / "nan.exr", *chain, status=3)


def test_chain_goes_to_dds_as_half_floats(panorama: Path, tmp_path: Path) -> None:
    run(panorama, "--model", "ggx", "--size", 16, "--levels", 3, "-o", tmp_path / "chain.dds")
    loaded = EnvMap.load(tmp_path / "chain.dds")
    expected = ggx_chain(EnvMap.load(panorama), 16, 3)
    np.testing.assert_allclose(loaded.values, expected.values, rtol=2**-11)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("--coefficients",), "--coefficients is given for a .json file, expected an image"),
        (("--format", "half"), "--format is given for a .json file"),
        (("--keep-negative",), "--keep-negative is given for coefficients"),
        (("--to", "latlong"), "--to is given for coefficients"),
    ],
)
def test_options_of_images_are_refused_for_json(
    panorama: Path, tmp_path: Path, arguments: tuple[object, ...], expected: str
) -> None:
    out = tmp_path / "out.json"
    assert expected in run(panorama, "--model", "sh", "-o", out, *arguments, status=2)
    assert not out.exists()

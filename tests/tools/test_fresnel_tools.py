"""`mirrorbake study fresnel` and `mb-fresnel` as a user meets them."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from mirrorbake import _core, fresnel
from programs import find_program

ROOT = Path(__file__).parents[2]


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=300, check=False)


def study(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return run(sys.executable, "-m", "mirrorbake", "study", "fresnel", *arguments)


@pytest.fixture(scope="module")
def tool() -> str:
    program = find_program("mb-fresnel")
    if program is None:
        pytest.skip("mb-fresnel is not built")
    return str(program)


def test_study_keeps_its_promises_and_draws_them(tmp_path: Path) -> None:
    result = study("--json", "--samples", "24", "--out", tmp_path)
    assert result.returncode == 0, result.stderr
    figures = json.loads(result.stdout)
    for curve in figures["rounding"]:
        assert 0 < curve["share_of_allowance"] <= 1, curve["material"]
    glass = next(row for row in figures["approximations"] if row["material"] == "n = 1.5")
    # Schlick with r0 = 0.04 is off by 0.02 to 0.03 at most for glass (Schlick 1994, figure 3).
    assert 0.01 < glass["schlick_error"] < 0.04
    assert 0 < glass["table_error"] <= figures["max_error"]
    assert {metal["metal"] for metal in figures["metals"]} == set(fresnel.metal_names())
    assert len(list(tmp_path.glob("fresnel-*.png"))) == 3


def test_study_prints_tables_and_rejects_nonsense() -> None:
    result = study("--samples", "10")
    assert result.returncode == 0, result.stderr
    assert "n = 200" in result.stdout
    wrong = study("--samples", "10", "--max-error", "0")
    assert wrong.returncode == 2
    assert "max_error is 0" in wrong.stderr


def test_tool_plots_curves_over_the_angle(tool: str, tmp_path: Path) -> None:
    """Points of the curves, read back from the picture, are the functions' values."""
    path = tmp_path / "glass.svg"
    assert run(tool, "plot", "--ior", "1.5", "-o", path).returncode == 0
    root = ElementTree.parse(path).getroot()
    curves = root.findall("{http://www.w3.org/2000/svg}polyline")
    degrees = np.arange(361) / 4
    cosines = np.cos(np.radians(degrees))
    assert len(curves) == 2
    for curve, expected in zip(
        curves, (fresnel.dielectric(cosines, 1.5), fresnel.schlick(cosines, 0.04)), strict=True
    ):
        x, y = np.array([point.split(",") for point in curve.attrib["points"].split()], float).T
        reflectance = 1 - (y - y[-1]) / 360.0  # the curves end at 1, with 360 pixels from 0 to 1
        np.testing.assert_allclose(reflectance, expected, atol=1e-4)
        np.testing.assert_allclose(np.diff(x), np.diff(x)[0], atol=0.02)
    gold = run(tool, "plot", "--model", "metal", "--metal", "Au")
    assert gold.stdout.count("<polyline") == 6
    wrong = run(tool, "plot", "--ior", "-1", "-o", tmp_path / "wrong.svg")
    assert wrong.returncode == 2
    assert not (tmp_path / "wrong.svg").exists()


def test_tool_prints_the_table_as_csv(tool: str) -> None:
    result = run(tool, "table", "--ior", "1.33", "--size", "17")
    assert result.returncode == 0, result.stderr
    rows = np.array([[float(x) for x in line.split(",")] for line in result.stdout.splitlines()[1:]])
    assert rows.shape == (17, 2)
    np.testing.assert_allclose(rows[:, 1], fresnel.dielectric(rows[:, 0], float(np.float32(1.33))), atol=1e-7)


def test_tool_writes_a_metal_as_exr(tool: str, tmp_path: Path) -> None:
    path = tmp_path / "gold.exr"
    result = run(tool, "table", "--model", "metal", "--metal", "Au", "--max-error", "1e-3", "--output", path)
    assert result.returncode == 0, result.stderr
    pixels = np.asarray(_core.load_image(str(path))[0])
    expected = np.clip(fresnel.metal_reflectance("gold", np.linspace(0, 1, pixels.shape[1])), 0, 1)
    np.testing.assert_allclose(pixels[0], expected, atol=1e-6)


def test_tool_reports_errors_and_metals_as_json(tool: str) -> None:
    report = json.loads(run(tool, "report", "--json", "--max-error", "1e-2").stdout)
    assert len(report["rows"]) == 18
    for row in report["rows"]:
        assert row["exact_error"] < 4e-7
        # The table's own search for its largest error is coarser than the report's: where total reflection
        # sets in, with a vertical tangent, that finds 0.13 % more.
        assert row["table_size"] is None or row["table_error"] <= 1.002e-2
    metal = json.loads(run(tool, "metal", "Cu", "--json").stdout)
    np.testing.assert_allclose(metal["normal_incidence"], fresnel.metal_colour("copper").normal, rtol=1e-5)


@pytest.mark.parametrize(
    ("arguments", "status", "message"),
    [
        (["table", "--model", "phong"], 2, "phong"),
        (["table", "--ior", "-1"], 2, "ior is -1"),
        (["table", "--max-error", "0"], 2, "max_error is 0"),
        (["metal", "mithril"], 2, "metal is mithril"),
        (["table", "--ior", "0.66", "--max-error", "1e-5"], 4, "65536"),
        (["table", "--output", "/nonexistent/table.exr"], 3, "/nonexistent/table.exr"),
        ([], 2, "subcommand"),
    ],
)
def test_tool_answers_nonsense_with_one_error(
    tool: str, arguments: list[str], status: int, message: str
) -> None:
    result = run(tool, *arguments)
    assert result.returncode == status
    assert message in result.stderr
    assert result.stdout == ""

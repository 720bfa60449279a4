"""How far a PEM's lead reaches: the study, on scenes that take a moment."""

from __future__ import annotations

import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from mirrorbake.scene.load import parse_config, parse_override
from mirrorbake.study.reach import BEYOND, INSIDE, measured, scene_of_mesh

if TYPE_CHECKING:
    from pathlib import Path

SMALL: dict[str, Any] = {
    "reflector": {"object": "teapot", "subdivisions": 6, "parts": "split"},
    "maps": {"size": 16, "distant": "box"},
    "layers": {"local": False},
    "trace": {"samples": 16, "noise": 0, "depth": 0, "indirect": "none"},
    "auto": {"quality": "draft"},
}


def test_an_arc_is_looked_at_between_its_samples_and_beyond(tmp_path: Path) -> None:
    views = {"count": 2, "degrees": 1.0, "start": 22.0, "size": [48, 36]}
    config = parse_config({**SMALL, "views": views, "static": {"views": 6}}, "arc")
    reach = measured(config, tmp_path / "pem")
    looks = reach.looks
    assert [look.place for look in looks] == [
        "on",
        "half-way",
        *(f"{degrees:g}° off" for degrees in BEYOND),
    ]
    assert all(look.pem > look.captured + 3.0 for look in looks[:2])
    assert looks[0].pem > looks[-1].pem
    # A draft's plan tries nothing.
    assert reach.foretold is None
    assert reach.least_above_static_set is not None
    least, place = reach.least_above_static_set
    assert least == min(look.pem - look.static_set for look in looks if look.static_set is not None)
    assert place in [look.place for look in looks]
    assert all(look.static_set is not None for look in looks)
    # Far off the samples little but the static set is drawn.
    assert looks[-1].pem == pytest.approx(looks[-1].static_set, abs=1.5)


def test_a_dome_is_looked_at_inside(tmp_path: Path) -> None:
    views = {
        "kind": "dome",
        "start": 15,
        "degrees": 10,
        "count": 2,
        "elevation": [15, 25],
        "rings": 2,
        "size": [48, 36],
    }
    reach = measured(parse_config({**SMALL, "views": views}, "dome"), tmp_path / "pem")
    looks = reach.looks
    assert reach.least_above_static_set is None
    assert [look.place for look in looks] == ["inside"] * INSIDE
    assert all(look.static_set is None for look in looks)
    assert all(look.noise > 10.0 for look in looks)


def test_a_mesh_has_a_scene_of_its_own(tmp_path: Path) -> None:
    overrides = [parse_override("static.views=0")]
    silver = scene_of_mesh(str(tmp_path / "a.obj"), str(tmp_path / "sky.exr"), overrides)
    assert silver.material is not None
    assert silver.material.metal == "silver"
    assert silver.surroundings.ground is not None
    assert (silver.views.count, silver.views.degrees, silver.maps.size) == (3, 2.0, 64)
    assert silver.static.views == 0
    as_filed = scene_of_mesh(str(tmp_path / "a.glb"))
    assert as_filed.material is None
    assert as_filed.surroundings.panorama is None
    assert as_filed.static.views == 24


@pytest.mark.parametrize(
    ("module", "arguments", "status", "words"),
    [
        ("reach", ["missing.toml"], 3, "missing.toml: No such file"),
        ("reach", ["missing.toml", "--set", "nonsense"], 2, "nonsense"),
        ("reach", [], 2, "expected SCENE.toml or --mesh FILE"),
        ("noise", ["--object", "missing.obj"], 3, "missing.obj"),
        ("noise", ["--bias", "--object", "missing.obj"], 2, "--bias is measured of the teapot"),
    ],
)
def test_bad_input_of_a_measurement_is_one_line(
    module: str, arguments: list[str], status: int, words: str
) -> None:
    program = f"mirrorbake.study.{module}"
    ended = subprocess.run([sys.executable, "-m", program, *arguments], capture_output=True, text=True)
    assert ended.returncode == status
    assert words in ended.stderr.splitlines()[-1]
    assert "Traceback" not in ended.stderr

"""The trade of a scene's qualities, on a scene that takes a moment."""

from __future__ import annotations

import json
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

from mirrorbake.bake.quality import QUALITIES
from mirrorbake.errors import OptionError
from mirrorbake.scene.load import parse_config
from mirrorbake.study.middle import in_the_middle
from mirrorbake.study.quality import PLACES, study

if TYPE_CHECKING:
    from pathlib import Path

SCENE: dict[str, Any] = {
    "reflector": {"object": "teapot", "subdivisions": 4, "parts": "split"},
    "views": {"count": 9, "degrees": 8.0, "start": 20.0, "size": [48, 36]},
    "layers": {"local": False, "diffuse": False},
    "maps": {"size": 16, "distant": "box"},
    "trace": {"samples": 4, "depth": 0, "indirect": "none", "most_samples": 8},
    "static": {"views": 4},
    "infer": {"smoothness": 1e-3},
}


def test_qualities_of_a_scene_are_baked_and_looked_at(tmp_path: Path) -> None:
    results = study(parse_config(SCENE, "scene"), tmp_path, views=2)
    assert [result.quality for result in results] == list(QUALITIES)
    for result in results:
        assert list(result.psnr) == list(result.ceiling) == list(PLACES)
        known = {place: value for place, value in result.psnr.items() if value is not None}
        # Away from the samples, where the error is large, noise never hides it.
        assert {"off_5", "above_10"} <= known.keys()
        assert all(5.0 < value < result.ceiling[place] for place, value in known.items())
        assert result.static_set is not None
        assert result.further_view_s is not None
        assert min(result.preparation_s, result.first_view_s, result.further_view_s) > 0.0
        # An interpreter with NumPy alone takes more than 2^25.
        assert 2**25 < result.peak_bytes < 2**33
        assert result.sample_bytes > 16 * 16 * 6


def test_views_are_taken_from_the_middle_of_the_arc() -> None:
    config = parse_config(SCENE, "scene")
    views = in_the_middle(config, 3).views
    assert (views.count, views.start, views.degrees) == (3, 23.0, 2.0)
    assert in_the_middle(config, 1).views.start == 24.0
    assert in_the_middle(config, 9) is config
    fixed = parse_config({**SCENE, "views": {"kind": "fixed", "size": [48, 36]}}, "fixed")
    assert in_the_middle(fixed, 3) is fixed


def test_an_unknown_quality_is_named(tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="--qualities best: expected some of draft, normal, high"):
        study(parse_config(SCENE, "scene"), tmp_path, ["best"])


def test_the_command_prints_figures_of_one_view_without_a_static_set(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[reflector]\nobject = "teapot"\nsubdivisions = 4\n[views]\nkind = "fixed"\n'
        '[trace]\nsamples = 4\ndepth = 0\nindirect = "none"\n'
        "[layers]\nlocal = false\n[infer]\nsmoothness = 1e-3\n"
    )
    command = [sys.executable, "-m", "mirrorbake", "study", "quality", str(scene), "--size", "48x36"]
    command += ["--em-size", "16", "--qualities", "draft", "--json"]
    (result,) = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert result["quality"] == "draft"
    assert result["static_set"] is None
    assert result["further_view_s"] is None
    assert "between" not in result["psnr"]
    table = subprocess.run(command[:-1], capture_output=True, text=True, check=True).stdout
    assert "draft" in table

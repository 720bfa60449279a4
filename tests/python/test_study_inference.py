"""The study of inference: its order of better and worse, on a small picture."""

from __future__ import annotations

from pathlib import Path

import pytest

from mirrorbake import _core
from mirrorbake.scene.load import load_config, parse_override
from mirrorbake.scene.stage import prepare_stage
from mirrorbake.study import inference

EXAMPLE = Path(__file__).parents[2] / "examples" / "teapot-room.toml"


@pytest.fixture(scope="module")
def results() -> dict[str, inference.Result]:
    overrides = [parse_override("views.size=[48,48]"), parse_override("reflector.subdivisions=6")]
    stage = prepare_stage(load_config(EXAMPLE, overrides))
    lab = inference.Lab(stage, (22.0, 20.0), samples=32, reference_samples=64, map_size=32)
    options = _core.DisplayFitOptions(solve=_core.SolveOptions(max_iterations=60))
    found = inference.study(lab, ["Web"], options)
    return {result.fit: result for result in found}


def test_maps_of_a_view_beat_the_static_set_on_it(results: dict[str, inference.Result]) -> None:
    assert set(results) == set(inference.FITS)
    assert results["one view"].decibels["on"] > results["static set"].decibels["on"] + 2.0


def test_a_static_set_does_not_know_where_it_is_seen_from(results: dict[str, inference.Result]) -> None:
    decibels = results["static set"].decibels.values()
    assert max(decibels) - min(decibels) < 2.0


def test_neighbours_help_between_the_samples(results: dict[str, inference.Result]) -> None:
    alone = results["one view"].decibels
    joint = results["with neighbours"].decibels
    assert joint["+2°"] > alone["+2°"]

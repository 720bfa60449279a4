"""The spacing of maps: the law that trials measure, and what is chosen by it."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any, cast

import pytest

from mirrorbake.bake.analyze import analyze
from mirrorbake.bake.bake import bake
from mirrorbake.bake.spacing import Option, Wanted, chosen, options_of
from mirrorbake.bake.spacing_trial import CameraAxis, CellTrial, camera_axes
from mirrorbake.errors import InputError, OptionError
from mirrorbake.evaluate.report.page import law_section
from mirrorbake.pem.opened import open_pem
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.plan import Plan
from mirrorbake.scene.spacing_law import SpacingLaw, SpacingTrial, falling
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

SMALL: dict[str, Any] = {
    "reflector": {"object": "teapot", "subdivisions": 6, "parts": "joined"},
    "views": {"count": "auto", "degrees": 12.0, "start": 22.0, "size": [40, 30]},
    "maps": {"size": 16, "distant": "box"},
    "layers": {"local": False, "diffuse": False},
    "trace": {"samples": 8, "noise": 0, "depth": 1, "indirect": "none"},
    "static": {"views": 0},
    "auto": {"decibels": 17.6},
}


def scene(views: dict[str, Any] | None = None, auto: dict[str, Any] | None = None) -> dict[str, Any]:
    return {
        **SMALL,
        "views": {**SMALL["views"], **(views or {})},
        "auto": {**SMALL["auto"], **(auto or {})},
    }


def trial(degrees: float, decibels: float, traced: int = 0) -> CellTrial:
    return CellTrial(SpacingTrial(degrees, traced, decibels), 1.0, 0.5, 1e6, 0)


# 40 - 2 log2(h), and a decibel for each time the views in a cell double.
TRIALS = [trial(2.0, 38.0), trial(4.0, 36.0, 1), trial(16.0, 32.0, 1), trial(16.0, 33.0, 3)]
ARC = [CameraAxis("count", 30.0, closed=False, nodes=None)]
DOME = [
    CameraAxis("count", 360.0, closed=True, nodes=None),
    CameraAxis("rings", 40.0, closed=False, nodes=None),
]


def choices(axes: Sequence[CameraAxis] = ARC, changes: int = 1) -> list[Option]:
    return options_of(axes, TRIALS, SpacingLaw(tuple(one.found for one in TRIALS)), changes)


def test_a_law_that_is_a_line_comes_back_from_its_trials() -> None:
    law = SpacingLaw(tuple(one.found for one in TRIALS))
    assert law.slope == pytest.approx(2.0)
    assert law.gain == pytest.approx(1.0)
    for degrees in (1.0, 3.0, 8.0, 32.0):
        wanted = {1.0: 40.0, 3.0: 36.830075, 8.0: 34.0, 32.0: 30.0}[degrees]
        assert law.decibels(degrees) == pytest.approx(wanted)
    assert law.decibels(16.0, 7) == pytest.approx(34.0)
    assert SpacingLaw.from_dict(law.to_dict()) == law


def test_a_law_never_rises_with_the_spacing_whatever_the_trials_say() -> None:
    trials = (SpacingTrial(2.0, 0, 30.0), SpacingTrial(6.0, 1, 31.0), SpacingTrial(18.0, 1, 30.5))
    law = SpacingLaw(trials)
    values = [law.decibels(0.5 * 1.2**step) for step in range(30)]
    assert all(b <= a + 1e-9 for a, b in itertools.pairwise(values))
    assert falling([1.0, 2.0, 3.0]) == [2.0, 2.0, 2.0]


def test_a_tighter_error_never_lets_maps_be_further_apart() -> None:
    for axes in (ARC, DOME):
        options = choices(axes)
        for budgets in ((None, None), (40.0, None), (None, 2.0), (60.0, 8.0)):
            most = max(option.decibels for option in options) if budgets == (None, None) else 45.0
            wanted = [Wanted(25.0 + 0.5 * k, *budgets) for k in range(40) if 25.0 + 0.5 * k <= most]
            found = [chosen(options, one)[0].degrees for one in wanted]
            assert all(b <= a for a, b in itertools.pairwise(found))


def test_the_widest_that_meets_what_is_wanted_is_taken_with_the_fewest_views() -> None:
    option, warning = chosen(choices(), Wanted(33.0, None, None))
    assert warning is None
    assert option.decibels >= 33.0
    wider = [other for other in choices() if other.degrees > option.degrees]
    assert wider
    assert all(other.decibels < 33.0 for other in wider)
    fewer = [o for o in choices() if o.degrees == option.degrees and o.traced < option.traced]
    assert all(other.decibels < 33.0 for other in fewer)


def test_nodes_are_no_further_apart_than_the_option_says() -> None:
    for axes in (ARC, DOME):
        for option in choices(axes):
            for axis, nodes in zip(axes, option.nodes, strict=True):
                assert axis.spacing(nodes) <= option.degrees * (1.0 + 1e-9)


@pytest.mark.parametrize(
    ("wanted", "binds"),
    [
        (Wanted(37.0, 4.0, None), "auto.megabytes = 4 binds"),
        (Wanted(37.0, None, 0.2), "auto.minutes = 0.2 binds"),
        (Wanted(37.0, 4.0, 0.2), "auto.megabytes = 4 and auto.minutes = 0.2 bind"),
    ],
)
def test_the_budget_that_binds_is_named_and_kept(wanted: Wanted, binds: str) -> None:
    option, warning = chosen(choices(), wanted)
    assert not wanted.over(option)
    assert warning is not None
    assert binds in warning
    assert "auto.decibels = 37 needs maps" in warning
    assert f"apart reach {option.decibels:.1f} dB" in warning
    affordable = [other for other in choices() if not wanted.over(other)]
    assert option.decibels == max(other.decibels for other in affordable)
    assert "\n" not in warning


def test_a_budget_that_nothing_keeps_is_said_to() -> None:
    option, warning = chosen(choices(), Wanted(30.0, 0.1, None))
    assert option.nodes == choices()[0].nodes
    assert warning is not None
    assert "auto.megabytes = 0.1 binds" in warning


def test_what_no_spacing_meets_needs_a_budget_to_end_at() -> None:
    best = max(other.decibels for other in choices())
    with pytest.raises(InputError, match=rf"auto.decibels = 60: no maps meet it, .* with {best:.1f} dB"):
        chosen(choices(), Wanted(60.0, None, None))
    option, warning = chosen(choices(), Wanted(60.0, 10.0, None))
    assert warning is not None
    assert "auto.decibels = 60 is out of reach" in warning
    assert "auto.megabytes = 10 binds" in warning
    assert option.bytes <= 10e6


def test_scenes_that_change_take_as_many_times_the_bytes() -> None:
    assert choices(changes=5)[0].bytes == 5 * choices()[0].bytes


def test_the_axes_of_arcs_and_domes() -> None:
    arc = camera_axes(parse_config(scene({"degrees": -30.0}), "arc"))
    assert [(axis.extent, axis.closed, axis.nodes) for axis in arc] == [(30.0, False, None)]
    views = {"kind": "dome", "degrees": 360.0, "rings": 4, "elevation": [10, 40]}
    dome = camera_axes(parse_config(scene(views), "dome"))
    assert [axis.spacing(axis.nodes_for(10.0)) for axis in dome] == [10.0, 10.0]
    assert [axis.nodes_for(9.0) for axis in dome] == [40, 4]


@pytest.mark.parametrize(
    ("views", "auto", "words"),
    [
        ({"count": "many"}, {}, "views.count = 'many'"),
        ({"kind": "none", "degrees": 360.0}, {}, "`count` = 'auto' has no meaning for kind = 'none'"),
        ({"kind": "fixed"}, {}, "has no meaning for kind = 'fixed'"),
        ({"rings": "auto"}, {}, "`rings` has no meaning for kind = 'arc'"),
        ({"degrees": 0.0}, {}, "needs views.degrees other than 0"),
        ({}, {"decibels": 0.0}, "auto.decibels = 0"),
        ({}, {"megabytes": -1.0}, "auto.megabytes = -1"),
        ({}, {"minutes": 0.0}, "auto.minutes = 0"),
        ({"count": 3}, {"minutes": 5.0}, "auto.minutes = 5: has no meaning unless"),
    ],
)
def test_bad_values_name_their_key_in_one_line(
    views: dict[str, Any], auto: dict[str, Any], words: str
) -> None:
    data = scene(views, auto)
    if views.get("kind") == "fixed":
        del data["views"]["degrees"]
    if views.get("count") == 3:
        del data["auto"]["decibels"]
    with pytest.raises(InputError) as failure:
        parse_config(data, "bad")
    assert words in str(failure.value)
    assert "\n" not in str(failure.value)


def test_maps_of_layers_cannot_be_spaced() -> None:
    with pytest.raises(InputError, match=r'views.count = "auto" needs infer.fit = "display"'):
        parse_config({**scene(), "infer": {"fit": "layers"}}, "bad")


def test_a_plan_spaces_the_maps_of_an_arc_and_its_bake_keeps_the_law(tmp_path: Path) -> None:
    config = parse_config(scene(), "arc")
    stage = prepare_stage(config)
    plan = analyze(stage)
    assert plan.law is not None
    assert [one.degrees for one in plan.law.trials[:3]] == pytest.approx([12 / 9, 4.0, 12.0])
    count = cast("int", plan.value("views.count"))
    assert len(stage.planned(plan).space) == count
    assert Plan.from_dict(plan.to_dict()) == plan
    assert f"# {plan.law}" in plan.lines()
    # The same plan again: nothing of the clock is in it.
    assert analyze(prepare_stage(config)) == plan

    with pytest.raises(OptionError, match=f"sample 999: expected 0 to {count - 1}"):
        bake(config, tmp_path / "none", stage=stage, samples=[999])
    bake(config, tmp_path / "pem", stage=stage)
    pem = open_pem(tmp_path / "pem")
    assert len(pem.space) == count
    assert pem.store.header.plan.law == plan.law
    assert pem.stage.space == pem.space
    section = law_section(pem.store)
    assert f"{plan.law.trials[0].decibels:.1f}" in section
    # Gone on with, it has what it had.
    assert bake(config, tmp_path / "pem", stage=stage).resumed == count


def test_a_plan_spaces_a_dome_within_its_bytes() -> None:
    views = {"kind": "dome", "degrees": 20.0, "elevation": [20, 40], "rings": "auto"}
    config = parse_config(scene(views, {"decibels": 60.0, "megabytes": 0.001}), "dome")
    plan = analyze(prepare_stage(config))
    assert plan.advice[0].startswith("warning: auto.megabytes = 0.001 binds")
    assert (plan.value("views.count"), plan.value("views.rings")) == (2, 2)

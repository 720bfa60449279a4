"""The parameter space: its nodes, what they blend to, and the views between them."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mirrorbake.errors import InputError, OptionError
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.parameters import Axis, ParameterSpace, space_of

ARC = ParameterSpace((Axis("arc", (0.0, 0.5, 1.0), 0.0, 1.0),))
AZIMUTH = Axis("azimuth", (0.0, 90.0, 180.0, 270.0), 0.0, 360.0, 360.0)
ELEVATION = Axis("elevation", (10.0, 30.0, 50.0), 10.0, 50.0)
MOTION = Axis("motion", (0.0, 1.0), 0.0, 1.0)
DOME = ParameterSpace((AZIMUTH, ELEVATION))
ONE_FOR_ALL = ParameterSpace(
    (Axis("azimuth", (180.0,), 0.0, 360.0, 360.0), Axis("elevation", (30.0,), 10.0, 50.0))
)
SPACES = (ParameterSpace(), ARC, DOME, ONE_FOR_ALL, ParameterSpace((AZIMUTH, ELEVATION, MOTION)))


def test_a_sampled_parameter_is_its_node_even_if_it_was_rounded() -> None:
    assert ARC.neighbours(0.0) == [(0, 1.0)]
    assert ARC.neighbours(0.5) == [(1, 1.0)]
    assert ARC.neighbours(0.4999999) == [(1, 1.0)]
    assert ARC.neighbours(1.0) == [(2, 1.0)]
    (first, a), (second, b) = ARC.neighbours(0.6)
    assert (first, second) == (1, 2)
    assert (a, b) == pytest.approx((0.8, 0.2))


@pytest.mark.parametrize("wrong", [-0.01, 1.01, math.nan, math.inf])
def test_a_point_outside_of_an_axis_names_it(wrong: float) -> None:
    with pytest.raises(OptionError, match="a parameter of the arc, from 0 to 1"):
        ARC.neighbours(wrong)
    with pytest.raises(OptionError, match="an elevation in degrees, from 10 to 50"):
        DOME.neighbours((0.0, wrong))


def test_a_point_has_a_coordinate_for_every_axis() -> None:
    with pytest.raises(OptionError, match=r"expected 2 coordinates \(azimuth, elevation\)"):
        DOME.neighbours(20.0)
    with pytest.raises(OptionError, match=r"view = 1,2: expected 1 coordinates \(arc\)"):
        ARC.neighbours((1.0, 2.0))
    assert ParameterSpace().neighbours(()) == [(0, 1.0)]


@pytest.mark.parametrize("space", SPACES)
def test_every_node_is_its_own_only_neighbour(space: ParameterSpace) -> None:
    samples = space.samples()
    assert len(samples) == len(space) == len(set(samples))
    for index, point in enumerate(samples):
        assert space.sample(index) == point
        assert space.neighbours(point) == [(index, 1.0)]


@settings(max_examples=100, deadline=None)
@given(st.floats(-720, 720), st.floats(10, 50), st.floats(0, 1))
def test_multilinear_weights_reproduce_what_is_linear_along_each_axis(
    azimuth: float, elevation: float, motion: float
) -> None:
    space = SPACES[-1]
    blend = space.neighbours((azimuth, elevation, motion))
    assert all(weight > 0 for _, weight in blend)
    assert sum(weight for _, weight in blend) == pytest.approx(1.0)
    points = [space.sample(index) for index, _ in blend]
    weights = [weight for _, weight in blend]
    # A node taken for a point close by shifts it by up to a millionth of a step.
    assert np.dot(weights, [p[1] for p in points]) == pytest.approx(elevation, abs=1e-4)
    assert np.dot(weights, [p[2] for p in points]) == pytest.approx(motion, abs=1e-5)
    apart = [abs((p[0] - azimuth + 180) % 360 - 180) for p in points]
    assert max(apart) < 90 + 1e-4


def test_a_closed_axis_blends_across_its_seam() -> None:
    blend = dict(DOME.neighbours((337.5, 10.0)))
    assert blend == {9: 0.25, 0: 0.75}
    assert DOME.neighbours((-22.5, 10.0)) == DOME.neighbours((337.5, 10.0))


def test_one_set_of_maps_serves_a_whole_dome_without_parameters() -> None:
    for point in ((0.0, 10.0), (123.0, 47.0)):
        assert ONE_FOR_ALL.neighbours(point) == [(0, 1.0)]
    assert all(view.nodes == ((0, 1.0),) for view in ONE_FOR_ALL.jittered_views(8, seed=1))
    assert ONE_FOR_ALL.middle_after(0) is None


def test_near_nodes_are_those_a_few_steps_away_and_wrap_around() -> None:
    assert ARC.near(1, 0) == [1]
    assert ARC.near(2, 1) == [1, 2]
    assert ARC.near(0, 5) == [0, 1, 2]
    assert {DOME.sample(i) for i in DOME.near(0, 1)} == {
        (azimuth, elevation) for azimuth in (270.0, 0.0, 90.0) for elevation in (10.0, 30.0)
    }
    for space in SPACES:
        for index in range(len(space)):
            assert index in space.near(index, 1)
            assert all(index in space.near(other, 1) for other in space.near(index, 1))


def test_views_fill_every_cell_and_depend_on_their_cell_and_the_seed_alone() -> None:
    views = DOME.jittered_views(5, seed=3)
    assert len(views) == 4 * 2 * 5
    assert views == DOME.jittered_views(5, seed=3)
    assert views != DOME.jittered_views(5, seed=4)
    for number in range(8):
        cell = views[5 * number : 5 * number + 5]
        assert len({view.nodes[0][0] for view in cell}) == 1
        # A Latin square: each fifth of the cell's width holds one view.
        fifths = sorted(int(((view.point[1] - 10) % 20) / 4) for view in cell)
        assert fifths == [0, 1, 2, 3, 4]
    assert all(sum(weight for _, weight in view.nodes) == pytest.approx(1) for view in views)


@pytest.mark.parametrize("space", SPACES)
def test_points_are_spread_over_the_whole_space(space: ParameterSpace) -> None:
    points = space.spread(9)
    assert all(space.point(point) for point in points if space.axes)
    for number, axis in enumerate(space.axes):
        along = sorted(point[number] for point in points)
        assert np.diff([axis.low, *along, axis.high]).max() < 0.4 * (axis.high - axis.low)


@pytest.mark.parametrize("space", SPACES)
def test_a_space_survives_the_attributes(space: ParameterSpace) -> None:
    assert ParameterSpace.from_attributes(json.loads(json.dumps(space.to_attributes()))) == space


def test_a_scene_file_spans_the_space() -> None:
    def shape(**sections: object) -> dict[str, int]:
        space = space_of(parse_config(sections, "scene"))
        return {axis.name: len(axis.values) for axis in space.axes}

    panorama = {"panorama": "/sky.exr"}
    assert shape() == {"arc": 100}
    assert shape(views={"kind": "dome"}) == {"azimuth": 12, "elevation": 3}
    assert shape(views={"kind": "fixed"}, motion={"to": [0.1, 0, 0], "count": 3}) == {"motion": 3}
    assert shape(views={"count": 2}, light={"count": 4}, surroundings=panorama) == {"arc": 2, "light": 4}
    closed = space_of(parse_config({"views": {"kind": "dome", "count": 4, "rings": 2}}, "scene"))
    assert closed.axes[0].period == 360
    assert closed.axes[0].values == (0, 90, 180, 270)
    assert closed.axes[1].values == (5, 60)


@pytest.mark.parametrize(
    ("sections", "message"),
    [
        ({"views": {"rings": 2}}, "`rings` has no meaning for kind = 'arc'"),
        ({"views": {"kind": "dome", "height": 0.5}}, "`height` has no meaning for kind = 'dome'"),
        ({"views": {"kind": "dome", "elevation": [40, 20]}}, "expected the lower one first"),
        ({"motion": {}}, "the object does not move"),
        ({"light": {}}, r"\[light\] needs surroundings.panorama"),
    ],
)
def test_sections_that_span_no_space_are_refused(sections: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        parse_config(sections, "scene")

"""Projections through Python: properties of random directions."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from mirrorbake import projection as pr

PROJECTIONS = ["cube", "dual_paraboloid", "latlong", "equal_area", "angular", "fisheye:360"]
COMPONENT = st.floats(-(2.0**100), 2.0**100, width=32, allow_subnormal=True)


@settings(max_examples=200, deadline=None)
@given(name=st.sampled_from(PROJECTIONS), directions=hnp.arrays(np.float32, (8, 3), elements=COMPONENT))
def test_directions_survive_a_round_trip_within_2e_7_radians(name: str, directions: np.ndarray) -> None:
    directions = directions[np.any(directions != 0, axis=1)]
    faces, points = pr.points_from_directions(name, directions)
    assert np.all(np.abs(points) <= 1)
    again = pr.directions_from_points(name, faces, points).astype(np.float64)
    exact = directions.astype(np.float64)
    angle = np.arctan2(np.linalg.norm(np.cross(exact, again), axis=1), np.sum(exact * again, axis=1))
    # Near a pole the latitude of equal_area changes as a square root of the rows that are left to it.
    from_pole = np.hypot(exact[:, 0], exact[:, 2]) / np.linalg.norm(exact, axis=1)
    assert np.all(angle <= 2e-7 / (np.maximum(from_pole, 5e-4) if name == "equal_area" else 1.0))


@settings(max_examples=200, deadline=None)
@given(directions=hnp.arrays(np.float32, (8, 3), elements=COMPONENT))
def test_directions_survive_a_sphere_map_as_far_as_its_rim_lets_them(directions: np.ndarray) -> None:
    directions = directions[np.any(directions != 0, axis=1)]
    faces, points = pr.points_from_directions("sphere_map", directions)
    again = pr.directions_from_points("sphere_map", faces, points).astype(np.float64)
    exact = directions.astype(np.float64)
    angle = np.arctan2(np.linalg.norm(np.cross(exact, again), axis=1), np.sum(exact * again, axis=1))
    # r = sin(θ/2) in float32, off by δ = 1e-7, moves θ by 2δ/cos(θ/2), at the rim by √(8δ).
    half = np.arctan2(np.hypot(exact[:, 0], exact[:, 1]), exact[:, 2]) / 2
    assert np.all(angle <= np.minimum(2e-7 + 2e-7 / np.maximum(np.cos(half), 1e-12), 1e-3))


@pytest.mark.parametrize("bad", [[0, 0, 0], [np.nan, 0, 1], [np.inf, 0, 0]])
@pytest.mark.parametrize("name", [*PROJECTIONS, "sphere_map", "fisheye:90"])
def test_directions_without_an_answer_are_errors(name: str, bad: list[float]) -> None:
    with pytest.raises(ValueError, match="1 NaN, infinite or zero vectors"):
        pr.points_from_directions(name, [bad, [1.0, 0.0, 0.0]])


def test_bad_positions_are_errors() -> None:
    with pytest.raises(ValueError, match=r"faces\[0\] is 6"):
        pr.directions_from_points("cube", 6, [0.0, 0.0])
    with pytest.raises(ValueError, match="not finite"):
        pr.directions_from_points("cube", 0, [np.nan, 0.0])
    with pytest.raises(ValueError, match="face is 2"):
        pr.solid_angle_density("dual_paraboloid", 2, 0, 0)


@pytest.mark.parametrize("name", [*PROJECTIONS, "sphere_map"])
def test_texels_share_the_sphere(name: str) -> None:
    faces = {"cube": 6, "dual_paraboloid": 2}.get(name, 1)
    angles = pr.texel_solid_angles(name, 50, 50)
    assert angles.shape == (50, 50)
    assert faces * angles.sum() == pytest.approx(4 * np.pi, rel=1e-12)


def test_paraboloid_density_is_that_of_the_paper() -> None:
    assert pr.solid_angle_density("dual_paraboloid", 0, 0, 0) == pytest.approx(4)
    assert pr.solid_angle_density("dual_paraboloid", 1, 0.6, -0.8) == pytest.approx(1)


def test_texture_matrix_gives_the_coordinates_of_the_map() -> None:
    r = np.array([0.6, -0.48, 0.64])
    h = pr.dual_paraboloid_texture_matrix(np.eye(3), 0) @ np.append(r, 1)
    np.testing.assert_allclose(h[:2] / h[3], [0.5 + 0.5 * 0.6 / 1.64, 0.5 + 0.5 * 0.48 / 1.64], atol=1e-6)

"""The papers' own ways with maps: paraboloid filters, backgrounds, chrome."""

import numpy as np
import pytest

from mirrorbake import InvalidArgument
from mirrorbake.envmap import EnvMap
from mirrorbake.prefilter import phong, prefilter
from mirrorbake.prefilter.backgrounds import background, chrome, fisheye, perspective, rotation
from mirrorbake.prefilter.parabolic import distortion, filter_widths, parabolic_phong, shrink_factors
from mirrorbake.projection import texel_directions


@pytest.fixture(scope="module")
def sky() -> EnvMap:
    d = texel_directions("latlong", 256, 128)
    return EnvMap.from_array((1 + 0.8 * np.sin(3 * d + 1)).astype(np.float32), "latlong")


def test_widths_and_shrink_factors_are_those_of_the_paper() -> None:
    widths = {10: (174, 260), 50: (78, 136), 100: (56, 100), 250: (36, 66), 500: (26, 48)}
    assert {n: filter_widths(n) for n in widths} == widths
    factors = {10: (32, 64), 50: (16, 32), 100: (8, 16), 250: (8, 16), 500: (4, 8)}
    assert {n: shrink_factors(n) for n in factors} == factors
    with pytest.raises(InvalidArgument, match="clamp"):
        filter_widths(10, clamp=1.0)


def test_circles_are_distorted_by_a_quarter_at_most() -> None:
    radii = np.linspace(0.05, 0.5, 10)
    places = np.linspace(0, 1, 11)
    worst = [max(distortion(radius, place) for place in places) for radius in radii]
    assert (np.diff(worst) > 0).all()
    assert 0.2 < worst[-1] < 0.25  # the paper's 25 %


def test_two_filters_come_near_to_phong_and_keep_white_white(sky: EnvMap) -> None:
    ours = parabolic_phong(sky, 50, 64)
    exact = prefilter(sky, phong(50), 64, "dual_paraboloid")
    error = ours.compare(exact)
    assert 1e-4 < error.relative_l2 < 0.05  # an approximation, but one of some percent
    white = parabolic_phong(EnvMap.from_array(np.ones((16, 32, 1), np.float32), "latlong"), 100, 32)
    np.testing.assert_allclose(white.values, 1, atol=1e-6)


def test_backgrounds_show_the_map_in_the_directions_of_the_pixels(sky: EnvMap) -> None:
    for d in (perspective(24, 16, 60), fisheye(20)):
        turn = rotation([1, 2, 3], 40)
        picture = background(sky, d, turn)
        seen = np.isfinite(d).all(-1)
        turned = d[seen] / np.linalg.norm(d[seen], axis=-1)[:, None] @ turn.T
        expected = 1 + 0.8 * np.sin(3 * turned + 1)
        np.testing.assert_allclose(picture[seen], expected, atol=0.05)  # a mean over pixels of 4° to 9°
        assert (picture[~seen] == 0).all()


def test_motion_blur_is_the_mean_of_what_passes(sky: EnvMap) -> None:
    d = perspective(8, 8, 20)
    end = rotation([0, 0, 1], 30)  # a roll: pixels near the middle move less
    blurred = background(sky, d, None, end, steps=16)
    many = np.mean([background(sky, d, rotation([0, 0, 1], 30 * (i + 0.5) / 64)) for i in range(64)], axis=0)
    np.testing.assert_allclose(blurred, many, atol=5e-3)
    still = background(sky, d, None, np.eye(3))
    np.testing.assert_allclose(still, background(sky, d), atol=1e-5)


def test_chrome_interpolates_and_averages_its_table() -> None:
    table = np.array([[0.0], [0.0], [1.0]])
    assert chrome(table, [0, 1, 0])[0] == pytest.approx(1, abs=1e-5)
    assert chrome(table, [1, 1, 0])[0] == pytest.approx(0.5, abs=1e-5)
    # Over the whole sphere of elevations: the mean of 0 and of a ramp from 0 to 1.
    assert chrome(table, [1, 0, 0], 360.0)[0] == pytest.approx(0.25, abs=1e-6)
    with pytest.raises(InvalidArgument, match="directions"):
        chrome(table, [0, 0, 0])

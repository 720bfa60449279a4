"""Radiance maps of the corners of a geodesic sphere, warped and blended to any view."""

import numpy as np
import pytest
from numpy.typing import NDArray

from mirrorbake import InvalidArgument
from mirrorbake.envmap import EnvMap
from mirrorbake.prefilter.reflection_space import (
    WARPS,
    RadianceMaps,
    between_views,
    geodesic,
    radiance_map,
    spherical_weights,
    view_frame,
)
from mirrorbake.projection import texel_directions, texel_solid_angles

Array = NDArray[np.float64]
SIZE = 24
INSIDE = np.hypot(*np.meshgrid(np.arange(SIZE) - 11.5, np.arange(SIZE) - 11.5)) < 0.9 * SIZE / 2


def glossy(n_v: Array, n_l: Array, v_l: Array) -> Array:
    # Phong about the mirror direction, and brighter where the view grazes: r·l = 2 (n·v)(n·l) − v·l.
    lobe: Array = np.maximum(2 * n_v * n_l - v_l, 0) ** 20 * (0.2 + 0.8 * (1 - n_v) ** 5) / n_l
    return lobe


def white(n_v: Array, n_l: Array, v_l: Array) -> Array:
    return np.broadcast_to(1 / np.pi, np.broadcast_shapes(n_v.shape, n_l.shape))


@pytest.fixture(scope="module")
def sky() -> EnvMap:
    d = texel_directions("latlong", 48, 24)
    image = 1 + 0.8 * np.sin(4 * d + 1)
    image[6, 30] = 60
    return EnvMap.from_array(image.astype(np.float32), "latlong")


def psnr(ours: EnvMap, expected: EnvMap) -> float:
    a, b = ours.level()[INSIDE], expected.level()[INSIDE]
    return float(20 * np.log10(b.max() / np.sqrt(((a - b) ** 2).mean())))


def test_geodesic_spheres_are_closed_and_their_triangles_cover_the_sphere() -> None:
    for level in (0, 1):
        points, triangles = geodesic(level)
        assert len(points) == 2 + 10 * 4**level
        assert len(triangles) == 20 * 4**level
        a, b, c = (points[triangles[:, i]] for i in range(3))
        over = np.abs(np.einsum("ij,ij->i", a, np.cross(b, c)))
        under = 1 + (a * b).sum(1) + (b * c).sum(1) + (c * a).sum(1)
        assert (2 * np.arctan2(over, under)).sum() == pytest.approx(4 * np.pi)


def test_weights_are_one_at_a_corner_and_sum_to_one() -> None:
    points, triangles = geodesic()
    corners = points[triangles[3]]
    np.testing.assert_allclose(spherical_weights(corners, corners[1]), [0, 1, 0], atol=1e-12)
    inside = corners.sum(0) + corners[0]
    weights = spherical_weights(corners, inside / np.linalg.norm(inside))
    assert weights.sum() == pytest.approx(1)
    assert weights[0] > weights[1] > 0


def test_a_white_ball_shows_its_irradiance_from_every_side(sky: EnvMap) -> None:
    maps = RadianceMaps.make(sky, white, SIZE)
    view = np.array([0.3, 0.5, 0.8])
    assert psnr(maps.at(view, warp="normal"), radiance_map(sky, white, view, SIZE)) > 40


def test_corners_are_exact_and_more_directions_are_better_between_them(sky: EnvMap) -> None:
    coarse = RadianceMaps.make(sky, glossy, SIZE)
    corner = coarse.views[4]
    assert psnr(coarse.at(corner), coarse.maps[4]) > 60  # but for interpolation where nothing moves
    finer = RadianceMaps.make(sky, glossy, SIZE, 1)
    views = np.array([[0.3, 0.5, 0.8], [-0.7, 0.2, 0.4], [0.1, -0.9, 0.3]])
    gains = []
    for view in views:
        expected = radiance_map(sky, glossy, view, SIZE)
        assert psnr(coarse.at(view), expected) > 20
        # A warp that follows the wrong feature is worse.
        assert psnr(coarse.at(view), expected) > psnr(coarse.at(view, warp="normal"), expected)
        gains.append(psnr(finer.at(view), expected) - psnr(coarse.at(view), expected))
    assert np.mean(gains) > 0


def test_maps_of_the_twelve_directions_shade_as_brute_force_does(sky: EnvMap) -> None:
    # A ball of its own pixels: against the sum over all texels at each, reading `at` may lose no more than
    # 1 dB of what reading the brute-force map of that view loses between its texels.
    maps = RadianceMaps.make(sky, glossy, SIZE)
    place = (np.arange(20) + 0.5) / 20 * 1.8 - 0.9
    x, y = (grid.ravel() for grid in np.meshgrid(place, place))
    ball = np.hypot(x, y) < 0.9
    normal = np.stack([x, y, np.sqrt(np.maximum(0, 1 - x**2 - y**2))], -1)[ball]
    lights = texel_directions("latlong", 48, 24).reshape(-1, 3).astype(np.float64)
    power = sky.level().reshape(-1, 3) * texel_solid_angles("latlong", 48, 24).reshape(-1, 1)
    for corner, view in enumerate(maps.views):
        frame = view_frame(view)
        n_l = np.maximum(normal @ frame.T @ lights.T, 0)
        lit = np.where(n_l > 0, n_l, 1)
        exact = (glossy(normal[:, 2:], lit, (lights @ view)[None]) * n_l) @ power
        reflected = (2 * normal[:, 2:] * normal - [0, 0, 1]).astype(np.float32)

        def loss(made: EnvMap, exact: Array = exact, at: NDArray[np.float32] = reflected) -> float:
            return float(20 * np.log10(exact.max() / np.sqrt(((made.sample(at) - exact) ** 2).mean())))

        assert loss(maps.at(view)) > loss(maps.maps[corner]) - 1


def test_views_between_the_directions_lose_less_the_more_there_are(sky: EnvMap) -> None:
    curves = [between_views(sky, glossy, SIZE, refinements, 2) for refinements in (0, 1)]
    for curve in curves:
        angles = [angle for angle, _ in curve]
        assert angles[0] == pytest.approx(0)
        assert angles == sorted(angles)
        assert curve[0][1] > curve[-1][1]  # best at a corner
    assert curves[0][-1][0] == pytest.approx(37.4, abs=0.1)  # from a corner of the icosahedron to its faces
    assert curves[1][-1][1] > curves[0][-1][1] + 1


def test_a_disc_of_triangles_comes_near_to_the_warp_of_every_texel(sky: EnvMap) -> None:
    maps = RadianceMaps.make(sky, glossy, SIZE)
    view = np.array([0.3, 0.5, 0.8])
    for warp in WARPS:
        exact = maps.at(view, warp=warp)
        found = [psnr(maps.at(view, warp=warp, rings=rings), exact) for rings in (3, 6, 12)]
        assert found == sorted(found), warp
        assert found[-1] > 25, warp
    with pytest.raises(InvalidArgument, match="rings is 1"):
        maps.at(view, rings=1)


def test_a_brdf_with_colours_gives_each_channel_its_own(sky: EnvMap) -> None:
    def tinted(n_v: Array, n_l: Array, v_l: Array) -> Array:
        return glossy(n_v, n_l, v_l)[..., None] * [1.0, 0.5, 0.0]

    view = np.array([0.0, 0.0, 1.0])
    grey = radiance_map(sky, glossy, view, 8).level()
    np.testing.assert_allclose(radiance_map(sky, tinted, view, 8).level(), grey * [1, 0.5, 0], rtol=1e-5)


def test_what_is_out_of_range_is_refused(sky: EnvMap) -> None:
    maps = RadianceMaps.make(sky, white, 4)
    with pytest.raises(InvalidArgument, match="mirror or normal"):
        maps.at([0, 0, 1], warp="best")  # type: ignore[arg-type]
    with pytest.raises(InvalidArgument, match="view"):
        maps.at([0, 0, 0])
    with pytest.raises(InvalidArgument, match="refinements"):
        geodesic(9)

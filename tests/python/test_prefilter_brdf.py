"""Lobes of isotropic materials: their shape, their energy, and maps with a third index."""

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.envmap import EnvMap
from mirrorbake.prefilter import Prefilter, phong, split_sum
from mirrorbake.prefilter.brdf_lobes import (
    ThirdIndexMaps,
    average_lobe,
    ggx_brdf,
    lobe_of_view,
    several_lobes,
)
from mirrorbake.prefilter.reflection_space import radiance_map, view_frame
from mirrorbake.projection import texel_directions


def phong_20(n_v: np.ndarray, n_l: np.ndarray, v_l: np.ndarray) -> np.ndarray:
    value: np.ndarray = np.maximum(2 * n_v * n_l - v_l, 0) ** 20 / n_l
    return value


def sky() -> EnvMap:
    d = texel_directions("latlong", 64, 32)
    light = 0.4 + 0.3 * d[..., 1:2] + 6 * (d @ np.array([0.36, 0.8, 0.48], np.float32) > 0.9)[..., None]
    return EnvMap.from_array((light * np.ones(3)).astype(np.float32), "latlong")


def test_lobe_of_a_phong_surface_is_phongs() -> None:
    one = lobe_of_view(phong_20, 1.0)
    for cosine in (1.0, 0.95, 0.8):
        # Straight lines between rings and monotone cubics between steps of the table.
        assert one.lobe.weight(cosine) == pytest.approx(cosine**20, abs=2e-3)
    assert one.shift == pytest.approx(0, abs=1e-9)
    assert one.reflectance == pytest.approx(2 * np.pi / 21, rel=1e-3)


@pytest.mark.parametrize("alpha", [0.1, 0.3, 0.8])
@pytest.mark.parametrize("cosine", [0.3, 0.7, 1.0])
def test_reflectance_is_that_of_the_split_sum(alpha: float, cosine: float) -> None:
    scale, bias = split_sum(cosine, alpha)
    # The split sum takes its own quadrature; both are good for half a per cent.
    assert lobe_of_view(ggx_brdf(alpha), cosine).reflectance == pytest.approx(scale + bias, rel=5e-3)


def test_white_shows_the_reflectance() -> None:
    white = EnvMap.from_array(np.ones((32, 64, 3), np.float32), "latlong")
    maps = ThirdIndexMaps.make(white, ggx_brdf(0.4), 8, 4)
    view = np.array([0.0, 0.0, 1.0])
    for index, one in enumerate(maps.lobes):
        sine = np.sqrt(1 - maps.cosines[index] ** 2)
        shown = maps.sample([sine, 0.0, maps.cosines[index]], view)
        # A ten-thousandth of the energy lies beyond the table; the convolution is good for half a per cent.
        assert shown == pytest.approx(one.reflectance, rel=6e-3)


def test_a_third_index_is_closer_to_every_texel_than_the_average_lobe() -> None:
    source, brdf, view, size = sky(), ggx_brdf(0.3), np.array([0.3, 0.2, 0.9]), 32
    frame = view_frame(view)
    place = (np.arange(size) + 0.5) / size * 2 - 1
    x, y = np.meshgrid(place, -place)
    inside = np.hypot(x, y) < 0.95
    normals = np.stack([x, y, np.sqrt(np.maximum(0, 1 - x**2 - y**2))], -1)[inside] @ frame.T
    expected = radiance_map(source, brdf, view, size).level()[inside]

    def error(shown: np.ndarray) -> float:
        return float(np.linalg.norm(shown - expected) / np.linalg.norm(expected))

    third = error(ThirdIndexMaps.make(source, brdf, 32, 8).sample(normals, frame[:, 2]))
    centred = error(ThirdIndexMaps.make(source, brdf, 32, 8, off_specular=False).sample(normals, frame[:, 2]))
    v = frame[:, 2]
    mirrored = 2 * (normals @ v)[:, None] * normals - v
    mean = error(Prefilter(source).sample(average_lobe(brdf).lobe, mirrored, scale="sum"))
    print(f"third index {third:.4f}, not shifted {centred:.4f}, average lobe {mean:.4f}")
    assert third < centred < mean
    assert third < 0.1


def test_several_lobes_are_the_sum_of_each() -> None:
    filtered = Prefilter(sky())
    d = np.eye(3)
    both = several_lobes(filtered, [(0.25, phong(5)), (0.75, phong(200))], d)
    assert both == pytest.approx(0.25 * filtered.sample(phong(5), d) + 0.75 * filtered.sample(phong(200), d))


def test_bad_arguments_are_named() -> None:
    with pytest.raises(_core.InvalidArgument, match="n_v is 0"):
        lobe_of_view(ggx_brdf(0.3), 0.0)
    with pytest.raises(_core.InvalidArgument, match="alpha is 2"):
        ggx_brdf(2.0)
    with pytest.raises(_core.InvalidArgument, match="reflects nothing"):
        lobe_of_view(lambda n_v, n_l, v_l: 0 * n_l, 0.5)
    with pytest.raises(_core.InvalidArgument, match="negative, NaN or infinite"):
        lobe_of_view(lambda n_v, n_l, v_l: np.nan * n_l, 0.5)
    with pytest.raises(_core.InvalidArgument, match="count is 0"):
        ThirdIndexMaps.make(sky(), ggx_brdf(0.3), 8, 0)
    with pytest.raises(_core.InvalidArgument, match="lobes is empty"):
        several_lobes(Prefilter(sky()), [], np.eye(3))

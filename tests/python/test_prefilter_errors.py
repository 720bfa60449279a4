"""Prefiltered maps against the sum over all texels in float64, on photographs, a sun and lamps."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mirrorbake._core import Lobe
from mirrorbake.envmap import EnvMap
from mirrorbake.literals import LobeScale
from mirrorbake.prefilter import Prefilter, ggx, lambert, phong
from mirrorbake.projection import texel_directions

Array = NDArray[np.float64]
PHOTOGRAPHS = ("night", "studio", "venice", "workshop")
SIZE, LOOKED_AT = 32, 40


def phong_weight(exponent: float) -> Callable[[Array], Array]:
    return lambda c: np.maximum(c, 0) ** exponent


def ggx_weight(alpha: float) -> Callable[[Array], Array]:
    # D of Walter et al. 2007 eq. 33 at the half vector, whose squared cosine is (1 + c)/2, but for a factor.
    return lambda c: np.maximum(c, 0) / (alpha**-2 - (alpha**-2 - 1) * (1 + c) / 2) ** 2


LOBES = (
    *((phong(n), phong_weight(n), f"Phong N = {n:g}") for n in (1, 10, 128, 1e4)),
    *((ggx(a), ggx_weight(a), f"GGX α = {a:g}") for a in (0.02, 0.1, 0.5, 1)),
)


def sun() -> EnvMap:
    """A sky with detail and a sun of 0.4° in radius and 1e5 times its radiance."""
    d = texel_directions("latlong", 512, 256).astype(np.float64)
    image = 0.35 + 0.3 * np.sin(5 * d + 1) + np.random.default_rng(0).random((256, 512, 1)) * 0.3
    image[d @ [0.36, 0.72, 0.6] > np.cos(np.radians(0.4)) * np.linalg.norm([0.36, 0.72, 0.6])] = 5e4
    return EnvMap.from_array(image.astype(np.float32), "latlong")


def lamps() -> EnvMap:
    """A dark room with lamps of several texels, which are all that is seen far from their own directions."""
    rng = np.random.default_rng(4)
    image = rng.random((256, 512, 3)) * 0.02
    for row, column, height, width in (
        (60, 70, 13, 31),
        (90, 260, 9, 22),
        (128, 400, 30, 6),
        (210, 90, 17, 29),
    ):
        image[row : row + height, column : column + width] = 3e3
    return EnvMap.from_array(image.astype(np.float32), "latlong")


def photograph(name: str) -> EnvMap:
    folder = os.environ.get("MIRRORBAKE_TEST_DATA")
    if folder is None:
        pytest.skip("MIRRORBAKE_TEST_DATA is not set")
    return EnvMap.load(Path(folder) / f"{name}.exr", "latlong")


@pytest.fixture(scope="module", params=("sun", "lamps", *PHOTOGRAPHS))
def panorama(request: pytest.FixtureRequest) -> tuple[str, EnvMap]:
    name = request.param
    return name, {"sun": sun, "lamps": lamps}.get(name, lambda: photograph(name))()


def errors(panorama: EnvMap, lobe: Lobe, weight: Callable[[Array], Array], scale: LobeScale) -> Array:
    """Relative errors of some texels of a cube; texels of the source count at their middles."""
    height, width = panorama.level().shape[:2]
    latitude = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    longitude = np.pi * ((np.arange(width) + 0.5) * 2 / width - 1)
    lat, lon = np.meshgrid(latitude, longitude, indexing="ij")
    lights = np.stack([np.cos(lat) * np.sin(lon), np.sin(lat), -np.cos(lat) * np.cos(lon)], -1).reshape(-1, 3)
    angles = 2 * np.pi / width * 2 * np.cos(lat).ravel() * np.sin(np.pi / 2 / height)
    picked = np.random.default_rng(1).choice(6 * SIZE * SIZE, LOOKED_AT, replace=False)
    axes = np.concatenate([texel_directions("cube", SIZE, SIZE, face).reshape(-1, 3) for face in range(6)])
    weights = weight(axes[picked].astype(np.float64) @ lights.T) * angles
    expected = weights @ panorama.level().reshape(-1, 3).astype(np.float64)
    if scale == "mean":
        expected /= weights.sum(1)[:, None]
    ours = Prefilter(panorama).apply(lobe, SIZE, scale=scale).level().reshape(-1, 3)[picked]
    relative: Array = np.abs(ours / expected - 1)
    return relative


def test_diffuse_light_is_the_sum_over_all_texels(panorama: tuple[str, EnvMap]) -> None:
    name, source = panorama
    found = errors(source, lambert(), phong_weight(1), "sum")
    print(f"| {name} | diffuse | {np.median(found):.1e} | {found.max():.1e} |")
    assert found.max() < 1e-6  # rounding of float32; 1e-5 is what a photograph has to keep


@pytest.mark.parametrize(("lobe", "weight", "of"), LOBES, ids=[of for *_, of in LOBES])
def test_lobes_are_within_a_thousandth_of_the_sum_over_all_texels(
    panorama: tuple[str, EnvMap], lobe: Lobe, weight: Callable[[Array], Array], of: str
) -> None:
    name, source = panorama
    found = errors(source, lobe, weight, "mean")
    print(f"| {name} | {of} | {np.median(found):.1e} | {np.percentile(found, 99):.1e} |")
    assert np.median(found) < 1e-3
    # A hundredth is what renderers need; the third moments that nodes leave out are a fraction of that.
    assert np.percentile(found, 99) < 5e-3

"""Prefiltered maps against the sum over all texels in float64."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mirrorbake.envmap import EnvMap
from mirrorbake.prefilter import Prefilter, ggx, lambert, phong
from mirrorbake.projection import texel_directions

if TYPE_CHECKING:
    from collections.abc import Callable

    from mirrorbake._core import Lobe
    from mirrorbake.literals import LobeScale

FloatArray = NDArray[np.float64]
SIZE, LOOKED_AT = 32, 40


def lobes() -> dict[str, tuple[Lobe, Callable[[FloatArray], FloatArray]]]:
    """Lobes by name, each with its weight by the cosine to its axis, but for a factor."""
    return {
        "diffuse": (lambert(), _phong_weight(1)),
        **{f"Phong N = {n:g}": (phong(n), _phong_weight(n)) for n in (1, 10, 128, 1e4)},
        **{f"GGX α = {a:g}": (ggx(a), _ggx_weight(a)) for a in (0.02, 0.1, 0.5, 1)},
    }


def _phong_weight(exponent: float) -> Callable[[FloatArray], FloatArray]:
    return lambda c: np.maximum(c, 0) ** exponent


def _ggx_weight(alpha: float) -> Callable[[FloatArray], FloatArray]:
    # D of Walter et al. 2007 eq. 33 at the half vector, whose squared cosine is (1 + c)/2.
    return lambda c: np.maximum(c, 0) / (alpha**-2 - (alpha**-2 - 1) * (1 + c) / 2) ** 2


def sunny_sky(height: int = 256) -> EnvMap:
    """A sky with detail and a sun of 0.4° in radius and 1e5 times its radiance."""
    d = texel_directions("latlong", 2 * height, height).astype(np.float64)
    noise = np.random.default_rng(0).random((height, 2 * height, 1)) * 0.3
    image = 0.35 + 0.3 * np.sin(5 * d + 1) + noise
    sun = np.array([0.3, 0.6, 0.5]) / np.linalg.norm([0.3, 0.6, 0.5])
    image[d @ sun > np.cos(np.radians(0.4))] = 5e4
    return EnvMap.from_array(image.astype(np.float32), "latlong")


def dark_room(height: int = 256) -> EnvMap:
    """A dark room with four lamps of 3e5 times its radiance, all that is seen far from where they are."""
    image = np.random.default_rng(4).random((height, 2 * height, 3)) * 0.02
    lamps = (
        (0.23, 0.27, 0.05, 0.12),
        (0.35, 1.02, 0.04, 0.09),
        (0.5, 1.56, 0.12, 0.02),
        (0.82, 0.35, 0.07, 0.11),
    )
    for lamp in lamps:
        top, left, rows, columns = (round(height * share) for share in lamp)
        image[top : top + rows, left : left + columns] = 3e3
    return EnvMap.from_array(image.astype(np.float32), "latlong")


def lobe_errors(
    source: EnvMap, lobe: Lobe, weight: Callable[[FloatArray], FloatArray], scale: LobeScale = "mean"
) -> FloatArray:
    """Relative errors of 40 texels of a cube of 32², (40, channels).

    The sum takes every texel of the source, a ``latlong``, at its middle and with its exact solid angle.
    """
    height, width, channels = source.level().shape
    latitude = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    longitude = np.pi * ((np.arange(width) + 0.5) * 2 / width - 1)
    lat, lon = np.meshgrid(latitude, longitude, indexing="ij")
    lights = np.stack([np.cos(lat) * np.sin(lon), np.sin(lat), -np.cos(lat) * np.cos(lon)], -1).reshape(-1, 3)
    angles = 2 * np.pi / width * 2 * np.cos(lat).ravel() * np.sin(np.pi / 2 / height)
    picked = np.random.default_rng(1).choice(6 * SIZE * SIZE, LOOKED_AT, replace=False)
    axes = np.concatenate([texel_directions("cube", SIZE, SIZE, face).reshape(-1, 3) for face in range(6)])
    weights = weight(axes[picked].astype(np.float64) @ lights.T) * angles
    expected = weights @ source.level().reshape(-1, channels).astype(np.float64)
    if scale == "mean":
        expected /= weights.sum(1)[:, None]
    ours = Prefilter(source).apply(lobe, SIZE, scale=scale).level().reshape(-1, channels)[picked]
    errors: FloatArray = np.abs(ours / expected - 1)
    return errors

"""Other ways to store the maps of a PEM: where the coarser levels come from, and how a texel is coded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numcodecs
import numpy as np

from mirrorbake.envmap import EnvMap
from mirrorbake.pem.pyramid import coarser_sizes, decimate
from mirrorbake.prefilter.convolve import Prefilter, ggx, phong
from mirrorbake.projection import MAP_PROJECTIONS

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from mirrorbake import _core
    from mirrorbake.arrays import FloatArray

LOG_FLOOR = 2.0**-8
"""ε of the logarithmic code: what is darker has few codes left."""


@dataclass(frozen=True)
class Levels:
    """A rule that makes the coarser levels of a map from other data, so that they need not be stored."""

    name: str
    coarser: Callable[[EnvMap, FloatArray], list[FloatArray]]
    """Levels (F, s, s, C) below the finest, of the finest and a captured pyramid (texels, 3)."""

    def apply(
        self, pyramid: FloatArray, size: int, capture: FloatArray, projection: str = "cube"
    ) -> FloatArray:
        """Return a pyramid (texels, C) with its coarser levels made anew; the projection of the maps."""
        channels, kept = pyramid.shape[1], MAP_PROJECTIONS[projection]
        finest = pyramid[: kept.faces * size * size].reshape(kept.faces, size, size, channels)
        levels = [finest, *self.coarser(EnvMap.from_array(finest, kept.projection), capture)]
        return np.concatenate([level.reshape(-1, channels) for level in levels])


def _decimated(envmap: EnvMap, capture: FloatArray) -> list[FloatArray]:
    levels, finest = [], envmap.level(0)
    for _ in coarser_sizes(finest.shape[1]):
        finest = decimate(finest)
        levels.append(finest)
    return levels


def _solid_angle(envmap: EnvMap, capture: FloatArray) -> list[FloatArray]:
    filtered = envmap.mips("seamless")
    return [filtered.level(level) for level in range(1, filtered.levels)]


def _captured(envmap: EnvMap, capture: FloatArray) -> list[FloatArray]:
    finest = envmap.level(0)
    if finest.shape[3] != 3:
        # Nothing of the object itself is captured from its centre.
        return _decimated(envmap, capture)
    faces = len(finest)
    levels, start = [], faces * finest.shape[1] ** 2
    for size in coarser_sizes(finest.shape[1]):
        levels.append(capture[start : start + faces * size * size].reshape(faces, size, size, 3))
        start += faces * size * size
    return levels


LEVELS = (
    Levels("decimated", _decimated),
    Levels("solid angle", _solid_angle),
    Levels("captured", _captured),
)
"""Means of 2×2 texels; filtered by solid angle and across edges; those of the captured map."""


def _wide_as_texels(size: int) -> float:
    """Phong exponent of the lobe that scatters as far as a texel in the middle of a face of so many."""
    # A box of width w has the variance w²/12, cos^N the variance 1/N along each axis; w = π/2 / size.
    return max(48.0 * (size / np.pi) ** 2, 1.0)


def _ggx_alpha(exponent: float) -> float:
    """α of the GGX lobe whose half of the light lies within the same angle as that of a Phong exponent."""
    # 1 − exp(−N γ²/2) = ½, and tan(γ/2) = α for GGX seen along its normal.
    return float(np.clip(np.tan(0.5 * np.sqrt(2.0 * np.log(2.0) / exponent)), 0.01, 1.0))


def _convolved(lobe: Callable[[float], _core.Lobe]) -> Callable[[EnvMap, FloatArray], list[FloatArray]]:
    """Levels convolved from the finest by the lobe of a Phong exponent, as image-based lighting has them."""

    def coarser(envmap: EnvMap, capture: FloatArray) -> list[FloatArray]:
        convolver = Prefilter(envmap)
        return [
            convolver.apply(lobe(_wide_as_texels(size)), size, envmap.projection).level(0)
            for size in coarser_sizes(envmap.layout.width)
        ]

    return coarser


PREFILTERS = (
    Levels("Phong's lobe", _convolved(phong)),
    Levels("GGX lobe", _convolved(lambda exponent: ggx(_ggx_alpha(exponent)))),
)
"""Convolved with lobes as wide as the level's texels."""


@dataclass(frozen=True)
class Storage:
    """A code of 8 bits per channel."""

    name: str
    encode: Callable[[FloatArray], NDArray[np.uint8]]
    """Codes of a pyramid (texels, C); the fourth channel is coverage."""
    decode: Callable[[NDArray[np.uint8], FloatArray], FloatArray]
    """The pyramid that codes stand for, given the one that they were made of for its range."""

    def apply(self, pyramid: FloatArray) -> FloatArray:
        """Return a pyramid as it comes back from storage."""
        return self.decode(self.encode(pyramid), pyramid)


def _coverage(codes: NDArray[np.uint8]) -> FloatArray:
    return codes[:, 3:].astype(np.float32) / np.float32(255.0)


def _encode_coverage(pyramid: FloatArray) -> NDArray[np.uint8]:
    return (np.clip(pyramid[:, 3:], 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)


def _log_range(pyramid: FloatArray) -> tuple[float, float]:
    low = float(np.log2(LOG_FLOOR))
    return low, max(float(np.log2(pyramid[:, :3].max(initial=0.0) + LOG_FLOOR)), low + 1.0)


def _encode_log(pyramid: FloatArray) -> NDArray[np.uint8]:
    low, high = _log_range(pyramid)
    logarithm = np.log2(np.maximum(pyramid[:, :3], 0.0) + LOG_FLOOR)
    codes = (np.clip((logarithm - low) / (high - low), 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    return np.concatenate([codes, _encode_coverage(pyramid)], axis=1)


def _decode_log(codes: NDArray[np.uint8], pyramid: FloatArray) -> FloatArray:
    low, high = _log_range(pyramid)
    light = 2.0 ** (low + codes[:, :3].astype(np.float32) / 255.0 * (high - low)) - LOG_FLOOR
    return np.concatenate([np.maximum(light, 0.0), _coverage(codes)], axis=1).astype(np.float32)


def _encode_linear(pyramid: FloatArray) -> NDArray[np.uint8]:
    codes = (np.clip(pyramid[:, :3], 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    return np.concatenate([codes, _encode_coverage(pyramid)], axis=1)


def _decode_linear(codes: NDArray[np.uint8], pyramid: FloatArray) -> FloatArray:
    return codes.astype(np.float32) / np.float32(255.0)


STORAGES = (
    Storage("8-bit log", _encode_log, _decode_log),
    Storage("8-bit linear, clipped", _encode_linear, _decode_linear),
)
"""The code of the web format, and that of [PEM], whose maps end at 1."""


def packed_bytes(values: NDArray[Any]) -> int:
    """Bytes of an array, losslessly compressed as a PEM's chunks are."""
    codec = numcodecs.Blosc(cname="zstd", clevel=3, shuffle=numcodecs.Blosc.SHUFFLE)
    return len(codec.encode(np.ascontiguousarray(values)))

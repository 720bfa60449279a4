"""Measured isotropic materials in the files of MERL (Matusik et al., SIGGRAPH 2003)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import map_coordinates

from mirrorbake.errors import InputError

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import NDArray

_SHAPE = (90, 90, 180)  # half-way angle, difference angle, azimuth of the difference
_SCALE = (1 / 1500, 1.15 / 1500, 1.66 / 1500)  # what red, green and blue are stored in
_HEADER = 12  # bytes


@dataclass(frozen=True, eq=False)
class MeasuredBrdf:
    """A measured isotropic BRDF, for `radiance_map` and, as `grey`, for the lobes of `brdf_lobes`.

    Attributes
    ----------
    values
        (90, 90, 180, 3), 1/steradian, at the middles of equal steps of √θ_half, θ_diff and φ_diff; what the
        file marks as not measured is 0.
    """

    values: NDArray[np.float32]

    @classmethod
    def load(cls, path: str | PathLike[str]) -> MeasuredBrdf:
        """Read a ``.binary`` file: three numbers of steps, then the doubles of red, green and blue.

        Raises
        ------
        InputError
            If the file cannot be read, has other numbers of steps or another length, or values that are NaN
            or infinite.
        """
        path = Path(path)
        count = int(np.prod(_SHAPE))
        expected = _HEADER + 3 * 8 * count
        try:
            size = path.stat().st_size
            if size != expected:
                raise InputError(f"{path} has {size} bytes, expected {expected} of a BRDF of MERL")
            with path.open("rb") as file:
                shape = tuple(np.fromfile(file, "<i4", 3).tolist())
                if shape != _SHAPE:
                    raise InputError(f"{path} has {shape} steps, expected {_SHAPE} of an isotropic BRDF")
                stored = np.fromfile(file, "<f8", 3 * count)
        except OSError as error:
            raise InputError(f"{path} cannot be read: {error.strerror}") from None
        bad = int((~np.isfinite(stored)).sum())
        if bad or len(stored) != 3 * count:
            raise InputError(f"{path} has {bad} values that are NaN or infinite, expected none")
        values = np.maximum(stored.reshape(3, *_SHAPE), 0) * np.reshape(_SCALE, (3, 1, 1, 1))
        return cls(np.ascontiguousarray(np.moveaxis(values, 0, -1), np.float32))

    def __call__(
        self, n_v: NDArray[np.float64], n_l: NDArray[np.float64], v_l: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Values (..., 3), linear between the measured ones, of cosines that broadcast."""
        at = _places(n_v, n_l, v_l)
        channels = [_interpolated(self.values[..., c], at) for c in range(3)]
        result: NDArray[np.float64] = np.stack(channels, axis=-1)
        return result

    def grey(
        self, n_v: NDArray[np.float64], n_l: NDArray[np.float64], v_l: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Means of the three channels (...)."""
        return _interpolated(self.values.mean(axis=-1), _places(n_v, n_l, v_l))


def _places(
    n_v: NDArray[np.float64], n_l: NDArray[np.float64], v_l: NDArray[np.float64]
) -> NDArray[np.float64]:
    # Rusinkiewicz 1998: the half-way vector h, and the light seen from it. About h the normal lies at
    # (−sin θ_half, 0, cos θ_half), so that n·l = cos θ_half cos θ_diff − sin θ_half sin θ_diff cos φ_diff.
    n_v, n_l, v_l = np.broadcast_arrays(n_v, n_l, v_l)
    cos_d = np.sqrt(np.clip((1 + v_l) / 2, 1e-12, 1))
    cos_h = np.clip((n_v + n_l) / (2 * cos_d), 0, 1)
    sines = np.sqrt((1 - cos_h**2) * (1 - cos_d**2))
    cos_p = np.where(sines > 1e-9, (cos_h * cos_d - n_l) / np.maximum(sines, 1e-9), 0.0)
    half = np.sqrt(np.arccos(cos_h) / (np.pi / 2))
    difference = np.arccos(cos_d) / (np.pi / 2)
    azimuth = np.arccos(np.clip(cos_p, -1, 1)) / np.pi
    places: NDArray[np.float64] = np.stack([half, difference, azimuth])
    places *= np.reshape(_SHAPE, (3, *[1] * half.ndim))
    places -= 0.5
    return places


def _interpolated(values: NDArray[np.float32], at: NDArray[np.float64]) -> NDArray[np.float64]:
    flat = map_coordinates(values, at.reshape(3, -1), np.float64, order=1, mode="nearest")
    result: NDArray[np.float64] = flat.reshape(at.shape[1:])
    return result

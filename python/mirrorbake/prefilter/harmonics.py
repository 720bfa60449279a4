"""Light as spherical harmonics."""

from __future__ import annotations

import json
from dataclasses import dataclass
from os import fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.arrays import real_array
from mirrorbake.envmap import EnvMap
from mirrorbake.files import read_text, write_text
from mirrorbake.prefilter.convolve import irradiance
from mirrorbake.projection import vectors
from mirrorbake.resample import height_and_width

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import ArrayLike, NDArray

    from mirrorbake.literals import HarmonicWindow, NegativeLight


_LARGEST_JSON = 1 << 20  # bytes: 81 rows take a hundredth of it


@dataclass(frozen=True, eq=False)
class Harmonics:
    """Coefficients of real, orthonormal spherical harmonics, in the order of [AEM] eq. 9.

    Attributes
    ----------
    coefficients
        ((order + 1)², C), float64: Y(l, m) in row l² + l + m, a polynomial of x, y and z: 1, y, z, x, xy,
        yz, 3z² − 1, xz, x² − y² and so on.

    Examples
    --------
    >>> sky = EnvMap.from_array(np.ones((32, 64, 3), np.float32), "latlong")
    >>> light = Harmonics.project(sky)
    >>> light.order, round(float(light.irradiance().evaluate(4).values.max()), 2)
    (2, 3.14)
    """

    coefficients: NDArray[np.float64]

    def __post_init__(self) -> None:
        """Check the shape."""
        shape = self.coefficients.shape
        if len(shape) != 2 or shape[0] not in {(n + 1) ** 2 for n in range(9)} or shape[1] < 1:
            raise _core.InvalidArgument(f"coefficients has shape {shape}, expected ((order + 1)², channels)")

    @classmethod
    def project(cls, envmap: EnvMap, order: int = 2) -> Harmonics:
        """∫ L Y dω of the finest level for orders 0 to 8 ([AEM] eq. 11).

        Raises
        ------
        InvalidArgument
            For another order, and NaN and infinite values, with their number.
        """
        return cls(_core.project_harmonics(envmap.layout, envmap.values, order))

    @classmethod
    def from_array(cls, coefficients: ArrayLike) -> Harmonics:
        """Coefficients of shape ((order + 1)², C)."""
        return cls(np.ascontiguousarray(real_array("coefficients", coefficients, np.float64)))

    @property
    def order(self) -> int:
        """Highest band."""
        return round(float(np.sqrt(self.coefficients.shape[0]))) - 1

    def irradiance(self) -> Harmonics:
        """Of irradiance, if these are of radiance: bands times π, 2π/3, π/4, 0 and so on."""
        return Harmonics(_core.lambert_harmonics(self.coefficients))

    def windowed(self, window: HarmonicWindow) -> Harmonics:
        """Damped against ringing, by ``hanning`` or ``sloan``; ``none`` gives the same.

        ``sloan`` divides band l by 1 + λ l² (l + 1)² with the least λ that leaves nothing below 0.
        """
        return Harmonics(_core.window_harmonics(self.coefficients, window))

    def evaluate(
        self, size: int | tuple[int, int], projection: str = "cube", *, negative: NegativeLight = "clamp"
    ) -> EnvMap:
        """Return the map of the sums. ``negative``: ``clamp`` sums below 0 to 0, or ``keep`` them."""
        height, width = height_and_width(projection, size)
        layout, values = _core.evaluate_harmonics(self.coefficients, projection, width, height, negative)
        return EnvMap.from_array(
            EnvMap(layout, values, [str(c) for c in range(layout.channels)]).level(), projection
        )

    def sample(self, directions: ArrayLike, *, negative: NegativeLight = "clamp") -> NDArray[np.float64]:
        """Return the sums (..., C) in unit directions (..., 3), sums below 0 as for `evaluate`."""
        d = vectors("directions", directions, 3)
        basis = _core.harmonic_basis(d.reshape(-1, 3), self.order)
        sums: NDArray[np.float64] = (basis @ self.coefficients).reshape(*d.shape[:-1], -1)
        return np.maximum(sums, 0) if negative == "clamp" else sums

    def shader_constants(self) -> NDArray[np.float64]:
        """(9, C) for E/π = c₀ + c₁y + c₂z + c₃x + c₄xy + c₅yz + c₆(3z² − 1) + c₇xz + c₈(x² − y²).

        It is Filament's order. These harmonics are of radiance.
        """
        return _core.harmonic_constants(self.coefficients)

    def three_js(self) -> dict[str, Any]:
        """Return what ``THREE.LightProbe.fromJSON`` reads: 27 numbers of radiance; order 2 and RGB only."""
        if self.coefficients.shape != (9, 3):
            raise _core.InvalidArgument(
                f"coefficients has shape {self.coefficients.shape}, expected (9, 3) for a LightProbe"
            )
        return {
            "type": "LightProbe",
            "color": 0xFFFFFF,
            "intensity": 1,
            "sh": self.coefficients.ravel().tolist(),
        }

    def to_json(self) -> str:
        """Order and rows of coefficients, as `from_json` reads them."""
        return json.dumps({"order": self.order, "coefficients": self.coefficients.tolist()})

    @classmethod
    def from_json(cls, text: str) -> Harmonics:
        """Read what `to_json` and ``mb-envmap prefilter --model sh`` write.

        Raises
        ------
        InvalidArgument
            It is not JSON, or has no such coefficients.
        """
        try:
            coefficients = json.loads(text)["coefficients"]
        except (json.JSONDecodeError, KeyError, TypeError) as error:
            raise _core.InvalidArgument(
                f"text has no coefficients ({error!r}), expected JSON of Harmonics"
            ) from None
        return cls.from_array(coefficients)

    def save(self, path: str | PathLike[str]) -> None:
        """Write the coefficients: to a ``.json``, or to an image as a row of (order + 1)² texels in float32.

        Raises
        ------
        FileError
            If the path cannot be written.
        """
        if fspath(path).lower().endswith(".json"):
            write_text(Path(path), self.to_json())
        else:
            EnvMap.from_array(self.coefficients[None], "latlong").save(path, format="float32")

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Harmonics:
        """Read what `save` and ``mb-envmap prefilter --model sh`` write: JSON, or a row of coefficients.

        Raises
        ------
        InputError, FileError
            If there is no such file, or it is damaged: of JSON the first, of an image the second.
        InvalidArgument
            It has no such coefficients, or a number of them that is not (order + 1)².
        """
        if fspath(path).lower().endswith(".json"):
            return cls.from_json(read_text(Path(path), at_most=_LARGEST_JSON))
        row = EnvMap.load(path, "latlong").level()
        if row.shape[0] != 1:
            raise _core.InvalidArgument(
                f"{fspath(path)} has {row.shape[0]} rows, expected one of coefficients"
            )
        return cls.from_array(row[0])

    def error_map(self, envmap: EnvMap, size: int | tuple[int, int], projection: str = "cube") -> EnvMap:
        """Error of the irradiance of these harmonics of radiance against the exact one, by texel."""
        exact = irradiance(envmap, size, projection)
        ours = self.irradiance().evaluate(size, projection)
        return EnvMap(exact.layout, ours.values - exact.values, exact.channels)

"""Fresnel reflectance of smooth surfaces (spec section 3): exact models, tables, metals and layers.

Cosines are those between the direction to the eye and the normal, on the side the light comes from. They
are clamped to [0, 1]; NaN stays NaN. Arrays of anything but real numbers are a TypeError. Everything
broadcasts as NumPy does. Results are float32 where all arrays are float32 (Python numbers do not count), else
float64.

>>> import numpy as np
>>> from mirrorbake import fresnel
>>> float(fresnel.dielectric(1.0, 1.5))
0.04
>>> fresnel.conductor(np.float32([0, 0.5, 1]), 0.2, 3.9).dtype
dtype('float32')
"""

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from mirrorbake import _core
from mirrorbake.arrays import real_array
from mirrorbake.literals import FresnelModel, Illuminant

__all__ = [
    "Conductor",
    "Dielectric",
    "FresnelTable",
    "MetalColour",
    "Schlick",
    "conductor",
    "dielectric",
    "dielectric_transmittance",
    "make_table",
    "metal_colour",
    "metal_names",
    "metal_reflectance",
    "schlick",
    "table_for_error",
]

Array: TypeAlias = npt.NDArray[np.floating[Any]]
ArrayLike: TypeAlias = npt.ArrayLike


_NATIVE = (np.dtype(np.float32), np.dtype(np.float64))


def _result_type(*values: ArrayLike) -> type[np.float32] | type[np.float64]:
    arrays = [np.asarray(value).dtype for value in values if not isinstance(value, (int, float))]
    return np.float32 if arrays and all(dtype == np.float32 for dtype in arrays) else np.float64


def _broadcast(c: ArrayLike, parameters: dict[str, ArrayLike]) -> tuple[Array, tuple[Any, ...]]:
    """Cosines and parameters of one type: one number per parameter where all are scalars, else arrays."""
    dtype: Any = _result_type(c, *parameters.values())
    cosines = real_array("c", c, dtype)
    if all(np.ndim(parameter) == 0 for parameter in parameters.values()):
        return cosines, tuple(float(real_array(name, p, np.float64)) for name, p in parameters.items())
    arrays = np.broadcast_arrays(cosines, *(real_array(name, p, dtype) for name, p in parameters.items()))
    return arrays[0], tuple(np.ascontiguousarray(array) for array in arrays[1:])


def _apply(function: Any, out: Array | None, c: ArrayLike, **parameters: ArrayLike) -> Array:
    """Call a function of C-contiguous arrays of one type; arrays with plain numbers go straight to it."""
    arguments: tuple[Any, ...] = tuple(parameters.values())
    if not (type(c) is np.ndarray and c.dtype in _NATIVE and all(isinstance(p, float) for p in arguments)):
        c, arguments = _broadcast(c, parameters)
    if out is None:
        out = np.empty(c.shape, c.dtype)
    elif out.shape != c.shape or out.dtype != c.dtype or not out.flags.c_contiguous:
        message = f"out is {out.dtype} {out.shape}, expected C-contiguous {c.dtype} {c.shape}"
        raise _core.InvalidArgument(message)
    function(np.ascontiguousarray(c), *arguments, out)
    return out


def schlick(c: ArrayLike, r0: ArrayLike, out: Array | None = None) -> Array:
    """Schlick's approximation ``r0 + (1 - r0) (1 - c)**5``.

    Parameters
    ----------
    c : cosines, any shape.
    r0 : reflectance at normal incidence, in [0, 1].
    out : array to fill instead of a new one: shape and dtype of the result, C-contiguous, apart from inputs.

    Returns
    -------
    Reflectance in [0, 1], shape of ``c`` and ``r0`` broadcast.

    Raises
    ------
    InvalidArgument : ``r0`` out of range.

    Notes
    -----
    Schlick 1994, "An inexpensive BRDF model for physically-based rendering", eq. 15.
    """
    return _apply(_core.fresnel_schlick, out, c, r0=r0)


def dielectric(c: ArrayLike, ior: ArrayLike, out: Array | None = None) -> Array:
    """Unpolarised reflectance of a dielectric; 1 on total internal reflection.

    Parameters
    ----------
    c : cosines, any shape.
    ior : relative index, transmitted side over incident side, above 0 and at most 1e100. 1 reflects nothing.
    out : array to fill instead of a new one, see :func:`schlick`.

    Returns
    -------
    Reflectance in [0, 1], shape of ``c`` and ``ior`` broadcast; within 4 ulp + 1e-7 (float32) or
    4 ulp + 1e-15 (float64) of the exact value.

    Raises
    ------
    InvalidArgument : ``ior`` out of range.

    Notes
    -----
    [EMT] eq. 13, in a form without cancellation.
    """
    return _apply(_core.fresnel_dielectric, out, c, ior=ior)


def dielectric_transmittance(c: ArrayLike, ior: float) -> npt.NDArray[np.float64]:
    """What a dielectric lets through, ``1 - dielectric(c, ior)``, accurate also where that is nearly 0."""
    transmittance = np.vectorize(_core.fresnel_dielectric_transmittance, otypes=[np.float64])
    return np.asarray(transmittance(real_array("c", c, np.float64), ior))


def conductor(c: ArrayLike, eta: ArrayLike, k: ArrayLike, out: Array | None = None) -> Array:
    """Unpolarised reflectance of a conductor of complex relative index ``eta + i k``.

    Parameters
    ----------
    c : cosines, any shape.
    eta : refractive index, above 0 and at most 1e40.
    k : extinction coefficient, 0 to 1e40; 0 is :func:`dielectric`.
    out : array to fill instead of a new one, see :func:`schlick`.

    Returns
    -------
    Reflectance in [0, 1], shape of all three broadcast, as accurate as :func:`dielectric`.

    Raises
    ------
    InvalidArgument : ``eta`` or ``k`` out of range.

    Notes
    -----
    Born & Wolf, Principles of Optics, section 14.2.
    """
    return _apply(_core.fresnel_conductor, out, c, eta=eta, k=k)


@dataclass(frozen=True)
class Schlick:
    """F1: :func:`schlick` with one ``r0``."""

    r0: float

    def __call__(self, c: ArrayLike) -> Array:
        """Reflectance at cosines ``c``."""
        return schlick(c, self.r0)


@dataclass(frozen=True)
class Dielectric:
    """F2: :func:`dielectric` with one relative index."""

    ior: float

    def __call__(self, c: ArrayLike) -> Array:
        """Reflectance at cosines ``c``."""
        return dielectric(c, self.ior)


@dataclass(frozen=True)
class Conductor:
    """F3: :func:`conductor` with one complex index."""

    eta: float
    k: float

    def __call__(self, c: ArrayLike) -> Array:
        """Reflectance at cosines ``c``."""
        return conductor(c, self.eta, self.k)


Model: TypeAlias = Schlick | Dielectric | Conductor


class FresnelTable:
    """F4: reflectance at equal steps of the cosine, interpolated linearly."""

    def __init__(self, table: _core.FresnelTable) -> None:
        self._table = table

    @property
    def values(self) -> npt.NDArray[np.float32]:
        """Reflectance at c = 0, 1/(size − 1), …, 1; read-only."""
        return np.asarray(self._table.values)

    @property
    def max_error(self) -> float:
        """Largest deviation from the exact curve over [0, 1]."""
        return self._table.max_error

    def __len__(self) -> int:
        return len(self.values)

    def __call__(self, c: ArrayLike, out: Array | None = None) -> Array:
        """Interpolated reflectance at cosines ``c``."""
        return _apply(self._table.evaluate, out, c)


def _table_arguments(model: Model) -> tuple[FresnelModel, float, float]:
    match model:
        case Schlick(r0):
            return "schlick", r0, 0.0
        case Dielectric(ior):
            return "dielectric", ior, 0.0
        case Conductor(eta, k):
            return "conductor", eta, k


def make_table(model: Model, size: int) -> FresnelTable:
    """Table of ``size`` entries, 2 to 65536."""
    return FresnelTable(_core.make_fresnel_table(*_table_arguments(model), size))


def table_for_error(model: Model, max_error: float) -> FresnelTable:
    """Smallest table within ``max_error`` of the model, 1e-6 to 1.

    Raises
    ------
    InvalidArgument : ``max_error`` out of range.
    NumericalError : 65536 entries do not do: total internal reflection sets in with a vertical tangent.

    Examples
    --------
    >>> from mirrorbake.fresnel import Dielectric, table_for_error
    >>> table = table_for_error(Dielectric(1.5), 1e-3)
    >>> len(table) < 100, table.max_error <= 1e-3
    (True, True)
    """
    return FresnelTable(_core.fresnel_table_for_error(*_table_arguments(model), max_error))


def metal_names() -> list[str]:
    """Names of the metals whose measured optical constants the library holds."""
    return _core.metal_names()


def metal_reflectance(metal: str, c: ArrayLike, illuminant: Illuminant = "D65") -> npt.NDArray[np.float64]:
    """Reflectance of a metal as linear Rec.709, from its measured spectrum.

    Parameters
    ----------
    metal : name or chemical symbol, see :func:`metal_names`.
    c : cosines, any shape.
    illuminant : "D65" or "E" (equal energy): the light in which the colour is seen.

    Returns
    -------
    Shape of ``c`` plus (3,). A perfect mirror is (1, 1, 1). Not clamped: gold's red is 1.04.

    Raises
    ------
    ValueError : unknown metal or illuminant.

    Notes
    -----
    CIE 1931 2° observer, 380 to 780 nm in steps of 5 nm; Johnson & Christy 1972, 1974, Rakić 1995.
    """
    cosines = real_array("c", c, np.float64)
    flat = _core.metal_reflectance(metal, np.ascontiguousarray(cosines), illuminant)
    return np.asarray(flat.reshape((*cosines.shape, 3)))


@dataclass(frozen=True)
class MetalColour:
    """A metal as renderers want it, per channel of linear Rec.709, with largest errors over all angles."""

    metal: str
    illuminant: Illuminant
    source: str
    normal: tuple[float, float, float]  # reflectance at normal incidence, not clamped
    r0: tuple[float, float, float]  # of the Schlick curve closest over all angles (least squares)
    r0_error: tuple[float, float, float]
    eta: tuple[float, float, float]  # effective complex index, least squares too
    k: tuple[float, float, float]
    index_error: tuple[float, float, float]


def metal_colour(metal: str, illuminant: Illuminant = "D65") -> MetalColour:
    """Fit three-channel models to :func:`metal_reflectance`."""
    fit = _core.fit_metal(metal, illuminant)
    red, green, blue = metal_reflectance(metal, 1.0, illuminant).tolist()
    source = _core.metal_source(metal)
    return MetalColour(
        metal, illuminant, source, (red, green, blue), fit.r0, fit.r0_error, fit.eta, fit.k, fit.index_error
    )

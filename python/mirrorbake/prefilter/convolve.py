"""Maps of the light that a lobe gathers, by the direction of its axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.arrays import real_array
from mirrorbake.envmap import EnvMap
from mirrorbake.projection import vectors
from mirrorbake.resample import height_and_width

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import ArrayLike, NDArray

    from mirrorbake.literals import LobeScale, RoughnessScale


def lambert() -> _core.Lobe:
    """Cosine lobe: max(0, cos γ)."""
    return _core.Lobe("lambert")


def phong(exponent: float) -> _core.Lobe:
    """Lobe of Phong: max(0, cos γ)^exponent, exponent 1 to 1e6, or infinity for a mirror."""
    return _core.Lobe("phong", exponent)


def ggx(alpha: float) -> _core.Lobe:
    """Lobe of GGX for a viewer along the normal: D(h) max(0, cos γ); alpha 0.01 to 1, or 0 for a mirror."""
    return _core.Lobe("ggx", alpha)


def table(weights: ArrayLike, largest_angle: float = 180.0) -> _core.Lobe:
    """Any lobe: weights ≥ 0 at equal steps of the angle from 0 to ``largest_angle`` degrees, 0 beyond.

    Monotone cubics that are flat at 0 connect them.
    """
    values = real_array("weights", weights, np.float64)
    if values.ndim != 1:
        raise _core.InvalidArgument(f"weights has shape {values.shape}, expected one dimension")
    return _core.Lobe("table", largest_angle, values.tolist())


class Prefilter:
    """Convolves one map with any number of lobes, and keeps what it has found out about the map.

    Texels count as lights at their middles, with their exact solid angle; those wider than 1.25 σ of a lobe
    are cut into parts. Cosine lobes and narrow ones are exact but for rounding; others are within 1e-3 of
    the sum over all texels.

    Parameters
    ----------
    envmap
        The finest level is read.

    Raises
    ------
    InvalidArgument
        The map has NaN or infinite values; the message says how many.

    Examples
    --------
    >>> white = EnvMap.from_array(np.full((16, 32, 3), 2.0, np.float32), "latlong")
    >>> several = Prefilter(white)
    >>> [float(several.apply(phong(n), 8).values.max().round(4)) for n in (1, 10, 1000)]
    [2.0, 2.0, 2.0]
    """

    def __init__(self, envmap: EnvMap) -> None:
        self._convolver = _core.Convolver(envmap.layout, envmap.values)
        self._channels = envmap.channels

    def apply(
        self,
        lobe: _core.Lobe,
        size: int | tuple[int, int],
        projection: str = "cube",
        *,
        scale: LobeScale = "mean",
        progress: Callable[[float], None] | None = None,
    ) -> EnvMap:
        """Return the map of the lobe by the direction of its axis.

        Parameters
        ----------
        lobe
            From `lambert`, `phong`, `ggx` or `table`.
        size
            Height of a face, or (height, width).
        projection
            What to make.
        scale
            ``mean``: the weighted mean, which keeps white white. ``sum``: ∫ weight L dω, as [AEM] eq. 7 has
            it, in radiance times steradian.
        progress
            Called with the share of the texels that are done, rising to 1.

        Raises
        ------
        InvalidArgument
            For unknown names and sizes that are not 1 to 65536, and for the sum of a mirror.
        """
        height, width = height_and_width(projection, size)
        layout, values = self._convolver.apply(lobe, projection, width, height, scale, progress)
        return EnvMap(layout, values, list(self._channels))

    def sample(
        self, lobe: _core.Lobe, directions: ArrayLike, *, scale: LobeScale = "mean"
    ) -> NDArray[np.float32]:
        """Values (..., C) of lobes about directions (..., 3); InvalidArgument for NaN and zero ones."""
        array = vectors("directions", directions, 3)
        values = self._convolver.sample(lobe, array.reshape(-1, 3), scale, len(self._channels))
        return values.reshape((*array.shape[:-1], len(self._channels)))


def prefilter(
    envmap: EnvMap,
    lobe: _core.Lobe,
    size: int | tuple[int, int],
    projection: str = "cube",
    *,
    scale: LobeScale = "mean",
) -> EnvMap:
    """Convolve the finest level of a map with one lobe; see `Prefilter.apply`."""
    return Prefilter(envmap).apply(lobe, size, projection, scale=scale)


def irradiance(envmap: EnvMap, size: int | tuple[int, int], projection: str = "cube") -> EnvMap:
    """∫ max(0, n·l) L dω by the normal ([AEM] eq. 4 without k_d/π): about π for a white map."""
    return prefilter(envmap, lambert(), size, projection, scale="sum")


def ggx_chain(
    envmap: EnvMap,
    size: int = 256,
    levels: int = 0,
    *,
    roughness: RoughnessScale = "squared",
    progress: Callable[[int, int], None] | None = None,
) -> EnvMap:
    """Return a cube whose levels are prefiltered with GGX, from the map itself to α = 1.

    Parameters
    ----------
    envmap
        The finest level is read.
    size
        Texels of a face of the first level.
    levels
        Number of levels; 0: down to 4×4 texels.
    roughness
        ``squared``: α = (level / last)², for renderers that look levels up by perceptual roughness.
        ``linear``: α = level / last.
    progress
        Called with the number of a level that is done, and how many there are.

    Raises
    ------
    InvalidArgument
        For sizes outside of 1 to 16384, more levels than there are, unknown names, NaN and infinite values.
    """
    layout, values = _core.ggx_chain(envmap.layout, envmap.values, size, levels, roughness, progress)
    return EnvMap(layout, values, list(envmap.channels))


def chain_alphas(levels: int, *, roughness: RoughnessScale = "squared") -> NDArray[np.float64]:
    """α of every level of a `ggx_chain`: 0 first, then at least 0.01.

    >>> chain_alphas(3).tolist()
    [0.0, 0.25, 1.0]
    """
    return np.array([_core.chain_alpha(level, levels, roughness) for level in range(levels)])


def split_sum(cosine: float, alpha: float) -> tuple[float, float]:
    """Scale and bias of r₀ that a GGX surface reflects of a white world: Karis' second sum.

    Parameters
    ----------
    cosine
        n·v, above 0 and up to 1.
    alpha
        Above 0 and up to 1.
    """
    return _core.split_sum(cosine, alpha)


def split_sum_table(size: int = 128, *, roughness: RoughnessScale = "squared") -> NDArray[np.float32]:
    """Scale, bias and their sum E, (size, size, 3): rows by roughness, columns by n·v, at (i + ½)/size.

    A renderer reflects ``chain(r, roughness) * (r0 * scale + bias)``, times ``1 + r0 * (1 / E - 1)`` for
    light that is reflected between microfacets more than once.

    >>> t = split_sum_table(8)
    >>> bool(np.all(t[..., 2] <= 1.001))
    True
    """
    return _core.split_sum_table(size, roughness)

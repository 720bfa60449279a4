"""Resampling of environment maps, and what of it is kept for the frames of a film."""

from __future__ import annotations

from dataclasses import replace
from operator import index
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.arrays import real_array

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from mirrorbake.envmap import EnvMap
    from mirrorbake.literals import ResampleFilter

__all__ = ["Resampler"]

_MAX_SIDE = 65536  # texels, as in C++


class Resampler:
    """Resamples maps of one projection and size, such as the frames of a film.

    It finds once what every texel of the target is made from, which is most of the work, and keeps it.
    `apply` gives the same bits as `EnvMap.resample`.

    Parameters
    ----------
    source
        A map, or the layout of one: the projection and size of those to come, of any number of channels.
    projection, size, filter, source_from_target
        As for `EnvMap.resample`.
    max_bytes
        Keep at most so much; what does not fit is found again every time. Typical are 5 bytes for each texel
        of the source that a texel of the target reads, divided by the symmetries that both maps share: 16
        between a panorama and a cube, 1 if they are turned against each other.

    Examples
    --------
    >>> from mirrorbake.envmap import EnvMap
    >>> frames = [EnvMap.from_array(np.full((64, 128, 3), i, np.float32), "latlong") for i in range(3)]
    >>> to_cube = Resampler(frames[0], "cube", 32)
    >>> [round(float(to_cube.apply(frame).values.max()), 5) for frame in frames]
    [0.0, 1.0, 2.0]
    """

    def __init__(
        self,
        source: EnvMap | _core.EnvMapLayout,
        projection: str,
        size: int | tuple[int, int],
        *,
        filter: ResampleFilter = "automatic",
        source_from_target: ArrayLike | None = None,
        max_bytes: int = 1 << 30,
    ) -> None:
        layout = source if isinstance(source, _core.EnvMapLayout) else source.layout
        self._resampler = make_resampler(layout, projection, size, filter, source_from_target, max_bytes)

    def apply(self, envmap: EnvMap) -> EnvMap:
        """Return the finest level in the projection and size of the target.

        Raises
        ------
        InvalidArgument
            If the map has another projection or size than the resampler was made for.
        """
        return resampled(self._resampler, envmap)

    @property
    def bytes(self) -> int:
        """Memory of what is kept."""
        return self._resampler.bytes


def height_and_width(projection: str, size: int | tuple[int, int]) -> tuple[int, int]:
    aspect = _core.natural_aspect(projection)
    try:
        if isinstance(size, tuple | list):
            height, width = (index(side) for side in size)
        else:
            height = index(size)
            width = aspect * height
    except (TypeError, ValueError):
        raise _core.InvalidArgument(f"size is {size!r}, expected a height, or (height, width)") from None
    if max(height, width) > _MAX_SIDE:
        raise _core.InvalidArgument(f"size is {size!r}, expected 1 to {_MAX_SIDE} texels a side")
    return height, width


def make_resampler(
    source: _core.EnvMapLayout,
    projection: str,
    size: int | tuple[int, int],
    filter: ResampleFilter,
    source_from_target: ArrayLike | None,
    max_bytes: int,
) -> _core.Resampler:
    height, width = height_and_width(projection, size)
    matrix = np.eye(3, dtype=np.float32) if source_from_target is None else source_from_target
    matrix = np.ascontiguousarray(real_array("source_from_target", matrix, np.float32))
    if matrix.shape != (3, 3):
        raise _core.InvalidArgument(f"source_from_target has shape {matrix.shape}, expected (3, 3)")
    if max_bytes < 0:
        raise _core.InvalidArgument(f"max_bytes is {max_bytes}, expected 0 or more")
    return _core.Resampler(source, projection, width, height, filter, matrix, max_bytes)


def resampled(resampler: _core.Resampler, envmap: EnvMap) -> EnvMap:
    layout = resampler.layout(envmap.layout.channels)
    values = np.empty(layout.size, np.float32)  # NumPy asks for large pages; they take a tenth of the time
    resampler.apply(envmap.layout, envmap.values, values)
    return replace(envmap, layout=layout, values=values)

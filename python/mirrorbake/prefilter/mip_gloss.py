"""Gloss by the levels of a map, the cheapest there is: [AEM] §4.2.

Hardware adds a bias b to the level of detail. Where that is 0 otherwise, as on a flat mirror, level b is what
is seen. It looks like Phong with some exponent, which `exponent_for_level` finds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize_scalar

from mirrorbake import _core
from mirrorbake.envmap import EnvMap
from mirrorbake.prefilter.convolve import Prefilter, phong
from mirrorbake.projection import texel_directions

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


def sample_level(envmap: EnvMap, directions: ArrayLike, level: float) -> NDArray[np.float32]:
    """Values (..., C) of an explicit level, interpolated within levels and between them.

    Levels outside of those that exist are clamped.

    Raises
    ------
    InvalidArgument
        For NaN, infinite and zero directions, and levels that are not finite.
    """
    if not np.isfinite(level):
        raise _core.InvalidArgument(f"level is {level}, expected a finite number")
    return envmap.sample(directions, filter="trilinear", level=level)


def exponent_for_level(envmap: EnvMap, level: float, size: int = 21) -> tuple[float, float]:
    """Exponent of the normalised Phong lobe that a level is most like, and how unlike it still is.

    Parameters
    ----------
    envmap
        With its levels; the finest is what the lobe filters. How they were made (``box``, ``solid_angle``,
        ``seamless``) is part of the result.
    level
        Or bias.
    size
        Faces of the cube at whose texels both are compared. An odd number: texels of sizes that divide the
        map's lie where several levels have the same values.

    Returns
    -------
    exponent, error
        1 to 1e5, and the relative L2 error at it.
    """
    directions = np.stack([texel_directions("cube", size, size, face) for face in range(6)])
    seen = sample_level(envmap, directions, level).astype(np.float64)
    finest = Prefilter(EnvMap.from_array(envmap.level(0), envmap.projection, envmap.channels))

    def error(log_exponent: float) -> float:
        lobe = finest.apply(phong(float(np.exp(log_exponent))), size).level()
        return float(np.linalg.norm(lobe - seen) / np.linalg.norm(seen))

    # The error has one valley, but near it and far from it is flat: a coarse search before the fine one.
    coarse = np.linspace(0, np.log(1e5), 12)
    errors = [error(value) for value in coarse]
    best = int(np.argmin(errors))
    low, high = coarse[max(0, best - 1)], coarse[min(len(coarse) - 1, best + 1)]
    found = minimize_scalar(error, bounds=(low, high), method="bounded", options={"xatol": 0.02})
    return float(np.exp(found.x)), float(found.fun)

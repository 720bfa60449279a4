"""Environment maps filtered ahead of rendering: diffuse, Phong, GGX and any other lobe; harmonics.

Examples
--------
>>> import numpy as np
>>> from mirrorbake.envmap import EnvMap
>>> white = EnvMap.from_array(np.ones((32, 64, 3), np.float32), "latlong")
>>> prefilter(white, phong(50.0), 16).level().shape
(6, 16, 16, 3)
>>> float(np.abs(prefilter(white, ggx(0.25), 16).values - 1).max()) < 1e-6
True
>>> chain = ggx_chain(white, 64)
>>> chain.levels
5
"""

from mirrorbake._core import Lobe, alpha_from_exponent, exponent_from_alpha, lambert_factor
from mirrorbake.prefilter.convolve import (
    Prefilter,
    chain_alphas,
    ggx,
    ggx_chain,
    irradiance,
    lambert,
    phong,
    prefilter,
    split_sum,
    split_sum_table,
    table,
)
from mirrorbake.prefilter.harmonics import Harmonics

__all__ = [
    "Harmonics",
    "Lobe",
    "Prefilter",
    "alpha_from_exponent",
    "chain_alphas",
    "exponent_from_alpha",
    "ggx",
    "ggx_chain",
    "irradiance",
    "lambert",
    "lambert_factor",
    "phong",
    "prefilter",
    "split_sum",
    "split_sum_table",
    "table",
]

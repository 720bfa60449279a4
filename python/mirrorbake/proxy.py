"""Proxy geometry: the shape on which an environment map lies (spec section 4, [PEM] section 4).

A lookup follows a reflected ray from the surface to where it leaves the shape, and reads the map in the
direction of that point as seen from the map's origin:

>>> import numpy as np
>>> from mirrorbake.proxy import Proxy
>>> room = Proxy.box(centre=(0, 1, 0), half_extent=(3, 1, 3), origin=(0, 0.5, 0))
>>> room.lookup(np.array([[0.0, 0.5, 0.0]]), np.array([[1.0, 0.0, 0.0]])).tolist()
[[3.0, 0.0, 0.0]]
"""

from mirrorbake._core import (
    Proxy,
    area_weighted_centroid,
    fit_box_mean_distance,
    fit_box_robust,
    fit_ellipsoid,
)

__all__ = [
    "Proxy",
    "area_weighted_centroid",
    "fit_box_mean_distance",
    "fit_box_robust",
    "fit_ellipsoid",
]

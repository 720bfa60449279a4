"""Proxy geometry: the shape on which an environment map lies (spec section 4, [PEM] section 4).

A lookup follows a reflected ray from the surface to where it leaves the shape, and reads the map in the
direction of that point as seen from the map's origin:

>>> import numpy as np
>>> from mirrorbake.proxy import Proxy
>>> room = Proxy.box(centre=(0, 1, 0), half_extent=(3, 1, 3), origin=(0, 0.5, 0))
>>> room.lookup(np.array([[0.0, 0.5, 0.0]]), np.array([[1.0, 0.0, 0.0]])).tolist()
[[3.0, 0.0, 0.0]]
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mirrorbake import _core
from mirrorbake._core import (
    Proxy,
    ProxyCandidate,
    ProxyChoice,
    area_weighted_centroid,
    choose_proxy,
    fit_box_mean_distance,
    fit_box_robust,
    fit_ellipsoid,
    mirror_lookups,
)

__all__ = [
    "FAMILIES",
    "SHAPES",
    "Proxy",
    "ProxyCandidate",
    "ProxyChoice",
    "area_weighted_centroid",
    "choose_proxy",
    "fit_box_mean_distance",
    "fit_box_robust",
    "fit_ellipsoid",
    "hull_triangles",
    "mirror_lookups",
    "proxy_from_attributes",
    "proxy_to_attributes",
]


def hull_triangles(
    positions: NDArray[np.float32], triangles: NDArray[np.uint32], tolerance: float = 1e-4
) -> NDArray[np.bool_]:
    """Tell which triangles lie on the mesh's convex hull: they can never reflect the object itself.

    Such polygons need the distant layer only, whatever the view ([PEM] section 4). A triangle counts as on
    the hull if no vertex is in front of its plane by more than the tolerance.

    Parameters
    ----------
    positions
        (n, 3), metres.
    triangles
        (m, 3) indices, counter-clockwise seen from outside.
    tolerance
        Depth of dents that do not count, as a fraction of the bounding box's diagonal.

    Returns
    -------
        (m,) booleans; False for triangles without area.

    Raises
    ------
    InvalidArgument
        Indices out of range, coordinates that are not finite, a negative tolerance.
    """
    return _core.hull_triangles(positions, triangles, tolerance).astype(np.bool_)


SHAPES: Mapping[str, tuple[str, ...]] = _core.proxy_shapes()
"""What tells a shape besides the map's origin: attributes of a `Proxy`, and arguments of the constructor that
bears the shape's name."""

FAMILIES: tuple[str, ...] = tuple(_core.proxy_families())
"""What `choose_proxy` fits, in rising order of parameters."""


def proxy_from_attributes(description: Mapping[str, Any]) -> _core.Proxy:
    """Return the proxy that a PEM's attributes describe."""
    values = {name: description[name] for name in ("origin", *SHAPES[description["shape"]])}
    if "axes" in values:
        values["axes"] = np.array(values["axes"], np.float32)
    proxy: _core.Proxy = getattr(_core.Proxy, description["shape"])(**values)
    return proxy


def proxy_to_attributes(proxy: _core.Proxy) -> dict[str, Any]:
    """Inverse of `proxy_from_attributes`."""
    description: dict[str, Any] = {"shape": proxy.kind}
    for field in (*SHAPES[proxy.kind], "origin"):
        description[field] = np.asarray(getattr(proxy, field)).astype(float).tolist()
    return description

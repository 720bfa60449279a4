"""How exact lookups on proxies are: against 50 digits, over shape, flatness and distance from the wall.

The library takes and returns float32 but computes in float64. The study shows what that is worth: the same
lookups in float32 arithmetic, by NumPy and the textbook formulas, lose one to three digits.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake.proxy import Proxy

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

DEPTHS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
DIGITS = 50


@dataclass(frozen=True)
class ProxyError:
    """Angles between computed and true lookup directions in one part of the domain, radians."""

    shape: str
    aspect: float
    """Largest extent over smallest."""
    depth: float
    """Distance of the positions from the wall, in units of the extent."""
    arithmetic: str
    """'mirrorbake float32' and 'mirrorbake float64' (arrays in and out), 'NumPy float32', 'NumPy float64'."""
    largest: float
    mean: float


def _extent(proxy: Proxy) -> NDArray[Any]:
    if proxy.kind == "hemisphere":
        return np.full(3, proxy.radius)
    return np.array(proxy.half_extent if proxy.kind == "box" else proxy.radii)


def _rays_near_the_wall(
    rng: np.random.Generator, proxy: Proxy, depth: float, count: int, dtype: type
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Positions at `depth` from the wall, and directions; none that rounding brings too close to it."""
    axes = proxy.axes.astype(np.float64)
    centre, extent = np.array(proxy.centre), _extent(proxy)
    norm = np.inf if proxy.kind == "box" else 2
    local = rng.normal(size=(count, 3))
    local *= (1 - depth) / np.linalg.norm(local, ord=norm, axis=1, keepdims=True)
    if proxy.kind == "hemisphere":  # half of them near the dome, half near the floor
        local[:, 1] = np.where(np.arange(count) % 2, np.maximum(np.abs(local[:, 1]), depth), depth)
    positions: NDArray[Any] = (centre + (local * extent) @ axes).astype(dtype)
    directions: NDArray[Any] = rng.normal(size=(count, 3)).astype(dtype)
    back = ((positions.astype(np.float64) - centre) @ axes.T) / extent
    inside = np.linalg.norm(back, ord=norm, axis=1) < 1 - 0.5 * depth
    if proxy.kind == "hemisphere":
        inside &= back[:, 1] > 0.5 * depth
    return positions[inside], directions[inside]


def _library_lookup(proxy: Proxy, p: NDArray[Any], d: NDArray[Any]) -> NDArray[Any]:
    return proxy.lookup(p, d) if p.dtype == np.float32 else proxy.lookup_float64(p, d)


def _numpy_lookup(proxy: Proxy, p: NDArray[Any], d: NDArray[Any]) -> NDArray[Any]:
    """Textbook lookup in the arithmetic of the arrays."""
    dtype = p.dtype.type
    axes: NDArray[Any] = proxy.axes.astype(dtype)
    q, e = (p - np.array(proxy.centre, dtype)) @ axes.T, d @ axes.T
    with np.errstate(all="ignore"):
        if proxy.kind == "box":
            t = np.min((np.copysign(np.array(proxy.half_extent, dtype), e) - q) / e, axis=1)
        else:
            radii: NDArray[Any] = _extent(proxy).astype(dtype)
            q, e = q / radii, e / radii
            a, b, c = np.sum(e * e, 1), np.sum(q * e, 1), np.sum(q * q, 1) - dtype(1)
            t = (-b + np.sqrt(b * b - a * c)) / a
            if proxy.kind == "hemisphere":
                t = np.where(e[:, 1] < 0, np.minimum(t, -q[:, 1] / e[:, 1]), t)
    lookup: NDArray[Any] = p + t[:, None] * d - np.array(proxy.origin, dtype)
    return lookup


def _exact_errors(
    proxy: Proxy, p: NDArray[Any], d: NDArray[Any], lookups: dict[str, NDArray[Any]]
) -> dict[str, list[float]]:
    """Angle of each lookup to the one that mpmath computes from the same numbers with 50 digits."""
    from mpmath import mp, mpf

    errors: dict[str, list[float]] = {name: [] for name in lookups}
    with mp.workdps(DIGITS):

        def exact(values: Any) -> list[Any]:
            return [mpf(float(value)) for value in values]

        def dot(a: list[Any], b: list[Any]) -> Any:
            return mp.fsum(x * y for x, y in zip(a, b, strict=True))

        axes = [exact(row) for row in proxy.axes]
        centre, origin = exact(proxy.centre), exact(proxy.origin)
        extent = exact(_extent(proxy))
        for i in range(len(p)):
            position, direction = exact(p[i]), exact(d[i])
            offset = [x - c for x, c in zip(position, centre, strict=True)]
            q = [dot(axis, offset) / r for axis, r in zip(axes, extent, strict=True)]
            e = [dot(axis, direction) / r for axis, r in zip(axes, extent, strict=True)]
            if proxy.kind == "box":
                t = min((mp.sign(v) - u) / v for u, v in zip(q, e, strict=True) if v != 0)
            else:
                a, b, c = dot(e, e), dot(q, e), dot(q, q) - 1
                t = (-b + mp.sqrt(b * b - a * c)) / a
                if proxy.kind == "hemisphere" and e[1] < 0:
                    t = min(t, -q[1] / e[1])
            true = [x + t * v - o for x, v, o in zip(position, direction, origin, strict=True)]
            for name, lookup in lookups.items():
                got = exact(lookup[i])
                if not all(mp.isfinite(x) for x in got):
                    errors[name].append(float(mp.pi))
                    continue
                cross = [
                    true[1] * got[2] - true[2] * got[1],
                    true[2] * got[0] - true[0] * got[2],
                    true[0] * got[1] - true[1] * got[0],
                ]
                errors[name].append(float(mp.atan2(mp.sqrt(dot(cross, cross)), dot(true, got))))
    return errors


def proxy_errors(samples: int = 50, seed: int = 1, depths: tuple[float, ...] = DEPTHS) -> list[ProxyError]:
    """Measure the error of lookups over the whole domain against mpmath with 50 digits.

    Parameters
    ----------
    samples
        Rays per part of the domain.
    seed
        Of the random rays.
    depths
        Distances of the positions from the wall, in units of the extent.

    Returns
    -------
        One entry per shape, aspect ratio, depth and arithmetic. Needs mpmath (in the extra `dev`).
    """
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0].astype(np.float32)
    shapes: dict[str, Callable[..., Proxy]] = {
        "box": Proxy.box,
        "ellipsoid": Proxy.ellipsoid,
        "hemisphere": lambda centre, extent, origin, axes: Proxy.hemisphere(centre, extent[0], origin, axes),
    }
    result = []
    for kind, make in shapes.items():
        for rotated in (False, True):
            for aspect in (1.0,) if kind == "hemisphere" else (1.0, 1e2, 1e4):
                extent, centre = np.array([3.0, 3.0 / aspect, 2.0]), np.array([1.0, -2.0, 0.5])
                axes = turn if rotated else np.eye(3, dtype=np.float32)
                lift = 0.5 if kind == "hemisphere" else -0.5
                origin = centre + (0.3 * extent * (1.0, lift, 0.7)) @ axes
                proxy = make(tuple(centre), tuple(extent), tuple(origin), axes)
                for depth in depths:
                    for dtype in (np.float32, np.float64):
                        p, d = _rays_near_the_wall(rng, proxy, depth, samples, dtype)
                        if len(p) == 0:
                            continue
                        lookups = {
                            f"mirrorbake {dtype.__name__}": _library_lookup(proxy, p, d),
                            f"NumPy {dtype.__name__}": _numpy_lookup(proxy, p, d),
                        }
                        for name, errors in _exact_errors(proxy, p, d, lookups).items():
                            shape = ("rotated " if rotated else "") + kind
                            mean = float(np.mean(errors))
                            result.append(ProxyError(shape, aspect, depth, name, max(errors), mean))
    return result


def as_json(errors: list[ProxyError]) -> dict[str, Any]:
    """Plain values for json.dump."""
    return {"reference": f"mpmath, {DIGITS} digits", "unit": "radians", "errors": [asdict(e) for e in errors]}


def plot(errors: list[ProxyError], path: Path) -> None:
    """Write a picture of the largest errors over the depth, a panel for each aspect ratio."""
    from matplotlib.figure import Figure

    aspects = sorted({e.aspect for e in errors})
    figure = Figure(figsize=(4 * len(aspects), 4), layout="constrained")
    axes = figure.subplots(1, len(aspects), sharey=True, squeeze=False)[0]
    for axis, aspect in zip(axes, aspects, strict=True):
        for name in sorted({e.arithmetic for e in errors}):
            depths = sorted({e.depth for e in errors})
            largest = [
                max(
                    (e.largest for e in errors if (e.arithmetic, e.aspect, e.depth) == (name, aspect, depth)),
                    default=np.nan,
                )
                for depth in depths
            ]
            axis.loglog(depths, np.maximum(largest, 1e-17), marker="o", label=name)
        axis.axhline(1e-5, color="grey", linestyle="--", linewidth=1)
        axis.set_title(f"aspect ratio {aspect:g}")
        axis.set_xlabel("distance from the wall / extent")
    axes[0].set_ylabel("largest error, radians")
    axes[0].legend(fontsize="small")
    figure.savefig(path, dpi=120)

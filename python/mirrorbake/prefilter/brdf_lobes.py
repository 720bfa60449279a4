"""Radially symmetric lobes of isotropic materials, and maps with a third index: [EMT] eqs. 18–19.

What a surface reflects towards one viewer is a lobe about the mirrored direction r, or about a direction
near it, that is not quite round. Its mean over the azimuth is, and a map can be convolved with it. That
lobe differs from view to view: Kautz and McCool, "Approximation of Glossy Reflection with Prefiltered
Environment Maps", Graphics Interface 2000, keep a map for several values of ⟨n, r⟩, or one of the mean lobe.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.prefilter.convolve import Prefilter, table
from mirrorbake.projection import vectors

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from mirrorbake.envmap import EnvMap
    from mirrorbake.literals import LobeScale
    from mirrorbake.prefilter.reflection_space import Brdf

_RINGS, _AROUND, _STEPS = 400, 96, 256
_LEFT_OUT = 1e-4  # share of the energy beyond the largest angle of a table


def ggx_brdf(alpha: float, r0: float = 1.0) -> Brdf:
    """BRDF of GGX with height-correlated masking (Heitz, JCGT 2014) and Schlick's Fresnel, 1/steradian.

    Parameters
    ----------
    alpha
        Above 0 and up to 1.
    r0
        Reflectance at normal incidence, 0 to 1; 1 reflects all but what the masking takes.
    """
    if not 0 < alpha <= 1:
        raise _core.InvalidArgument(f"alpha is {alpha}, expected above 0 and up to 1")
    if not 0 <= r0 <= 1:
        raise _core.InvalidArgument(f"r0 is {r0}, expected 0 to 1")
    a2 = alpha * alpha

    def brdf(
        n_v: NDArray[np.float64], n_l: NDArray[np.float64], v_l: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        v_h = np.sqrt(np.maximum((1 + v_l) / 2, 1e-12))
        n_h = np.minimum((n_v + n_l) / (2 * v_h), 1)
        d = a2 / (np.pi * (1 + (a2 - 1) * n_h**2) ** 2)
        masked = n_l * np.sqrt(a2 + (1 - a2) * n_v**2) + n_v * np.sqrt(a2 + (1 - a2) * n_l**2)
        value: NDArray[np.float64] = d * 0.5 / masked * (r0 + (1 - r0) * (1 - v_h) ** 5)
        return value

    return brdf


@dataclass(frozen=True, eq=False)
class AxialLobe:
    """A radially symmetric lobe about an axis in the plane of normal and viewer.

    Attributes
    ----------
    lobe
        Weights f·⟨n, l⟩, averaged over the azimuth about the axis; 0 below the surface.
    reflectance
        ∫ f ⟨n, l⟩ dω: what a white world shows, and the integral of the lobe.
    shift
        Degrees from the mirrored direction to the axis, positive away from the normal.
    """

    lobe: _core.Lobe
    reflectance: float
    shift: float


def lobe_of_view(brdf: Brdf, n_v: float, *, off_specular: bool = True) -> AxialLobe:
    """Return the lobe for one viewer.

    Parameters
    ----------
    brdf
        Of n·v, n·l and v·l, as `mirrorbake.prefilter.reflection_space.radiance_map` takes it: a formula, or a
        lookup in measured values.
    n_v
        Cosine of the angle of view, above 0 and up to 1.
    off_specular
        About the mean direction of what is reflected, or else about the mirrored direction.

    Raises
    ------
    InvalidArgument
        For another cosine, and a BRDF that reflects nothing, or has negative or infinite values.

    Examples
    --------
    >>> mirrored = lobe_of_view(ggx_brdf(0.2), 1.0)
    >>> abs(mirrored.shift) < 1e-6, round(mirrored.reflectance, 2)
    (True, 0.95)
    """
    polar, weights, axis = _about_axis(brdf, n_v, off_specular)
    mean = weights.mean(1)
    energy = np.concatenate([[0.0], np.cumsum(_trapezoids(polar, 2 * np.pi * mean * np.sin(polar)))])
    reach = float(polar[min(np.searchsorted(energy, (1 - _LEFT_OUT) * energy[-1]) + 1, len(polar) - 1)])
    angles = np.linspace(0, reach, _STEPS + 1)
    theta = float(np.arccos(n_v))
    return AxialLobe(
        table(np.interp(angles, polar, mean), float(np.degrees(reach))),
        float(energy[-1]),
        float(np.degrees(axis - theta)),
    )


def average_lobe(brdf: Brdf, views: int = 16) -> AxialLobe:
    """Return the mean of the lobes about the mirrored direction, with the views that a ball shows: 2 c dc.

    Parameters
    ----------
    brdf
        As for `lobe_of_view`.
    views
        Number of views, 1 to 1024.
    """
    if not 1 <= views <= 1024:
        raise _core.InvalidArgument(f"views is {views}, expected 1 to 1024")
    cosines = np.sqrt((np.arange(views) + 0.5) / views)
    parts = [_about_axis(brdf, float(c), False) for c in cosines]
    polar = parts[0][0]
    mean = np.mean([weights.mean(1) for _, weights, _ in parts], axis=0)
    reflectance = float(_trapezoids(polar, 2 * np.pi * mean * np.sin(polar)).sum())
    angles = np.linspace(0, np.pi, 8 * _STEPS + 1)
    return AxialLobe(table(np.interp(angles, polar, mean)), reflectance, 0.0)


def several_lobes(
    filtered: Prefilter,
    lobes: Sequence[tuple[float, _core.Lobe]],
    directions: ArrayLike,
    *,
    scale: LobeScale = "mean",
) -> NDArray[np.float64]:
    """Σ k · (the light that a lobe gathers) about directions (..., 3), for pairs of k and a lobe."""
    if not lobes:
        raise _core.InvalidArgument("lobes is empty, expected pairs of a factor and a lobe")
    return sum(  # type: ignore[return-value]
        k * filtered.sample(lobe, directions, scale=scale).astype(np.float64) for k, lobe in lobes
    )


@dataclass(frozen=True, eq=False)
class ThirdIndexMaps:
    """A map for each of several ⟨n, r⟩, by the axis of the lobe ([EMT] eq. 19).

    Attributes
    ----------
    cosines
        (k,), ascending, the last one 1.
    lobes
        Of each cosine.
    maps
        ∫ p(⟨n, r⟩, ⟨axis, l⟩) L(l) dω of each cosine.
    """

    cosines: NDArray[np.float64]
    lobes: list[AxialLobe]
    maps: list[EnvMap]

    @classmethod
    def make(
        cls, envmap: EnvMap, brdf: Brdf, size: int = 64, count: int = 8, *, off_specular: bool = True
    ) -> ThirdIndexMaps:
        """Make all maps: ``count`` (1 to 256) cubes of ``size`` texels a side."""
        if not 1 <= count <= 256:
            raise _core.InvalidArgument(f"count is {count}, expected 1 to 256")
        cosines = (np.arange(count) + 1) / count
        filtered = Prefilter(envmap)
        lobes = [lobe_of_view(brdf, float(c), off_specular=off_specular) for c in cosines]
        return cls(cosines, lobes, [filtered.apply(one.lobe, size, scale="sum") for one in lobes])

    def sample(self, normals: ArrayLike, views: ArrayLike) -> NDArray[np.float64]:
        """Radiance (..., C) that surfaces reflect to viewers, linear between the cosines.

        Parameters
        ----------
        normals, views
            Unit vectors (..., 3); views point towards the viewer. Below the first cosine its map is read.
        """
        n = vectors("normals", normals, 3).astype(np.float64)
        v = np.broadcast_to(vectors("views", views, 3).astype(np.float64), n.shape)
        cosine = np.clip((n * v).sum(-1), 1e-6, 1)
        across = cosine[..., None] * n - v  # of r, times the sine
        sine = np.linalg.norm(across, axis=-1)
        across = across / np.maximum(sine, 1e-12)[..., None]
        place = np.clip(np.interp(cosine, self.cosines, np.arange(len(self.cosines))), 0, None)
        low = np.minimum(place.astype(int), max(len(self.cosines) - 2, 0))
        result = np.zeros((*n.shape[:-1], self.maps[0].layout.channels))
        for index, (one, envmap) in enumerate(zip(self.lobes, self.maps, strict=True)):
            share = np.clip(1 - np.abs(place - index), 0, 1)
            used = (share > 0) & ((low == index) | (low + 1 == index))
            if not used.any():
                continue
            angle = (np.arctan2(sine, cosine) + np.radians(one.shift))[used][..., None]
            axis = np.cos(angle) * n[used] + np.sin(angle) * across[used]
            result[used] += share[used][..., None] * envmap.sample(axis.astype(np.float32))
        return result


def _about_axis(
    brdf: Brdf, n_v: float, off_specular: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    # Angles from the axis (rings), weights f ⟨n, l⟩ (rings, around), angle of the axis from the normal.
    if not 0 < n_v <= 1:
        raise _core.InvalidArgument(f"n_v is {n_v}, expected above 0 and up to 1")
    theta = float(np.arccos(n_v))
    polar = np.pi * (np.arange(_RINGS + 1) / _RINGS) ** 2  # dense about the axis
    turn = 2 * np.pi * (np.arange(_AROUND) + 0.5) / _AROUND
    ring, around = np.meshgrid(polar, turn, indexing="ij")

    def weigh(axis: float) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        # In the plane of normal (z) and viewer (−x), and across it.
        along = np.cos(ring)
        side = np.sin(ring) * np.cos(around)
        x = np.sin(axis) * along + np.cos(axis) * side
        z = np.cos(axis) * along - np.sin(axis) * side
        lit = z > 0
        v_l = np.clip(-np.sin(theta) * x + np.cos(theta) * z, -1, 1)
        n_l = np.where(lit, z, 1.0)
        weight = np.where(lit, brdf(np.full_like(z, n_v), n_l, v_l) * n_l, 0.0)
        return weight, x, z

    weights, x, z = weigh(theta)
    if not (np.isfinite(weights).all() and (weights >= 0).all()):
        raise _core.InvalidArgument(
            "brdf has negative, NaN or infinite values, expected finite ones from 0 up"
        )
    if not weights.any():
        raise _core.InvalidArgument(f"brdf reflects nothing at n_v = {n_v}, expected values above 0")
    if not off_specular:
        return polar, weights, theta
    mean = [float(_trapezoids(polar, (weights * part).mean(1) * np.sin(polar)).sum()) for part in (x, z)]
    axis = float(np.arctan2(mean[0], mean[1]))
    return polar, weigh(axis)[0], axis


def _trapezoids(at: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    areas: NDArray[np.float64] = np.diff(at) * (values[1:] + values[:-1]) / 2
    return areas

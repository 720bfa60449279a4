"""Diffuse and glossy reflection in a single pass, from a cube that is captured again for every frame: [AEM].

The diffuse part is nine harmonics of a cube of a few texels, the glossy part a coarser level of the same
cube: nothing is convolved, so that lights may move.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.envmap import EnvMap
from mirrorbake.fresnel import schlick
from mirrorbake.prefilter.harmonics import Harmonics
from mirrorbake.prefilter.mip_gloss import sample_level
from mirrorbake.projection import vectors

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, eq=False)
class CapturedLight:
    """What arrives at one point, ready for `shade`.

    Attributes
    ----------
    cube
        With all its levels, of box filters as graphics hardware makes them.
    irradiance
        Nine coefficients per channel.

    Examples
    --------
    >>> white = EnvMap.from_array(np.ones((6, 16, 16, 3), np.float32), "cube")
    >>> light = CapturedLight.make(white)
    >>> light.shade([0, 0, 1], [0, 0, 1], bias=2.0, diffuse=0.5, reflectance=0.04).round(2).tolist()
    [0.52, 0.52, 0.52]
    """

    cube: EnvMap
    irradiance: Harmonics

    @classmethod
    def make(cls, cube: EnvMap, *, diffuse_size: int = 8) -> CapturedLight:
        """Make the levels and project the first one of at most ``diffuse_size`` texels.

        Raises
        ------
        InvalidArgument
            If the map is not a cube, or has NaN or infinite values, and for sizes below 1.
        """
        if cube.projection != "cube":
            raise _core.InvalidArgument(f"cube is {cube.projection}, expected a cube")
        if diffuse_size < 1:
            raise _core.InvalidArgument(f"diffuse_size is {diffuse_size}, expected 1 or more texels")
        levels = EnvMap.from_array(cube.level(0), "cube", cube.channels).mips("box")
        small = next(
            level
            for level in range(levels.levels)
            if levels.layout.level_width(level) <= diffuse_size or level == levels.levels - 1
        )
        light = Harmonics.project(EnvMap.from_array(levels.level(small), "cube", cube.channels))
        return cls(levels, light.irradiance())

    @classmethod
    def capture(
        cls,
        tracer: _core.Tracer,
        origin: ArrayLike,
        size: int = 64,
        *,
        hidden: Sequence[int] = (),
        samples: int = 4,
        diffuse_size: int = 8,
    ) -> CapturedLight:
        """Trace the cube at a point of a scene, usually the middle of an object, which is ``hidden``.

        Parameters
        ----------
        tracer
            Of the scene as it is in this frame.
        origin
            (3,).
        size
            Texels of a face: 8 are enough for what is diffuse, 64 and more show what is reflected.
        hidden
            Numbers of objects through which rays pass.
        samples
            Per texel.
        diffuse_size
            As for `make`.
        """
        point = vectors("origin", origin, 3).reshape(3)
        options = _core.TraceOptions(samples_per_pixel=samples)
        traced = tracer.capture_cube(point.tolist(), size, list(hidden), options)
        return cls.make(EnvMap.from_array(traced, "cube"), diffuse_size=diffuse_size)

    def shade(
        self,
        normals: ArrayLike,
        views: ArrayLike,
        *,
        bias: float = 0.0,
        diffuse: ArrayLike = 1.0,
        reflectance: float = 0.04,
    ) -> NDArray[np.float64]:
        """Radiance (..., C) of a surface: (1 − F) k_d/π E(n) + F L_b(r), [AEM] eqs. 8 and 12.

        Parameters
        ----------
        normals, views
            Unit vectors (..., 3); views point towards the viewer.
        bias
            Level of the cube that is seen, b: 0 is a mirror.
        diffuse
            k_d, a number or one for each channel.
        reflectance
            f_λ of Schlick's approximation, at normal incidence.
        """
        n = vectors("normals", normals, 3).astype(np.float64)
        v = vectors("views", views, 3).astype(np.float64)
        cosine = np.clip((n * v).sum(-1), 0, 1)
        mirrored = 2 * (n * v).sum(-1, keepdims=True) * n - v
        share = np.asarray(schlick(cosine, reflectance), np.float64)[..., None]
        glossy = sample_level(self.cube, mirrored, bias).astype(np.float64)
        lit = self.irradiance.sample(n)
        result: NDArray[np.float64] = (1 - share) * np.asarray(diffuse) / np.pi * lit + share * glossy
        return result

"""Drawing the light that the body under the mirror reflects, from irradiance at vertices or in a lightmap."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.scene.texture_coordinates import atlas_coordinates

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.build import BuiltScene


@dataclass(frozen=True)
class BodyLight:
    """Where the irradiance of a reflector's body is stored, and how that is read."""

    triangles: NDArray[np.uint32]
    """(T, 3) of the reflector."""
    uvs: FloatArray
    """(V, 2) shares of the texture coordinates' bounds, v up; (0, 2) if it has none."""
    lightmap: int = 0
    """Texels along a side of a square map on those bounds; 0: irradiance is at the vertices."""

    @staticmethod
    def of(built: BuiltScene, lightmap: int) -> BodyLight:
        """Return that of a scene's reflector."""
        uvs = atlas_coordinates(built.scene.object_mesh(built.reflector))
        return BodyLight(built.triangles, uvs, lightmap)

    def radiance(self, samples: _core.SurfaceSamples, irradiance: FloatArray) -> FloatArray:
        """Return what the bodies of samples reflect and emit, (n, 3).

        Parameters
        ----------
        samples
            Of the reflector.
        irradiance
            (V, 3) at the vertices, or (S², 3) in the texels of a lightmap, rows from the top; W m⁻². (…, 6):
            with that of the backs.
        """
        front = np.ascontiguousarray(irradiance[:, :3])
        back = np.ascontiguousarray(irradiance[:, 3:]) if irradiance.shape[1] > 3 else None
        if self.lightmap:
            found = _core.diffuse_from_lightmap(samples, self.triangles, self.uvs, self.lightmap, front, back)
        else:
            found = _core.diffuse_from_irradiance(samples, self.triangles, front, back)
        return np.asarray(found)

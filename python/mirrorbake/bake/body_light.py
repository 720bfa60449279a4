"""Gathers the light that the body under the mirror gets: at the vertices of the mesh, or into a lightmap."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Literal

import numpy as np

from mirrorbake import _core
from mirrorbake.errors import InputError
from mirrorbake.scene.texture_coordinates import atlas_coordinates, has_own_texels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.stage import Stage

RAYS = 1 << 23
"""Gathered for a side of a body, and at a vertex or a place of it:"""
_MOST_RAYS, _LEAST_RAYS = 1024, 16
_FINE_MESH, _SHARED_BY = 1 << 14, 4
"""Vertices from which on neighbours share their rays, and how many times fewer each one then takes: the mean
with a ring of six still has more than each would have had alone."""
_PROBE_RAYS = (2, 16)

_MOST_PLACES, _PLACES_OF_A_MAP = 3, 512
"""Along a side of a texel and of the map, at which light is gathered."""
_BILINEAR = _core.RunTimeModel(
    name="lightmap", places=[[0.5, 0.5]], footprint_scale=1.0, filter="bilinear", max_taps=1
)
_SMOOTHNESS = 72.0
"""Over the rays of a texel: λ of squared differences of neighbours, in proportion to the noise, as a Wiener
filter has it. Without it the texels of a large map are noisier than what was gathered for them."""


def irradiance_of(
    stage: Stage, sides: int, lightmap: int = 0, *, rays: int = RAYS, seed: int | None = None
) -> FloatArray:
    """Return the irradiance of the reflector's body, (V, 3 * sides) or (S², 3 * sides), W m⁻².

    Parameters
    ----------
    stage
        The scene.
    sides
        1: on the front of triangles; 2: on their backs, too.
    lightmap
        S, texels along a side of the map, rows from the top; 0: at the vertices.
    rays
        Of a side in all, as far as each place gets neither too few nor too many.
    seed
        Of random numbers; None: the scene's.
    """
    seed = stage.config.trace.seed if seed is None else seed
    if not lightmap:
        return _at_vertices(stage, sides, rays, seed)
    found = Lightmap(stage, lightmap)
    return found.inferred(found.gathered(sides, rays, seed))


def _sides(count: int) -> Sequence[Literal["front", "back"]]:
    both: tuple[Literal["front", "back"], ...] = ("front", "back")
    return both[:count]


def _at_vertices(stage: Stage, sides: int, rays: int, seed: int) -> FloatArray:
    """Up to 1024 rays are gathered at a vertex.

    Of a fine mesh fewer, since more vertices share a pixel, and vertices share them with their neighbours.
    """
    built = stage.built
    count = max(1, len(built.positions))
    each = _rays_of_each(count * (_SHARED_BY if count > _FINE_MESH else 1), rays)
    found = [
        np.asarray(stage.tracer.vertex_irradiance(built.reflector, each, seed, side))
        for side in _sides(sides)
    ]
    if count > _FINE_MESH:
        found = [shared_over_triangles(irradiance, built.triangles) for irradiance in found]
    return np.concatenate(found, axis=1)


def _rays_of_each(count: int, rays: int) -> int:
    return min(_MOST_RAYS, max(_LEAST_RAYS, rays // max(1, count)))


def shared_over_triangles(values: FloatArray, triangles: NDArray[np.uint32]) -> FloatArray:
    """Return means of vertices' values (V, C) over the corners of the triangles (T, 3) at each vertex.

    Vertices apart stay apart, as on both sides of a crease; ones without triangles keep their value.
    """
    corners = triangles.reshape(-1)
    count = 3.0 * np.bincount(corners, minlength=len(values))
    means = values.astype(np.float64)
    there = count > 0.0
    for channel in range(values.shape[1]):
        of_triangles = np.sum(values[triangles, channel].astype(np.float64), axis=1)
        sums = np.bincount(corners, np.repeat(of_triangles, 3), len(values))
        means[there, channel] = sums[there] / count[there]
    return means.astype(np.float32)


def has_own_coordinates(stage: Stage) -> bool:
    """Whether each place of the reflector has texture coordinates of its own, as a lightmap takes."""
    built = stage.built
    uvs = atlas_coordinates(built.scene.object_mesh(built.reflector))
    return has_own_texels(built.positions, built.triangles, uvs)


class Lightmap:
    """A square map on the bounds of a reflector's texture coordinates, before its light is inferred.

    Its texels are those whose bilinear reads meet the light that is gathered all over the surface best, by
    least squares.
    """

    def __init__(self, stage: Stage, size: int) -> None:
        """Find what is read of `size`² texels. The reflector `has_own_coordinates`."""
        built = stage.built
        uvs = atlas_coordinates(built.scene.object_mesh(built.reflector))
        self._stage, self._size = stage, size
        self._topology = _core.TexelTopology.atlas(size, size)
        places = max(1, min(_MOST_PLACES, _PLACES_OF_A_MAP // size))
        self._samples = _core.texture_samples(built.positions, built.triangles, uvs, size, places)
        self._matrix = _core.build_rendering_matrix(
            self._samples, 0, _core.Proxy.infinite(), self._topology, _BILINEAR
        )
        self._read = texels_near(self._matrix.texels, size)

    @property
    def texels(self) -> int:
        """How many are read, or lie beside one that is."""
        return int(np.count_nonzero(self._read))

    @property
    def samples(self) -> _core.SurfaceSamples:
        """The places of the surface whose light tells the map's."""
        return self._samples

    def gathered(self, sides: int, rays: int, seed: int) -> FloatArray:
        """Return the irradiance at the samples, (n, 3 * sides), by `rays` in all of a side."""
        samples, stage = self._samples, self._stage
        places = (stage.built.reflector, samples.triangle, samples.barycentric)
        each = _rays_of_each(len(samples), rays)
        gather = partial(stage.tracer.surface_irradiance, *places, each, seed)
        return np.concatenate([gather(side) for side in _sides(sides)], axis=1)

    def inferred(self, light: FloatArray) -> FloatArray:
        """Return the texels (S², C), rows from the top, from irradiance at the samples (n, C); C is 3 or 6.

        Those that are not read are 0.

        Raises
        ------
        InputError
            The solver did not converge.
        """
        matrix, size = self._matrix, self._size
        smoothness = _SMOOTHNESS * self.texels / RAYS
        options = _core.SolveOptions(smoothness=smoothness, prior_weight=0.0, tolerance=1e-4)
        solver = _core.MapSolver([(matrix, [(0, 1.0)])], [self._topology], options=options)
        covered = np.asarray(matrix.row_samples, np.float32) / np.float32(self._samples.samples_per_pixel)
        weights = np.ascontiguousarray(np.repeat(covered[:, None], 3, axis=1))
        found = []
        for first in range(0, light.shape[1], 3):
            target = matrix.row_means(np.ascontiguousarray(light[:, first : first + 3]))
            texels, report = solver.solve([target], [weights])
            if not report.converged:
                raise InputError(
                    f"layers.lightmap: {size}: its solver did not converge; expected another size"
                )
            found.append(np.where(self._read[:, None], np.asarray(texels)[: size * size], np.float32(0.0)))
        return np.concatenate(found, axis=1)


def texels_near(texels: NDArray[np.uint32], size: int) -> NDArray[np.bool_]:
    """Return which of size² texels are among some, or one of the eight beside it is."""
    near = np.zeros((size + 2, size + 2), np.bool_)
    inner = np.zeros((size, size), np.bool_)
    inner.reshape(-1)[texels] = True
    for down in range(3):
        for right in range(3):
            near[down : down + size, right : right + size] |= inner
    return near[1:-1, 1:-1].reshape(-1)


def lit_sides(stage: Stage) -> int:
    """Return 2 if light reaches the backs of the reflector's triangles, as in a bowl without thickness."""
    seed, tracer, reflector = stage.config.trace.seed, stage.tracer, stage.built.reflector
    lit = any(np.any(tracer.vertex_irradiance(reflector, rays, seed, "back")) for rays in _PROBE_RAYS)
    return 2 if lit else 1

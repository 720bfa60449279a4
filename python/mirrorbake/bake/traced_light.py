"""What stored light of the body under the mirror is compared with."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.probe import BRIGHTEST_SHARE, probe_points, small_cameras
from mirrorbake.pem.body_light import BodyLight

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.bake.body_light import Lightmap
    from mirrorbake.scene.stage import Stage

    DoubleArray = NDArray[np.float64]

SAMPLES = 16
"""Per pixel of each of two tracings of a trial image."""
BLOCK = 4
"""Pixels along a side of the blocks over which light is compared."""


def small_views(stage: Stage) -> list[_core.Camera]:
    """Return a few views of a stage as small pictures."""
    small = small_cameras(stage.built.cameras)
    return [small.camera(point) for point in probe_points(stage)]


class TracedLight:
    """Small pictures of a few views, traced twice: what drawing the bodies' light is compared with."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        # The noise of two tracings is independent: the product of their errors holds the difference alone.
        seeds = (stage.config.trace.seed, stage.config.trace.seed + 1)
        self._views = [[self._trace(view, seed) for seed in seeds] for view in small_views(stage)]

    def _trace(self, view: _core.Camera, seed: int) -> _Traced:
        options = _core.TraceOptions(samples_per_pixel=SAMPLES, max_specular_depth=0, seed=seed)
        traced = self._stage.tracer.trace_layers(view, self._stage.built.reflector, options)
        block = _block_of(traced.samples)
        blocks = -(-view.width // BLOCK) * -(-view.height // BLOCK)
        return _Traced(
            traced.samples,
            block,
            np.bincount(block, minlength=blocks),
            _block_means(traced.sample_beauty, block, blocks),
        )

    def change_by(
        self, irradiance: FloatArray, lightmap: int = 0, *, again: FloatArray | None = None
    ) -> float:
        """Return how much drawing the bodies' light from an irradiance changes the pictures, beyond noise.

        Root mean square over blocks of `BLOCK`² pixels, less twice its standard error, relative to that of
        their light, the brightest clipped.

        Parameters
        ----------
        irradiance
            Of the stage's reflector, as `irradiance_of` returns it.
        lightmap
            Texels along its side; 0: it is at the vertices.
        again
            The same from other random numbers, so that the noise of gathering does not count either.
        """
        lights_of = (irradiance, irradiance if again is None else again)
        body = BodyLight.of(self._stage.built, lightmap)
        products, counts, lights = [], [], []
        for first, second in self._views:
            error, other = (
                _block_means(
                    one.samples.diffuse - body.radiance(one.samples, stored), one.block, len(one.count)
                )
                for one, stored in zip((first, second), lights_of, strict=True)
            )
            products.append(np.mean(error * other, axis=1))
            counts.append(np.minimum(first.count, second.count))
            lights.append(first.light)
        product, light = np.concatenate(products), np.concatenate(lights)
        weights = np.concatenate(counts).astype(np.float64)
        weights /= max(weights.sum(), 1.0)
        square = float(weights @ product)
        noise = math.sqrt(float(weights**2 @ (product - square) ** 2))
        seen = light[weights > 0.0]
        light = np.minimum(light, (np.quantile(seen, 1.0 - BRIGHTEST_SHARE) if len(seen) else 0.0) or np.inf)
        scale = float(weights @ np.mean(light * light, axis=1))
        return math.sqrt(max(square - 2.0 * noise, 0.0) / scale) if scale > 0.0 else 0.0


class LightmapTrial:
    """Small pictures of a few views, drawn from light at the vertices and from lightmaps fitted to that."""

    def __init__(self, stage: Stage, lights: tuple[FloatArray, FloatArray]) -> None:
        """Draw them from irradiance (V, 3), or (V, 6) with the backs, gathered twice."""
        self._built, self._lights = stage.built, lights
        options = _core.TraceOptions(samples_per_pixel=SAMPLES)
        self._views = [
            stage.tracer.trace_visibility(view, stage.built.reflector, options) for view in small_views(stage)
        ]

    def change_by(self, lightmap: Lightmap, size: int) -> float:
        """Return by how much the pictures change where a map takes the place of the vertices.

        Root mean square over blocks, without the noise of gathering, relative to that of the body's light:
        what it reflects besides hides nothing.
        """
        samples = lightmap.samples
        second, third = np.asarray(samples.barycentric).T[..., None]
        vertices, map_ = BodyLight.of(self._built, 0), BodyLight.of(self._built, size)
        drawn, changes = [], []
        for light in self._lights:
            a, b, c = (light[self._built.triangles[samples.triangle, k]] for k in range(3))
            texels = lightmap.inferred((1.0 - second - third) * a + second * b + third * c)
            pairs = [(vertices.radiance(view, light), map_.radiance(view, texels)) for view in self._views]
            at_vertices, in_map = (
                np.concatenate([_of_blocks(*one) for one in zip(self._views, values, strict=True)])
                for values in zip(*pairs, strict=True)
            )
            drawn.append(at_vertices)
            changes.append(in_map - at_vertices)
        # Of the noise of two gatherings, which a map smooths, the product holds nothing.
        square = float(np.mean(changes[0] * changes[1]))
        scale = float(np.mean(drawn[0] * drawn[1]))
        return math.sqrt(max(square, 0.0) / scale) if scale > 0.0 else 0.0


def _of_blocks(samples: _core.SurfaceSamples, light: FloatArray) -> DoubleArray:
    """Sums of samples' light (n, 3) over the blocks of their picture."""
    blocks = -(-samples.width // BLOCK) * -(-samples.height // BLOCK)
    block = _block_of(samples)
    return np.stack([np.bincount(block, light[:, c], blocks) for c in range(3)], axis=-1)


def _block_of(samples: _core.SurfaceSamples) -> NDArray[np.int64]:
    """Number of the block that each sample lies in."""
    pixel = np.asarray(samples.pixel).astype(np.int64)
    across = -(-samples.width // BLOCK)
    block: NDArray[np.int64] = pixel // samples.width // BLOCK * across + pixel % samples.width // BLOCK
    return block


@dataclass(frozen=True)
class _Traced:
    samples: _core.SurfaceSamples
    block: NDArray[np.int64]
    """(n,) that each sample lies in."""
    count: NDArray[np.int64]
    """Of samples in each block."""
    light: DoubleArray
    """(blocks, 3) of the picture."""


def _block_means(values: NDArray[Any], block: NDArray[np.int64], blocks: int) -> DoubleArray:
    count = np.maximum(np.bincount(block, minlength=blocks), 1)[:, None]
    sums = [np.bincount(block, values[:, c], blocks) for c in range(3)]
    means: DoubleArray = np.stack(sums, axis=-1) / count
    return means

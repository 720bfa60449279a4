"""Small trial images of a scene, and how much they differ."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.tone import srgb_encoded

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.cameras import Cameras
    from mirrorbake.scene.parameters import Point
    from mirrorbake.scene.stage import Stage

    DoubleArray = NDArray[np.float64]

PROBE_VIEWS = 5
PROBE_VIEWS_OF_A_DOME = 9
"""Also of every other space of several axes."""
PROBE_SIDE = 128
"""Longer side of the trial images, in pixels."""
PROBE_SAMPLES = 4

BRIGHTEST_SHARE = 0.01
"""The brightest pixels are clipped to the next ones, so that one mirrored sun does not decide alone."""


def small_cameras(cameras: Cameras) -> Cameras:
    """Return cameras for trial images, no longer than `PROBE_SIDE`."""
    width, height = cameras.size
    scale = min(1.0, PROBE_SIDE / max(width, height))
    return replace(cameras, size=(max(1, round(scale * width)), max(1, round(scale * height))))


def probe_points(stage: Stage) -> list[Point]:
    space = stage.space
    if len(space.axes) == 1 and len(space) <= PROBE_VIEWS:
        return space.samples()
    return space.spread(PROBE_VIEWS if len(space.axes) < 2 else PROBE_VIEWS_OF_A_DOME)


@dataclass(frozen=True)
class Probe:
    """Samples of small images of a few views, one after the other."""

    view: NDArray[np.int32]
    pixel: NDArray[np.int64]
    """Numbered through all views."""
    part: NDArray[np.int64]
    triangle: NDArray[np.int64]
    position: FloatArray
    reflection: FloatArray
    beauty: DoubleArray
    diffuse: DoubleArray
    fresnel: DoubleArray
    shells: tuple[DoubleArray, ...]
    """Premultiplied radiance and α (n, 4) of each shell, front to back."""

    @staticmethod
    def of(stage: Stage, depth: int, samples_per_pixel: int = PROBE_SAMPLES) -> Probe:
        size = small_cameras(stage.built.cameras).size
        # The same random numbers at every depth: what differs are the bounces alone.
        options = _core.TraceOptions(
            samples_per_pixel=samples_per_pixel,
            max_specular_depth=depth,
            seed=stage.config.trace.seed,
            shells=stage.shell_rules,
        )
        traces = [
            moved.tracer.trace_layers(
                small_cameras(moved.built.cameras).camera(point), moved.built.reflector, options
            )
            for moved, point in ((stage.at(point), point) for point in probe_points(stage))
        ]

        def joined(name: str) -> NDArray[np.float32]:
            return np.concatenate([np.asarray(getattr(trace.samples, name)) for trace in traces])

        def light(shell: int) -> NDArray[np.float32]:
            return np.concatenate([np.asarray(trace.samples.shells[shell].radiance) for trace in traces])

        counts = [len(trace.samples) for trace in traces]
        view = np.repeat(np.arange(len(traces), dtype=np.int32), counts)
        return Probe(
            view=view,
            pixel=joined("pixel").astype(np.int64) + view.astype(np.int64) * (size[0] * size[1]),
            part=joined("part").astype(np.int64),
            triangle=joined("triangle").astype(np.int64),
            position=np.concatenate(
                [trace.samples.position + np.array(trace.samples.origin) for trace in traces]
            ).astype(np.float32),
            reflection=joined("reflection"),
            beauty=np.concatenate([np.asarray(trace.sample_beauty) for trace in traces]).astype(np.float64),
            diffuse=joined("diffuse").astype(np.float64),
            fresnel=joined("fresnel").astype(np.float64),
            shells=tuple(light(shell).astype(np.float64) for shell in range(len(options.shells))),
        )

    @property
    def incident(self) -> DoubleArray:
        """Radiance that arrives along the reflected rays."""
        return self.without(None)

    def without(self, shell: int | None) -> DoubleArray:
        """Return what would arrive, if a shell were not there."""
        light: DoubleArray = self.shells[-1][:, :3]
        for number in range(len(self.shells) - 2, -1, -1):
            if number != shell:
                layer = self.shells[number]
                light = layer[:, :3] + (1.0 - layer[:, 3:]) * light
        return light


def pixel_means(values: DoubleArray, pixel: NDArray[np.int64]) -> DoubleArray:
    _, place, count = np.unique(pixel, return_inverse=True, return_counts=True)
    sums = [np.bincount(place, weights=values[:, c], minlength=len(count)) for c in range(values.shape[1])]
    means: DoubleArray = np.stack(sums, axis=-1) / count[:, None]
    return means


def relative_change(with_it: DoubleArray, without: DoubleArray, pixel: NDArray[np.int64]) -> float:
    """Relative RMS change of the pixels, the brightest clipped."""
    if not len(pixel):
        return 0.0
    a, b = pixel_means(with_it, pixel), pixel_means(without, pixel)
    # A picture that is black but for a few pixels is judged by those.
    limit = np.quantile(a, 1.0 - BRIGHTEST_SHARE) or np.inf
    a, b = np.minimum(a, limit), np.minimum(b, limit)
    scale = float(np.sqrt(np.mean(a * a)))
    return float(np.sqrt(np.mean((a - b) ** 2))) / scale if scale > 0.0 else 0.0


def displayed_noise(probe: Probe) -> float:
    """Root mean square error, of the display's range, that the samples of a pixel leave in it.

    From the difference of two halves of them; pixels with fewer than two samples on the object say nothing.
    """
    _, first, place, count = np.unique(
        probe.pixel, return_index=True, return_inverse=True, return_counts=True
    )
    place = place.reshape(-1)
    second = (np.arange(len(place)) - first[place]) % 2 == 1
    shown = []
    for half in (second, ~second):
        held = np.bincount(place[half], minlength=len(count))
        sums = [np.bincount(place[half], probe.beauty[half, c], len(count)) for c in range(3)]
        means = np.stack(sums, axis=-1) / np.maximum(held, 1)[:, None]
        shown.append(srgb_encoded(means.astype(np.float32)))
    several = count > 1
    if not several.any():
        return 0.0
    return float(np.sqrt(np.mean(((shown[0] - shown[1])[several] / 2.0) ** 2)))

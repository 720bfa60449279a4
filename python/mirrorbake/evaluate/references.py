"""What an evaluation compares with: tracings of their own, apart from those that a PEM was baked from."""

from __future__ import annotations

import hashlib
import io
import json
import math
import time
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.targets import bounds, widened
from mirrorbake.errors import StoreError
from mirrorbake.evaluate.metrics import decibels, mean_squared_error
from mirrorbake.pem.location import Location
from mirrorbake.pem.view_images import ViewImages, images_of_trace
from mirrorbake.scene.config_axes import SCENE_AXES

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.header import Source
    from mirrorbake.scene.stage import Stage

    Window = tuple[int, int, int, int]

REFERENCES_NAME = "references"
FIRST_SAMPLES = 16
"""Per pixel, of both halves together: what a reference starts with."""
MOST_SAMPLES = 1024
MARGIN_DECIBELS = 6.0
"""The reference's own noise stays this far below the error that it measures."""
BATCH = 1 << 22
"""Samples that see the object and are held at a time."""
SEED_OFFSET = 0x5EED_0000
"""Keeps seeds of references apart from those of targets: samples lie elsewhere in the pixels."""
WINDOW_MARGIN = 6
"""Pixels around the object that are traced, too: metrics of structure look around a pixel."""
_LIGHT_SECTIONS = ("reflector", "material", "surroundings", *SCENE_AXES)
_LIGHT_KEYS = ("seed", "indirect", "cache_rays")


@dataclass(frozen=True)
class Half:
    """Sums over the samples of half a reference."""

    light: NDArray[np.float64]
    """(H, W, 3) of the object's radiance."""
    count: NDArray[np.float64]
    """(H, W) of the samples that see the object."""
    background: NDArray[np.float64]
    """(H, W, 3) of what the other samples see."""

    @cached_property
    def object(self) -> FloatArray:
        """Mean radiance (H, W, 3) of the samples that see the object; 0 where none does."""
        return (self.light / np.maximum(self.count, 1.0)[..., None]).astype(np.float32)


@dataclass(frozen=True)
class Reference:
    """A ray-traced window of a view, as two independent halves that tell how noisy it is."""

    window: Window
    """x, y, width and height in the view, pixels."""
    halves: tuple[Half, Half]
    samples: int
    """Per pixel, of both halves together."""
    batches: int
    """Tracings of each half."""
    seconds: float
    """That tracing took."""

    @cached_property
    def images(self) -> ViewImages:
        """The mean of both halves."""
        a, b = self.halves
        count = a.count + b.count
        return ViewImages(
            object=((a.light + b.light) / np.maximum(count, 1.0)[..., None]).astype(np.float32),
            coverage=(count / self.samples).astype(np.float32),
            background=((a.background + b.background) / self.samples).astype(np.float32),
        )

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """Pixels all of whose samples see the object, shape (H, W).

        Silhouettes are left out: their error is that of a few samples across an edge, whatever is drawn.
        """
        a, b = self.halves
        return (a.count + b.count) >= self.samples - 0.5

    @cached_property
    def noise(self) -> float:
        """Mean squared error of `images` on the mask, as a display shows it; NaN if the mask is empty.

        The halves A and B are independent, so that E(A − B)² is the sum of their variances, and the variance
        of their mean a quarter of it.
        """
        a, b = self.halves
        return 0.25 * mean_squared_error(a.object, b.object, self.mask)

    @property
    def ceiling(self) -> float:
        """PSNR in dB that the true image would have against this reference."""
        return decibels(self.noise)

    def error(self, image: FloatArray) -> float | None:
        """Mean squared error of an image (H, W, 3) of the window, the reference's own noise taken off.

        The noise of the reference is independent of the image, so that it adds to the squared difference;
        what is left is unbiased. None where it is no larger than the noise: it cannot be told.
        """
        if not self.mask.any():
            return None
        left = mean_squared_error(image, self.images.object, self.mask) - self.noise
        return left if left > self.noise or self.noise == 0.0 else None

    def psnr(self, image: FloatArray) -> float | None:
        """PSNR in dB of the error that is left; None where the noise hides it."""
        error = self.error(image)
        return None if error is None else decibels(error)


def options_of(stage: Stage, samples: int, seed: int, window: Window) -> _core.TraceOptions:
    """Options of a planned stage with other samples, seed and window."""
    return _core.TraceOptions(
        samples_per_pixel=samples,
        max_specular_depth=stage.options.max_specular_depth,
        seed=seed,
        window=list(window),
        # Of the beauty alone is told here, which is the same however it is split, and cheapest unsplit.
        shells=[_core.ShellRule("all")],
    )


def object_window(stage: Stage, camera: _core.Camera) -> Window:
    """The part of a view with the object in it and a margin around; of no size if it is not seen."""
    whole = (0, 0, camera.width, camera.height)
    seen = stage.tracer.trace_visibility(camera, stage.built.reflector, options_of(stage, 4, 0, whole))
    around = bounds(np.asarray(seen.pixel), whole)
    return (0, 0, 0, 0) if around is None else widened(around, WINDOW_MARGIN, whole)


def trace_reference(stage: Stage, camera: _core.Camera, window: Window, samples: int) -> Reference:
    """Trace a reference.

    Parameters
    ----------
    stage
        Planned.
    camera
        Of the view.
    window
        Part of it, of at least one pixel.
    samples
        Per pixel, of both halves together.
    """
    shape = (window[3], window[2])
    halves = [Half(np.zeros((*shape, 3)), np.zeros(shape), np.zeros((*shape, 3))) for _ in range(2)]
    empty = Reference(window, (halves[0], halves[1]), 0, 0, 0.0)
    return extend_reference(stage, camera, empty, samples)


def extend_reference(stage: Stage, camera: _core.Camera, reference: Reference, samples: int) -> Reference:
    """Return a reference with more samples per pixel: at least `samples` in all."""
    start = time.perf_counter()
    covered = max(int(np.count_nonzero(reference.halves[0].count)), 1)
    if reference.samples == 0:
        covered = reference.window[2] * reference.window[3]
    limit = max(BATCH // covered, 1)
    halves, done, batch = list(reference.halves), reference.samples, reference.batches
    while done < samples:
        count = min(math.ceil((samples - done) / 2), limit)
        for number in range(2):
            seed = stage.config.trace.seed + SEED_OFFSET + 2 * batch + number
            options = options_of(stage, count, seed % (1 << 63), reference.window)
            images = images_of_trace(stage.tracer.trace_layers(camera, stage.built.reflector, options))
            seen = np.rint(images.coverage.astype(np.float64) * count)
            half = halves[number]
            halves[number] = Half(
                half.light + seen[..., None] * images.object,
                half.count + seen,
                half.background + count * images.background.astype(np.float64),
            )
        done += 2 * count
        batch += 1
    seconds = reference.seconds + time.perf_counter() - start
    return Reference(reference.window, (halves[0], halves[1]), done, batch, seconds)


class ReferenceCache:
    """References on disk, beside a PEM; each under a name that changes with all that decides its light.

    A folder that cannot be written to leaves the references in memory alone; `problem` then says why.
    """

    def __init__(self, folder: Location | Path, source: Source, depth: int) -> None:
        self._folder = Location.of(folder)
        config: Mapping[str, Any] = source.config
        content = {section: config.get(section) for section in _LIGHT_SECTIONS}
        # The content of a file counts, not its name.
        files = {key: {**value, "path": None} for key, value in source.inputs.items()}
        for key in files:
            section, name = key.split(".")
            content[section] = {**(content[section] or {}), name: None}
        trace = {key: config["trace"][key] for key in _LIGHT_KEYS}
        self._light = [source.library, content, files, trace, depth]
        self.problem: str | None = None

    def place(
        self, camera: _core.Camera, window: Window, scene: Mapping[str, float] | None = None
    ) -> Location:
        """Where the reference of a view is, or would be; `scene`: its coordinates that change the scene."""
        place = [list(camera.eye), list(camera.target), list(camera.up)]
        frame = [camera.vertical_fov_degrees, camera.width, camera.height, *window]
        text = json.dumps([self._light, place, frame, dict(scene or {})])
        return self._folder.joined(f"{hashlib.sha256(text.encode()).hexdigest()[:32]}.npz")

    def load(
        self, camera: _core.Camera, window: Window, scene: Mapping[str, float] | None = None
    ) -> Reference | None:
        """The reference of a view; None if there is none, or it cannot be read."""
        place = self.place(camera, window, scene)
        try:
            with np.load(io.BytesIO(place.read_bytes())) as file:
                first, second = (
                    Half(*(file[f"{name}_{number}"].astype(np.float64) for name in _HALF))
                    for number in (0, 1)
                )
                samples, batches, seconds = file["about"].tolist()
        # What a damaged file raises depends on where it is damaged: zipfile.BadZipFile, EOFError, zlib.error.
        except Exception:
            return None
        return Reference(window, (first, second), int(samples), int(batches), float(seconds))

    def save(
        self, camera: _core.Camera, reference: Reference, scene: Mapping[str, float] | None = None
    ) -> None:
        """Keep a reference."""
        arrays = {
            f"{name}_{number}": getattr(half, name).astype(np.float32)
            for number, half in enumerate(reference.halves)
            for name in _HALF
        }
        about = np.array([reference.samples, reference.batches, reference.seconds])
        packed = io.BytesIO()
        np.savez(packed, allow_pickle=False, about=about, **arrays)
        try:
            self.place(camera, reference.window, scene).write_bytes(packed.getvalue())
        except StoreError as failure:
            self.problem = str(failure)


_HALF = ("light", "count", "background")


def refined_reference(
    stage: Stage,
    camera: _core.Camera,
    window: Window,
    cache: ReferenceCache,
    best_error: Callable[[Reference], float | None],
    margin: float = MARGIN_DECIBELS,
) -> Reference:
    """A reference whose noise lies at least 6 dB below the smallest error that it measures.

    Parameters
    ----------
    stage
        Planned.
    camera, window
        The view, and what of it is traced.
    cache
        Where references are looked for and kept.
    best_error
        The smallest mean squared error that a reference finds; None where its noise hides one.
    margin
        dB that a reference without enough gets to spare: more than 6 if better pictures will follow.

    Returns
    -------
    Reference
        With at most 1024 samples per pixel, even if those are not enough.
    """
    reference = cache.load(camera, window, stage.place)
    traced = reference is None
    if reference is None:
        reference = trace_reference(stage, camera, window, FIRST_SAMPLES)
    while reference.mask.any() and reference.noise > 0.0 and reference.samples < MOST_SAMPLES:
        error = best_error(reference)
        measured = error if error is not None else reference.noise
        if reference.noise <= measured * 10.0 ** (-MARGIN_DECIBELS / 10.0):
            break
        allowed = measured * 10.0 ** (-margin / 10.0)
        # A little more than noise that falls as 1/samples asks for: another round costs more than that.
        wanted = 1.15 * reference.samples * min(reference.noise / allowed, 16.0)
        reference = extend_reference(stage, camera, reference, min(math.ceil(wanted), MOST_SAMPLES))
        traced = True
    if traced:
        cache.save(camera, reference, stage.place)
    return reference

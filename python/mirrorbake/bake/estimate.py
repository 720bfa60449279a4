"""What a bake will take, from one sample of a small trial image."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numcodecs import blosc

from mirrorbake import _core
from mirrorbake.bake.probe import PROBE_SIDE
from mirrorbake.bake.sample import SampleBaker

if TYPE_CHECKING:
    from mirrorbake.pem.store import Contents
    from mirrorbake.pem.view_images import ViewImages
    from mirrorbake.scene.stage import Stage


@dataclass(frozen=True)
class Estimate:
    """Time and disk of a bake."""

    samples: int
    """That are to be baked."""
    seconds: float
    """Per sample, on the threads that the library uses now."""
    bytes: float
    """Per sample."""
    threads: int

    def __str__(self) -> str:
        """Return a line of words.

        >>> str(Estimate(100, 2.0, 12e6, 2))
        'about 3.3 min and 1.2 GB for 100 samples (2 s and 12 MB each), on 2 threads'
        """
        time_of_all, disk = (
            time_in_words(self.samples * self.seconds),
            bytes_in_words(self.samples * self.bytes),
        )
        samples = f"{self.samples} sample{'s' if self.samples != 1 else ''}"
        each = (
            f" ({time_in_words(self.seconds)} and {bytes_in_words(self.bytes)} each)"
            if self.samples > 1
            else ""
        )
        threads = f"{self.threads} thread{'s' if self.threads != 1 else ''}"
        return f"about {time_of_all} and {disk} for {samples}{each}, on {threads}"


def _two_digits(value: float) -> str:
    return f"{float(f'{value:.2g}'):g}"


def time_in_words(seconds: float) -> str:
    """Return a time with two digits."""
    for unit, length in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
        if seconds >= 2.0 * length:
            return f"{_two_digits(seconds / length)} {unit}"
    return f"{_two_digits(seconds)} s"


def bytes_in_words(count: float) -> str:
    """Return a number of bytes with two digits."""
    for unit, length in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if count >= length:
            return f"{_two_digits(count / length)} {unit}"
    return f"{_two_digits(count / 1e3)} kB"


def estimate(stage: Stage, contents: Contents, samples: int) -> Estimate:
    """Estimate what baking takes.

    A sample in the middle of the space is baked in memory from an image of at most 128 pixels a side. Its
    time is scaled by the number of pixels, as tracing and matrices go; maps that are much larger than the
    image make the estimate too long, since a solve does not grow with pixels alone.

    Parameters
    ----------
    stage
        Planned.
    contents
        What the samples share.
    samples
        How many are to be baked.
    """
    width, height = stage.built.cameras.size
    scale = min(1.0, PROBE_SIDE / max(width, height))
    size = (max(1, round(scale * width)), max(1, round(scale * height)))
    small = replace(
        stage, built=replace(stage.built, cameras=replace(stage.built.cameras, size=size)), moved={}
    )
    pixels = width * height / (size[0] * size[1])
    header = contents.header
    baker = SampleBaker(small, contents)
    start = time.perf_counter()
    baked = baker.bake(len(header.space) // 2)
    seconds = (time.perf_counter() - start) * pixels
    maps = sum(stored_bytes(values, header.precision) for values in baked.maps.values())
    pictures = bytes_of_pictures(baked.images, header.precision)
    return Estimate(samples, seconds, maps + pictures * pixels, _core.thread_count())


def stored_bytes(values: np.ndarray, precision: str) -> int:
    """Return what values take on disk."""
    clipped = np.clip(values, -65504.0, 65504.0).astype(np.dtype(precision))
    return len(blosc.compress(np.ascontiguousarray(clipped), b"zstd", 3, 1))


def bytes_of_pictures(images: ViewImages, precision: str) -> int:
    """Return what the pictures of a sample take on disk."""
    layers = [images.object, images.coverage[..., None], images.background]
    return stored_bytes(np.concatenate(layers, -1), precision)

"""Ray-traced images of a view, as a PEM keeps them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from mirrorbake import _core
    from mirrorbake.arrays import FloatArray


@dataclass(frozen=True)
class ViewImages:
    """Ray-traced images of one view, float32."""

    object: FloatArray
    """(H, W, 3) radiance of the object, mean over the samples that see it; 0 elsewhere."""
    coverage: FloatArray
    """(H, W) fraction of the pixel's samples that see the object."""
    background: FloatArray
    """(H, W, 3) radiance of the others, times their fraction."""

    def put(self, x: int, y: int, part: ViewImages) -> None:
        """Write images of a part of the view, whose top left pixel is (x, y), in place."""
        height, width = part.coverage.shape
        place = np.s_[y : y + height, x : x + width]
        self.object[place] = part.object
        self.coverage[place] = part.coverage
        self.background[place] = part.background

    def composite(self, object_radiance: FloatArray) -> FloatArray:
        """The whole picture with another rendering (H, W, 3) of the object in it."""
        return self.background + self.coverage[..., None] * object_radiance

    @property
    def beauty(self) -> FloatArray:
        """The ray-traced picture (H, W, 3)."""
        return self.composite(self.object)


def images_of_trace(trace: _core.LayerTrace) -> ViewImages:
    """Separate the object from what is behind it in a ray-traced view."""
    samples = trace.samples
    shape = (samples.height, samples.width)
    pixel = np.asarray(samples.pixel)
    count = np.bincount(pixel, minlength=shape[0] * shape[1])
    beauty = np.asarray(trace.sample_beauty)
    total = np.stack(
        [np.bincount(pixel, weights=beauty[:, c], minlength=count.size) for c in range(3)], axis=-1
    )
    traced = np.asarray(samples.pixel_samples) if len(samples.pixel_samples) else samples.samples_per_pixel
    coverage = (count / traced).reshape(shape)
    light = (total / np.maximum(count, 1)[:, None]).reshape(*shape, 3)
    channels = list(trace.channels)
    background = np.asarray(trace.layers)[..., [channels.index(f"background.{name}") for name in "RGB"]]
    return ViewImages(
        object=light.astype(np.float32),
        coverage=coverage.astype(np.float32),
        background=background.astype(np.float32),
    )

"""Images of the web format: AVIF, or WebP without loss."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import imagecodecs
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

# 6 takes less time and needs a tenth more bytes for the same error.
AVIF_SPEED = 4

# The channels as they are (ITU-T H.273, matrix coefficients 0). Luma and chroma of 8 bits are rounded, which
# costs the error of a whole code whatever the quality.
AVIF_MATRIX = 0


@dataclass(frozen=True)
class ImageFormat:
    """How images are written."""

    exact: bool
    """WebP without loss instead of AVIF."""
    quality: int = 93
    """Of AVIF, 0 to 100."""

    @property
    def suffix(self) -> str:
        """Ending of a file's name."""
        return ".webp" if self.exact else ".avif"

    @property
    def media_type(self) -> str:
        """What a server calls such a file."""
        return "image/webp" if self.exact else "image/avif"

    def encode(self, image: NDArray[np.uint8]) -> bytes:
        """Encode an image of shape (H, W, 3), or (H, W) for a grey one."""
        grey = image.ndim == 2
        # The AVIF encoder ignores the quality of two-dimensional arrays, and WebP knows no grey.
        colour = np.ascontiguousarray(np.repeat(image[..., None], 3, axis=2) if grey else image)
        if self.exact:
            return bytes(imagecodecs.webp_encode(colour, lossless=True))
        return bytes(
            imagecodecs.avif_encode(
                colour,
                level=self.quality,
                speed=AVIF_SPEED,
                pixelformat="400" if grey else "444",
                matrix=None if grey else AVIF_MATRIX,
            )
        )

    def decode(self, data: bytes) -> NDArray[np.uint8]:
        """Decode an image: (H, W, 3) whatever it was."""
        image = imagecodecs.webp_decode(data) if self.exact else imagecodecs.avif_decode(data)
        image = np.asarray(image, np.uint8)
        return np.repeat(image[..., None], 3, axis=2) if image.ndim == 2 else image


def linear_codes(values: FloatArray) -> NDArray[np.uint8]:
    """8-bit codes of values in [0, 1], of any shape; others are clipped."""
    codes: NDArray[np.uint8] = np.rint(255.0 * np.clip(values, 0.0, 1.0)).astype(np.uint8)
    return codes


def srgb_codes(linear: FloatArray) -> NDArray[np.uint8]:
    """8-bit sRGB codes (IEC 61966-2-1) of scene-linear values of any shape, clipped to [0, 1]."""
    clipped = np.clip(linear, 0.0, 1.0)
    curve = 1.055 * np.maximum(clipped, 1e-9) ** (1.0 / 2.4) - 0.055
    return linear_codes(np.where(clipped <= 0.0031308, 12.92 * clipped, curve))


def probe_image() -> NDArray[np.uint8]:
    """Return the picture by which the page learns whether a browser decodes images as they were written.

    Eight fields of 8×8 pixels: black, white, greys and saturated colours, which a colour space conversion, a
    limited range or a wrong matrix would each change by tens of steps.
    """
    colours = np.array(
        [
            [0, 0, 0],
            [255, 255, 255],
            [64, 64, 64],
            [160, 160, 160],
            [220, 30, 30],
            [30, 200, 60],
            [40, 60, 210],
            [200, 180, 20],
        ],
        np.uint8,
    )
    return np.repeat(np.repeat(colours[None], 8, axis=1), 8, axis=0)

"""Pictures and curves of a report, as text that goes into its page."""

from __future__ import annotations

import base64
import html
import io
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from PIL import Image

from mirrorbake.evaluate.contact_sheet import ERROR_COLOURS, ERROR_RANGE
from mirrorbake.evaluate.contenders import CONTENDERS, TITLES
from mirrorbake.evaluate.metrics import display_referred

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

LEAST_WIDTH = 480
"""Pixels; smaller pictures are repeated pixel by pixel, so that a browser does not blur them."""


def data_url(shown: NDArray[np.float64], *, lossless: bool) -> str:
    """A picture (H, W, 3) of display values in [0,1] as a data URL of a WebP file."""
    codes = (np.clip(shown, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    image = Image.fromarray(codes, "RGB")
    if lossless:
        factor = max(1, -(-LEAST_WIDTH // image.width))
        image = image.resize((factor * image.width, factor * image.height), Image.Resampling.NEAREST)
    data = io.BytesIO()
    image.save(data, "WEBP", lossless=lossless, quality=80, method=4)
    return "data:image/webp;base64," + base64.b64encode(data.getvalue()).decode("ascii")


def picture_url(radiance: FloatArray) -> str:
    """Scene-linear radiance (H, W, 3) as a display shows it, to the last of its 8 bits."""
    return data_url(display_referred(radiance), lossless=True)


def error_url(picture: FloatArray, reference: FloatArray) -> str:
    """Absolute difference of what a display shows, mean of R, G and B, in the contact sheet's colours."""
    error = np.abs(display_referred(picture) - display_referred(reference)).mean(axis=-1)
    return data_url(mpl.colormaps[ERROR_COLOURS](error / ERROR_RANGE)[..., :3], lossless=False)


def colour(contender: str) -> str:
    """CSS colour of a contender: the same in all curves of a page."""
    return f"var(--c{CONTENDERS.index(contender) % 7})"


def legend(contenders: Sequence[str]) -> str:
    """The key to the colours of curves."""
    entries = "".join(
        f'<span><i style="background:{colour(name)}"></i>{html.escape(TITLES[name])}</span>'
        for name in contenders
    )
    return f'<p class="legend">{entries}</p>'


WIDTH, HEIGHT = 760, 320
LEFT, RIGHT, TOP, BOTTOM = 46, 14, 12, 40


class Plot:
    """Curves and points over two linear axes, as an SVG image."""

    def __init__(self, x: Sequence[float], y: Sequence[float], names: tuple[str, str], *, title: str) -> None:
        self._x0, self._x1 = min(x), max(x) if max(x) > min(x) else min(x) + 1.0
        low, high = min(y), max(y)
        step = _step((high - low) / 5 or 1.0)
        self._y0, self._y1 = step * np.floor(low / step), step * np.ceil(high / step + 1e-9)
        if self._y1 <= self._y0:
            self._y1 = self._y0 + step
        self._parts = [f"<title>{html.escape(title)}</title>"]
        for value in np.arange(self._y0, self._y1 + step / 2, step):
            height = self._place(self._x0, float(value))[1]
            self._parts.append(f'<path class="grid" d="M{LEFT} {height:.1f}H{WIDTH - RIGHT}"/>')
            self._text(LEFT - 6, height + 4, f"{value:.6g}", "end")
        step = _step((self._x1 - self._x0) / 8)
        for value in np.arange(step * np.ceil(self._x0 / step), self._x1 + 1e-9 * step, step):
            self._text(self._place(float(value), 0.0)[0], HEIGHT - BOTTOM + 16, f"{value:.6g}", "middle")
        self._parts.append(f'<path class="axis" fill="none" d="M{LEFT} {HEIGHT - BOTTOM}H{WIDTH - RIGHT}"/>')
        self._text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 6, names[0], "middle")
        self._text(LEFT + 4, TOP + 10, names[1], "start")

    def _text(self, x: float, y: float, words: str, anchor: str) -> None:
        self._parts.append(
            f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{html.escape(words)}</text>'
        )

    def _place(self, x: float, y: float) -> tuple[float, float]:
        across = (x - self._x0) / (self._x1 - self._x0)
        up = (y - self._y0) / (self._y1 - self._y0)
        return LEFT + across * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM - up * (HEIGHT - TOP - BOTTOM)

    def curve(self, points: Sequence[tuple[float, float]], style: str) -> None:
        """A line through points; `style` are attributes of the path."""
        if points:
            places = " ".join("{:.1f},{:.1f}".format(*self._place(x, y)) for x, y in points)
            self._parts.append(f'<polyline fill="none" points="{places}" {style}/>')

    def point(self, x: float, y: float, style: str, words: str) -> None:
        """A disc with words that show when it is pointed at."""
        across, down = self._place(x, y)
        self._parts.append(
            f'<circle cx="{across:.1f}" cy="{down:.1f}" r="4" {style}>'
            f"<title>{html.escape(words)}</title></circle>"
        )

    def label(self, x: float, y: float, words: str) -> None:
        """Words beside a point."""
        across, down = self._place(x, y)
        anchor, shift = ("end", -7) if across > WIDTH - 150 else ("start", 7)
        self._text(across + shift, down - 6, words, anchor)

    def svg(self) -> str:
        """The image."""
        return f'<svg class="curves" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">{"".join(self._parts)}</svg>'


def _step(least: float) -> float:
    """The least of 1, 2, 5 · 10ⁿ that is no smaller."""
    power: float = 10.0 ** np.floor(np.log10(least))
    return next(power * factor for factor in (1, 2, 5, 10) if power * factor >= least * (1 - 1e-9))

"""A walk through a PEM's parameter space, as a film or as stills."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import av
import numpy as np

from mirrorbake import _core
from mirrorbake.errors import InputError, OptionError
from mirrorbake.files import atomic_output, check_writable
from mirrorbake.pem.render import check_picture_display, picture_of
from mirrorbake.tone import check_display, displayed, srgb_bytes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from os import PathLike

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.opened import OpenedPem
    from mirrorbake.scene.parameters import ParameterSpace, Point

CONSTANT_RATE_FACTOR = 14
"""Of x264: below what an eye sees."""
MAX_FRAMES = 100_000


def walk(space: ParameterSpace, frames: int | None) -> list[Point]:
    """Points along the first axis that has an extent; other coordinates stay at their middle node.

    Parameters
    ----------
    space
        Of the PEM.
    frames
        How many, evenly spaced from end to end; once round, without the first again, if the axis closes.
        None: at the axis' nodes, whose backgrounds the PEM holds.

    Raises
    ------
    OptionError
        The space has no such axis, or `frames` is not from 1 to 100,000.
    """
    if frames is not None and not 1 <= frames <= MAX_FRAMES:
        raise OptionError(f"frames = {frames}: expected 1 to {MAX_FRAMES}")
    moving = next((i for i, axis in enumerate(space.axes) if axis.high > axis.low), None)
    if moving is None:
        raise OptionError("the PEM has no axis to move along: expected one of several samples")
    axis = space.axes[moving]
    values = list(axis.values)
    if frames is not None:
        closed = axis.period is not None
        steps = np.linspace(axis.low, axis.high, frames, endpoint=not closed)
        values = [float(value) for value in steps]
    rest = [other.values[len(other.values) // 2] for other in space.axes]
    return [(*rest[:moving], value, *rest[moving + 1 :]) for value in values]


def export_video(
    pem: OpenedPem,
    out: str | PathLike[str],
    *,
    frames: int | None = None,
    frames_per_second: int = 30,
    exposure: float = 0.0,
    tone: str = "none",
    report: Callable[[int, int, str], None] | None = None,
) -> None:
    """Write an .mp4 of H.264, 4:2:0, BT.709, which every browser plays.

    Parameters
    ----------
    pem
        Opened.
    out
        Written whole or not at all. An odd side is filled up by repeating its last pixels.
    frames
        As for `walk`.
    frames_per_second
        From 1 to 240.
    exposure, tone
        As for `mirrorbake.tone.displayed`.
    report
        Called with frames done, of how many, and words.

    Raises
    ------
    InputError
        The file has another suffix or cannot be written.
    OptionError
        A number is out of its range, or the PEM has no axis to move along.
    """
    out = Path(out)
    if out.suffix.lower() != ".mp4":
        raise InputError(f"{out}: expected a name that ends in .mp4")
    if not 1 <= frames_per_second <= 240:
        raise OptionError(f"fps = {frames_per_second}: expected 1 to 240")
    check_display(exposure, tone)
    check_writable(out)
    points = walk(pem.space, frames)
    with atomic_output(out) as temporary, av.open(str(temporary), "w") as container:
        stream = container.add_stream("libx264", rate=frames_per_second)
        stream.pix_fmt = "yuv420p"
        stream.options = {"crf": str(CONSTANT_RATE_FACTOR), "preset": "medium"}
        for number, radiance in enumerate(_pictures(pem, points, report)):
            pixels = _even(srgb_bytes(displayed(radiance, exposure, tone)))
            if number == 0:
                stream.height, stream.width = pixels.shape[:2]
                context = stream.codec_context
                # ITU-T H.273's numbers of BT.709's matrix and primaries, of sRGB's transfer; limited range.
                context.colorspace, context.color_primaries = 1, 1
                context.color_trc, context.color_range = 13, 1
            frame = av.VideoFrame.from_ndarray(pixels, format="rgb24").reformat(
                format="yuv420p", src_colorspace="ITU709", dst_colorspace="ITU709", dst_color_range="MPEG"
            )
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def export_stills(
    pem: OpenedPem,
    pattern: Path,
    *,
    frames: int | None = None,
    exposure: float = 0.0,
    tone: str = "none",
    report: Callable[[int, int, str], None] | None = None,
) -> list[Path]:
    """Write a picture per frame.

    Parameters
    ----------
    pem, frames, report
        As for `export_video`.
    pattern
        Path with `{}` in its name, which stands for the number from 0000. An .exr is scene-linear, so that
        exposure and tone mapping do not go with it; a .png is sRGB.
    exposure, tone
        As for `mirrorbake.tone.displayed`.

    Returns
    -------
    list
        The files.

    Raises
    ------
    InputError
        The name has no `{}` or another suffix, or cannot be written.
    OptionError
        A number is out of its range, an EXR is to be tone mapped, or the PEM has no axis to move along.
    """
    suffix = pattern.suffix.lower()
    if "{}" not in pattern.name or suffix not in (".png", ".exr"):
        raise InputError(f"{pattern}: expected a name with {{}} for the number that ends in .png or .exr")
    check_picture_display(pattern, exposure, tone)
    points = walk(pem.space, frames)
    paths = [pattern.with_name(pattern.name.replace("{}", f"{i:04d}")) for i in range(len(points))]
    check_writable(paths[0])
    for path, radiance in zip(paths, _pictures(pem, points, report), strict=True):
        _core.save_image(str(path), displayed(radiance, exposure, tone), ["R", "G", "B"])
    return paths


def _pictures(
    pem: OpenedPem, points: list[Point], report: Callable[[int, int, str], None] | None
) -> Iterator[FloatArray]:
    for number, point in enumerate(points):
        if report is not None:
            report(number, len(points), "")
        yield picture_of(pem, point)
    if report is not None:
        report(len(points), len(points), "")


def _even(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Chroma of 4:2:0 needs even sides."""
    height, width = pixels.shape[:2]
    return np.pad(pixels, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")

"""One picture of a PEM at any parameter of its arc."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mirrorbake import _core
from mirrorbake.errors import InputError, OptionError
from mirrorbake.files import check_writable
from mirrorbake.pem.opened import open_pem
from mirrorbake.pem.view_images import images_of_trace

if TYPE_CHECKING:
    from pathlib import Path

    from mirrorbake.arrays import FloatArray

PICTURE_SUFFIXES = (".exr", ".png")


def render(directory: Path, t: float, out: Path) -> FloatArray:
    """Draw a PEM over its ray-traced background and write the picture.

    Parameters
    ----------
    directory
        Holds a complete PEM.
    t
        Parameter of the arc in [0,1]. Between two sampled views their maps are blended linearly.
    out
        An .exr (scene-linear, float16) or a .png (clipped to [0,1] and sRGB-encoded, 8 bit).

    Returns
    -------
    array
        The picture, scene-linear radiance (H, W, 3).

    Raises
    ------
    InputError
        t is outside [0,1], or `out` has another suffix or cannot be written.
    """
    if out.suffix.lower() not in PICTURE_SUFFIXES:
        raise InputError(f"{out}: expected a name that ends in {' or '.join(PICTURE_SUFFIXES)}")
    if not 0.0 <= t <= 1.0:
        raise OptionError(f"view = {t:g}: expected a parameter of the arc, from 0 to 1")
    check_writable(out)
    pem = open_pem(directory)
    first, _, weight = pem.run_time.neighbours(t)
    if weight == 0.0:
        samples, images = pem.stage.visibility(t), pem.store.read_images(first)
    else:
        trace = pem.stage.trace(t)
        samples, images = trace.samples, images_of_trace(trace)
    picture = images.composite(pem.run_time.render("pem", t, samples))
    _core.save_image(str(out), picture, ["R", "G", "B"])
    return picture

"""One picture of a PEM at any point of its parameter space."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from mirrorbake import _core
from mirrorbake.errors import InputError, OptionError
from mirrorbake.files import check_writable
from mirrorbake.pem.opened import open_pem
from mirrorbake.pem.view_images import images_of_trace
from mirrorbake.tone import check_display, displayed

if TYPE_CHECKING:
    from os import PathLike

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.opened import OpenedPem
    from mirrorbake.scene.parameters import PointLike

PICTURE_SUFFIXES = (".exr", ".png")


def render(
    directory: str | PathLike[str],
    point: PointLike,
    out: str | PathLike[str],
    away: tuple[float, float] = (0.0, 0.0),
    *,
    exposure: float = 0.0,
    tone: str = "none",
) -> FloatArray:
    """Draw a PEM over its ray-traced background and write the picture.

    Parameters
    ----------
    directory
        Holds a complete PEM.
    point
        Of the parameter space, such as t in [0,1] of an arc. Between nodes their maps are blended by
        multilinear weights.
    out
        An .exr (scene-linear, float16) or a .png (clipped to [0,1] and sRGB-encoded, 8 bit).
    away
        Degrees of azimuth and elevation that the eye moves on from the point's place.
    exposure, tone
        Of a .png, as for `mirrorbake.tone.displayed`.

    Returns
    -------
    array
        The picture, scene-linear radiance (H, W, 3).

    Raises
    ------
    InputError
        The point is not of the space, or `out` has another suffix or cannot be written.
    OptionError
        The exposure or the tone mapping is none of `displayed`, or an .exr is to have one.
    """
    out = Path(out)
    if out.suffix.lower() not in PICTURE_SUFFIXES:
        raise InputError(f"{out}: expected a name that ends in {' or '.join(PICTURE_SUFFIXES)}")
    check_picture_display(out, exposure, tone)
    check_writable(out)
    picture = picture_of(open_pem(Path(directory)), point, away)
    _core.save_image(str(out), displayed(picture, exposure, tone), ["R", "G", "B"])
    return picture


def check_picture_display(path: Path, exposure: float, tone: str) -> None:
    """Raise OptionError for what `mirrorbake.tone.displayed` refuses, and for changes of an .exr."""
    check_display(exposure, tone)
    if path.suffix.lower() == ".exr" and (exposure != 0.0 or tone != "none"):
        raise OptionError(
            "exposure and tone-map: an .exr holds scene-linear radiance, expected neither, or .png"
        )


def picture_of(pem: OpenedPem, point: PointLike, away: tuple[float, float] = (0.0, 0.0)) -> FloatArray:
    """Draw an opened PEM over its ray-traced background; as `render`, which writes the picture too."""
    if any(away):
        return _picture_from_beyond(pem, point, away)
    blend = pem.space.neighbours(point)
    if len(blend) == 1 and pem.space.sample(blend[0][0]) == pem.space.point(point):
        images = pem.store.read_images(blend[0][0])
    else:
        images = images_of_trace(pem.stage.trace(point))
    samples = pem.stage.visibility(point, pem.run_time.places)
    return images.composite(pem.run_time.render("pem", point, samples))


def _picture_from_beyond(pem: OpenedPem, point: PointLike, away: tuple[float, float]) -> FloatArray:
    stage, model = pem.stage.at(point), pem.run_time.model
    cameras = stage.built.cameras
    azimuth, elevation = cameras.angles_of(cameras.eye(pem.space.point(point)))
    if not abs(elevation + away[1]) < 90.0:
        raise InputError(f"away = {away[0]:g},{away[1]:g}: the eye would pass straight above or below")
    camera = cameras.around(azimuth + away[0], elevation + away[1])
    reflector = stage.built.reflector
    images = images_of_trace(stage.tracer.trace_layers(camera, reflector, stage.options))
    samples = stage.tracer.trace_visibility(camera, reflector, stage.options, pem.run_time.places)
    degrees = cameras.degrees_outside(camera.eye)
    return images.composite(pem.run_time.render("pem", point, samples, model, degrees))

"""[views] of a scene file: the cameras, and the axes of the parameter space along which they move."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from mirrorbake.scene.config_values import AUTO, ImageSide, Section, Vec3, as_tuple

_DEFAULTS: Mapping[str, Mapping[str, float]] = {
    "dome": {"degrees": 360.0, "count": 12},
    "none": {"degrees": 360.0, "count": 64},
}
"""Of kinds of views where they are not an arc's."""

_MEANINGLESS: Mapping[str, tuple[str, ...]] = {
    "arc": ("elevation", "rings"),
    "dome": ("height", "around"),
    "fixed": ("elevation", "rings", "degrees", "count", "around"),
    "none": ("height", "rings", "traced", "around"),
}
"""Keys that a kind of views does not know."""

Elevation = Annotated[float, Field(ge=-89, le=89)]


class Views(Section):
    """[views]: where the cameras are.

    `arc`: evenly spaced on an arc about the vertical through `centre`. The eye of parameter t in [0,1] is at
    centre + (radius·sin a, height, radius·cos a), a = start + t·degrees, and looks at the centre.

    `dome`: over a part of a sphere about `centre`, `count` azimuths by `rings` elevations.

    `fixed`: a single camera, where an arc would start.

    `none`: no parameters. One set of maps is inferred from `count` views spread over a part of a sphere.
    """

    kind: Literal["arc", "dome", "fixed", "none"] = "arc"
    centre: Vec3 | None = None
    """Default: the middle of the object's bounding box."""
    radius: Annotated[float, Field(gt=0, le=1e6)] | None = None
    """Of the arc, or of the dome's sphere. Default: so far that the object's bounding sphere fills the
    frame."""
    height: Annotated[float, Field(ge=-1e6, le=1e6)] | None = None
    """Of the eye above the centre (`arc`, `fixed`). Default: the eye looks down at 20 degrees."""
    start: Annotated[float, Field(ge=-3600, le=3600)] = 0.0
    degrees: Annotated[float, Field(ge=-360, le=360)] = 99.0
    """Length of the arc, or of the dome's azimuths, which close at 360. Default of domes: 360."""
    elevation: Annotated[tuple[Elevation, Elevation], BeforeValidator(as_tuple)] = (5.0, 60.0)
    """Of a dome, and of `none`: the lowest and the highest above the horizon."""
    count: Annotated[Annotated[int, Field(ge=1, le=100_000)] | None, *AUTO] = 100
    """Maps along the arc, or along a ring of the dome (default there: 12); of `none`: views (default: 64).
    "auto", of arcs and domes: as few as meet `auto.decibels`."""
    traced: Annotated[Annotated[int, Field(ge=0, le=1000)] | None, *AUTO] = None
    """Views between neighbouring maps that are traced, too, and fitted by what the maps' blend shows. "auto":
    where the maps are far apart, by `auto.quality`, or as many as `auto.decibels` needs."""
    around: Annotated[Annotated[int, Field(ge=0, le=1000)] | None, *AUTO] = None
    """Views beside the arc, up to 8 degrees from a sample, to which its maps are fitted, too. "auto": where
    the maps are near, by `auto.quality`."""
    rings: Annotated[Annotated[int, Field(ge=1, le=1000)] | None, *AUTO] = 3
    """Maps of a dome from its lowest to its highest elevation. "auto": as few as meet `auto.decibels`."""
    fov: Annotated[float, Field(gt=0, lt=180)] = 30.0
    """Vertical field of view."""
    size: Annotated[tuple[ImageSide, ImageSide], BeforeValidator(as_tuple)] = (512, 512)
    """Pixels: width, height."""

    @property
    def awaits_spacing(self) -> bool:
        """Whether a plan decides how far apart the maps are."""
        return self.count is None or self.rings is None

    @model_validator(mode="before")
    @classmethod
    def _defaults_of_domes(cls, data: Any) -> Any:
        if isinstance(data, Mapping) and data.get("kind") in _DEFAULTS:
            return {**_DEFAULTS[data["kind"]], **data}
        return data

    @model_validator(mode="after")
    def _keys_fit_the_kind(self) -> Views:
        for key in _MEANINGLESS[self.kind]:
            if getattr(self, key) != type(self).model_fields[key].default:
                raise ValueError(f"`{key}` has no meaning for kind = {self.kind!r}")
        if self.kind == "none" and self.count is None:
            raise ValueError("`count` = 'auto' has no meaning for kind = 'none', which has no maps to space")
        if self.elevation[0] > self.elevation[1]:
            raise ValueError(f"elevation = {list(self.elevation)}: expected the lower one first")
        return self

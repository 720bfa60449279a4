"""The sections of a scene file: what SCENE.toml may say, and its defaults.

Lengths are in metres, angles in degrees, colours and radiance scene-linear with Rec.709 primaries.
Keys that are not known are errors, so that a misspelt one is found.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final, Literal, TypeAlias

from pydantic import BeforeValidator, Field, field_validator, model_validator

from mirrorbake import _core
from mirrorbake.projection import MAP_PROJECTIONS
from mirrorbake.proxy import FAMILIES
from mirrorbake.scene.config_axes import SCENE_AXES, Light, Motion, scene_axes
from mirrorbake.scene.config_infer import Infer
from mirrorbake.scene.config_shells import Shells, ShellSection, check_shells
from mirrorbake.scene.config_values import (
    AUTO,
    Extinction,
    Index,
    LightmapSize,
    MapSize,
    Reflectance,
    Section,
    Vec3,
    as_tuple,
    one_of,
    with_default,
)
from mirrorbake.scene.config_views import Elevation, Views

ILLUMINANT: Final = "D65"
"""Under which the colours of metals are meant: the white of Rec.709."""

MOST_PARTS: Final = 16
"""Into which a surface is cut."""

Parts: TypeAlias = Literal["split", "joined"] | Annotated[int, Field(ge=1, le=MOST_PARTS)]


class Reflector(Section):
    """[reflector]: the shiny object. It stands on y = 0, the table's top or the ground."""

    object: Literal["teapot"] | None = None
    """A built-in object; or give `mesh` or `scene_object`."""
    mesh: str | None = None
    """An .obj, .gltf or .glb file, with its materials unless there is a section [material]; or give `object`
    or `scene_object`."""
    scene_object: str | None = None
    """Name of an object of `surroundings.scene`, which stays where it is; its material is the file's, unless
    there is a section [material]."""
    height: Annotated[float, Field(gt=0, le=1e4)] = 0.15
    """The object is scaled to this height (the teapot: from its foot to the tip of the knob)."""
    scale: Annotated[float, Field(gt=0, le=1e6)] | None = None
    """Scales a mesh's own units to metres, instead of `height`."""
    rotation: Vec3 = (0.0, 0.0, 0.0)
    """Degrees about x, then y, then z, before the object is set on the ground. -90 about x lifts +Z up to
    +Y."""
    position: Vec3 = (0.0, 0.0, 0.0)
    """Where the centre of the object's base stands."""
    subdivisions: Annotated[int, Field(ge=1, le=128)] = 25
    """The teapot's tessellation: every patch becomes subdivisions² · 2 triangles."""
    parts: Annotated[Parts | None, *AUTO] = None
    """Which triangles get maps of their own: `split`, each part that the object has (the teapot's lid and
    body, the objects of a file); `joined`, all one; or a number of connected parts into which the surface is
    cut such that points of a part which reflect alike lie together. "auto": as many as keep apart what the
    views see differently."""

    longest_edge: Annotated[Annotated[float, Field(ge=0, le=1e6)] | None, *AUTO] = None
    """Of its triangles, metres: longer ones are halved, since the body's own light is stored at the vertices.
    0: they stay as they are. "auto": if that light would be wrong between them."""

    @model_validator(mode="before")
    @classmethod
    def _teapot_by_default(cls, data: Any) -> Any:
        return with_default(data, ("object", "mesh", "scene_object"), "teapot")

    @model_validator(mode="after")
    def _one_source(self) -> Reflector:
        if sum(source is not None for source in (self.object, self.mesh, self.scene_object)) != 1:
            raise ValueError("give either `object`, `mesh` or `scene_object`")
        if self.scene_object is not None:
            for key, field in type(self).model_fields.items():
                if key != "scene_object" and getattr(self, key) != field.default:
                    raise ValueError(f"`{key}` has no meaning for `scene_object`, which stays as it is")
        if self.object is not None and self.scale is not None:
            raise ValueError("`scale` is for meshes; set the teapot's `height`")
        return self


_OTHER_NAMES = {"chrome": "chromium"}
_LOBES = {"roughness": "ggx", "exponent": "phong"}


class MaterialConfig(Section):
    """[material]: what the reflector is made of."""

    fresnel: Literal["constant", "schlick", "dielectric", "conductor"] = "schlick"
    """Default where `metal`, `eta` or `k` is given: `conductor`; where `ior` is: `dielectric`."""
    r0: Reflectance | None = None
    """`constant`: reflectance; `schlick`: at normal incidence. Default 0.9."""
    ior: Index | None = None
    """`dielectric`: relative index of refraction. Default 1.5."""
    eta: Index | None = None
    """`conductor`: real part of the relative index."""
    k: Extinction | None = None
    """`conductor`: extinction coefficient."""
    metal: str | None = None
    """`conductor`: takes `eta` and `k` from the measured optical constants of a metal, by name or symbol."""
    albedo: Reflectance = (0.0, 0.0, 0.0)
    """Diffuse reflectance under the mirror lobe; black has no diffuse layer."""
    texture: str | None = None
    """Image that multiplies the albedo, on the mesh's texture coordinates."""
    layers: Literal["additive", "coated"] = "additive"
    """`additive`: F·L + D; `coated`: F·L + (1 - F)·D."""
    lobe: Literal["mirror", "ggx", "phong"] = "mirror"
    """Directions into which it reflects; `roughness` alone means `ggx`, `exponent` `phong`."""
    roughness: Annotated[float, Field(gt=0, le=1)] | None = None
    """`ggx`: α of the facets' slopes. Default 0.1."""
    exponent: Annotated[float, Field(ge=1, le=1e6)] | None = None
    """`phong`: of the cosine. Default 100."""

    @model_validator(mode="before")
    @classmethod
    def _parameters_imply_the_model(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        lobes = [lobe for key, lobe in _LOBES.items() if data.get(key) is not None]
        data = {"lobe": lobes[0], **data} if lobes else data
        if "fresnel" in data:
            return data
        for keys, model in ((("metal", "eta", "k"), "conductor"), (("ior",), "dielectric")):
            if any(data.get(key) is not None for key in keys):
                return {**data, "fresnel": model}
        return data

    @model_validator(mode="after")
    def _parameters_fit_the_model(self) -> MaterialConfig:
        used = {
            "constant": {"r0"},
            "schlick": {"r0"},
            "dielectric": {"ior"},
            "conductor": {"eta", "k", "metal"},
        }
        for key in ("r0", "ior", "eta", "k", "metal"):
            if getattr(self, key) is not None and key not in used[self.fresnel]:
                raise ValueError(f"`{key}` has no meaning for fresnel = {self.fresnel!r}")
        for key, lobe in _LOBES.items():
            if getattr(self, key) is not None and self.lobe != lobe:
                raise ValueError(f"`{key}` has no meaning for lobe = {self.lobe!r}")
        has_index = self.eta is not None and self.k is not None
        if self.fresnel == "conductor" and (self.metal is not None) == has_index:
            raise ValueError("fresnel = 'conductor' needs either `metal`, or `eta` and `k`")
        return self

    @field_validator("metal")
    @classmethod
    def _known_metal(cls, name: str | None) -> str | None:
        if name is not None:
            name = _OTHER_NAMES.get(name.lower(), name)
            _core.fit_metal(name, ILLUMINANT)
        return name


class Ground(Section):
    """[surroundings.ground]: a diffuse disc below the object, for surroundings that have none."""

    radius: Annotated[float, Field(gt=0, le=1e4)] = 0.5
    albedo: Reflectance = (0.5, 0.5, 0.5)


class Surroundings(Section):
    """[surroundings]: what the object mirrors."""

    room: Literal["furnished"] | None = None
    """A built-in room; or give `panorama` or `scene`."""
    panorama: str | None = None
    """A latitude-longitude image, its centre along -Z, +Y up, or a cube map that its shape tells; or give
    `room` or `scene`. With `scene` it is the light from around that."""
    layer: str | None = None
    """Of a panorama in an EXR file that has colours in several layers."""
    part: str | None = None
    """Of a panorama in an EXR file of several parts: name or number. Otherwise the first with colours."""
    repair: bool = False
    """Fill NaN and infinite values of the panorama from their surroundings, instead of refusing it."""
    scene: str | None = None
    """An .obj, .gltf or .glb file with objects, materials and lights; or give `room` or `panorama`."""
    rotation: float = 0.0
    """Of the panorama, counter-clockwise about +Y seen from above."""
    scale: Annotated[float, Field(gt=0, le=1e6)] = 1.0
    """Factor on the panorama's radiance."""
    ground: Ground | None = None

    @model_validator(mode="before")
    @classmethod
    def _room_by_default(cls, data: Any) -> Any:
        return with_default(data, ("room", "panorama", "scene"), "furnished")

    @model_validator(mode="after")
    def _one_source(self) -> Surroundings:
        if (self.room is None) == (self.panorama is None and self.scene is None):
            raise ValueError("give either `room`, `panorama` or `scene`")
        if (self.room is not None or self.scene is not None) and self.ground is not None:
            raise ValueError("`ground` is for panoramas alone: a room or a scene has its own floor")
        return self


class Layers(Section):
    """[layers]: which layers the reflector gets. None stands for "auto" here and below."""

    diffuse: Annotated[bool | None, *AUTO] = None
    """What the body reflects and emits, as irradiance. "auto": if it changes the picture."""
    lightmap: Annotated[LightmapSize | None, *AUTO] = None
    """Texels along a side of a map on the mesh's texture coordinates, a power of two, that holds the body's
    irradiance; 0: it is at the vertices. "auto": what takes fewer bytes at equal error."""
    local: Annotated[bool | None, *AUTO] = None
    """Maps of the object's reflection in itself. "auto": for the parts whose picture it changes; without it
    a single map per part holds everything."""
    hull_split: Annotated[bool | None, *AUTO] = None
    """Keeps polygons on the convex hull, which cannot reflect the object, out of the local maps ([PEM] §4).
    "auto": if a view sees any."""


DistantShape: TypeAlias = Annotated[str, one_of(*FAMILIES)]


class Maps(Section):
    """[maps]: the environment maps."""

    size: Annotated[MapSize | None, *AUTO] = None
    """Texels along a side of a face, a power of two. "auto": what the views can tell apart."""
    projection: Annotated[str, one_of(*MAP_PROJECTIONS)] = "cube"
    """Six faces, or two dual paraboloids of a third of the texels."""
    distant: Annotated[DistantShape | None, *AUTO] = None
    """Geometry of the distant layer. "auto": the simplest shape that predicts where reflected rays end."""
    box: Literal["angle", "robust", "mean_distance"] = "angle"
    """How a box is fitted to the surroundings that the object sees: to the angles under which the map's
    origin sees them, as the other shapes are; to the walls by robust least squares; or with its bottom below
    the object and the other sides at the mean distance ([PEM] §4)."""
    shared_distant: Annotated[bool | None, *AUTO] = None
    """Whether all parts read one distant map, which saves a map for each further part ([PEM] §6). "auto": if
    they want the same of it."""
    precision: Literal["float16", "float32"] = "float16"
    """Storage of the maps on disk."""


class Trace(Section):
    """[trace]: the ray tracer."""

    samples: Annotated[Annotated[int, Field(ge=1, le=65536)] | None, *AUTO] = None
    """Per pixel. "auto": 16, or more where those leave too much noise: of a rough lobe, if `noise` is 0."""
    noise: Annotated[Annotated[float, Field(ge=0, lt=1)] | None, *AUTO] = None
    """Standard error of a pixel's displayed value, 0 to 1, above which a pixel gets more than `samples`; 0:
    none does. "auto": by `auto.quality`."""
    most_samples: Annotated[int, Field(ge=1, le=65536)] = 256
    """Per pixel, that `noise` may lead to."""
    depth: Annotated[Annotated[int, Field(ge=0, le=64)] | None, *AUTO] = None
    """Specular bounces after the first. "auto": as many as change the picture."""
    seed: Annotated[int, Field(ge=0, lt=2**63)] = 0
    indirect: Literal["none", "cached", "path"] = "cached"
    """Diffuse light from other diffuse surfaces."""
    cache_rays: Annotated[int, Field(ge=1, le=65536)] = 96
    """Rays per vertex and bounce with which `cached` indirect light is gathered."""


class Static(Section):
    """[static]: the maps that serve views far from all samples: inferred from views of a dome around."""

    views: Annotated[Annotated[int, Field(ge=0, le=10_000)] | None, *AUTO] = None
    """Of the dome; 0: there are no such maps. "auto": by `auto.quality`."""
    elevation: Annotated[tuple[Elevation, Elevation], BeforeValidator(as_tuple)] = (5.0, 60.0)
    """Of the dome: the lowest and the highest above the horizon."""
    beyond: Annotated[float, Field(ge=0, le=180)] = 25.0
    """Degrees of azimuth that the dome goes on past those of the samples."""

    @model_validator(mode="after")
    def _rises(self) -> Static:
        if self.elevation[0] > self.elevation[1]:
            raise ValueError(f"elevation = {list(self.elevation)}: expected the lower one first")
        return self


class Auto(Section):
    """[auto]: what the values that are "auto" are decided by."""

    quality: Literal["draft", "normal", "high"] = "normal"
    """What a bake may cost: noise of targets, passes, neighbours' views, the static set."""
    tolerance: Annotated[float, Field(gt=0, lt=1)] = 0.01
    """Relative RMS change of the object's picture that is worth no layer and no bounce."""
    noise: Annotated[float, Field(gt=0, lt=1)] = 0.05
    """Standard error of a pixel's displayed value, 0 to 1, that samples may leave if `trace.noise` is 0."""
    finer_share: Annotated[float, Field(ge=0, lt=1)] = 0.1
    """Share of the object's pixels whose reflections may be finer than the maps."""
    decibels: Annotated[float, Field(gt=0, le=100)] = 30.0
    """PSNR wanted of views between the maps, where `views.count` or `views.rings` is "auto"."""
    megabytes: Annotated[float, Field(gt=0, le=1e9)] | None = None
    """That all samples may take on disk then. None: any."""
    minutes: Annotated[float, Field(gt=0, le=1e7)] | None = None
    """By the clock of this machine, that baking all samples may take then. None: any."""


class SceneConfig(Section):
    """A whole scene file."""

    reflector: Reflector = Reflector(object="teapot")
    material: MaterialConfig | None = None
    """None: the materials that a `mesh` or a `scene_object` has in its file."""
    surroundings: Surroundings = Surroundings(room="furnished")
    views: Views = Views()
    motion: Motion | None = None
    """None: the object stays where it is."""
    light: Light | None = None
    """None: the light stays as it is."""
    layers: Layers = Layers()
    shells: Annotated[Shells | None, BeforeValidator(as_tuple), *AUTO] = None
    """[[shells]], front to back. "auto": `local`, the object where it is seen in itself, and the rest,
    from which what is near or on a plane is split where that is worth its maps."""
    maps: Maps = Maps()
    trace: Trace = Trace()
    infer: Infer = Infer()
    static: Static = Static()
    auto: Auto = Auto()

    @model_validator(mode="before")
    @classmethod
    def _built_in_objects_have_a_material(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or data.get("material") is not None:
            return data
        reflector = data.get("reflector")
        if isinstance(reflector, Mapping) and any(
            reflector.get(key) is not None for key in ("scene_object", "mesh")
        ):
            return data
        return {**data, "material": {}}

    @model_validator(mode="after")
    def _sections_fit_each_other(self) -> SceneConfig:
        if self.reflector.scene_object is not None and self.surroundings.scene is None:
            raise ValueError("reflector.scene_object needs surroundings.scene, the file that it is in")
        if self.shells is not None:
            check_shells(self.shells)
            if self.layers.local is not None:
                raise ValueError("layers.local has no meaning beside [[shells]]")
            if self.maps.distant is not None and self.shells[-1].proxy != "auto":
                raise ValueError(
                    f"maps.distant and the proxy of {self.shells[-1].name!r} are one; give either"
                )
        if self.infer.smoothness is None and self.infer.fit == "layers":
            raise ValueError('infer.smoothness = "auto" needs infer.fit = "display"')
        self._check_spacing()
        for axis in scene_axes(self).values():
            axis.check(self)
        return self

    def _check_spacing(self) -> None:
        if self.views.awaits_spacing:
            key = "views.count" if self.views.count is None else "views.rings"
            if self.infer.fit == "layers" or self.infer.matrix == "probed":
                raise ValueError(f'{key} = "auto" needs infer.fit = "display" and infer.matrix = "analytic"')
            if self.views.count is None and self.views.degrees == 0.0:
                raise ValueError('views.count = "auto" needs views.degrees other than 0')
            if self.views.rings is None and self.views.elevation[0] == self.views.elevation[1]:
                raise ValueError('views.rings = "auto" needs views.elevation with two different angles')
            return
        for name in ("decibels", "megabytes", "minutes"):
            value = getattr(self.auto, name)
            if value != Auto.model_fields[name].default:
                raise ValueError(
                    f'auto.{name} = {value:g}: has no meaning unless views.count or views.rings is "auto"'
                )


PATH_KEYS = (
    ("reflector", "mesh"),
    ("material", "texture"),
    ("surroundings", "panorama"),
    ("surroundings", "scene"),
)
"""The keys whose values are files."""

SECTIONS: Mapping[str, type[Section]] = {
    "reflector": Reflector,
    "material": MaterialConfig,
    "surroundings": Surroundings,
    "ground": Ground,
    "views": Views,
    **SCENE_AXES,
    "layers": Layers,
    "shells": ShellSection,
    "maps": Maps,
    "trace": Trace,
    "infer": Infer,
    "static": Static,
    "auto": Auto,
}
"""Every section by its name."""

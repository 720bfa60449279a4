"""The axes of a study: what trades time or bytes against error, with cheaper and dearer neighbours."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.pem.run_time import lookups_of
from mirrorbake.projection import MAP_PROJECTIONS
from mirrorbake.study.trade import maps
from mirrorbake.study.trade.drawing import FILTERS, Drawing, fresnel_models, label_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.scene.stage import Stage

LARGEST_MAP = 1024
FEWEST_SAMPLES, MOST_SAMPLES = 4, 256


@dataclass(frozen=True)
class Setting:
    """One value of an axis."""

    label: str
    overrides: Mapping[str, Any] = field(default_factory=dict)
    """Keys of the scene file that it sets, such as `maps.size`."""
    drawing: Drawing = field(default_factory=Drawing)
    """How the maps are drawn."""
    levels: maps.Levels | None = None
    """Where the coarser levels of the maps come from; None: as they were inferred."""
    storage: maps.Storage | None = None
    """How texels are stored; None: as the scene file says."""


@dataclass(frozen=True)
class Axis:
    """A choice, and how it is made and could be made. The first setting is the scene's own."""

    name: str
    title: str
    settings: tuple[Setting, ...]

    def setting(self, label: str) -> Setting:
        """The setting of a label; KeyError for none."""
        for setting in self.settings:
            if setting.label == label:
                return setting
        raise KeyError(label)


def axes_of(stage: Stage) -> list[Axis]:
    """The axes of a scene in which nothing is "auto" that an axis is about.

    Choices that the scene cannot make have no axis: a mesh of one object has no parts.
    """
    found = [make(stage.config) for make in _AXES]
    found += [make(stage) for make in _DRAWN_AXES]
    axes = [axis for axis in found if axis is not None and len(axis.settings) > 1]
    return sorted(axes, key=lambda axis: AXIS_NAMES.index(axis.name))


def _value(config: SceneConfig, key: str) -> Any:
    section, name = key.split(".")
    return getattr(getattr(config, section), name)


def _of_key(
    name: str, title: str, key: str, values: Callable[[Any], list[Any]], fit: str | None = None
) -> Callable[..., Axis | None]:
    """An axis of one key of the scene file: its own value, then the others; of one way to fit alone."""

    def make(config: SceneConfig) -> Axis | None:
        own = _value(config, key)
        if own is None or fit not in (None, config.infer.fit):
            return None
        settings = [Setting(_label(own), {})]
        settings += [Setting(_label(value), {key: value}) for value in values(own) if value != own]
        return Axis(name, title, tuple(settings))

    return make


def _label(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _sizes(own: int) -> list[int]:
    return [size for size in (own // 4, own // 2, own * 2) if 4 <= size <= LARGEST_MAP]


def _size(config: SceneConfig) -> Axis:
    own = config.maps.size
    assert own is not None, "the study decides it"
    settings = [Setting(str(own)), Setting("for each part", {"maps.size": "auto"})]
    settings += [Setting(str(size), {"maps.size": size}) for size in _sizes(own)]
    return Axis("size", "texels along a face", tuple(settings))


def _samples(own: int) -> list[int]:
    wanted = (max(own // 4, FEWEST_SAMPLES), own * 4)
    return [samples for samples in wanted if FEWEST_SAMPLES <= samples <= MOST_SAMPLES]


def _spacing(config: SceneConfig) -> Axis | None:
    views, count = config.views, config.views.count
    if count is None or count < 2 or views.degrees == 0.0:
        return None
    step = views.degrees / (count - 1)
    middle = views.start + 0.5 * views.degrees
    settings = [Setting(f"{abs(step):g}°")]
    for factor in (0.5, 2.0, 5.0):
        degrees = factor * views.degrees
        if abs(degrees) <= 90.0:
            overrides = {"views.start": middle - 0.5 * degrees, "views.degrees": degrees}
            settings.append(Setting(f"{abs(factor * step):g}°", overrides))
    return Axis("spacing", "degrees between views", tuple(settings))


def _blending(config: SceneConfig) -> Axis | None:
    if config.views.count is None or config.views.count < 2:
        return None
    settings = (Setting("blended"), Setting("nearest", drawing=Drawing(nearest=True)))
    return Axis("blending", "between samples", settings)


def _parts(config: SceneConfig) -> Axis | None:
    own = config.reflector.parts
    if own is None or config.reflector.scene_object is not None:
        return None
    others = [parts for parts in ("joined", "split", 4, 8) if parts != own]
    settings = [Setting(_label(own)), *(Setting(_label(p), {"reflector.parts": p}) for p in others)]
    return Axis("parts", "parts with maps of their own", tuple(settings))


def _shared(config: SceneConfig) -> Axis | None:
    parts = config.reflector.parts
    if parts in (None, "joined", 1) or (parts == "split" and config.reflector.object is None):
        return None
    own = bool(config.maps.shared_distant)
    settings = (Setting(_label(own)), Setting(_label(not own), {"maps.shared_distant": not own}))
    return Axis("shared", "one distant map for all parts", settings)


def _shells(config: SceneConfig) -> Axis:
    own = {True: "local and distant", False: "one shell", None: "as planned"}[config.layers.local]
    settings = [Setting(own)]
    for value, label in ((True, "local and distant"), (False, "one shell")):
        if value is not config.layers.local:
            settings.append(Setting(label, {"layers.local": value}))
    return Axis("shells", "shells of maps", tuple(settings))


def _levels(config: SceneConfig) -> Axis:
    settings = [Setting("inferred")]
    settings += [Setting(levels.name, levels=levels) for levels in maps.LEVELS]
    return Axis("levels", "coarser levels of the maps", tuple(settings))


def _prefilter(config: SceneConfig) -> Axis:
    settings = [Setting("inferred"), *(Setting(levels.name, levels=levels) for levels in maps.PREFILTERS)]
    return Axis("prefilter", "prefiltering of the coarser levels", tuple(settings))


def _storage(config: SceneConfig) -> Axis:
    other = "float32" if config.maps.precision == "float16" else "float16"
    settings = [Setting(config.maps.precision), Setting(other, {"maps.precision": other})]
    settings += [Setting(storage.name, storage=storage) for storage in maps.STORAGES]
    return Axis("storage", "storage of texels", tuple(settings))


def _fit(config: SceneConfig) -> Axis:
    display = Setting("the displayed pixel", {"infer.fit": "display"})
    # Layers by themselves take all samples of a pixel alike.
    layers = Setting("every layer by itself", {"infer.fit": "layers", "trace.noise": 0.0})
    own, other = (display, layers) if config.infer.fit == "display" else (layers, display)
    return Axis("fit", "what maps are fitted to", (Setting(own.label), other))


def _filter(stage: Stage) -> Axis:
    infer = stage.config.infer
    model = _core.run_time_model(infer.run_time)
    own = label_of(model if infer.fit == "display" else lookups_of(infer.footprint_scale))
    settings = [Setting(own), *(Setting(f, drawing=Drawing(filter=f)) for f in FILTERS if f != own)]
    return Axis("filter", "filter of a lookup", tuple(settings))


def _coordinates(stage: Stage) -> Axis | None:
    built = stage.built
    if not len(built.scene.object_mesh(built.reflector).normals):
        return None
    vertex = Setting("per vertex", drawing=Drawing(coordinates="vertex"))
    return Axis("coordinates", "where lookups are computed", (Setting("per pixel"), vertex))


def _fresnel(stage: Stage) -> Axis | None:
    built = stage.built
    first, *others = fresnel_models(stage)
    if not len(built.scene.object_mesh(built.reflector).normals):
        others = [model for model in others if model != "Schlick at vertices"]
    settings = (Setting(first), *(Setting(model, drawing=Drawing(fresnel=model)) for model in others))
    return Axis("fresnel", "Fresnel reflectance", settings)


_SHAPES = ["infinite", "sphere", "box", "ellipsoid"]

_AXES: tuple[Callable[[SceneConfig], Axis | None], ...] = (
    _size,
    _levels,
    _prefilter,
    _storage,
    _of_key("projection", "projection of the maps", "maps.projection", lambda own: list(MAP_PROJECTIONS)),
    _of_key("geometry", "geometry of the distant map", "maps.distant", lambda own: _SHAPES),
    _shells,
    _parts,
    _shared,
    _of_key("samples", "samples of a target pixel", "trace.samples", _samples),
    _of_key("noise", "noise that a target's pixel may have", "trace.noise", lambda own: [0.0, 0.01, 0.02]),
    _spacing,
    _blending,
    _of_key(
        "run_time", "run time", "infer.run_time", lambda own: ["Web1", "Web", "Reference"], fit="display"
    ),
    _fit,
    _of_key(
        "neighbours", "weight of neighbours' views", "infer.neighbours", lambda own: [0.0, 0.3], "display"
    ),
    _of_key("passes", "passes of the fit", "infer.passes", lambda own: [1, 2, 4], fit="display"),
    _of_key(
        "footprint",
        "footprint of a lookup, pixels",
        "infer.footprint_scale",
        lambda own: [0.25, 0.5, 1.0],
        fit="layers",
    ),
    _of_key("smoothness", "λ of smoothness", "infer.smoothness", lambda own: [own / 10, own * 10]),
    _of_key("prior", "what unseen texels fall back to", "infer.prior", lambda own: ["captured", "smooth"]),
    _of_key("prior_weight", "λ of the prior", "infer.prior_weight", lambda own: [own / 10, own * 10]),
    _of_key("iterations", "iterations at most", "infer.iterations", lambda own: [own // 16, own // 4]),
)
_DRAWN_AXES: tuple[Callable[[Stage], Axis | None], ...] = (_filter, _coordinates, _fresnel)

AXIS_NAMES = (
    *("size", "levels", "prefilter", "storage", "projection", "geometry", "shells", "parts", "shared"),
    *("samples", "noise", "spacing", "blending", "run_time", "filter", "coordinates", "fresnel"),
    *("fit", "neighbours", "passes", "footprint", "smoothness", "prior", "prior_weight", "iterations"),
)
"""Of all axes, in their order."""


def log_ratio(a: float, b: float) -> float:
    """Binary logarithm of a/b: octaves."""
    return float(np.log2(max(a, 1e-12) / max(b, 1e-12)))

"""The axes of a study: what trades time or bytes against error, with cheaper and dearer neighbours."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake.study.trade import maps

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from mirrorbake.scene.config import SceneConfig

LARGEST_MAP = 1024
FEWEST_SAMPLES, MOST_SAMPLES = 4, 256


@dataclass(frozen=True)
class Setting:
    """One value of an axis."""

    label: str
    overrides: Mapping[str, Any] = field(default_factory=dict)
    """Keys of the scene file that it sets, such as `maps.size`."""
    contender: str = "pem"
    """Which contender of an evaluation draws it."""
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


def axes_of(config: SceneConfig) -> list[Axis]:
    """The axes of a scene in which nothing is "auto" that an axis is about.

    Choices that the scene cannot make have no axis: the teapot alone has parts.
    """
    found = [make(config) for make in _AXES]
    return [axis for axis in found if axis is not None and len(axis.settings) > 1]


def _value(config: SceneConfig, key: str) -> Any:
    section, name = key.split(".")
    return getattr(getattr(config, section), name)


def _of_key(
    name: str, title: str, key: str, values: Callable[[Any], list[Any]]
) -> Callable[..., Axis | None]:
    """An axis of one key of the scene file: its own value, then the others."""

    def make(config: SceneConfig) -> Axis | None:
        own = _value(config, key)
        if own is None:
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


def _samples(own: int) -> list[int]:
    wanted = (max(own // 4, FEWEST_SAMPLES), own * 4)
    return [samples for samples in wanted if FEWEST_SAMPLES <= samples <= MOST_SAMPLES]


def _spacing(config: SceneConfig) -> Axis | None:
    views = config.views
    step = views.degrees / max(views.count - 1, 1)
    if views.count < 2 or step == 0.0:
        return None
    middle = views.start + 0.5 * views.degrees
    settings = [Setting(f"{abs(step):g}°")]
    for factor in (0.5, 2.0, 5.0):
        degrees = factor * views.degrees
        if abs(degrees) <= 90.0:
            overrides = {"views.start": middle - 0.5 * degrees, "views.degrees": degrees}
            settings.append(Setting(f"{abs(factor * step):g}°", overrides))
    return Axis("spacing", "degrees between views", tuple(settings))


def _blending(config: SceneConfig) -> Axis | None:
    if config.views.count < 2:
        return None
    settings = (Setting("blended"), Setting("nearest", contender="pem_nearest"))
    return Axis("blending", "between samples", settings)


def _parts(config: SceneConfig) -> Axis | None:
    if config.reflector.object is None:
        return None
    other = "joined" if config.reflector.parts == "split" else "split"
    settings = (Setting(config.reflector.parts), Setting(other, {"reflector.parts": other}))
    return Axis("parts", "parts with maps of their own", settings)


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


def _storage(config: SceneConfig) -> Axis:
    other = "float32" if config.maps.precision == "float16" else "float16"
    settings = [Setting(config.maps.precision), Setting(other, {"maps.precision": other})]
    settings += [Setting(storage.name, storage=storage) for storage in maps.STORAGES]
    return Axis("storage", "storage of texels", tuple(settings))


_SHAPES = ["infinite", "sphere", "box", "ellipsoid"]

_AXES: tuple[Callable[[Any], Axis | None], ...] = (
    _of_key("size", "texels along a face", "maps.size", _sizes),
    _levels,
    _storage,
    _of_key("geometry", "geometry of the distant map", "maps.distant", lambda own: _SHAPES),
    _shells,
    _parts,
    _of_key("samples", "samples of a target pixel", "trace.samples", _samples),
    _spacing,
    _blending,
    _of_key(
        "footprint", "footprint of a lookup, pixels", "infer.footprint_scale", lambda own: [0.25, 0.5, 1.0]
    ),
    _of_key("smoothness", "λ of smoothness", "infer.smoothness", lambda own: [own / 10, own * 10]),
    _of_key("prior", "what unseen texels fall back to", "infer.prior", lambda own: ["captured", "smooth"]),
    _of_key("prior_weight", "λ of the prior", "infer.prior_weight", lambda own: [own / 10, own * 10]),
    _of_key("iterations", "iterations at most", "infer.iterations", lambda own: [own // 8, own * 4]),
)

AXIS_NAMES = (
    *("size", "levels", "storage", "geometry", "shells", "parts", "samples", "spacing", "blending"),
    *("footprint", "smoothness", "prior", "prior_weight", "iterations"),
)
"""Of all axes, in their order."""


def log_ratio(a: float, b: float) -> float:
    """Binary logarithm of a/b: octaves."""
    return float(np.log2(max(a, 1e-12) / max(b, 1e-12)))

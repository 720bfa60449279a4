"""Fresnel reflectance of a reflector's materials, evaluated apart from the tracer."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from mirrorbake import fresnel

if TYPE_CHECKING:
    from collections.abc import Callable

    from mirrorbake import _core
    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.stage import Stage

How: TypeAlias = Literal["exact", "table", "Schlick"]
TABLE_ERROR = 1e-3
"""Of tables of reflectance, which are as long as that needs."""


def materials_of(stage: Stage) -> list[_core.Material]:
    """Materials of a reflector's parts."""
    scene = stage.built.scene
    return [scene.material(index) for index in scene.object_part_materials(stage.built.reflector)]


def is_plain(stage: Stage) -> bool:
    """Whether reflectance depends on the angle alone, not on textures or vertices."""
    return not any(
        material.specular_texture.texture >= 0 or material.colors_tint_reflectance
        for material in materials_of(stage)
    )


def reflectance(material: _core.Fresnel, how: How, cosines: FloatArray) -> FloatArray:
    """F (n, 3) at cosines (n,) in [0, 1]: by the material's model, by a table of it, or by Schlick's formula.

    Schlick's formula takes the model's reflectance along the normal.
    """
    c = np.ascontiguousarray(cosines, np.float32)
    channels = []
    for channel in range(3):
        if material.model == "constant":
            channels.append(np.full_like(c, material.r0[channel]))
        else:
            channels.append(np.asarray(_function(*_curve(material, channel), how)(c), np.float32))
    return np.stack(channels, axis=-1)


def _curve(material: _core.Fresnel, channel: int) -> tuple[str, float, float]:
    if material.model == "schlick":
        return "schlick", material.r0[channel], 0.0
    return (
        material.model,
        material.eta[channel],
        material.k[channel] if material.model == "conductor" else 0.0,
    )


@lru_cache(maxsize=64)
def _function(model: str, first: float, second: float, how: How) -> Callable[[Any], Any]:
    curve: fresnel.Model
    if model == "schlick":
        curve = fresnel.Schlick(first)
    elif model == "dielectric":
        curve = fresnel.Dielectric(first)
    else:
        curve = fresnel.Conductor(first, second)
    if how == "table":
        return fresnel.table_for_error(curve, TABLE_ERROR)
    return fresnel.Schlick(float(curve(1.0))) if how == "Schlick" else curve

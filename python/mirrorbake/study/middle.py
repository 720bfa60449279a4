"""A scene with few of its views, for a study."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mirrorbake.scene.config import SceneConfig


def overridden(config: SceneConfig, overrides: Mapping[str, Any]) -> SceneConfig:
    """Return a scene with other values of some keys, such as `maps.size`.

    Raises
    ------
    InputError
        A value is out of range.
    """
    data: dict[str, Any] = json.loads(config.model_dump_json())
    for key, value in overrides.items():
        section, name = key.split(".")
        data[section][name] = value
    return parse_config(data, "study")


def in_the_middle(config: SceneConfig, most: int) -> SceneConfig:
    """Return a scene with at most so many views, those around the middle of its arc, as far apart as there.

    A scene without an arc, or whose views are yet to be counted, is returned as it is.
    """
    views = config.views
    if views.kind != "arc" or views.count is None or views.count <= most:
        return config
    step = views.degrees / (views.count - 1)
    first = (views.count - 1) // 2 - (most - 1) // 2
    return overridden(
        config,
        {
            "views.count": most,
            "views.start": views.start + step * first,
            "views.degrees": step * (most - 1),
        },
    )

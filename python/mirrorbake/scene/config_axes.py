"""The sections of a scene file that are axes of the parameter space and change the scene: [motion], [light].

Each says all that its axis is: its keys, what it needs of the other sections, and what a coordinate does.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Final

import numpy as np
from pydantic import Field, model_validator

from mirrorbake.scene.config_values import Section, Vec3
from mirrorbake.scene.pose import AT_REST, Pose

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mirrorbake.scene.config import SceneConfig


@dataclass(frozen=True)
class Arrangement:
    """A scene at a place of its parameter space."""

    config: SceneConfig
    """What is to be built."""
    pose: Pose = AT_REST
    """Where the reflector has moved to."""


class SceneAxis(Section, ABC):
    """A section that is an axis from 0, where the scene is as the other sections have it, to 1."""

    count: Annotated[int, Field(ge=1, le=100_000)] = 5
    """Maps along the axis."""

    @abstractmethod
    def check(self, config: SceneConfig) -> None:
        """Raise ValueError if the axis does not fit the other sections."""

    @abstractmethod
    def apply(self, arrangement: Arrangement, coordinate: float) -> Arrangement:
        """Return an arrangement with what the axis changes at a coordinate."""


class Motion(SceneAxis):
    """[motion]: an axis of the parameter space along which the object moves, from 0 to 1."""

    to: Vec3 = (0.0, 0.0, 0.0)
    """How far the object has moved at 1, in metres."""
    turn: Annotated[float, Field(ge=-3600, le=3600)] = 0.0
    """How far it has turned about the vertical through the centre of its base at 1, in degrees."""

    @model_validator(mode="after")
    def _moves(self) -> Motion:
        if not any(self.to) and not self.turn:
            raise ValueError("give `to` or `turn`: the object does not move")
        return self

    def check(self, config: SceneConfig) -> None:
        if config.reflector.scene_object is not None:
            raise ValueError("[motion] has no meaning for reflector.scene_object, which stays where it is")

    def apply(self, arrangement: Arrangement, coordinate: float) -> Arrangement:
        pose = Pose(coordinate * np.array(self.to), coordinate * self.turn)
        return replace(arrangement, pose=pose)


class Light(SceneAxis):
    """[light]: an axis of the parameter space along which the panorama turns, from 0 to 1."""

    turn: Annotated[float, Field(ge=-3600, le=3600)] = 90.0
    """Of the panorama at 1, in degrees, counter-clockwise about +Y seen from above."""

    def check(self, config: SceneConfig) -> None:
        if config.surroundings.panorama is None:
            raise ValueError("[light] needs surroundings.panorama, the light that it turns")

    def apply(self, arrangement: Arrangement, coordinate: float) -> Arrangement:
        surroundings = arrangement.config.surroundings
        turned = surroundings.rotation + coordinate * self.turn
        return replace(
            arrangement,
            config=arrangement.config.model_copy(
                update={"surroundings": surroundings.model_copy(update={"rotation": turned})}
            ),
        )


SCENE_AXES: Final[Mapping[str, type[SceneAxis]]] = {"motion": Motion, "light": Light}
"""By their sections, which are fields of `SceneConfig` of the same names; in the order of the axes."""


def scene_axes(config: SceneConfig) -> dict[str, SceneAxis]:
    """Return the axes that a scene file has, by name."""
    found = {name: getattr(config, name) for name in SCENE_AXES}
    return {name: axis for name, axis in found.items() if axis is not None}


def arranged(config: SceneConfig, place: Mapping[str, float]) -> Arrangement:
    """Return a scene at a place, the coordinates of its scene axes by name; 0 where one is missing."""
    arrangement = Arrangement(config)
    for name, axis in scene_axes(config).items():
        arrangement = axis.apply(arrangement, place.get(name, 0.0))
    return arrangement

"""From a scene file to objects in front of a ray tracer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.errors import InputError
from mirrorbake.proxy import hull_triangles
from mirrorbake.scene.cameras import Cameras, resolve_cameras
from mirrorbake.scene.config_axes import arranged
from mirrorbake.scene.origin import Origin, loaded_nearby
from mirrorbake.scene.parameters import ParameterSpace, Point, format_point, space_of
from mirrorbake.scene.reflector import add_reflector, named_object
from mirrorbake.scene.shell_rules import trace_rules

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.config import SceneConfig, Surroundings

GROUND_THICKNESS = 0.02


@dataclass(frozen=True)
class BuiltScene:
    """A scene ready for tracing, and what the bake needs to know of its reflector."""

    origin: Origin
    """Where the zero of all positions here lies in the scene file's world."""
    scene: _core.Scene
    reflector: int
    """Number of the object."""
    positions: FloatArray
    """(V, 3) of the reflector."""
    triangles: NDArray[np.uint32]
    """(T, 3)."""
    parts: NDArray[np.uint16]
    """(T,) part of every triangle."""
    part_names: list[str]
    cameras: Cameras
    space: ParameterSpace
    notes: list[str]
    """What the user should know about the inputs, such as values that had to be changed."""

    @cached_property
    def on_hull(self) -> NDArray[np.bool_]:
        """(T,) which triangles lie on the reflector's convex hull and cannot reflect it ([PEM] §4)."""
        return hull_triangles(self.positions, self.triangles)

    def with_space(self, space: ParameterSpace) -> BuiltScene:
        """Return the scene with maps at the nodes of another space, of the same axes.

        Raises
        ------
        InputError
            A view of one of them lies inside the reflector.
        """
        _check_eyes(self.scene.object_mesh(self.reflector), self.cameras, space, self.origin)
        return replace(self, space=space)


def build_scene(config: SceneConfig, point: Point | None = None) -> BuiltScene:
    """Build everything that a scene file describes.

    Parameters
    ----------
    config
        The scene file.
    point
        Of the parameter space, whose coordinates change the scene. None: at rest.

    Raises
    ------
    InputError
        A view lies inside the reflector, or the scene file has no such object, or a matte one.
    mirrorbake.FileError
        A mesh, a scene or an image is missing or corrupt.
    mirrorbake.InvalidArgument
        The scene is not usable: vertices that are not finite, no area.
    """
    space = space_of(config)
    place = {} if point is None else space.scene_coordinates(point)
    arrangement = arranged(config, place)
    config, pose = arrangement.config, arrangement.pose
    scene, notes, origin = _surroundings(config)
    reflector, more_notes = add_reflector(config, scene, pose)
    notes += more_notes
    if config.shells is not None:
        trace_rules(config.shells, scene.object_names, reflector)
    mesh, part_names = scene.object_mesh(reflector), scene.object_part_names(reflector)
    positions = np.asarray(mesh.positions)
    triangles = np.asarray(mesh.triangles)
    parts = np.asarray(mesh.parts) if len(mesh.parts) else np.zeros(len(triangles), np.uint16)
    # The cameras stay where they are when the object moves.
    cameras = resolve_cameras(config.views, pose.at_rest(positions.astype(np.float64)), origin)
    _check_eyes(mesh, cameras, space, origin)
    return BuiltScene(
        origin=origin,
        scene=scene,
        reflector=reflector,
        positions=positions,
        triangles=triangles,
        parts=parts,
        part_names=part_names,
        cameras=cameras,
        space=space,
        notes=notes,
    )


def _check_eyes(mesh: _core.TriangleMesh, cameras: Cameras, space: ParameterSpace, origin: Origin) -> None:
    for sample in space.samples():
        eye = cameras.eye(sample)
        if _core.encloses(mesh, eye):
            where = f"t = {format_point(sample)}" if len(sample) == 1 else format_point(sample)
            raise InputError(
                f"views: the eye at {where}, {_vector(np.add(eye, origin))}, lies inside the reflector; "
                "expected a view from outside"
            )


def _vector(v: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{x:.7g}" for x in v) + ")"


def _surroundings(config: SceneConfig) -> tuple[_core.Scene, list[str], Origin]:
    """Return the surroundings, what the user should know of them, and where their zero is.

    That is where the object stands; one that a file places is asked for its own position.
    """
    surroundings, origin = config.surroundings, config.reflector.position
    if surroundings.room is not None:
        scene = _core.make_room()
        if any(origin):
            scene.translate([-x for x in origin])
        return scene, [], origin
    scene, notes = _core.Scene(), list[str]()
    if surroundings.scene is not None:
        loaded, origin = _loaded_scene(config, surroundings.scene)
        scene = loaded.scene
        notes = [f"{surroundings.scene}: {w.message} ({w.count} times)" for w in loaded.warnings]
    if surroundings.panorama is not None:
        notes += _add_panorama(scene, surroundings, origin)
    return scene, notes, origin


def _loaded_scene(config: SceneConfig, path: str) -> tuple[_core.LoadedScene, Origin]:
    def load(origin: Origin) -> _core.LoadedScene:
        return _core.load_scene(path, origin=origin)

    if config.reflector.scene_object is None:
        origin = config.reflector.position
        return load(origin), origin
    return loaded_nearby(
        load,
        lambda loaded: np.asarray(loaded.scene.object_mesh(named_object(config, loaded.scene)).positions),
    )


def _add_panorama(scene: _core.Scene, surroundings: Surroundings, origin: Origin) -> list[str]:
    assert surroundings.panorama is not None
    panorama, negative, repaired = _core.load_panorama(
        surroundings.panorama, surroundings.layer or "", surroundings.part or "", surroundings.repair
    )
    counts = {"negative values were taken as 0": negative, "values were not finite and are filled": repaired}
    notes = [f"{surroundings.panorama}: {count} {words}" for words, count in counts.items() if count]
    scene.set_environment(panorama, surroundings.scale, surroundings.rotation)
    if surroundings.ground is not None:
        material = _core.Material(name="ground", albedo=surroundings.ground.albedo)
        disc = _core.make_cylinder(
            (-origin[0], -GROUND_THICKNESS - origin[1], -origin[2]),
            surroundings.ground.radius,
            GROUND_THICKNESS,
            96,
        )
        scene.add_object("ground", disc, scene.add_material(material), [])
    return notes

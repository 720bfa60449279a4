"""The reflector of a scene file: a built-in object, a mesh from its own file, or an object of the scene."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.errors import InputError
from mirrorbake.scene.config import ILLUMINANT, MaterialConfig, Reflector, SceneConfig
from mirrorbake.scene.origin import loaded_nearby
from mirrorbake.scene.pose import Pose, rotation_matrix
from mirrorbake.scene.refine import refined
from mirrorbake.scene.surface_parts import split_surface

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

REFLECTOR_NAME = "reflector"
MOST_OBJECTS = 8
"""A file with more objects is split into parts by its materials: every part has maps of its own."""


@dataclass(frozen=True)
class _Source:
    """What there is of a reflector before it stands in the scene."""

    mesh: _core.TriangleMesh
    part_names: list[str]
    part_materials: list[int]
    """Indices into the scene's materials; empty: the scene file's."""
    notes: list[str]


def add_reflector(config: SceneConfig, scene: _core.Scene, pose: Pose) -> tuple[int, list[str]]:
    """Put the reflector of a scene file into a scene.

    Parameters
    ----------
    config
        The scene file.
    scene
        Its surroundings, whose zero is where the object stands.
    pose
        Where the object has moved to.

    Returns
    -------
    tuple
        Number of the object, and what the user should know of its file.

    Raises
    ------
    InputError
        The scene has no such object, or a matte one, or the mesh is flat and has no scale.
    mirrorbake.FileError
        The mesh, or an image of it, is missing or corrupt.
    """
    reflector = config.reflector
    if reflector.scene_object is not None:
        return _scene_reflector(config, scene), []
    source = _source(config, scene)
    if reflector.longest_edge:
        finer = refined(source.mesh, reflector.longest_edge, _scale(source.mesh, reflector))
        source = replace(source, mesh=finer)
    if isinstance(reflector.parts, int):
        source = _cut(source, reflector.parts)
    mesh = _placed(source.mesh, reflector, pose)
    materials = source.part_materials
    if materials:
        number = scene.add_object(
            REFLECTOR_NAME, mesh, materials[0], source.part_names, part_materials=materials
        )
    else:
        material = _material(config.material or MaterialConfig(), scene)
        number = scene.add_object(REFLECTOR_NAME, mesh, material, source.part_names)
    return number, source.notes


def _source(config: SceneConfig, scene: _core.Scene) -> _Source:
    reflector = config.reflector
    if reflector.mesh is None:
        mesh = _core.make_teapot(reflector.subdivisions, reflector.height)
        if reflector.parts != "joined":
            return _Source(mesh, list(_core.teapot_part_names()), [], [])
        return _Source(_without_parts(mesh), [reflector.object or "object"], [], [])
    if config.material is not None:
        return _Source(_load_mesh(reflector.mesh), ["object"], [], [])
    loaded = _load_objects(reflector.mesh)
    notes = [f"{reflector.mesh}: {w.message} ({w.count} times)" for w in loaded.warnings]
    mesh, names, materials = loaded.scene.join_objects(MOST_OBJECTS)
    if not any(loaded.scene.material(index).specular for index in materials):
        notes.append(
            f"{reflector.mesh}: no material of it shines, so it is a mirror; [material] says of what"
        )
        materials = []
    if reflector.parts == "joined":
        if len(set(materials)) > 1:
            raise InputError(
                f"{reflector.mesh}: its objects are of {len(set(materials))} materials, which "
                "reflector.parts = 'joined' cannot keep apart; expected 'split', or a section [material]"
            )
        mesh, names, materials = _without_parts(mesh), ["object"], materials[:1]
    first = scene.add_materials(loaded.scene) if materials else 0
    return _Source(mesh, names, [first + index for index in materials], notes)


# What stands on the ground is moved there, from wherever its file has it.
def _load_mesh(path: str) -> _core.TriangleMesh:
    mesh, _ = loaded_nearby(
        lambda origin: _core.load_mesh(path, origin=origin), lambda mesh: np.asarray(mesh.positions)
    )
    return mesh


def _load_objects(path: str) -> _core.LoadedScene:
    def positions(loaded: _core.LoadedScene) -> FloatArray:
        meshes = (loaded.scene.object_mesh(i) for i in range(len(loaded.scene.object_names)))
        return np.concatenate([np.asarray(mesh.positions) for mesh in meshes])

    loaded, _ = loaded_nearby(lambda origin: _core.load_scene(path, origin=origin), positions)
    return loaded


def _cut(source: _Source, count: int) -> _Source:
    """Return a reflector in a number of parts that keep materials apart."""
    mesh, materials = source.mesh, source.part_materials
    kind = np.asarray(materials)[mesh.parts] if materials and len(mesh.parts) else None
    parts = split_surface(mesh.positions, mesh.triangles, kind).parts(count)
    found = int(parts.max()) + 1
    if kind is not None:
        materials = [int(kind[parts == number][0]) for number in range(found)]
    names = [f"part-{number + 1}" for number in range(found)]
    return _Source(_with_parts(mesh, parts), names, materials, source.notes)


def _without_parts(mesh: _core.TriangleMesh) -> _core.TriangleMesh:
    return _with_parts(mesh, None)


def _with_parts(mesh: _core.TriangleMesh, parts: NDArray[np.uint16] | None) -> _core.TriangleMesh:
    return _core.TriangleMesh(
        mesh.positions,
        mesh.triangles,
        mesh.normals if len(mesh.normals) else None,
        mesh.uvs if len(mesh.uvs) else None,
        parts,
        mesh.colors if len(mesh.colors) else None,
        mesh.tangents if len(mesh.tangents) else None,
    )


def _placed(mesh: _core.TriangleMesh, reflector: Reflector, pose: Pose) -> _core.TriangleMesh:
    rotation = rotation_matrix(reflector.rotation)
    positions = np.asarray(mesh.positions).astype(np.float64) @ rotation.T
    if reflector.mesh is not None:
        low, high = positions.min(axis=0), positions.max(axis=0)
        base = np.array([0.5 * (low[0] + high[0]), low[1], 0.5 * (low[2] + high[2])])
        positions = (positions - base) * _scale(mesh, reflector)
    # Rotation and uniform scale leave normals and tangents unit vectors.
    turn = (pose.rotation @ rotation).T
    normals = np.asarray(mesh.normals).astype(np.float64) @ turn
    tangents = np.array(mesh.tangents)
    tangents[:, :3] = tangents[:, :3].astype(np.float64) @ turn
    return _core.TriangleMesh(
        pose.moved(positions).astype(np.float32),
        mesh.triangles,
        normals.astype(np.float32) if len(normals) else None,
        mesh.uvs if len(mesh.uvs) else None,
        mesh.parts if len(mesh.parts) else None,
        mesh.colors if len(mesh.colors) else None,
        tangents if len(tangents) else None,
    )


def _scale(mesh: _core.TriangleMesh, reflector: Reflector) -> float:
    """Metres of a unit of the mesh."""
    if reflector.mesh is None:
        return 1.0
    if reflector.scale is not None:
        return reflector.scale
    positions = np.asarray(mesh.positions).astype(np.float64) @ rotation_matrix(reflector.rotation).T
    size = positions.max(axis=0) - positions.min(axis=0)
    if size[1] > 1e-6 * np.max(size):
        return float(reflector.height / size[1])
    raise InputError(
        f"{reflector.mesh}: the mesh is flat, so it cannot be scaled to reflector.height; "
        "turn it with reflector.rotation or give reflector.scale"
    )


def _material(config: MaterialConfig, scene: _core.Scene) -> int:
    eta, k = config.eta or config.ior or (1.5, 1.5, 1.5), config.k or (0.0, 0.0, 0.0)
    if config.metal is not None:
        fit = _core.fit_metal(config.metal, ILLUMINANT)
        eta, k = fit.eta, fit.k
    model = config.fresnel
    fresnel = _core.Fresnel(model=model, r0=config.r0 or (0.9, 0.9, 0.9), eta=eta, k=k)
    texture = _core.TextureReference()
    if config.texture is not None:
        texture.texture = scene.add_texture(_load_rgb(config.texture))
    material = _core.Material(
        name=REFLECTOR_NAME,
        specular=True,
        fresnel=fresnel,
        albedo=config.albedo,
        albedo_texture=texture,
        layers=config.layers,
        lobe=config.lobe,
        roughness=config.roughness or 0.1,
        exponent=config.exponent or 100.0,
    )
    return scene.add_material(material)


def named_object(config: SceneConfig, scene: _core.Scene) -> int:
    """Return the number of `reflector.scene_object`; raises InputError if the scene has none."""
    name, names = config.reflector.scene_object, scene.object_names
    if name not in names:
        known = ", ".join(names[:20]) + (", …" if len(names) > 20 else "")
        raise InputError(f"{config.surroundings.scene}: has no object {name!r}; its objects: {known}")
    return names.index(name)


def _scene_reflector(config: SceneConfig, scene: _core.Scene) -> int:
    reflector = named_object(config, scene)
    if config.material is not None:
        # Other objects may share the file's material.
        scene.set_object_material(reflector, _material(config.material, scene))
    elif not any(scene.material(index).specular for index in scene.object_part_materials(reflector)):
        raise InputError(
            f"{config.surroundings.scene}: the material of {config.reflector.scene_object!r} is matte; "
            "a section [material] makes it shine"
        )
    return reflector


def _load_rgb(path: str) -> FloatArray:
    pixels, channels = _core.load_image(path)
    if pixels.shape[2] == 1:
        return np.repeat(pixels, 3, axis=2)
    if pixels.shape[2] == 2 or list(channels[:3]) not in (["R", "G", "B"], ["r", "g", "b"]):
        raise InputError(f"{path}: channels {', '.join(channels)}; expected R, G, B")
    return np.ascontiguousarray(pixels[..., :3])

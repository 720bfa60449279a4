"""One object made of all objects of a scene, and materials taken over from another scene."""

from __future__ import annotations

import numpy as np
import pytest

from mirrorbake import _core

TRIANGLE = np.array([[0, 1, 2]], np.uint32)
FLAT = np.array([[0, 0, 0], [1, 0, 0], [0, 0, -1]], np.float32)  # faces +Y


def mesh(offset: float = 0.0, **arrays: np.ndarray) -> _core.TriangleMesh:
    return _core.TriangleMesh(FLAT + np.array([offset, 0, 0], np.float32), TRIANGLE, **arrays)


def two_materials() -> tuple[_core.Scene, int, int]:
    scene = _core.Scene()
    red = scene.add_material(_core.Material(name="red", albedo=(0.8, 0.1, 0.1)))
    blue = scene.add_material(_core.Material(name="blue", albedo=(0.1, 0.1, 0.8)))
    return scene, red, blue


def test_every_object_becomes_a_part_of_its_name_and_material() -> None:
    scene, red, blue = two_materials()
    scene.add_object("left", mesh(), red)
    scene.add_object("right", mesh(2.0), blue)
    joined, names, materials = scene.join_objects(8)
    assert names == ["left", "right"]
    assert materials == [red, blue]
    np.testing.assert_array_equal(
        joined.positions, np.concatenate([FLAT, FLAT + np.array([2, 0, 0], np.float32)])
    )
    np.testing.assert_array_equal(joined.triangles, [[0, 1, 2], [3, 4, 5]])
    np.testing.assert_array_equal(joined.parts, [0, 1])


def test_parts_of_an_object_keep_their_names_behind_its_own() -> None:
    scene, red, blue = two_materials()
    twice = _core.TriangleMesh(
        np.concatenate([FLAT, FLAT + np.array([0, 1, 0], np.float32)]),
        np.array([[0, 1, 2], [3, 4, 5]], np.uint32),
        parts=np.array([1, 0], np.uint16),
    )
    scene.add_object("single", mesh(5.0), blue)
    scene.add_object("pair", twice, red, ["low", "high"], part_materials=[blue, red])
    joined, names, materials = scene.join_objects(8)
    assert names == ["single", "pair/low", "pair/high"]
    assert materials == [blue, blue, red]
    np.testing.assert_array_equal(joined.parts, [0, 2, 1])


def test_more_objects_than_parts_are_wanted_are_parted_by_material() -> None:
    scene, red, blue = two_materials()
    for number, material in enumerate([blue, red, blue, red, blue]):
        scene.add_object(f"object {number}", mesh(2.0 * number), material)
    joined, names, materials = scene.join_objects(4)
    assert names == ["blue", "red"]
    assert materials == [blue, red]
    np.testing.assert_array_equal(joined.parts, [0, 1, 0, 1, 0])


def test_what_only_some_meshes_have_is_completed() -> None:
    scene, red, _ = two_materials()
    up = np.tile(np.array([0.6, 0.8, 0.0], np.float32), (3, 1))
    full = mesh(
        normals=up,
        uvs=np.full((3, 2), 0.5, np.float32),
        colors=np.full((3, 3), 0.25, np.float32),
        tangents=np.tile(np.array([0.8, -0.6, 0.0, -1.0], np.float32), (3, 1)),
    )
    scene.add_object("bare", mesh(2.0), red)
    scene.add_object("full", full, red)
    joined, _, _ = scene.join_objects(8)
    # Of the mesh without normals those of its facets, (0, 0), white and no tangents.
    np.testing.assert_allclose(joined.normals, np.concatenate([np.tile([0, 1, 0], (3, 1)), up]))
    np.testing.assert_array_equal(joined.uvs, [[0, 0]] * 3 + [[0.5, 0.5]] * 3)
    np.testing.assert_array_equal(joined.colors, [[1, 1, 1]] * 3 + [[0.25] * 3] * 3)
    np.testing.assert_array_equal(
        joined.tangents, [[0] * 4] * 3 + [[np.float32(0.8), np.float32(-0.6), 0, -1]] * 3
    )


def test_a_scene_without_objects_is_an_error() -> None:
    with pytest.raises(_core.InvalidArgument, match="scene is no objects, expected at least one"):
        _core.Scene().join_objects(8)


def test_materials_of_another_scene_bring_their_textures() -> None:
    scene, *_ = two_materials()
    scene.add_texture(np.full((2, 2, 3), 0.1, np.float32))
    other = _core.Scene()
    green = other.add_texture(np.full((2, 2, 3), 0.9, np.float32))
    reference = _core.TextureReference(texture=green)
    other.add_material(
        _core.Material(
            name="green", albedo_texture=reference, emission_texture=reference, normal_texture=reference
        )
    )
    first = scene.add_materials(other)
    assert first == 2
    material = scene.material(first)
    assert material.name == "green"
    for role in ("albedo", "emission", "normal"):
        reference = getattr(material, f"{role}_texture")
        assert reference.texture == 1
        np.testing.assert_allclose(scene.texture_pixels(reference.texture), 0.9)
    # What has no texture still has none.
    assert material.specular_texture.texture == -1

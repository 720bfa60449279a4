"""A reflector from its own file: its materials, its objects as parts, and the bake of files alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.errors import InputError
from mirrorbake.scene.build import build_scene
from mirrorbake.scene.inputs import hash_inputs
from mirrorbake.scene.load import DRAFT, load_config, parse_config

from .gltf_scene import pair_of_primitives

if TYPE_CHECKING:
    from pathlib import Path

TWO_OBJECTS = """mtllib two.mtl
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
o front
usemtl gold
f 1 2 3
o side
usemtl cloth
f 1 3 4
"""
MATERIALS = "newmtl gold\nKd 0 0 0\nKs 0.9 0.7 0.2\nillum 3\nnewmtl cloth\nKd 0.2 0.4 0.6\nillum 1\n"


def two_objects(folder: Path, materials: str = MATERIALS) -> str:
    (folder / "two.mtl").write_text(materials)
    path = folder / "two.obj"
    path.write_text(TWO_OBJECTS)
    return str(path)


def test_a_mesh_keeps_the_objects_and_materials_of_its_file(tmp_path: Path) -> None:
    built = build_scene(parse_config({"reflector": {"mesh": two_objects(tmp_path)}}, "test"))
    assert built.part_names == ["front", "side"]
    gold, cloth = (
        built.scene.material(index) for index in built.scene.object_part_materials(built.reflector)
    )
    assert gold.specular
    assert gold.fresnel.r0 == pytest.approx((0.9, 0.7, 0.2))
    assert not cloth.specular
    assert cloth.albedo == pytest.approx((0.2, 0.4, 0.6))


def test_a_section_material_is_of_the_whole_mesh(tmp_path: Path) -> None:
    data = {"reflector": {"mesh": two_objects(tmp_path)}, "material": {"r0": 0.5}}
    built = build_scene(parse_config(data, "test"))
    assert built.part_names == ["object"]
    assert built.scene.material(built.scene.object_material(built.reflector)).fresnel.r0 == (0.5, 0.5, 0.5)


def test_a_file_in_which_nothing_shines_is_a_mirror_and_says_so(tmp_path: Path) -> None:
    path = two_objects(tmp_path, MATERIALS.replace("illum 3", "illum 1"))
    built = build_scene(parse_config({"reflector": {"mesh": path}}, "test"))
    assert built.scene.material(built.scene.object_material(built.reflector)).specular
    assert any("no material of it shines" in note for note in built.notes)


def test_joined_parts_of_several_materials_are_refused(tmp_path: Path) -> None:
    data = {"reflector": {"mesh": two_objects(tmp_path), "parts": "joined"}}
    with pytest.raises(InputError, match=r"2 materials.*expected 'split'"):
        build_scene(parse_config(data, "test"))


def test_material_libraries_are_inputs_of_a_mesh_that_is_of_its_materials(tmp_path: Path) -> None:
    path = two_objects(tmp_path)
    config = parse_config({"reflector": {"mesh": path}}, "test")
    assert list(hash_inputs(config)["reflector.mesh"]["files"]) == ["two.mtl"]
    other = parse_config({"reflector": {"mesh": path}, "material": {}}, "test")
    assert not hash_inputs(other)["reflector.mesh"]["files"]


def test_every_primitive_of_a_mesh_keeps_its_material_and_tangents_turn_with_it(tmp_path: Path) -> None:
    # By 90 degrees about the vertical: what points along +X points along −Z.
    reflector = {"mesh": pair_of_primitives(tmp_path), "rotation": [0, 90, 0]}
    built = build_scene(parse_config({"reflector": reflector}, "test"))
    assert built.part_names == ["box/gold", "box/cloth"]
    gold, cloth = (
        built.scene.material(index) for index in built.scene.object_part_materials(built.reflector)
    )
    assert gold.specular
    assert gold.fresnel.r0 == pytest.approx((0.9, 0.7, 0.2))
    assert gold.normal_texture.texture == -1
    assert cloth.albedo == pytest.approx((0.2, 0.4, 0.6))
    assert cloth.normal_texture.texture >= 0
    mesh = built.scene.object_mesh(built.reflector)
    np.testing.assert_array_equal(mesh.parts, [0, 0, 1, 1])
    # Only the cloth has a use for tangents.
    np.testing.assert_allclose(mesh.tangents[:4], 0.0)
    np.testing.assert_allclose(mesh.tangents[4:], [[0.0, 0.8, -0.6, -1.0]] * 4, atol=1e-6)


def test_every_part_is_traced_with_its_own_material() -> None:
    # Two squares side by side before a white sky: what they show is their reflectance, in closed form.
    scene = _core.Scene()
    mirror = scene.add_material(
        _core.Material(
            specular=True,
            albedo=(0.0, 0.0, 0.0),
            fresnel=_core.Fresnel(model="constant", r0=(0.25, 0.5, 0.75)),
        )
    )
    glow = scene.add_material(_core.Material(albedo=(0.0, 0.0, 0.0), emission=(2.0, 3.0, 4.0)))
    positions = np.array(
        [[-1, 0, 0], [0, 0, 0], [0, 1, 0], [-1, 1, 0], [0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32
    )
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], np.uint32)
    mesh = _core.TriangleMesh(positions, triangles, parts=np.array([0, 0, 1, 1], np.uint16))
    number = scene.add_object("pair", mesh, mirror, ["mirror", "glow"], part_materials=[mirror, glow])
    scene.set_environment(np.ones((2, 4, 3), np.float32))
    camera = _core.Camera(eye=(0.0, 0.5, 3.0), target=(0.0, 0.5, 0.0), width=16, height=16)
    trace = _core.Tracer(scene).trace_layers(camera, number, _core.TraceOptions(samples_per_pixel=4))
    samples, beauty = trace.samples, np.asarray(trace.sample_beauty)
    parts = np.asarray(samples.part)
    assert set(parts) == {0, 1}
    np.testing.assert_allclose(beauty[parts == 0], [[0.25, 0.5, 0.75]] * int((parts == 0).sum()), rtol=1e-6)
    np.testing.assert_allclose(beauty[parts == 1], [[2.0, 3.0, 4.0]] * int((parts == 1).sum()), rtol=1e-6)
    assert not np.asarray(samples.fresnel)[parts == 1].any()
    np.testing.assert_array_equal(np.asarray(samples.emission)[parts == 1][0], [2.0, 3.0, 4.0])


def test_a_part_with_a_material_that_is_not_there_is_refused() -> None:
    scene = _core.Scene()
    material = scene.add_material(_core.Material(specular=True))
    with pytest.raises(_core.InvalidArgument, match="part_materials is 7"):
        scene.add_object(
            "ball", _core.make_sphere((0.0, 0.0, 0.0), 1.0), material, ["all"], part_materials=[7]
        )


def test_a_draft_fills_only_what_the_scene_leaves_open(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text("[views]\ncount = 3\n")
    config = load_config(scene, draft=True)
    assert config.views.count == 3
    assert config.maps.size == DRAFT["maps"]["size"]
    assert load_config(scene).maps.size is None

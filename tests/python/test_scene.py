"""Scenes from Python: what goes in comes out, and what is wrong is named."""

import copy
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mirrorbake import _core

TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0]], dtype=np.float32)
INDICES = np.array([[0, 1, 2]], dtype=np.uint32)


def test_mesh_returns_what_it_was_given() -> None:
    normals = np.tile(np.array([0, 0, 1], dtype=np.float32), (3, 1))
    uvs = np.array([[0, 0], [1, 0], [0, 1]], dtype=np.float32)
    mesh = _core.TriangleMesh(TRIANGLE, INDICES, normals, uvs, np.array([3], dtype=np.uint16))
    np.testing.assert_array_equal(mesh.positions, TRIANGLE)
    np.testing.assert_array_equal(mesh.triangles, INDICES)
    np.testing.assert_array_equal(mesh.normals, normals)
    np.testing.assert_array_equal(mesh.uvs, uvs)
    np.testing.assert_array_equal(mesh.parts, [3])
    assert repr(mesh) == "TriangleMesh(3 vertices, 1 triangles)"


def test_mesh_converts_other_types_and_leaves_out_what_is_not_given() -> None:
    mesh = _core.TriangleMesh(TRIANGLE.astype(np.float64), INDICES.astype(np.int64))
    np.testing.assert_array_equal(mesh.positions, TRIANGLE)
    assert mesh.normals.shape == (0, 3)
    assert mesh.uvs.shape == (0, 2)
    assert mesh.parts.shape == (0,)


def test_views_are_read_only_and_outlive_the_mesh() -> None:
    mesh = _core.TriangleMesh(TRIANGLE, INDICES)
    positions = mesh.positions
    with pytest.raises(ValueError, match="read-only"):
        positions[0, 0] = 1.0
    del mesh
    np.testing.assert_array_equal(positions, TRIANGLE)


def test_bad_meshes_are_rejected_by_field() -> None:
    bad = TRIANGLE.copy()
    bad[1, 2] = np.nan
    with pytest.raises(_core.InvalidArgument, match=r"mesh vertex 1 is .*nan"):
        _core.TriangleMesh(bad, INDICES)
    with pytest.raises(_core.InvalidArgument, match="triangle 0 vertex index is 3"):
        _core.TriangleMesh(TRIANGLE, np.array([[0, 1, 3]]))
    with pytest.raises(_core.InvalidArgument, match="area is 0"):
        _core.TriangleMesh(TRIANGLE, np.array([[0, 1, 1]]))
    with pytest.raises(_core.InvalidArgument, match="at least one triangle"):
        _core.TriangleMesh(np.zeros((0, 3), dtype=np.float32), np.zeros((0, 3), dtype=np.uint32))
    with pytest.raises(TypeError):
        _core.TriangleMesh(np.zeros((3, 2), dtype=np.float32), INDICES)


def test_scene_holds_what_is_added() -> None:
    scene = _core.Scene()
    texture = scene.add_texture(np.full((2, 4, 3), 0.25, dtype=np.float32), wrap_v="clamp")
    fresnel = _core.Fresnel("schlick", r0=(0.9, 0.8, 0.7))
    material = scene.add_material(
        _core.Material(
            name="gold",
            albedo=(0.1, 0.2, 0.3),
            albedo_texture=_core.TextureReference(texture),
            specular=True,
            fresnel=fresnel,
            specular_texture=_core.TextureReference(texture, scale=(2, 3), rotation=0.5),
            lobe="ggx",
            roughness=0.25,
            roughness_texture=_core.TextureReference(texture),
            exponent=20.0,
            layers="coated",
            emission=(0, 0, 1),
            emission_texture=_core.TextureReference(texture, offset=(0.25, 0.5)),
        )
    )
    mesh = _core.TriangleMesh(TRIANGLE, np.array([[0, 1, 2], [2, 1, 0]]), parts=np.array([0, 1]))
    assert scene.add_object("sail", mesh, material, ["front", "back"]) == 0
    assert scene.add_rectangle_light((0, 1, 0), (1, 0, 0), (0, 0, 1), (3, 3, 3)) == 0
    assert scene.add_point_light((0, 2, 0), (1, 1, 1)) == 0
    assert scene.add_sphere_light((0, 2, 0), 0.1, (1, 1, 1)) == 0
    assert scene.add_directional_light((0, -1, 0), (1, 1, 1)) == 0
    assert scene.add_spot_light((0, 2, 0), (0, -1, 0), (1, 1, 1), 10, outer_degrees=20) == 0
    scene.set_environment(np.ones((4, 8, 3), dtype=np.float32), scale=2.0, rotation_degrees=30.0)
    scene.validate()

    assert scene.object_names == ["sail"]
    assert scene.material_names == ["gold"]
    assert scene.object_material(0) == material
    assert scene.object_part_names(0) == ["front", "back"]
    assert scene.bounds(0) == ((0, 0, 0), (1, 2, 0))
    np.testing.assert_array_equal(scene.object_mesh(0).parts, [0, 1])
    back = scene.material(0)
    assert back.fresnel.model == "schlick"
    np.testing.assert_allclose(back.fresnel.r0, (0.9, 0.8, 0.7), rtol=1e-7)
    assert back.layers == "coated"
    assert back.albedo_texture == _core.TextureReference(texture)
    assert back.albedo_texture != _core.TextureReference(texture, rotation=1.0)
    assert back.albedo_texture != texture
    assert (back.specular_texture.scale, back.specular_texture.rotation) == ((2, 3), 0.5)
    assert (back.lobe, back.roughness, back.exponent) == ("ggx", 0.25, 20.0)
    assert back.roughness_texture.texture == texture
    assert back.emission_texture.offset == (0.25, 0.5)
    assert repr(back.roughness_texture).startswith("TextureReference(texture=0, offset=(")
    back.fresnel = _core.Fresnel("conductor", eta=(0.2, 0.9, 1.1), k=(3.9, 2.4, 2.2))
    scene.set_material(0, back)
    assert scene.material(0).fresnel.model == "conductor"


def test_scene_errors_name_the_culprit() -> None:
    scene = _core.Scene()
    with pytest.raises(_core.InvalidArgument, match="material is 0"):
        scene.add_object("sail", _core.TriangleMesh(TRIANGLE, INDICES), 0)
    scene.add_material(_core.Material(name="too white", albedo=(1.5, 0, 0)))
    with pytest.raises(_core.InvalidArgument, match="material 0 'too white' albedo"):
        scene.validate()
    with pytest.raises(_core.InvalidArgument, match="object is 7"):
        scene.bounds(7)
    with pytest.raises(TypeError):
        scene.add_texture(np.zeros((2, 2, 4), dtype=np.float32))


def test_objects_are_seen_by_a_set_of_rays() -> None:
    scene = _core.Scene()
    matte = scene.add_material(_core.Material())
    mesh = _core.TriangleMesh(TRIANGLE, INDICES)
    visibility = _core.Visibility.reflection | _core.Visibility.shadow
    scene.add_object("sail", mesh, matte)
    scene.add_object("ghost", mesh, matte, visibility=visibility)
    assert scene.object_visibility(0) == _core.Visibility.all
    assert scene.object_visibility(1) == visibility
    scene.set_object_visibility(1, _core.Visibility.none)
    assert _core.Visibility.camera not in scene.object_visibility(1)
    with pytest.raises(_core.InvalidArgument, match="object is 2"):
        scene.set_object_visibility(2, visibility)


def test_lights_that_cannot_be_are_named() -> None:
    scene = _core.Scene()
    scene.add_spot_light((0, 2, 0), (0, -1, 0), (1, 1, 1), inner_degrees=50)
    with pytest.raises(_core.InvalidArgument, match="spot light 0 inner_degrees is 50"):
        scene.validate()


def test_load_mesh_reads_a_file_and_names_what_is_wrong_with_it(tmp_path: Path) -> None:
    path = tmp_path / "triangle.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n")
    mesh = _core.load_mesh(str(path))
    np.testing.assert_array_equal(mesh.positions, TRIANGLE)
    np.testing.assert_array_equal(mesh.normals, np.tile([0, 0, 1], (3, 1)))
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n")
    with pytest.raises(_core.FileError, match=r"triangle\.obj: line 3 has 'nan'"):
        _core.load_mesh(str(path))


def test_teapot_in_its_room_is_a_valid_scene() -> None:
    scene = _core.make_room()
    chrome = scene.add_material(_core.Material(name="chrome", specular=True))
    teapot = _core.make_teapot(subdivisions=25, height=0.15)
    assert teapot.triangles.shape == (40_000, 3)
    assert np.isfinite(teapot.normals).all()
    reflector = scene.add_object("teapot", teapot, chrome, _core.teapot_part_names())
    scene.validate()
    assert scene.object_part_names(reflector) == ["body", "lid"]
    assert _core.bounds(teapot)[1][1] == pytest.approx(0.15)


@pytest.mark.parametrize(
    ("make", "low", "high"),
    [
        (lambda: _core.make_box((0, 0, 0), (1, 2, 3)), [0, 0, 0], [1, 2, 3]),
        (lambda: _core.make_sphere((1, 1, 1), 0.5, segments=8), [0.5, 0.5, 0.5], [1.5, 1.5, 1.5]),
        (lambda: _core.make_cylinder((0, 0, 0), 1.0, 2.0, segments=8), [-1, 0, -1], [1, 2, 1]),
        (lambda: _core.make_cone((0, 0, 0), 1.0, 2.0, segments=8), [-1, 0, -1], [1, 2, 1]),
        (
            lambda: _core.make_torus((0, 0, 0), 1.0, 0.25, segments=16),
            [-1.25, -0.25, -1.25],
            [1.25, 0.25, 1.25],
        ),
        (lambda: _core.make_rectangle((0, 0, 0), (1, 0, 0), (0, 1, 0)), [0, 0, 0], [1, 1, 0]),
    ],
)
def test_shapes_have_their_extent(
    make: Callable[[], _core.TriangleMesh], low: list[float], high: list[float]
) -> None:
    mesh = make()
    assert np.allclose(_core.bounds(mesh), (low, high), atol=1e-6)
    assert mesh.normals.shape == mesh.positions.shape


def test_tangents_are_unit_vectors_with_a_sign_or_zeros() -> None:
    for tangent, is_right in (
        ((1, 0, 0, 1), True),
        ((0, 0, 0, 0), True),
        ((1, 0, 0, 0.5), False),
        ((0, 2, 0, 1), False),
    ):
        tangents = np.tile(np.array(tangent, np.float32), (3, 1))
        if is_right:
            mesh = _core.TriangleMesh(TRIANGLE, INDICES, tangents=tangents)
            np.testing.assert_array_equal(mesh.tangents, tangents)
            continue
        with pytest.raises(_core.InvalidArgument, match=r"tangent 0 is .* expected a unit vector"):
            _core.TriangleMesh(TRIANGLE, INDICES, tangents=tangents)
    with pytest.raises(_core.InvalidArgument, match="tangent count is 2"):
        _core.TriangleMesh(TRIANGLE, INDICES, tangents=np.zeros((2, 4), np.float32))


def test_meshes_materials_and_options_pickle_and_copy() -> None:
    sphere = _core.make_sphere((0, 1, 0), 0.5, 8)
    tangents = np.tile(np.array([0, 0.6, 0.8, -1], np.float32), (len(sphere.positions), 1))
    colors = np.full((len(sphere.positions), 3), 0.25, np.float32)
    mesh = _core.TriangleMesh(
        sphere.positions,
        sphere.triangles,
        sphere.normals,
        sphere.uvs,
        None,
        colors,
        tangents,
    )
    for again in (pickle.loads(pickle.dumps(mesh)), copy.copy(mesh), copy.deepcopy(mesh)):
        for name in ("positions", "normals", "uvs", "triangles", "parts", "colors", "tangents"):
            np.testing.assert_array_equal(getattr(again, name), getattr(mesh, name))
    metal = _core.Fresnel("conductor", eta=(0.2, 0.9, 1.4), k=(3.9, 2.5, 1.6))
    material = _core.Material(name="gold", specular=True, fresnel=metal, lobe="ggx", opacity_cutoff=0.25)
    options = [
        _core.TraceOptions(window=(1, 2, 3, 4)),
        _core.TracerOptions(indirect="path"),
        _core.SolveOptions(),
    ]
    for thing in [material, *options]:
        assert repr(pickle.loads(pickle.dumps(thing))) == repr(copy.deepcopy(thing)) == repr(thing)
    camera = _core.Camera((0, 1, 2), (0, 0, 0.1), vertical_fov_degrees=30, width=8, height=4)
    assert pickle.loads(pickle.dumps(camera)) == copy.copy(camera) == camera
    assert "lobe='ggx'" in repr(material)
    assert "model='conductor'" in repr(material)


def test_an_unknown_name_is_an_error_that_lists_the_known_ones() -> None:
    with pytest.raises(_core.InvalidArgument, match="indirect is photons, expected none, cached or path"):
        _core.TracerOptions(indirect="photons")  # type: ignore[arg-type]


def test_paths_may_be_of_pathlib(tmp_path: Path) -> None:
    path = tmp_path / "ü.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", encoding="utf-8")
    assert len(_core.load_mesh(path).triangles) == len(_core.load_mesh(str(path)).triangles) == 1
    with pytest.raises(TypeError):
        _core.load_mesh(7)  # type: ignore[arg-type]


def test_what_is_printed_says_what_it_is() -> None:
    scene = _core.Scene()
    material = scene.add_material(_core.Material())
    scene.add_object("ball", _core.make_sphere((0, 0, 0), 1.0, 8), material)
    scene.add_point_light((0, 3, 0), (1, 1, 1))
    assert repr(scene) == "Scene(objects=1, materials=1, lights=1, environment=False)"
    assert repr(_core.TexelTopology.cube(8)) == "TexelTopology(faces=6, width=8, height=8)"
    assert repr(_core.run_time_model("Web1")) == "RunTimeModel('Web1', lookups=1)"

"""From a scene file to meshes, cameras and surroundings."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.errors import InputError
from mirrorbake.scene.build import build_scene
from mirrorbake.scene.cameras import Cameras
from mirrorbake.scene.inputs import hash_inputs
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.pose import rotation_matrix

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

# A 1 x 2 x 4 cuboid away from the origin, no normals, faces counter-clockwise from outside.
CUBOID = """
v 5 5 5
v 6 5 5
v 6 7 5
v 5 7 5
v 5 5 9
v 6 5 9
v 6 7 9
v 5 7 9
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 3 4 8 7
f 2 3 7 6
f 4 1 5 8
"""


def build(**sections: Any) -> Any:
    defaults = {"reflector": {"object": "teapot", "subdivisions": 3}, "views": {"count": 2}}
    return build_scene(parse_config({**defaults, **sections}, "scene"))


@pytest.fixture
def cuboid(tmp_path: Path) -> str:
    path = tmp_path / "cuboid.obj"
    path.write_text(CUBOID)
    return str(path)


def test_rotations_turn_counter_clockwise_about_each_axis_in_turn() -> None:
    x, y, z = np.eye(3)
    np.testing.assert_allclose(rotation_matrix((90, 0, 0)) @ y, z, atol=1e-15)
    np.testing.assert_allclose(rotation_matrix((0, 90, 0)) @ z, x, atol=1e-15)
    np.testing.assert_allclose(rotation_matrix((0, 0, 90)) @ x, y, atol=1e-15)
    # About x first: y goes to z, then about y to x.
    np.testing.assert_allclose(rotation_matrix((90, 90, 0)) @ y, x, atol=1e-15)
    # What the reference page promises for Z-up meshes.
    np.testing.assert_allclose(rotation_matrix((-90, 0, 0)) @ z, y, atol=1e-15)


def test_a_closed_mesh_winds_once_about_inner_points_and_not_about_outer_ones() -> None:
    sphere = _core.make_sphere((1.0, 2.0, 3.0), 0.5, 32)
    random = np.random.default_rng(0)
    for direction in random.normal(size=(20, 3)):
        unit = direction / np.linalg.norm(direction)
        inner, outer = np.array([1, 2, 3]) + 0.48 * unit, np.array([1, 2, 3]) + 0.51 * unit
        # The mesh is float32 and its poles are slivers: 1e-4 is far from the threshold of 1/2.
        assert _core.winding_number(sphere, inner) == pytest.approx(1.0, abs=1e-4)
        assert _core.winding_number(sphere, outer) == pytest.approx(0.0, abs=1e-4)


def test_the_eye_walks_an_arc_about_the_vertical() -> None:
    arc = Cameras("arc", centre=(1, 2, 3), radius=2, height=0.5, start=0, degrees=90, fov=30, size=(8, 4))
    np.testing.assert_allclose(arc.eye((0,)), (1, 2.5, 5))
    np.testing.assert_allclose(arc.eye((1,)), (3, 2.5, 3))
    np.testing.assert_allclose(arc.eye((0.5,)), (1 + math.sqrt(2), 2.5, 3 + math.sqrt(2)))
    camera = arc.camera((1,))
    np.testing.assert_allclose(camera.eye, (3, 2.5, 3))
    np.testing.assert_allclose(camera.target, (1, 2, 3))
    assert (camera.width, camera.height, camera.vertical_fov_degrees) == (8, 4, 30)


def test_by_default_the_object_fills_the_frame_and_stays_inside() -> None:
    built = build(views={"count": 2, "fov": 40, "size": [64, 64]})
    edge = math.tan(math.radians(20))
    fills = []
    for t in (0.0, 0.4, 1.0):
        eye, target = np.array(built.cameras.eye((t,))), np.array(built.cameras.centre)
        forward = (target - eye) / np.linalg.norm(target - eye)
        right = np.cross(forward, (0, 1, 0))
        right /= np.linalg.norm(right)
        seen = built.positions - eye
        across, along = (seen @ axis / (seen @ forward) for axis in (right, np.cross(right, forward)))
        fills.append(float(np.max(np.abs([across, along]))) / edge)
    # The teapot is widest from the side, where the arc starts, and narrow from the front, where it ends.
    assert 0.6 < fills[0] < 1.0
    assert fills[0] > fills[1] > fills[2] > 0.3


def test_a_mesh_is_scaled_to_its_height_and_set_on_the_ground(cuboid: str) -> None:
    built = build(reflector={"mesh": cuboid, "height": 0.5, "position": [1, 2, 3]})
    # A quarter of the file's size: 0.25 x 0.5 x 1, the base's centre at the position.
    assert built.origin == (1, 2, 3)
    np.testing.assert_allclose(built.positions.min(axis=0), (-0.125, 0.0, -0.5), atol=1e-6)
    np.testing.assert_allclose(built.positions.max(axis=0), (0.125, 0.5, 0.5), atol=1e-6)
    assert built.part_names == ["object"]


def test_a_mesh_can_be_turned_and_scaled(cuboid: str) -> None:
    built = build(reflector={"mesh": cuboid, "scale": 0.1, "rotation": [-90, 0, 0]})
    np.testing.assert_allclose(built.positions.min(axis=0), (-0.05, 0.0, -0.1), atol=1e-6)
    np.testing.assert_allclose(built.positions.max(axis=0), (0.05, 0.4, 0.1), atol=1e-6)
    assert _core.encloses(built.scene.object_mesh(built.reflector), (0, 0.2, 0))


def test_a_flat_mesh_has_no_height_to_scale_to(tmp_path: Path) -> None:
    path = tmp_path / "flat.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 3 2\n")
    with pytest.raises(InputError, match=r"flat\.obj: the mesh is flat"):
        build(reflector={"mesh": str(path)})
    built = build(reflector={"mesh": str(path), "scale": 0.1})
    assert len(built.triangles) == 1


def test_the_teapot_is_split_into_body_and_lid_or_joined() -> None:
    split, joined = build(), build(reflector={"object": "teapot", "subdivisions": 3, "parts": "joined"})
    assert split.part_names == ["body", "lid"]
    assert set(split.parts) == {0, 1}
    assert joined.part_names == ["teapot"]
    assert set(joined.parts) == {0}
    np.testing.assert_array_equal(split.positions, joined.positions)
    assert split.positions[:, 1].min() == pytest.approx(0.0, abs=1e-6)


def test_a_view_inside_the_object_is_rejected(cuboid: str) -> None:
    views = {"centre": [0, 0.5, 0], "radius": 0.1, "height": 0, "count": 3}
    with pytest.raises(InputError, match=r"the eye at t = 0, .* lies inside the reflector"):
        build(reflector={"mesh": cuboid, "scale": 1.0}, views=views)


def test_a_reflector_of_gold_has_the_colour_of_gold() -> None:
    built = build(material={"fresnel": "conductor", "metal": "gold"})
    fresnel = built.scene.material(built.scene.object_material(built.reflector)).fresnel
    # Normal incidence, exact: ((η − 1)² + k²) / ((η + 1)² + k²); gold reflects little blue.
    red, green, blue = (
        ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)
        for eta, k in zip(fresnel.eta, fresnel.k, strict=True)
    )
    assert red > 0.95
    assert 0.65 < green < 0.8
    assert 0.3 < blue < 0.45


def test_input_files_are_known_by_their_content(cuboid: str, tmp_path: Path) -> None:
    config = parse_config({"reflector": {"mesh": cuboid}}, "scene")
    inputs = hash_inputs(config)
    assert inputs.keys() == {"reflector.mesh"}
    assert inputs["reflector.mesh"]["path"] == cuboid
    missing = parse_config({"reflector": {"mesh": str(tmp_path / "nowhere.obj")}}, "scene")
    with pytest.raises(InputError, match=r"nowhere\.obj: cannot read"):
        hash_inputs(missing)


def test_a_panorama_of_one_channel_is_grey_and_of_others_is_rejected(tmp_path: Path, cuboid: str) -> None:
    grey, odd = tmp_path / "grey.exr", tmp_path / "odd.exr"
    _core.save_image(str(grey), np.full((4, 8, 1), 0.5, np.float32), ["Y"])
    _core.save_image(str(odd), np.full((4, 8, 3), 0.5, np.float32), ["X", "Y", "Z"])
    built = build(surroundings={"panorama": str(grey), "ground": {"radius": 0.3}})
    assert built.scene.object_names == ["ground", "reflector"]
    with pytest.raises(_core.FileError, match=r"odd\.exr: has the channels X, Y, Z, expected colours"):
        build(surroundings={"panorama": str(odd)})


def seen_from_inside(**surroundings: Any) -> NDArray[np.float32]:
    """Mean of what arrives at a point from all around."""
    built = build(surroundings=surroundings)
    options = _core.TraceOptions(samples_per_pixel=1)
    tracer = _core.Tracer(built.scene, _core.TracerOptions(indirect="none"))
    captured = tracer.capture((0.0, 5.0, 0.0), "latlong", 16, 8, [built.reflector], options)
    mean: NDArray[np.float32] = captured.reshape(-1, 3).mean(axis=0)
    return mean


def test_a_layer_of_a_panorama_is_chosen_and_depth_and_alpha_are_no_light(tmp_path: Path) -> None:
    path = tmp_path / "layers.exr"
    names = [f"{layer}.{channel}" for layer in ("sky", "sun") for channel in "RGBAZ"]
    values = np.array([1, 2, 3, 1, 90, 4, 5, 6, 1, 90], np.float32)
    _core.save_image(str(path), np.tile(values, (4, 8, 1)), names)
    for layer, colour in (("sky", [1, 2, 3]), ("sun", [4, 5, 6])):
        np.testing.assert_allclose(seen_from_inside(panorama=str(path), layer=layer), colour, rtol=1e-5)
    with pytest.raises(_core.FileError, match="has no layer 'moon', expected one of sky, sun"):
        build(surroundings={"panorama": str(path), "layer": "moon"})


def test_a_square_is_no_panorama_and_a_strip_of_faces_is_a_cube(tmp_path: Path) -> None:
    square, strip = tmp_path / "square.exr", tmp_path / "strip.exr"
    _core.save_image(str(square), np.ones((8, 8, 3), np.float32), ["R", "G", "B"])
    _core.save_image(str(strip), np.full((8, 48, 3), [1, 2, 3], np.float32), ["R", "G", "B"])
    with pytest.raises(_core.FileError, match=r"square\.exr: has 8 x 8 pixels, expected a panorama"):
        build(surroundings={"panorama": str(square)})
    np.testing.assert_allclose(seen_from_inside(panorama=str(strip)), [1, 2, 3], rtol=1e-3)


@pytest.mark.parametrize(
    ("section", "lobe", "roughness", "exponent"),
    [
        ({}, "mirror", 0.1, 100.0),
        ({"roughness": 0.3}, "ggx", 0.3, 100.0),
        ({"lobe": "ggx"}, "ggx", 0.1, 100.0),
        ({"exponent": 20}, "phong", 0.1, 20.0),
    ],
)
def test_a_rough_material_reaches_the_tracer(
    section: dict[str, Any], lobe: str, roughness: float, exponent: float
) -> None:
    config = parse_config({"material": section, "reflector": {"subdivisions": 2}}, "rough")
    built = build_scene(config)
    [first, *_] = built.scene.object_part_materials(built.reflector)
    material = built.scene.material(first)
    assert material.lobe == lobe
    assert material.roughness == pytest.approx(roughness)
    assert material.exponent == pytest.approx(exponent)

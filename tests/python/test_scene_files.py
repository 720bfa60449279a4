"""Scenes from files: against NumPy, against the extensions' formulas, and baked."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import mirrorbake
from mirrorbake import _core
from mirrorbake.bake.bake import bake
from mirrorbake.errors import InputError, StoreError
from mirrorbake.evaluate.evaluate import evaluate
from mirrorbake.pem.header import Source
from mirrorbake.scene.build import build_scene
from mirrorbake.scene.inputs import hash_inputs
from mirrorbake.scene.load import parse_config

from .gltf_scene import SQUARE, SQUARE_NORMALS, SQUARE_TRIANGLES, SQUARE_UVS, GlbScene, png

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

MATTE: dict[str, Any] = {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 1.0}}
# No specular part at all: the index of refraction is that of the air.
LAMBERT: dict[str, Any] = {**MATTE, "extensions": {"KHR_materials_ior": {"ior": 1.0}}}


def rotation_from_quaternion(q: NDArray[np.float64]) -> NDArray[np.float64]:
    x, y, z, w = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_node_transforms_agree_with_numpy_down_a_random_tree(tmp_path: Path) -> None:
    random = np.random.default_rng(1)
    scene = GlbScene(materials=[LAMBERT])
    positions = random.normal(size=(6, 3))
    scene.add_mesh(positions, np.arange(6).reshape(2, 3), 0)
    world: list[NDArray[np.float64]] = []
    for i in range(20):
        local = np.eye(4)
        node: dict[str, Any] = {"mesh": 0, "name": f"n{i}", "children": []}
        if i % 3 == 0:
            local[:3] = random.normal(size=(3, 4))
            node["matrix"] = local.T.reshape(-1).tolist()  # column by column
        else:
            t, s = random.normal(size=3), random.uniform(0.5, 2.0, 3) * random.choice([-1, 1], 3)
            q = random.normal(size=4)
            q /= np.linalg.norm(q)
            local[:3, :3] = rotation_from_quaternion(q) * s
            local[:3, 3] = t
            node |= {"translation": t.tolist(), "rotation": q.tolist(), "scale": s.tolist()}
        parent = int(random.integers(-1, i)) if i else -1
        if parent >= 0:
            scene.nodes[parent]["children"].append(i)
            scene.children.append(i)
        world.append((world[parent] if parent >= 0 else np.eye(4)) @ local)
        scene.nodes.append(node)
    for node in scene.nodes:
        if not node["children"]:
            del node["children"]
    loaded = mirrorbake.load_scene(str(scene.write(tmp_path / "tree.glb")))
    names = loaded.scene.object_names
    assert sorted(names) == sorted(f"n{i}" for i in range(20))
    single = np.asarray(positions, np.float32).astype(np.float64)
    for i, matrix in enumerate(world):
        mesh = loaded.scene.object_mesh(names.index(f"n{i}"))
        expected = single @ matrix[:3, :3].T + matrix[:3, 3]
        # Mirrored transforms turn the order of corners around, so corners are looked up by the triangles.
        found = np.asarray(mesh.positions)[np.asarray(mesh.triangles)]
        order = [0, 1, 2] if np.linalg.det(matrix[:3, :3]) > 0 else [0, 2, 1]
        corners = expected.reshape(2, 3, 3)[:, order]
        # Transformed in double precision and rounded once.
        np.testing.assert_allclose(found, corners, rtol=2e-7, atol=1e-7 * np.abs(expected).max())


def top_view(scene: _core.Scene, size: int = 32, spp: int = 256) -> NDArray[np.float32]:
    """Pixels of the square [−1, 1]² seen from above, by all but parallel rays."""
    camera = _core.Camera(
        (0, 100, 0), (0, 0, 0), (0, 0, -1), math.degrees(2 * math.atan(1 / 100)), size, size
    )
    tracer = _core.Tracer(scene, _core.TracerOptions(indirect="none"))
    return np.asarray(tracer.trace_beauty(camera, _core.TraceOptions(samples_per_pixel=spp)))[..., :3]


def linear_from_srgb(bytes_: NDArray[np.uint8]) -> NDArray[np.float64]:
    v = bytes_ / 255.0
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def test_a_transformed_texture_is_seen_as_the_extension_says(tmp_path: Path) -> None:
    texels = np.random.default_rng(2).integers(0, 256, (4, 4, 3)).astype(np.uint8)
    offset, scale, rotation = (0.2, -0.3), (0.7, 1.3), 0.6
    scene = GlbScene(nodes=[{"mesh": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}])
    transform = {"offset": offset, "scale": scale, "rotation": rotation}
    info = {"index": scene.add_texture(texels), "extensions": {"KHR_texture_transform": transform}}
    pbr = {"metallicFactor": 0.0, "baseColorTexture": info}
    scene.materials = [{"pbrMetallicRoughness": pbr, "extensions": {"KHR_materials_ior": {"ior": 1.0}}}]
    scene.add_mesh(SQUARE, SQUARE_TRIANGLES, 0, SQUARE_NORMALS, SQUARE_UVS)
    # Shines straight down: the node's −Z turned by −90° about x.
    half = math.sqrt(0.5)
    scene.nodes[1]["rotation"] = [-half, 0, 0, half]
    lights = [{"type": "directional", "intensity": math.pi}]
    scene.extra = {"extensions": {"KHR_lights_punctual": {"lights": lights}}}
    loaded = mirrorbake.load_scene(str(scene.write(tmp_path / "floor.glb")))
    assert not loaded.warnings
    size, spp = 32, 256
    image = top_view(loaded.scene, size, spp)

    # E / π · albedo with E = π, the albedo averaged over each pixel: the extension's matrices, then bilinear.
    step = 1 / (16 * size)
    x = np.arange(16 * size) * step + step / 2
    u, v = np.meshgrid(x, x)
    uv = np.stack([u, v, np.ones_like(u)])
    c, s = math.cos(rotation), math.sin(rotation)
    matrix = (
        np.array([[1, 0, offset[0]], [0, 1, offset[1]], [0, 0, 1]])
        @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        @ np.diag([*scale, 1])
    )
    u, v, _ = np.einsum("ij,jyx->iyx", matrix, uv)
    colours = linear_from_srgb(texels)
    a, b = u * 4 - 0.5, v * 4 - 0.5
    i, j = np.floor(a).astype(int), np.floor(b).astype(int)
    fa, fb = (a - i)[..., None], (b - j)[..., None]
    top = (1 - fa) * colours[j % 4, i % 4] + fa * colours[j % 4, (i + 1) % 4]
    bottom = (1 - fa) * colours[(j + 1) % 4, i % 4] + fa * colours[(j + 1) % 4, (i + 1) % 4]
    seen = ((1 - fb) * top + fb * bottom).reshape(size, 16, size, 16, 3).mean(axis=(1, 3))
    # 256 stratified samples of ramps of at most 0.2 across a pixel; a wrong sign or order gives 0.3.
    assert np.abs(image - seen).max() < 5e-3
    assert seen.std() > 0.1


def test_a_spot_light_falls_off_as_the_extension_says(tmp_path: Path) -> None:
    inner, outer, intensity, height = 0.2, 0.45, 7.0, 2.0
    scene = GlbScene(materials=[{**LAMBERT, "pbrMetallicRoughness": {"metallicFactor": 0.0}}])
    scene.add_mesh(SQUARE, SQUARE_TRIANGLES, 0, SQUARE_NORMALS)
    half = math.sqrt(0.5)
    node = {"translation": [0, height, 0], "rotation": [-half, 0, 0, half]}
    scene.nodes = [{"mesh": 0}, {**node, "extensions": {"KHR_lights_punctual": {"light": 0}}}]
    spot = {"innerConeAngle": inner, "outerConeAngle": outer}
    lights = [{"type": "spot", "intensity": intensity, "color": [1.0, 0.5, 0.25], "spot": spot}]
    scene.extra = {"extensions": {"KHR_lights_punctual": {"lights": lights}}}
    loaded = mirrorbake.load_scene(str(scene.write(tmp_path / "spot.glb")))
    size = 32
    image = top_view(loaded.scene, size)
    x = (np.arange(8 * size) + 0.5) / (4 * size) - 1
    px, pz = np.meshgrid(x, x)
    distance2 = px**2 + pz**2 + height**2
    cosine = height / np.sqrt(distance2)
    ramp_scale = 1 / max(0.001, math.cos(inner) - math.cos(outer))
    ramp = np.clip(cosine * ramp_scale - math.cos(outer) * ramp_scale, 0, 1)
    radiance = intensity * ramp**2 * cosine / distance2 / math.pi
    seen = radiance.reshape(size, 8, size, 8).mean(axis=(1, 3))
    expected = seen[..., None] * np.array([1.0, 0.5, 0.25])
    # The view is not quite parallel, and pixels are sampled, not integrated: below 1 % of the largest value.
    assert np.abs(image - expected).max() < 0.01 * seen.max()
    assert seen.min() == 0.0


def tiny_room(path: Path, *, shiny: dict[str, Any]) -> Path:
    """Four walls, floor and ceiling, most of them textured, a lamp and an octahedron to bake."""
    random = np.random.default_rng(3)
    scene = GlbScene()
    checks = np.kron(random.integers(60, 255, (8, 8, 3)), np.ones((4, 4, 1))).astype(np.uint8)
    pbr = {"metallicFactor": 0.0, "baseColorTexture": {"index": scene.add_texture(checks)}}
    scene.materials = [
        {"name": "tiles", "pbrMetallicRoughness": pbr, "extensions": {"KHR_materials_ior": {"ior": 1.0}}},
        {"name": "plaster", **LAMBERT},
        {"name": "lamp", **LAMBERT, "emissiveFactor": [1.0, 0.9, 0.8]},
        {"name": "shiny", **shiny},
    ]
    strength = {"KHR_materials_emissive_strength": {"emissiveStrength": 12.0}}
    scene.materials[2]["extensions"] = {**LAMBERT["extensions"], **strength}
    tiles, plaster, lamp = (
        scene.add_mesh(SQUARE, SQUARE_TRIANGLES, m, SQUARE_NORMALS, SQUARE_UVS) for m in range(3)
    )
    axes = np.vstack([np.eye(3), -np.eye(3)])
    faces = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    octahedron = scene.add_mesh(axes, faces, 3, axes)
    half = math.sqrt(0.5)

    def wall(
        name: str, mesh: int, rotation: list[float], translation: list[float], side: float = 2
    ) -> dict[str, Any]:
        scale = [side, 1, side]
        return {"name": name, "mesh": mesh, "scale": scale, "rotation": rotation, "translation": translation}

    scene.nodes = [
        wall("floor", tiles, [0, 0, 0, 1], [0, 0, 0]),
        wall("ceiling", plaster, [1, 0, 0, 0], [0, 2, 0]),
        wall("back", tiles, [half, 0, 0, half], [0, 0, -2]),
        wall("front", tiles, [-half, 0, 0, half], [0, 0, 2]),
        wall("left", tiles, [0, 0, -half, half], [-2, 0, 0]),
        wall("right", plaster, [0, 0, half, half], [2, 0, 0]),
        wall("lamp", lamp, [1, 0, 0, 0], [0, 1.98, 0], side=0.5),
        {"name": "gem", "mesh": octahedron, "scale": [0.2, 0.3, 0.2], "translation": [0, 0.4, 0]},
    ]
    return scene.write(path)


MIRROR: dict[str, Any] = {"pbrMetallicRoughness": {"metallicFactor": 1.0, "roughnessFactor": 0.0}}


def test_an_object_of_a_gltf_scene_is_baked_where_it_stands(tmp_path: Path) -> None:
    path = tiny_room(tmp_path / "room.glb", shiny=MIRROR)
    config = parse_config(
        {
            "reflector": {"scene_object": "gem"},
            "surroundings": {"scene": str(path)},
            "views": {"count": 2, "degrees": 2.0, "size": [64, 64]},
            "maps": {"size": 32},
            "trace": {"samples": 8},
            "auto": {"quality": "draft"},
        },
        "scene",
    )
    assert hash_inputs(config).keys() == {"surroundings.scene"}
    built = build_scene(config)
    assert built.scene.object_names[built.reflector] == "gem"
    np.testing.assert_allclose(built.positions.max(axis=0), (0.2, 0.7, 0.2), rtol=1e-6)
    summary = bake(config, tmp_path / "pem")
    assert summary.views == 2
    assert not summary.plan.has_diffuse
    evaluation = evaluate(tmp_path / "pem")
    pem = evaluation.mean("pem", "on", run_time="web")
    static = evaluation.mean("static_infinite", "on", run_time="web")
    assert pem is not None
    assert static is not None
    # Facets of an octahedron are flat mirrors: what stands near is far from where an infinite map has it.
    assert pem > 30.0
    assert pem > static + 10.0


def test_a_bake_with_another_material_is_another_scene(tmp_path: Path) -> None:
    surroundings = {"scene": str(tiny_room(tmp_path / "room.glb", shiny=MIRROR))}
    data: dict[str, Any] = {"reflector": {"scene_object": "gem"}, "surroundings": surroundings}

    def source(**sections: Any) -> Source:
        config = parse_config({**data, **sections}, "scene")
        return Source("1", json.loads(config.model_dump_json()), hash_inputs(config))

    files, own = source(), source(material={"r0": 0.5})
    assert files.fingerprint == source().fingerprint
    assert files.fingerprint != own.fingerprint
    assert files.difference_from(files) == "nothing"
    assert files.difference_from(own) == "a section [material] instead of none"
    assert own.difference_from(files).startswith("material.")
    # What a PEM keeps of its scene can be read again.
    assert parse_config(files.config, "again").material is None


def test_files_that_a_scene_refers_to_are_part_of_it(tmp_path: Path) -> None:
    def write(mtl: str = "newmtl a\nKs 0.9 0.9 0.9\nnewmtl b\nmap_Kd tiles.png\n", texel: int = 100) -> None:
        (tmp_path / "paint.mtl").write_text(mtl)
        (tmp_path / "tiles.png").write_bytes(png(np.full((2, 2, 3), texel, np.uint8)))

    floor = "".join(f"v {x} {y} {z}\n" for x, y, z in SQUARE)
    triangles = "o ball\nusemtl a\nf 5 6 7\nf 7 6 5\no floor\nusemtl b\nf 1 2 3\nf 1 3 4\n"
    (tmp_path / "room.obj").write_text(
        "mtllib paint.mtl\n" + floor + "v 0 0.2 0\nv 0.2 0.2 0\nv 0 0.5 0\n" + triangles
    )
    write()
    data = {
        "reflector": {"scene_object": "ball"},
        "surroundings": {"scene": str(tmp_path / "room.obj")},
        "views": {"count": 1, "size": [16, 16]},
        "maps": {"size": 8},
        "trace": {"indirect": "none", "samples": 1},
        "auto": {"quality": "draft"},
    }
    config = parse_config(data, "scene")
    files = hash_inputs(config)["surroundings.scene"]["files"]
    assert list(files) == ["paint.mtl", "tiles.png"]
    bake(config, tmp_path / "pem")
    assert bake(config, tmp_path / "pem").resumed == 1
    write(texel=101)
    with pytest.raises(StoreError, match=r"surroundings\.scene: its file tiles\.png has another content"):
        bake(config, tmp_path / "pem")
    with pytest.raises(StoreError, match=r"its file tiles\.png has another content"):
        evaluate(tmp_path / "pem")
    write()
    assert bake(config, tmp_path / "pem").resumed == 1
    write(mtl="newmtl a\nKs 0.8 0.8 0.8\nnewmtl b\n")
    with pytest.raises(StoreError, match=r"its file paint\.mtl has another content"):
        bake(config, tmp_path / "pem")
    (tmp_path / "paint.mtl").unlink()
    with pytest.raises(StoreError, match=r"its file paint\.mtl is missing"):
        bake(config, tmp_path / "pem")


def test_buffers_of_a_gltf_mesh_are_part_of_the_scene(tmp_path: Path) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"uri": "corners.bin", "byteLength": 36}],
    }
    (tmp_path / "mesh.gltf").write_text(json.dumps(document))
    config = parse_config({"reflector": {"mesh": str(tmp_path / "mesh.gltf")}}, "scene")

    def source(scale: float) -> Source:
        (tmp_path / "corners.bin").write_bytes((scale * corners).tobytes())
        return Source("1", json.loads(config.model_dump_json()), hash_inputs(config))

    once = source(1.0)
    assert source(1.0).fingerprint == once.fingerprint
    other = source(2.0)
    assert other.fingerprint != once.fingerprint
    assert other.difference_from(once) == "reflector.mesh: its file corners.bin has another content"


def test_a_reflector_of_its_own_stands_in_a_scene_from_a_file(tmp_path: Path) -> None:
    path = tiny_room(tmp_path / "room.glb", shiny=MATTE)
    sections: dict[str, Any] = {
        "reflector": {"object": "teapot", "subdivisions": 3, "height": 0.5, "position": [1, 0, 0]},
        "surroundings": {"scene": str(path)},
        "views": {"count": 1},
    }
    built = build_scene(parse_config(sections, "scene"))
    assert built.scene.object_names[-1] == "reflector"
    assert built.part_names == ["body", "lid"]
    # A material of one's own, for the file's matte object.
    sections["reflector"] = {"scene_object": "gem"}
    sections["material"] = {"fresnel": "constant", "r0": 0.5}
    built = build_scene(parse_config(sections, "scene"))
    assert built.scene.material(built.scene.object_material(built.reflector)).fresnel.r0 == (0.5, 0.5, 0.5)


def test_a_scene_object_that_cannot_be_a_reflector_is_an_error(tmp_path: Path) -> None:
    surroundings = {"scene": str(tiny_room(tmp_path / "room.glb", shiny=MATTE))}

    def build(**reflector: Any) -> None:
        build_scene(parse_config({"reflector": reflector, "surroundings": surroundings}, "s"))

    with pytest.raises(InputError, match=r"has no object 'stone'; its objects: floor, ceiling, back"):
        build(scene_object="stone")
    with pytest.raises(InputError, match=r"material of 'floor' is matte"):
        build(scene_object="floor")
    with pytest.raises(InputError, match=r"`height` has no meaning for `scene_object`"):
        build(scene_object="gem", height=2.0)
    with pytest.raises(InputError, match=r"needs surroundings\.scene"):
        parse_config({"reflector": {"scene_object": "gem"}}, "s")


def test_a_texture_that_stays_in_its_file_looks_like_one_in_memory(tmp_path: Path) -> None:
    texels = np.random.default_rng(5).integers(0, 256, (64, 64, 3)).astype(np.uint8)
    (tmp_path / "map.png").write_bytes(png(texels))
    mirrorbake.set_texture_cache_bytes(64 << 20)
    mesh = _core.TriangleMesh(SQUARE, SQUARE_TRIANGLES, SQUARE_NORMALS, SQUARE_UVS)
    images = []
    for in_file in (False, True):
        scene = mirrorbake.Scene()
        if in_file:
            texture = scene.add_texture_file(str(tmp_path / "map.png"), transfer="srgb")
        else:
            texture = scene.add_texture(mirrorbake.load_image(str(tmp_path / "map.png"))[0])
        reference = mirrorbake.TextureReference(texture)
        material = mirrorbake.Material(albedo=(1, 1, 1), albedo_texture=reference)
        scene.add_object("floor", mesh, scene.add_material(material))
        scene.add_directional_light((0, -1, 0), (math.pi, math.pi, math.pi))
        images.append(top_view(scene, spp=16))
    assert images[0].std() > 0.02
    # Texels are halves, and lie where rounding puts them.
    np.testing.assert_allclose(images[0], images[1], atol=1e-3)
    with pytest.raises(mirrorbake.FileError, match=r"gone\.png"):
        scene.add_texture_file(str(tmp_path / "gone.png"))
    with pytest.raises(mirrorbake.InvalidArgument, match="texture cache bytes is 1"):
        mirrorbake.set_texture_cache_bytes(1)


def test_cameras_and_warnings_come_with_the_scene(tmp_path: Path) -> None:
    scene = GlbScene(
        materials=[{**LAMBERT, "alphaMode": "MASK", "alphaCutoff": 0.25, "occlusionTexture": {"index": 0}}]
    )
    scene.add_mesh(SQUARE, SQUARE_TRIANGLES, 0)
    scene.nodes = [{"mesh": 0}, {"camera": 0, "name": "eye", "translation": [0, 1, 3]}]
    scene.extra = {"cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}]}
    loaded = mirrorbake.load_scene(str(scene.write(tmp_path / "a.glb")))
    (camera,) = loaded.cameras
    assert (camera.name, camera.eye, camera.direction, camera.up) == ("eye", (0, 1, 3), (0, 0, -1), (0, 1, 0))
    assert camera.vertical_fov_degrees == pytest.approx(math.degrees(0.8))
    assert repr(camera) == "SceneCamera('eye')"
    (warning,) = loaded.warnings
    message = "occlusion textures are not used: the ray tracer finds what is occluded"
    assert (warning.message, warning.count) == (message, 1)
    assert repr(warning) == f"SceneWarning('{message}', count=1)"
    material = loaded.scene.material(0)
    assert (material.opacity, material.opacity_cutoff, material.opacity_texture.texture) == (1.0, 0.25, -1)


def test_an_obj_scene_has_its_materials(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl gold\nKd 0.1 0.1 0\nKs 0.9 0.7 0.2\nNs 50\nd 0.75\n")
    path = tmp_path / "a.obj"
    path.write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\no sail\nusemtl gold\nf 1 2 3\n")
    loaded = mirrorbake.load_scene(str(path))
    assert loaded.scene.object_names == ["sail"]
    material = loaded.scene.material(0)
    assert (material.lobe, material.exponent) == ("phong", 50.0)
    assert (material.opacity, material.opacity_cutoff) == (0.75, None)


def test_text_of_another_encoding_does_not_get_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_bytes(b"newmtl K\xe4nnchen\nK\xe4 1\n")
    path = tmp_path / "a.obj"
    path.write_bytes(b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\no K\xe4nnchen\nusemtl K\xe4nnchen\nf 1 2 3\n")
    loaded = mirrorbake.load_scene(str(path))
    assert loaded.scene.object_names == loaded.scene.material_names == ["K\ufffdnnchen"]
    assert [w.message for w in loaded.warnings] == ["MTL keyword K\ufffd is not supported"]
    path.write_bytes(b"v 0 0 \xe4\n")
    with pytest.raises(mirrorbake.FileError, match="line 1 has '\ufffd'"):
        mirrorbake.load_scene(str(path))


def test_what_is_wrong_with_a_scene_file_is_named(tmp_path: Path) -> None:
    path = tiny_room(tmp_path / "room.glb", shiny=MATTE)
    with pytest.raises(mirrorbake.FileError, match=r"room\.glb: .*too large: 32 x 32"):
        mirrorbake.load_scene(str(path), max_texture_side=16)
    with pytest.raises(mirrorbake.FileError, match=r"room\.glb.* vertices or more, the limit is 10"):
        mirrorbake.load_scene(str(path), max_vertices=10)
    with pytest.raises(mirrorbake.InvalidArgument, match="luminous_efficacy is 0"):
        mirrorbake.load_scene(str(path), luminous_efficacy=0.0)
    (tmp_path / "cut.glb").write_bytes(path.read_bytes()[:-100])
    with pytest.raises(mirrorbake.FileError, match=r"cut\.glb"):
        mirrorbake.load_scene(str(tmp_path / "cut.glb"))

"""A glTF scene against Mitsuba 3, which gets the same scene from the arrays that the file was written from.

Skipped unless Mitsuba is installed (`pip install mitsuba`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import mirrorbake
from mirrorbake import _core

from .gltf_scene import SQUARE, SQUARE_NORMALS, SQUARE_TRIANGLES, SQUARE_UVS, GlbScene, png

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

mi = pytest.importorskip("mitsuba")

SIZE, BLOCK, SAMPLES, IMAGES = 32, 8, 64, 12
OFFSET, SCALE, ROTATION = (0.3, -0.2), (2.0, 1.5), 0.7
EYE, TARGET, FOV = (0.2, 1.6, 3.0), (0.0, 0.5, 0.0), 50.0
IOR_OF_AIR = {"KHR_materials_ior": {"ior": 1.0}}


def arrays(mesh: _core.TriangleMesh) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    return np.asarray(mesh.positions), np.asarray(mesh.triangles), np.asarray(mesh.normals)


def write_scene(path: Path, texels: NDArray[np.uint8], ball: _core.TriangleMesh) -> Path:
    scene = GlbScene()
    transform = {"offset": OFFSET, "scale": SCALE, "rotation": ROTATION}
    tiles = {"index": scene.add_texture(texels), "extensions": {"KHR_texture_transform": transform}}
    scene.materials = [
        {
            "pbrMetallicRoughness": {"metallicFactor": 0.0, "baseColorTexture": tiles},
            "extensions": IOR_OF_AIR,
        },
        # A metal of base colour 1 reflects everything at every angle.
        {"pbrMetallicRoughness": {"metallicFactor": 1.0, "roughnessFactor": 0.0}},
        {
            "pbrMetallicRoughness": {"metallicFactor": 0.0, "baseColorFactor": [0.3, 0.3, 0.3, 1.0]},
            "emissiveFactor": [1.0, 0.75, 0.5],
            "extensions": {**IOR_OF_AIR, "KHR_materials_emissive_strength": {"emissiveStrength": 8.0}},
        },
    ]
    floor = scene.add_mesh(SQUARE, SQUARE_TRIANGLES, 0, SQUARE_NORMALS, SQUARE_UVS)
    sphere = scene.add_mesh(
        np.asarray(ball.positions), np.asarray(ball.triangles), 1, np.asarray(ball.normals)
    )
    lamp = scene.add_mesh(SQUARE, SQUARE_TRIANGLES, 2, SQUARE_NORMALS)
    half = math.sqrt(0.5)
    scene.nodes = [
        {"mesh": floor, "scale": [2, 1, 2]},
        {"mesh": floor, "scale": [2, 1, 2], "rotation": [half, 0, 0, half], "translation": [0, 1, -2]},
        {"mesh": sphere, "scale": [0.6, 0.6, 0.6], "translation": [0.3, 0.6, 0]},
        {"mesh": lamp, "scale": [0.4, 1, 0.4], "rotation": [1, 0, 0, 0], "translation": [0, 2.5, 0]},
        {"rotation": [-half, 0, 0, half], "extensions": {"KHR_lights_punctual": {"light": 0}}},
    ]
    sun = {"type": "directional", "intensity": 0.8, "color": [0.5, 0.75, 1.0]}
    scene.extra = {"extensions": {"KHR_lights_punctual": {"lights": [sun]}}}
    return scene.write(path)


def transformed(uvs: NDArray[np.float32]) -> NDArray[np.float64]:
    """By the matrices of KHR_texture_transform."""
    c, s = math.cos(ROTATION), math.sin(ROTATION)
    rotated = (uvs * SCALE) @ np.array([[c, s], [-s, c]]).T
    return np.asarray(rotated + OFFSET, np.float64)


def write_ply(path: Path, columns: dict[str, NDArray[Any]], triangles: NDArray[Any]) -> dict[str, Any]:
    vertices = np.stack(list(columns.values()), axis=1)
    header = ["ply", "format ascii 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in columns]
    header += [f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header"]
    lines = [" ".join(repr(float(value)) for value in row) for row in vertices]
    lines += ["3 " + " ".join(str(int(i)) for i in row) for row in triangles]
    path.write_text("\n".join(header + lines) + "\n")
    return {"type": "ply", "filename": str(path)}


def axes(prefix: str, vectors: NDArray[Any]) -> dict[str, NDArray[Any]]:
    return {f"{prefix}{axis}": vectors[:, i] for i, axis in enumerate("xyz")}


def peer_scene(folder: Path, texels: NDArray[np.uint8], ball: _core.TriangleMesh) -> dict[str, Any]:
    (folder / "tiles.png").write_bytes(png(texels))
    uvs = transformed(SQUARE_UVS)
    bitmap = {"type": "bitmap", "filename": str(folder / "tiles.png"), "wrap_mode": "repeat"}
    tiles = {"type": "twosided", "nested": {"type": "diffuse", "reflectance": bitmap}}
    floor = SQUARE * [2, 1, 2]
    back = np.stack([floor[:, 0], 1 - floor[:, 2], floor[:, 1] - 2], axis=1)
    back_normals = np.tile([0, 0, 1], (4, 1))
    uv = {"u": uvs[:, 0], "v": uvs[:, 1]}
    floor_columns = axes("", floor) | axes("n", SQUARE_NORMALS) | uv
    back_columns = axes("", back) | axes("n", back_normals) | uv
    ply = {
        "floor": write_ply(folder / "floor.ply", floor_columns, SQUARE_TRIANGLES),
        "back": write_ply(folder / "back.ply", back_columns, SQUARE_TRIANGLES),
    }
    positions, triangles, normals = arrays(ball)
    ball_columns = axes("", positions * 0.6 + [0.3, 0.6, 0]) | axes("n", normals)
    sphere = write_ply(folder / "ball.ply", ball_columns, triangles)
    grey = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 0.3}}
    lamp = np.stack([0.4 * SQUARE[:, 0], 2.5 - SQUARE[:, 1], -0.4 * SQUARE[:, 2]], axis=1)
    lamp_ply = write_ply(folder / "lamp.ply", axes("", lamp), SQUARE_TRIANGLES)
    return {
        "type": "scene",
        **{name: {**shape, "bsdf": tiles} for name, shape in ply.items()},
        "ball": {**sphere, "bsdf": {"type": "twosided", "nested": {"type": "conductor", "material": "none"}}},
        "lamp": {
            **lamp_ply,
            "face_normals": True,
            "bsdf": {
                "type": "twosided",
                "nested": grey,
            },
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [8.0, 6.0, 4.0]}},
        },
        "sun": {
            "type": "directional",
            "direction": [0, -1, 0],
            "irradiance": {"type": "rgb", "value": [0.4, 0.6, 0.8]},
        },
        "integrator": {"type": "path", "max_depth": -1},
        "sensor": {
            "type": "perspective",
            "to_world": mi.ScalarTransform4f().look_at(origin=EYE, target=TARGET, up=[0, 1, 0]),
            "fov": FOV,
            "fov_axis": "y",
            "near_clip": 1e-3,
            "film": {
                "type": "hdrfilm",
                "width": SIZE,
                "height": SIZE,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
                "component_format": "float32",
            },
        },
    }


def blocks(image: NDArray[Any]) -> NDArray[Any]:
    count = SIZE // BLOCK
    means: NDArray[Any] = image.reshape(count, BLOCK, count, BLOCK, 3).mean(axis=(1, 3))
    return means.ravel()


def test_a_gltf_scene_looks_as_in_mitsuba(tmp_path: Path) -> None:
    mi.set_variant("scalar_rgb")
    texels = np.random.default_rng(6).integers(20, 236, (8, 8, 3)).astype(np.uint8)
    ball = _core.make_sphere((0, 0, 0), 1.0, 48)
    loaded = mirrorbake.load_scene(str(write_scene(tmp_path / "scene.glb", texels, ball)))
    assert not loaded.warnings
    tracer = _core.Tracer(loaded.scene, _core.TracerOptions(indirect="path"))
    camera = _core.Camera(EYE, TARGET, vertical_fov_degrees=FOV, width=SIZE, height=SIZE)
    peer = mi.load_dict(peer_scene(tmp_path, texels, ball))
    ours, theirs = [], []
    for seed in range(IMAGES):
        options = _core.TraceOptions(
            samples_per_pixel=SAMPLES, max_specular_depth=64, max_diffuse_depth=64, seed=seed
        )
        ours.append(blocks(np.asarray(tracer.trace_beauty(camera, options))[..., :3]))
        theirs.append(blocks(np.array(mi.render(peer, spp=SAMPLES, seed=seed))))
    a, b = np.array(ours), np.array(theirs)
    difference = a.mean(axis=0) - b.mean(axis=0)
    # Standard errors from independent images; what is left without noise is float rounding.
    error = np.sqrt((a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / IMAGES) + 2e-4
    # Small enough to see a texture that is placed wrongly, which changes blocks by a third.
    assert error.mean() < 0.05 * b.mean()
    assert np.abs(difference / error).max() < 4.5
    # All blocks together, in which a bias adds up: within 1 % of the mean radiance.
    assert abs(difference.mean()) < 0.01 * b.mean()

"""Images of the unbiased tracer against Mitsuba 3 on the same scenes, by a z-test on block means.

Skipped unless Mitsuba is installed (`pip install mitsuba`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mirrorbake import _core as core

if TYPE_CHECKING:
    from pathlib import Path

mi = pytest.importorskip("mitsuba")

SIZE = 32
BLOCK = 8
SAMPLES = 64
# Independent images per renderer, from which the variance of a block's mean is taken.
IMAGES = 12
# 48 block means per scene: t with about 22 degrees of freedom exceeds 5 once in 20,000.
LARGEST_Z = 5.0
# What is left without noise: float rounding, and edges of shadows that fall between two samples.
FLOOR = 2e-4


@dataclass
class Twin:
    """A scene that is built for both renderers at once."""

    directory: Path
    eye: tuple[float, float, float]
    target: tuple[float, float, float]
    fov: float = 55.0
    scene: core.Scene = field(default_factory=core.Scene)
    peer: dict[str, Any] = field(default_factory=lambda: {"type": "scene"})

    def add(self, mesh: core.TriangleMesh, material: core.Material, bsdf: dict[str, Any]) -> None:
        number = self.scene.add_object("object", mesh, self.scene.add_material(material))
        shape = self._ply(f"mesh{number}", mesh)
        shape["bsdf"] = {"type": "twosided", "nested": bsdf}
        if any(material.emission):
            shape["emitter"] = {"type": "area", "radiance": rgb(material.emission)}
        self.peer[f"mesh{number}"] = shape

    def matte(self, mesh: core.TriangleMesh, albedo: tuple[float, float, float]) -> None:
        self.add(mesh, core.Material(albedo=albedo), {"type": "diffuse", "reflectance": rgb(albedo)})

    def lamp(
        self,
        corner: tuple[float, float, float],
        u: tuple[float, float, float],
        v: tuple[float, float, float],
        radiance: float,
    ) -> None:
        self.scene.add_rectangle_light(corner, u, v, (radiance,) * 3)
        shape = self._ply("lamp", core.make_rectangle(corner, u, v))
        shape["bsdf"] = {"type": "diffuse", "reflectance": rgb((0.0, 0.0, 0.0))}
        shape["emitter"] = {"type": "area", "radiance": rgb((radiance,) * 3)}
        self.peer["lamp"] = shape

    def _ply(self, name: str, mesh: core.TriangleMesh) -> dict[str, Any]:
        positions = np.asarray(mesh.positions)
        normals = np.asarray(mesh.normals)
        columns = ["x", "y", "z"] + (["nx", "ny", "nz"] if len(normals) else [])
        vertices = np.hstack([positions, normals]) if len(normals) else positions
        header = [
            "ply", "format ascii 1.0", f"element vertex {len(vertices)}",
            *(f"property float {c}" for c in columns),
            f"element face {len(mesh.triangles)}", "property list uchar int vertex_indices", "end_header",
        ]  # fmt: skip
        lines = [" ".join(repr(float(value)) for value in row) for row in vertices]
        lines += ["3 " + " ".join(str(i) for i in row) for row in np.asarray(mesh.triangles).tolist()]
        path = self.directory / f"{name}.ply"
        path.write_text("\n".join(header + lines) + "\n")
        return {"type": "ply", "filename": str(path), "face_normals": not len(normals)}


def rgb(value: Any) -> dict[str, Any]:
    return {"type": "rgb", "value": [float(v) for v in value]}


def add_room(twin: Twin) -> None:
    walls = [
        ((-2, 0, 2), (4, 0, 0), (0, 0, -4), (0.6, 0.6, 0.5)),
        ((-2, 4, -2), (4, 0, 0), (0, 0, 4), (0.7, 0.7, 0.7)),
        ((-2, 0, -2), (4, 0, 0), (0, 4, 0), (0.3, 0.4, 0.7)),
        ((2, 0, 2), (-4, 0, 0), (0, 4, 0), (0.7, 0.7, 0.7)),
        ((-2, 0, 2), (0, 0, -4), (0, 4, 0), (0.7, 0.2, 0.2)),
        ((2, 0, -2), (0, 0, 4), (0, 4, 0), (0.2, 0.6, 0.2)),
    ]
    for corner, u, v, albedo in walls:
        twin.matte(core.make_rectangle(corner, u, v), albedo)
    twin.lamp((-0.5, 3.9, -0.5), (1, 0, 0), (0, 0, 1), 12.0)


IN_ROOM: dict[str, Any] = {"eye": (0.3, 2.2, 1.8), "target": (0.0, 1.0, 0.0)}


def box_room(directory: Path) -> Twin:
    twin = Twin(directory, **IN_ROOM)
    add_room(twin)
    twin.matte(core.make_box((-1.2, 0, -1.2), (-0.2, 1.5, -0.3)), (0.7, 0.7, 0.7))
    return twin


def mirror_ball(directory: Path) -> Twin:
    twin = Twin(directory, **IN_ROOM)
    add_room(twin)
    reflectance = (0.9, 0.8, 0.7)
    material = core.Material(
        specular=True, albedo=(0, 0, 0), fresnel=core.Fresnel(core.FresnelModel.constant, r0=reflectance)
    )
    bsdf = {"type": "conductor", "material": "none", "specular_reflectance": rgb(reflectance)}
    twin.add(core.make_sphere((0, 1, 0), 0.7, 48), material, bsdf)
    return twin


def gold_ring(directory: Path) -> Twin:
    """Reflects itself; gold at 630, 532 and 465 nm after Johnson and Christy, Phys. Rev. B 6, 1972."""
    twin = Twin(directory, **IN_ROOM)
    add_room(twin)
    eta, k = (0.189, 0.543, 1.332), (3.071, 2.231, 1.869)
    material = core.Material(
        specular=True, albedo=(0, 0, 0), fresnel=core.Fresnel(core.FresnelModel.conductor, eta=eta, k=k)
    )
    twin.add(
        core.make_torus((0, 1, 0), 0.6, 0.3, 48),
        material,
        {"type": "conductor", "eta": rgb(eta), "k": rgb(k)},
    )
    return twin


def under_the_sky(directory: Path) -> Twin:
    twin = Twin(directory, eye=(0.4, 1.5, 4.0), target=(0.0, 0.6, 0.0), fov=40.0)
    twin.matte(core.make_rectangle((-3, 0, 3), (6, 0, 0), (0, 0, -6)), (0.5, 0.5, 0.5))
    twin.matte(core.make_torus((0, 0.5, 0), 0.6, 0.3, 48), (0.7, 0.4, 0.2))
    # Constant from pole to pole: the two interpolate rows differently there.
    azimuth = (np.arange(64) + 0.5) / 64 * 2 * np.pi
    row = np.stack([2 + np.sin(azimuth), 2 + np.cos(azimuth), 1 + 8 * (np.abs(azimuth - 2) < 0.3)], axis=-1)
    panorama = np.ascontiguousarray(np.broadcast_to(row, (32, 64, 3)), dtype=np.float32)
    twin.scene.set_environment(panorama)
    # Mitsuba's panorama has +Z at its centre.
    twin.peer["sky"] = {"type": "envmap", "bitmap": mi.Bitmap(np.roll(panorama, 32, axis=1))}
    return twin


def glowing_ball(directory: Path) -> Twin:
    twin = Twin(directory, **IN_ROOM)
    add_room(twin)
    del twin.peer["lamp"]
    dark = Twin(directory, **IN_ROOM)
    dark.peer = twin.peer
    for index in range(len(twin.scene.object_names)):
        material = twin.scene.material(twin.scene.object_material(index))
        dark.scene.add_object("wall", twin.scene.object_mesh(index), dark.scene.add_material(material))
    glow = core.Material(albedo=(0.2, 0.2, 0.2), emission=(5, 6, 7))
    dark.add(
        core.make_sphere((0.5, 1.0, 0.2), 0.5, 24), glow, {"type": "diffuse", "reflectance": rgb(glow.albedo)}
    )
    return dark


def point_light(directory: Path) -> Twin:
    twin = Twin(directory, eye=(0.4, 1.5, 4.0), target=(0.0, 0.6, 0.0), fov=40.0)
    twin.matte(core.make_rectangle((-3, 0, 3), (6, 0, 0), (0, 0, -6)), (0.5, 0.6, 0.7))
    twin.matte(core.make_box((-0.5, 0, -0.5), (0.5, 1, 0.5)), (0.7, 0.4, 0.2))
    twin.scene.add_point_light((1.0, 2.5, 1.5), (9, 9, 9))
    twin.peer["lamp"] = {"type": "point", "position": [1.0, 2.5, 1.5], "intensity": rgb((9, 9, 9))}
    return twin


def blocks(image: Any) -> Any:
    count = SIZE // BLOCK
    return image.reshape(count, BLOCK, count, BLOCK, 3).mean(axis=(1, 3)).ravel()


@pytest.mark.parametrize(
    "make",
    [box_room, mirror_ball, gold_ring, under_the_sky, glowing_ball, point_light],
    ids=lambda f: f.__name__,
)
def test_path_traced_image_agrees_with_mitsuba(make: Any, tmp_path: Path) -> None:
    mi.set_variant("scalar_rgb")
    twin = make(tmp_path)
    tracer = core.Tracer(twin.scene, core.TracerOptions(indirect=core.IndirectLight.path))
    camera = core.Camera(twin.eye, twin.target, vertical_fov_degrees=twin.fov, width=SIZE, height=SIZE)
    twin.peer["integrator"] = {"type": "path", "max_depth": -1}
    twin.peer["sensor"] = {
        "type": "perspective",
        "to_world": mi.ScalarTransform4f().look_at(origin=twin.eye, target=twin.target, up=[0, 1, 0]),
        "fov": twin.fov,
        "fov_axis": "y",
        "near_clip": 1e-3,
        "film": {
            "type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"},
            "pixel_format": "rgb", "component_format": "float32",
        },
    }  # fmt: skip
    peer = mi.load_dict(twin.peer)
    ours, theirs = [], []
    for seed in range(IMAGES):
        options = core.TraceOptions(
            samples_per_pixel=SAMPLES, max_specular_depth=64, max_diffuse_depth=64, seed=seed
        )
        ours.append(blocks(tracer.trace_beauty(camera, options)))
        theirs.append(blocks(np.array(mi.render(peer, spp=SAMPLES, seed=seed))))
    a, b = np.array(ours), np.array(theirs)
    error = np.sqrt((a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / IMAGES)
    difference = np.abs(a.mean(axis=0) - b.mean(axis=0))
    allowed = LARGEST_Z * error + FLOOR * b.mean(axis=0)
    assert (difference <= allowed).all(), f"z up to {(difference / error).max():.1f}"
    # The comparison has teeth: it would see a bias of a few percent even where the lamp's caustics are noisy.
    assert b.mean() > 0.01
    assert allowed.mean() < 0.08 * b.mean()

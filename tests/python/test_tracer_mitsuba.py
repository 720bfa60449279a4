"""Images of the unbiased tracer against Mitsuba 3 on the same scenes, by a z-test on block means.

Skipped unless Mitsuba is installed (`pip install mitsuba`). With MIRRORBAKE_LONG_TESTS=1 each scene takes
4096 samples per pixel in place of 1024. Materials that Mitsuba lacks are written for it here; they need its
compiled variant, and with it LLVM: `apt install libllvm19`, and DRJIT_LIBLLVM_PATH if it is not found.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy import stats

from mirrorbake import _core as core

if TYPE_CHECKING:
    from pathlib import Path

mi = pytest.importorskip("mitsuba")

SIZE = 32
BLOCK = 8
SAMPLES = 64
LONG = os.environ.get("MIRRORBAKE_LONG_TESTS") == "1"
# Independent images per renderer, from which the variance of a block's mean is taken.
IMAGES = 64 if LONG else 16


def largest_z(z: float) -> float:
    """As unlikely as `z`, where the variance is that of few images: Mitsuba's are the noisy ones."""
    return z if LONG else float(stats.t.isf(stats.norm.sf(z), IMAGES - 1))


# Of 48 block means per scene; of all of them together, in which a bias adds up, at 99 %.
LARGEST_Z = largest_z(4.0)
LARGEST_MEAN_Z = largest_z(2.6)
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
        self.add_one_sided(mesh, material, {"type": "twosided", "nested": bsdf})

    def add_one_sided(self, mesh: core.TriangleMesh, material: core.Material, bsdf: dict[str, Any]) -> None:
        number = self.scene.add_object("object", mesh, self.scene.add_material(material))
        shape = self._ply(f"mesh{number}", mesh)
        shape["bsdf"] = bsdf
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

    def sky(self, panorama: Any) -> None:
        self.scene.set_environment(panorama)
        # Mitsuba's panorama has +Z at its centre, and its first and last row at the poles. Our interpolant,
        # sampled on 16 times as many rows, is the same function up to the kinks between them.
        height = len(panorama)
        v = np.linspace(0, 1, 16 * height + 1) * height - 0.5
        low = np.clip(np.floor(v).astype(int), 0, height - 1)
        high = np.clip(low + (v >= 0), 0, height - 1)
        share = np.clip(v - np.floor(v), 0, 1)[:, None, None].astype(np.float32)
        rows = (1 - share) * panorama[low] + share * panorama[high]
        turned = np.roll(rows, panorama.shape[1] // 2, axis=1).astype(np.float32)
        self.peer["sky"] = {"type": "envmap", "bitmap": mi.Bitmap(np.ascontiguousarray(turned))}

    def camera(self) -> core.Camera:
        return core.Camera(self.eye, self.target, vertical_fov_degrees=self.fov, width=SIZE, height=SIZE)

    def load_peer(self) -> Any:
        self.peer["integrator"] = {"type": "path", "max_depth": -1}
        self.peer["sensor"] = {
            "type": "perspective",
            "to_world": mi.ScalarTransform4f().look_at(origin=self.eye, target=self.target, up=[0, 1, 0]),
            "fov": self.fov,
            "fov_axis": "y",
            "near_clip": 1e-3,
            "film": {
                "type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"},
                "pixel_format": "rgb", "component_format": "float32",
            },
        }  # fmt: skip
        return mi.load_dict(self.peer)

    def _ply(self, name: str, mesh: core.TriangleMesh) -> dict[str, Any]:
        positions = np.asarray(mesh.positions)
        normals = np.asarray(mesh.normals)
        uvs = np.asarray(mesh.uvs)
        columns = ["x", "y", "z"] + (["nx", "ny", "nz"] if len(normals) else [])
        vertices = np.hstack([positions, normals]) if len(normals) else positions
        if len(uvs):  # Mitsuba's v counts downwards
            columns += ["u", "v"]
            vertices = np.hstack([vertices, uvs[:, :1], 1 - uvs[:, 1:]])
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


COATED = "coated_diffuse"


def register_coated_diffuse() -> None:
    """Give Mitsuba's present variant the coated body of the paper: F L_m + (1 - F) L_d, F of the eye's side.

    Mitsuba's own `plastic` also loses light on its way in and keeps some inside: another material.
    """
    import drjit as dr

    base: Any = mi.BSDF

    class CoatedDiffuse(base):  # type: ignore[misc]
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            self.eta = props["int_ior"]
            self.albedo = mi.Color3f(props["albedo_r"], props["albedo_g"], props["albedo_b"])
            mirror = mi.BSDFFlags.DeltaReflection | mi.BSDFFlags.FrontSide
            body = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide
            self.m_components = [mirror, body]
            self.m_flags = mirror | body

        def reflectance(self, si: Any) -> Any:
            return mi.fresnel(mi.Frame3f.cos_theta(si.wi), self.eta)[0]

        def sample(self, ctx: Any, si: Any, sample1: Any, sample2: Any, active: Any = True) -> Any:
            fresnel = self.reflectance(si)
            # Half of the samples each: independent of how the tracer divides its own.
            mirror = sample1 < 0.5
            bs = mi.BSDFSample3f()
            bs.wo = dr.select(mirror, mi.reflect(si.wi), mi.warp.square_to_cosine_hemisphere(sample2))
            cos_o = mi.Frame3f.cos_theta(bs.wo)
            bs.pdf = dr.select(mirror, 0.5, 0.5 * cos_o / dr.pi)
            bs.eta = 1.0
            bs.sampled_component = dr.select(mirror, mi.UInt32(0), mi.UInt32(1))
            bs.sampled_type = dr.select(
                mirror, mi.UInt32(+mi.BSDFFlags.DeltaReflection), mi.UInt32(+mi.BSDFFlags.DiffuseReflection)
            )
            weight = dr.select(mirror, mi.Color3f(2.0 * fresnel), 2.0 * (1.0 - fresnel) * self.albedo)
            active &= (mi.Frame3f.cos_theta(si.wi) > 0.0) & (cos_o > 0.0)
            return bs, weight & active

        def eval(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
            active &= (cos_i > 0.0) & (cos_o > 0.0)
            return ((1.0 - self.reflectance(si)) * self.albedo * cos_o / dr.pi) & active

        def pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
            return dr.select((cos_i > 0.0) & (cos_o > 0.0), 0.5 * cos_o / dr.pi, 0.0)

        def eval_pdf(self, ctx: Any, si: Any, wo: Any, active: Any = True) -> Any:
            return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

        def to_string(self) -> str:
            return COATED

    mi.register_bsdf(COATED, CoatedDiffuse)


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
        specular=True, albedo=(0, 0, 0), fresnel=core.Fresnel("constant", r0=reflectance)
    )
    bsdf = {"type": "conductor", "material": "none", "specular_reflectance": rgb(reflectance)}
    twin.add(core.make_sphere((0, 1, 0), 0.7, 48), material, bsdf)
    return twin


def gold_ring(directory: Path) -> Twin:
    """Reflects itself; gold at 630, 532 and 465 nm after Johnson and Christy, Phys. Rev. B 6, 1972."""
    twin = Twin(directory, **IN_ROOM)
    add_room(twin)
    eta, k = (0.189, 0.543, 1.332), (3.071, 2.231, 1.869)
    material = core.Material(specular=True, albedo=(0, 0, 0), fresnel=core.Fresnel("conductor", eta=eta, k=k))
    twin.add(
        core.make_torus((0, 1, 0), 0.6, 0.3, 48),
        material,
        {"type": "conductor", "eta": rgb(eta), "k": rgb(k)},
    )
    return twin


def under_the_sky(directory: Path) -> Twin:
    twin = Twin(directory, eye=(0.4, 1.5, 4.0), target=(0.0, 0.6, 0.0), fov=40.0)
    twin.matte(core.make_rectangle((-3, 0, 3), (6, 0, 0), (0, 0, -6)), (0.5, 0.5, 0.5))
    # Flat: where an interpolated normal turns away from the eye, Mitsuba lights the silhouette from behind.
    ring = core.make_torus((0, 0.5, 0), 0.6, 0.3, 48)
    twin.matte(core.TriangleMesh(ring.positions, ring.triangles), (0.7, 0.4, 0.2))
    azimuth = (np.arange(64) + 0.5) / 64 * 2 * np.pi
    row = np.stack([2 + np.sin(azimuth), 2 + np.cos(azimuth), 1 + 8 * (np.abs(azimuth - 2) < 0.3)], axis=-1)
    twin.sky(np.ascontiguousarray(np.broadcast_to(row, (32, 64, 3)), dtype=np.float32))
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
    # Flat: Mitsuba's mesh lights do not shine where an interpolated normal turns away.
    ball = core.make_sphere((0.5, 1.0, 0.2), 0.5, 24)
    flat = core.TriangleMesh(ball.positions, ball.triangles)
    dark.add(flat, glow, {"type": "diffuse", "reflectance": rgb(glow.albedo)})
    return dark


def point_light(directory: Path) -> Twin:
    twin = Twin(directory, eye=(0.4, 1.5, 4.0), target=(0.0, 0.6, 0.0), fov=40.0)
    twin.matte(core.make_rectangle((-3, 0, 3), (6, 0, 0), (0, 0, -6)), (0.5, 0.6, 0.7))
    twin.matte(core.make_box((-0.5, 0, -0.5), (0.5, 1, 0.5)), (0.7, 0.4, 0.2))
    twin.scene.add_point_light((1.0, 2.5, 1.5), (9, 9, 9))
    twin.peer["lamp"] = {"type": "point", "position": [1.0, 2.5, 1.5], "intensity": rgb((9, 9, 9))}
    return twin


def rough_metal(directory: Path) -> Twin:
    """A conductor with GGX facets, which reflects itself."""
    twin = Twin(directory, **IN_ROOM)
    add_room(twin)
    eta, k, alpha = (0.2, 0.9, 1.5), (3.0, 2.5, 1.9), 0.25
    material = core.Material(
        specular=True,
        albedo=(0, 0, 0),
        fresnel=core.Fresnel("conductor", eta=eta, k=k),
        lobe="ggx",
        roughness=alpha,
    )
    bsdf = {"type": "roughconductor", "distribution": "ggx", "alpha": alpha, "eta": rgb(eta), "k": rgb(k)}
    twin.add(core.make_torus((0, 1, 0), 0.6, 0.3, 48), material, bsdf)
    return twin


def coated_ball(directory: Path) -> Twin:
    """A coloured body under a clear coat, whose reflection and shade show in a box of the same kind."""
    try:
        mi.set_variant("llvm_ad_rgb")
        import drjit as dr

        dr.eval(mi.Float(1.0) + mi.Float(2.0))
    except Exception as failure:
        pytest.skip(f"Mitsuba's compiled variant does not run here: {failure}")
    register_coated_diffuse()
    twin = Twin(directory, **IN_ROOM)
    add_room(twin)
    # Flat: see `under_the_sky`.
    ball = core.make_sphere((0.4, 1.0, 0.2), 0.6, 24)
    for mesh, albedo, ior in (
        (core.TriangleMesh(ball.positions, ball.triangles), (0.8, 0.3, 0.2), 1.5),
        (core.make_box((-1.2, 0, -1.0), (-0.3, 1.3, -0.2)), (0.2, 0.4, 0.8), 2.0),
    ):
        fresnel = core.Fresnel("dielectric", eta=(ior,) * 3)
        material = core.Material(specular=True, albedo=albedo, fresnel=fresnel, layers="coated")
        bsdf = {"type": COATED, "int_ior": ior}
        bsdf |= dict(zip(("albedo_r", "albedo_g", "albedo_b"), albedo, strict=True))
        twin.add(mesh, material, bsdf)
    return twin


def silver_teapot(directory: Path) -> Twin:
    """Spout and handle are reflected in the body."""
    twin = Twin(directory, eye=(0.6, 2.3, 1.8), target=(0.0, 0.8, 0.0))
    add_room(twin)
    reflectance = (0.95, 0.93, 0.88)
    material = core.Material(
        specular=True, albedo=(0, 0, 0), fresnel=core.Fresnel("constant", r0=reflectance)
    )
    bsdf = {"type": "conductor", "material": "none", "specular_reflectance": rgb(reflectance)}
    teapot = core.make_teapot(12, 1.2)
    one_part = core.TriangleMesh(teapot.positions, teapot.triangles, normals=teapot.normals)
    twin.add(one_part, material, bsdf)
    return twin


def textured_room(directory: Path) -> Twin:
    """A mirror ball before a chequered wall and on a chequered floor."""
    twin = Twin(directory, **IN_ROOM)
    add_room(twin)
    texels = np.random.default_rng(3).random((8, 8, 3), np.float32) * 0.8
    texture = twin.scene.add_texture(texels)
    bitmap = {
        "type": "bitmap", "bitmap": mi.Bitmap(texels), "raw": True,
        "filter_type": "bilinear", "wrap_mode": "repeat",
    }  # fmt: skip
    for corner, u, v in (
        ((-1.9, 0.01, 1.9), (3.8, 0, 0), (0, 0, -3.8)),
        ((-1.9, 0.1, -1.99), (3.8, 0, 0), (0, 3.8, 0)),
    ):
        material = core.Material(albedo=(1, 1, 1), albedo_texture=core.TextureReference(texture))
        twin.add(core.make_rectangle(corner, u, v), material, {"type": "diffuse", "reflectance": bitmap})
    reflectance = (0.9, 0.9, 0.9)
    mirror = core.Material(specular=True, albedo=(0, 0, 0), fresnel=core.Fresnel("constant", r0=reflectance))
    bsdf = {"type": "conductor", "material": "none", "specular_reflectance": rgb(reflectance)}
    twin.add(core.make_sphere((0, 1, 0), 0.7, 48), mirror, bsdf)
    return twin


def mesh_under_a_panorama(directory: Path) -> Twin:
    """Suzanne under a sunny square, panorama of 128 by 64 texels."""
    folder = os.environ.get("MIRRORBAKE_TEST_DATA")
    if not folder:
        pytest.skip("MIRRORBAKE_TEST_DATA is not set")
    twin = Twin(directory, eye=(0.6, 0.6, 4.0), target=(0.0, 0.0, 0.0), fov=40.0)
    twin.matte(core.load_mesh(f"{folder}/suzanne.obj"), (0.7, 0.5, 0.4))
    pixels = np.asarray(core.load_image(f"{folder}/venice.exr")[0])[..., :3]
    y, x = pixels.shape[0] // 64, pixels.shape[1] // 128
    small = pixels[: 64 * y, : 128 * x].reshape(64, y, 128, x, 3).mean(axis=(1, 3))
    twin.sky(np.ascontiguousarray(small, dtype=np.float32))
    return twin


def bright_lamps(directory: Path) -> Twin:
    """A sphere light, parallel light and a spot on a box and a floor."""
    twin = Twin(directory, eye=(0.4, 1.5, 4.0), target=(0.0, 0.6, 0.0), fov=40.0)
    twin.matte(core.make_rectangle((-3, 0, 3), (6, 0, 0), (0, 0, -6)), (0.5, 0.6, 0.7))
    twin.matte(core.make_box((-0.5, 0, -0.5), (0.5, 1, 0.5)), (0.7, 0.4, 0.2))
    twin.scene.add_sphere_light((1.0, 1.2, 0.8), 0.25, (6, 5, 4))
    twin.peer["ball"] = {
        "type": "sphere", "center": [1.0, 1.2, 0.8], "radius": 0.25,
        "bsdf": {"type": "diffuse", "reflectance": rgb((0.0, 0.0, 0.0))},
        "emitter": {"type": "area", "radiance": rgb((6, 5, 4))},
    }  # fmt: skip
    down = (0.36, -0.8, -0.48)
    twin.scene.add_directional_light(down, (0.5, 0.6, 0.7))
    twin.peer["sun"] = {
        "type": "directional", "direction": list(down), "irradiance": rgb((0.5, 0.6, 0.7)),
    }  # fmt: skip
    return twin


def lace_screen(directory: Path) -> Twin:
    """Two matte screens with gaps before a box, one of them with a texture of gaps, whose shadows show."""
    twin = Twin(directory, **IN_ROOM)
    add_room(twin)
    twin.matte(core.make_box((-1.2, 0, -1.2), (-0.2, 1.5, -0.3)), (0.7, 0.7, 0.7))
    texels = np.random.default_rng(4).random((8, 8, 1), np.float32).repeat(3, axis=2)
    texture = twin.scene.add_texture(texels)
    bitmap = {
        "type": "bitmap", "bitmap": mi.Bitmap(texels), "raw": True,
        "filter_type": "bilinear", "wrap_mode": "repeat",
    }  # fmt: skip
    albedo = (0.3, 0.5, 0.8)
    body = {"type": "twosided", "nested": {"type": "diffuse", "reflectance": rgb(albedo)}}
    lace = core.Material(albedo=albedo, opacity_texture=core.TextureReference(texture))
    screen = core.make_rectangle((-1.0, 0.4, 0.4), (1.2, 0, 0.2), (0, 1.2, 0.1))
    twin.add_one_sided(screen, lace, {"type": "mask", "opacity": bitmap, "nested": body})
    gauze = core.Material(albedo=albedo, opacity=0.4)
    ceiling = core.make_rectangle((0.2, 2.2, 0.5), (1.0, 0, 0), (0, 0, -1.0))
    twin.add_one_sided(ceiling, gauze, {"type": "mask", "opacity": 0.4, "nested": body})
    return twin


def blocks(image: Any) -> Any:
    count = SIZE // BLOCK
    return image.reshape(count, BLOCK, count, BLOCK, 3).mean(axis=(1, 3)).ravel()


@pytest.mark.parametrize(
    "make",
    [
        box_room,
        mirror_ball,
        gold_ring,
        rough_metal,
        coated_ball,
        silver_teapot,
        textured_room,
        mesh_under_a_panorama,
        under_the_sky,
        glowing_ball,
        point_light,
        bright_lamps,
        lace_screen,
    ],
    ids=lambda f: f.__name__,
)
def test_path_traced_image_agrees_with_mitsuba(make: Any, tmp_path: Path) -> None:
    mi.set_variant("scalar_rgb")
    twin = make(tmp_path)
    tracer = core.Tracer(twin.scene, core.TracerOptions(indirect="path"))
    camera = twin.camera()
    peer = twin.load_peer()
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
    means = a.mean(axis=1), b.mean(axis=1)
    spread = np.sqrt((means[0].var(ddof=1) + means[1].var(ddof=1)) / IMAGES)
    bias = abs(means[0].mean() - means[1].mean())
    assert bias <= LARGEST_MEAN_Z * spread + FLOOR * means[1].mean(), f"z of the mean {bias / spread:.1f}"
    # The comparison has teeth: it would see a bias of a few percent even where the lamp's caustics are noisy.
    assert b.mean() > 0.01
    assert allowed.mean() < 0.08 * b.mean()


def test_tilted_normals_differ_from_mitsuba_only_where_they_turn_away_from_the_eye(tmp_path: Path) -> None:
    """One square whose normals lean by 50 degrees, under a sky that is white above the square's plane.

    A hemisphere about the leaning normal n has the share (1 + cos 50°)/2 of its cosine above the plane. That
    is what the tracer reflects, seen from anywhere above the plane. Mitsuba turns n to the eye: where n turns
    away, it takes the hemisphere about -n, with (1 - cos 50°)/2 above the plane, the light from behind. Light
    below the plane, which a closed object shadows, would count in Mitsuba and does not here.
    """
    mi.set_variant("scalar_rgb")
    lean, albedo = math.radians(50.0), 0.6
    normals = np.tile(np.array([math.sin(lean), math.cos(lean), 0.0], np.float32), (4, 1))
    square = core.make_rectangle((-1, 0, 1), (2, 0, 0), (0, 0, -2))
    tilted = core.TriangleMesh(square.positions, square.triangles, normals)
    near, far = (albedo * (1.0 + sign * math.cos(lean)) / 2.0 for sign in (1, -1))
    white = albedo
    for above, below, side, ours, theirs in (
        (1.0, 0.0, 1.0, near, near),
        (1.0, 0.0, -1.0, near, far),
        (1.0, 1.0, 1.0, near, white),
    ):
        # 20 degrees above the square's plane: n turns away from the eye of negative x.
        eye = (side * 4.0 * math.cos(math.radians(20.0)), 4.0 * math.sin(math.radians(20.0)), 0.0)
        twin = Twin(tmp_path, eye=eye, target=(0.0, 0.0, 0.0), fov=8.0)
        twin.matte(tilted, (albedo,) * 3)
        rows = np.where(np.arange(1024) < 512, above, below).astype(np.float32)
        twin.sky(np.ascontiguousarray(np.broadcast_to(rows[:, None, None], (1024, 8, 3))))
        tracer = core.Tracer(twin.scene, core.TracerOptions(indirect="path"))
        traced = tracer.trace_beauty(twin.camera(), core.TraceOptions(samples_per_pixel=256))
        peer = np.array(mi.render(twin.load_peer(), spp=1024))
        # The square fills the middle of the image. The panorama fades over 0.2 degrees at its horizon, and
        # Mitsuba's independent samples leave 0.3 %.
        middle = slice(SIZE // 4, 3 * SIZE // 4)
        assert traced[middle, middle].mean() == pytest.approx(ours, rel=0.01)
        assert peer[middle, middle].mean() == pytest.approx(theirs, rel=0.01)

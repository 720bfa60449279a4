"""Path-traced images against Mitsuba 3's `scalar_rgb` and, where there is an LLVM for it, `llvm_ad_rgb`.

Two scenes, paths of any length: a box room with a rectangle light and a mirror ball of 9,000 triangles, which
throws caustics, and a matte teapot under a sky with a sun, which does not.
Times are scaled to equal error: a renderer with half the variance at the same time counts as twice as fast.
Before them rays alone, as in benchmarks/rays.py; after them one thread against two, and the tracer's time and
memory for balls of 10,000 to 5 million triangles.
"""

from __future__ import annotations

import tempfile
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks import rays
from benchmarks._mitsuba import mitsuba
from benchmarks._report import Case, Effort, require, run, seconds
from mirrorbake import _core as core

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from numpy.typing import NDArray

    Point = tuple[float, float, float]

SIZE = 64
SAMPLES = 64
REFERENCE_SEEDS = 16
EYE, TARGET, FOV = (0.3, 2.2, 1.8), (0.0, 1.0, 0.0), 55.0
MIRROR = (0.9, 0.8, 0.7)
# Corner, edges and albedo.
WALLS = [
    ((-2, 0, 2), (4, 0, 0), (0, 0, -4), (0.6, 0.6, 0.5)),
    ((-2, 4, -2), (4, 0, 0), (0, 0, 4), (0.7, 0.7, 0.7)),
    ((-2, 0, -2), (4, 0, 0), (0, 4, 0), (0.3, 0.4, 0.7)),
    ((2, 0, 2), (-4, 0, 0), (0, 4, 0), (0.7, 0.7, 0.7)),
    ((-2, 0, 2), (0, 0, -4), (0, 4, 0), (0.7, 0.2, 0.2)),
    ((2, 0, -2), (0, 0, 4), (0, 4, 0), (0.2, 0.6, 0.2)),
]
LAMP = (-0.5, 3.9, -0.5), (1, 0, 0), (0, 0, 1)
RADIANCE = (12.0, 12.0, 12.0)


def rgb(value: Any) -> dict[str, Any]:
    return {"type": "rgb", "value": list(value)}


def write_ply(path: Path, mesh: core.TriangleMesh) -> dict[str, Any]:
    vertices = np.hstack([mesh.positions, mesh.normals]).astype("<f4")
    faces = np.zeros(len(mesh.triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"] = 3
    faces["corners"] = mesh.triangles
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(vertices)}"]
    header += [f"property float {name}" for name in ("x", "y", "z", "nx", "ny", "nz")]
    header += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header\n"]
    path.write_bytes("\n".join(header).encode() + vertices.tobytes() + faces.tobytes())
    return {"type": "ply", "filename": str(path)}


def our_scene(ball: core.TriangleMesh) -> core.Scene:
    scene = core.Scene()
    for corner, u, v, albedo in WALLS:
        scene.add_object(
            "wall", core.make_rectangle(corner, u, v), scene.add_material(core.Material(albedo=albedo))
        )
    scene.add_rectangle_light(*LAMP, RADIANCE)
    mirror = core.Material(specular=True, albedo=(0, 0, 0), fresnel=core.Fresnel("constant", r0=MIRROR))
    scene.add_object("ball", ball, scene.add_material(mirror))
    return scene


def mitsuba_sensor(mi: Any, eye: Point, target: Point) -> dict[str, Any]:
    return {
        "type": "perspective",
        "to_world": mi.ScalarTransform4f().look_at(origin=eye, target=target, up=[0, 1, 0]),
        "fov": FOV,
        "fov_axis": "y",
        "film": {
            "type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"},
            "pixel_format": "rgb", "component_format": "float32",
        },
    }  # fmt: skip


def matte(shape: dict[str, Any], albedo: Point) -> dict[str, Any]:
    bsdf = {"type": "twosided", "nested": {"type": "diffuse", "reflectance": rgb(albedo)}}
    return shape | {"bsdf": bsdf}


def mitsuba_room(ball: core.TriangleMesh, mi: Any, folder: Path) -> dict[str, Any]:
    scene: dict[str, Any] = {"type": "scene", "integrator": {"type": "path", "max_depth": -1}}
    for i, (corner, u, v, albedo) in enumerate(WALLS):
        mesh = core.make_rectangle(corner, u, v)
        scene[f"wall{i}"] = matte(write_ply(folder / f"wall{i}.ply", mesh), albedo)
    scene["lamp"] = write_ply(folder / "lamp.ply", core.make_rectangle(*LAMP)) | {
        "bsdf": {"type": "diffuse", "reflectance": rgb((0.0, 0.0, 0.0))},
        "emitter": {"type": "area", "radiance": rgb(RADIANCE)},
    }
    mirror = {"type": "conductor", "material": "none", "specular_reflectance": rgb(MIRROR)}
    scene["ball"] = write_ply(folder / "ball.ply", ball) | {"bsdf": {"type": "twosided", "nested": mirror}}
    scene["sensor"] = mitsuba_sensor(mi, EYE, TARGET)
    return scene


def sky() -> NDArray[np.float32]:
    """Blue above, brown below, and a sun of 0.1 rad; centre along -Z."""
    height, azimuth = np.meshgrid(
        np.pi * (0.5 - (np.arange(128) + 0.5) / 128),
        2 * np.pi * ((np.arange(256) + 0.5) / 256 - 0.5),
        indexing="ij",
    )
    up = 0.5 + 0.5 * np.sin(height)[..., None]
    panorama = (1 - up) * np.array((0.3, 0.25, 0.2)) + up * np.array((0.5, 0.7, 1.0))
    towards_sun = np.sin(height) * np.sin(0.8) + np.cos(height) * np.cos(0.8) * np.cos(azimuth - 1.0)
    panorama += 200 * np.exp((towards_sun - 1) / 0.005)[..., None] * np.array((1.0, 0.9, 0.7))
    return np.asarray(panorama, dtype=np.float32)


# Of the floor, then of the teapot.
OUTDOORS = (0.5, 0.5, 0.4), (0.8, 0.4, 0.2)
OUTDOOR_VIEW = (0.15, 0.2, 0.3), (0.0, 0.06, 0.0)


def outdoor_meshes() -> tuple[core.TriangleMesh, core.TriangleMesh]:
    return core.make_rectangle((-0.5, 0, 0.5), (1, 0, 0), (0, 0, -1)), core.make_teapot()


def our_outdoors() -> core.Scene:
    scene = core.Scene()
    for mesh, albedo, parts in zip(outdoor_meshes(), OUTDOORS, ([], core.teapot_part_names()), strict=True):
        scene.add_object("matte", mesh, scene.add_material(core.Material(albedo=albedo)), parts)
    scene.set_environment(sky())
    return scene


def mitsuba_outdoors(mi: Any, folder: Path) -> dict[str, Any]:
    scene: dict[str, Any] = {"type": "scene", "integrator": {"type": "path", "max_depth": -1}}
    for i, (mesh, albedo) in enumerate(zip(outdoor_meshes(), OUTDOORS, strict=True)):
        scene[f"matte{i}"] = matte(write_ply(folder / f"matte{i}.ply", mesh), albedo)
    # Mitsuba's panorama has +Z at its centre.
    turned = np.roll(sky(), 128, axis=1)
    scene["sky"] = {"type": "envmap", "bitmap": mi.Bitmap(np.ascontiguousarray(turned))}
    scene["sensor"] = mitsuba_sensor(mi, *OUTDOOR_VIEW)
    return scene


def contest(
    name: str, scene: core.Scene, view: tuple[Point, Point], peer_scene: Callable[[Any, Path], dict[str, Any]]
) -> Iterator[Case]:
    start = time.perf_counter()
    tracer = core.Tracer(scene, core.TracerOptions(indirect="path"))
    ready = time.perf_counter() - start
    camera = core.Camera(*view, vertical_fov_degrees=FOV, width=SIZE, height=SIZE)

    def ours(seed: int) -> Any:
        options = core.TraceOptions(
            samples_per_pixel=SAMPLES, max_specular_depth=64, max_diffuse_depth=64, seed=seed
        )
        return tracer.trace_beauty(camera, options)

    # Fireflies, of Mitsuba's caustics above all, would decide alone: the worst 1 % of pixels are left out.
    reference = np.mean([ours(1000 + i) for i in range(2 if Effort.quick else REFERENCE_SEEDS)], axis=0)

    def error(image: Any) -> float:
        square = ((image - reference) / np.maximum(reference, 0.01)) ** 2
        return float(np.sqrt(np.sort(square, axis=None)[: int(0.99 * square.size)].mean()))

    our_image = ours(1)
    our_error = error(our_image)
    our_time = seconds(lambda: ours(1), 5)
    for variant in ("scalar_rgb", "llvm_ad_rgb"):
        mi = mitsuba(variant)
        if mi is None:
            continue
        with tempfile.TemporaryDirectory() as folder:
            loaded = mi.load_dict(peer_scene(mi, Path(folder)))

        def peers(mi: Any = mi, loaded: Any = loaded) -> Any:
            return np.array(mi.render(loaded, spp=SAMPLES, seed=1))

        image = peers()
        # Not the median: fireflies lift the mean of a pixel above what most of its estimates are.
        bias = abs(float(image.mean() / our_image.mean()) - 1)
        require(bias < 0.02, f"the mean is {bias:.1%} off")
        peer_error = error(image)
        peer_time = seconds(peers, 5)
        yield Case(
            case=f"{name}, {SIZE}² pixels, time to our error at {SAMPLES} samples; ready in {ready:.2f} s",
            unit="s per image",
            ours=our_time,
            peer=peer_time * (peer_error / our_error) ** 2,
            peer_name=f"mitsuba {variant}",
            error_ours=our_error,
            error_peer=peer_error,
        )


def cases() -> Iterator[Case]:
    ball = core.make_sphere((0, 1, 0), 0.7, 96)
    yield from contest("mirror ball in a room", our_scene(ball), (EYE, TARGET), partial(mitsuba_room, ball))
    yield from contest("teapot under a sky", our_outdoors(), OUTDOOR_VIEW, mitsuba_outdoors)


def scaling() -> Iterator[Case]:
    """One thread is the peer of two."""
    tracer = core.Tracer(our_scene(core.make_sphere((0, 1, 0), 0.7, 96)), core.TracerOptions(indirect="path"))
    camera = core.Camera(EYE, TARGET, vertical_fov_degrees=FOV, width=2 * SIZE, height=2 * SIZE)
    images, times = [], []
    for threads in (1, 2):
        limit = core.ThreadLimit(threads)
        run_once = partial(tracer.trace_beauty, camera, core.TraceOptions(samples_per_pixel=16))
        images.append(np.asarray(run_once()))
        times.append(seconds(run_once, 3))
        del limit
    require(bool((images[0] == images[1]).all()), "one thread and two")
    yield Case("the same room on two threads", "s per image", times[1], times[0], "one thread", 0.0, 0.0)


def resident_megabytes() -> float:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1024
    return float("nan")


def triangles() -> Iterator[Case]:
    """The ball of 10,000 triangles is the peer of the larger ones."""
    camera = core.Camera(EYE, TARGET, vertical_fov_degrees=FOV, width=256, height=256)
    first = 0.0
    for segments in (100, 1000) if Effort.quick else (100, 1000, 2236):
        before = resident_megabytes()
        start = time.perf_counter()
        tracer = core.Tracer(
            our_scene(core.make_sphere((0, 1, 0), 0.7, segments)),
            core.TracerOptions(indirect="none"),
        )
        ready = time.perf_counter() - start
        memory = resident_megabytes() - before
        taken = seconds(partial(tracer.trace_beauty, camera, core.TraceOptions(samples_per_pixel=4)), 2)
        first = first or taken
        count = segments * segments
        yield Case(
            f"{count:,} triangles, ready in {ready:.2f} s, {memory:.0f} MB",
            "s per image", taken, first, "10,000 triangles", 0.0, 0.0,
        )  # fmt: skip


def all_cases() -> Iterator[Case]:
    yield from rays.cases()
    yield from cases()
    yield from scaling()
    yield from triangles()


if __name__ == "__main__":
    run("Path tracing against Mitsuba 3.", all_cases)

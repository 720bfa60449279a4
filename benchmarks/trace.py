"""Path-traced images against Mitsuba 3's `scalar_rgb` and, where it has LLVM, `llvm_ad_rgb`.

The scene: a box room with a rectangle light and a mirror ball of 9,000 triangles, paths of any length.
Times are scaled to equal error: a renderer with half the variance at the same time counts as twice as fast.
Then one thread against two, and the tracer's time and memory for balls of 10,000 to 5 million triangles.
"""

from __future__ import annotations

import tempfile
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import mitsuba as mi
import numpy as np

from benchmarks._report import Case, require, run, seconds
from mirrorbake import _core as core

if TYPE_CHECKING:
    from collections.abc import Iterator

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
    mirror = core.Material(
        specular=True, albedo=(0, 0, 0), fresnel=core.Fresnel(core.FresnelModel.constant, r0=MIRROR)
    )
    scene.add_object("ball", ball, scene.add_material(mirror))
    return scene


def mitsuba_scene(ball: core.TriangleMesh, folder: Path) -> dict[str, Any]:
    scene: dict[str, Any] = {"type": "scene", "integrator": {"type": "path", "max_depth": -1}}
    for i, (corner, u, v, albedo) in enumerate(WALLS):
        scene[f"wall{i}"] = write_ply(folder / f"wall{i}.ply", core.make_rectangle(corner, u, v)) | {
            "bsdf": {"type": "twosided", "nested": {"type": "diffuse", "reflectance": rgb(albedo)}}
        }
    scene["lamp"] = write_ply(folder / "lamp.ply", core.make_rectangle(*LAMP)) | {
        "bsdf": {"type": "diffuse", "reflectance": rgb((0.0, 0.0, 0.0))},
        "emitter": {"type": "area", "radiance": rgb(RADIANCE)},
    }
    mirror = {"type": "conductor", "material": "none", "specular_reflectance": rgb(MIRROR)}
    scene["ball"] = write_ply(folder / "ball.ply", ball) | {"bsdf": {"type": "twosided", "nested": mirror}}
    scene["sensor"] = {
        "type": "perspective",
        "to_world": mi.ScalarTransform4f().look_at(origin=EYE, target=TARGET, up=[0, 1, 0]),
        "fov": FOV,
        "fov_axis": "y",
        "film": {
            "type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"},
            "pixel_format": "rgb", "component_format": "float32",
        },
    }  # fmt: skip
    return scene


def cases() -> Iterator[Case]:
    ball = core.make_sphere((0, 1, 0), 0.7, 96)
    tracer = core.Tracer(our_scene(ball), core.TracerOptions(indirect=core.IndirectLight.path))
    camera = core.Camera(EYE, TARGET, vertical_fov_degrees=FOV, width=SIZE, height=SIZE)

    def ours(seed: int) -> Any:
        options = core.TraceOptions(
            samples_per_pixel=SAMPLES, max_specular_depth=64, max_diffuse_depth=64, seed=seed
        )
        return tracer.trace_beauty(camera, options)

    # The lamp's caustics are fireflies at this number of samples: the worst 1 % of the pixels are left out.
    reference = np.mean([ours(1000 + i) for i in range(REFERENCE_SEEDS)], axis=0)

    def peers(scene: Any) -> Any:
        return np.array(mi.render(scene, spp=SAMPLES, seed=1))

    def error(image: Any) -> float:
        square = ((image - reference) / np.maximum(reference, 0.01)) ** 2
        return float(np.sqrt(np.sort(square, axis=None)[: int(0.99 * square.size)].mean()))

    our_image = ours(1)
    our_error = error(our_image)
    our_time = seconds(lambda: ours(1), 3)
    for variant in ("scalar_rgb", "llvm_ad_rgb"):
        try:
            mi.set_variant(variant)
            with tempfile.TemporaryDirectory() as folder:
                scene = mi.load_dict(mitsuba_scene(ball, Path(folder)))
            image = peers(scene)
        except (ImportError, RuntimeError):
            continue  # no LLVM on this machine
        bias = abs(float(np.median(image / np.maximum(our_image, 1e-3))) - 1)
        require(bias < 0.02, f"the median pixel is {bias:.1%} off")
        peer_error = error(image)
        peer_time = seconds(partial(peers, scene), 3)
        yield Case(
            case=f"path-traced room, {SIZE}² pixels, time to our error at {SAMPLES} samples",
            unit="s per image",
            ours=our_time,
            peer=peer_time * (peer_error / our_error) ** 2,
            peer_name=f"mitsuba {variant}",
            error_ours=our_error,
            error_peer=peer_error,
        )


def scaling() -> Iterator[Case]:
    """One thread is the peer of two."""
    tracer = core.Tracer(
        our_scene(core.make_sphere((0, 1, 0), 0.7, 96)), core.TracerOptions(indirect=core.IndirectLight.path)
    )
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
    for segments in (100, 1000, 2236):
        before = resident_megabytes()
        start = time.perf_counter()
        tracer = core.Tracer(
            our_scene(core.make_sphere((0, 1, 0), 0.7, segments)),
            core.TracerOptions(indirect=core.IndirectLight.none),
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
    yield from cases()
    yield from scaling()
    yield from triangles()


if __name__ == "__main__":
    run("Path tracing against Mitsuba 3.", all_cases)

"""First hits of rays against embreex, the Python binding of Embree 4, on the same triangles.

Both are given arrays and return arrays. mirrorbake also returns object and normal, and checks every ray.
Before that the program bench_rays, which is built first, compares with a bare loop over Embree in C++.
"""

import json
import subprocess
from collections.abc import Iterator
from functools import partial

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from benchmarks._build import built_program
from benchmarks._report import Case, require, run, seconds
from mirrorbake import _core as core

RAYS = 1_000_000


def bare_embree() -> Iterator[Case]:
    program = built_program("bench_rays", "bench")
    done = subprocess.run([program], stdout=subprocess.PIPE, text=True, check=False)
    require(done.returncode == 0, "bench_rays says so")
    for line in done.stdout.splitlines():
        row = json.loads(line)
        yield Case(
            case=f"{row['case']}, {row['rays']} rays, {row['threads']} threads",
            unit="ns per ray",
            ours=1e3 / row["ours"],
            peer=1e3 / row["ours"] * row["share"],
            peer_name="bare Embree (by processor time)",
            error_ours=0.0,
            error_peer=0.0,
        )


def cases() -> Iterator[Case]:
    yield from bare_embree()
    scene = core.make_room()
    scene.add_object(
        "teapot", core.make_teapot(), scene.add_material(core.Material()), core.teapot_part_names()
    )
    meshes = [scene.object_mesh(index) for index in range(len(scene.object_names))]
    corners = np.concatenate([np.asarray(m.positions)[np.asarray(m.triangles)] for m in meshes])
    tracer = core.Tracer(scene, core.TracerOptions(indirect="none"))
    peer = EmbreeScene()
    TriangleMesh(peer, corners)

    random = np.random.default_rng(1)
    towards = random.normal(scale=0.1, size=(RAYS, 3))
    eye = np.array([0.0, 0.25, 0.6])
    views = {
        "from one point": np.broadcast_to(eye, (RAYS, 3)),
        "from everywhere": random.uniform((-0.3, 0.02, -0.3), (0.3, 0.5, 0.3), (RAYS, 3)),
    }
    for name, start in views.items():
        origins = np.ascontiguousarray(start, dtype=np.float32)
        directions = np.ascontiguousarray(towards - start, dtype=np.float32)
        distance, hit, _ = tracer.intersect(origins, directions)
        distance_peer = peer.run(origins, directions, query="DISTANCE")
        # Rays along an edge may end on either side of it, and lights are no meshes: compare hits of both.
        both = (hit >= 0) & (distance_peer < 1e30)
        length = np.linalg.norm(directions, axis=1)
        difference = np.abs(distance - distance_peer * length)[both] / np.maximum(distance[both], 1e-3)
        outliers = float((difference > 1e-4).mean())
        require(
            both.mean() > 0.99 and outliers < 1e-3, f"{outliers:.1%} of the distances, {both.mean():.1%} hit"
        )
        ours = seconds(partial(tracer.intersect, origins, directions), 3)
        theirs = seconds(partial(peer.run, origins, directions, query="DISTANCE"), 3)
        yield Case(
            case=f"first hit, {name}, {len(corners)} triangles",
            unit="ns per ray",
            ours=1e9 / RAYS * ours,
            peer=1e9 / RAYS * theirs,
            peer_name="embreex",
            error_ours=outliers,
            error_peer=outliers,
        )


if __name__ == "__main__":
    run("Ray casting against embreex.", cases)

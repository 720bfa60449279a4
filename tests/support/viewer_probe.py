"""Probes the rendering matrix of the page's shader, which viewer/tests/browser/probe.test.ts draws with.

Messages on standard input and output are a length (uint32) and bytes. The first two that are written tell the
test's size and the rays of every pixel; then maps, each answered by a picture; the last one is the result.
"""

from __future__ import annotations

import json
import struct
import sys
from typing import TYPE_CHECKING

import numpy as np

import mirrorbake as mb
from mirrorbake._core import Proxy

if TYPE_CHECKING:
    from numpy.typing import NDArray

IMAGE, MAP = 64, 128


def send(data: bytes) -> None:
    """Write a message."""
    sys.stdout.buffer.write(struct.pack("<I", len(data)) + data)
    sys.stdout.buffer.flush()


def receive() -> bytes:
    """Read a message."""
    (length,) = struct.unpack("<I", sys.stdin.buffer.read(4))
    return sys.stdin.buffer.read(length)


def torus() -> mb.SurfaceSamples:
    """Return one lookup in the middle of every pixel of a mirror torus."""
    scene = mb.Scene()
    mirror = scene.add_material(
        mb.Material(albedo=(0, 0, 0), specular=True, fresnel=mb.Fresnel("constant", r0=(1, 1, 1)))
    )
    reflector = scene.add_object("torus", mb.make_torus((0, 0, 0), 0.1, 0.045), mirror)
    tracer = mb.Tracer(scene, mb.TracerOptions(indirect="none"))
    camera = mb.Camera((0.0, 0.35, 0.6), (0.0, 0.0, 0.0), vertical_fov_degrees=25, width=IMAGE, height=IMAGE)
    return tracer.trace_visibility(camera, reflector, places=[(0.5, 0.5)])


def row(matrix: mb.RenderingMatrix, number: int) -> dict[int, float]:
    """Return the weights of a row by their texels."""
    entries = slice(int(matrix.row_offsets[number]), int(matrix.row_offsets[number + 1]))
    return dict(zip(matrix.texels[entries].tolist(), matrix.weights[entries].tolist(), strict=True))


def main() -> None:
    """Probe, and compare with the analytic matrix entry by entry."""
    samples, topology = torus(), mb.TexelTopology.cube(MAP)
    rays = np.zeros((3, IMAGE * IMAGE, 3), np.float32)
    for image, values in zip(
        rays, (samples.reflection, samples.dreflection_dx, samples.dreflection_dy), strict=True
    ):
        image[samples.pixel] = values
    send(json.dumps({"image": IMAGE, "map": MAP}).encode())
    send(rays.tobytes())

    def render(texels: NDArray[np.float32]) -> NDArray[np.float32]:
        send(texels.tobytes())
        return np.frombuffer(receive(), np.float32).reshape(IMAGE, IMAGE, 3)

    probed = mb.probe_rendering_matrix(topology, render)
    one = mb.RunTimeModel(name="middle", places=[(0.5, 0.5)], footprint_scale=1.0)
    analytic = mb.build_rendering_matrix(samples, 0, Proxy.infinite(), topology, one)
    numbers = {int(pixel): number for number, pixel in enumerate(analytic.row_pixels)}
    worst = 0.0
    for number, pixel in enumerate(probed.matrix.row_pixels):
        found, expected = row(probed.matrix, number), row(analytic, numbers[int(pixel)])
        texels = found.keys() | expected.keys()
        worst = max(worst, *(abs(found.get(t, 0.0) - expected.get(t, 0.0)) for t in texels))
    result = {
        "renderings": probed.renderings,
        "rows": probed.matrix.rows,
        "unresolved": probed.unresolved,
        "analyticRows": analytic.rows,
        "entries": analytic.nonzeros,
        "worst": worst,
    }
    send(json.dumps({"result": result}).encode())


if __name__ == "__main__":
    main()

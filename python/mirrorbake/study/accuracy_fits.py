"""How exact maps are that are fitted to what is seen, and shapes to what rays meet; rows on accuracy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import mirrorbake as mb
from mirrorbake import _core, proxy
from mirrorbake.study.accuracy_row import Accuracy

if TYPE_CHECKING:
    from numpy.typing import NDArray

GREY = 0.375
"""A sky that every integral of it is known for."""


def accuracy_of_fits() -> list[Accuracy]:
    """Measure maps that are fitted to what a view shows, and shapes to what rays meet."""
    scene = mb.Scene()
    mirror = scene.add_material(
        mb.Material(albedo=(0, 0, 0), specular=True, fresnel=mb.Fresnel("constant", r0=(0.5, 0.5, 0.5)))
    )
    ball = scene.add_object("ball", mb.make_sphere((0, 0, 0), 1.0, 48), mirror)
    scene.set_environment(np.full((8, 16, 3), GREY, np.float32))
    tracer = mb.Tracer(scene, mb.TracerOptions(indirect="none"))
    camera = mb.Camera((0, 0.5, 3.5), (0, 0, 0), vertical_fov_degrees=45, width=40, height=40)
    model = mb.run_time_model("Web")
    lookups = tracer.trace_visibility(camera, ball, mb.TraceOptions(samples_per_pixel=1), model.places)
    traced = tracer.trace_layers(camera, ball, mb.TraceOptions(samples_per_pixel=16)).samples
    targets = mb.ViewTargets(40, 40, 1, len(traced.shells))
    targets.add(traced)
    size, infinite = mb.TexelTopology.cube(16), proxy.Proxy.infinite()
    count = len(traced.shells)
    stack = [mb.FitShell(infinite, shell) for shell in range(count)]
    texels, *_ = mb.fit_display([mb.DisplayView(lookups, targets)], [stack], [size] * count, run_time=model)
    maps = np.asarray(texels).reshape(count, -1, 4)
    drawn = np.asarray(
        mb.render_reflector(lookups, [[mb.ShellMap(infinite, size, m.copy()) for m in maps]], None, model)
    )
    whole = drawn[..., 3] > 0.999
    one = tracer.trace_visibility(camera, ball, mb.TraceOptions(samples_per_pixel=1), [(0.5, 0.5)])
    known = np.random.default_rng(24).random((sum(6 * 4**k for k in range(4)), 3), np.float32)
    small = mb.TexelTopology.cube(8)
    single = mb.RunTimeModel(name="one", places=[(0.5, 0.5)], footprint_scale=1.0, filter="bilinear")

    def render(values: NDArray[np.float32]) -> NDArray[np.float32]:
        opaque = mb.ShellMap(infinite, small, np.ascontiguousarray(values))
        return np.ascontiguousarray(np.asarray(mb.render_reflector(one, [[opaque]], None, single))[..., :3])

    probed = mb.probe_rendering_matrix(small, render)
    product = np.asarray(probed.matrix.multiply(known)) * np.asarray(probed.scales)
    seen = render(known).reshape(-1, 3)[np.asarray(probed.matrix.row_pixels)]
    light = np.asarray(_core.shell_light(one, mb.ShellMap(infinite, small, known), single))
    row = 0.5 * light[:, :3]
    pixels = render(known).reshape(-1, 3)[np.asarray(one.pixel)]
    return [
        Accuracy(
            "`fit_display`", "a ball of F = ½ in a grey sky, drawn again", "F · grey", "",
            _worst(drawn[..., :3][whole], 0.5 * GREY), 1e-3,
        ),
        Accuracy(
            "`probe_rendering_matrix`", "a ball, noise", "the renderer", "", _worst(product, seen), 1e-5
        ),
        Accuracy("`shell_light`", "a ball, noise", "what is drawn", "", _worst(row, pixels), 2e-6),
        _chosen(),
    ]  # fmt: skip


def _worst(a: object, b: object) -> float:
    return float(np.max(np.abs(np.asarray(a, float) - np.asarray(b, float))))


def _chosen() -> Accuracy:
    random = np.random.default_rng(25)
    half = np.array([3.0, 2.0, 4.0])
    position = random.uniform(-0.3, 0.3, (3000, 3))
    direction = random.normal(size=(3000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    distance = np.min((np.sign(direction) * half - position) / direction, axis=1)
    choice = proxy.choose_proxy(
        position.astype(np.float32),
        direction.astype(np.float32),
        distance.astype(np.float32),
        (np.arange(3000) % 3).astype(np.int32),
        (0.0, 0.0, 0.0),
    )
    off = (
        _worst(np.asarray(choice.best.proxy.half_extent) / half, 1.0)
        if choice.best.proxy.kind == "box"
        else 1.0
    )
    return Accuracy("`proxy.choose_proxy`", "rays in a box 3:2:4", "the box", "relative", off, 1e-3)

"""A bake's seconds per view by stage beside those of [PEM], and drawing a view beside rendering it anew.

The set-up is that of [PEM] §6, the teapot of 40,000 triangles in its room with maps of 256²×6, of whose 100
views one is baked, every layer by itself as there, and some neighbouring ones by the display fit, in draft
and in normal quality without a static set. Of these the first is left out, which traces what those after it
share: the figure is what one more view takes. The peak of memory so far is printed after each. The paper's
times, 15 minutes of ray tracing and 5.5 of inference a view, stand beside ours for what has become of them
since 2001, not as a peer on the same machine. Then a mirror ball in a room
is traced, solved for and drawn from the maps, and Mitsuba 3 renders the same view for as long as it takes to
be as near to a reference of many samples. Without Mitsuba its cases are left out, with a sentence.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks._mitsuba import mitsuba
from benchmarks._report import Case, require, run, seconds
from benchmarks.trace import EYE, FOV, SIZE, TARGET, mitsuba_room, our_scene
from mirrorbake import _core as core
from mirrorbake.bake.bake import bake
from mirrorbake.pem.store import PemStore
from mirrorbake.scene.load import load_config, parse_override

if TYPE_CHECKING:
    from collections.abc import Iterator

EXAMPLE = Path(__file__).parents[1] / "examples" / "teapot-room.toml"
VIEWS = 1
MIDDLE = range(48, 52)
"""Of the arc's views, those that are baked in each quality."""
PAPER_TRACE_S, PAPER_INFER_S = 15.0 * 60.0, 5.5 * 60.0
TARGET_SAMPLES, REFERENCE_SAMPLES, PEER_SAMPLES = 128, 1024, 16


def stages() -> Iterator[Case]:
    """Seconds of a view in the middle of the paper's arc, without neighbours and without a static set."""
    overrides = [
        f"views.count={VIEWS}",
        "views.start=49",
        "views.degrees=0",
        "static.views=0",
        # What [PEM] traced and fitted: a set number of samples, every layer by itself.
        "trace.noise=0",
        "infer.fit='layers'",
        "reflector.parts='split'",
    ]
    config = load_config(EXAMPLE, [parse_override(text) for text in overrides])
    with tempfile.TemporaryDirectory() as folder:
        bake(config, Path(folder) / "pem")
        store = PemStore.open(Path(folder) / "pem")
        timings = [store.read_timings(index) for index in range(VIEWS)]
    for stage, ours, paper in (
        ("ray tracing", sum(t.trace_s for t in timings) / VIEWS, PAPER_TRACE_S),
        ("matrices and solving", sum(t.build_s + t.solve_s for t in timings) / VIEWS, PAPER_INFER_S),
    ):
        yield Case(f"the paper's teapot, {stage}", "s per view", ours, paper, "[PEM], 2001", 0.0, 0.0)


def qualities() -> Iterator[Case]:
    """Seconds that one more view of the paper's arc takes, fitted as it will be displayed.

    Views in the middle of the arc are baked one after the other. The first traces all that is around it, of
    which those after it find most already: their mean is what each of many views takes.
    """
    for quality in ("draft", "normal"):
        overrides = ["static.views=0", f"auto.quality='{quality}'"]
        config = load_config(EXAMPLE, [parse_override(text) for text in overrides])
        with tempfile.TemporaryDirectory() as folder:
            start = time.process_time()
            bake(config, Path(folder) / "pem", samples=MIDDLE)
            spent = time.process_time() - start
            store = PemStore.open(Path(folder) / "pem")
            taken = [store.read_timings(index) for index in MIDDLE]
        seconds_of = [t.trace_s + t.build_s + t.solve_s for t in taken]
        more = sum(seconds_of[1:]) / len(seconds_of[1:])
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
        tracing = sum(t.trace_s for t in taken[1:]) / len(seconds_of[1:])
        print(
            f"{quality} quality: {seconds_of[0]:.1f} s for the first view, {more:.1f} s for each further, "
            f"{tracing:.1f} s of it tracing; {spent:.0f} s of processor time for all {len(MIDDLE)} with plan "
            f"and preparation; peak of memory so far {peak:.2f} GiB",
            file=sys.stderr,
        )
        paper = PAPER_TRACE_S + PAPER_INFER_S
        yield Case(
            f"the paper's teapot, {quality} quality, one more of 100 views",
            "s per view",
            more,
            paper,
            "[PEM], 2001",
            0.0,
            0.0,
        )


def drawing() -> Iterator[Case]:
    """A frame from maps, against path tracing to the same error."""
    mesh = core.make_sphere((0, 1, 0), 0.7, 96)
    scene = our_scene(mesh)
    ball = len(scene.object_names) - 1
    tracer = core.Tracer(scene, core.TracerOptions(indirect="path"))
    camera = core.Camera(EYE, TARGET, vertical_fov_degrees=FOV, width=SIZE, height=SIZE)
    model = core.run_time_model("Web")

    def options(samples: int, seed: int) -> core.TraceOptions:
        return core.TraceOptions(
            samples_per_pixel=samples, max_specular_depth=64, max_diffuse_depth=64, seed=seed
        )

    start = time.perf_counter()
    targets = core.ViewTargets(SIZE, SIZE, 1, 2)
    targets.add(tracer.trace_layers(camera, ball, options(TARGET_SAMPLES, 1)).samples)
    lookups = tracer.trace_visibility(camera, ball, options(1, 0), model.places)
    traced = time.perf_counter() - start
    box = core.Proxy.box((0.0, 2.0, 0.0), (2.0, 2.0, 2.0), (0.0, 1.0, 0.0))
    map_size = core.TexelTopology.cube(64)
    texels, _, _ = core.fit_display(
        [core.DisplayView(lookups, targets)], [[core.FitShell(box, 0)]], [map_size], run_time=model
    )
    fitted = time.perf_counter() - start - traced
    maps = [[core.ShellMap(box, map_size, np.ascontiguousarray(np.asarray(texels)[:, :3]))]]
    draw = partial(core.render_reflector, lookups, maps, None, model)

    reference = np.asarray(tracer.trace_beauty(camera, options(REFERENCE_SAMPLES, 2)))
    inside = np.asarray(draw())[..., 3] == 1.0

    def error(image: Any) -> float:
        # As benchmarks/trace.py: the worst 1 % are left out, for Mitsuba's fireflies.
        square = ((image - reference)[inside] / np.maximum(reference[inside], 0.01)) ** 2
        return float(np.sqrt(np.sort(square, axis=None)[: int(0.99 * square.size)].mean()))

    ours = error(np.asarray(draw())[..., :3])
    require(ours < 0.5, f"the maps are {ours:.0%} off")
    took = seconds(draw)
    print(
        f"the ball's view: {traced:.2f} s of tracing, {fitted:.2f} s of matrices and solving, "
        f"{1e3 * took:.1f} ms to draw, {ours:.1%} off",
        file=sys.stderr,
    )
    for name in ("scalar_rgb", "llvm_ad_rgb"):
        # One module has one variant at a time: each is used before the next is set.
        mi = mitsuba(name)
        if mi is None:
            continue
        with tempfile.TemporaryDirectory() as folder:
            loaded = mi.load_dict(mitsuba_room(mesh, mi, Path(folder)))

        def render(mi: Any = mi, loaded: Any = loaded) -> Any:
            return np.array(mi.render(loaded, spp=PEER_SAMPLES, seed=1))

        theirs = error(render())
        to_our_error = seconds(render, 3) * (theirs / ours) ** 2
        for what, unit, spent in (
            ("a mirror ball drawn from its maps", "s per frame", took),
            ("a mirror ball traced for its maps", "s per view", traced),
            ("a mirror ball's maps solved for", "s per view", fitted),
        ):
            yield Case(
                f"{what}, {SIZE}² pixels, beside a frame of our error",
                unit,
                spent,
                to_our_error,
                f"mitsuba {name}",
                ours,
                theirs,
            )


def cases() -> Iterator[Case]:
    yield from stages()
    yield from qualities()
    yield from drawing()


if __name__ == "__main__":
    run("A bake by stage, and a frame from maps against Mitsuba 3.", cases)

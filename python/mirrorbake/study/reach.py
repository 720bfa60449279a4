"""How far a PEM's lead reaches: against a captured map at infinity and its own static set, by scenes.

`python -m mirrorbake.study.reach SCENE.toml ...` bakes each scene into a temporary folder and looks at it
on a sample, half-way to the next, at places spread inside of a dome, and up to 30 degrees beyond the samples.
Below each stands where it is least above its static set, and what its plan foretold. With `--mesh FILE` it
looks at an object in the furnished room, or with `--sky FILE` under a panorama on a ground.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake.bake.bake import bake
from mirrorbake.bake.trial import trial_of
from mirrorbake.errors import one_line_errors
from mirrorbake.pem.opened import open_pem
from mirrorbake.scene.load import load_config, parse_override
from mirrorbake.scene.stage import prepare_stage
from mirrorbake.tone import srgb_encoded

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from mirrorbake import _core
    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.opened import OpenedPem
    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.scene.parameters import Point

BEYOND = (2.0, 5.0, 10.0, 20.0, 30.0)
"""Degrees past the last sample's azimuth."""
INSIDE = 5
"""Places inside of a dome."""
REFERENCE_SAMPLES = 64
"""Per pixel of each half of a reference."""
SEED_OFFSET = 0x0FF5_0000
CONTENDERS = ("pem", "static_set", "static_infinite")
TARGET_SAMPLES = 16
"""Of which the noise is told."""
SCENE_OF_MESH: tuple[tuple[tuple[str, ...], Any], ...] = (
    (("reflector", "height"), 0.2),
    (("views", "start"), 21.0),
    (("views", "degrees"), 2.0),
    (("views", "count"), 3),
    (("views", "size"), [128, 128]),
    (("maps", "size"), 64),
    (("trace", "noise"), 0.01),
    (("trace", "most_samples"), 128),
    (("static", "views"), 24),
)
"""Three samples 1 degree apart, in the room."""
GROUND = ((("surroundings", "ground", "radius"), 0.3), (("surroundings", "ground", "albedo"), 0.4))
"""Under a panorama."""


@dataclass(frozen=True)
class Look:
    """PSNR in dB, the references' noise taken off, of the pixels that the object covers wholly."""

    place: str
    pem: float
    static_set: float | None
    captured: float
    noise: float
    """That a tracing of 16 samples would have."""


class Reference:
    """A view traced in two halves, whose noise is independent."""

    def __init__(self, pem: OpenedPem, camera: _core.Camera) -> None:
        pixels = camera.width * camera.height
        self._halves, self.seen = [], np.ones(pixels, bool)
        reflector = pem.stage.built.reflector
        for half in range(2):
            options = pem.stage.options
            options.samples_per_pixel, options.seed = REFERENCE_SAMPLES, SEED_OFFSET + half
            options.noise = 0.0
            traced = pem.stage.tracer.trace_layers(camera, reflector, options)
            pixel, light = np.asarray(traced.samples.pixel), np.asarray(traced.sample_beauty)
            count = np.bincount(pixel, minlength=pixels)
            sums = np.stack([np.bincount(pixel, light[:, c], pixels) for c in range(3)], axis=-1)
            self._halves.append(_shown((sums / np.maximum(count, 1)[:, None]).astype(np.float32)))
            self.seen &= count == REFERENCE_SAMPLES

    def decibels(self, picture: FloatArray) -> float:
        """Return the PSNR of a picture (H, W, 3) to the truth: noise cancels in the product of the errors."""
        shown = _shown(picture.reshape(-1, 3))[self.seen]
        a, b = (shown - half[self.seen] for half in self._halves)
        return _decibels(float(np.mean(a * b)))

    @property
    def noise(self) -> float:
        """PSNR in dB of a tracing of `TARGET_SAMPLES`."""
        a, b = (half[self.seen] for half in self._halves)
        return _decibels(float(np.mean((a - b) ** 2)) / 2.0 * REFERENCE_SAMPLES / TARGET_SAMPLES)


def looks(pem: OpenedPem) -> Iterator[Look]:
    """Look at a PEM from between its samples and from beyond them."""
    space, cameras = pem.space, pem.stage.built.cameras
    index = (len(space) - 1) // 2
    between = space.middle_after(index)
    places: list[tuple[str, Point, _core.Camera]] = []
    if cameras.kind == "dome":
        places += [("inside", point, cameras.camera(point)) for point in spread_inside(pem)]
    elif between is not None:
        first = space.sample(index)
        places += [("on", first, cameras.camera(first)), ("half-way", between, cameras.camera(between))]
        last = space.sample(len(space) - 1)
        azimuth, elevation = cameras.angles_of(cameras.eye(last))
        turn = math.copysign(1.0, cameras.degrees)
        places += [
            (f"{degrees:g}° off", last, cameras.around(azimuth + turn * degrees, elevation))
            for degrees in BEYOND
        ]
    for name, point, camera in places:
        reference = Reference(pem, camera)
        samples = pem.stage.tracer.trace_visibility(
            camera, pem.stage.built.reflector, pem.stage.options, pem.run_time.places
        )
        away = cameras.degrees_outside(camera.eye)
        found = {
            contender: reference.decibels(pem.run_time.render(contender, point, samples, None, away))
            for contender in CONTENDERS
            if contender != "static_set" or pem.run_time.has_static_set
        }
        yield Look(name, found["pem"], found.get("static_set"), found["static_infinite"], reference.noise)


def spread_inside(pem: OpenedPem) -> list[Point]:
    """Return places inside of a space of two axes, evenly spread, none of them where a view was traced.

    By powers of the plastic number, as `Dome.places`.
    """
    plastic = 1.32471795724474602596
    places = []
    for number in range(1, INSIDE + 1):
        shares = ((0.5 + number / plastic) % 1.0, (0.5 + number / plastic**2) % 1.0)
        ends = [(axis.values[0], axis.values[-1]) for axis in pem.space.axes]
        places.append(
            tuple(low + share * (high - low) for (low, high), share in zip(ends, shares, strict=True))
        )
    return places


@dataclass(frozen=True)
class Reach:
    """What was found of a scene."""

    looks: list[Look]
    foretold: float | None
    """Decibels by which the plan's trial beat a captured map half-way; None: it tried nothing."""

    @property
    def least_above_static_set(self) -> tuple[float, str] | None:
        """Decibels by which the PEM is above its static set where that is least, and the place."""
        known = [
            (look.pem - look.static_set, look.place) for look in self.looks if look.static_set is not None
        ]
        return min(known, default=None)


def scene_of_mesh(
    mesh: str, sky: str | None = None, overrides: Sequence[tuple[tuple[str, ...], Any]] = ()
) -> SceneConfig:
    """Return a small scene of a mesh, in silver if its file is an OBJ, else in its file's materials.

    Parameters
    ----------
    mesh
        An .obj, .gltf or .glb file.
    sky
        A panorama, above a ground on which the object stands; None: the furnished room.
    overrides
        Of `SCENE_OF_MESH`.
    """
    own: list[tuple[tuple[str, ...], Any]] = [*SCENE_OF_MESH, (("reflector", "mesh"), mesh)]
    if Path(mesh).suffix.lower() == ".obj":
        own.append((("material", "metal"), "silver"))
    if sky is not None:
        own += [(("surroundings", "panorama"), sky), *GROUND]
    return load_config(None, [*own, *overrides])


def measured(config: SceneConfig, folder: Path) -> Reach:
    """Bake a scene into a folder and look at it."""
    stage = prepare_stage(config)
    summary = bake(config, folder, stage=stage)
    found = list(looks(open_pem(folder, stage.planned(summary.plan))))
    trial = trial_of(stage, summary.plan)
    return Reach(found, None if trial is None else trial.lead)


def _shown(light: FloatArray) -> NDArray[np.float64]:
    shown: NDArray[np.float64] = srgb_encoded(light).astype(np.float64)
    return shown


def _decibels(squares: float) -> float:
    return -10.0 * math.log10(max(squares, 1e-9))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(prog="python -m mirrorbake.study.reach", description=__doc__)
    parser.add_argument("scenes", nargs="*", metavar="SCENE.toml")
    parser.add_argument("--mesh", action="append", default=[], metavar="FILE", help="a scene of this object")
    parser.add_argument("--sky", metavar="FILE", help="a panorama over the objects of --mesh; default: room")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="assignments")
    options = parser.parse_args(arguments)
    overrides = [parse_override(text) for text in options.assignments]
    if not options.scenes and not options.mesh:
        parser.error("nothing to look at: expected SCENE.toml or --mesh FILE")
    scenes = {name: load_config(Path(name), overrides) for name in options.scenes}
    scenes |= {name: scene_of_mesh(name, options.sky, overrides) for name in options.mesh}
    print("| scene | place | PEM | static set | captured at infinity | lead | 16 samples' noise |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name, config in scenes.items():
        start = time.process_time()
        with tempfile.TemporaryDirectory() as folder:
            reach = measured(config, Path(folder) / "pem")
            for look in reach.looks:
                static = "" if look.static_set is None else f"{look.static_set:.1f}"
                lead = look.pem - look.captured
                print(
                    f"| {Path(name).stem} | {look.place} | {look.pem:.1f} | {static} | {look.captured:.1f} | "
                    f"{lead:+.1f} | {look.noise:.1f} |",
                    flush=True,
                )
        least = reach.least_above_static_set
        words = "no static set" if least is None else f"least above it {least[1]}: {least[0]:+.1f} dB"
        foretold = "nothing foretold" if reach.foretold is None else f"foretold lead {reach.foretold:+.1f} dB"
        print(f"| {Path(name).stem} | {words}; {foretold} | | | | | |", flush=True)
        print(f"{name}: {time.process_time() - start:.0f} s of processor time", file=sys.stderr, flush=True)


if __name__ == "__main__":
    with one_line_errors("python -m mirrorbake.study.reach"):
        main()

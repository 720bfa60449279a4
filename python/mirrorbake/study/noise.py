"""How far independent tracings of one view are apart, by samples per pixel: the noise of targets.

`python -m mirrorbake.study.noise` traces the teapot in its room, with `--object` and `--sky` another view.
Whatever object it is, it has the default material of scene files.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from mirrorbake import _core
from mirrorbake.errors import one_line_errors
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

    DoubleArray = NDArray[np.float64]

Indirect: TypeAlias = Literal["none", "cached", "path"]

SIDE = 256
"""Pixels."""
EYE, TARGET, FIELD_OF_VIEW = (0.225, 0.30, 0.5), (0.0, 0.075, 0.0), 22.0
"""Of the teapot's view, metres and degrees."""


@dataclass(frozen=True)
class Agreement:
    """Two tracings of a view."""

    samples: tuple[int, int]
    """Per pixel, of each; where counts adapt, those that a pixel has at least."""
    noise: float
    """Of a displayed pixel, that the second may keep; 0: counts do not adapt."""
    spent: float
    """Samples per pixel of the second, on average over the object's."""
    decibels: float
    """PSNR of one against the other, of wholly covered pixels."""
    seconds: float
    """Of processor time that the second took, all threads together."""


@dataclass(frozen=True)
class Bias:
    """Of one kind of indirect light against paths, in shares of the mean radiance."""

    mean: float
    worst: float
    """Of the block that is most off."""
    error: float
    """Standard error of that."""
    block: tuple[int, int]
    """Its row and column, from the picture's top left corner."""


class View:
    """One view of a scene, traced again and again."""

    def __init__(
        self, object_file: str | None = None, sky: str | None = None, side: int = SIDE, cache_seed: int = 0
    ) -> None:
        self._side = side
        self._cache_seed = cache_seed
        self._tracers: dict[Indirect, _core.Tracer] = {}
        views = {"kind": "fixed", "size": [side, side], "fov": FIELD_OF_VIEW}
        scene: dict[str, object] = {"views": views}
        if object_file is not None:
            scene["reflector"] = {"mesh": object_file}
            scene["material"] = {}
        if sky is not None:
            scene["surroundings"] = {"panorama": sky}
        self._stage = prepare_stage(parse_config(scene, "noise"))
        self._camera = _core.Camera(EYE, TARGET, vertical_fov_degrees=FIELD_OF_VIEW, width=side, height=side)

    def trace(
        self, samples: int, seed: int, noise: float = 0.0
    ) -> tuple[FloatArray, NDArray[np.bool_], float]:
        """Return the picture, the pixels that the object covers wholly, and samples spent on those."""
        options = _core.TraceOptions(
            samples_per_pixel=samples,
            max_specular_depth=8,
            seed=seed,
            noise=noise,
            most_samples_per_pixel=256,
        )
        traced = self._stage.tracer.trace_layers(self._camera, self._stage.built.reflector, options)
        side = self._side
        pixel, light = np.asarray(traced.samples.pixel), np.asarray(traced.sample_beauty)
        hits = np.bincount(pixel, minlength=side * side).reshape(side, side)
        counts = np.asarray(traced.samples.pixel_samples).reshape(-1)
        taken = counts.reshape(side, side) if counts.size else np.full((side, side), samples)
        whole = hits == taken
        sums = [np.bincount(pixel, light[:, channel], side * side) for channel in range(3)]
        picture = np.stack(sums, axis=-1).reshape(side, side, 3) / np.maximum(hits, 1)[..., None]
        return picture.astype(np.float32), whole, float(taken[whole].mean())

    def blocks(self, indirect: Indirect, samples: int, seed: int) -> tuple[DoubleArray, DoubleArray]:
        """Sums of the object's light over blocks, mean of the channels, and numbers of samples on it."""
        if indirect not in self._tracers:
            self._tracers[indirect] = _core.Tracer(
                self._stage.built.scene,
                _core.TracerOptions(
                    indirect=indirect, seed=self._cache_seed, focus=self._stage.built.reflector
                ),
            )
        options = _core.TraceOptions(
            samples_per_pixel=samples, max_specular_depth=8, max_diffuse_depth=16, seed=seed
        )
        traced = self._tracers[indirect].trace_layers(self._camera, self._stage.built.reflector, options)
        pixel, light = np.asarray(traced.samples.pixel), np.asarray(traced.sample_beauty).mean(axis=1)
        across = self._side // BLOCK
        block = pixel // self._side // BLOCK * across + pixel % self._side // BLOCK
        return np.bincount(block, light, across**2).astype(float), np.bincount(
            block, minlength=across**2
        ).astype(float)

    def agreement(self, first: int, second: int, noise: float = 0.0) -> Agreement:
        """Trace the view twice, from other random numbers."""
        one, covered, _ = self.trace(first, 101, noise)
        start = time.process_time()
        other, also, spent = self.trace(second, 202, noise)
        seconds = time.process_time() - start
        return Agreement((first, second), noise, spent, psnr(one, other, covered & also), seconds)


BIAS_SIDE, BLOCK = 64, 8
"""Pixels of a picture, and of a block."""


def bias(samples: int, pictures: int, side: int = BIAS_SIDE, cache_seed: int = 0) -> dict[Indirect, Bias]:
    """Compare light that is cached, or none, with paths: the teapot's view in blocks.

    All take the same random numbers, so that what they share cancels.

    Parameters
    ----------
    samples
        Per pixel, of each picture.
    pictures
        Whose scatter tells the error of their mean.
    side
        Pixels of a side, a multiple of BLOCK.
    cache_seed
        Of the cached light: another one has other errors.

    Returns
    -------
        By `trace.indirect`, of blocks that the object covers by a quarter.
    """
    view = View(side=side, cache_seed=cache_seed)
    paths = [view.blocks("path", samples, seed) for seed in range(pictures)]
    hits = np.sum([count for _, count in paths], axis=0)
    kept = np.flatnonzero(hits > 0.25 * hits.max())
    whole = np.mean([light[kept] / count[kept] for light, count in paths])
    found: dict[Indirect, Bias] = {}
    modes: tuple[Indirect, ...] = ("cached", "none")
    for mode in modes:
        others = [view.blocks(mode, samples, seed) for seed in range(pictures)]
        off = np.array(
            [
                (a[kept] / m[kept] - b[kept] / n[kept]) / whole
                for (a, m), (b, n) in zip(others, paths, strict=True)
            ]
        )
        mean = off.mean(axis=0)
        error = off.std(axis=0, ddof=1) / pictures**0.5
        worst = int(np.abs(mean).argmax())
        row, column = divmod(int(kept[worst]), side // BLOCK)
        found[mode] = Bias(float(mean.mean()), float(mean[worst]), float(error[worst]), (row, column))
    return found


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(prog="python -m mirrorbake.study.noise", description=__doc__)
    parser.add_argument("--object", help="an .obj, .gltf or .glb file instead of the teapot")
    parser.add_argument("--sky", help="a panorama instead of the room")
    parser.add_argument("--bias", action="store_true", help="of cached light against paths, in blocks")
    parser.add_argument(
        "--pictures", type=int, default=4, metavar="N", help="of 1024 samples a pixel for --bias, 2 or more"
    )
    parser.add_argument(
        "--cache-seed", type=int, default=0, metavar="N", help="of the cached light that --bias looks at"
    )
    options = parser.parse_args(arguments)
    if options.bias and (options.object or options.sky):
        parser.error("--bias is measured of the teapot in its room, without --object and --sky")
    if options.cache_seed and not options.bias:
        parser.error(f"--cache-seed {options.cache_seed}: is measured with --bias alone")
    if options.pictures < 2:
        parser.error(f"--pictures {options.pictures}: expected 2 or more")
    if not 0 <= options.cache_seed < 2**64:
        parser.error(f"--cache-seed {options.cache_seed}: expected 0 to 2^64 - 1")
    if options.bias:
        for mode, off in bias(1024, options.pictures, cache_seed=options.cache_seed).items():
            row, column = off.block
            print(
                f"{mode}: {off.mean:+.2%} in the mean, {off.worst:+.2%} ±{off.error:.2%} "
                f"in the worst block (row {row}, column {column} from the top left, from 0)"
            )
        return
    view = View(options.object, options.sky)
    print("| samples | against | noise allowed | spent | agree to | processor seconds |")
    print("| --- | --- | --- | --- | --- | --- |")
    for first, second, noise in (
        (16, 16, 0.0),
        (64, 64, 0.0),
        (16, 128, 0.0),
        (16, 16, 0.02),
        (16, 16, 0.01),
        (256, 256, 0.0),
    ):
        found = view.agreement(first, second, noise)
        print(
            f"| {first} | {second} | {noise:g} | {found.spent:.0f} | {found.decibels:.1f} dB | "
            f"{found.seconds:.1f} |",
            flush=True,
        )


if __name__ == "__main__":
    with one_line_errors("python -m mirrorbake.study.noise"):
        main()

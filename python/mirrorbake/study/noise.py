"""How far independent tracings of one view are apart, by samples per pixel: the noise of targets.

`python -m mirrorbake.study.noise` traces the teapot in its room, with `--object` and `--sky` another view.
Whatever object it is, it has the default material of scene files.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

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


class View:
    """One view of a scene, traced again and again."""

    def __init__(self, object_file: str | None = None, sky: str | None = None, side: int = SIDE) -> None:
        self._side = side
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

    def agreement(self, first: int, second: int, noise: float = 0.0) -> Agreement:
        """Trace the view twice, from other random numbers."""
        one, covered, _ = self.trace(first, 101, noise)
        start = time.process_time()
        other, also, spent = self.trace(second, 202, noise)
        seconds = time.process_time() - start
        return Agreement((first, second), noise, spent, psnr(one, other, covered & also), seconds)


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(prog="python -m mirrorbake.study.noise", description=__doc__)
    parser.add_argument("--object", help="an .obj, .gltf or .glb file instead of the teapot")
    parser.add_argument("--sky", help="a panorama instead of the room")
    options = parser.parse_args(arguments)
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
    main()

"""What it gains to refine α after the joint fit, which takes it from the layers' own.

`python -m mirrorbake.study.alpha` fits a view of the teapot in its room with its neighbours, then moves α by
one step of Gauss and Newton within [0, 1], the light held, and tells decibels before and after.
"""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from mirrorbake import _core
from mirrorbake.errors import one_line_errors
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import prepare_stage
from mirrorbake.study.inference import NEIGHBOUR_WEIGHT, OPTIONS, PLACES, Lab

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.study.inference import Place

    DoubleArray = NDArray[np.float64]

VIEW: Place = (22.0, 20.0)
SOFTENING = 0.03
"""Radiance below which the derivative of the display's curve is held, as in the fit."""
STEPS = 150
"""Of the projected gradient."""
DAMPING = 1e-2
"""Squared, relative to the mean square of a column of the rows."""


def rows_of(
    lab: Lab, texels: FloatArray, place: Place, weight: float, run_time: _core.RunTimeModel
) -> tuple[list[sparse.csr_matrix], list[DoubleArray]]:
    """Return how displayed channels change with α of the stacked local maps, and what they lack."""
    count, side = lab.topology.texels, lab.camera(place).width
    pixels = side * side
    lookups = lab.lookups(place, run_time)
    traced = lab.picture(place, lab.samples, lab.stage.config.trace.seed)
    pixel, part = np.asarray(lookups.pixel).astype(np.int64), np.asarray(lookups.part)
    fresnel = np.asarray(lookups.fresnel, float)
    share = 1.0 / np.maximum(np.bincount(pixel, minlength=pixels), 1)

    def means(values: DoubleArray, chosen: NDArray[np.bool_]) -> DoubleArray:
        sums = [np.bincount(pixel[chosen], values[chosen, c], pixels) for c in range(3)]
        means: DoubleArray = np.stack(sums, axis=-1) * share[:, None]
        return means

    drawn = np.zeros((pixels, 3))
    behind = []
    for number, ((near, local, triangles), (far, distant, _)) in enumerate(lab.parts):
        assert triangles is not None
        front = texels[local * count : (local + 1) * count]
        back = np.ascontiguousarray(texels[distant * count : (distant + 1) * count, :3])
        near_light = np.asarray(
            _core.shell_light(lookups, _core.ShellMap(near, lab.topology, front, triangles), run_time), float
        )
        far_light = np.asarray(
            _core.shell_light(lookups, _core.ShellMap(far, lab.topology, back), run_time), float
        )
        mine = part == number
        drawn += means(fresnel * (near_light[:, :3] + (1.0 - near_light[:, 3:]) * far_light[:, :3]), mine)
        matrix = _core.build_rendering_matrix(lookups, number, near, lab.topology, run_time, triangles)
        reads = sparse.csr_matrix(
            (matrix.weights, matrix.texels, matrix.row_offsets.astype(np.int64)), shape=(matrix.rows, count)
        )
        off_hull = mine & (triangles[np.asarray(lookups.triangle)] > 0)
        behind.append((np.asarray(matrix.row_pixels), reads, means(fresnel * far_light[:, :3], off_hull)))
    # Derivative of the sRGB curve (IEC 61966-2-1) at the model's own image.
    slope = 1.055 / 2.4 * np.maximum(drawn, SOFTENING) ** (1.0 / 2.4 - 1.0)
    slope *= math.sqrt(weight) * traced[..., 3].reshape(-1, 1)
    wanted = traced[..., :3].reshape(-1, 3) - drawn
    rows, lacks = [], []
    for c in range(3):
        blocks = []
        for seen, reads, light in behind:
            scaled = sparse.diags(-(slope * light)[seen, c]) @ reads
            to_pixels = sparse.csr_matrix(
                (np.ones(len(seen)), (seen, np.arange(len(seen)))), shape=(pixels, len(seen))
            )
            blocks.append(to_pixels @ scaled)
        rows.append(sparse.hstack(blocks).tocsr())
        lacks.append(slope[:, c] * wanted[:, c])
    return rows, lacks


def bounded_step(rows: sparse.csr_matrix, lacks: DoubleArray, alpha: DoubleArray) -> DoubleArray:
    """Return the change of α that shows best what the rows lack, by a projected, accelerated gradient."""
    squares = np.asarray(rows.multiply(rows).sum(axis=0)).ravel()
    damping = DAMPING * squares.sum() / max(np.count_nonzero(squares), 1)
    diagonal = squares + damping
    vector = np.ones(rows.shape[1])
    for _ in range(15):
        vector = (rows.T @ (rows @ vector) + damping * vector) / diagonal
        largest = float(np.linalg.norm(vector))
        vector /= largest
    step, ahead, momentum = np.zeros(rows.shape[1]), np.zeros(rows.shape[1]), 1.0
    for _ in range(STEPS):
        gradient = (rows.T @ (rows @ ahead - lacks) + damping * ahead) / (diagonal * largest)
        new = np.clip(ahead - gradient, -alpha, 1.0 - alpha)
        following = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * momentum**2))
        ahead = new + (momentum - 1.0) / following * (new - step)
        step, momentum = new, following
    return step


def refined(
    lab: Lab, texels: FloatArray, views: Sequence[tuple[Place, float]], run_time: _core.RunTimeModel
) -> FloatArray:
    """Return maps with α moved by one step, fitted to views with their weights."""
    rows, lacks = [], []
    for place, weight in views:
        of_view = rows_of(lab, texels, place, weight, run_time)
        rows += of_view[0]
        lacks += of_view[1]
    count, maps = lab.topology.texels, [part[0][1] for part in lab.parts]
    alpha = np.concatenate([texels[m * count : (m + 1) * count, 3] for m in maps]).astype(float)
    step = bounded_step(sparse.vstack(rows).tocsr(), np.concatenate(lacks), alpha)
    result = texels.copy()
    for number, m in enumerate(maps):
        result[m * count : (m + 1) * count, 3] += step[number * count : (number + 1) * count]
    return result


def study(size: int, map_size: int, samples: int) -> dict[str, dict[str, float]]:
    """Return decibels by place, before and after."""
    scene = {"views": {"size": [size, size]}, "reflector": {"parts": "split"}, "trace": {"indirect": "none"}}
    lab = Lab(prepare_stage(parse_config(scene, "alpha")), VIEW, samples, 2 * samples, map_size)
    run_time = _core.run_time_model("Web")
    beside = [((VIEW[0] + side, VIEW[1]), NEIGHBOUR_WEIGHT) for side in (-1.0, 1.0)]
    views = [(VIEW, 1.0), *beside]
    before, _ = lab.fit(views, run_time, OPTIONS, lab.captured_prior())
    return {
        name: {
            place: lab.decibels(maps, (VIEW[0] + around, VIEW[1] + up), run_time)
            for place, (around, up) in PLACES.items()
        }
        for name, maps in (("layers' own", before), ("refined", refined(lab, before, views, run_time)))
    }


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(prog="python -m mirrorbake.study.alpha", description=__doc__)
    parser.add_argument("--size", type=int, default=96, help="pixels a side")
    parser.add_argument("--map-size", type=int, default=32, help="texels a side of a face")
    parser.add_argument("--samples", type=int, default=64, help="per pixel, of targets")
    options = parser.parse_args(arguments)
    found = study(options.size, options.map_size, options.samples)
    print("| α | " + " | ".join(PLACES) + " |")
    print("| --- |" + " --- |" * len(PLACES))
    for name, decibels in found.items():
        print(f"| {name} | " + " | ".join(f"{decibels[place]:.2f}" for place in PLACES) + " |")


if __name__ == "__main__":
    with one_line_errors("python -m mirrorbake.study.alpha"):
        main()

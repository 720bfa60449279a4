"""Where the body's own light is stored: at vertices, of finer meshes, or in a map on texture coordinates.

`python -m mirrorbake.study.diffuse SCENE.toml ...` measures for each scene how much the picture changes by
light that is interpolated, beyond noise, and what it takes: two bytes a channel of every vertex or of every
texel that is read.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from mirrorbake.bake.diffuse_edges import at_vertices, change_by, small_views
from mirrorbake.bake.sample import diffuse_layer
from mirrorbake.errors import InputError, one_line_errors
from mirrorbake.scene.load import load_config, parse_override
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from numpy.typing import NDArray

    from mirrorbake import _core
    from mirrorbake.arrays import FloatArray
    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.scene.stage import Stage

HALVINGS = 5
"""Of the mesh's mean edge."""
SIZES = (16, 32, 64, 128, 256)
"""Texels along the sides of maps."""
TRUTH_VERTICES = 1 << 15
"""Of the mesh whose light maps are fitted to."""
SMOOTHNESS = 1e-3
"""λ of squared differences of neighbouring texels."""
BYTES = 6


@dataclass(frozen=True)
class Storage:
    """One way to store a body's light."""

    name: str
    values: int
    """Vertices, or texels that are read."""
    change: float
    """Of the picture, beyond noise, relative."""


def ways_to_store(config: SceneConfig) -> Iterator[Storage]:
    """Measure vertices of finer and finer meshes, then maps, if the mesh has coordinates for them.

    Raises
    ------
    InputError
        No part of the object has diffuse light, or the object is one of a scene, which keeps its mesh.
    """
    if config.reflector.scene_object is not None:
        raise InputError("reflector.scene_object: keeps its mesh; expected `mesh` or `object`")
    stage = prepare_stage(config)
    built = stage.built
    materials = map(built.scene.material, built.scene.object_part_materials(built.reflector))
    if not any(any(material.albedo) or any(material.emission) for material in materials):
        raise InputError("material.albedo: black, so that there is no diffuse light to store")
    views = small_views(stage)
    corners = built.positions[built.triangles].astype(np.float64)
    edge = float(np.mean(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1)))
    finest = stage
    for halvings in range(HALVINGS + 1):
        finer = stage.without_edges_above(edge / 2**halvings) if halvings else stage
        if halvings and len(finer.built.positions) > TRUTH_VERTICES:
            break
        finest = finer
        name = (
            f"vertices, edges up to {1e3 * edge / 2**halvings:.3g} mm" if halvings else "vertices as they are"
        )
        yield Storage(name, len(finer.built.positions), change_by(finer, views, at_vertices(finer)))
    coordinates = np.asarray(built.scene.object_mesh(built.reflector).uvs)
    if len(coordinates):
        light = diffuse_layer(finest, 1)
        for size in SIZES:
            drawn, texels = in_map(finest, light, size)
            yield Storage(f"map of {size}²", texels, change_by(finest, views, drawn))


def in_map(
    stage: Stage, light: FloatArray, size: int
) -> tuple[Callable[[_core.SurfaceSamples], FloatArray], int]:
    """Fit a map on the mesh's texture coordinates to the light (V, 3) at its vertices.

    Returns
    -------
    tuple
        What gives the radiance (n, 3) of samples' bodies, and how many texels are read.
    """
    built = stage.built
    mesh = built.scene.object_mesh(built.reflector)
    uvs, triangles = np.asarray(mesh.uvs), np.asarray(mesh.triangles)
    reads = _bilinear(uvs, size)
    across = scipy.sparse.eye_array(size * size) - scipy.sparse.eye_array(size * size, k=1)
    down = scipy.sparse.eye_array(size * size) - scipy.sparse.eye_array(size * size, k=size)
    system = scipy.sparse.vstack([reads, SMOOTHNESS**0.5 * across, SMOOTHNESS**0.5 * down]).tocsr()
    zeros = np.zeros(2 * size * size)
    texels = np.stack(
        [scipy.sparse.linalg.lsqr(system, np.concatenate([light[:, c], zeros]))[0] for c in range(3)], axis=-1
    )

    def drawn(samples: _core.SurfaceSamples) -> FloatArray:
        b = np.asarray(samples.barycentric)
        weights = np.stack([1.0 - b[:, 0] - b[:, 1], b[:, 0], b[:, 1]], axis=-1)
        places = np.einsum("nk,nkc->nc", weights, uvs[triangles[samples.triangle]])
        found: FloatArray = (samples.albedo * (_bilinear(places, size) @ texels) / np.pi).astype(np.float32)
        return found + samples.emission if len(samples.emission) else found

    return drawn, int(np.count_nonzero(np.bincount(reads.indices, minlength=size * size)))


def _bilinear(uvs: NDArray[Any], size: int) -> Any:
    """Rows that read a map of size² texels at coordinates (n, 2)."""
    place = np.mod(uvs, 1.0) * size - 0.5
    low = np.floor(place).astype(np.int64)
    share = place - low
    rows, columns, weights = [], [], []
    for right in (0, 1):
        for up in (0, 1):
            x, y = np.clip(low[:, 0] + right, 0, size - 1), np.clip(low[:, 1] + up, 0, size - 1)
            rows.append(np.arange(len(uvs)))
            columns.append(y * size + x)
            weights.append(np.abs(1 - right - share[:, 0]) * np.abs(1 - up - share[:, 1]))
    entries = (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns)))
    return scipy.sparse.coo_array(entries, shape=(len(uvs), size * size)).tocsr()


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(prog="python -m mirrorbake.study.diffuse", description=__doc__)
    parser.add_argument("scenes", nargs="+", metavar="SCENE.toml")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="assignments")
    options = parser.parse_args(arguments)
    overrides = [parse_override(text) for text in options.assignments]
    scenes = {name: load_config(Path(name), overrides) for name in options.scenes}
    print("| scene | stored | values | bytes | change |")
    print("| --- | --- | --- | --- | --- |")
    for name, config in scenes.items():
        for way in ways_to_store(config):
            size = f"{BYTES * way.values / 1e3:.1f} kB"
            print(
                f"| {Path(name).stem} | {way.name} | {way.values} | {size} | {way.change:.2%} |", flush=True
            )


if __name__ == "__main__":
    with one_line_errors("python -m mirrorbake.study.diffuse"):
        main()

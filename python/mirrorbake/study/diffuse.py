"""Where the body's own light is stored: at vertices, of finer meshes, or in a map on texture coordinates.

`python -m mirrorbake.study.diffuse SCENE.toml ...` measures for each scene how much the picture changes by
light that is interpolated, beyond noise, and what it takes: two bytes a channel of every vertex or of every
texel that is read.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake.bake.body_light import RAYS, Lightmap, has_own_coordinates, irradiance_of, lit_sides
from mirrorbake.bake.light_storage import BYTES, SIZES
from mirrorbake.bake.traced_light import TracedLight
from mirrorbake.errors import InputError, one_line_errors
from mirrorbake.scene.load import load_config, parse_override
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from mirrorbake.scene.config import SceneConfig

HALVINGS = 5
"""Of the mesh's mean edge."""
MOST_VERTICES = 1 << 15


@dataclass(frozen=True)
class Storage:
    """One way to store a body's light."""

    name: str
    values: int
    """Vertices, or texels that are read, on each side that is lit."""
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
    corners = built.positions[built.triangles].astype(np.float64)
    edge = float(np.mean(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1)))
    traced, sides = TracedLight(stage), lit_sides(stage)
    change = traced.change_by(irradiance_of(stage, sides))
    yield Storage("vertices as they are", sides * len(built.positions), change)
    for halvings in range(1, HALVINGS + 1):
        finer = stage.without_edges_above(edge / 2**halvings)
        if len(finer.built.positions) > MOST_VERTICES:
            break
        name = f"vertices, edges up to {1e3 * edge / 2**halvings:.3g} mm"
        change = TracedLight(finer).change_by(irradiance_of(finer, sides))
        yield Storage(name, sides * len(finer.built.positions), change)
    if has_own_coordinates(stage):
        for size in SIZES:
            lightmap = Lightmap(stage, size)
            texels = lightmap.inferred(lightmap.gathered(sides, RAYS, config.trace.seed))
            yield Storage(f"map of {size}²", sides * lightmap.texels, traced.change_by(texels, size))


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

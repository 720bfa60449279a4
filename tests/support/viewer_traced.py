"""Small baked PEMs for the tests of the page, with ray tracing and the C++ renderer beside them.

    python tests/support/viewer_traced.py OUT

writes the web exports `traced-exact` and `traced-avif` of a teapot and `traced-lightmap` of a plate with a
shadow, with a `reference.json` beside `reference-K.f32`: ray traced pictures, float32 RGBA from the top left
corner with 1 in alpha where all of a pixel is the object.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from mirrorbake.bake.bake import bake
from mirrorbake.evaluate.metrics import decibels, mean_squared_error
from mirrorbake.evaluate.references import trace_reference
from mirrorbake.pem.export.images import ImageFormat
from mirrorbake.pem.export.source import export_source
from mirrorbake.pem.export.web import WebOptions, WebPem
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.scene.load import parse_config
from mirrorbake.viewer.export import write_folder
from unwrapped import write_post_on_plate, write_sun

CONFIG = {
    "reflector": {"object": "teapot", "subdivisions": 8, "parts": "split"},
    "views": {"count": 3, "degrees": 4.0, "size": [160, 120]},
    "maps": {"size": 64},
    "trace": {"samples": 32, "indirect": "none"},
    "static": {"views": 3},
    "auto": {"quality": "draft"},
}
LIT = {
    **CONFIG,
    "material": {
        "ior": [1.5] * 3,
        "fresnel": "dielectric",
        "albedo": [0.7, 0.6, 0.5],
        "layers": "coated",
    },
    "layers": {"lightmap": 64},
}
REFERENCE_SAMPLES = 64
POINTS = (0.5, 0.25)
"""On a sample, and half-way between two."""


def write_pictures(pem: OpenedPem, folders: list[Path]) -> None:
    """Trace the views at `POINTS` and say how near the C++ renderer comes to them, in dB of the display."""
    pictures: list[dict[str, Any]] = []
    for k, t in enumerate(POINTS):
        stage = pem.stage.at((t,))
        camera = stage.built.cameras.camera((t,))
        reference = trace_reference(stage, camera, (0, 0, camera.width, camera.height), REFERENCE_SAMPLES)
        seen = stage.tracer.trace_visibility(
            camera, stage.built.reflector, stage.options, pem.run_time.places
        )
        drawn = pem.run_time.render("pem", (t,), seen)
        traced = reference.images.object
        pixels = np.concatenate([traced, reference.mask[..., None]], axis=2).astype("<f4")
        for folder in folders:
            pixels.tofile(folder / f"reference-{k}.f32")
        cameras = stage.built.cameras
        pictures.append(
            {
                "file": f"reference-{k}.f32",
                "parameter": t,
                "elevation": cameras.angles_of(camera.eye)[1],
                "web": decibels(mean_squared_error(drawn, traced, reference.mask)),
            }
        )
    description = {
        "width": camera.width,
        "height": camera.height,
        "distance": math.dist(camera.eye, camera.target),
        "pictures": pictures,
    }
    for folder in folders:
        (folder / "reference.json").write_text(json.dumps(description))


def write_pem(config: dict[str, Any], folders: list[Path]) -> None:
    """Bake, and export, exactly where the folder's name does not say otherwise."""
    with tempfile.TemporaryDirectory() as scratch:
        bake(parse_config(config, "traced"), Path(scratch) / "pem")
        pem = open_pem(Path(scratch) / "pem")
        source = export_source(pem)
        for folder in folders:
            image_format = ImageFormat(exact=not folder.name.endswith("avif"))
            web = WebPem(source, WebOptions(image_format, fallback=False))
            write_folder(web, "traced", folder, lambda done, total, text: None)
        write_pictures(pem, folders)


def main(out: Path) -> None:
    write_pem(CONFIG, [out / "traced-exact", out / "traced-avif"])
    with tempfile.TemporaryDirectory() as folder:
        mesh, sky = Path(folder) / "plate.obj", Path(folder) / "sky.exr"
        write_post_on_plate(mesh)
        write_sun(sky)
        scene = {"reflector": {"mesh": str(mesh)}, "surroundings": {"panorama": str(sky)}}
        write_pem({**LIT, **scene}, [out / "traced-lightmap"])


if __name__ == "__main__":
    main(Path(sys.argv[1]))

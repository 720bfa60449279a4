"""Draws the pictures of the page on environment maps: a labelled panorama in every projection and convention.

Runs by itself (`python docs/make_pictures.py`) and as a hook of mkdocs before every build.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mirrorbake.envmap import EnvMap
from mirrorbake.projection import texel_directions, texel_solid_angles

if TYPE_CHECKING:
    from numpy.typing import NDArray

FOLDER = Path(__file__).parent / "guide" / "pictures"
SIZE = 256

# Label, direction, and what is to the right of it and above it for somebody in the middle who looks there.
SIDES = [
    ("+X", (1, 0, 0), (0, 0, 1), (0, 1, 0), "#d9534f"),
    ("−X", (-1, 0, 0), (0, 0, -1), (0, 1, 0), "#f2b5b3"),
    ("+Y", (0, 1, 0), (1, 0, 0), (0, 0, 1), "#4cae4c"),
    ("−Y", (0, -1, 0), (1, 0, 0), (0, 0, -1), "#b6ddb6"),
    ("+Z", (0, 0, 1), (-1, 0, 0), (0, 1, 0), "#428bca"),
    ("−Z", (0, 0, -1), (1, 0, 0), (0, 1, 0), "#b3d1ea"),
]


def side(label: str, color: str) -> NDArray[np.float32]:
    """Picture of one side of the room, as seen from inside."""
    figure = Figure(figsize=(1, 1), dpi=SIZE, facecolor=color)
    canvas = FigureCanvasAgg(figure)
    figure.text(0.5, 0.5, label, ha="center", va="center", fontsize=22, weight="bold")
    figure.text(0.5, 0.84, "↑", ha="center", va="center", fontsize=14)
    canvas.draw()  # type: ignore[no-untyped-call]
    pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
    return pixels[..., :3].astype(np.float32) / np.float32(255)


def labelled_panorama(height: int) -> EnvMap:
    """A panorama whose texels show the side of the room that they look at."""
    d = texel_directions("latlong", 2 * height, height)
    image = np.zeros((height, 2 * height, 3), np.float32)
    for label, forward, right, up, color in SIDES:
        picture = side(label, color)
        depth = d @ np.array(forward, np.float32)
        seen = depth >= np.abs(d).max(axis=-1) - 1e-6
        x = (d @ np.array(right, np.float32))[seen] / depth[seen]
        y = (d @ np.array(up, np.float32))[seen] / depth[seen]
        column = np.clip(((x + 1) / 2 * SIZE).astype(int), 0, SIZE - 1)
        row = np.clip(((1 - y) / 2 * SIZE).astype(int), 0, SIZE - 1)
        image[seen] = picture[row, column]
    # The drawing is in display values; PNG files are encoded from scene-linear ones.
    linear = np.where(image <= 0.04045, image / 12.92, ((image + 0.055) / 1.055) ** 2.4)
    return EnvMap.from_array(linear, "latlong")


def seam_pictures() -> None:
    """[AEM] figure 4: the last but one level of plain and of seamless mips, without interpolation."""
    d = np.stack([texel_directions("cube", 128, 128, face) for face in range(6)])
    sun = np.exp(40 * (d @ np.array([0.36, 0.8, 0.48], np.float32) - 1))
    sky = (0.3 + 0.2 * d[..., 1:2]) * np.array([0.6, 0.8, 1.0]) + 8 * sun[..., None]
    cube = EnvMap.from_array(sky, "cube")
    for filter in ("box", "seamless"):
        coarse = cube.mips(filter).level(6)
        EnvMap.from_array(coarse, "cube").resample("latlong", 128, filter="nearest").save(
            FOLDER / f"mips_{filter}.png"
        )


def density_table() -> None:
    """[EMT] figure 4, measured at 512 texels a side: solid angles of the texels inside of the domain."""
    lines = [
        "| projection | smallest texel, 1e-6 sr | largest | largest : smallest |",
        "| --- | --- | --- | --- |",
    ]
    rows, columns = (np.arange(512) - 255.5)[:, None], (np.arange(512) - 255.5)[None, :]
    inside = np.hypot(np.abs(rows) + 0.5, np.abs(columns) + 0.5) <= 256
    for projection in ("cube", "dual_paraboloid", "sphere_map", "angular", "latlong", "equal_area"):
        angles = texel_solid_angles(projection, 512, 512)
        if projection not in ("cube", "latlong", "equal_area"):
            angles = angles[inside]
        low, high = angles.min(), angles.max()
        lines.append(f"| `{projection}` | {1e6 * low:.3g} | {1e6 * high:.3g} | {high / low:.3g} |")
    (FOLDER / "densities.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


def draw() -> None:
    """Write all pictures."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    density_table()
    panorama = labelled_panorama(512)
    for projection in ("latlong", "equal_area"):
        panorama.resample(projection, 160).save(FOLDER / f"{projection}.png")
    for projection in ("sphere_map", "angular", "fisheye"):
        panorama.resample(projection, 256).save(FOLDER / f"{projection}.png")
    panorama.resample("dual_paraboloid", 256).save(FOLDER / "dual_paraboloid.png")
    panorama.resample("cube", 96).save(FOLDER / "cube.png", faces="cross")
    for name in ("openexr", "oiio", "mitsuba", "threejs"):
        panorama.resample("latlong", 160).to_convention(name).save(FOLDER / f"latlong_{name}.png")
    for name in ("openexr", "threejs"):
        panorama.resample("cube", 96).to_convention(name).save(FOLDER / f"cube_{name}.png")
    panorama.resample("cube", 96).save(FOLDER / "cube_ktx2.png")
    seam_pictures()


def on_pre_build(config: Any) -> None:
    """Hook of mkdocs."""
    draw()


if __name__ == "__main__":
    draw()

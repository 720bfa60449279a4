"""Draws the pictures of the page on environment maps: a labelled panorama in every projection and convention.

Runs by itself (`python docs/make_pictures.py`) and as a hook of mkdocs before every build.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mirrorbake import save_image
from mirrorbake.envmap import EnvMap
from mirrorbake.prefilter import Prefilter, lambert, phong
from mirrorbake.prefilter.styles import STYLES, style
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
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].astype(np.float32) / 255


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


def prefilter_pictures() -> None:
    """[WP] figure 8, spheres from diffuse to mirror; [EMT] figure 15, the four styles on a sphere."""
    d = texel_directions("latlong", 512, 256)
    sky = np.where(d[..., 1:2] > 0, [0.35, 0.55, 0.9], [0.25, 0.2, 0.15]) * (0.6 + 0.4 * np.abs(d[..., 1:2]))
    windows = (np.sin(9 * np.arctan2(d[..., 0], -d[..., 2])) > 0.3) & (np.abs(d[..., 1] - 0.25) < 0.18)
    sky = np.where(windows[..., None], [3.0, 2.6, 2.0], sky)
    sky[d @ np.array([0.36, 0.8, 0.48], np.float32) > 0.995] = 60
    source = EnvMap.from_array(sky.astype(np.float32), "latlong")

    size = 160
    place = (np.arange(size) + 0.5) / size * 2.1 - 1.05
    x, y = np.meshgrid(place, -place)
    inside = np.hypot(x, y) < 1
    normal = np.stack([x, y, np.sqrt(np.maximum(0, 1 - x**2 - y**2))], axis=-1).astype(np.float32)[inside]
    reflected = 2 * normal[:, 2:] * normal - np.array([0, 0, 1], np.float32)
    filtered = Prefilter(source)
    diffuse = filtered.sample(lambert(), normal)

    def row(name: str, colors: list[NDArray[np.float32]]) -> None:
        picture = np.ones((size, size * len(colors), 3), np.float32)
        for i, color in enumerate(colors):
            picture[:, i * size : (i + 1) * size][inside] = color / (1 + 0.35 * color)
        save_image(str(FOLDER / name), picture)

    mirror = source.sample(reflected)
    row("diffuse_to_mirror.png", [(1 - s) * diffuse + s * mirror for s in (0.0, 0.25, 0.5, 0.75, 1.0)])
    row("phong_spheres.png", [filtered.sample(phong(n), reflected) for n in (1, 10, 50, 250, 2000)])
    row("style_spheres.png", [style(name, 256).sample(reflected) for name in STYLES])


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
    prefilter_pictures()


def on_pre_build(config: Any) -> None:
    """Hook of mkdocs."""
    draw()


if __name__ == "__main__":
    draw()

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
from mirrorbake.fresnel import dielectric
from mirrorbake.prefilter import Prefilter, lambert, phong
from mirrorbake.prefilter.parabolic import distortion, parabolic_phong
from mirrorbake.prefilter.styles import STYLES, style
from mirrorbake.projection import points_from_directions, texel_directions, texel_solid_angles

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


def light_room() -> EnvMap:
    """A sky with a sun over brown ground, and a ring of windows."""
    d = texel_directions("latlong", 512, 256)
    sky = np.where(d[..., 1:2] > 0, [0.35, 0.55, 0.9], [0.25, 0.2, 0.15]) * (0.6 + 0.4 * np.abs(d[..., 1:2]))
    windows = (np.sin(9 * np.arctan2(d[..., 0], -d[..., 2])) > 0.3) & (np.abs(d[..., 1] - 0.25) < 0.18)
    sky = np.where(windows[..., None], [3.0, 2.6, 2.0], sky)
    sky[d @ np.array([0.36, 0.8, 0.48], np.float32) > 0.995] = 60
    return EnvMap.from_array(sky.astype(np.float32), "latlong")


def save_row(
    name: str, inside: NDArray[np.bool_], colors: list[NDArray[np.float32]], background: float = 1.0
) -> None:
    """Pictures side by side: colours of the pixels that an object covers, compressed to [0, 1]."""
    height, width = inside.shape
    picture = np.full((height, width * len(colors), 3), background, np.float32)
    for i, color in enumerate(colors):
        picture[:, i * width : (i + 1) * width][inside] = color / (1 + 0.35 * color)
    save_image(str(FOLDER / name), picture)


def ball(size: int) -> tuple[NDArray[np.bool_], NDArray[np.float32], NDArray[np.float32]]:
    """Which pixels a ball covers, its normals there, and the directions that they reflect the viewer to."""
    place = (np.arange(size) + 0.5) / size * 2.1 - 1.05
    x, y = np.meshgrid(place, -place)
    inside = np.hypot(x, y) < 1
    normal = np.stack([x, y, np.sqrt(np.maximum(0, 1 - x**2 - y**2))], axis=-1).astype(np.float32)[inside]
    return inside, normal, 2 * normal[:, 2:] * normal - np.array([0, 0, 1], np.float32)


def torus(size: int) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Which pixels a tilted torus covers, and its normals there, found by stepping along parallel rays."""
    place = (np.arange(size) + 0.5) / size * 3 - 1.5
    x, y = np.meshgrid(place, -place)
    tilt = np.radians(50)
    turn = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    point = np.stack([x, y, np.full_like(x, 2)], axis=-1) @ turn  # in the frame of the torus, its axis z
    step = np.array([0, 0, -1.0]) @ turn

    def distance(p: NDArray[np.float64]) -> NDArray[np.float64]:
        result: NDArray[np.float64] = np.hypot(np.hypot(p[..., 0], p[..., 1]) - 1, p[..., 2]) - 0.42
        return result

    for _ in range(120):
        point = point + distance(point)[..., None] * step
    inside = distance(point) < 1e-3
    hit = point[inside]
    center = hit * [1, 1, 0]
    center /= np.linalg.norm(center, axis=-1, keepdims=True)
    return inside, ((hit - center) / 0.42 @ turn.T).astype(np.float32)


def pixel_steps(covered: NDArray[np.bool_], values: NDArray[np.float32], axis: int) -> NDArray[np.float32]:
    """By how much values of covered pixels change to the next covered one along an axis of the picture."""
    whole = np.zeros((*covered.shape, 3), np.float32)
    whole[covered] = values
    steps = np.zeros_like(whole)
    for way in (1, -1):
        beside = np.roll(covered, -way, axis)[..., None]
        steps = np.where(beside, way * (np.roll(whole, -way, axis) - whole), steps)
    return np.asarray(steps[covered], np.float32)


def prefilter_pictures() -> None:
    """[WP] figure 8, [EMT] figures 8, 14 and 15: spheres from diffuse to mirror, Fresnel, torus, styles."""
    source = light_room()
    inside, normal, reflected = ball(160)
    filtered = Prefilter(source)
    diffuse = filtered.sample(lambert(), normal)
    mirror = source.sample(reflected)
    save_row(
        "diffuse_to_mirror.png", inside, [(1 - s) * diffuse + s * mirror for s in (0.0, 0.25, 0.5, 0.75, 1.0)]
    )
    save_row(
        "phong_spheres.png", inside, [filtered.sample(phong(n), reflected) for n in (1, 10, 50, 250, 2000)]
    )
    save_row("style_spheres.png", inside, [style(name, 256).sample(reflected) for name in STYLES])
    share = [dielectric(normal[:, 2], n)[:, None].astype(np.float32) for n in (1.5, 5.0, 200.0)]
    save_row("fresnel_mirrors.png", inside, [f * mirror for f in share])
    save_row("fresnel_glossy.png", inside, [f * filtered.sample(phong(250), reflected) for f in share])
    red = np.array([0.7, 0.1, 0.08], np.float32) * diffuse
    save_row("fresnel_coated.png", inside, [f * mirror + (1 - f) * red for f in share])

    covered, around = torus(240)
    seen = 2 * around[:, 2:] * around - np.array([0, 0, 1], np.float32)
    gold = np.array([1.0, 0.72, 0.3], np.float32)
    save_row(
        "torus.png",
        covered,
        [
            gold * filtered.sample(phong(10), seen),
            gold * filtered.sample(phong(100), seen),
            gold * source.sample(seen),
        ],
    )
    ddx, ddy = (pixel_steps(covered, seen, axis) for axis in (1, 0))
    save_row(
        "torus_styles.png",
        covered,
        [style(name, 256).sample(seen, ddx, ddy, filter="trilinear") for name in STYLES],
    )


def hardware_pictures() -> None:
    """[EMT] figures 12 and 13: what a filter of one size is on the sphere, and both blended against B2."""
    figure = Figure(figsize=(5, 3), dpi=110)
    axes = figure.subplots()
    for radius in (0.1, 0.25, 0.5):
        at = np.linspace(0, 1, 60)
        axes.plot(at, [100 * distortion(radius, float(x)) for x in at], label=f"radius {radius:g}")
    axes.set_xlabel("distance of the filter from the centre of the map")
    axes.set_ylabel("distortion, %")
    axes.legend()
    figure.tight_layout()
    FigureCanvasAgg(figure).print_png(FOLDER / "parabolic_distortion.png")
    source = light_room().resample("latlong", 128)
    inside, _, reflected = ball(160)
    exact = Prefilter(source)
    rows = []
    for exponent in (10, 50, 250):
        rows += [
            parabolic_phong(source, exponent, 128).sample(reflected),
            exact.sample(phong(exponent), reflected),
        ]
    save_row("parabolic_spheres.png", inside, rows)


def warp_picture() -> None:
    """[RSI] figure 4: where a grid of one view's sphere map comes from in that of a view 37° away."""
    angle = np.radians(37)
    place = (np.arange(200) + 0.5) / 200 * 2.1 - 1.05
    x, y = np.meshgrid(place, -place)
    inside = np.hypot(x, y) < 1
    normal = np.stack([x, y, np.sqrt(np.maximum(0, 1 - x**2 - y**2))], axis=-1)[inside]
    source = np.array(
        [[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]]
    )  # source from target
    mirrored = 2 * normal[:, 2:] * normal - [0, 0, 1]
    _, by_mirror = points_from_directions("sphere_map", (mirrored @ source.T).astype(np.float32))
    by_normal = (normal @ source.T).astype(np.float32)
    pictures = []
    for at, faded in (
        (normal[:, :2], 1.0),
        (by_normal[:, :2], np.clip(by_normal[:, 2:] / 0.2, 0, 1)),
        (by_mirror, 1.0),
    ):
        lines = (np.abs(np.mod(at * 5, 1) - 0.5) > 0.43).any(axis=-1)[:, None]
        colour = np.where(lines, 0.05, 0.5 + 0.5 * np.concatenate([at, -at[:, :1]], axis=-1))
        pictures.append((faded * colour + (1 - faded) * 0.5).astype(np.float32))
    save_row("warps.png", inside, pictures)


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
    hardware_pictures()
    warp_picture()


def on_pre_build(config: Any) -> None:
    """Hook of mkdocs."""
    draw()


if __name__ == "__main__":
    draw()

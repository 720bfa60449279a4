"""Draws the pictures of the page on prefiltered maps; a hook of mkdocs, and a program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure

from mirrorbake import save_image
from mirrorbake.envmap import EnvMap
from mirrorbake.fresnel import dielectric
from mirrorbake.prefilter import Prefilter, lambert, phong
from mirrorbake.prefilter.backgrounds import background, fisheye, perspective, rotation
from mirrorbake.prefilter.mip_gloss import exponent_for_level
from mirrorbake.prefilter.parabolic import distortion, parabolic_phong
from mirrorbake.prefilter.reflection_space import between_views
from mirrorbake.prefilter.single_pass import CapturedLight
from mirrorbake.prefilter.styles import STYLES, style
from mirrorbake.projection import points_from_directions, texel_directions

if TYPE_CHECKING:
    from numpy.typing import NDArray

FOLDER = Path(__file__).parent / "guide" / "pictures"


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
    figure.savefig(FOLDER / "parabolic_distortion.png")
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


def mip_pictures() -> None:
    """[AEM] figures 3, 5 and 6: gloss by a bias, Phong beside a level, and reflectance."""
    source = light_room()
    cube = source.resample("cube", 64)
    inside, normal, reflected = ball(160)
    view = np.array([0.0, 0.0, 1.0])
    # Figures 3 and 6: rows of reflectance, columns of bias.
    light = CapturedLight.make(cube)
    red = [0.6, 0.25, 0.12]
    rows = [
        [
            light.shade(normal, view, bias=bias, diffuse=red, reflectance=share).astype(np.float32)
            for bias in (0.0, 1.5, 2.25, 3.3)
        ]
        for share in (0.05, 0.15, 0.5)
    ]
    for number, row in enumerate(rows):
        save_row(f"bias_{number}.png", inside, row)
    # Figure 5: Phong with the paper's N = 225, a level with its b = 2.25, and the Phong most like that level.
    levels = cube.mips("box")
    exponent, _ = exponent_for_level(levels, 2.25, 11)
    filtered = Prefilter(cube)
    save_row(
        "bias_and_phong.png",
        inside,
        [
            filtered.sample(phong(225), reflected),
            levels.sample(reflected, filter="trilinear", level=2.25),
            filtered.sample(phong(exponent), reflected),
        ],
    )
    figure = Figure(figsize=(8, 3), dpi=110)
    left, right = figure.subplots(1, 2)
    biases = (1.0, 1.5, 2.0, 2.25, 2.5, 3.0, 3.5, 4.0)
    for filter in ("box", "solid_angle", "seamless"):
        levels = cube.mips(filter)
        found = [exponent_for_level(levels, b, 11) for b in biases]
        left.semilogy(biases, [n for n, _ in found], label=filter)
        right.plot(biases, [100 * e for _, e in found], label=filter)
    left.plot(2.25, 225, "k+", markersize=10, label="[AEM] figure 5")
    left.set_ylabel("N of the Phong lobe most like it")
    right.set_ylabel("what is left, % (relative L2)")
    for axes in (left, right):
        axes.set_xlabel("bias b, of a cube of 64²")
        axes.legend()
    figure.tight_layout()
    figure.savefig(FOLDER / "bias_curve.png")


def view_pictures() -> None:
    """[RSI]: what is lost between the views for which there are maps."""

    def glossy(
        n_v: NDArray[np.float64], n_l: NDArray[np.float64], v_l: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        lobe: NDArray[np.float64] = (
            np.maximum(2 * n_v * n_l - v_l, 0) ** 30 * (0.2 + 0.8 * (1 - n_v) ** 5) / n_l
        )
        return lobe

    source = light_room().resample("latlong", 32)
    figure = Figure(figsize=(5, 3), dpi=110)
    axes = figure.subplots()
    for refinements, count in enumerate((12, 42, 162)):
        curve = between_views(source, glossy, 64, refinements, 4)
        axes.plot(*zip(*curve, strict=True), "o-", label=f"{count} directions")
    axes.set_xlabel("degrees from the nearest direction")
    axes.set_ylabel("PSNR, dB")
    axes.set_ylim(20, 60)  # at the direction itself nothing is lost
    axes.legend()
    figure.tight_layout()
    figure.savefig(FOLDER / "view_curve.png")


def background_pictures() -> None:
    """[WP]: a still, the same while the camera pans and rolls, an Omnimax frame, and chrome."""
    source = light_room()
    camera = perspective(240, 160, 60)
    turned = rotation([0, 1, 0], 30)
    pictures = [
        background(source, camera, turned),
        background(source, camera, turned, rotation([0, 1, 0], 24) @ turned),
        background(source, camera, turned, turned @ rotation([0, 0, 1], 20)),
    ]
    gap = np.ones((160, 4, 3), np.float32)
    dome = background(source, fisheye(160), rotation([1, 0, 0], 50))
    row = [*(part for picture in pictures for part in (picture, gap)), dome]
    whole = np.concatenate(row, axis=1)
    save_image(str(FOLDER / "backgrounds.png"), (whole / (1 + 0.35 * whole)).astype(np.float32))


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
        lines = np.any(np.abs(np.mod(at * 5, 1) - 0.5) > 0.43, axis=-1, keepdims=True)
        colour = np.where(lines, 0.05, 0.5 + 0.5 * np.concatenate([at, -at[:, :1]], axis=-1))
        pictures.append((faded * colour + (1 - faded) * 0.5).astype(np.float32))
    save_row("warps.png", inside, pictures)


def draw() -> None:
    """Write all pictures."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    prefilter_pictures()
    hardware_pictures()
    mip_pictures()
    view_pictures()
    warp_picture()
    background_pictures()


def on_pre_build(config: Any) -> None:
    """Hook of mkdocs."""
    draw()


if __name__ == "__main__":
    draw()

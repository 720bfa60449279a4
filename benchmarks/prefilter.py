"""Prefiltered maps against what others have, all against the sum over all texels in float64.

Peers, in the order of the table:

- that sum itself, in NumPy: its time is that of some texels, times their number;
- filtered importance sampling, what cmgen, Unreal and older three.js do for every texel, in NumPy: 1024
  directions, drawn in proportion to the lobe, each read from the mip level that suits its density (Krivanek
  and Colbert 2008). Its time is that of NumPy; its error is that of the method;
- a cone of texels, what cmft does for a Phong lobe: the sum, cut where the lobe is 1 % of its peak;
- both maps of a cube convolved exactly, beside what a moving light costs for every frame ([AEM]): tracing a
  cube in the furnished room, nine harmonics of 8² texels and levels of it, and shading from both;
- skylibs (PyPI), `EnvironmentMap.blur`: a lobe of von Mises and Fisher;
- three.js (npm), `PMREMGenerator` in headless Chromium, drawn by SwiftShader on the processor. Left out,
  with a message, where there is no Node.js or no Chromium.

Errors are the 99th percentile of the relative error over the texels looked at. The panorama is a sky of
smooth waves and noise with a sun of 1e5 times its radiance: 5e4, which half floats still hold.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import time
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from benchmarks import _three
from benchmarks._report import Case, require, run, seconds
from mirrorbake._core import TraceOptions, Tracer, make_room
from mirrorbake.envmap import EnvMap
from mirrorbake.prefilter import Prefilter, ggx, ggx_chain, irradiance, lambert, phong, prefilter, table
from mirrorbake.prefilter.single_pass import CapturedLight
from mirrorbake.projection import texel_directions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from mirrorbake._core import Lobe

FloatArray = NDArray[np.float64]
HEIGHT, LOOKED_AT, SAMPLES = 1024, 50, 1024


def panorama(height: int = HEIGHT) -> EnvMap:
    d = texel_directions("latlong", 2 * height, height).astype(np.float64)
    noise = np.random.default_rng(0).random((height, 2 * height, 1)) * 0.3
    image = 0.5 + 0.3 * np.sin(5 * d + 1) + noise
    sun = np.array([0.3, 0.6, 0.5]) / np.linalg.norm([0.3, 0.6, 0.5])
    image[d @ sun > np.cos(np.radians(0.4))] = 5e4
    return EnvMap.from_array(image.astype(np.float32), "latlong")


def all_texels(source: EnvMap, weight: Callable[[FloatArray], FloatArray], axes: FloatArray) -> FloatArray:
    """Weighted means about `axes`, texels at their middles, in float64."""
    height = source.layout.height
    latitude = np.pi * (0.5 - (np.arange(height) + 0.5) / height)
    longitude = np.pi * ((np.arange(2 * height) + 0.5) / height - 1)
    lat, lon = np.meshgrid(latitude, longitude, indexing="ij")
    lights = np.stack([np.cos(lat) * np.sin(lon), np.sin(lat), -np.cos(lat) * np.cos(lon)], -1).reshape(-1, 3)
    angle = np.cos(lat).ravel()
    radiance = source.level().reshape(-1, 3).astype(np.float64)
    means = np.empty((len(axes), 3))
    for i, axis in enumerate(axes):
        w = weight((1 - lights @ axis) / 2) * angle
        means[i] = w @ radiance / w.sum()
    return means


def phong_weight(exponent: float) -> Callable[[FloatArray], FloatArray]:
    return lambda h: np.exp(exponent * np.log1p(-2 * np.minimum(h, 0.4999999999))) * (h < 0.5)


def ggx_weight(alpha: float) -> Callable[[FloatArray], FloatArray]:
    a = alpha**2
    return lambda h: np.maximum(1 - 2 * h, 0) * (a / (a + (1 - a) * h)) ** 2


def van_der_corput(count: int) -> FloatArray:
    bits = np.arange(count)[:, None] >> np.arange(32) & 1
    value: FloatArray = (bits * 0.5 ** (np.arange(32) + 1)).sum(1)
    return value


def frames(axes: FloatArray) -> tuple[FloatArray, FloatArray]:
    up = np.where(np.abs(axes[:, 1:2]) < 0.9, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    x = np.cross(up, axes)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return x, np.cross(axes, x)


def sampled(mips: EnvMap, alpha: float, axes: FloatArray) -> FloatArray:
    u = (np.arange(SAMPLES) + 0.5) / SAMPLES
    cos_h = np.sqrt((1 - u) / (1 + (alpha**2 - 1) * u))
    turn = 2 * np.pi * van_der_corput(SAMPLES)
    cosine = 2 * cos_h**2 - 1
    sine = np.sqrt(1 - cosine**2)
    density = alpha**2 / (np.pi * ((alpha**2 - 1) * cos_h**2 + 1) ** 2) / 4
    width = 2 * np.sqrt(1 / (SAMPLES * density))  # twice the side of a sample's share, as Krivanek has it
    weight = np.maximum(cosine, 0)
    x, y = frames(axes)
    local = np.stack([sine * np.cos(turn), sine * np.sin(turn), cosine], axis=-1)
    result = np.empty((len(axes), 3))
    for i in range(len(axes)):
        d = local @ np.stack([x[i], y[i], axes[i]])
        xs, ys = frames(d)
        values = mips.sample(d, xs * width[:, None], ys * width[:, None], filter="trilinear")
        result[i] = (weight[:, None] * values).sum(0) / weight.sum()
    return result


def percentile(values: NDArray[np.floating], expected: FloatArray) -> float:
    return float(np.percentile(np.abs(values / expected - 1), 99))


def cases() -> Iterator[Case]:
    source = panorama()
    rng = np.random.default_rng(1)

    def texels_of(size: int) -> tuple[FloatArray, NDArray[np.int64]]:
        faces = [texel_directions("cube", size, size, face).reshape(-1, 3) for face in range(6)]
        picked = rng.choice(6 * size * size, min(LOOKED_AT, 6 * size * size), replace=False)
        return np.concatenate(faces)[picked].astype(np.float64), picked

    for name, lobe, weight, size in lobes():
        axes, picked = texels_of(size)
        start = time.perf_counter()
        expected = all_texels(source, weight, axes)
        brute = (time.perf_counter() - start) * 6 * size * size / len(axes)
        ours = partial(Prefilter(source).apply, lobe, size)
        error = np.abs(ours().level().reshape(-1, 3)[picked] / expected - 1)
        require(float(np.median(error)) <= 1e-3, f"{name}: median error {np.median(error)}")
        require(float(np.percentile(error, 99)) <= 1e-2, f"{name}: p99 {np.percentile(error, 99)}")
        fresh = seconds(lambda lobe=lobe, size=size: Prefilter(source).apply(lobe, size), 1)  # type: ignore[misc]
        yield Case(
            f"{name} into {size}²", "ms", 1e3 * fresh, 1e3 * brute,
            "NumPy, all texels in float64", float(np.percentile(error, 99)), 0.0,
        )  # fmt: skip
    mips = source.mips()
    kept = Prefilter(source)
    for alpha in (0.1, 0.5):
        axes, _ = texels_of(16)
        expected = all_texels(source, ggx_weight(alpha), axes)
        start = time.perf_counter()
        theirs = sampled(mips, alpha, axes)
        peer = (time.perf_counter() - start) / LOOKED_AT
        mine = kept.sample(ggx(alpha), axes.astype(np.float32))
        each = seconds(partial(kept.apply, ggx(alpha), 16), 1) / (6 * 16 * 16)
        yield Case(
            f"GGX α = {alpha}, a texel", "ms", 1e3 * each, 1e3 * peer, f"{SAMPLES} filtered samples",
            percentile(mine, expected), percentile(theirs, expected),
        )  # fmt: skip
    axes, _ = texels_of(16)
    expected = all_texels(source, phong_weight(50), axes)
    start = time.perf_counter()
    theirs = all_texels(source, lambda h: phong_weight(50)(h) * (1 - 2 * h > 0.01 ** (1 / 50)), axes)
    peer = (time.perf_counter() - start) / LOOKED_AT
    mine = kept.sample(phong(50), axes.astype(np.float32))
    each = seconds(partial(kept.apply, phong(50), 16), 1) / (6 * 16 * 16)
    yield Case(
        "Phong 50, a texel", "ms", 1e3 * each, 1e3 * peer, "a cone of texels, NumPy",
        percentile(mine, expected), percentile(theirs, expected),
    )  # fmt: skip
    yield from single_pass()
    yield blurred()
    yield from of_three_js()
    whole = seconds(lambda: ggx_chain(source, 256, 8), 1)
    yield Case("GGX chain 256², 8 levels", "ms", 1e3 * whole, 1e3, "what it may take", 0.0, 0.0)


def single_pass() -> Iterator[Case]:
    """What a light that moves costs for every frame, against both maps convolved exactly."""
    room = make_room()
    start = time.perf_counter()
    tracer = Tracer(room)
    built = time.perf_counter() - start
    normals = np.random.default_rng(3).normal(size=(128 * 128, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    view = np.array([0.0, 0.0, 1.0])
    for size in (8, 64):
        capture = partial(tracer.capture_cube, [0, 0.2, 0], size, options=TraceOptions(samples_per_pixel=4))
        cube = EnvMap.from_array(capture(), "cube")
        light = CapturedLight.make(cube)
        exact = Prefilter(cube).sample(lambert(), normals, scale="sum")
        error = percentile(light.irradiance.sample(normals), exact.astype(np.float64))
        both = seconds(lambda cube=cube: (irradiance(cube, 16), prefilter(cube, phong(225), 64)), 1)  # type: ignore[misc]
        yield Case(
            f"filter a cube of {size}²", "ms", 1e3 * seconds(partial(CapturedLight.make, cube)), 1e3 * both,
            "B1 and Phong 225 exactly", error, 0.0,
        )  # fmt: skip
        traced = seconds(capture, 1)
        yield Case(f"trace a cube of {size}²", "ms", 1e3 * traced, 1e3 * built, "scene made ready", 0.0, 0.0)
        shaded = seconds(partial(light.shade, normals, view, bias=2.25), 1)
        yield Case("shade 128² pixels", "ms", 1e3 * shaded, 1e3 * traced, "their cube", 0.0, 0.0)


def blurred() -> Case:
    """A lobe of von Mises and Fisher over a small map, as skylibs blurs it."""
    kappa, source = 40.0, panorama(32)
    other = importlib.import_module("envmap").EnvironmentMap(source.level().astype(np.float64), "latlong")
    start = time.perf_counter()
    with contextlib.redirect_stderr(io.StringIO()):  # its progress bar
        theirs = other.blur(kappa).data
    peer = time.perf_counter() - start
    lobe = table(np.exp(kappa * (np.cos(np.linspace(0, np.pi, 721)) - 1)))
    directions = texel_directions("latlong", 64, 32).reshape(-1, 3)
    expected = all_texels(source, lambda h: np.exp(-2 * kappa * h), directions.astype(np.float64))
    time_of_ours = seconds(lambda: Prefilter(source).apply(lobe, 32, "latlong"))
    mine = Prefilter(source).apply(lobe, 32, "latlong").level().reshape(-1, 3)
    return Case(
        "von Mises and Fisher, 64 × 32", "ms", 1e3 * time_of_ours, 1e3 * peer, "skylibs, blur",
        percentile(mine, expected), percentile(theirs.reshape(-1, 3), expected),
    )  # fmt: skip


def of_three_js() -> Iterator[Case]:
    """A chain of three.js and, of some of its levels, the errors beside ours for the same α."""
    source = panorama(512)
    axes = np.random.default_rng(2).normal(size=(LOOKED_AT, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    made = _three.pmrem(source.level(), axes, [1, 2, 3, 4])
    if made is None:
        return
    ours = Prefilter(source)
    name = f"three.js, PMREM {made.size}²"
    time_of_ours = seconds(lambda: ggx_chain(source, made.size, made.levels), 1)
    yield Case(
        f"GGX chain {made.size}², {made.levels} levels", "ms", 1e3 * time_of_ours, made.milliseconds,
        name + ", SwiftShader", 0.0, 0.0,
    )  # fmt: skip
    for level, (roughness, values) in enumerate(made.found, 1):
        alpha = roughness**2
        expected = all_texels(source, ggx_weight(alpha), axes)
        size = made.size >> level
        each = seconds(partial(ours.apply, ggx(alpha), size), 1) / (6 * size * size)
        mine = ours.sample(ggx(alpha), axes.astype(np.float32))
        texels = sum(6 * (made.size >> level) ** 2 for level in range(made.levels))
        yield Case(
            f"GGX α = {alpha:.3g}, a texel", "ms", 1e3 * each, made.milliseconds / texels, name,
            percentile(mine, expected), percentile(values, expected),
        )  # fmt: skip


def lobes() -> list[tuple[str, Lobe, Callable[[FloatArray], FloatArray], int]]:
    return [
        ("irradiance", lambert(), phong_weight(1), 16),
        *((f"Phong {n:g}", phong(n), phong_weight(n), 128) for n in (10, 128, 1e4)),
        *((f"GGX α = {a}", ggx(a), ggx_weight(a), 128) for a in (0.02, 0.1, 0.5)),
        ("GGX α = 1", ggx(1.0), ggx_weight(1), 16),
    ]


if __name__ == "__main__":
    run("Prefiltered environment maps.", cases)

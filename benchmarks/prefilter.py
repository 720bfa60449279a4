"""Prefiltered maps against filtered importance sampling, both against the sum over all texels in float64.

The peer is what cmgen, three.js and Unreal do for every texel, in NumPy: 1024 directions, drawn in proportion
to the lobe, each read from the mip level that suits its density (Krivanek and Colbert 2008). Its time is that
of NumPy; its error is that of the method. Errors are the 99th percentile of the relative error over the
texels looked at. The panorama is a sky of smooth waves and noise with a sun of 1e5 times its radiance,
2048 × 1024. The time of the sum over all texels is that of a few of them, times their number.
"""

from __future__ import annotations

import time
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from benchmarks._report import Case, require, run, seconds
from mirrorbake.envmap import EnvMap
from mirrorbake.prefilter import Prefilter, ggx, ggx_chain, lambert, phong
from mirrorbake.projection import texel_directions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from mirrorbake._core import Lobe

FloatArray = NDArray[np.float64]
HEIGHT, LOOKED_AT, SAMPLES = 1024, 50, 1024


def panorama() -> EnvMap:
    d = texel_directions("latlong", 2 * HEIGHT, HEIGHT).astype(np.float64)
    noise = np.random.default_rng(0).random((HEIGHT, 2 * HEIGHT, 1)) * 0.3
    image = 0.5 + 0.3 * np.sin(5 * d + 1) + noise
    sun = np.array([0.3, 0.6, 0.5]) / np.linalg.norm([0.3, 0.6, 0.5])
    image[d @ sun > np.cos(np.radians(0.4))] = 1e5
    return EnvMap.from_array(image.astype(np.float32), "latlong")


def all_texels(source: EnvMap, weight: Callable[[FloatArray], FloatArray], axes: FloatArray) -> FloatArray:
    """Weighted means about `axes`, texels at their middles, in float64."""
    latitude = np.pi * (0.5 - (np.arange(HEIGHT) + 0.5) / HEIGHT)
    longitude = np.pi * ((np.arange(2 * HEIGHT) + 0.5) / HEIGHT - 1)
    lat, lon = np.meshgrid(latitude, longitude, indexing="ij")
    lights = np.stack([np.cos(lat) * np.sin(lon), np.sin(lat), -np.cos(lat) * np.cos(lon)], -1).reshape(-1, 3)
    angle = np.cos(lat).ravel()
    radiance = source.level().reshape(-1, 3).astype(np.float64)
    means = np.empty((len(axes), 3))
    for i, axis in enumerate(axes):
        w = weight(((axis - lights) ** 2).sum(1) / 4) * angle  # by (1 − cos γ)/2
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
    for name, lobe, weight, size in lobes():
        directions = np.concatenate(
            [texel_directions("cube", size, size, face).reshape(-1, 3) for face in range(6)]
        )
        picked = rng.choice(len(directions), LOOKED_AT, replace=False)
        axes = directions[picked].astype(np.float64)
        start = time.perf_counter()
        expected = all_texels(source, weight, axes)
        brute = (time.perf_counter() - start) * len(directions) / LOOKED_AT

        def ours(lobe: Lobe = lobe, size: int = size) -> EnvMap:
            return Prefilter(source).apply(lobe, size)

        error = np.abs(ours().level().reshape(-1, 3)[picked] / expected - 1)
        require(float(np.median(error)) <= 1e-3, f"{name}: median error {np.median(error)}")
        require(float(np.percentile(error, 99)) <= 1e-2, f"{name}: p99 {np.percentile(error, 99)}")
        yield Case(
            f"{name} into {size}²", "ms", 1e3 * seconds(ours, 1), 1e3 * brute,
            "NumPy, all texels in float64", float(np.percentile(error, 99)), 0.0,
        )  # fmt: skip
    mips = source.mips()
    for alpha in (0.1, 0.5):
        directions = np.concatenate(
            [texel_directions("cube", 16, 16, face).reshape(-1, 3) for face in range(6)]
        )
        axes = directions[rng.choice(len(directions), LOOKED_AT, replace=False)].astype(np.float64)
        expected = all_texels(source, ggx_weight(alpha), axes)
        start = time.perf_counter()
        theirs = sampled(mips, alpha, axes)
        peer = (time.perf_counter() - start) / LOOKED_AT
        kept = Prefilter(source)
        one_lobe = partial(kept.apply, ggx(alpha), 16)
        mine = kept.sample(ggx(alpha), axes.astype(np.float32))
        yield Case(
            case=f"GGX α = {alpha}, a texel",
            unit="ms",
            ours=1e3 / len(directions) * seconds(one_lobe, 1),
            peer=1e3 * peer,
            peer_name=f"{SAMPLES} filtered samples",
            error_ours=percentile(mine, expected),
            error_peer=percentile(theirs, expected),
        )
    whole = seconds(lambda: ggx_chain(source, 256, 8), 1)
    yield Case("GGX chain 256², 8 levels", "ms", 1e3 * whole, 1e3, "what it may take", 0.0, 0.0)


def lobes() -> list[tuple[str, Lobe, Callable[[FloatArray], FloatArray], int]]:
    return [
        ("irradiance", lambert(), phong_weight(1), 16),
        *((f"Phong {n:g}", phong(n), phong_weight(n), 128) for n in (10, 128, 1e4)),
        *((f"GGX α = {a}", ggx(a), ggx_weight(a), 128) for a in (0.02, 0.1, 0.5)),
    ]


if __name__ == "__main__":
    run("Prefiltered environment maps.", cases)

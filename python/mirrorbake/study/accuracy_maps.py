"""How exact the functions of maps, harmonics, lobes and metals are; rows of the page on accuracy."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import fresnel, prefilter, projection
from mirrorbake.envmap import EnvMap
from mirrorbake.prefilter import Harmonics
from mirrorbake.prefilter.backgrounds import background, fisheye, perspective, rotation
from mirrorbake.prefilter.parabolic import distortion, parabolic_phong
from mirrorbake.study.accuracy_row import Accuracy

if TYPE_CHECKING:
    from numpy.typing import NDArray

    DoubleArray = NDArray[np.float64]

GREY = 0.375
COSINES = np.linspace(0.0, 1.0, 2001)


def accuracy_of_maps() -> list[Accuracy]:
    """Measure what maps, harmonics, lobes and metals give."""
    return [
        *_reflectance(),
        *_metals(),
        *_projections(),
        *_maps(),
        *_lobes(),
        *_harmonics(),
        *_pictures(),
    ]


def _worst(a: object, b: object) -> float:
    return float(np.max(np.abs(np.asarray(a, float) - np.asarray(b, float))))


def _reflectance() -> list[Accuracy]:
    transmitted = tabled = 0.0
    for index in (1.01, 1.33, 1.5, 2.4, 10.0):
        inner = np.sqrt(1.0 - (1.0 - COSINES**2) / index**2)
        product = 4.0 * index * COSINES * inner
        exact = 0.5 * product * (1.0 / (COSINES + index * inner) ** 2 + 1.0 / (index * COSINES + inner) ** 2)
        found = fresnel.dielectric_transmittance(COSINES, index)
        transmitted = max(transmitted, _worst(found[1:] / exact[1:], 1.0))
        model = fresnel.Dielectric(index)
        table = fresnel.make_table(model, 65)
        tabled = max(tabled, _worst(table.values, model(np.linspace(0.0, 1.0, 65))))
    schlick = fresnel.schlick(COSINES, 0.04)
    exact = 0.04 + 0.96 * (1.0 - COSINES) ** 5
    return [
        Accuracy(
            "`fresnel.dielectric_transmittance`", "c above 0, n 1.01…10", "closed form without cancellation",
            "relative", transmitted, 1e-14,
        ),
        Accuracy("`fresnel.make_table`", "entries, n 1.01…10", "the model", "", tabled, 1e-7),
        Accuracy("`fresnel.schlick` float64", "c 0…1", "closed form", "", _worst(schlick, exact), 1e-15),
    ]  # fmt: skip


def _metals() -> list[Accuracy]:
    grazing = promised = fitted = approximated = 0.0
    for metal in fresnel.metal_names():
        colour = fresnel.metal_colour(metal)
        spectrum = fresnel.metal_reflectance(metal, COSINES)
        grazing = max(grazing, _worst(spectrum[0], 1.0))
        for channel in range(3):
            curve = spectrum[:, channel]
            models = (
                (fresnel.conductor(COSINES, colour.eta[channel], colour.k[channel]), colour.index_error),
                (fresnel.schlick(COSINES, colour.r0[channel]), colour.r0_error),
            )
            errors = [_worst(values, curve) for values, _ in models]
            fitted, approximated = max(fitted, errors[0]), max(approximated, errors[1])
            promised = max(
                promised, *(e - said[channel] for e, (_, said) in zip(errors, models, strict=True))
            )
    every = "every metal, c 0…1"
    return [
        Accuracy("`fresnel.metal_reflectance`", "every metal, grazing", "1", "", grazing, 1e-12),
        Accuracy("`fresnel.metal_colour`, effective index", every, "the spectrum's", "", fitted, 0.04),
        Accuracy("`fresnel.metal_colour`, Schlick", every, "the spectrum's", "", approximated, 0.18),
        Accuracy("`fresnel.metal_colour`, errors it names", every, "measured", "more", promised, 1e-3),
    ]


def _projections() -> list[Accuracy]:
    # The density times the area of small texels, beside their solid angles.
    density = 0.0
    size = 256
    for name in ("cube", "dual_paraboloid", "latlong", "angular", "sphere_map"):
        width = 2 * size if name == "latlong" else size
        angles = np.asarray(projection.texel_solid_angles(name, width, size))
        for row, column in ((128, 128), (100, 140), (90, 60), (150, 200)):
            x, y = (2.0 * column + 1.0) / width - 1.0, 1.0 - (2.0 * row + 1.0) / size
            area = (2.0 / width) * (2.0 / size)
            found = projection.solid_angle_density(name, 0, x, y) * area
            density = max(density, abs(found / angles[row, column] - 1.0))
    directions = np.random.default_rng(21).normal(size=(2000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    matrices = [projection.dual_paraboloid_texture_matrix(np.eye(3), face).astype(float) for face in (0, 1)]
    faces, points = projection.points_from_directions("dual_paraboloid", directions.astype(np.float32))
    placed = np.einsum("nij,nj->ni", np.stack(matrices)[faces], np.c_[directions, np.ones(2000)])
    texture = placed[:, :2] / placed[:, 3:]
    wanted = np.stack([0.5 + 0.5 * points[:, 0], 0.5 - 0.5 * points[:, 1]], axis=-1)
    off = 0.0
    for face in range(6):
        centres = projection.texel_directions("cube", 64, 64, face)
        on, at = projection.points_from_directions("cube", centres)
        place = (2.0 * np.arange(64) + 1.0) / 64 - 1.0
        off = max(off, 64.0 if np.any(on != face) else 32.0 * _worst(at[..., 0], place[None]))
    return [
        Accuracy(
            "`solid_angle_density`", "every projection, 256² texels", "`texel_solid_angles`", "relative",
            density, 1e-4,
        ),
        Accuracy(
            "`dual_paraboloid_texture_matrix`", "all directions", "the projection", "of a face",
            _worst(texture, wanted), 1e-6,
        ),
        Accuracy("`texel_directions`", "cube, 64²×6", "texels' middles", "texels", off, 1e-4),
    ]  # fmt: skip


def _sky(size: int = 32) -> tuple[EnvMap, DoubleArray]:
    """Smooth light of bands 0 to 2, and its coefficients' meaning: `1 + 0.5 y + 0.25 x z`."""
    d = np.stack([projection.texel_directions("cube", size, size, face) for face in range(6)]).astype(float)
    light = _bands(d)
    return EnvMap.from_array(light[..., None].astype(np.float32), "cube"), d


def _bands(d: DoubleArray, factors: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> DoubleArray:
    result: DoubleArray = (
        factors[0] + 0.5 * factors[1] * d[..., 1] + 0.25 * factors[2] * d[..., 0] * d[..., 2]
    )
    return result


def _maps() -> list[Accuracy]:
    sky, directions = _sky()
    flat = EnvMap.from_array(np.full((6, 16, 16, 1), GREY, np.float32), "cube")
    wide = sky.with_border(4)
    inner = _worst(wide[:, 4:-4, 4:-4], sky.level())
    # Beyond an edge a face's border goes on as the light does: to the slope of half a texel.
    place = 2.0 * (np.arange(-4, 36) + 0.5) / 32 - 1.0
    border = 0.0
    for face in range(6):
        points = np.stack(np.meshgrid(place, -place), axis=-1).astype(np.float32)
        true = _bands(projection.directions_from_points("cube", face, points).astype(float))
        sides = np.zeros((40, 40), bool)
        sides[4:-4, :4] = sides[4:-4, -4:] = sides[:4, 4:-4] = sides[-4:, 4:-4] = True
        border = max(border, _worst(wide[face, ..., 0][sides], true[sides]))
    there = 0.0
    colours = EnvMap.from_array(np.random.default_rng(22).random((32, 64, 3), np.float32), "latlong")
    # The poles of oiio lie elsewhere: its maps are resampled.
    for name in ("openexr", "mitsuba", "threejs"):
        there = max(there, _worst(colours.to_convention(name).from_convention(name).values, colours.values))
    there = max(there, _worst(sky.to_convention("ktx2").from_convention("ktx2").values, sky.values))
    shifted = EnvMap.from_array(sky.level() + np.float32(0.125), "cube")
    compared = shifted.compare(sky)
    resampler = sky.resample("dual_paraboloid", 64, filter="bilinear")
    d = np.stack([projection.texel_directions("dual_paraboloid", 64, 64, face) for face in range(2)])
    inside = np.asarray(projection.texel_solid_angles("dual_paraboloid", 64, 64)) > 0.0
    moved = _worst(resampler.level()[:, inside][..., 0], _bands(d.astype(float))[:, inside])
    mips = sky.mips()
    few = directions[:, ::7, ::5].reshape(-1, 3).astype(np.float32)
    spread = np.cross(few, [0.3, 0.5, 0.8]) * 0.05
    other = np.cross(few, spread)
    ellipse = mips.sample(few, spread, other, filter="ewa")[..., 0]
    return [
        Accuracy("`EnvMap.with_border`, inside", "bands 0…2, 32²×6", "the map", "", inner, 0.0),
        Accuracy("`EnvMap.with_border`, border", "bands 0…2, 32²×6", "the light", "", border, 0.02),
        Accuracy("`EnvMap.seam`", "a grey map", "0", "", max(flat.seam()), 0.0),
        Accuracy("`EnvMap.to_convention`", "all but oiio, noise", "and back", "", there, 0.0),
        Accuracy(
            "`EnvMap.compare`", "0.125 more", "0.125", "",
            max(abs(compared.mean_error - 0.125), abs(compared.rms_error - 0.125)), 1e-6,
        ),
        Accuracy("`EnvMap.resample`, bilinear", "bands 0…2, 32²×6", "the light", "", moved, 0.01),
        Accuracy(
            "`EnvMap.sample`, EWA", "bands 0…2, ellipses of 3°", "the light", "",
            _worst(ellipse, _bands(few.astype(float))), 0.02,
        ),
    ]  # fmt: skip


def _lobes() -> list[Accuracy]:
    sky, _ = _sky()
    d = np.stack([projection.texel_directions("cube", 8, 8, face) for face in range(6)]).astype(float)
    # Funk and Hecke: bands of light come back by the lobe's own factors (π, 2π/3, π/4 of a cosine).
    wanted = _bands(d, (math.pi, 2.0 * math.pi / 3.0, math.pi / 4.0))
    lit = prefilter.irradiance(sky, 8).level()[..., 0]
    weights = np.cos(np.minimum(np.radians(np.linspace(0.0, 180.0, 721)), math.pi / 2.0))
    own = prefilter.prefilter(sky, prefilter.table(weights), 8, scale="sum").level()[..., 0]
    chain = prefilter.ggx_chain(sky, 16, 4)
    alphas = prefilter.chain_alphas(4)
    alone = prefilter.prefilter(sky, prefilter.ggx(float(alphas[2])), 4).level()
    integral = 0.0
    for lobe, exact in (
        (prefilter.lambert(), math.pi),
        (prefilter.phong(1.0), math.pi),
        (prefilter.phong(50.0), 2.0 * math.pi / 51.0),
    ):
        integral = max(integral, abs(lobe.integral / exact - 1.0))
    table = prefilter.split_sum_table(8)
    parts = 0.0
    for row in range(8):
        for column in range(8):
            alpha = max(((row + 0.5) / 8.0) ** 2, 1e-4)
            scale, bias = prefilter.split_sum((column + 0.5) / 8.0, alpha)
            parts = max(parts, _worst(table[row, column], (scale, bias, scale + bias)))
    return [
        Accuracy(
            "`prefilter.irradiance`", "bands 0…2, 32²×6", "Funk and Hecke", "", _worst(lit, wanted), 4e-3
        ),
        Accuracy(
            "`prefilter.table`", "a cosine of 721 weights", "Funk and Hecke", "relative",
            _worst(own / wanted, 1.0), 0.02,
        ),
        Accuracy(
            "`prefilter.ggx_chain`", "third of 4 levels", "`prefilter.prefilter`", "",
            _worst(chain.level(2), alone), 1e-5,
        ),
        Accuracy(
            "`prefilter.chain_alphas`", "10 levels", "(level/9)²", "",
            _worst(prefilter.chain_alphas(10)[1:], np.maximum((np.arange(1, 10) / 9.0) ** 2, 0.01)), 1e-7,
        ),
        Accuracy("`Lobe.integral`", "cosine, Phong 1 and 50", "closed form", "relative", integral, 1e-9),
        Accuracy("`prefilter.split_sum_table`", "8×8 entries", "`split_sum`", "", parts, 2e-3),
    ]  # fmt: skip


def _harmonics() -> list[Accuracy]:
    # Fine texels, since a sum over their middles stands for the integral.
    sky, _ = _sky(128)
    light = Harmonics.project(sky, 2)
    y0, y1, y2 = math.sqrt(4.0 * math.pi), math.sqrt(4.0 * math.pi / 3.0), math.sqrt(4.0 * math.pi / 15.0)
    known = np.zeros(9)
    known[0], known[1], known[7] = y0, 0.5 * y1, 0.25 * y2
    d = np.random.default_rng(23).normal(size=(500, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    exact = Harmonics.from_array(known[:, None])
    sums = _worst(exact.sample(d)[:, 0], _bands(d))
    drawn = exact.evaluate(16).level()[..., 0]
    middles = np.stack([projection.texel_directions("cube", 16, 16, face) for face in range(6)]).astype(float)
    lambert = (math.pi, 2.0 * math.pi / 3.0, math.pi / 4.0)
    lit = _worst(exact.irradiance().sample(d)[:, 0], _bands(d, lambert))
    hanning = [0.5 * (1.0 + math.cos(math.pi * band / 3.0)) for band in range(3)]
    kept = exact.windowed("hanning").coefficients[:, 0]
    bands = np.array([0, 1, 1, 1, 2, 2, 2, 2, 2])
    window = _worst(kept, known * np.array(hanning)[bands])
    # Sloan's leaves nothing below 0, where the sums are.
    sharp = Harmonics.from_array(np.array([[0.3], [1.0], [0.0], [0.4], [0.0], [0.0], [0.8], [0.0], [0.3]]))
    below = max(0.0, -float(sharp.windowed("sloan").sample(d, negative="keep").min()))
    c = exact.shader_constants()[:, 0]
    x, y, z = d.T
    basis = np.stack(
        [np.ones_like(x), y, z, x, y * x, y * z, 3.0 * z * z - 1.0, z * x, x * x - y * y], axis=-1
    )
    shader = _worst(basis @ c, _bands(d, lambert) / math.pi)
    closed = "closed form"
    return [
        Accuracy(
            "`Harmonics.project`", "bands 0…2, 128²×6", closed, "",
            _worst(light.coefficients[:, 0], known), 1e-3,
        ),
        Accuracy("`Harmonics.sample`", "bands 0…2", closed, "", sums, 1e-6),
        Accuracy("`Harmonics.evaluate`", "bands 0…2", closed, "", _worst(drawn, _bands(middles)), 1e-6),
        Accuracy("`Harmonics.irradiance`", "bands 0…2", closed, "", lit, 1e-6),
        Accuracy("`Harmonics.windowed`, Hann's", "bands 0…2", closed, "", window, 1e-12),
        Accuracy("`Harmonics.windowed`, Sloan's", "light below 0", "what stays below 0", "", below, 1e-3),
        Accuracy("`Harmonics.shader_constants`", "bands 0…2, as a shader sums", closed, "", shader, 1e-6),
    ]  # fmt: skip


def _pictures() -> list[Accuracy]:
    sky, _ = _sky(64)
    flat = perspective(33, 25, 60.0)
    step = math.tan(math.radians(30.0)) / 12.5
    place = np.stack(np.meshgrid((np.arange(33) - 16.0) * step, (12.0 - np.arange(25)) * step), axis=-1)
    pinhole = _worst(flat[..., :2] / -flat[..., 2:], place)
    round_lens = fisheye(65)
    radius = np.hypot(*np.meshgrid((np.arange(65) - 32.0) / 32.5, (np.arange(65) - 32.0) / 32.5))
    angle = np.arccos(np.clip(-round_lens[..., 2], -1.0, 1.0))
    seen = np.isfinite(angle)
    bent = _worst(angle[seen], radius[seen] * math.pi / 2.0)
    turn = rotation([0.0, 1.0, 0.0], 30.0)
    shown = background(sky, flat, turn)[..., 0]
    unit = flat / np.linalg.norm(flat, axis=-1, keepdims=True)
    turned = _worst(shown, _bands(unit @ turn.T))
    axis = np.array([1.0, 2.0, -0.5])
    matrix = rotation(axis, 77.0)
    kept = max(_worst(matrix @ matrix.T, np.eye(3)), _worst(matrix @ axis, axis))
    # Half a face about a centre half a face out: tangents of half the angles (stereographic projection).
    nearest, farthest = 2.0 * math.atan(0.25), 2.0 * math.atan(0.75)
    middle = 2.0 * math.atan(0.5)
    uneven = abs((middle - nearest) - (farthest - middle)) / (farthest - nearest)
    exact = prefilter.prefilter(sky, prefilter.phong(20.0), 32, "dual_paraboloid").level()
    approximate = parabolic_phong(sky, 20.0, 32).level()
    inside = np.asarray(projection.texel_solid_angles("dual_paraboloid", 32, 32)) > 0.0
    filtered = _worst((approximate / np.maximum(exact, 1e-9))[:, inside], 1.0)
    return [
        Accuracy("`perspective`", "60°", "tangents", "", pinhole, 1e-9),
        Accuracy("`fisheye`", "180°", "equidistant angles", "rad", bent, 1e-9),
        Accuracy("`rotation`", "77° about a slanting axis", "orthonormal, axis kept", "", kept, 1e-14),
        Accuracy("`background`", "bands 0…2, turned by 30°", "the light", "", turned, 5e-3),
        Accuracy(
            "`distortion`", "a quarter, half a face out", "closed form", "",
            abs(distortion(0.25, 0.5) - uneven), 1e-12,
        ),
        Accuracy(
            "`parabolic_phong`", "N = 20, bands 0…2", "`prefilter.prefilter`", "relative", filtered, 0.05
        ),
    ]  # fmt: skip

"""How exact the functions of light, shapes and matrices are; rows of the page on accuracy."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

import mirrorbake as mb
from mirrorbake import _core, proxy
from mirrorbake.envmap import EnvMap
from mirrorbake.study.accuracy_row import Accuracy
from mirrorbake.tone import srgb_bytes, srgb_encoded, tone_map

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

    DoubleArray = NDArray[np.float64]

GREY = 0.375
"""A sky that every integral of it is known for."""


def accuracy_of_light() -> list[Accuracy]:
    """Measure fitted shapes, reads of maps, harmonics, tones, tracing and matrices."""
    return [*_shapes(), *_reads(), *_harmonics(), *_tones(), *_tracing(), *_matrices()]


def _worst(a: object, b: object) -> float:
    return float(np.max(np.abs(np.asarray(a, float) - np.asarray(b, float))))


def _shapes() -> list[Accuracy]:
    random = np.random.default_rng(11)
    around = 0.0
    walls = {"robust": 0.0, "mean": 0.0}
    corners = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T / math.sqrt(3.0)
    for flat in (1.0, 0.1, 0.001):
        radii = np.array([1.0, flat, 2.0])
        # The ends of its axes and eight more of its points leave no smaller ellipsoid about the same centre.
        points = (np.concatenate([np.eye(3), -np.eye(3), corners]) * radii).astype(np.float32)
        found = proxy.fit_ellipsoid(points, (0.0, 0.0, 0.0))
        around = max(around, _worst(np.asarray(found.radii) / radii, 1.0))
    for flat in (1.0, 0.3, 0.1, 0.03, 0.001):
        half = np.array([3.0, 3.0 * flat, 2.0])
        hits = random.uniform(-1.0, 1.0, (3000, 3))
        side = np.arange(3000) % 6
        hits[np.arange(3000), side // 2] = np.where(side % 2, 1.0, -1.0)
        hits = (hits * half).astype(np.float32)
        robust = proxy.fit_box_robust(hits, (0.0, 0.0, 0.0))
        walls["robust"] = max(walls["robust"], _worst(np.asarray(robust.half_extent) / half, 1.0))
        if flat < 0.1:  # before its far walls most hits are on floor and ceiling, which draw the means in
            continue
        mean = proxy.fit_box_mean_distance(hits, (0.0, 0.0, 0.0), -half[1])
        walls["mean"] = max(walls["mean"], _worst(np.asarray(mean.half_extent)[[0, 2]] / half[[0, 2]], 1.0))
    ball = _core.make_sphere((100.0, -50.0, 7.0), 1.0, 64)
    centre = proxy.area_weighted_centroid(ball.positions, ball.triangles)
    inside = random.normal(size=(200, 3))
    inside *= 0.9 / np.linalg.norm(inside, axis=1, keepdims=True) * random.random((200, 1))
    middle = np.array([100.0, -50.0, 7.0])
    winding = max(abs(_core.winding_number(ball, (middle + p).tolist()) - 1.0) for p in inside)
    flat_to, sides, wide = "radii 1:1 to 1:1000", "sides 1:1 to 1:10", "sides 1:1 to 1:1000"
    return [
        Accuracy("`proxy.fit_ellipsoid`", flat_to, "the ellipsoid", "relative", around, 1e-5),
        Accuracy("`proxy.fit_box_robust`", wide, "the box", "relative", walls["robust"], 1e-4),
        Accuracy("`proxy.fit_box_mean_distance`", sides, "the box", "relative", walls["mean"], 0.2),
        Accuracy(
            "`proxy.area_weighted_centroid`", "a ball 110 radii away", "its centre", "radii",
            _worst(centre, middle), 1e-5,
        ),
        Accuracy("`winding_number`", "within a ball", "1", "", winding, 1e-6),
        _mirrored(random),
    ]  # fmt: skip


def _mirrored(random: np.random.Generator) -> Accuracy:
    box = proxy.Proxy.box((0, 0, 0), (3, 2, 4), (0, 0.5, 0))
    position = random.uniform(-1.0, 1.0, (2000, 3)).astype(np.float32)
    normal = random.normal(size=(2000, 3))
    normal = (normal / np.linalg.norm(normal, axis=1, keepdims=True)).astype(np.float32)
    eye = np.array([0.0, 1.0, 2.0])
    (found,) = proxy.mirror_lookups([box], eye.tolist(), position, normal)
    view = position - eye
    n = normal.astype(float)
    mirrored = view - 2.0 * np.sum(n * view, axis=1, keepdims=True) * n
    exact = np.asarray(box.lookup_float64(position.astype(float), mirrored))
    return Accuracy(
        "`proxy.mirror_lookups`", "a box, all normals", "float64", "rad", _angle(found, exact), 1e-6
    )


def _angle(a: object, b: object) -> float:
    x, y = np.asarray(a, float), np.asarray(b, float)
    return float(np.max(np.arctan2(np.linalg.norm(np.cross(x, y), axis=1), np.sum(x * y, axis=1))))


def _grid(size: int) -> tuple[DoubleArray, DoubleArray]:
    """Places across and up a face, of the middles of its texels."""
    place = 2.0 * (np.arange(size) + 0.5) / size - 1.0
    x, y = np.meshgrid(place, -place)
    return x, y


def _reads() -> list[Accuracy]:
    random = np.random.default_rng(12)
    x, y = _grid(32)
    # Light that is linear across a face is what bilinear reads give back, away from the edges.
    face = np.stack([1.0 + 0.5 * x, 2.0 - 0.25 * y, 1.0 + x * 0.3 + y * 0.2], axis=-1).astype(np.float32)
    linear = EnvMap.from_array(np.stack([face] * 6), "cube")
    s, t = random.uniform(-0.95, 0.95, (2, 5000))
    faces = np.zeros(5000, np.int32)
    points = np.stack([s, t], axis=-1).astype(np.float32)
    directions = _core.directions_from_points("cube", faces, points)
    exact = np.stack([1.0 + 0.5 * s, 2.0 - 0.25 * t, 1.0 + 0.3 * s + 0.2 * t], axis=-1)
    bilinear = _worst(linear.sample(directions, filter="bilinear") / exact, 1.0)
    light = random.random((6, 64, 64, 3)).astype(np.float32)
    source = EnvMap.from_array(light, "cube")
    flux = np.asarray(source.flux())
    angles = np.asarray(_core.texel_solid_angles("cube", 64, 64), float)
    direct = (light.astype(float).reshape(6, 64, 64, 3) * angles.reshape(-1, 64, 64, 1)).sum(axis=(0, 1, 2))
    moved = source.resample("latlong", (128, 256), filter="area")
    mips = source.mips()
    levels = max(_worst(np.asarray(mips.flux(level)) / flux, 1.0) for level in range(mips.levels))
    pyramid = np.asarray(_core.build_cube_pyramid(light))
    last = pyramid[-6:].astype(float).mean(axis=0) * 4.0 * math.pi
    half, _ = source.half()
    rounded = light.astype(np.float16)
    return [
        Accuracy("`EnvMap.sample`, bilinear", "light linear across a face", "it", "relative", bilinear, 2e-6),
        Accuracy(
            "`EnvMap.flux`", "noise, 64²×6", "a sum in float64", "relative", _worst(flux / direct, 1.0), 1e-12
        ),
        Accuracy(
            "`EnvMap.resample`, area, flux", "noise, cube to latlong", "before", "relative",
            _worst(np.asarray(moved.flux()) / flux, 1.0), 2e-3,
        ),
        Accuracy("`EnvMap.mips`, flux of all levels", "noise, 64²×6", "level 0", "relative", levels, 2e-3),
        Accuracy(
            "`build_cube_pyramid`, coarsest level", "noise, 64²×6", "the flux", "relative",
            _worst(last / flux, 1.0), 1e-6,
        ),
        Accuracy("`EnvMap.half`", "0…1", "NumPy", "", _worst(np.ravel(half), np.ravel(rounded)), 0.0),
    ]  # fmt: skip


def _harmonics() -> list[Accuracy]:
    order = 8
    nodes, weights = np.polynomial.legendre.leggauss(24)
    turn = 2.0 * math.pi * (np.arange(48) + 0.5) / 48
    up, around = np.meshgrid(nodes, turn, indexing="ij")
    radius = np.sqrt(1.0 - up**2)
    directions = np.stack([radius * np.cos(around), up, radius * np.sin(around)], axis=-1).reshape(-1, 3)
    measure = np.repeat(weights, 48) * 2.0 * math.pi / 48
    basis = _core.harmonic_basis(directions.astype(np.float32), order)
    gram = basis.T @ (basis * measure[:, None])
    known = [math.pi, 2.0 * math.pi / 3.0, math.pi / 4.0, 0.0, -math.pi / 24.0]
    lambert = max(abs(_core.lambert_factor(band) - value) for band, value in enumerate(known))
    exponents = 10.0 ** np.linspace(0.0, 4.0, 41)
    there = [_core.exponent_from_alpha(_core.alpha_from_exponent(float(n))) / n - 1.0 for n in exponents]
    split = 0.0
    for alpha in (0.3, 0.5, 1.0):
        for cosine in (0.05, 0.5, 1.0):
            found = _core.split_sum(cosine, alpha)
            split = max(split, _worst(found, _split_sum(cosine, alpha)))
    return [
        Accuracy(
            "`harmonic_basis`", "orders 0…8, Gauss's quadrature", "orthonormal", "", _worst(gram, np.eye(81)),
            1e-6,
        ),
        Accuracy("`lambert_factor`", "bands 0…4", "closed form", "", lambert, 1e-14),
        Accuracy(
            "`exponent_from_alpha`", "N 1…10,000", "inverse of `alpha_from_exponent`", "relative",
            _worst(there, 0.0), 1e-9,
        ),
        Accuracy("`split_sum`", "n·v 0.05…1, α 0.3…1", "quadrature over facets", "", split, 2e-3),
    ]  # fmt: skip


def _split_sum(cosine: float, alpha: float) -> DoubleArray:
    """Scale and bias of GGX with Smith's height-correlated masking, by quadrature over facets in float64."""
    count = 2000
    # The distribution function's own variable, in which D cos θ dω is uniform, is taken finely at grazing.
    s = (np.arange(count) + 0.5) / count
    u = 1.0 - (1.0 - s) ** 3
    share = (3.0 * (1.0 - s) ** 2)[:, None]
    cos_h = np.sqrt((1.0 - u) / (1.0 + (alpha * alpha - 1.0) * u))[:, None]
    phi = (2.0 * math.pi * (np.arange(count) + 0.5) / count)[None]
    sin_h = np.sqrt(1.0 - cos_h**2)
    view = np.array([math.sqrt(1.0 - cosine * cosine), cosine])
    vh = np.maximum(sin_h * np.cos(phi) * view[0] + cos_h * view[1], 0.0)
    nl = 2.0 * vh * cos_h - cosine
    lit = nl > 0.0
    nl = np.where(lit, nl, 1.0)

    def smith(other: DoubleArray | float, own: DoubleArray | float) -> DoubleArray:
        inner: DoubleArray = other * np.sqrt(own * own * (1.0 - alpha**2) + alpha**2)
        return inner

    visible = 0.5 / (smith(nl, cosine) + smith(cosine, nl))
    weight = share * np.where(lit, 4.0 * visible * nl * vh / cos_h, 0.0)
    fresnel = (1.0 - vh) ** 5
    return np.array([np.mean(weight * (1.0 - fresnel)), np.mean(weight * fresnel)])


def _tones() -> list[Accuracy]:
    shown = np.linspace(0.0, 1.0, 4096)
    linear = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
    codes = np.abs(srgb_bytes(linear).astype(float) - 255.0 * shown)
    kept = np.linspace(0.08, 0.8, 200)[:, None] * np.ones(3)
    return [
        Accuracy("`srgb_encoded`", "0…1", "its inverse", "", _worst(srgb_encoded(linear), shown), 1e-15),
        Accuracy("`srgb_bytes`", "0…1", "the code", "of a code", float(codes.max()), 0.5 + 1e-9),
        Accuracy(
            "`tone_map`", "greys 0.08…0.8", "0.04 below (its definition)", "",
            _worst(tone_map(kept.astype(np.float32)), kept - 0.04), 1e-6,
        ),
    ]  # fmt: skip


def _grey_ball() -> tuple[mb.Tracer, int, mb.Scene]:
    scene = mb.Scene()
    mirror = scene.add_material(
        mb.Material(albedo=(0.5, 0.5, 0.5), specular=True, fresnel=mb.Fresnel("constant", r0=(0.5, 0.5, 0.5)))
    )
    ball = scene.add_object("ball", mb.make_sphere((0, 0, 0), 1.0, 48), mirror)
    scene.set_environment(np.full((8, 16, 3), GREY, np.float32))
    return mb.Tracer(scene, mb.TracerOptions(indirect="none")), ball, scene


def _tracing() -> list[Accuracy]:
    tracer, ball, scene = _grey_ball()
    camera = mb.Camera((0, 0.5, 3.5), (0, 0, 0), vertical_fov_degrees=45, width=30, height=30)
    samples = tracer.trace_layers(camera, ball, mb.TraceOptions(samples_per_pixel=4)).samples
    light = np.asarray(samples.shells[-1].radiance)[:, :3]
    mesh = scene.object_mesh(ball)
    used = np.unique(mesh.triangles)
    irradiance = np.asarray(tracer.vertex_irradiance(ball, 1024, 1))
    off = irradiance[used] / (GREY * math.pi) - 1.0
    captured = tracer.capture_cube((0.0, 3.0, 0.0), 8, [ball], mb.TraceOptions(samples_per_pixel=1))
    body = mb.diffuse_from_irradiance(samples, mesh.triangles, np.full_like(irradiance, GREY * math.pi))
    weights = np.full((len(mesh.triangles), 2), 1 / 3, np.float32)
    middles = tracer.surface_irradiance(ball, np.arange(len(weights), dtype=np.uint32), weights, 1024, 1)
    lit = np.asarray(middles) / (GREY * math.pi) - 1.0
    sky = "a grey sky"
    return [
        Accuracy("`Tracer.trace_layers`", "a mirror ball", sky, "relative", _worst(light / GREY, 1.0), 1e-6),
        Accuracy(
            "`Tracer.vertex_irradiance`", "a ball, 1024 rays", "π L of a grey sky", "relative, RMS",
            float(np.sqrt(np.mean(off**2))), 0.01,
        ),
        Accuracy(
            "`Tracer.capture_cube`", "above a ball", sky, "relative",
            _worst(np.asarray(captured) / GREY, 1.0), 1e-6,
        ),
        Accuracy(
            "`diffuse_from_irradiance`", "a ball of albedo ½", "ρ E / π", "relative",
            _worst(np.asarray(body) / (0.5 * GREY), 1.0), 1e-6,
        ),
        Accuracy(
            "`Tracer.surface_irradiance`", "a ball, 1024 rays", "π L of a grey sky", "relative, RMS",
            float(np.sqrt(np.mean(lit**2))), 0.01,
        ),
        _lightmap(samples, mesh),
    ]  # fmt: skip


def _lightmap(samples: mb.SurfaceSamples, mesh: mb.TriangleMesh) -> Accuracy:
    """Light that is linear in the texture coordinates is read as it is."""
    uvs = (0.1 + 0.8 * np.asarray(mesh.uvs)).astype(np.float32)
    middle = (np.arange(32) + 0.5) / 32
    u, v = np.broadcast_arrays(middle, 1.0 - middle[:, None])
    linear = np.stack([1.0 + u, 2.0 - v, u + v + 1.0], axis=-1).reshape(-1, 3)
    body = mb.diffuse_from_lightmap(samples, mesh.triangles, uvs, 32, linear.astype(np.float32))
    b = np.asarray(samples.barycentric, float)
    weights = np.stack([1.0 - b.sum(axis=1), b[:, 0], b[:, 1]], axis=-1)
    s, t = np.einsum("nk,nkc->cn", weights, uvs[mesh.triangles[samples.triangle]].astype(float))
    exact = 0.5 / math.pi * np.stack([1.0 + s, 2.0 - t, s + t + 1.0], axis=-1)
    error = _worst(np.asarray(body) / exact, 1.0)
    return Accuracy("`diffuse_from_lightmap`", "light linear in (u, v)", "ρ E / π", "relative", error, 2e-6)


def _matrices() -> list[Accuracy]:
    tracer, ball, _ = _grey_ball()
    camera = mb.Camera((0, 0.5, 3.5), (0, 0, 0), vertical_fov_degrees=45, width=30, height=30)
    model = mb.run_time_model("Web")
    samples = tracer.trace_visibility(camera, ball, mb.TraceOptions(samples_per_pixel=1), model.places)
    layout, box = mb.TexelTopology.cube(16), proxy.Proxy.box((0, 0, 0), (3, 2, 4))
    matrix = mb.build_rendering_matrix(samples, 0, box, layout, model)
    sparse = scipy.sparse.csr_array(
        (matrix.weights.astype(float), matrix.texels.astype(int), matrix.row_offsets.astype(int)),
        shape=(matrix.rows, matrix.columns),
    )
    texels = np.random.default_rng(4).random((matrix.columns, 3), np.float32)
    sums = sparse @ np.ones(matrix.columns)
    product = matrix.multiply(texels)
    drawn = np.asarray(mb.render_reflector(samples, [[mb.ShellMap(box, layout, texels)]], None, model))
    covered = drawn[..., 3] > 0.999
    target = 4.0 * np.random.default_rng(5).random((matrix.rows, 3), np.float32)
    hits = np.bincount(np.asarray(samples.pixel), minlength=900)[np.asarray(matrix.row_pixels)]
    luminance = target.astype(float) @ (0.2126, 0.7152, 0.0722)
    weights = hits / len(model.places) / (1.0 + luminance) ** 2
    weighted = _worst(mb.display_row_weights(matrix, len(model.places), target), weights[:, None])
    return [
        Accuracy("`build_rendering_matrix`, sums of rows", "a ball, `Web`", "1", "", _worst(sums, 1.0), 2e-6),
        Accuracy(
            "`RenderingMatrix.multiply`", "a ball, noise", "SciPy in float64", "",
            _worst(product, sparse @ texels), 1e-6,
        ),
        Accuracy("`display_row_weights`", "a ball, noise", "its formula", "", weighted, 1e-6),
        _drawn(matrix, product, drawn, covered),
        _solved(matrix, sparse, layout),
    ]  # fmt: skip


def _drawn(
    matrix: mb.RenderingMatrix, product: FloatArray, drawn: FloatArray, covered: NDArray[np.bool_]
) -> Accuracy:
    pixels = np.asarray(matrix.row_pixels)
    whole = covered.reshape(-1)[pixels]
    image = drawn[..., :3].reshape(-1, 3)[pixels]
    error = _worst(image[whole], 0.5 * np.asarray(product)[whole])
    return Accuracy("`render_reflector`", "a ball of F = ½, noise", "F · matrix · texels", "", error, 2e-6)


def _solved(matrix: mb.RenderingMatrix, sparse: scipy.sparse.csr_array, layout: mb.TexelTopology) -> Accuracy:
    random = np.random.default_rng(6)
    truth = random.uniform(0.5, 1.5, (matrix.columns, 1))
    target = (sparse @ truth).astype(np.float32)
    weight = 1e-3
    options = mb.SolveOptions(
        smoothness=0.0, level_agreement=0.0, prior_weight=weight, tolerance=1e-6, max_iterations=4000
    )
    prior = np.full((matrix.columns, 1), 1.0, np.float32)
    solver = mb.MapSolver([(matrix, [(0, 1.0)])], [layout], options=options)
    texels, _ = solver.solve([target], [np.ones_like(target)], None, prior)
    return Accuracy(
        "`MapSolver.solve`, rows", "noise, λ = 1e-3", "SciPy's LSMR in float64", "",
        _regularised(sparse, target, np.asarray(texels)), 2e-2,
    )  # fmt: skip


def _regularised(sparse: scipy.sparse.csr_array, target: NDArray[np.float32], found: DoubleArray) -> float:
    exact = scipy.sparse.linalg.lsmr(sparse, target[:, 0].astype(float), atol=1e-12, btol=1e-12)[0]
    return _worst(sparse @ found[:, 0], sparse @ exact)

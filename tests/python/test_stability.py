"""Inference and whole bakes at the extremes: conditions, scales, sizes, shapes, views and light."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import scipy.sparse
import scipy.sparse.linalg

import mirrorbake as mb
from mirrorbake import _core
from mirrorbake._core import Proxy
from mirrorbake.bake.bake import bake
from mirrorbake.evaluate.evaluate import Onlooker
from mirrorbake.evaluate.places import choose_views
from mirrorbake.pem.opened import open_pem
from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

LAYOUT = mb.CubePyramidLayout(16)


@pytest.fixture(scope="module")
def matrix() -> mb.RenderingMatrix:
    """A ball seen by 900 pixels: some 600 rows for 2046 texels, most of them between what the rows see."""
    scene = mb.Scene()
    mirror = scene.add_material(
        mb.Material(albedo=(0, 0, 0), specular=True, fresnel=mb.Fresnel("constant", r0=(1, 1, 1)))
    )
    ball = scene.add_object("ball", mb.make_sphere((0, 0, 0), 1.0), mirror)
    tracer = mb.Tracer(scene, mb.TracerOptions(indirect="none"))
    camera = mb.Camera((0, 0.5, 3.5), (0, 0, 0), vertical_fov_degrees=45, width=30, height=30)
    samples = tracer.trace_visibility(camera, ball, mb.TraceOptions(samples_per_pixel=4))
    return mb.build_rendering_matrix(samples, 0, Proxy.box((0, 0, 0), (3, 2, 4)), LAYOUT)


def true_map() -> NDArray[np.float32]:
    """Light of some structure, all of it within what a regulariser likes."""
    faces = np.random.default_rng(1).uniform(0.5, 1.5, (6, 16, 16, 3)).astype(np.float32)
    return mb.build_cube_pyramid(faces)


def solved(
    matrix: mb.RenderingMatrix, target: NDArray[np.float32], **options: Any
) -> tuple[NDArray[np.float32], mb.SolveReport]:
    solver = mb.MapSolver([(matrix, [(0, 1.0)])], [LAYOUT], options=mb.SolveOptions(**options))
    texels, report = solver.solve([target], [np.ones_like(target)])
    return np.asarray(texels), report


def misfit(matrix: mb.RenderingMatrix, texels: NDArray[np.float32], target: NDArray[np.float32]) -> float:
    difference = matrix.multiply(texels).astype(np.float64) - target
    return float(np.sqrt(np.mean(difference**2)) / np.sqrt(np.mean(target.astype(np.float64) ** 2)))


@pytest.mark.parametrize("weight", [1.0, 1e-2, 1e-4, 1e-6, 1e-8])
def test_a_solve_fits_or_says_that_it_did_not_converge(matrix: mb.RenderingMatrix, weight: float) -> None:
    # The weights of the regulariser bound the condition of the system from below: 1 to 1e8.
    target = matrix.multiply(true_map())
    options = {"smoothness": weight, "level_agreement": weight, "prior_weight": weight}
    texels, report = solved(matrix, target, tolerance=1e-4, max_iterations=2000, **options)
    assert np.isfinite(texels).all()
    assert texels.min() >= 0.0
    if report.converged:
        # The light is consistent with the rows, so that less regularisation fits it better.
        assert misfit(matrix, texels, target) < 0.25 * min(1.0, weight**0.25) + 0.01


@pytest.mark.parametrize("weight", [1.0, 1e-2, 1e-4, 1e-6, 1e-8])
def test_float32_fits_what_float64_fits_but_for_the_regulariser(
    matrix: mb.RenderingMatrix, weight: float
) -> None:
    target = matrix.multiply(true_map())
    texels, report = solved(
        matrix, target, smoothness=weight, level_agreement=0.0, prior_weight=0.0, tolerance=1e-5,
        max_iterations=4000,
    )  # fmt: skip
    a = scipy.sparse.csr_array(
        (matrix.weights.astype(float), matrix.texels.astype(int), matrix.row_offsets.astype(int)),
        shape=(matrix.rows, matrix.columns),
    )
    exact = scipy.sparse.linalg.lsqr(a, target[:, 0].astype(float), atol=1e-14, btol=1e-14, iter_lim=20_000)
    # SciPy's LSQR in float64 meets all rows: whatever is left in float32 is the regulariser's, which moves
    # the rows by about the root of its weight, and rounding.
    consistent = exact[3] / np.linalg.norm(target[:, 0])
    assert consistent < 1e-6
    found = misfit(matrix, texels, target)
    assert report.converged or report.relative_gradient < 1e-2
    assert found < max(0.5 * weight**0.5, 2e-3)


def test_an_exhausted_budget_is_reported(matrix: mb.RenderingMatrix) -> None:
    target = matrix.multiply(true_map())
    small = {"smoothness": 1e-6, "level_agreement": 1e-6, "prior_weight": 1e-6}
    _, short = solved(matrix, target, max_iterations=2, tolerance=1e-6, **small)
    assert not short.converged
    assert short.relative_gradient > 1e-6
    _, enough = solved(matrix, target, max_iterations=2000)
    assert enough.converged


@pytest.mark.parametrize("scale", [1e-5, 1e-3, 1e3, 1e5])
def test_brightness_does_not_matter_to_the_solver(matrix: mb.RenderingMatrix, scale: float) -> None:
    target = matrix.multiply(true_map())
    plain, _ = solved(matrix, target, tolerance=1e-5, max_iterations=1000)
    scaled, report = solved(matrix, target * np.float32(scale), tolerance=1e-5, max_iterations=1000)
    assert report.converged
    # Conjugate gradients in float32, stopped at 1e-5 of the gradient: both are that far from the minimum.
    np.testing.assert_allclose(scaled / scale, plain, rtol=5e-3, atol=5e-3)


def test_light_over_ten_orders_of_magnitude_keeps_its_dark_end(matrix: mb.RenderingMatrix) -> None:
    # A sun beside darkness: rows of 1e5 and of 1e-5, weighted relatively, as a display's weights do.
    random = np.random.default_rng(2)
    target = (10.0 ** random.choice([-5.0, 0.0, 5.0], size=(matrix.rows, 1))).astype(np.float32)
    target = np.repeat(target, 3, axis=1)
    solver = mb.MapSolver(
        [(matrix, [(0, 1.0)])], [LAYOUT], options=mb.SolveOptions(tolerance=1e-3, max_iterations=500)
    )
    texels, _ = solver.solve([target], [1.0 / target**2])
    texels = np.asarray(texels)
    assert np.isfinite(texels).all()
    assert texels.min() >= 0.0
    # No texel is brighter than the sun by more than the overshoot of a smooth fill.
    assert texels.max() < 1e7


# Whole bakes

SCENE: dict[str, Any] = {
    "reflector": {"object": "teapot", "subdivisions": 4, "parts": "split"},
    "views": {"count": 2, "degrees": 1.0, "start": 22.0, "size": [40, 30]},
    "layers": {"diffuse": False},
    "maps": {"size": 16},
    "trace": {"samples": 8, "depth": 2, "indirect": "none"},
    "auto": {"quality": "draft"},
}


def sky(tmp_path: Path, light: float) -> str:
    v, u = np.mgrid[0:16, 0:32].astype(np.float32)
    pixels = np.stack([u / 32, 1 - v / 16, 1 - u / 32], axis=-1) * np.float32(light)
    path = tmp_path / "sky.exr"
    _core.save_image(str(path), np.ascontiguousarray(pixels), ["R", "G", "B"], format="float32")
    return str(path)


def mesh(tmp_path: Path, text: str) -> str:
    path = tmp_path / "mesh.obj"
    path.write_text(text)
    return str(path)


TRIANGLE = "v -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
NEEDLE = "v 0 0 0.001\nv 0.001 0 -0.001\nv -0.001 0 -0.001\nv 0 1 0\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 3 2 1\n"


def figure(tmp_path: Path, scene: dict[str, Any]) -> tuple[float | None, NDArray[np.float32] | None]:
    """PSNR of a bake on its first sample, and what it draws; None where no pixel is wholly the object's."""
    bake(parse_config(scene, "extreme"), tmp_path / "pem")
    pem = open_pem(tmp_path / "pem")
    view = choose_views(pem.stage.built.cameras, pem.space)[0]
    seen = Onlooker(pem, only=("pem",)).look(view)
    if seen is None:
        return None, None
    picture = seen.pictures["pem"]["reference"]
    return seen.reference.psnr(picture), picture[seen.reference.mask]


@pytest.mark.parametrize("height", [1e-3, 1e3])
def test_a_bake_of_any_size_is_the_same(tmp_path: Path, height: float) -> None:
    scene = {**SCENE, "surroundings": {"panorama": sky(tmp_path, 1.0)}}
    small = {**scene, "reflector": {**SCENE["reflector"], "height": height}}
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    usual, _ = figure(tmp_path / "a", scene)
    extreme, _ = figure(tmp_path / "b", small)
    assert usual is not None
    # Rounding moves a few samples across edges: of some 300 pixels, a handful decides tenths.
    assert extreme == pytest.approx(usual, abs=2.0)


@pytest.mark.parametrize(
    "change",
    [
        pytest.param({"views": {**SCENE["views"], "fov": 1.0}}, id="fov of 1 degree"),
        pytest.param({"views": {**SCENE["views"], "fov": 170.0, "radius": 0.3}}, id="fov of 170 degrees"),
        pytest.param({"views": {**SCENE["views"], "height": 0.0}}, id="grazing view"),
        pytest.param({"views": {**SCENE["views"], "size": [1, 1]}}, id="one pixel"),
        pytest.param({"maps": {"size": 1}}, id="maps of one texel"),
    ],
)
def test_a_bake_of_an_extreme_view_is_finite(tmp_path: Path, change: dict[str, Any]) -> None:
    _, picture = figure(tmp_path, {**SCENE, "surroundings": {"panorama": sky(tmp_path, 1.0)}, **change})
    if picture is not None:
        assert np.isfinite(picture).all()
        assert picture.max() < 10.0


@pytest.mark.parametrize("shape", [TRIANGLE, NEEDLE], ids=["one triangle", "needle"])
def test_a_bake_of_an_extreme_shape_is_finite(tmp_path: Path, shape: str) -> None:
    scene = {
        **SCENE,
        "reflector": {"mesh": mesh(tmp_path, shape)},
        "surroundings": {"panorama": sky(tmp_path, 1.0)},
    }
    decibels, picture = figure(tmp_path, scene)
    if picture is not None:
        assert np.isfinite(picture).all()
    if decibels is not None:
        assert decibels > 15.0


def test_two_million_triangles_are_traced_read_and_drawn() -> None:
    # A ball of 1,416² triangles; a bake of it would differ in what is traced alone.
    scene = mb.Scene()
    mirror = scene.add_material(
        mb.Material(albedo=(0, 0, 0), specular=True, fresnel=mb.Fresnel("constant", r0=(1, 1, 1)))
    )
    mesh = mb.make_sphere((0, 0, 0), 1.0, 1416)
    assert len(mesh.triangles) > 2_000_000
    ball = scene.add_object("ball", mesh, mirror)
    scene.set_environment(np.full((8, 16, 3), 0.5, np.float32))
    tracer = mb.Tracer(scene, mb.TracerOptions(indirect="none"))
    camera = mb.Camera((0, 0.5, 3.5), (0, 0, 0), vertical_fov_degrees=45, width=30, height=30)
    samples = tracer.trace_layers(camera, ball, mb.TraceOptions(samples_per_pixel=4)).samples
    matrix = mb.build_rendering_matrix(samples, 0, Proxy.infinite(), LAYOUT)
    target = matrix.row_means(np.ascontiguousarray(np.asarray(samples.shells[1].radiance)[:, :3]))
    texels, report = solved(matrix, target)
    assert report.converged
    # One grey sky.
    np.testing.assert_allclose(matrix.multiply(texels), 0.5, rtol=1e-3)


def test_a_black_world_is_black(tmp_path: Path) -> None:
    scene = {**SCENE, "surroundings": {"panorama": sky(tmp_path, 0.0)}}
    _, picture = figure(tmp_path, scene)
    assert picture is not None
    np.testing.assert_array_equal(picture, 0.0)


def test_a_world_a_million_times_as_bright_is_as_well_baked(tmp_path: Path) -> None:
    bright = {
        **SCENE,
        "surroundings": {"panorama": sky(tmp_path, 1e6)},
        "maps": {"size": 16, "precision": "float32"},
    }
    _, picture = figure(tmp_path, bright)
    assert picture is not None
    assert np.isfinite(picture).all()
    # A mirror of 0.9 and more under a sky of up to 1e6 in each channel.
    assert 1e5 < picture.max() < 1.1e6

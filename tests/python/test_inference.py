"""The inference and the software run time from Python: one chain from traced samples to a drawn image."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
import scipy.sparse

import mirrorbake as mb
from mirrorbake._core import Proxy

if TYPE_CHECKING:
    from numpy.typing import NDArray

SIZE = 40
SAMPLES = 4
LAYOUT = mb.CubePyramidLayout(16)
PROXY = Proxy.box((0, 0, 0), (3, 2, 4))


@pytest.fixture(scope="module")
def trace() -> mb.LayerTrace:
    """A mirror ball under a light, in a box of coloured walls."""
    scene = mb.Scene()
    mirror = scene.add_material(
        mb.Material(albedo=(0, 0, 0), specular=True, fresnel=mb.Fresnel("constant", r0=(1, 1, 1)))
    )
    ball = scene.add_object("ball", mb.make_sphere((0, 0, 0), 1.0), mirror)
    corners = [(-3, -2, -4), (3, -2, -4), (-3, -2, 4)]
    edges = [((0, 4, 0), (0, 0, 8)), ((0, 0, 8), (0, 4, 0)), ((6, 0, 0), (0, 4, 0))]
    for number, (corner, (u, v)) in enumerate(zip(corners, edges, strict=True)):
        colour = tuple(0.8 if number == channel else 0.2 for channel in range(3))
        wall = scene.add_material(mb.Material(albedo=colour, emission=colour))
        scene.add_object(f"wall {number}", mb.make_rectangle(corner, u, v), wall)
    tracer = mb.Tracer(scene, mb.TracerOptions(indirect="none"))
    camera = mb.Camera((0, 0.5, 3.5), (0, 0, 0), vertical_fov_degrees=45, width=SIZE, height=SIZE)
    return tracer.trace_layers(camera, ball, mb.TraceOptions(samples_per_pixel=SAMPLES))


@pytest.fixture(scope="module")
def matrix(trace: mb.LayerTrace) -> mb.RenderingMatrix:
    return mb.build_rendering_matrix(trace.samples, 0, PROXY, LAYOUT)


def as_scipy(matrix: mb.RenderingMatrix) -> scipy.sparse.csr_array:
    return scipy.sparse.csr_array(
        (matrix.weights, matrix.texels, matrix.row_offsets.astype(np.int64)), (matrix.rows, matrix.columns)
    )


def solver_of(matrix: mb.RenderingMatrix, options: mb.SolveOptions | None = None) -> mb.MapSolver:
    return mb.MapSolver([(matrix, [(0, 1.0)])], [LAYOUT], options=options or mb.SolveOptions())


def random_map(channels: int) -> NDArray[np.float32]:
    return np.random.default_rng(5).random((LAYOUT.texels, channels), np.float32)


def test_layout_counts_the_texels_of_all_levels() -> None:
    assert (LAYOUT.size, LAYOUT.levels) == (16, 5)
    assert LAYOUT.texels == 6 * (256 + 64 + 16 + 4 + 1)
    assert [LAYOUT.level_size(level) for level in range(5)] == [16, 8, 4, 2, 1]
    assert LAYOUT.level_offset(2) == 6 * (256 + 64)
    with pytest.raises(ValueError, match="size is 0"):
        mb.CubePyramidLayout(0)


def test_pyramid_of_a_constant_map_is_constant() -> None:
    pyramid = mb.build_cube_pyramid(np.full((6, 16, 16, 3), 0.25, np.float32))
    assert pyramid.shape == (LAYOUT.texels, 3)
    np.testing.assert_allclose(pyramid, 0.25, rtol=1e-6)
    with pytest.raises(ValueError, match="faces"):
        mb.build_cube_pyramid(np.zeros((6, 16, 8, 3), np.float32))


def test_rows_of_the_matrix_are_means(matrix: mb.RenderingMatrix) -> None:
    assert matrix.rows > SIZE
    assert matrix.nonzeros == matrix.texels.size == matrix.weights.size
    np.testing.assert_allclose(as_scipy(matrix).sum(axis=1), 1.0, rtol=5e-6)
    assert np.all(np.diff(matrix.row_pixels.astype(np.int64)) > 0)
    assert matrix.row_samples.min() >= 1
    assert matrix.row_samples.max() <= SAMPLES


def test_multiply_is_the_sparse_product(matrix: mb.RenderingMatrix) -> None:
    x = random_map(3)
    np.testing.assert_allclose(matrix.multiply(x), as_scipy(matrix) @ x, rtol=1e-5)
    with pytest.raises(ValueError, match="x is"):
        matrix.multiply(x[1:])


def test_average_is_the_mean_of_the_row(trace: mb.LayerTrace, matrix: mb.RenderingMatrix) -> None:
    pixel = np.asarray(trace.samples.pixel, np.float32)[:, None]
    np.testing.assert_array_equal(matrix.row_means(pixel)[:, 0], matrix.row_pixels)


def test_renderer_draws_what_the_matrix_says(trace: mb.LayerTrace, matrix: mb.RenderingMatrix) -> None:
    x = random_map(3)
    image = mb.render_reflector(trace.samples, [[mb.ShellMap(PROXY, LAYOUT, x)]])
    drawn = image.reshape(-1, 4)[matrix.row_pixels]
    coverage = matrix.row_samples[:, None] / SAMPLES
    np.testing.assert_allclose(drawn[:, :3], coverage * matrix.multiply(x), rtol=1e-5)
    np.testing.assert_allclose(drawn[:, 3:], coverage, rtol=1e-6)


def test_inferred_map_reproduces_the_traced_reflection(
    trace: mb.LayerTrace, matrix: mb.RenderingMatrix
) -> None:
    target = matrix.row_means(np.asarray(trace.samples.shells[1].radiance)[:, :3])
    weights = mb.display_row_weights(matrix, SAMPLES, target)
    assert weights.shape == (matrix.rows, 3)
    texels, report = solver_of(matrix).solve([target], [weights])
    assert report.converged
    assert texels.shape == (LAYOUT.texels, 3)
    assert report.iterations > 0
    assert report.rounds >= 1
    assert report.relative_gradient <= mb.SolveOptions().tolerance
    assert 0 < report.unknowns <= LAYOUT.texels
    # A constant is the best that a map of one texel could do; the walls differ by far more than the residue.
    constant = np.sqrt(np.average((target - target.mean(axis=0)) ** 2))
    assert report.rms_error < 0.35 * constant
    image = mb.render_reflector(trace.samples, [[mb.ShellMap(PROXY, LAYOUT, texels)]])
    drawn = image.reshape(-1, 4)[matrix.row_pixels, :3] * SAMPLES / matrix.row_samples[:, None]
    assert np.sqrt(np.average((drawn - target) ** 2)) < 0.35 * constant


def test_solver_starts_from_a_map_and_falls_back_to_a_prior(
    trace: mb.LayerTrace, matrix: mb.RenderingMatrix
) -> None:
    prior = random_map(3)
    target = matrix.multiply(prior)
    weights = np.ones((matrix.rows, 3), np.float32)
    solver = solver_of(matrix, mb.SolveOptions(prior_weight=0.1))
    texels, _ = solver.solve([target], [weights], prior=prior)
    np.testing.assert_allclose(texels, prior, atol=1e-5)
    _, cold = solver.solve([target], [weights])
    best, _ = solver.solve([target], [weights])
    _, warm = solver.solve([target], [weights], initial=best)
    assert warm.iterations < cold.iterations


def test_solver_names_what_is_wrong(matrix: mb.RenderingMatrix) -> None:
    target = np.ones((matrix.rows, 1), np.float32)
    weights = target.copy()
    solver = solver_of(matrix)
    target[3] = np.nan
    with pytest.raises(mb.InvalidArgument, match="target is not finite or too large in 1 values"):
        solver.solve([target], [weights])
    with pytest.raises(mb.InvalidArgument, match="smoothness"):
        solver_of(matrix, mb.SolveOptions(smoothness=-1.0))
    with pytest.raises(mb.InvalidArgument, match="tolerance"):
        solver_of(matrix, mb.SolveOptions(tolerance=0.0))


def test_diffuse_radiance_is_albedo_times_irradiance_over_pi(trace: mb.LayerTrace) -> None:
    ball = mb.make_sphere((0, 0, 0), 1.0)
    irradiance = np.ones_like(np.asarray(ball.positions))
    diffuse = mb.diffuse_from_irradiance(trace.samples, np.asarray(ball.triangles), irradiance)
    np.testing.assert_allclose(diffuse, np.asarray(trace.samples.albedo) / np.pi, rtol=1e-6)


def test_a_display_fit_shows_the_traced_ball(trace: mb.LayerTrace) -> None:
    targets = mb.ViewTargets(SIZE, SIZE, 1, 2)
    targets.add(trace.samples)
    parts = [[mb.FitShell(Proxy.ellipsoid((0, 0, 0), (1.1, 1.1, 1.1)), 0), mb.FitShell(PROXY, 1)]]
    maps = [mb.TexelTopology.cube(16)] * 2
    view = mb.DisplayView(trace.samples, targets)
    texels, reports, _ = mb.fit_display([view], parts, maps)
    assert texels.shape == (2 * LAYOUT.texels, 4)
    assert len(reports) == 1 + mb.DisplayFitOptions().passes
    local, distant = np.split(np.asarray(texels), 2)
    shells = [
        mb.ShellMap(parts_proxy, maps[0], np.ascontiguousarray(part))
        for parts_proxy, part in [
            (Proxy.ellipsoid((0, 0, 0), (1.1, 1.1, 1.1)), local),
            (PROXY, distant[:, :3]),
        ]
    ]
    image = mb.render_reflector(trace.samples, [shells], run_time=mb.run_time_model("Web"))
    channels = list(trace.channels)
    layers = np.asarray(trace.layers)
    seen = layers[..., channels.index("coverage")] == 1.0
    beauty = layers[..., :3][seen]
    # A ball reflects nothing of itself, and the walls are flat colours: what is left lies at their edges.
    assert np.sqrt(np.mean((image[..., :3][seen] - beauty) ** 2)) < 0.2 * beauty.std()

"""What the solver promises, on a traced view: the best map within its bounds, recovery, λ without units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
import scipy.sparse

import mirrorbake as mb
from mirrorbake._core import Proxy

if TYPE_CHECKING:
    from numpy.typing import NDArray

PROXY = Proxy.infinite()
NOTHING_ELSE = {"smoothness": 0.0, "level_agreement": 0.0}
"""With a prior of weight λ as the only regulariser, the problem can be written down in one line."""


@pytest.fixture(scope="module")
def samples() -> mb.SurfaceSamples:
    """The teapot in its room, as a camera sees it."""
    return trace(64)


def trace(size: int) -> mb.SurfaceSamples:
    scene = mb.make_room()
    chrome = mb.Material(albedo=(0, 0, 0), specular=True, fresnel=mb.Fresnel("constant", r0=(1, 1, 1)))
    teapot = scene.add_object("teapot", mb.make_teapot(6), scene.add_material(chrome), mb.teapot_part_names())
    tracer = mb.Tracer(scene, mb.TracerOptions(indirect="none"))
    camera = mb.Camera((0, 0.25, 0.6), (0, 0.08, 0), vertical_fov_degrees=25, width=size, height=size)
    return tracer.trace_layers(camera, teapot, mb.TraceOptions(samples_per_pixel=4)).samples


def system(
    samples: mb.SurfaceSamples, size: int
) -> tuple[mb.RenderingMatrix, scipy.sparse.csr_array, mb.TexelTopology]:
    topology = mb.TexelTopology.cube(size)
    matrix = mb.build_rendering_matrix(samples, 0, PROXY, topology)
    a = scipy.sparse.csr_array(
        (matrix.weights.astype(np.float64), matrix.texels, matrix.row_offsets.astype(np.int64)),
        (matrix.rows, matrix.columns),
    )
    return matrix, a, topology


def solve(
    matrix: mb.RenderingMatrix,
    topology: mb.TexelTopology,
    target: NDArray[np.float32],
    prior: NDArray[np.float32],
    options: mb.SolveOptions,
) -> tuple[NDArray[np.float32], mb.SolveReport]:
    weights = np.ones_like(target)
    return mb.MapSolver([(matrix, [(0, 1.0)])], [topology], options=options).solve([target], [weights], prior)


def test_a_traced_view_is_solved_to_the_best_map_within_the_bounds(samples: mb.SurfaceSamples) -> None:
    """Karush, Kuhn and Tucker: no gradient inside of the bounds, on them none that wants inside."""
    matrix, a, topology = system(samples, 32)
    incident = np.asarray(samples.shells[1].radiance)[:, :3]
    # Pixels that are darker than any map could show force texels onto their bound.
    target = (matrix.row_means(np.ascontiguousarray(incident)) - 0.2).astype(np.float32)
    prior = np.full((topology.texels, 3), 0.1, np.float32)
    options = mb.SolveOptions(**NOTHING_ELSE, prior_weight=1e-3, tolerance=1e-5, max_iterations=5000)
    texels, report = solve(matrix, topology, target, prior, options)
    assert report.converged
    seen = np.unique(np.asarray(matrix.texels))
    x = texels.astype(np.float64)
    scale = a.sum(axis=1) @ a.sum(axis=1) / len(seen)
    gradient = (a.T @ (a @ x - target) + 1e-3 * scale * (x - prior))[seen]
    at_start = (a.T @ (a @ prior.astype(np.float64) - target))[seen]
    small = 1e-4 * np.abs(at_start).max()
    dark = x[seen] == 0
    assert 0.02 < dark.mean() < 0.9
    assert x.min() >= 0
    assert np.abs(gradient[~dark]).max() < small
    assert gradient[dark].min() > -small


def test_random_maps_come_back_where_the_view_determines_them(samples: mb.SurfaceSamples) -> None:
    matrix, a, topology = system(samples, 8)
    truth = np.random.default_rng(3).random((topology.texels, 3), np.float32) + 0.5
    target = matrix.multiply(truth)
    weight = 1e-5
    options = mb.SolveOptions(**NOTHING_ELSE, prior_weight=weight, tolerance=1e-5, max_iterations=1000)
    prior = np.full((topology.texels, 3), 1.0, np.float32)
    texels, _ = solve(matrix, topology, target, prior, options)
    seen = np.unique(np.asarray(matrix.texels))
    dense = a[:, seen].toarray()
    scale = a.sum(axis=1) @ a.sum(axis=1) / len(seen)
    _, values, directions = np.linalg.svd(dense, full_matrices=False)
    # Diagonal of the resolution matrix: which share of a texel the data decide, the prior the rest.
    decided = (directions.T**2) @ (values**2 / (values**2 + weight * scale))
    determined = decided > 0.999
    assert determined.sum() > 100
    # The other texels are off by up to 0.5; what is left is the share of the prior and of the tolerance.
    assert np.abs(texels - truth)[seen[determined]].max() < 0.02


def test_regularisation_means_the_same_at_any_size_of_image_and_map() -> None:
    """How far a constant target is pulled to a black prior."""
    options = mb.SolveOptions(**NOTHING_ELSE, prior_weight=0.1, tolerance=1e-4, max_iterations=1000)
    pulled = []
    for pixels, size in ((48, 32), (96, 64), (96, 32)):
        matrix, _, topology = system(trace(pixels), size)
        target = np.ones((matrix.rows, 1), np.float32)
        texels, report = solve(matrix, topology, target, np.zeros((topology.texels, 1), np.float32), options)
        assert report.converged
        pulled.append(float(1 - matrix.multiply(texels).mean()))
    # Image and map together keep what a texel is read by; the image alone changes which levels are read.
    assert pulled[1] == pytest.approx(pulled[0], rel=0.15)
    assert pulled[2] == pytest.approx(pulled[0], rel=0.4)


def test_the_same_bits_come_from_any_number_of_threads(samples: mb.SurfaceSamples) -> None:
    matrix, _, topology = system(samples, 32)
    incident = np.ascontiguousarray(np.asarray(samples.shells[1].radiance)[:, :3])
    prior = np.zeros((topology.texels, 3), np.float32)
    results = []
    for threads in (1, 2, 3):
        with mb.ThreadLimit(threads):
            results.append(solve(matrix, topology, matrix.row_means(incident), prior, mb.SolveOptions())[0])
    np.testing.assert_array_equal(results[0], results[1])
    np.testing.assert_array_equal(results[0], results[2])

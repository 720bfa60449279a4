"""The rendering matrix and its solver against SciPy, on one view of the teapot in its room.

Cases: `A x` for three channels; and a number of steps of least squares for three channels, without
regularisation, from zero. SciPy's LSQR takes one right-hand side at a time and is given the same
preconditioner: columns scaled to unit length. The error is that of b against float64, or the
norm of the residual over that of b.
"""

from collections.abc import Iterator

import numpy as np
import scipy.sparse
from numpy.typing import NDArray
from scipy.sparse.linalg import lsqr

from benchmarks._report import Case, require, run, seconds
from mirrorbake import _core as core

FloatArray = NDArray[np.float32]
ITERATIONS = 20


def cases() -> Iterator[Case]:
    scene = core.make_room()
    chrome = core.Material(
        name="chrome",
        albedo=(0.0, 0.0, 0.0),
        specular=True,
        fresnel=core.Fresnel(model="schlick", r0=(0.9, 0.9, 0.9)),
    )
    teapot = scene.add_object(
        "teapot", core.make_teapot(), scene.add_material(chrome), core.teapot_part_names()
    )
    camera = core.Camera((0.0, 0.25, 0.6), (0.0, 0.08, 0.0), vertical_fov_degrees=30.0, width=320, height=320)
    tracer = core.Tracer(scene, core.TracerOptions(indirect="none"))
    samples = tracer.trace_layers(camera, teapot, core.TraceOptions(samples_per_pixel=16)).samples

    layout = core.CubePyramidLayout(128)
    matrix = core.build_rendering_matrix(samples, 0, core.Proxy.infinite(), layout)
    target = matrix.row_means(np.asarray(samples.shells[1].radiance)[:, :3])
    peer = scipy.sparse.csr_array(
        (matrix.weights, matrix.texels.astype(np.int32), matrix.row_offsets.astype(np.int32)),
        shape=(matrix.rows, matrix.columns),
    )

    x = np.random.default_rng(1).random((matrix.columns, 3), dtype=np.float32)
    reference = peer.astype(np.float64) @ x.astype(np.float64)
    ours, theirs = (float(np.abs(b - reference).max()) for b in (matrix.multiply(x), peer @ x))
    require(ours < 1e-5, f"A x is off by {ours:.1e}")
    yield Case(
        case=f"A x, {matrix.nonzeros} entries, 3 channels",
        unit="ms",
        ours=1e3 * seconds(lambda: matrix.multiply(x)),
        peer=1e3 * seconds(lambda: peer @ x),
        peer_name="SciPy CSR",
        error_ours=ours,
        error_peer=theirs,
    )

    weights = core.display_row_weights(matrix, 16, target)
    root = np.sqrt(weights[:, :1])
    options = core.SolveOptions(
        smoothness=0.0, level_agreement=0.0, tolerance=1e-30, max_iterations=ITERATIONS
    )
    weighted = (peer * root).tocsc()
    length = np.sqrt(weighted.multiply(weighted).sum(axis=0)).ravel()
    scale = np.divide(1.0, length, out=np.zeros_like(length), where=length > 0).astype(np.float32)
    scaled = (weighted * scale).tocsr()
    right = root * target
    start = np.zeros((matrix.columns, 3), np.float32)

    def solve() -> FloatArray:
        solver = core.MapSolver([(matrix, [(0, 1.0)])], [layout], options=options)
        return solver.solve([target], [weights], initial=start)[0]

    def solve_peer() -> FloatArray:
        channels = [
            lsqr(scaled, right[:, c], atol=0, btol=0, conlim=0, iter_lim=ITERATIONS)[0] for c in range(3)
        ]
        solution: FloatArray = np.maximum(np.stack(channels, axis=1) * scale[:, None], 0.0)
        return solution

    def residual(solution: FloatArray) -> float:
        return float(np.linalg.norm(weighted @ solution - right) / np.linalg.norm(right))

    ours, theirs = residual(solve()), residual(solve_peer())
    # The same Krylov space, in float32 and float64, and both clamp to radiance that is not negative.
    require(ours < 1.1 * theirs, f"relative residual {ours:.3g} against {theirs:.3g}")
    yield Case(
        case=f"least squares, {ITERATIONS} steps, 3 channels",
        unit="ms",
        ours=1e3 * seconds(solve, 3),
        peer=1e3 * seconds(solve_peer, 3),
        peer_name="SciPy LSQR",
        error_ours=ours,
        error_peer=theirs,
    )


if __name__ == "__main__":
    run("Rendering matrix and solver against SciPy.", cases)

"""Rendering matrix and solver against SciPy and Eigen, on views of the teapot in its room.

Cases, of so many pixels, texels of a face and lookups a pixel: building the matrix, beside its product `A x`;
least squares without regularisation, from zero, for three channels of random maps shown through the matrix,
to the residual that our solver reaches; and a step of the solver, beside what the same bytes take at the
bandwidth of the memory.

SciPy's LSMR and LSQR, Eigen's LeastSquaresConjugateGradient, and conjugate gradients with an incomplete
Cholesky factor on the normal equations take one right-hand side at a time, of columns scaled to unit length,
as is usual; SciPy's once more of columns divided by the roots of the row sums of AᵀA, our own preconditioner
(`our scaling`). Solves and steps are of one thread and in its processor time, which other
programs disturb less than a clock; script/bench keeps SciPy's BLAS to that thread, since waiting for others
takes it as long again. SciPy's are shown once more beside ours on all cores, both by the clock. The error is
the norm of the residual over that of b; of `A x`, the largest against float64.
"""

import argparse
import json
import struct
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse
from numpy.typing import NDArray
from scipy.sparse.linalg import lsmr, lsqr

from benchmarks._build import built_program
from benchmarks._report import Case, report, require, seconds
from mirrorbake import _core as core

FloatArray = NDArray[np.float32]

TOLERANCE = 2e-3
"""Of our solver: the image has converged by then."""
BARE = {"smoothness": 0.0, "level_agreement": 0.0, "prior_weight": 0.0}
GRIDS = {
    1: core.run_time_model("Web1"),
    4: core.run_time_model("Web"),
    16: core.run_time_model("Reference"),
}


@dataclass(frozen=True)
class Problem:
    """A view of the teapot that shows random maps."""

    name: str
    samples: core.SurfaceSamples
    layout: core.TexelTopology
    run_time: core.RunTimeModel

    @staticmethod
    def of(pixels: int, size: int, lookups: int) -> "Problem":
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
        camera = core.Camera(
            (0.0, 0.25, 0.6), (0.0, 0.08, 0.0), vertical_fov_degrees=30.0, width=pixels, height=pixels
        )
        tracer = core.Tracer(scene, core.TracerOptions(indirect="none"))
        run_time = GRIDS[lookups]
        samples = tracer.trace_visibility(camera, teapot, places=list(run_time.places))
        name = f"{pixels}² pixels, {size}² faces, {lookups} lookups"
        return Problem(name, samples, core.TexelTopology.cube(size), run_time)

    def build(self) -> core.RenderingMatrix:
        return core.build_rendering_matrix(self.samples, 0, core.Proxy.infinite(), self.layout, self.run_time)


def scipy_matrix(matrix: core.RenderingMatrix) -> scipy.sparse.csr_array:
    return scipy.sparse.csr_array(
        (matrix.weights, matrix.texels.astype(np.int32), matrix.row_offsets.astype(np.int32)),
        shape=(matrix.rows, matrix.columns),
    )


def scaled_columns(matrix: scipy.sparse.csr_array, squares: NDArray[Any]) -> scipy.sparse.csr_array:
    """Divide columns by the roots of `squares`. In float32 LSMR comes to rest far above our residual."""
    length = np.sqrt(squares)
    scale = np.divide(1.0, length, out=np.zeros_like(length), where=length > 0.0)
    scaled = matrix.astype(np.float64)
    scaled.data *= scale[matrix.indices]
    return scaled


def product(problem: Problem, matrix: core.RenderingMatrix, peer: scipy.sparse.csr_array) -> Iterator[Case]:
    x = np.random.default_rng(1).random((matrix.columns, 3), dtype=np.float32)
    reference = peer.astype(np.float64) @ x.astype(np.float64)
    ours, theirs = (float(np.abs(b - reference).max()) for b in (matrix.multiply(x), peer @ x))
    require(ours < 1e-5, f"A x is off by {ours:.1e}")
    multiply = seconds(lambda: matrix.multiply(x), 3)
    yield Case(
        case=f"A x, {problem.name}, {matrix.nonzeros} entries, 3 channels",
        unit="ms",
        ours=1e3 * multiply,
        peer=1e3 * seconds(lambda: peer @ x, 3),
        peer_name="SciPy CSR",
        error_ours=ours,
        error_peer=theirs,
    )
    yield Case(
        case=f"building A, {problem.name}",
        unit="ms",
        ours=1e3 * seconds(problem.build, 2),
        peer=1e3 * multiply,
        peer_name="our A x",
        error_ours=ours,
        error_peer=ours,
    )


def solver_of(matrix: core.RenderingMatrix, problem: Problem, tolerance: float, steps: int) -> core.MapSolver:
    options = core.SolveOptions(**BARE, tolerance=tolerance, max_iterations=steps)
    return core.MapSolver([(matrix, [(0, 1.0)])], [problem.layout], options=options)


def timed(function: Callable[[], object]) -> float:
    """Return the processor time that it takes on one thread, this one."""
    with core.ThreadLimit(1):
        start = time.thread_time()
        function()
        return time.thread_time() - start


def solves(
    problem: Problem,
    matrix: core.RenderingMatrix,
    peer: scipy.sparse.csr_array,
    bandwidth: float,
    with_eigen: bool,
) -> Iterator[Case]:
    # Off zero, so that our bounds hold nothing that the others do not know of.
    truth = 0.5 + np.random.default_rng(2).random((matrix.columns, 3), dtype=np.float32)
    target = matrix.multiply(truth)
    weights = np.ones_like(target)
    start = np.zeros((matrix.columns, 3), np.float32)

    def solve(solver: core.MapSolver) -> tuple[FloatArray, core.SolveReport]:
        return solver.solve([target], [weights], initial=start)

    def whole() -> tuple[FloatArray, core.SolveReport]:
        return solve(solver_of(matrix, problem, TOLERANCE, 2000))

    def residual(solution: FloatArray) -> float:
        return float(np.linalg.norm(peer @ solution - target) / np.linalg.norm(target))

    solution, found = whole()
    by_clock = seconds(whole, 3)
    require(found.converged, f"our solver stopped after {found.iterations} steps")
    reached = residual(solution)
    ours = min(timed(whole) for _ in range(2))
    unit = scaled_columns(peer, np.bincount(peer.indices, peer.data.astype(float) ** 2, peer.shape[1]))
    even = scaled_columns(peer, peer.T @ (peer @ np.ones(peer.shape[1])))

    def case(name: str, seconds_taken: float, error: float) -> Case:
        return Case(
            case=f"solve, {problem.name}, {found.iterations} steps",
            unit="ms",
            ours=1e3 * ours,
            peer=1e3 * seconds_taken,
            peer_name=name,
            error_ours=reached,
            error_peer=error,
        )

    peers = [
        (name, solver, system) for system in (unit, even) for name, solver in (("LSMR", lsmr), ("LSQR", lsqr))
    ]
    for name, peer_solver, scaled in peers:
        name += ", our scaling" if scaled is even else ""
        limit = {"maxiter": 5000} if peer_solver is lsmr else {"iter_lim": 5000}
        began, clock = time.thread_time(), time.perf_counter()
        answers = [
            peer_solver(scaled, target[:, c], atol=0, btol=reached, conlim=0, **limit)[0] for c in range(3)
        ]
        taken, clock = time.thread_time() - began, time.perf_counter() - clock
        error = float(np.linalg.norm(scaled @ np.stack(answers, axis=1) - target) / np.linalg.norm(target))
        require(error < 1.1 * reached, f"{name}'s residual is {error:.3g}, ours {reached:.3g}")
        yield case(f"SciPy {name}", taken, error)
        yield replace(
            case(f"SciPy {name}", clock, error),
            case=f"the same on {core.thread_count()} threads, by the clock",
            ours=1e3 * by_clock,
        )
    for row in eigen(matrix, target, reached) if with_eigen else []:
        require(row["residual"] < 1.2 * reached, f"{row['solver']}: residual {row['residual']:.3g}")
        name = f"Eigen {row['solver']}, {row['iterations']} steps"
        yield case(name, row["setup_s"] + row["solve_s"], row["residual"])
    yield step(problem, matrix, bandwidth, solve, reached)


def step(
    problem: Problem,
    matrix: core.RenderingMatrix,
    bandwidth: float,
    solve: Callable[[core.MapSolver], object],
    error: float,
) -> Case:
    """Time a step by two runs of different length, beside its bytes at the bandwidth of the memory."""
    few, many = 20, 60
    # A tolerance that is not met: all steps are taken. The last round's end is in both.
    solvers = [solver_of(matrix, problem, 1e-30, steps) for steps in (few, many)]
    times = [min(timed(partial(solve, solver)) for _ in range(4)) for solver in solvers]
    seen = len(np.unique(matrix.texels))
    # Of two entries beside each other a number, 2 bytes, and two weights, 8; a row's count and weights; of an
    # unknown three floats, as often as a step reads or writes a vector at the least, and twice the
    # preconditioner, of 2 bytes a channel. What several bands read is read and given back by each of
    # them; that is not counted.
    first = np.zeros(matrix.nonzeros, bool)
    first[matrix.row_offsets[:-1]] = True
    first[1:] |= np.diff(matrix.texels.astype(np.int64)) != 1
    runs = np.diff(np.flatnonzero(np.append(first, True)))
    moved = 10 * int(((runs + 1) // 2).sum()) + (4 + 16) * matrix.rows + (10 * 12 + 2 * 6) * seen
    return Case(
        case=f"a step, {problem.name}, {moved / 1e6:.0f} MB",
        unit="ms",
        ours=1e3 * (times[1] - times[0]) / (many - few),
        peer=1e3 * moved / bandwidth,
        peer_name=f"{bandwidth / 1e9:.1f} GB/s",
        error_ours=error,
        error_peer=error,
    )


def run_program(*arguments: object) -> list[dict[str, Any]]:
    program = built_program("bench_solvers", "bench")
    done = subprocess.run([program, *map(str, arguments)], stdout=subprocess.PIPE, text=True, check=False)
    require(done.returncode == 0, f"bench_solvers {arguments[0]} failed")
    return [json.loads(line) for line in done.stdout.splitlines()]


def eigen(matrix: core.RenderingMatrix, target: FloatArray, reached: float) -> list[dict[str, Any]]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "system.bin"
        with path.open("wb") as file:
            file.write(struct.pack("=QQQd", matrix.rows, matrix.columns, matrix.nonzeros, reached))
            file.write(np.asarray(matrix.row_offsets, np.uint64).tobytes())
            file.write(np.asarray(matrix.texels, np.uint32).tobytes())
            file.write(np.asarray(matrix.weights, np.float32).tobytes())
            file.write(np.ascontiguousarray(target, np.float32).tobytes())
        return run_program(path)


def cases(pixels: list[int], faces: list[int], lookups: list[int], with_eigen: bool = True) -> Iterator[Case]:
    bandwidth = float(run_program("bandwidth")[0]["bytes_per_second"])
    for side in pixels:
        for size in faces:
            for count in lookups:
                problem = Problem.of(side, size, count)
                matrix = problem.build()
                peer = scipy_matrix(matrix)
                yield from product(problem, matrix, peer)
                yield from solves(problem, matrix, peer, bandwidth, with_eigen)


def main() -> None:
    parser = argparse.ArgumentParser(description="Rendering matrix and solver against SciPy and Eigen.")
    parser.add_argument("--json", action="store_true", help="print one JSON object per case")
    parser.add_argument("--pixels", type=int, nargs="+", default=[512], help="along a side of the view")
    parser.add_argument("--faces", type=int, nargs="+", default=[256], help="texels along a side of a face")
    parser.add_argument("--lookups", type=int, nargs="+", default=[1, 4, 16], choices=sorted(GRIDS))
    parser.add_argument(
        "--without-eigen",
        action="store_true",
        help="leave out Eigen, whose incomplete Cholesky factor takes a minute at 16 lookups",
    )
    arguments = parser.parse_args()
    rows = cases(arguments.pixels, arguments.faces, arguments.lookups, not arguments.without_eigen)
    report(rows, as_json=arguments.json)


if __name__ == "__main__":
    main()

"""One sample of a PEM: a function of the scene and the sample's number, and of nothing else."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.pem.run_time import lookups_of, model_of
from mirrorbake.pem.store import SolverReport, Timings
from mirrorbake.pem.view_images import ViewImages, images_of_trace
from mirrorbake.scene.pose import Pose

if TYPE_CHECKING:
    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.shells import Part, Shell
    from mirrorbake.pem.store import Contents
    from mirrorbake.scene.parameters import Point
    from mirrorbake.scene.stage import Stage

DIFFUSE_RAYS = 1024
"""Gather rays per vertex of the diffuse layer."""


@dataclass(frozen=True)
class BakedSample:
    """What is stored of a sample."""

    maps: dict[tuple[str, str], FloatArray]
    """Pyramids (texels, C) by part and shell."""
    images: ViewImages
    irradiance: FloatArray | None
    """(V, 3), where it differs from sample to sample."""
    timings: Timings
    reports: dict[tuple[str, str], SolverReport]


class SampleBaker:
    """Bakes samples of a planned stage; keeps what they share, never what one leaves for another."""

    def __init__(self, stage: Stage, contents: Contents) -> None:
        infer = stage.config.infer
        self._stage = stage
        self._header = contents.header
        self._capture = _core.build_cube_pyramid(contents.capture)
        self._local_triangles = contents.local_triangles
        self._layout = _core.CubePyramidLayout(contents.header.map_size)
        self._lookup = lookups_of(infer.footprint_scale)
        self._solve = _core.SolveOptions(
            smoothness=infer.smoothness,
            level_agreement=infer.level_agreement,
            prior_weight=infer.prior_weight,
            tolerance=infer.tolerance,
            max_iterations=infer.iterations,
        )

    def bake(self, index: int) -> BakedSample:
        """Bake a sample."""
        return self.bake_at(self._header.space.sample(index))

    def bake_at(self, point: Point) -> BakedSample:
        """Bake what the sample of a point would be."""
        start = time.perf_counter()
        stage = self._stage.at(point)
        trace = self._stage.trace(point)
        irradiance = None
        if self._header.space.changes_scene and self._header.plan.has_diffuse:
            irradiance = stage.tracer.vertex_irradiance(
                stage.built.reflector, DIFFUSE_RAYS, stage.config.trace.seed
            )
        capture = self._capture_of(stage)
        seconds = [time.perf_counter() - start, 0.0, 0.0]
        maps: dict[tuple[str, str], FloatArray] = {}
        reports: dict[tuple[str, str], SolverReport] = {}
        pose = Pose.of(self._stage.config, self._header.space.scene_coordinates(point).get("motion", 0.0))
        if self._stage.config.infer.fit == "display":
            start = time.perf_counter()
            maps, reports = self._fit_display(point, trace.samples, pose, capture)
            seconds[2] = time.perf_counter() - start
            return BakedSample(maps, images_of_trace(trace), irradiance, Timings(*seconds), reports)
        for number, part in enumerate(self._header.parts):
            for shell in part.shells:
                start = time.perf_counter()
                off_hull = self._local_triangles if shell.polygons == "off hull" else None
                matrix = _core.build_rendering_matrix(
                    trace.samples, number, shell.proxy_at(pose), self._layout, self._lookup, off_hull
                )
                incident = _incident(trace.samples, part, shell)
                target = matrix.average(incident)
                middle = time.perf_counter()
                prior = capture if shell.rule == "rest" else None
                name = (part.name, shell.name)
                maps[name], reports[name] = self._infer(matrix, target, prior)
                seconds[1] += middle - start
                seconds[2] += time.perf_counter() - middle
        return BakedSample(maps, images_of_trace(trace), irradiance, Timings(*seconds), reports)

    def _capture_of(self, stage: Stage) -> FloatArray:
        if not stage.place:
            return self._capture
        origin = self._header.plan.distant["origin"]
        captured = stage.tracer.capture_cube(
            origin, self._header.map_size, [stage.built.reflector], self._stage.options
        )
        return _core.build_cube_pyramid(captured)

    def _fit_display(
        self, point: Point, samples: _core.SurfaceSamples, pose: Pose, capture: FloatArray
    ) -> tuple[dict[tuple[str, str], FloatArray], dict[tuple[str, str], SolverReport]]:
        header = self._header
        model = model_of(header.run_time)
        lookups = self._stage.visibility(point, model.places)
        targets = _core.ViewTargets(samples.width, samples.height, len(header.parts), len(samples.shells))
        targets.add(samples)
        numbers = {entry.name: number for number, entry in enumerate(header.maps)}
        prior = np.zeros((len(numbers), self._layout.texels, 3), np.float32)
        parts = []
        for part in header.parts:
            shells = []
            for shell in part.shells:
                off_hull = self._local_triangles if shell.polygons == "off hull" else None
                shells.append(_core.FitShell(shell.proxy_at(pose), numbers[shell.map], off_hull))
                if shell.rule == "rest":
                    prior[numbers[shell.map]] = capture
            parts.append(shells)
        texels, passes = _core.fit_display(
            [_core.DisplayView(lookups, targets)],
            parts,
            [_core.TexelTopology.cube(header.map_size)] * len(numbers),
            run_time=model,
            options=_core.DisplayFitOptions(solve=self._solve),
            prior=prior.reshape(-1, 3) if self._stage.config.infer.prior == "captured" else None,
        )
        stacked = np.asarray(texels).reshape(len(numbers), -1, 4)
        last = passes[-1]
        report = SolverReport(last.iterations, float(last.relative_gradient), last.converged)
        maps = {}
        for name in header.map_names():
            number = header.map_of(*name)
            maps[name] = np.ascontiguousarray(stacked[number, :, : header.maps[number].channels])
        return maps, dict.fromkeys(maps, report)

    def _infer(
        self, matrix: _core.RenderingMatrix, target: FloatArray, prior: FloatArray | None
    ) -> tuple[FloatArray, SolverReport]:
        # The solver starts from the captured map, never from a neighbour's maps as they were baked.
        if matrix.rows == 0:
            none = np.zeros((self._layout.texels, target.shape[1]), np.float32)
            return none if prior is None else np.asarray(prior), SolverReport(0, 0.0, True)
        weights = _core.display_row_weights(matrix, self._stage.options.samples_per_pixel, target)
        solver = _core.MapSolver([(matrix, [(0, 1.0)])], [self._layout], options=self._solve)
        captured = self._stage.config.infer.prior == "captured"
        texels, report = solver.solve([target], [weights], prior if captured else None, prior)
        return np.asarray(texels), SolverReport(
            report.iterations, float(report.relative_gradient), report.converged
        )


def _incident(samples: _core.SurfaceSamples, part: Part, shell: Shell) -> FloatArray:
    """Return the radiance that a shell holds, per sample; a single shell holds all that arrives."""
    local = np.asarray(samples.shells[0].radiance)
    if shell.rule == "itself":
        return local
    distant = np.asarray(samples.shells[1].radiance)[:, :3]
    return distant if len(part.shells) > 1 else local[:, :3] + (1.0 - local[:, 3:]) * distant

"""One sample of a PEM: a function of the scene and the sample's number, and of nothing else."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.around import places_around
from mirrorbake.bake.body_light import irradiance_of
from mirrorbake.bake.captured import captured_pyramids
from mirrorbake.bake.fit import DisplayFitter, FitView, solve_options
from mirrorbake.bake.static_set import static_views
from mirrorbake.bake.targets import ViewTracer
from mirrorbake.pem.pyramid import coarse_end
from mirrorbake.pem.run_time import lookups_of
from mirrorbake.pem.store import SolverReport, Timings
from mirrorbake.pem.view_images import ViewImages, images_of_trace
from mirrorbake.scene.config_axes import arranged
from mirrorbake.scene.neighbourhood import beside, block, views_around
from mirrorbake.scene.pose import AT_REST

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.store import Contents
    from mirrorbake.scene.parameters import Point
    from mirrorbake.scene.pose import Pose
    from mirrorbake.scene.stage import Stage

    Maps = dict[tuple[str, str], FloatArray]
    Reports = dict[tuple[str, str], SolverReport]


class Probing(NamedTuple):
    """What probing the views of fits took and left, with `infer.matrix = "probed"`."""

    renderings: int = 0
    """Pictures that the renderer drew."""
    most_of_a_map: int = 0
    """The most that one map of a view took at a time."""
    unresolved: int = 0
    """Pixels of the object that were left out, since the pictures do not tell what they read."""

    @staticmethod
    def of(report: _core.ProbingReport | None) -> Probing:
        """Return the same of a fit."""
        if report is None:
            return Probing()
        return Probing(report.renderings, report.most_of_a_map, report.unresolved)

    def plus(self, other: Probing) -> Probing:
        """Return what both took."""
        return Probing(
            self.renderings + other.renderings,
            max(self.most_of_a_map, other.most_of_a_map),
            self.unresolved + other.unresolved,
        )


NOTHING_PROBED = Probing()


@dataclass(frozen=True)
class BakedSample:
    """What is stored of a sample."""

    maps: Maps
    """Pyramids (texels, C) by part and shell."""
    images: ViewImages
    irradiance: FloatArray | None
    """(V, 3) at vertices or (S², 3) in a lightmap, (…, 6) with the backs, where samples differ in it."""
    timings: Timings
    reports: Reports
    rejected: int = 0
    """Samples of the views fitted that were left out, since their light was not finite."""
    probing: Probing = NOTHING_PROBED


class SampleBaker:
    """Bakes samples of a planned stage; keeps what they share, never what one leaves for another."""

    def __init__(self, stage: Stage, contents: Contents) -> None:
        self._stage = stage
        self._header = contents.header
        self._captured = captured_pyramids(stage, contents.header, contents.capture)
        self._static_maps = contents.static_maps
        self._sides = contents.lit_sides
        self._local_triangles = contents.local_triangles
        self._topologies = contents.header.topologies
        self._infer = stage.config.infer
        if self._infer.fit == "display":
            self._tracer = ViewTracer(stage, contents.header, contents.local_triangles)
            self._fitter = DisplayFitter(contents.header, self._infer, contents.local_triangles)

    def bake(self, index: int) -> BakedSample:
        """Bake a sample."""
        start = time.perf_counter()
        point = self._header.space.sample(index)
        stage = self._stage.at(point)
        irradiance = None
        if self._header.space.changes_scene and self._header.plan.has_diffuse:
            irradiance = irradiance_of(stage, self._sides, self._header.lightmap)
        captured = captured_pyramids(stage, self._header) if stage.place else self._captured
        pose = arranged(self._stage.config, self._header.space.scene_coordinates(point)).pose
        if self._infer.fit == "display":
            return self._fit_display(index, stage, pose, captured, irradiance, start)
        return self._fit_layers(point, pose, captured, irradiance, start)

    def _fit_display(
        self,
        index: int,
        stage: Stage,
        pose: Pose,
        captured: Mapping[str, FloatArray],
        irradiance: FloatArray | None,
        start: float,
    ) -> BakedSample:
        header, tracer = self._header, self._tracer
        own = tracer.at(header.space.sample(index))
        if header.is_static_set:
            nodes, views = [index], static_views(tracer, stage)
        else:
            nodes, views = self.with_neighbours(index)
        middle = time.perf_counter()
        texels, report = self._fitter.fit(views, pose, self._prior(captured), len(nodes))
        maps = self._named(texels[nodes.index(index)])
        seconds = Timings(middle - start, 0.0, time.perf_counter() - middle)
        rejected = sum(one.view.targets.rejected for one in views)
        reports = dict.fromkeys(maps, report)
        probing = self._fitter.probing
        return BakedSample(
            maps,
            own.images,
            irradiance,
            seconds,
            reports,
            rejected,
            Probing.of(probing),
        )

    def fit(self, nodes: Sequence[int], views: Sequence[FitView]) -> dict[int, Maps]:
        """Fit the maps of several nodes together, as `with_neighbours` names them and what they see.

        The scene is at rest.
        """
        texels, _ = self._fitter.fit(views, AT_REST, self._prior(self._captured), len(nodes))
        return {node: self._named(mine) for node, mine in zip(nodes, texels, strict=True)}

    def _prior(self, captured: Mapping[str, FloatArray]) -> list[FloatArray] | None:
        if self._infer.prior != "captured":
            return None
        if self._static_maps is not None:
            return [np.ascontiguousarray(texels[:, :3]) for texels in self._static_maps]
        return self._fitter.captured_prior(captured)

    def _named(self, texels: Sequence[FloatArray]) -> Maps:
        header, maps = self._header, {}
        for name in header.map_names():
            number = header.map_of(*name)
            maps[name] = np.ascontiguousarray(texels[number][:, : header.maps[number].channels])
        return maps

    def with_neighbours(self, index: int) -> tuple[list[int], list[FitView]]:
        """Return the nodes of the fit of a sample, and what it sees."""
        space, infer, trace = self._header.space, self._infer, self._tracer.at
        assert infer.neighbours is not None, "the scene has to be planned first"
        assert self._stage.config.views.traced is not None, "the scene has to be planned first"
        per_cell = self._stage.config.views.traced
        between = views_around(space, index, per_cell, self._stage.config.trace.seed)
        nodes = block(space, index) if between else [index]
        views = [FitView(trace(space.sample(node)), ((i, 1.0),)) for i, node in enumerate(nodes)]
        number = {node: i for i, node in enumerate(nodes)}
        for view in between:
            shares = tuple((number[node], weight) for node, weight in view.nodes)
            views.append(FitView(trace(view.point), shares))
        if infer.neighbours > 0.0:
            mine = ((number[index], 1.0),)
            views += [
                FitView(trace(space.sample(other)), mine, infer.neighbours, layer_rows=False)
                for other in beside(space, index)
            ]
        count = self._stage.config.views.around
        assert count is not None, "the scene has to be planned first"
        if self._stage.config.views.kind == "arc":
            for place in places_around(self._stage.built.cameras, space.sample(index), count):
                beside_it = self._tracer.around(place.azimuth, place.elevation)
                if beside_it is not None:
                    mine = ((number[index], 1.0),)
                    views.append(FitView(beside_it, mine, place.weight, layer_rows=False))
        return nodes, views

    def _fit_layers(
        self,
        point: Point,
        pose: Pose,
        captured: Mapping[str, FloatArray],
        irradiance: FloatArray | None,
        start: float,
    ) -> BakedSample:
        trace = self._stage.trace(point)
        lookup = lookups_of(self._infer.footprint_scale)
        seconds = [time.perf_counter() - start, 0.0, 0.0]
        maps: Maps = {}
        reports: Reports = {}
        for entry, topology in zip(self._header.maps, self._topologies, strict=True):
            start = time.perf_counter()
            matrices, targets, prior = [], [], None
            readers = []
            for number, (part, ends) in enumerate(zip(self._header.parts, self._header.stacks, strict=True)):
                for place, shell in enumerate(part.shells):
                    if shell.map != entry.name:
                        continue
                    readers.append((part.name, shell.name))
                    # Channels beyond colour have no prior.
                    if entry.channels == 3 and shell.name in captured:
                        prior = coarse_end(captured[shell.name], topology.texels)
                    off_hull = self._local_triangles if shell.polygons == "off hull" else None
                    matrix = _core.build_rendering_matrix(
                        trace.samples, number, shell.proxy_at(pose), topology, lookup, off_hull
                    )
                    if matrix.rows:
                        matrices.append(matrix)
                        first = 0 if place == 0 else ends[place - 1] + 1
                        targets.append(
                            matrix.row_means(_incident(trace.samples, first, ends[place], entry.channels))
                        )
            middle = time.perf_counter()
            texels, report = self._infer_layer(topology, matrices, targets, prior, entry.channels)
            maps.update(dict.fromkeys(readers, texels))
            reports.update(dict.fromkeys(readers, report))
            seconds[1] += middle - start
            seconds[2] += time.perf_counter() - middle
        return BakedSample(maps, images_of_trace(trace), irradiance, Timings(*seconds), reports)

    def _infer_layer(
        self,
        topology: _core.TexelTopology,
        matrices: list[_core.RenderingMatrix],
        targets: list[FloatArray],
        prior: FloatArray | None,
        channels: int,
    ) -> tuple[FloatArray, SolverReport]:
        # The solver starts from the captured map, never from a neighbour's maps as they were baked.
        if not matrices:
            none = np.zeros((topology.texels, channels), np.float32)
            return none if prior is None else np.asarray(prior), SolverReport(0, 0.0, True)
        weights = [
            _core.display_row_weights(matrix, self._stage.options.samples_per_pixel, target)
            for matrix, target in zip(matrices, targets, strict=True)
        ]
        solver = _core.MapSolver(
            [(matrix, [(0, 1.0)]) for matrix in matrices],
            [topology],
            options=solve_options(self._infer),
        )
        captured = self._infer.prior == "captured"
        texels, report = solver.solve(targets, weights, prior if captured else None, prior)
        return np.asarray(texels), SolverReport(
            report.iterations, float(report.relative_gradient), report.converged
        )


def _incident(samples: _core.SurfaceSamples, first: int, last: int, channels: int) -> FloatArray:
    """Return the light of the traced shells from one to another, per sample (n, channels)."""
    light = np.asarray(samples.shells[last].radiance)[:, :channels]
    for number in range(last - 1, first - 1, -1):
        layer = np.asarray(samples.shells[number].radiance)
        light = layer[:, :channels] + (1.0 - layer[:, 3:]) * light
    return light

"""Maps of one layer, inferred for the views of a PEM: what its layers are compared with."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.bake.fit import solve_options
from mirrorbake.pem.pyramid import pyramid_of
from mirrorbake.pem.run_time import blended
from mirrorbake.scene.texture_coordinates import has_own_texels

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.opened import OpenedPem
    from mirrorbake.scene.config_infer import Infer
    from mirrorbake.scene.stage import Stage

MOST_KEPT = 16
"""Samples whose maps are kept in memory: views at the same ones come apart in an evaluation."""
TARGETS_KEPT = 3
"""Traced views in memory, for all that are inferred for them."""
BATCH = 1 << 22
"""Samples that are held at a time, were the object to fill the frame."""

TOLERANCE = 1e-3
"""Of their fits: a PEM is compared with the best that such maps can do, not with where its fit may stop."""


def _solve_options(infer: Infer) -> _core.SolveOptions:
    options = solve_options(infer)
    options.tolerance = min(options.tolerance, TOLERANCE)
    return options


@dataclass(frozen=True)
class Target:
    """A view that maps of one layer should show."""

    lookups: _core.SurfaceSamples
    """Where the run time of the PEM sees the reflector."""
    light: _core.ViewTargets
    samples: _core.SurfaceSamples | None
    """With their light, of a PEM whose layers were fitted to the traced samples themselves."""


class Targets:
    """The views at the samples of a PEM, with all that the object reflects in one shell."""

    def __init__(self, pem: OpenedPem) -> None:
        self._pem = pem
        self._kept: OrderedDict[int, Target] = OrderedDict()

    def at(self, index: int) -> Target:
        """Trace the view of a sample, as the bake did."""
        if index not in self._kept:
            while len(self._kept) >= TARGETS_KEPT:
                self._kept.popitem(last=False)
            self._kept[index] = self._trace(index)
        return self._kept[index]

    def _trace(self, index: int) -> Target:
        pem = self._pem
        point = pem.space.sample(index)
        stage = pem.stage.at(point)
        camera, reflector = stage.built.cameras.camera(point), stage.built.reflector
        light = _core.ViewTargets(camera.width, camera.height, len(pem.store.header.parts), 1)
        if stage.config.infer.fit == "layers":
            options = stage.options
            options.shells = [_core.ShellRule("all")]
            samples = stage.tracer.trace_layers(camera, reflector, options).samples
            return Target(samples, light, samples)
        rows = max(1, BATCH // (camera.width * stage.options.samples_per_pixel))
        for y in range(0, camera.height, rows):
            options = stage.options_of((0, y, camera.width, min(rows, camera.height - y)))
            options.shells = [_core.ShellRule("all")]
            light.add(stage.tracer.trace_layers(camera, reflector, options).samples, 0, y)
        lookups = stage.tracer.trace_visibility(camera, reflector, stage.options, pem.run_time.places)
        return Target(lookups, light, None)


@dataclass(frozen=True)
class Layer:
    """Where maps of one layer lie."""

    proxy: _core.Proxy
    topologies: Sequence[_core.TexelTopology]
    map_of_part: Sequence[int]
    """Numbers of `topologies`."""
    prior: FloatArray | None
    """RGB (M, T, 3) of all maps, what no view determines falls back to; None: a smooth fill."""
    placed: Callable[[Stage, _core.SurfaceSamples], _core.SurfaceSamples]
    """Samples as the maps are read at them."""


def layer_at_infinity(pem: OpenedPem) -> Layer:
    """A map for every part on a sphere at infinity: [PEM] figure 6."""
    header = pem.store.header
    count = len(header.parts)
    capture = pyramid_of(pem.store.read_capture(), header.projection)
    return Layer(
        proxy=_core.Proxy.infinite(header.static["infinite"]["origin"]),
        topologies=[header.topology] * count,
        map_of_part=range(count),
        prior=np.stack([capture] * count),
        placed=lambda stage, samples: samples,
    )


def layer_on_surface(pem: OpenedPem) -> Layer | None:
    """A texture on the surface, the parameterised texture map of [PEM] figure 7; None: it has no coordinates.

    It has as many texels as all maps of a sample, rounded down to a power of two along its side.
    """
    header, built = pem.store.header, pem.stage.built
    mesh = built.scene.object_mesh(built.reflector)
    uvs = np.asarray(mesh.uvs)
    if not has_own_texels(built.positions, built.triangles, uvs):
        return None
    coordinates = np.concatenate([uvs, np.zeros((len(uvs), 1), np.float32)], axis=1)

    def placed(stage: Stage, samples: _core.SurfaceSamples) -> _core.SurfaceSamples:
        return _core.with_vertex_lookups(samples, stage.built.positions, built.triangles, coordinates)

    texels = sum(topology.texels for topology in header.topologies)
    # All levels of a square atlas have a third more texels than the finest.
    side = 1 << max((3 * texels // 4).bit_length() - 1, 0) // 2
    return Layer(
        proxy=_core.Proxy.infinite((0.0, 0.0, 0.0)),
        topologies=[_core.TexelTopology.atlas(side, side)],
        map_of_part=[0] * len(header.parts),
        prior=None,
        placed=placed,
    )


class SingleMaps:
    """Draws a PEM's views from maps of one layer.

    A sample's maps are inferred when they are first drawn, by the fit and the settings of the PEM, from the
    sample's own view alone; between samples they are blended.
    """

    def __init__(self, pem: OpenedPem, targets: Targets, layer: Layer) -> None:
        self._pem, self._targets, self._layer = pem, targets, layer
        self._maps: dict[int, list[FloatArray]] = {}

    def render(
        self, point: tuple[float, ...], samples: _core.SurfaceSamples, model: _core.RunTimeModel
    ) -> FloatArray:
        """Draw the reflector: radiance (H, W, 3).

        Parameters
        ----------
        point
            Of the parameter space.
        samples
            Where the camera sees the reflector.
        model
            How maps are read.
        """
        shares = self._pem.space.neighbours(point)
        for index, _ in shares:
            if index not in self._maps:
                if len(self._maps) >= MOST_KEPT:
                    self._maps.clear()
                self._maps[index] = self._infer(index)
        layer = self._layer
        maps = [
            blended([(self._maps[i][number], weight) for i, weight in shares])
            for number in range(len(layer.topologies))
        ]
        parts = [
            [_core.ShellMap(layer.proxy, layer.topologies[number], maps[number])]
            for number in layer.map_of_part
        ]
        placed = layer.placed(self._pem.stage.at(point), samples)
        return self._pem.run_time.render_parts(parts, placed, point, model)

    def _infer(self, index: int) -> list[FloatArray]:
        layer, target = self._layer, self._targets.at(index)
        stage = self._pem.stage.at(self._pem.space.sample(index))
        lookups = layer.placed(stage, target.lookups)
        sizes = [topology.texels for topology in layer.topologies]
        if target.samples is not None:
            texels = self._fit_layers(lookups, target.samples)
        else:
            infer = stage.config.infer
            assert infer.passes is not None, "the scene has to be planned first"
            shells = [[_core.FitShell(layer.proxy, number)] for number in layer.map_of_part]
            found, _, _ = _core.fit_display(
                [_core.DisplayView(lookups, target.light)],
                shells,
                list(layer.topologies),
                run_time=self._pem.run_time.model,
                options=_core.DisplayFitOptions(solve=_solve_options(infer), passes=infer.passes),
                prior=None if layer.prior is None else layer.prior.reshape(-1, 3),
            )
            texels = np.asarray(found)[:, :3]
        return [np.ascontiguousarray(part) for part in np.split(texels, np.cumsum(sizes)[:-1])]

    def _fit_layers(self, lookups: _core.SurfaceSamples, samples: _core.SurfaceSamples) -> FloatArray:
        """Maps (M · T, 3) fitted to the incident light of the traced samples."""
        layer, stage = self._layer, self._pem.stage
        incident = np.ascontiguousarray(np.asarray(samples.shells[0].radiance)[:, :3])
        texels: list[FloatArray] = []
        for number, topology in enumerate(layer.topologies):
            views, targets, weights = [], [], []
            for part in (p for p, own in enumerate(layer.map_of_part) if own == number):
                matrix = _core.build_rendering_matrix(
                    lookups, part, layer.proxy, topology, self._pem.run_time.model
                )
                if matrix.rows == 0:
                    continue
                target = matrix.row_means(incident)
                views.append((matrix, [(0, 1.0)]))
                targets.append(target)
                weights.append(_core.display_row_weights(matrix, stage.options.samples_per_pixel, target))
            prior = None if layer.prior is None else np.ascontiguousarray(layer.prior[number])
            if not views:
                texels.append(np.zeros((topology.texels, 3), np.float32) if prior is None else prior)
                continue
            solver = _core.MapSolver(views, [topology], options=_solve_options(stage.config.infer))
            texels.append(np.asarray(solver.solve(targets, weights, prior, prior)[0]))
        return np.concatenate(texels)

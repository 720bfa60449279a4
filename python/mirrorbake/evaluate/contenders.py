"""What an evaluation compares with ray tracing: one interface, and everything that implements it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.evaluate.references import options_of
from mirrorbake.pem.pyramid import pyramid_of
from mirrorbake.pem.run_time import blended, lookups_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from mirrorbake.arrays import FloatArray
    from mirrorbake.evaluate.places import View
    from mirrorbake.evaluate.references import Window
    from mirrorbake.pem.opened import OpenedPem
    from mirrorbake.scene.parameters import Point

RUN_TIMES: Mapping[str, _core.RunTimeModel] = {
    "reference": _core.run_time_model("Reference"),
    "web": _core.run_time_model("Web"),
    "web1": _core.run_time_model("Web1"),
}
"""How contenders are drawn, in the order of the tables: with 16, 4 (as the web page does) or 1 lookup per
pixel."""

MOST_KEPT = 16
"""Samples whose single-layer maps are kept in memory: views at the same ones come apart in an evaluation."""

MAIN_RUN_TIME = "reference"
"""The one that pictures and studies show of maps that were inferred for none of `RUN_TIMES`."""


def main_run_time(pem: OpenedPem) -> str:
    """Return the name of the run time that a PEM's maps were inferred for: the one to show of it."""
    own = pem.run_time.model
    return next((name for name, model in RUN_TIMES.items() if model == own), MAIN_RUN_TIME)


def run_time_of(pem: OpenedPem, name: str) -> _core.RunTimeModel:
    """The run time of a name, one of `RUN_TIMES`.

    Maps that were inferred for isotropic lookups of the traced samples have those as their reference: read
    anisotropically they would be sharper than what they were fitted to.
    """
    own = pem.run_time.model
    return own if name == MAIN_RUN_TIME and own.filter == "trilinear" else RUN_TIMES[name]


@dataclass
class Frame:
    """A view to be drawn from maps."""

    pem: OpenedPem
    view: View
    window: Window
    """x, y, width and height of the part that is drawn, pixels."""
    _samples: dict[str, _core.SurfaceSamples] = field(default_factory=dict)

    def samples(self, run_time: str) -> _core.SurfaceSamples:
        """Where a run time's lookups see the reflector, by one of `RUN_TIMES`."""
        if run_time not in self._samples:
            stage = self.pem.stage.at(self.view.point)
            places = run_time_of(self.pem, run_time).places
            options = options_of(stage, len(places), stage.config.trace.seed, self.window)
            self._samples[run_time] = stage.tracer.trace_visibility(
                self.view.camera, stage.built.reflector, options, places
            )
        return self._samples[run_time]


@dataclass(frozen=True)
class Contender:
    """Something that draws the reflector without ray tracing."""

    title: str
    """How tables and pictures call it."""
    render: Callable[[Frame, str], FloatArray]
    """Radiance (H, W, 3) of the reflector in a frame's window, drawn as one of `RUN_TIMES`."""


TITLES: Mapping[str, str] = {
    "pem": "PEM",
    "pem_nearest": "PEM, nearest sample",
    "pem_single_infinite": "PEM, one layer at infinity",
    "static_set": "Static set",
    "static_infinite": "Static map at infinity",
    "static_proxy": "Static map on the PEM's geometry",
}
"""All contenders there are, in the order of the tables, and how those call them."""

CONTENDERS = tuple(TITLES)


def contenders_of(pem: OpenedPem) -> dict[str, Contender]:
    """Return the contenders that a PEM has, by name: all of `CONTENDERS` that make sense for it.

    A static map on the PEM's geometry is none of its own if that is infinite, and the nearest sample is what
    is drawn anyway if there is just one.
    """

    def stored(name: str) -> Callable[[Frame, str], FloatArray]:
        return lambda frame, run_time: pem.run_time.render(
            name, frame.view.point, frame.samples(run_time), run_time_of(pem, run_time), away_of(pem, frame)
        )

    found = {"pem": stored("pem")}
    if len(pem.space) > 1:
        found["pem_nearest"] = lambda frame, run_time: pem.run_time.render(
            "pem",
            nearest_sample(pem, frame.view.point),
            frame.samples(run_time),
            run_time_of(pem, run_time),
            away_of(pem, frame),
        )
    found["pem_single_infinite"] = SingleLayer(pem).render
    if pem.run_time.has_static_set:
        found["static_set"] = stored("static_set")
    found["static_infinite"] = stored("static_infinite")
    if pem.run_time.has_static_proxy:
        found["static_proxy"] = stored("static_proxy")
    return {name: Contender(TITLES[name], render) for name, render in found.items()}


def away_of(pem: OpenedPem, frame: Frame) -> float:
    """Degrees from a frame's eye to the cameras of the PEM."""
    return pem.stage.built.cameras.degrees_outside(frame.view.camera.eye)


def nearest_sample(pem: OpenedPem, point: Point) -> Point:
    """Point of the sample of largest weight; of several, the first."""
    index, _ = max(pem.space.neighbours(point), key=lambda share: share[1])
    return pem.space.sample(index)


class SingleLayer:
    """Maps of one layer on a sphere at infinity, inferred as those of [PEM] figure 6.

    They are inferred from the views of the PEM, with its solver's settings, when they are first drawn: one
    map per part, which holds all that the part reflects.
    """

    def __init__(self, pem: OpenedPem) -> None:
        self._pem = pem
        header = pem.store.header
        self._topology = header.topology
        self._proxy = _core.Proxy.infinite(header.static["infinite"]["origin"])
        infer = pem.stage.config.infer
        self._lookup = lookups_of(infer.footprint_scale)
        self._solve = _core.SolveOptions(
            smoothness=infer.smoothness,
            level_agreement=infer.level_agreement,
            prior_weight=infer.prior_weight,
            tolerance=infer.tolerance,
            max_iterations=infer.iterations,
        )
        self._capture = pyramid_of(pem.store.read_capture(), header.projection)
        self._maps: dict[int, list[FloatArray]] = {}

    def render(self, frame: Frame, run_time: str) -> FloatArray:
        """Draw the reflector: radiance (H, W, 3). Between two samples their maps are blended, as a PEM's."""
        shares = self._pem.space.neighbours(frame.view.point)
        for index, _ in shares:
            if index not in self._maps:
                if len(self._maps) >= MOST_KEPT:
                    self._maps.clear()
                self._maps[index] = self._infer(index)
        maps = [
            blended([(self._maps[i][part], weight) for i, weight in shares])
            for part in range(len(self._pem.store.header.parts))
        ]
        parts = [[_core.ShellMap(self._proxy, self._topology, texels)] for texels in maps]
        return self._pem.run_time.render_parts(
            parts, frame.samples(run_time), frame.view.point, run_time_of(self._pem, run_time)
        )

    def _infer(self, index: int) -> list[FloatArray]:
        stage, header = self._pem.stage, self._pem.store.header
        samples = stage.trace(header.space.sample(index)).samples
        incident = np.zeros((len(samples), 3), np.float32)
        through = np.ones((len(samples), 1), np.float32)
        for shell in samples.shells:
            radiance = np.asarray(shell.radiance)
            incident += through * radiance[:, :3]
            through *= 1.0 - radiance[:, 3:]
        maps = []
        for part in range(len(header.parts)):
            matrix = _core.build_rendering_matrix(samples, part, self._proxy, self._topology, self._lookup)
            if matrix.rows == 0:
                maps.append(np.asarray(self._capture))
                continue
            target = matrix.row_means(incident)
            weights = _core.display_row_weights(matrix, stage.options.samples_per_pixel, target)
            solver = _core.MapSolver([(matrix, [(0, 1.0)])], [self._topology], options=self._solve)
            maps.append(np.asarray(solver.solve([target], [weights], self._capture, self._capture)[0]))
        return maps

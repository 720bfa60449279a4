"""What an evaluation compares with ray tracing: one interface, and everything that implements it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from mirrorbake import _core
from mirrorbake.evaluate.references import options_of
from mirrorbake.evaluate.single_maps import (
    Layer,
    SingleMaps,
    Targets,
    layer_at_infinity,
    layer_on_surface,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from mirrorbake.arrays import FloatArray
    from mirrorbake.evaluate.places import View
    from mirrorbake.evaluate.references import Window
    from mirrorbake.pem.opened import OpenedPem
    from mirrorbake.scene.parameters import Point

RUN_TIMES: Mapping[str, _core.RunTimeModel] = {
    "web": _core.run_time_model("Web"),
    "web1": _core.run_time_model("Web1"),
    "reference": _core.run_time_model("Reference"),
}
"""How contenders are drawn, in the order of the tables: with 4 lookups per pixel as the web page does, for
which maps are inferred by default; with 1, or 16."""

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
    "ptm": "Texture on the surface (PTM)",
    "static_set": "Static set",
    "static_infinite": "Static map at infinity",
    "static_proxy": "Static map on the PEM's geometry",
}
"""All contenders there are, in the order of the tables, and how those call them."""

CONTENDERS = tuple(TITLES)


def contenders_of(pem: OpenedPem) -> dict[str, Contender]:
    """Return the contenders that a PEM has, by name: all of `CONTENDERS` that make sense for it.

    A static map on the PEM's geometry is none of its own if that is infinite, and the nearest sample is what
    is drawn anyway if there is just one. A texture needs coordinates on the surface that do not overlap.
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
    targets = Targets(pem)

    def inferred(layer: Layer) -> Callable[[Frame, str], FloatArray]:
        maps = SingleMaps(pem, targets, layer)
        return lambda frame, run_time: maps.render(
            frame.view.point, frame.samples(run_time), run_time_of(pem, run_time)
        )

    found["pem_single_infinite"] = inferred(layer_at_infinity(pem))
    on_surface = layer_on_surface(pem)
    if on_surface is not None:
        found["ptm"] = inferred(on_surface)
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

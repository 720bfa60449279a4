"""Ctrl-C, and any handler of a signal that raises, stops the library's long computations."""

from __future__ import annotations

import signal
from typing import TYPE_CHECKING

import numpy as np
import pytest

import mirrorbake
from mirrorbake import _core

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import FrameType

    from mirrorbake import Scene, Tracer

BALL = 0


def scene() -> Scene:
    made = mirrorbake.Scene()
    chrome = made.add_material(mirrorbake.Material(specular=True))
    made.add_object("ball", _core.make_sphere((0, 0.1, 0), 0.1, 32), chrome)
    grey = made.add_material(mirrorbake.Material())
    made.add_object("floor", _core.make_rectangle((-3, 0, 3), (6, 0, 0), (0, 0, -6)), grey)
    made.set_environment(np.full((4, 8, 3), 0.25, np.float32))
    return made


def compute(name: str, tracer: Tracer) -> None:
    """Something that would take minutes or hours."""
    camera = mirrorbake.Camera((0, 0.3, 1), (0, 0.1, 0), width=2048, height=2048)
    many = mirrorbake.TraceOptions(samples_per_pixel=65536)
    match name:
        case "Tracer":
            mirrorbake.Tracer(
                mirrorbake.make_room(), mirrorbake.TracerOptions(cache_rays=65536, cache_bounces=16)
            )
        case "trace_beauty":
            tracer.trace_beauty(camera, many)
        case "trace_layers":
            tracer.trace_layers(camera, BALL, many)
        case "capture_cube":
            tracer.capture_cube((0, 0.5, 0), 2048, options=many)
        case "vertex_irradiance":
            tracer.vertex_irradiance(BALL, 65536)


@pytest.fixture
def alarm() -> Iterator[None]:
    """Interrupt what runs after a fifth of a second, as Ctrl-C does."""

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, 0.2)
    yield
    signal.setitimer(signal.ITIMER_REAL, 0)
    signal.signal(signal.SIGALRM, before)


@pytest.mark.usefixtures("alarm")
@pytest.mark.parametrize(
    "name", ["Tracer", "trace_beauty", "trace_layers", "capture_cube", "vertex_irradiance"]
)
def test_an_interrupt_stops(name: str) -> None:
    tracer = mirrorbake.Tracer(scene(), mirrorbake.TracerOptions(indirect="none"))
    with pytest.raises(KeyboardInterrupt):
        compute(name, tracer)


@pytest.mark.usefixtures("alarm")
def test_the_library_works_on_after_an_interrupt() -> None:
    tracer = mirrorbake.Tracer(scene(), mirrorbake.TracerOptions(indirect="none"))
    with pytest.raises(KeyboardInterrupt):
        compute("trace_beauty", tracer)
    camera = mirrorbake.Camera((0, 0.3, 1), (0, 0.1, 0), width=8, height=8)
    assert np.isfinite(tracer.trace_beauty(camera)).all()

"""What trials trace alike is traced once, and counted for each."""

from __future__ import annotations

import time
from collections import OrderedDict
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from mirrorbake import _core
    from mirrorbake.scene.stage import Stage

MOST_BYTES = 3 << 29
"""Of traces that are kept."""
SAMPLE_BYTES = 260
"""Of a sample with two shells, about."""


class KeptTraces:
    """Traced views by tracer, camera and options; the last ones are kept."""

    def __init__(self) -> None:
        self.saved_s = 0.0
        """Seconds of processor time that tracing what was found here would have taken."""
        self._kept: OrderedDict[str, tuple[_core.LayerTrace, float]] = OrderedDict()
        self._bytes = 0

    def keeping(self, stage: Stage) -> Stage:
        """Return a stage whose tracer keeps its traces here."""
        # All that a bake asks of a tracer is passed on.
        return replace(stage, tracer=cast("_core.Tracer", _Tracer(stage.tracer, self)))

    def trace(
        self, tracer: _core.Tracer, camera: _core.Camera, reflector: int, options: _core.TraceOptions
    ) -> _core.LayerTrace:
        """Trace the layers of a view, or find them."""
        frame = (*camera.eye, *camera.target, *camera.up, camera.vertical_fov_degrees)
        key = repr((id(tracer), frame, camera.width, camera.height, reflector, options))
        if key in self._kept:
            self._kept.move_to_end(key)
            traced, seconds = self._kept[key]
            self.saved_s += seconds
            return traced
        start = time.process_time()
        traced = tracer.trace_layers(camera, reflector, options)
        self._kept[key] = (traced, time.process_time() - start)
        self._bytes += SAMPLE_BYTES * len(traced.samples)
        while self._bytes > MOST_BYTES and len(self._kept) > 1:
            _, (oldest, _) = self._kept.popitem(last=False)
            self._bytes -= SAMPLE_BYTES * len(oldest.samples)
        return traced


class _Tracer:
    """A tracer that keeps the layers that it traces."""

    def __init__(self, tracer: _core.Tracer, traces: KeptTraces) -> None:
        self._tracer, self._traces = tracer, traces

    def trace_layers(
        self, camera: _core.Camera, reflector: int, options: _core.TraceOptions
    ) -> _core.LayerTrace:
        return self._traces.trace(self._tracer, camera, reflector, options)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._tracer, name)

"""A scene with its ray tracer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from mirrorbake import _core
from mirrorbake.scene.build import BuiltScene, build_scene

if TYPE_CHECKING:
    from mirrorbake.scene.config import (
        SceneConfig,
    )
    from mirrorbake.scene.plan import Plan


@dataclass(frozen=True)
class Stage:
    """A scene and its ray tracer: slow to prepare, so a bake and its evaluation can share it."""

    config: SceneConfig
    built: BuiltScene
    tracer: _core.Tracer

    @property
    def options(self) -> _core.TraceOptions:
        """Options of every view. All views share the seed: a view is the same in every bake."""
        trace = self.config.trace
        assert trace.samples is not None, "the scene has to be planned first"
        assert trace.depth is not None, "the scene has to be planned first"
        return _core.TraceOptions(
            samples_per_pixel=trace.samples, max_specular_depth=trace.depth, seed=trace.seed
        )

    def planned(self, plan: Plan) -> Stage:
        """Return the stage with what a plan decides in place of "auto", so that its views can be traced."""
        return replace(self, config=plan.resolve(self.config))

    def visibility(self, t: float) -> _core.SurfaceSamples:
        """Where the camera of t sees the reflector."""
        return self.tracer.trace_visibility(self.built.arc.camera(t), self.built.reflector, self.options)

    def trace(self, t: float) -> _core.LayerTrace:
        """Ray trace the layers of the view of t."""
        return self.tracer.trace_layers(self.built.arc.camera(t), self.built.reflector, self.options)


def prepare_stage(config: SceneConfig) -> Stage:
    """Build a scene and make it ready for tracing; raises as `build_scene` does."""
    built = build_scene(config)
    options = _core.TracerOptions(
        indirect=getattr(_core.IndirectLight, config.trace.indirect),
        cache_rays=config.trace.cache_rays,
        seed=config.trace.seed,
    )
    return Stage(config, built, _core.Tracer(built.scene, options))

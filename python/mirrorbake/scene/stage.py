"""A scene with its ray tracer."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from mirrorbake import _core
from mirrorbake.scene.build import BuiltScene, build_scene
from mirrorbake.scene.config_shells import DEFAULT_SHELLS
from mirrorbake.scene.parameters import space_of
from mirrorbake.scene.shell_rules import trace_rules

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from mirrorbake.scene.config import Parts, SceneConfig
    from mirrorbake.scene.parameters import ParameterSpace, Point, PointLike
    from mirrorbake.scene.plan import Plan


@dataclass(frozen=True)
class Stage:
    """A scene and its ray tracer: slow to prepare, so a bake and its evaluation can share it."""

    config: SceneConfig
    built: BuiltScene
    tracer: _core.Tracer
    moved: dict[Point, Stage] = field(default_factory=dict, compare=False, repr=False)
    """The last stage that `at` made, by the coordinates that change the scene."""
    cut: dict[Parts, Stage] = field(default_factory=dict, compare=False, repr=False)
    """The last stage that `in_parts` made, by the parts of the reflector."""
    finer: dict[float, Stage] = field(default_factory=dict, compare=False, repr=False)
    """The last stage that `without_edges_above` made, by the longest edge."""
    place: Mapping[str, float] = field(default_factory=dict)
    """Coordinates that have changed the scene, by axis; without any it is at rest."""

    @property
    def options(self) -> _core.TraceOptions:
        """Options of every view. All views share the seed: a view is the same in every bake."""
        trace = self.config.trace
        assert trace.samples is not None, "the scene has to be planned first"
        assert trace.depth is not None, "the scene has to be planned first"
        return _core.TraceOptions(
            samples_per_pixel=trace.samples,
            max_specular_depth=trace.depth,
            seed=trace.seed,
            noise=trace.noise or 0.0,
            most_samples_per_pixel=max(trace.samples, trace.most_samples),
            shells=self.shell_rules,
        )

    @property
    def shell_rules(self) -> list[_core.ShellRule]:
        """Rules by which reflected light is split; those of [PEM] §4 before the scene is planned."""
        built = self.built
        shells = self.config.shells or DEFAULT_SHELLS
        return trace_rules(shells, built.scene.object_names, built.reflector)

    def options_of(self, window: tuple[int, int, int, int]) -> _core.TraceOptions:
        """Options of a part of a view: x, y, width and height in pixels; of no size: the whole."""
        options = self.options
        options.window = list(window)
        return options

    def planned(self, plan: Plan) -> Stage:
        """Return the stage with what a plan decides in place of "auto", so that its views can be traced."""
        config = plan.resolve(self.config)
        assert config.reflector.parts is not None, "a plan decides the parts"
        stage = self.without_edges_above(config.reflector.longest_edge or 0.0)
        stage = replace(stage.in_parts(config.reflector.parts), config=config)
        return stage.spaced(config) if self.config.views.awaits_spacing else stage

    def spaced(self, config: SceneConfig) -> Stage:
        """Return the stage with the nodes of a scene that is this one but for how far apart its maps are.

        Raises
        ------
        InputError
            One of its views lies inside the reflector.
        """
        built = self.built.with_space(space_of(config))
        return replace(self, config=config, built=built, moved={}, cut={}, finer={})

    def without_edges_above(self, edge: float) -> Stage:
        """Return the stage with a finer mesh of its reflector (`reflector.longest_edge`); 0: as it is."""
        before = self.config.reflector.longest_edge
        if edge == (before or 0.0):
            return self
        if edge not in self.finer:
            reflector = self.config.reflector.model_copy(update={"longest_edge": edge})
            self.finer.clear()
            self.finer[edge] = prepare_stage(self.config.model_copy(update={"reflector": reflector}))
        return self.finer[edge]

    def in_parts(self, parts: Parts) -> Stage:
        """Return the stage with its reflector in other parts (`reflector.parts`)."""
        before = self.config.reflector.parts
        # What is "auto" is built as its file has it.
        if parts == (before or "split") or self.config.reflector.scene_object is not None:
            return self
        if parts not in self.cut:
            reflector = self.config.reflector.model_copy(update={"parts": parts})
            self.cut.clear()
            config = self.config.model_copy(update={"reflector": reflector})
            built = build_scene(config)
            # Light gets about as before: the tracer keeps what it has gathered.
            tracer = self.tracer.with_parts(
                built.reflector,
                built.parts.tolist(),
                built.scene.object_part_names(built.reflector),
                built.scene.object_part_materials(built.reflector),
            )
            self.cut[parts] = Stage(config, built, tracer)
        return self.cut[parts]

    @property
    def space(self) -> ParameterSpace:
        """The parameter space of the scene file."""
        return self.built.space

    def at(self, point: PointLike) -> Stage:
        """Return the stage as it is at a point: with the object moved and the light turned.

        The last one is kept, so that points that differ in the camera alone cost nothing.
        """
        place = self.space.scene_coordinates(self.space.point(point))
        if not any(place.values()):
            return self
        key = tuple(place.values())
        if key not in self.moved:
            self.moved.clear()
            self.moved[key] = replace(_prepared(self.config, self.space.point(point)), place=place)
        return replace(self.moved[key], config=self.config)

    def visibility(self, point: PointLike, places: Sequence[Sequence[float]] = ()) -> _core.SurfaceSamples:
        """Where the camera of a point sees the reflector: at random in every pixel, or at places of it."""
        stage, place = self.at(point), self.space.point(point)
        return stage.tracer.trace_visibility(
            stage.built.cameras.camera(place), stage.built.reflector, self.options, places
        )

    def trace(self, point: PointLike) -> _core.LayerTrace:
        """Ray trace the layers of the view of a point."""
        stage, place = self.at(point), self.space.point(point)
        return stage.tracer.trace_layers(
            stage.built.cameras.camera(place), stage.built.reflector, self.options
        )


def prepare_stage(config: SceneConfig) -> Stage:
    """Build a scene and make it ready for tracing; raises as `build_scene` does."""
    return _prepared(config, None)


def _prepared(config: SceneConfig, point: Point | None) -> Stage:
    built = build_scene(config, point)
    options = _core.TracerOptions(
        indirect=config.trace.indirect,
        cache_rays=config.trace.cache_rays,
        seed=config.trace.seed,
        focus=built.reflector,
    )
    return Stage(config, built, _core.Tracer(built.scene, options))

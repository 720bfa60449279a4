"""How far apart maps are to be: by the law that trials measure, and by budgets of bytes and minutes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from mirrorbake.bake.around import STRIPS
from mirrorbake.bake.estimate import bytes_in_words, time_in_words
from mirrorbake.bake.quality import NEAR_DEGREES
from mirrorbake.bake.spacing_trial import camera_axes, cell_trial
from mirrorbake.errors import InputError
from mirrorbake.scene.config_axes import scene_axes
from mirrorbake.scene.plan import Decision
from mirrorbake.scene.spacing_law import SpacingLaw

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from mirrorbake.bake.spacing_trial import CameraAxis, CellTrial
    from mirrorbake.scene.plan import Plan
    from mirrorbake.scene.stage import Stage

WIDEST = 15.0
"""Degrees between the maps of the widest trial, where there is room."""
STEP = 3.0
"""Between trials: each is so many times narrower."""
TRIALS = 3
BEYOND = 2.0
"""The law is believed up to so many times wider or narrower than its trials."""
MOST_TRACED = 4
"""Views in a cell of one axis; squared in one of two."""


@dataclass(frozen=True)
class Option:
    """A way to bake a scene, and what is foretold of it."""

    degrees: float
    """Between maps along the axes where that was open."""
    nodes: tuple[int, ...]
    """Maps along each of the cameras' axes."""
    traced: int
    """Views in a cell."""
    decibels: float
    bytes: float
    seconds: float


@dataclass(frozen=True)
class Wanted:
    """What a scene file asks for."""

    decibels: float
    megabytes: float | None
    minutes: float | None

    def over(self, option: Option) -> tuple[str, ...]:
        """Return the keys of the budgets that an option is over."""
        budgets = (
            ("auto.megabytes", self.megabytes, option.bytes / 1e6),
            ("auto.minutes", self.minutes, option.seconds / 60.0),
        )
        return tuple(key for key, budget, value in budgets if budget is not None and value > budget)


def chosen(options: Sequence[Option], wanted: Wanted) -> tuple[Option, str | None]:
    """Choose from options, the widest first and of these the ones with the fewest traced views.

    The first that meets what is wanted within the budgets; where there is none, the one of most decibels
    within them.

    Returns
    -------
    tuple
        The option, and a line that says what contradicts what; None: nothing does.

    Raises
    ------
    InputError
        No option meets what is wanted, and there is no budget to end at.
    """
    meeting = [option for option in options if option.decibels >= wanted.decibels]
    within = [option for option in meeting if not wanted.over(option)]
    if within:
        return within[0], None
    asked, best = f"auto.decibels = {wanted.decibels:g}", max(options, key=lambda option: option.decibels)
    unmet = f"no maps meet it, down to {best.degrees:.2g} degrees apart with {best.decibels:.1f} dB"
    affordable = [option for option in options if not wanted.over(option)]
    if not meeting and wanted.megabytes is None and wanted.minutes is None:
        raise InputError(f"{asked}: {unmet}; expected less, or auto.megabytes to end at")
    if not affordable:
        return options[0], f"{_binding(options, wanted)}maps {_costs(options[0], wanted)} are the least"
    found = max(affordable, key=lambda option: option.decibels)
    needs = f"needs maps {_costs(meeting[0], wanted)}" if meeting else f"is out of reach ({unmet})"
    return found, (
        f"{asked} {needs}; {_binding(meeting or options[-1:], wanted)}"
        f"maps {found.degrees:.3g} degrees apart reach {found.decibels:.1f} dB"
    )


def _binding(options: Sequence[Option], wanted: Wanted) -> str:
    """Say which budget stands in the way of all of some options; nothing where none does."""
    over = [wanted.over(option) for option in options]
    always = [key for key in ("auto.megabytes", "auto.minutes") if all(key in keys for keys in over)]
    keys = always or sorted({key for some in over for key in some})
    values = {"auto.megabytes": wanted.megabytes, "auto.minutes": wanted.minutes}
    words = " and ".join(f"{key} = {values[key]:g}" for key in keys)
    return f"{words} {'binds' if len(keys) == 1 else 'bind'}: " if keys else ""


def _costs(option: Option, wanted: Wanted) -> str:
    words = f"{option.degrees:.3g} degrees apart, {bytes_in_words(option.bytes)}"
    return words if wanted.minutes is None else f"{words} and {time_in_words(option.seconds)}"


def with_spacing(stage: Stage, plan_of: Callable[[Stage], Plan]) -> tuple[Stage, Plan]:
    """Return a stage whose maps have their places, and its plan with the law by which they were found.

    Where the scene file sets how many there are, the stage as it is.

    Parameters
    ----------
    stage
        Of the scene, in its parts.
    plan_of
        Decides the rest, for a stage whose maps have their places.

    Raises
    ------
    InputError
        A view lies inside the reflector, those in the middle do not see it, or nothing meets what is wanted.
    """
    if not stage.config.views.awaits_spacing:
        return stage, plan_of(stage)
    config = stage.config
    axes = camera_axes(config)
    trials = _trials(stage, plan_of, axes)
    auto = config.auto
    wanted = Wanted(auto.decibels, auto.megabytes, auto.minutes)
    law = SpacingLaw(tuple(trial.found for trial in trials))
    changes = math.prod(axis.count for axis in scene_axes(config).values())
    option, warning = chosen(options_of(axes, trials, law, changes), wanted)
    views = config.views.model_copy(
        update={axis.key: nodes for axis, nodes in zip(axes, option.nodes, strict=True)}
    )
    stage = stage.spaced(config.model_copy(update={"views": views}))
    reason = f"{option.degrees:.3g} degrees apart {option.decibels:.1f} dB are foretold between maps"
    reason += f", {auto.decibels:g} wanted; {bytes_in_words(option.bytes)} in all"
    if auto.minutes is not None:
        reason += f", in {time_in_words(option.seconds)}"
    decisions = [
        Decision(f"views.{axis.key}", None, nodes, True, reason, option.decibels)
        for axis, nodes in zip(axes, option.nodes, strict=True)
        if axis.nodes is None
    ]
    if config.views.traced is None and option.traced > _usual(trials, option.degrees).found.traced:
        reason = f"further views in a cell, {option.decibels:.1f} dB with them, let the maps be further apart"
        decisions.append(Decision("views.traced", None, option.traced, True, reason, option.decibels))
    plan = plan_of(stage)
    decided = {decision.key for decision in decisions}
    kept = (decision for decision in plan.decisions if decision.key not in decided)
    advice = plan.advice if warning is None else (f"warning: {warning}", *plan.advice)
    return stage, replace(plan, decisions=(*kept, *decisions), advice=advice, law=law)


def _trials(stage: Stage, plan_of: Callable[[Stage], Plan], axes: Sequence[CameraAxis]) -> list[CellTrial]:
    """Try some spacings, and more traced views at one of them: the narrowest that has any."""
    widest = min(WIDEST, max(axis.extent for axis in axes if axis.nodes is None))
    found = [cell_trial(stage, plan_of, widest / STEP**number) for number in reversed(range(TRIALS))]
    trials = [trial for trial in found if trial is not None]
    if not trials:
        raise InputError("views: those in the middle of the cameras' axes do not see the object")
    apart = [trial for trial in trials if _are_blended(axes, trial.found.degrees)]
    if stage.config.views.traced is None and apart:
        most = _most_traced(axes)
        if most > apart[0].found.traced:
            further = cell_trial(stage, plan_of, apart[0].found.degrees, most)
            trials += [] if further is None else [further]
    return trials


def _most_traced(axes: Sequence[CameraAxis]) -> int:
    return int(MOST_TRACED ** sum(axis.extent > 0.0 for axis in axes))


def _are_blended(axes: Sequence[CameraAxis], degrees: float) -> bool:
    """Whether views between maps so far apart are fitted by the maps' blend, as in `quality`."""
    return max(axis.step(degrees) for axis in axes) > NEAR_DEGREES


def _usual(trials: Sequence[CellTrial], degrees: float) -> CellTrial:
    """Return the trial of the nearest spacing, and of these with the fewest traced views."""
    return min(trials, key=lambda one: (abs(math.log(one.found.degrees / degrees)), one.found.traced))


def options_of(
    axes: Sequence[CameraAxis], trials: Sequence[CellTrial], law: SpacingLaw, changes: int
) -> list[Option]:
    """Return all ways to space the maps, the widest first, and of these the fewest traced views.

    Parameters
    ----------
    axes
        Of the cameras.
    trials
        At several spacings.
    law
        Of these.
    changes
        How many scenes there are along the axes that change it.
    """
    tried = [trial.found.degrees for trial in trials]
    widest, narrowest = max(tried) * BEYOND, min(tried) / BEYOND
    steps: set[float] = set()
    for axis in (axis for axis in axes if axis.nodes is None):
        fewest, most = axis.nodes_for(min(widest, axis.extent)), axis.nodes_for(narrowest)
        steps |= {axis.spacing(nodes) for nodes in range(fewest, most + 1)}
    options = []
    for step in sorted(steps, reverse=True):
        usual = _usual(trials, step)
        nodes = tuple(axis.nodes_for(step) for axis in axes)
        blended = _are_blended(axes, step)
        more = {trial.found.traced for trial in trials} if blended else set()
        for traced in sorted({usual.found.traced, *(k for k in more if k > usual.found.traced)}):
            views, rows = _work(axes, nodes, traced if blended else None, usual.around)
            seconds = views * usual.view_seconds + rows * usual.row_seconds
            options.append(
                Option(
                    step,
                    nodes,
                    traced,
                    law.decibels(step, traced),
                    changes * math.prod(nodes) * usual.bytes,
                    changes * seconds,
                )
            )
    return options


def _work(
    axes: Sequence[CameraAxis], nodes: Sequence[int], traced: int | None, around: int
) -> tuple[float, float]:
    """Return the views that are traced for all nodes, and the views in all of their fits together.

    Parameters
    ----------
    axes, nodes
        With so many maps along each.
    traced
        Views in a cell; None: maps are fitted to their neighbours' views, and to views beside an arc.
    around
        So many of these.
    """
    count = math.prod(nodes)
    if traced is None:
        beside = around * (axes[0].extent / (2.0 * STRIPS[1]) + 1.0)
        return count + beside, count * (1 + 2 * len(nodes) + around)
    cells = [max(n if axis.closed else n - 1, 1) for axis, n in zip(axes, nodes, strict=True)]
    touching, block = (math.prod(min(n, most) for n in some) for some, most in ((cells, 2), (nodes, 3)))
    return count + math.prod(cells) * traced, count * (block + touching * traced)

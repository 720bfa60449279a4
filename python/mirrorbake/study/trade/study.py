"""The trade of time and bytes against error on the user's own scene: axis by axis, then combinations."""

from __future__ import annotations

import itertools
import math
import time
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, cast

from mirrorbake.bake.analyze import analyze
from mirrorbake.bake.map_sizes import SMALLEST_MAP
from mirrorbake.errors import InputError, OptionError
from mirrorbake.scene.stage import prepare_stage
from mirrorbake.study.middle import in_the_middle, overridden
from mirrorbake.study.trade.axes import AXIS_NAMES, Axis, Setting, axes_of, log_ratio
from mirrorbake.study.trade.notebook import Identity, Measurements, Notebook, words_of
from mirrorbake.study.trade.trial import Bench, Trial

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from mirrorbake.bake.bake import ProgressReport
    from mirrorbake.scene.config import Parts, SceneConfig
    from mirrorbake.scene.stage import Stage

STUDY_NAME = "study.json"
STUDIED_VIEWS = 3
"""Maps of a trial: a sample with a neighbour on either side."""
LONGEST_SIDE = 160
"""Pixels of the pictures of trials, and maps as much smaller as they are than the scene's."""
SINGLES_SHARE = 0.75
"""Of the time that there is, after which combinations are tried, for what it tells of single choices."""
COMBINATIONS = 15
"""Tried at most, after the single axes."""
NOTICEABLE = 0.5
"""dB that a dearer choice has to gain to be on the front: twice the standard deviation that a gain has under
another seed, of the teapot."""
SAME_PRICE = 1.25
"""Ratio of costs up to which a front has one step: what measuring them again can change."""
MOST_COMBINED = 50_000

COSTS = ("bytes_per_degree", "bake_s", "draw_ms")
"""What is traded against error."""


@dataclass(frozen=True)
class Study:
    """What was measured."""

    base: Trial
    """The scene's own choice."""
    axes: list[Axis]
    trials: list[Trial]
    """With one setting changed, by axis; then combinations."""
    planned: int
    """Trials that there are to make; more than there are `trials` if the time was up."""
    refused: dict[str, str] = field(default_factory=dict)
    """Settings that the scene cannot be baked with, and why."""

    @property
    def all(self) -> list[Trial]:
        """All trials, the scene's own first."""
        return [self.base, *self.trials]

    def front(self, cost: str) -> list[Trial]:
        """Trials that no cheaper one is as good as: the Pareto front, cheapest first.

        It has no steps of less than `NOTICEABLE`, nor two for the same price.

        Parameters
        ----------
        cost
            One of `COSTS`.
        """
        found: list[Trial] = []
        cheapest, best = -1.0, -1e9
        for trial in sorted(self.all, key=lambda trial: (getattr(trial, cost), -(trial.near or -1e9))):
            if trial.near is None or trial.near <= best + NOTICEABLE:
                continue
            price, best = getattr(trial, cost), trial.near
            if found and price <= SAME_PRICE * cheapest:
                found[-1] = trial
            else:
                found.append(trial)
                cheapest = price
        return found

    def of_axis(self, axis: str) -> list[Trial]:
        """Trials that differ from the scene's own in this axis alone."""
        return [trial for trial in self.trials if list(trial.settings) == [axis]]


def study(
    config: SceneConfig,
    folder: Path,
    axes: Sequence[str] = (),
    minutes: float | None = None,
    progress: ProgressReport | None = None,
    combinations: int = COMBINATIONS,
    *,
    longest_side: int = LONGEST_SIDE,
    again: Sequence[Mapping[str, str]] | None = None,
) -> Study:
    """Measure what a scene's choices cost and how far off they are.

    A few views from the middle of the arc are baked with each setting, looked at from each sample, between
    every two and 5° past the last, and compared with references that all trials share. What is measured is
    kept in `folder`/study.json after every trial: an interrupted study goes on where it stopped.

    Parameters
    ----------
    config
        The scene.
    folder
        Made if it does not exist.
    axes
        Names of the axes; none: all that the scene has.
    minutes
        After which no further trial begins. None: no limit.
    progress
        Told about every trial.
    combinations
        Tried at most, after the single axes.
    longest_side
        Pixels of the trials' pictures, the scene's if those are no larger; maps of a set size shrink
        with them.
    again
        Combinations to try, labels by axis, in place of those that the single axes foretell.

    Raises
    ------
    OptionError
        An axis does not exist, or the scene does not have it.
    InputError
        The scene is not usable, or its object is not seen, or the folder holds a study of another scene.
    """
    began = time.monotonic()
    report = progress or (lambda done, total, text: None)
    for name in axes:
        if name not in AXIS_NAMES:
            raise OptionError(f"--axes {name}: expected some of {', '.join(AXIS_NAMES)}")
    report(0, 1, "preparing the scene")
    folder.mkdir(parents=True, exist_ok=True)
    config = shrunk(config, longest_side)
    notebook = Notebook(folder / STUDY_NAME, Identity.of(config))
    stage = _studied(config)
    chosen = _named(axes_of(stage), axes)
    singles = singles_of(chosen)
    planned = 1 + len(singles)
    trials: list[Trial] = []

    def try_all(several: Sequence[Mapping[str, Setting]], first: int) -> None:
        for step, settings in enumerate(several, start=first):
            report(step, planned, words_of(settings))
            trial = measure.trial(settings)
            if trial is not None:
                trials.append(trial)

    with Bench(stage.config, folder, stage) as bench:
        measure = Measurements(bench, notebook, began, minutes)
        report(0, planned, "the scene's own choice")
        base = measure.trial({})
        if base is None or base.near is None:
            raise InputError("study: no pixel of the views in the middle of the arc is wholly the object's")
        measure.share = SINGLES_SHARE
        try_all(singles, 1)
        measure.share = 1.0
        if again is None:
            promising = _promising(base, chosen, trials, combinations)
        else:
            promising = _of_labels(chosen, again)
        planned += len(promising)
        try_all(promising, 1 + len(singles))
    report(planned, planned, f"{1 + len(trials)} trials")
    result = Study(
        base, chosen, _in_order(chosen, trials), planned - len(notebook.refused), dict(notebook.refused)
    )
    notebook.finish(summary(result))
    return result


def _named(axes: Sequence[Axis], names: Sequence[str]) -> list[Axis]:
    """Return the axes of some names, in their own order; without names all."""
    missing = sorted(set(names) - {axis.name for axis in axes})
    if missing:
        raise OptionError(f"--axes {missing[0]}: this scene has no such choice")
    return [axis for axis in axes if not names or axis.name in names]


def singles_of(axes: Sequence[Axis]) -> list[dict[str, Setting]]:
    """Return all settings alone, in the order of trials.

    What needs no bake of its own comes first; of the others every axis has its turn before one has another,
    so that a study that ends early has looked at all of them.
    """
    turns = [
        (bool(setting.overrides), turn if setting.overrides else 0, number, {axis.name: setting})
        for number, axis in enumerate(axes)
        for turn, setting in enumerate(axis.settings[1:])
    ]
    return [settings for *_, settings in sorted(turns, key=lambda entry: entry[:3])]


def _in_order(axes: Sequence[Axis], trials: Sequence[Trial]) -> list[Trial]:
    """Return trials as the axes have their settings, whenever they were made; combinations at the end."""
    places = [(axis.name, setting.label) for axis in axes for setting in axis.settings]

    def place(trial: Trial) -> int:
        (setting,) = trial.settings.items() if len(trial.settings) == 1 else (None,)
        return len(places) if setting is None else places.index(setting)

    return sorted(trials, key=place)


def shrunk(config: SceneConfig, longest_side: int) -> SceneConfig:
    """Return a scene with pictures of at most so many pixels a side, maps of a set size as much smaller."""
    width, height = config.views.size
    scale = longest_side / max(width, height)
    if scale >= 1.0:
        return config
    overrides: dict[str, Any] = {"views.size": [max(1, round(scale * width)), max(1, round(scale * height))]}
    if config.maps.size is not None:
        smaller = 2 ** math.ceil(math.log2(scale * config.maps.size))
        overrides["maps.size"] = min(max(smaller, SMALLEST_MAP), config.maps.size)
    return overridden(config, overrides)


_DECIDED = (
    *(
        "reflector.longest_edge",
        "reflector.parts",
        "trace.depth",
        "trace.samples",
        "trace.noise",
        "maps.distant",
    ),
    "maps.shared_distant",
    *("views.traced", "views.around", "infer.passes", "infer.neighbours"),
)
"""What all trials share of the plan; with them the local layer, if all parts have one or none has."""


def _studied(config: SceneConfig) -> Stage:
    """The scene with few views in the middle of its arc, and what is "auto" decided.

    It has no static set, which serves views far from all samples and is the same for all of them.
    """
    views = config.views
    if views.kind != "arc":
        raise InputError(f"views.kind = {views.kind!r}: a study needs views on an arc")
    if views.count is None:
        raise InputError('views.count = "auto": a study needs a number')
    config = overridden(in_the_middle(config, STUDIED_VIEWS), {"static.views": 0})
    stage = prepare_stage(config)
    plan = analyze(stage)
    decided = {
        decision.key: decision.value
        for decision in plan.decisions
        if decision.automatic and decision.key in _DECIDED
    }
    decided["maps.size"] = plan.map_size
    local = {decision.value for decision in plan.decisions if decision.key == "layers.local"}
    if len(local) == 1:
        decided["layers.local"] = local.pop()
    stage = stage.without_edges_above(cast("float", plan.value("reflector.longest_edge")))
    stage = stage.in_parts(cast("Parts", plan.value("reflector.parts")))
    return replace(stage, config=overridden(config, decided))


def _of_labels(axes: Sequence[Axis], again: Sequence[Mapping[str, str]]) -> list[dict[str, Setting]]:
    """Return combinations by their labels; those that the axes do not have are left out."""
    known = {axis.name: {setting.label: setting for setting in axis.settings} for axis in axes}
    return [
        {axis: known[axis][label] for axis, label in labels.items()}
        for labels in again
        if all(label in known.get(axis, ()) for axis, label in labels.items())
    ]


@dataclass(frozen=True)
class _Move:
    """What one setting changes."""

    axis: str
    setting: Setting
    octaves: tuple[float, ...]
    """Of `COSTS`."""
    gain: float
    """dB."""


def _promising(
    base: Trial, axes: Sequence[Axis], singles: Sequence[Trial], count: int
) -> list[dict[str, Setting]]:
    """Combinations that the single axes foretell to be on a front.

    Axes are taken to act independently: ratios of costs multiply, gains in dB add. Of all combinations of
    settings that trade something, those on the foretold fronts of `COSTS` are tried, evenly over the fronts.
    """
    options: list[list[_Move]] = []
    for axis in axes:
        moves: list[_Move] = []
        for trial in singles:
            if list(trial.settings) == [axis.name] and trial.near is not None and base.near is not None:
                ratios = tuple(log_ratio(getattr(trial, cost), getattr(base, cost)) for cost in COSTS)
                gain = trial.near - base.near
                # Worse and no cheaper: no part of any front.
                if gain > NOTICEABLE or min(ratios) < -0.1:
                    moves.append(_Move(axis.name, axis.setting(trial.settings[axis.name]), ratios, gain))
        if moves:
            options.append(sorted(moves, key=lambda move: -abs(move.gain))[:3])
    # The axes that matter most, as many as can be combined.
    options.sort(key=lambda moves: -max(abs(move.gain) + abs(move.octaves[0]) for move in moves))
    sizes = itertools.accumulate((1 + len(moves) for moves in options), lambda a, b: a * b)
    options = [moves for moves, size in zip(options, sizes, strict=True) if size <= MOST_COMBINED]
    foretold = []
    for choice in itertools.product(*([None, *moves] for moves in options)):
        taken = [move for move in choice if move is not None]
        makers = sum(move.setting.levels is not None for move in taken)
        if len(taken) > 1 and makers < 2:
            gain = sum(move.gain for move in taken)
            ratios = tuple(sum(move.octaves[cost] for move in taken) for cost in range(len(COSTS)))
            foretold.append((ratios, gain, {move.axis: move.setting for move in taken}))
    chosen: dict[str, dict[str, Setting]] = {}
    for cost in range(len(COSTS)):
        best, front = -1e9, []
        for ratios, gain, settings in sorted(foretold, key=lambda item: (item[0][cost], -item[1])):
            if gain > best + NOTICEABLE:
                best = gain
                front.append((ratios, gain, settings))
        for _, _, settings in _evenly(front, max(count // len(COSTS), 1)):
            chosen.setdefault(words_of(settings), settings)
    return list(chosen.values())


def _evenly(items: list[Any], count: int) -> list[Any]:
    if len(items) <= count:
        return items
    if count < 2:
        return items[:count]
    return [items[round(i * (len(items) - 1) / (count - 1))] for i in range(count)]


def summary(result: Study) -> dict[str, Any]:
    """Return the fronts, by cost, and the advice, as plain values."""
    fronts = {cost: [trial.settings for trial in result.front(cost)] for cost in COSTS}
    return {"fronts": fronts, "advice": advice(result)}


def advice(result: Study) -> list[str]:
    """Sentences that a person can act on: what can be saved for little, and what is worth its price."""
    base = result.base
    assert base.near is not None
    ordered, gains = [], []
    nouns = ("the bytes", "the time to bake", "the time to draw")
    for cost, noun in zip(COSTS, nouns, strict=True):
        savings = []
        for axis in result.axes:
            for trial in result.of_axis(axis.name):
                if trial.near is None:
                    continue
                ratio = getattr(trial, cost) / max(getattr(base, cost), 1e-12)
                change = trial.near - base.near
                words = f"{axis.title}: {trial.settings[axis.name]}"
                if ratio < 0.85 and change > -1.5:
                    effect = f"cost {-change:.1f} dB" if change <= -0.05 else "cost nothing"
                    effect = f"and {change:.1f} dB more" if change >= 0.05 else effect
                    price = change / -log_ratio(ratio, 1.0)
                    savings.append((price, f"{share(ratio)} {noun} {effect} ({words})"))
                elif change > 0.3 and cost == "bake_s":
                    gains.append((change, f"{change:.1f} dB more for {share(ratio)} {noun} ({words})"))
        ordered += [words for _, words in sorted(savings, reverse=True)[:2]]
    return ordered + [words for _, words in sorted(gains, reverse=True)[:3]]


def share(ratio: float) -> str:
    """Words for a ratio: half, a third, twice, 3.4 times.

    >>> [share(r) for r in (0.26, 0.5, 0.7, 1.0, 1.96, 3.4)]
    ['a quarter of', 'half', '70 % of', 'the same', 'twice', '3.4 times']
    """
    for value, words in ((0.25, "a quarter of"), (1 / 3, "a third of"), (0.5, "half"), (2.0, "twice")):
        if abs(ratio / value - 1.0) < 0.06:
            return words
    if abs(ratio - 1.0) < 0.05:
        return "the same"
    return f"{ratio:.0%}".replace("%", " % of") if ratio < 1.0 else f"{ratio:.2g} times"

"""The bake: every sample of a scene's parameter space, into a PEM that can always be gone on with."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

from mirrorbake import _core
from mirrorbake.bake.analyze import analyze
from mirrorbake.bake.choose_weights import with_chosen_weight
from mirrorbake.bake.contents import contents_of, with_static_set
from mirrorbake.bake.estimate import Estimate, estimate
from mirrorbake.bake.renderers import renderer_named
from mirrorbake.bake.sample import SampleBaker
from mirrorbake.bake.workers import Counts, bake_into, bake_on_workers
from mirrorbake.errors import OptionError, StoreError
from mirrorbake.pem.header import Source
from mirrorbake.pem.location import GROUP_NAME, Location
from mirrorbake.pem.store import PemStore, exclusive
from mirrorbake.pem.verify import damaged_samples
from mirrorbake.scene.inputs import hash_inputs
from mirrorbake.scene.parameters import space_of
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.scene.plan import Plan
    from mirrorbake.scene.stage import Stage

ProgressReport: TypeAlias = Callable[[int, int, str], None]
"""Called with steps done, steps in all, and what is going on."""

PlanReport: TypeAlias = Callable[["Plan"], None]
"""Called with what was decided, before the first view."""

EstimateReport: TypeAlias = Callable[[Estimate], bool]
"""Called with what the bake will take, before the first sample; False ends it there."""


@dataclass(frozen=True)
class BakeSummary:
    """What a bake did."""

    views: int
    """Samples that the PEM has in all."""
    resumed: int
    """How many of the samples asked for were there already."""
    plan: Plan
    clamped: int
    """Values of maps and references that float16 could not hold."""
    notes: list[str]
    """What the user should know about the inputs, and about what was found in the folder."""
    unconverged: tuple[str, ...] = ()
    """Maps of this run that the solver did not finish, `sample I: PART/SHELL`."""


def bake(
    config: SceneConfig,
    directory: Location | Path | str,
    progress: ProgressReport | None = None,
    stage: Stage | None = None,
    on_plan: PlanReport | None = None,
    samples: Sequence[int] | None = None,
    *,
    workers: str | None = None,
    on_estimate: EstimateReport | None = None,
) -> BakeSummary:
    """Bake a scene's PEM into a folder, or go on with one that was interrupted.

    Parameters
    ----------
    config
        The scene.
    directory
        A folder, made if it does not exist, or a URL. If it holds a PEM of the same scene, only what is
        missing or damaged is baked.
    progress
        Told about every sample.
    stage
        The scene, if it has been prepared already.
    on_plan
        Told what is "auto" in the scene and was decided, before the first sample; when resuming, what was
        decided then.
    samples
        Numbers of those to bake; None: all. Each comes out the same, bit for bit, whichever others are
        baked, and when; several processes may bake different samples of one PEM.
    workers
        A number of processes or the address of a Dask scheduler that bake the samples; None: this process.
    on_estimate
        Told what the bake will take.

    Raises
    ------
    StoreError
        The folder cannot be written to, holds something else, or a PEM of another scene.
    InputError
        The scene is not usable, or has no such sample. Nothing has been written then.
    """
    location = Location.of(directory)
    report = progress or (lambda done, total, text: None)
    source = Source(_core.version(), json.loads(config.model_dump_json()), hash_inputs(config))
    _check_output(location, source)
    if not config.views.awaits_spacing:
        _check_samples(samples, len(space_of(config)))
    if config.infer.renderer is not None:
        renderer_named(config.infer.renderer)
    report(0, 1, "preparing the scene")
    stage = replace(stage or prepare_stage(config), config=config)
    with _held(location, shared=samples is not None):
        if PemStore.exists(location):
            store = PemStore.open(location, writable=True)
            if samples is None:
                store.location.remove_stray_files()
            contents = store.contents()
        else:
            report(0, 1, "finding out what the scene requires")
            plan = analyze(stage)
            store, contents = None, contents_of(stage.planned(plan), plan, source)
            decided = with_chosen_weight(stage.planned(plan), plan, contents)
            contents = replace(contents, header=replace(contents.header, plan=decided))
        plan = contents.header.plan
        stage = stage.planned(plan)
        total = len(stage.space)
        _check_samples(samples, total)
        if on_plan is not None:
            on_plan(plan)
        wanted = list(range(total)) if samples is None else list(dict.fromkeys(samples))
        done, notes = (set[int](), list[str]()) if store is None else _sound(store, wanted, report)
        missing = [index for index in wanted if index not in done]
        summary = BakeSummary(total, len(done), plan, 0, [*stage.built.notes, *notes])
        if on_estimate is not None and missing:
            report(0, len(missing), "estimating")
            if not on_estimate(estimate(stage, contents, len(missing))):
                return summary
        if store is None:
            contents, notes = with_static_set(stage, contents, report)
            summary.notes.extend(notes)
            store = PemStore.create(location, contents)
        if workers is not None and missing:
            counts = bake_on_workers(store, missing, workers, report)
        else:
            counts = _bake_here(stage, store, missing, report)
        unconverged = _unconverged(store, missing)
    summary.notes.extend(_words_of(counts))
    return replace(summary, clamped=counts.clamped, unconverged=unconverged)


def _check_samples(samples: Sequence[int] | None, total: int) -> None:
    for index in samples or ():
        if not 0 <= index < total:
            raise OptionError(f"sample {index}: expected 0 to {total - 1}")


def _words_of(counts: Counts) -> list[str]:
    words, probing = [], counts.probing
    if counts.rejected:
        words.append(f"{counts.rejected} traced samples were not finite and were left out")
    if probing.renderings:
        words.append(
            f"probed from {probing.renderings} pictures, at most {probing.most_of_a_map} for a map; "
            f"{probing.unresolved} pixels of the object, whose lookups they do not tell, were left out"
        )
    return words


def _bake_here(stage: Stage, store: PemStore, missing: Sequence[int], report: ProgressReport) -> Counts:
    baker = SampleBaker(stage, store.contents())
    counts = Counts()
    for step, index in enumerate(missing):
        report(step, len(missing), f"sample {index + 1} of {len(store.header.space)}")
        counts = counts.plus(bake_into(store, baker, index))
    report(len(missing), len(missing), f"{len(missing)} samples")
    return counts


def _sound(store: PemStore, wanted: Sequence[int], report: ProgressReport) -> tuple[set[int], list[str]]:
    """Return the samples that need no baking, and notes on those that are there but damaged."""
    completed = store.completed()
    there = [index for index in wanted if completed[index]]
    if there:
        report(0, len(wanted), f"reading {len(there)} samples that are there")
    damaged = damaged_samples(store, there)
    return set(there) - set(damaged), [f"baked anew: {problem}" for problem in damaged.values()]


def _unconverged(store: PemStore, samples: Sequence[int]) -> tuple[str, ...]:
    found = []
    for index in samples:
        record = store.read_record(index)
        found += [
            f"sample {index}: {entry.name}"
            for entry in store.header.maps
            if not record[f"converged: {entry.name}"]
        ]
    return tuple(found)


def _held(location: Location, *, shared: bool) -> contextlib.AbstractContextManager[None]:
    """Make the folder and hold its lock; at a URL there are no locks, and none is needed for the bits."""
    if location.is_remote:
        return contextlib.nullcontext()
    try:
        location.path.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise StoreError(f"{location}: cannot write: {failure.strerror or failure}") from None
    return exclusive(location.path, shared=shared)


def _check_output(location: Location, source: Source) -> None:
    if location.exists():
        existing = PemStore.open(location).header.source
        if existing.fingerprint != source.fingerprint:
            raise StoreError(
                f"{location}: holds a PEM of another scene ({source.difference_from(existing)}); "
                "bake to another folder or remove it"
            )
    elif not location.is_remote and location.path.exists():
        if not location.path.is_dir():
            raise StoreError(f"{location}: is a file, expected a folder for the PEM")
        if any(not _is_partial(entry.name) for entry in location.path.iterdir()):
            raise StoreError(f"{location}: is not empty and holds no PEM; expected a new or an empty folder")


def _is_partial(name: str) -> bool:
    return name.startswith(f".{GROUP_NAME}.") and name.endswith(".partial")

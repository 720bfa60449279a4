"""How well a PEM does: against independent ray tracing, on the sampled views, between them and off them."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mirrorbake.errors import StoreError
from mirrorbake.evaluate.contenders import (
    CONTENDERS,
    MAIN_RUN_TIME,
    RUN_TIMES,
    Frame,
    contenders_of,
    main_run_time,
)
from mirrorbake.evaluate.metrics import (
    DISPLAY_TRANSFORM,
    flip,
    mean_or_none,
    motion,
    sliding,
    ssim,
    worst_error,
)
from mirrorbake.evaluate.places import PLACES, View, choose_views
from mirrorbake.evaluate.references import (
    MARGIN_DECIBELS,
    REFERENCES_NAME,
    Reference,
    ReferenceCache,
    object_window,
    refined_reference,
)
from mirrorbake.pem.location import Location
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.pem.store import PemStore

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.bake.bake import ProgressReport
    from mirrorbake.evaluate.contenders import Contender
    from mirrorbake.evaluate.metrics import Motion
    from mirrorbake.scene.parameters import Point
    from mirrorbake.scene.stage import Stage

METRICS_NAME = "metrics.json"

METRICS = ("psnr", "ssim", "flip", "worst", "sliding")
"""PSNR in dB, SSIM, FLIP, the RMS error of the worst 1 % of the pixels, and the error of the motion since the
view before, in pixels, where that is a neighbour."""

Figures: TypeAlias = dict[str, dict[str, float | None]]
"""By contender, by run time. None: it does not exist there, or the reference's noise hides it."""


@dataclass(frozen=True)
class ViewFigures:
    """Figures of one view."""

    place: str
    degrees: float
    """From the nearest sampled view, as seen from the object."""
    point: Point
    """Of the parameter space, at which the PEM was drawn."""
    ceiling: float
    """PSNR in dB that the true image would have against this view's reference: its noise."""
    samples: int
    """Per pixel of the reference."""
    seconds: float
    """That tracing the reference took, now or when it was put into the cache."""
    metrics: dict[str, Figures]
    """By one of `METRICS`."""

    @property
    def margin(self) -> float:
        """DB between the best contender's PSNR and the ceiling; infinite if there is neither."""
        best = [v for row in self.metrics["psnr"].values() for v in row.values() if v is not None]
        return self.ceiling - max(best) if best and math.isfinite(self.ceiling) else math.inf


@dataclass(frozen=True)
class Evaluation:
    """Figures of a whole PEM."""

    views: list[ViewFigures]
    header: dict[str, Any]
    notes: list[str] = field(default_factory=list)
    """What the user should know about the figures."""
    written: bool = False
    """Whether they are in metrics.json."""

    def mean(
        self, contender: str, place: str, *, run_time: str = MAIN_RUN_TIME, metric: str = "psnr"
    ) -> float | None:
        """Mean of a metric over the views of a place (PSNR: of the dB); None if there are none."""
        return mean_or_none(
            [
                view.metrics[metric].get(contender, {}).get(run_time)
                for view in self.views
                if view.place == place
            ]
        )

    @property
    def places(self) -> list[str]:
        """Those that there are views of, in the order of the tables."""
        return [place for place in PLACES if any(view.place == place for view in self.views)]

    def to_json(self) -> str:
        """Return the text of metrics.json. PSNR of equal images is null: infinity is not JSON."""
        summary = {
            contender: {
                run_time: {
                    place: finite(self.mean(contender, place, run_time=run_time)) for place in self.places
                }
                for run_time in RUN_TIMES
            }
            for contender in CONTENDERS
        }
        views = [
            {
                "place": view.place,
                "degrees": view.degrees,
                "point": list(view.point),
                "ceiling": finite(view.ceiling),
                "reference_samples": view.samples,
                "reference_s": view.seconds,
                **{
                    metric: {
                        contender: {run_time: finite(value) for run_time, value in row.items()}
                        for contender, row in figures.items()
                    }
                    for metric, figures in view.metrics.items()
                },
            }
            for view in self.views
        ]
        content = {"views": views, "summary": summary, "notes": self.notes, **self.header}
        return json.dumps(content, indent=1) + "\n"


def finite(value: float | None) -> float | None:
    """None for what is not finite."""
    return value if value is not None and math.isfinite(value) else None


@dataclass(frozen=True)
class SeenView:
    """A view with its reference and what the contenders make of it."""

    view: View
    reference: Reference
    pictures: dict[str, dict[str, FloatArray]]
    """Radiance (H, W, 3) of the object in the reference's window, by contender and run time."""
    run_time: str
    """The one to show: that of the PEM's maps."""


class Onlooker:
    """Looks at a PEM from any view: reference and contenders.

    Parameters
    ----------
    pem
        The PEM.
    references
        The folder in which references are kept; None: beside the PEM.
    only
        Names of the contenders that look.
    margin
        dB that new references get to spare.
    contenders
        Instead of the PEM's own.
    run_times
        How they are drawn: some of `RUN_TIMES`.
    """

    def __init__(
        self,
        pem: OpenedPem,
        references: Path | None = None,
        only: Collection[str] = CONTENDERS,
        margin: float = MARGIN_DECIBELS,
        *,
        contenders: Mapping[str, Contender] | None = None,
        run_times: Collection[str] = tuple(RUN_TIMES),
    ) -> None:
        self.pem = pem
        self._run_times = run_times
        self._margin = margin
        self.cache = ReferenceCache(
            references or pem.store.location.joined(REFERENCES_NAME),
            pem.store.header.source,
            pem.store.header.plan.depth,
        )
        found = contenders_of(pem) if contenders is None else contenders
        self.contenders: dict[str, Contender] = {
            name: contender for name, contender in found.items() if name in only
        }

    def look(self, view: View) -> SeenView | None:
        """Return a view with a reference that is good enough for it; None if the object is not in it."""
        stage = self.pem.stage.at(view.point)
        window = object_window(stage, view.camera)
        if window[2] == 0:
            return None
        frame = Frame(self.pem, view, window)
        pictures = {
            name: {run_time: contender.render(frame, run_time) for run_time in self._run_times}
            for name, contender in self.contenders.items()
        }
        images = [image for row in pictures.values() for image in row.values()]

        def best_error(reference: Reference) -> float | None:
            errors = [reference.error(image) for image in images]
            return None if None in errors else min(error for error in errors if error is not None)

        reference = refined_reference(stage, view.camera, window, self.cache, best_error, self._margin)
        return SeenView(view, reference, pictures, main_run_time(self.pem)) if reference.mask.any() else None


def evaluate(
    directory: Location | Path | str,
    progress: ProgressReport | None = None,
    stage: Stage | None = None,
    *,
    every_view: bool = False,
    on_view: Callable[[SeenView], None] | None = None,
) -> Evaluation:
    """Compare a PEM with independent ray tracing and write metrics.json into its folder.

    References are traced with other random numbers than the PEM's targets, with as many samples as bring
    their noise 6 dB below the smallest error that is measured, and kept in `DIR/references`.

    Parameters
    ----------
    directory
        A folder or URL with a complete PEM. If it cannot be written to, as nothing behind `https://` can, the
        figures are returned all the same.
    progress
        Told about every view.
    stage
        The PEM's scene, if it has been prepared already.
    every_view
        Look at every sample and between every two, not at a selection (`choose_views`).
    on_view
        Told about every view with the object in it, with its pictures.

    Raises
    ------
    StoreError
        As `open_pem` raises it.
    """
    location = Location.of(directory)
    report = progress or (lambda done, total, text: None)
    count = len(PemStore.open(location).header.space)
    report(0, count, "preparing the scene")
    pem = open_pem(location, stage)
    onlooker = Onlooker(pem)
    views = choose_views(pem.stage.built.cameras, pem.space, every=every_view)
    figures: list[ViewFigures] = []
    unseen = []
    before: SeenView | None = None
    for step, view in enumerate(views):
        report(step, len(views), f"{view.place}, {view.degrees:.3g}° from a sample")
        seen = onlooker.look(view)
        if seen is None:
            unseen.append(view.place)
        else:
            if on_view is not None:
                on_view(seen)
            figures.append(_figures(seen, before if view.place == "between" else None))
        before = seen
    report(len(views), len(views), f"{len(views)} views")
    notes = _notes(figures, unseen, onlooker.cache)
    source = pem.store.header.source
    evaluation = Evaluation(
        figures,
        {
            "library": source.library,
            "display_transform": DISPLAY_TRANSFORM,
            "mask": "pixels that the object covers wholly",
            "run_time": main_run_time(pem),
            "config": source.config,
            "plan": pem.store.header.plan.to_dict(),
            "inputs": source.inputs,
        },
        notes,
    )
    try:
        location.joined(METRICS_NAME).write_bytes(evaluation.to_json().encode())
    except StoreError as failure:
        notes.append(str(failure))
        return evaluation
    return replace(evaluation, written=True)


def _notes(figures: list[ViewFigures], unseen: list[str], cache: ReferenceCache) -> list[str]:
    notes = []
    if unseen:
        notes.append(f"no pixel is wholly the object's from: {', '.join(dict.fromkeys(unseen))}")
    noisy = [view.place for view in figures if view.margin < MARGIN_DECIBELS - 0.05]
    if noisy:
        notes.append(
            f"the reference has less than {MARGIN_DECIBELS:g} dB to spare, for all its samples: "
            + ", ".join(dict.fromkeys(noisy))
        )
    if cache.problem is not None:
        notes.append(f"references are not kept: {cache.problem}")
    return notes


def _figures(seen: SeenView, before: SeenView | None) -> ViewFigures:
    reference = seen.reference
    whole, mask = reference.images.beauty, reference.mask
    pair = None if before is None else _Pair(before, seen)
    metrics: dict[str, Figures] = {metric: {} for metric in METRICS}
    for contender, row in seen.pictures.items():
        for metric in METRICS:
            metrics[metric][contender] = {}
        for run_time, light in row.items():
            picture = reference.images.composite(light)
            values = {
                "psnr": reference.psnr(light),
                "ssim": ssim(picture, whole, mask),
                "flip": flip(picture, whole, mask),
                "worst": worst_error(light, reference.images.object, mask),
                "sliding": None if pair is None else pair.sliding(contender, run_time),
            }
            for metric, value in values.items():
                metrics[metric][contender][run_time] = value
    view = seen.view
    return ViewFigures(
        view.place, view.degrees, view.point, reference.ceiling, reference.samples, reference.seconds, metrics
    )


class _Pair:
    """Two neighbouring views, placed in a part of the frame that holds both their windows."""

    def __init__(self, before: SeenView, seen: SeenView) -> None:
        self._views = (before, seen)
        windows = [view.reference.window for view in self._views]
        self._left, self._top = (min(window[axis] for window in windows) for axis in (0, 1))
        right, bottom = (max(window[axis] + window[axis + 2] for window in windows) for axis in (0, 1))
        self._shape = (bottom - self._top, right - self._left)
        true = [self._placed(view, view.reference.images.beauty) for view in self._views]
        masks = [self._placed(view, view.reference.mask) > 0 for view in self._views]
        self._motion: Motion = motion((true[0], true[1]), masks[0] & masks[1])

    def sliding(self, contender: str, run_time: str) -> float:
        drawn = [
            self._placed(view, view.reference.images.composite(view.pictures[contender][run_time]))
            for view in self._views
        ]
        return sliding((drawn[0], drawn[1]), self._motion)

    def _placed(self, view: SeenView, image: NDArray[np.generic]) -> FloatArray:
        left, top = view.reference.window[0] - self._left, view.reference.window[1] - self._top
        canvas = np.zeros((*self._shape, *image.shape[2:]), np.float32)
        canvas[top : top + image.shape[0], left : left + image.shape[1]] = image
        return canvas

"""How well a PEM does: against ray tracing, on the sampled views and half-way between them."""

from __future__ import annotations

import json
import math
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mirrorbake.evaluate.contenders import CONTENDERS, render_contenders
from mirrorbake.evaluate.metrics import DISPLAY_TRANSFORM, OBJECT_COVERAGE, mean_or_none, psnr
from mirrorbake.files import write_text
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.pem.store import PemStore, Timings
from mirrorbake.pem.view_images import ViewImages, images_of_trace

if TYPE_CHECKING:
    from pathlib import Path

    from mirrorbake import _core
    from mirrorbake.bake.bake import ProgressReport
    from mirrorbake.scene.stage import Stage

METRICS_NAME = "metrics.json"


@dataclass(frozen=True)
class ViewMetrics:
    """One line of an evaluation."""

    t: float
    sampled: bool
    """Whether the PEM has maps of just this view."""
    trace_s: float
    build_s: float | None
    """None half-way between samples, where nothing is built or solved."""
    solve_s: float | None
    psnr: dict[str, float | None]
    """dB per contender; None where it does not exist, or the object covers no pixel."""


@dataclass(frozen=True)
class Evaluation:
    """Figures of a whole PEM."""

    views: list[ViewMetrics]
    header: dict[str, Any]

    def mean_psnr(self, contender: str, *, sampled: bool) -> float | None:
        """Mean PSNR in dB over the sampled views or those between them; None if there are none."""
        return mean_or_none([view.psnr[contender] for view in self.views if view.sampled == sampled])

    def to_json(self) -> str:
        """Return the text of metrics.json. PSNR of equal images is null: infinity is not JSON."""
        summary = {
            name: {contender: _finite(self.mean_psnr(contender, sampled=sampled)) for contender in CONTENDERS}
            for name, sampled in (("sampled", True), ("between", False))
        }
        views = [
            {
                "t": view.t,
                "sampled": view.sampled,
                "trace_s": view.trace_s,
                "build_s": view.build_s,
                "solve_s": view.solve_s,
                "psnr": {name: _finite(value) for name, value in view.psnr.items()},
            }
            for view in self.views
        ]
        return json.dumps({"views": views, "mean_psnr": summary, **self.header}, indent=1) + "\n"


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def evaluate(
    directory: Path, progress: ProgressReport | None = None, stage: Stage | None = None
) -> Evaluation:
    """Compare a PEM with ray tracing and write metrics.json into its folder.

    The sampled views are compared with the ray tracing they were baked from, those half-way between with a
    new one.

    Parameters
    ----------
    directory
        Holds a complete PEM.
    progress
        Told about every view.
    stage
        The PEM's scene, if it has been prepared already.
    """
    report = progress or (lambda done, total, text: None)
    count = len(PemStore.open(directory).header.parameters)
    total = 2 * count - 1
    report(0, total, "preparing the scene")
    pem = open_pem(directory, stage)
    views = []
    for step in range(total):
        index, between = divmod(step, 2)
        if between:
            t = 0.5 * (pem.parameters[index] + pem.parameters[index + 1])
            report(step, total, f"tracing t = {t:.4f}")
            views.append(_evaluate_between(pem, t))
        else:
            report(step, total, f"view {index + 1} of {count}")
            views.append(_evaluate_sampled(pem, index))
    report(total, total, f"{total} views")
    source = pem.store.header.source
    evaluation = Evaluation(
        views,
        {
            "library": source.library,
            "display_transform": DISPLAY_TRANSFORM,
            "object_coverage": OBJECT_COVERAGE,
            "config": source.config,
            "plan": pem.store.header.plan.to_json(),
            "inputs": source.inputs,
        },
    )
    write_text(directory / METRICS_NAME, evaluation.to_json())
    return evaluation


def _evaluate_sampled(pem: OpenedPem, index: int) -> ViewMetrics:
    t = pem.parameters[index]
    timings: Timings = pem.store.read_timings(index)
    values = compare(pem, t, pem.stage.visibility(t), pem.store.read_images(index))
    return ViewMetrics(t, True, timings.trace_s, timings.build_s, timings.solve_s, values)


def _evaluate_between(pem: OpenedPem, t: float) -> ViewMetrics:
    start = time.perf_counter()
    trace = pem.stage.trace(t)
    trace_s = time.perf_counter() - start
    values = compare(pem, t, trace.samples, images_of_trace(trace))
    return ViewMetrics(t, False, trace_s, None, None, values)


def compare(
    pem: OpenedPem, t: float, samples: _core.SurfaceSamples, images: ViewImages
) -> dict[str, float | None]:
    """PSNR in dB of every contender on the object's pixels; None for what does not exist."""
    mask = images.coverage >= OBJECT_COVERAGE
    values: dict[str, float | None] = dict.fromkeys(CONTENDERS)
    if mask.any():
        for name, image in render_contenders(pem, t, samples).items():
            values[name] = psnr(image, images.object, mask)
    return values

"""A study in words and pictures: tables, plots, and its section of a report."""

from __future__ import annotations

import html
import json
import textwrap
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from rich.table import Table

from mirrorbake.evaluate.report.pictures import Plot
from mirrorbake.files import atomic_output
from mirrorbake.study.trade.study import STUDY_NAME, Study, summary

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from mirrorbake.study.trade.trial import Trial

PLOT_NAME = "study.png"
COST_TITLES = {
    "bytes_per_degree": "bytes of maps per degree of the arc",
    "bake_s": "seconds of baking per degree of the arc",
    "draw_ms": "milliseconds of one core to draw a frame",
}
SHOWN_COSTS = ("bytes_per_degree", "bake_s", "draw_ms")
OWN = "the scene's own"
KEY_LINE, KEY_WIDTH = 0.19, 78
"""Height of a line of the list below a plot, in inches, and characters that it has."""


def words_of(trial: Trial) -> str:
    """The settings of a trial, in words."""
    return ", ".join(f"{axis} {label}" for axis, label in trial.settings.items()) or OWN


def as_json(result: Study) -> dict[str, Any]:
    """Return plain values of all that was measured, with the fronts and the advice."""
    trials = [trial.to_dict() for trial in result.all]
    return {"trials": trials, **summary(result), "planned": result.planned, "refused": result.refused}


def bytes_in_words(count: float) -> str:
    """Words for a number of bytes."""
    return f"{count / 1e6:.3g} MB" if count >= 1e6 else f"{count / 1e3:.3g} kB"


def _db(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _figures(trial: Trial, base: Trial) -> list[str]:
    change = None if trial.near is None or base.near is None else trial.near - base.near
    return [
        bytes_in_words(trial.bytes_per_degree),
        f"{trial.bake_s:.2f}",
        f"{trial.draw_ms:.0f}",
        *(_db(trial.psnr.get(place)) for place in ("on", "between", "off_5")),
        "–" if change is None else f"{change:+.2f}",
    ]


HEADINGS = ("bytes/°", "bake s/°", "draw ms", "on", "between", "off 5°", "change dB")


def tables(result: Study) -> list[Table]:
    """Return the tables for a terminal: one setting changed at a time, and the front of the combinations."""
    single = Table(
        title="One choice at a time: PSNR in dB against independent ray tracing", title_justify="left"
    )
    single.add_column("choice")
    single.add_column("setting")
    front = Table(
        title="The best for their bytes, for their time to bake, and for their time to draw",
        title_justify="left",
    )
    front.add_column("settings that are not the scene's own", overflow="fold")
    for table in (single, front):
        for heading in HEADINGS:
            table.add_column(heading, justify="right")
    single.add_row("", OWN, *_figures(result.base, result.base))
    for axis in result.axes:
        single.add_section()
        for trial in result.of_axis(axis.name):
            single.add_row(axis.title, trial.settings[axis.name], *_figures(trial, result.base))
    for cost in SHOWN_COSTS:
        front.add_section()
        for trial in result.front(cost):
            front.add_row(words_of(trial), *_figures(trial, result.base))
    return [single, front]


def plot(result: Study, path: Path) -> None:
    """Write a PNG: error against bytes, the time to bake and the time to draw, with the fronts marked.

    The steps of a front are numbered; what they stand for is listed below.
    """
    style: dict[Any, Any] = {"font.family": "sans-serif", "font.sans-serif": ["DejaVu Sans"], "font.size": 9}
    keys = [_key(result.front(cost)) for cost in SHOWN_COSTS]
    lines = max(text.count("\n") + 1 for text in keys)
    with mpl.rc_context(style):
        figure = Figure(figsize=(15, 4.6 + KEY_LINE * lines), layout="constrained")
        above, below = figure.subplots(2, len(SHOWN_COSTS), height_ratios=(4.6, KEY_LINE * lines))
        for axes, beneath, cost, text in zip(above, below, SHOWN_COSTS, keys, strict=True):
            _draw_front(axes, result, cost)
            beneath.axis("off")
            beneath.text(0.0, 1.0, text, fontsize=8, va="top", linespacing=1.3, transform=beneath.transAxes)
        above[-1].legend(fontsize=8, loc="lower right")
        with atomic_output(path) as temporary:
            figure.savefig(temporary, dpi=150, facecolor="white")


def _key(front: Sequence[Trial]) -> str:
    """What the numbers of a front's steps stand for, a few lines."""
    lines = []
    for number, trial in enumerate(front, start=1):
        lines += textwrap.wrap(f"{number}  {words_of(trial)}", KEY_WIDTH, subsequent_indent="     ")
    return "\n".join(lines)


def _draw_front(axes: Axes, result: Study, cost: str) -> None:
    seen = [trial for trial in result.all if trial.near is not None]
    single = [trial for trial in seen if len(trial.settings) < 2]
    combined = [trial for trial in seen if len(trial.settings) > 1]
    for trials, marker, label in ((single, "o", "one choice changed"), (combined, "^", "combinations")):
        x, y = _places(trials, cost)
        axes.plot(x, y, marker, color="0.65", markersize=5, label=label)
    front = result.front(cost)
    x, y = _places(front, cost)
    axes.step(x, y, "-o", where="post", color="C0", label="front")
    for number, place in enumerate(zip(x, y, strict=True), start=1):
        # On the left above a step nothing else of the front is.
        axes.annotate(
            str(number), place, xytext=(-4, 4), textcoords="offset points", ha="right", weight="bold"
        )
    axes.plot(*_places([result.base], cost), "*", color="C3", markersize=12, label=OWN)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: _tick(value)))
    low, high = axes.get_xlim()
    subs = (1.0, 2.0, 5.0) if high < 200.0 * low else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(base=10, subs=subs, numticks=12))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.margins(x=0.1)
    axes.set_xlabel(COST_TITLES[cost])
    axes.set_ylabel("PSNR, dB: mean on and between samples")
    axes.grid(color="0.9")


def _places(trials: Sequence[Trial], cost: str) -> tuple[list[float], list[float]]:
    return [getattr(trial, cost) for trial in trials], [trial.near or 0.0 for trial in trials]


def _tick(value: float) -> str:
    return f"{value:g}" if value < 1e3 else f"{value / 1e3:g}k" if value < 1e6 else f"{value / 1e6:g}M"


def section(directory: Path) -> str:
    """The section of a report on the study that a folder holds: HTML; nothing without one."""
    path = directory / STUDY_NAME
    if not path.is_file():
        return ""
    data = json.loads(path.read_text(encoding="utf-8"))
    if "fronts" not in data:
        return ""
    trials = data["trials"]
    near = [_near(trial) for trial in trials]
    parts = ["<h2>What the choices cost</h2>"]
    parts += [f"<p>{html.escape(_sentence(words))}</p>" for words in data["advice"]]
    for cost in SHOWN_COSTS:
        points = [
            (float(trial[cost]), value)
            for trial, value in zip(trials, near, strict=True)
            if value is not None and trial[cost] > 0
        ]
        parts.append(_front_plot(cost, trials, points, data["fronts"][cost]))
    return "\n".join(parts)


def _sentence(words: str) -> str:
    return words[:1].upper() + words[1:] + "."


def _near(trial: dict[str, Any]) -> float | None:
    values = [value for place in ("on", "between") if (value := trial["psnr"].get(place)) is not None]
    return sum(values) / len(values) if values else None


def _front_plot(
    cost: str,
    trials: Sequence[dict[str, Any]],
    points: Sequence[tuple[float, float]],
    front: Sequence[dict[str, str]],
) -> str:
    if len(points) < 2:
        return ""
    scale = 1e-6 if cost == "bytes_per_degree" else 1.0
    name = "MB of maps per degree" if cost == "bytes_per_degree" else COST_TITLES[cost]
    x, y = [scale * point[0] for point in points], [point[1] for point in points]
    drawing = Plot(x, y, (name, "dB"), title=f"PSNR against {name}")
    best = []
    for trial in trials:
        value = _near(trial)
        if value is None:
            continue
        on_front = trial["settings"] in front
        words = ", ".join(f"{a} {b}" for a, b in trial["settings"].items()) or OWN
        fill = "var(--accent)" if on_front else "var(--line)"
        place = scale * trial[cost]
        drawing.point(place, value, f'style="fill:{fill}"', f"{words}: {value:.1f} dB")
        if on_front:
            best.append((place, value))
    drawing.curve(sorted(best), 'style="stroke:var(--accent)" stroke-width="1.5"')
    return f'<div class="scroll">{drawing.svg()}</div>'

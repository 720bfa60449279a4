"""The tables of an evaluation, for a terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table

from mirrorbake.evaluate.contenders import CONTENDERS, RUN_TIMES, TITLES
from mirrorbake.evaluate.metrics import mean_or_none
from mirrorbake.evaluate.places import PLACE_TITLES

if TYPE_CHECKING:
    from mirrorbake.evaluate.evaluate import Evaluation

METRIC_TITLES = {
    "psnr": "PSNR dB",
    "ssim": "SSIM",
    "flip": "FLIP",
    "worst": "worst 1 %",
    "sliding": "sliding px",
}
METRIC_DIGITS = {"psnr": 2, "ssim": 4, "flip": 4, "worst": 3, "sliding": 2}


def number(value: float | None, digits: int) -> str:
    """Words for a figure; a dash for none."""
    return "–" if value is None else f"{value:.{digits}f}"


def present(evaluation: Evaluation) -> list[str]:
    """Contenders that have a figure somewhere."""
    return [
        name
        for name in CONTENDERS
        if any(
            value is not None
            for view in evaluation.views
            for value in view.metrics["psnr"].get(name, {}).values()
        )
    ]


def metrics_tables(evaluation: Evaluation) -> list[Table]:
    """Return the tables of an evaluation: PSNR of every contender by place, and all metrics of the PEM.

    The run time that the maps were inferred for comes first.
    """
    names = present(evaluation)
    tables = []
    own = evaluation.header.get("run_time")
    run_times = sorted(RUN_TIMES, key=lambda name: name != own)
    for run_time in run_times:
        table = Table(
            title=f"PSNR in dB on the object, as a display shows it; run time {run_time}",
            title_justify="left",
        )
        for heading in ("place", "views", "degrees", "ceiling"):
            table.add_column(heading, justify="left" if heading == "place" else "right", no_wrap=True)
        for name in names:
            table.add_column(TITLES[name], justify="right")
        for place in evaluation.places:
            views = [view for view in evaluation.views if view.place == place]
            table.add_row(
                PLACE_TITLES[place],
                str(len(views)),
                f"{max(view.degrees for view in views):.3g}",
                number(mean_or_none([view.ceiling for view in views]), 1),
                *(number(evaluation.mean(name, place, run_time=run_time), 2) for name in names),
            )
        tables.append(table)
    table = Table(title="The PEM by every metric", title_justify="left")
    table.add_column("place", no_wrap=True)
    table.add_column("run time")
    for title in METRIC_TITLES.values():
        table.add_column(title, justify="right")
    for place in evaluation.places:
        for run_time in run_times:
            values = (
                number(evaluation.mean("pem", place, run_time=run_time, metric=metric), METRIC_DIGITS[metric])
                for metric in METRIC_TITLES
            )
            table.add_row(PLACE_TITLES[place], run_time, *values)
    tables.append(table)
    return tables

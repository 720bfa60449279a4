"""Prints the table of docs/guide/study.md: `python docs/make_study_table.py examples/teapot-study`."""

from __future__ import annotations

import sys
from pathlib import Path

from mirrorbake.study.trade.axes import AXIS_NAMES
from mirrorbake.study.trade.stability import read_study

PLACES = ("on", "between", "off_5")


def main(folder: str) -> None:
    """Print a line for the scene's own choice, and for every choice that was changed alone."""
    study = read_study(Path(folder))
    print("| axis | setting | bytes a degree | bake, s | draw, ms | on | between | 5° off | change |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    places = {axis: place for place, axis in enumerate(("", *AXIS_NAMES))}
    for trial in sorted(study.all, key=lambda trial: places[next(iter(trial.settings), "")]):
        if len(trial.settings) > 1 or trial.near is None or study.base.near is None:
            continue
        axis, label = next(iter(trial.settings.items()), ("", "the plan's own"))
        figures = ["–" if (value := trial.psnr.get(place)) is None else f"{value:.1f}" for place in PLACES]
        change = f"{trial.near - study.base.near:+.1f}" if trial.settings else ""
        print(
            f"| {f'`{axis}`' if axis else ''} | {label} | {trial.bytes_per_degree / 1e3:.0f} kB | "
            f"{trial.bake_s:.1f} | {trial.draw_ms:.0f} | {' | '.join(figures)} | {change} |"
        )


if __name__ == "__main__":
    main(sys.argv[1])

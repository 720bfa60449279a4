"""The ready-made demonstration: a teapot in its room, small enough for some minutes on two cores."""

from __future__ import annotations

from typing import TYPE_CHECKING

from mirrorbake.bake.bake import bake
from mirrorbake.evaluate.contact_sheet import SHEET_NAME, contact_sheet
from mirrorbake.evaluate.evaluate import evaluate
from mirrorbake.pem.opened import open_pem
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from mirrorbake.bake.bake import ProgressReport
    from mirrorbake.evaluate.evaluate import Evaluation
    from mirrorbake.scene.config import SceneConfig


def demo_config() -> SceneConfig:
    """Return the demonstration's scene: the paper's teapot, views 1° apart, at a reduced size."""
    return parse_config(
        {
            "reflector": {"object": "teapot"},
            "surroundings": {"room": "furnished"},
            "views": {"count": 5, "degrees": 4.0, "start": 20.0, "size": [480, 360]},
            "maps": {"size": 128},
            "trace": {"samples": 16},
            # What the page draws is what the maps are inferred for.
            "infer": {"fit": "display", "run_time": "Web"},
        },
        "demo",
    )


def run_demo(directory: Path, add_progress: Callable[[str], ProgressReport]) -> tuple[Evaluation, Path]:
    """Bake, evaluate and draw the demonstration.

    Parameters
    ----------
    directory
        Takes the PEM, metrics.json and the contact sheet.
    add_progress
        Starts a progress display of a title.

    Returns
    -------
    tuple
        The figures, and where the contact sheet is.
    """
    stage = prepare_stage(demo_config())
    bake(stage.config, directory, add_progress("bake"), stage)
    evaluation = evaluate(directory, add_progress("evaluate"), stage)
    sheet = directory / SHEET_NAME
    contact_sheet(open_pem(directory, stage), sheet)
    return evaluation, sheet

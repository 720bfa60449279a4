"""The command line. Data goes to stdout, progress and messages to stderr.

Exit status: 0 success, 2 wrong usage, 3 bad files, 4 a computation that cannot give an answer, 130
interrupted. Commands import what they need themselves: `--help` should not wait for Zarr and matplotlib.
"""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from mirrorbake import _core
from mirrorbake.command import reports_errors
from mirrorbake.errors import InputError
from mirrorbake.study import app as study_app

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from mirrorbake.bake import ProgressReport
    from mirrorbake.config import SceneConfig
    from mirrorbake.evaluate import Evaluation
    from mirrorbake.plan import Plan

app = typer.Typer(
    name="mirrorbake",
    help="Bake the reflections of shiny objects into parameterized environment maps.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.add_typer(study_app, name="study")
messages = Console(stderr=True, highlight=False)


@contextlib.contextmanager
def _progress() -> Iterator[Callable[[str], ProgressReport]]:
    """Show progress bars on stderr; what is yielded adds one."""
    columns = (
        TextColumn("[bold]{task.fields[title]}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=messages) as bars:

        def add(title: str) -> ProgressReport:
            task = bars.add_task("", title=title)

            def report(done: int, total: int, text: str) -> None:
                bars.update(task, completed=done, total=total, description=text)

            return report

        yield add


def _parse_size(text: str) -> list[int]:
    width, separator, height = text.lower().partition("x")
    if not separator or not all(part.isascii() and part.isdigit() for part in (width, height)):
        raise typer.BadParameter(f"{text!r}: expected WIDTHxHEIGHT in pixels, such as 512x512")
    return [int(width), int(height)]


def _parse_set(text: str) -> tuple[tuple[str, ...], Any]:
    from mirrorbake.config import parse_override

    try:
        return parse_override(text)
    except InputError as failure:
        raise typer.BadParameter(str(failure)) from None


def _print_figures(evaluation: Evaluation, json: bool) -> None:
    from mirrorbake.report import metrics_table

    if json:
        typer.echo(evaluation.to_json(), nl=False)
    else:
        # A pipe or a log has no width of its own; the table should not be squeezed into 80 columns there.
        console = Console(highlight=False, width=None if sys.stdout.isatty() else 120)
        console.print(metrics_table(evaluation))


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mirrorbake {_core.version()}")
        raise typer.Exit


Threads = Annotated[
    int, typer.Option("--threads", min=0, max=1024, metavar="N", help="Threads at most; 0: all cores.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the figures as JSON instead of a table.")]
Folder = Annotated[
    Path, typer.Argument(metavar="DIR", help="Folder with a finished PEM.", show_default=False)
]


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit."),
    ] = False,
) -> None:
    pass


Views = Annotated[
    int | None,
    typer.Option("--views", metavar="N", help="Number of views on the arc. [default: views.count]"),
]
Size = Annotated[str | None, typer.Option("--size", metavar="WxH", help="Pixels. [default: views.size]")]
Spp = Annotated[
    int | None, typer.Option("--spp", metavar="N", help="Samples per pixel. [default: trace.samples]")
]
EmSize = Annotated[
    int | None,
    typer.Option("--em-size", metavar="N", help="Texels along a side of a map's face. [default: maps.size]"),
]
Seed = Annotated[int | None, typer.Option("--seed", metavar="N", help="[default: trace.seed]")]
Assignments = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Any key of the scene file: --set reflector.mesh=bunny.obj"
    ),
]


def _scene_config(
    scene: Path,
    assignments: list[str] | None,
    views: int | None,
    size: str | None,
    spp: int | None,
    em_size: int | None,
    seed: int | None,
) -> SceneConfig:
    """Load a scene file, with --set and the options that have names of their own instead of its values."""
    from mirrorbake.config import load_config

    named = {
        ("views", "count"): views,
        ("views", "size"): None if size is None else _parse_size(size),
        ("trace", "samples"): spp,
        ("maps", "size"): em_size,
        ("trace", "seed"): seed,
    }
    overrides: list[tuple[tuple[str, ...], Any]] = [_parse_set(text) for text in assignments or []]
    overrides += [(key, value) for key, value in named.items() if value is not None]
    return load_config(scene, overrides)


def _print_plan(plan: Plan) -> None:
    for line in plan.lines():
        messages.print(line, markup=False, soft_wrap=True)


@app.command("bake")
@reports_errors
def bake_command(
    scene: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="The scene file.", show_default=False)],
    out: Annotated[
        Path,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Folder for the PEM; resumes one of the same scene.",
            show_default=False,
        ),
    ],
    views: Views = None,
    size: Size = None,
    spp: Spp = None,
    em_size: EmSize = None,
    seed: Seed = None,
    assignments: Assignments = None,
    threads: Threads = 0,
) -> None:
    """Bake a scene's reflections into one set of environment maps per view of the arc.

    What the scene leaves to be decided ("auto") is decided first and printed, as `analyze` does.
    """
    from mirrorbake.bake import bake

    config = _scene_config(scene, assignments, views, size, spp, em_size, seed)
    limit = _core.ThreadLimit(threads)
    with _progress() as add_bar:
        summary = bake(config, out, add_bar("bake"), on_plan=_print_plan)
    del limit
    warnings = list(summary.notes)
    if summary.clamped:
        warnings.append(
            f"{summary.clamped} values above 65504 were clamped; maps.precision = 'float32' keeps them"
        )
    for warning in warnings:
        messages.print(f"warning: {warning}", markup=False, soft_wrap=True)
    resumed = f", {summary.resumed} of them from an earlier run" if summary.resumed else ""
    messages.print(f"{out}: {summary.views} views{resumed}", markup=False, soft_wrap=True)


@app.command("analyze")
@reports_errors
def analyze_command(
    scene: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="The scene file.", show_default=False)],
    views: Views = None,
    size: Size = None,
    spp: Spp = None,
    em_size: EmSize = None,
    seed: Seed = None,
    assignments: Assignments = None,
    json: Json = False,
    threads: Threads = 0,
) -> None:
    """Tell what `bake` with the same options decides, and why: layers, bounces, samples, geometry, maps."""
    import json as json_module

    from mirrorbake.analyze import analyze
    from mirrorbake.scene import prepare_stage

    config = _scene_config(scene, assignments, views, size, spp, em_size, seed)
    limit = _core.ThreadLimit(threads)
    plan = analyze(prepare_stage(config))
    del limit
    if json:
        typer.echo(json_module.dumps(plan.to_json(), indent=1))
        return
    for line in plan.lines():
        typer.echo(line)


@app.command("evaluate")
@reports_errors
def evaluate_command(directory: Folder, json: Json = False, threads: Threads = 0) -> None:
    """Compare a PEM and static maps with ray tracing, on the sampled views and half-way between them."""
    from mirrorbake.evaluate import METRICS_NAME, evaluate

    limit = _core.ThreadLimit(threads)
    with _progress() as add_bar:
        evaluation = evaluate(directory, add_bar("evaluate"))
    del limit
    _print_figures(evaluation, json)
    messages.print(f"wrote {directory / METRICS_NAME}", markup=False, soft_wrap=True)


@app.command("render")
@reports_errors
def render_command(
    directory: Folder,
    view: Annotated[
        float,
        typer.Option("--view", metavar="T", help="Parameter of the arc, from 0 to 1.", show_default=False),
    ],
    out: Annotated[
        Path,
        typer.Option(
            "--out", metavar="FILE", help="An .exr (scene-linear) or a .png (sRGB).", show_default=False
        ),
    ],
    threads: Threads = 0,
) -> None:
    """Draw a PEM at any parameter of its arc, blended between the neighbouring views."""
    from mirrorbake.render import render

    limit = _core.ThreadLimit(threads)
    render(directory, view, out)
    del limit
    messages.print(f"wrote {out}", markup=False, soft_wrap=True)


@app.command("demo")
@reports_errors
def demo_command(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Folder for the results.")] = Path(
        "out/demo"
    ),
    json: Json = False,
    threads: Threads = 0,
) -> None:
    """Bake and evaluate a small teapot scene: about a minute on two cores."""
    from mirrorbake.demo import run_demo

    limit = _core.ThreadLimit(threads)
    with _progress() as add_bar:
        evaluation, sheet = run_demo(out, add_bar)
    del limit
    _print_figures(evaluation, json)
    messages.print(f"wrote {sheet}", markup=False, soft_wrap=True)


def main() -> None:
    """Run the command line; never returns."""
    app()

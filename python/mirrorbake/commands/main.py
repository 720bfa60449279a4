"""The command line. Data goes to stdout, progress and messages to stderr.

Exit status: 0 success, 2 wrong usage, 3 bad files, 4 a computation that cannot give an answer, 130
interrupted. Commands import what they need themselves: `--help` should not wait for Zarr and matplotlib.
"""

from __future__ import annotations

import codecs
import io
import sys
from typing import Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.analyze import analyze_command
from mirrorbake.commands.bake import bake_command
from mirrorbake.commands.demo import demo_command
from mirrorbake.commands.errors import OneLineErrors
from mirrorbake.commands.evaluate import evaluate_command
from mirrorbake.commands.export import export_command
from mirrorbake.commands.info import info_command, verify_command
from mirrorbake.commands.render import render_command
from mirrorbake.commands.report import report_command
from mirrorbake.commands.sheet import sheet_command
from mirrorbake.commands.study import app as study_app
from mirrorbake.commands.view import view_command

app = typer.Typer(
    name="mirrorbake",
    help="Bake the reflections of shiny objects into parameterized environment maps.",
    cls=OneLineErrors,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)
app.command("bake")(bake_command)
app.command("analyze")(analyze_command)
app.command("evaluate")(evaluate_command)
app.command("report")(report_command)
app.command("sheet")(sheet_command)
app.command("render")(render_command)
app.command("export")(export_command)
app.command("view")(view_command)
app.command("info")(info_command)
app.command("verify")(verify_command)
app.command("demo")(demo_command)
app.add_typer(study_app, name="study")


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"mirrorbake {_core.version()}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version and exit."),
    ] = False,
) -> None:
    pass


def _print_utf8() -> None:
    """Print UTF-8 in the C locale: as Python does by itself unless PYTHONUTF8=0 forbids it."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and codecs.lookup(stream.encoding).name == "ascii":
            stream.reconfigure(encoding="utf-8", errors="surrogateescape")


def main() -> None:
    """Run the command line; never returns."""
    _print_utf8()
    app()

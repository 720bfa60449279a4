"""Options that several commands have, and what they lead to."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console

from mirrorbake.commands.progress import messages
from mirrorbake.errors import InputError

if TYPE_CHECKING:
    from mirrorbake.evaluate.evaluate import Evaluation
    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.scene.plan import Plan


def _parse_size(text: str) -> list[int]:
    width, separator, height = text.lower().partition("x")
    if not separator or not all(part.isascii() and part.isdigit() for part in (width, height)):
        raise typer.BadParameter(f"{text!r}: expected WIDTHxHEIGHT in pixels, such as 512x512")
    return [int(width), int(height)]


def _parse_set(text: str) -> tuple[tuple[str, ...], Any]:
    from mirrorbake.scene.load import parse_override

    try:
        return parse_override(text)
    except InputError as failure:
        raise typer.BadParameter(str(failure)) from None


def print_figures(evaluation: Evaluation, json: bool) -> None:
    from mirrorbake.evaluate.table import metrics_tables

    if json:
        typer.echo(evaluation.to_json(), nl=False)
    else:
        # A pipe or a log has no width of its own; the table should not be squeezed into 80 columns there.
        console = Console(highlight=False, width=None if sys.stdout.isatty() else 120)
        for table in metrics_tables(evaluation):
            console.print(table)
    for note in evaluation.notes:
        messages.print(f"note: {note}", markup=False, soft_wrap=True)


Threads = Annotated[
    int, typer.Option("--threads", min=0, max=1024, metavar="N", help="Threads at most; 0: all cores.")
]
Json = Annotated[bool, typer.Option("--json", help="Print the figures as JSON instead of a table.")]
Folder = Annotated[
    Path, typer.Argument(metavar="DIR", help="Folder with a finished PEM.", show_default=False)
]
Place = Annotated[str, typer.Argument(metavar="DIR", help="Folder or URL with a PEM.", show_default=False)]
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


Exposure = Annotated[
    float, typer.Option("--exposure", metavar="STOPS", help="Of films and PNG pictures: factor 2^STOPS.")
]
ToneMap = Annotated[
    str,
    typer.Option(
        "--tone-map",
        metavar="none|neutral",
        help="Of films and PNG pictures: clipped, or by Khronos PBR Neutral.",
    ),
]
ObjectFile = Annotated[
    Path | None,
    typer.Option(
        "--object", metavar="FILE", help="The reflector: an .obj, .gltf or .glb file. [default: reflector]"
    ),
]
Sky = Annotated[
    Path | None,
    typer.Option("--sky", metavar="FILE", help="A panorama around it. [default: surroundings]"),
]
Quality = Annotated[
    str | None,
    typer.Option(
        "--quality", metavar="draft|normal|high", help="What the bake may spend. [default: auto.quality]"
    ),
]
Draft = Annotated[
    bool | None,
    typer.Option(
        "--draft/--full",
        help="A first look in a minute or two: 9 views on 16 degrees, 256 x 256 pixels, maps of 128, 32 "
        "to 64 samples, where the scene says nothing else. [default: draft without a SCENE.toml, else full]",
        show_default=False,
    ),
]


def scene_config(
    scene: Path | None,
    assignments: list[str] | None,
    views: int | None,
    size: str | None,
    spp: int | None,
    em_size: int | None,
    seed: int | None,
    object_file: Path | None = None,
    sky: Path | None = None,
    *,
    draft: bool | None = None,
    quality: str | None = None,
) -> SceneConfig:
    """Load a scene file, with --set and the options that have names of their own instead of its values."""
    from mirrorbake.scene.load import load_config

    if scene is None and object_file is None:
        raise typer.BadParameter("expected a SCENE.toml, or --object FILE")
    named = {
        ("reflector", "mesh"): None if object_file is None else str(object_file),
        ("surroundings", "panorama"): None if sky is None else str(sky),
        ("views", "count"): views,
        ("views", "size"): None if size is None else _parse_size(size),
        ("trace", "samples"): spp,
        ("maps", "size"): em_size,
        ("trace", "seed"): seed,
        ("auto", "quality"): quality,
    }
    overrides: list[tuple[tuple[str, ...], Any]] = [_parse_set(text) for text in assignments or []]
    overrides += [(key, value) for key, value in named.items() if value is not None]
    return load_config(scene, overrides, draft=scene is None if draft is None else draft)


def print_plan(plan: Plan) -> None:
    for line in plan.lines():
        messages.print(line, markup=False, soft_wrap=True)

"""Studies: what each approximation costs and how far off it is, measured in one run."""

from __future__ import annotations

import json as json_module
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table
from typer.core import TyperGroup

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import Assignments, EmSize, Seed, Size, Threads, scene_config
from mirrorbake.commands.progress import messages, progress
from mirrorbake.errors import OptionError


class _StudyGroup(TyperGroup):
    """`study SCENE` measures a scene; `study NAME`, one approximation by itself."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        if args and args[0] not in self.commands and args[0] != "--help":
            args = ["scene", *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=_StudyGroup,
    help="What approximations cost and how far off they are: a scene's (study SCENE.toml), or alone.",
    no_args_is_help=True,
)

Json = Annotated[bool, typer.Option("--json", help="Print the figures as JSON instead of a table.")]
Out = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Folder for plots. [default: none]")]


@app.callback()
def _root() -> None:
    pass


def _names(text: str) -> list[str]:
    """Those of a list with commas."""
    return [name.strip() for name in text.split(",") if name.strip()]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


@app.command("scene")
@reports_errors
def scene_command(
    scene: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="The scene file.", show_default=False)],
    axes: Annotated[
        str, typer.Option("--axes", metavar="A,B,…", help="Choices to study, by name. [default: all]")
    ] = "",
    minutes: Annotated[
        float, typer.Option("--minutes", min=0.0, metavar="M", help="No trial begins later.")
    ] = 15.0,
    pixels: Annotated[
        int,
        typer.Option(
            "--pixels",
            min=16,
            max=16384,
            metavar="N",
            help="Longest side of pictures; maps shrink with them.",
        ),
    ] = 160,
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for results; goes on with a study in it.")
    ] = Path("out/study"),
    against: Annotated[
        Path | None,
        typer.Option(
            "--against",
            metavar="DIR",
            help="A study of the scene under another seed: tries its combinations, and says what of its "
            "fronts stays. [default: none]",
        ),
    ] = None,
    assignments: Assignments = None,
    seed: Seed = None,
    json: Json = False,
    threads: Threads = 0,
) -> None:
    """Time and bytes against error on a scene of your own: choice by choice, then the best combinations.

    `mirrorbake study SCENE.toml` is short for it.
    """
    from mirrorbake.study.trade import show
    from mirrorbake.study.trade.notebook import Identity
    from mirrorbake.study.trade.stability import combinations_of, compare, read_study
    from mirrorbake.study.trade.study import advice, shrunk, study

    config = scene_config(scene, assignments, None, None, None, None, seed)
    names = _names(axes)
    other = None if against is None else read_study(against, Identity.of(shrunk(config, pixels)))
    again = None if other is None else combinations_of(other)
    with _core.ThreadLimit(threads), progress() as add_bar:
        result = study(config, out, names, minutes, add_bar("study"), longest_side=pixels, again=again)
    show.plot(result, out / show.PLOT_NAME)
    stability = None if other is None else compare(result, other)
    if json:
        content = show.as_json(result)
        if stability is not None:
            content["stability"] = stability.to_dict()
        typer.echo(json_module.dumps(content))
    else:
        console = Console(highlight=False, width=None if sys.stdout.isatty() else 160)
        for table in show.tables(result):
            console.print(table)
        for words in [*advice(result), *(() if stability is None else stability.words())]:
            console.print(f"- {words}", markup=False, soft_wrap=True)
    made = 1 + len(result.trials)
    if made < result.planned:
        messages.print(
            f"note: {made} of {result.planned} trials within the time; the same command goes on",
            markup=False,
            soft_wrap=True,
        )
    for settings, reason in result.refused.items():
        messages.print(f"note: {settings}: not possible: {reason}", markup=False, soft_wrap=True)
    messages.print(f"wrote {out / show.PLOT_NAME}", markup=False, soft_wrap=True)


@app.command("fresnel")
@reports_errors
def fresnel_command(
    json: Json = False,
    out: Out = None,
    max_error: Annotated[float, typer.Option("--max-error", help="What tables are made for.")] = 1e-3,
    samples: Annotated[
        int, typer.Option("--samples", min=10, max=100_000, help="Cosines per curve compared with 50 digits.")
    ] = 200,
    threads: Annotated[
        int, typer.Option("--threads", min=0, max=1024, metavar="N", help="Threads at most; 0: all cores.")
    ] = 0,
) -> None:
    """Error and time of the Fresnel models: rounding, Schlick, tables, metals."""
    from mirrorbake.study import fresnel

    try:
        with _core.ThreadLimit(threads):
            result = fresnel.study(max_error, samples)
    except _core.InvalidArgument as failure:
        raise OptionError(str(failure)) from None
    if out is not None:
        for path in fresnel.plot(result, out):
            typer.echo(f"wrote {path}", err=True)
    if json:
        typer.echo(json_module.dumps(result))
    else:
        _print_fresnel(result)


def _print_fresnel(result: dict[str, Any]) -> None:
    console = Console(highlight=False, width=max(Console().width, 100))
    table = Table(
        *("material", "float32 error", "ns", "Schlick error", "ns", "entries", "table error", "ns"),
        title=f"Against the full equations in float64; {result['isa']}, {result['threads']} threads",
    )
    for row in result["approximations"]:
        size = "-" if row["table_size"] is None else str(row["table_size"])
        table.add_row(
            row["material"],
            *(_number(row[key]) for key in ("exact_error", "exact_ns", "schlick_error", "schlick_ns")),
            size,
            *(_number(row[key]) for key in ("table_error", "table_ns")),
        )
    console.print(table)
    table = Table(
        *("material", "precision", "largest error", "part of the allowance"),
        title=f"Against {result['digits']} digits; allowed: 4 ulp + 1e-7 (float32), 4 ulp + 1e-15 (float64)",
    )
    for curve in result["rounding"]:
        errors = (curve["max_error"], curve["share_of_allowance"])
        table.add_row(curve["material"], curve["dtype"], *(_number(error) for error in errors))
    console.print(table)


@app.command("proxy")
@reports_errors
def proxy_command(
    json: Json = False,
    out: Out = None,
    samples: Annotated[
        int, typer.Option("--samples", min=2, max=100_000, help="Rays per shape, flatness and depth.")
    ] = 30,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the random rays.")] = 1,
) -> None:
    """Error of lookups on proxies, in float32 and float64, against 50 digits."""
    from mirrorbake.study import proxy

    errors = proxy.proxy_errors(samples, seed)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        proxy.plot(errors, out / "proxy-errors.png")
        typer.echo(f"wrote {out / 'proxy-errors.png'}", err=True)
    if json:
        typer.echo(json_module.dumps(proxy.as_json(errors)))
        return
    table = Table("shape", "aspect", "arithmetic", "largest error, radians", "mean")
    groups: dict[tuple[str, float, str], list[proxy.ProxyError]] = {}
    for error in errors:
        groups.setdefault((error.shape, error.aspect, error.arithmetic), []).append(error)
    for (shape, aspect, arithmetic), group in groups.items():
        mean = sum(error.mean for error in group) / len(group)
        largest = max(error.largest for error in group)
        table.add_row(shape, f"{aspect:g}", arithmetic, _number(largest), _number(mean))
    Console(highlight=False).print(table)


@app.command("inference")
@reports_errors
def inference_command(
    scene: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="The scene file.", show_default=False)],
    azimuth: Annotated[
        float, typer.Option("--azimuth", help="Of the view that is inferred, degrees.")
    ] = 22.0,
    elevation: Annotated[float, typer.Option("--elevation", help="Of that view, degrees.")] = 20.0,
    size: Annotated[int, typer.Option("--size", min=16, max=1024, help="Pixels a side of the views.")] = 256,
    map_size: Annotated[
        int, typer.Option("--map-size", min=8, max=512, help="Texels a side of a face.")
    ] = 128,
    samples: Annotated[int, typer.Option("--samples", min=1, max=4096, help="Per pixel, of targets.")] = 256,
    reference_samples: Annotated[
        int, typer.Option("--reference-samples", min=1, max=4096, help="Per pixel, of references.")
    ] = 256,
    run_times: Annotated[
        str, typer.Option("--run-times", metavar="A,B,…", help="Which infer and draw.")
    ] = "Reference,Web,Web1",
    assignments: Assignments = None,
    json: Json = False,
    threads: Threads = 0,
) -> None:
    """Decibels of one view's maps, on it and away from it, by run time and by what is fitted."""
    from dataclasses import asdict

    from mirrorbake.scene.stage import prepare_stage
    from mirrorbake.study import inference

    config = scene_config(scene, assignments, None, f"{size}x{size}", None, None, None)
    names = _names(run_times)
    with _core.ThreadLimit(threads):
        lab = inference.Lab(prepare_stage(config), (azimuth, elevation), samples, reference_samples, map_size)
        results = inference.study(
            lab, names, inference.OPTIONS, lambda text: messages.print(text, markup=False)
        )
    if json:
        typer.echo(json_module.dumps([asdict(result) for result in results]))
        return
    table = Table("run time", "maps of", *inference.PLACES, "seconds", "converged")
    for result in results:
        decibels = (f"{value:.1f}" for value in result.decibels.values())
        table.add_row(
            result.run_time,
            result.fit,
            *decibels,
            f"{result.seconds:.1f}",
            "yes" if result.converged else "no",
        )
    Console(highlight=False, width=None if sys.stdout.isatty() else 140).print(table)


@app.command("quality")
@reports_errors
def quality_command(
    scene: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="The scene file.", show_default=False)],
    qualities: Annotated[
        str, typer.Option("--qualities", metavar="A,B,…", help="Some of draft, normal, high. [default: all]")
    ] = "",
    views: Annotated[
        int, typer.Option("--views", min=1, metavar="N", help="At most, around the middle of the arc.")
    ] = 5,
    size: Size = None,
    em_size: EmSize = None,
    assignments: Assignments = None,
    seed: Seed = None,
    json: Json = False,
    threads: Threads = 0,
) -> None:
    """Time, bytes, memory and decibels of a scene's few views in each quality."""
    import tempfile

    from mirrorbake.evaluate.places import PLACE_TITLES
    from mirrorbake.evaluate.table import number
    from mirrorbake.study import quality

    config = scene_config(scene, assignments, None, size, None, em_size, seed)
    names = _names(qualities)
    with tempfile.TemporaryDirectory() as folder, progress() as add_bar:
        results = quality.study(
            config, Path(folder), names, views=views, threads=threads, progress=add_bar("study")
        )
    if json:
        typer.echo(json_module.dumps([result.to_dict() for result in results]))
        return
    places = [place for place in quality.PLACES if any(place in result.psnr for result in results)]
    table = Table(
        title="Processor time, all threads together; PSNR in dB on the object, as a display shows it",
        title_justify="left",
    )
    table.add_column("quality", no_wrap=True)
    costs = ("preparation s", "first view s", "further view s", "MB a sample", "peak GiB")
    for title in (*costs, *(PLACE_TITLES[place] for place in places), "static set"):
        table.add_column(title, justify="right")
    for result in results:
        table.add_row(
            result.quality,
            number(result.preparation_s, 1),
            number(result.first_view_s, 1),
            number(result.further_view_s, 1),
            number(result.sample_bytes / 1e6, 2),
            number(result.peak_bytes / 2**30, 2),
            *(number(result.psnr.get(place), 1) for place in places),
            number(result.static_set, 1),
        )
    Console(highlight=False, width=None if sys.stdout.isatty() else 140).print(table)

"""`mirrorbake export`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mirrorbake import _core
from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import (
    Folder,
    Threads,
)
from mirrorbake.commands.progress import messages

if TYPE_CHECKING:
    from collections.abc import Iterator

    from mirrorbake.pem.export.map_sets import MapSet


@reports_errors
def export_command(
    directory: Folder,
    maps: Annotated[
        Path | None,
        typer.Option("--maps", metavar="OUT", help="Folder for environment maps of other programs."),
    ] = None,
    format: Annotated[
        str, typer.Option("--format", metavar="ktx2|exr", help="Of --maps; ktx2 holds all levels in a file.")
    ] = "ktx2",
    convention: Annotated[
        str,
        typer.Option(
            "--convention",
            metavar="NAME",
            help="Of --maps: threejs, unity, unreal, blender or godot: whose orientation.",
        ),
    ] = "threejs",
    precision: Annotated[
        str, typer.Option("--precision", metavar="half|float32", help="Of --maps.")
    ] = "half",
    glb: Annotated[
        Path | None,
        typer.Option(
            "--glb", metavar="OUT.glb", help="A glTF file with the mesh, its material and the maps."
        ),
    ] = None,
    sample: Annotated[
        int | None,
        typer.Option(
            "--sample",
            metavar="I",
            help="This sample's maps: with --maps alone, with --glb beside the static.",
        ),
    ] = None,
    all_samples: Annotated[
        bool, typer.Option("--all", help="The static maps and those of all samples.")
    ] = False,
    threads: Threads = 0,
) -> None:
    """Write a PEM for other programs: its maps, a glTF file."""
    if maps is None and glb is None:
        raise typer.BadParameter("nothing to write: give --maps or --glb")
    if sample is not None and all_samples:
        raise typer.BadParameter("--sample and --all exclude each other")
    with _core.ThreadLimit(threads):
        if maps is not None:
            _export_maps(directory, maps, format, convention, precision, sample, all_samples)
        if glb is not None:
            _export_glb(directory, glb, sample, all_samples)


def _export_maps(
    directory: Path,
    out: Path,
    format: str,
    convention: str,
    precision: str,
    sample: int | None,
    all_samples: bool,
) -> None:
    from mirrorbake.pem.export.map_sets import axis_descriptions, sample_set, static_set
    from mirrorbake.pem.export.maps import DESCRIPTION_NAME, export_maps
    from mirrorbake.pem.store import PemStore

    store = PemStore.open(directory)
    store.require_complete()

    def sets() -> Iterator[MapSet]:
        if sample is not None:
            yield sample_set(store, sample)
            return
        yield static_set(store)
        if all_samples:
            yield from (sample_set(store, i) for i in range(len(store.header.space)))

    export_maps(
        sets(),
        out,
        axes=axis_descriptions(store.header.space),
        format=format,
        convention=convention,
        precision=precision,
        report=_print_message,
    )
    _print_message(f"wrote {out / DESCRIPTION_NAME} and the maps that it names")


def _export_glb(directory: Path, out: Path, sample: int | None, all_samples: bool) -> None:
    from mirrorbake.files import check_writable
    from mirrorbake.pem.export.glb import export_glb
    from mirrorbake.pem.opened import unchanged_config
    from mirrorbake.pem.store import PemStore
    from mirrorbake.scene.build import build_scene

    check_writable(out)
    store = PemStore.open(directory)
    store.require_complete()
    samples = [] if sample is None else [sample]
    if all_samples:
        samples = list(range(len(store.header.space)))
    built = build_scene(unchanged_config(store))
    export_glb(store, built, out, samples=samples, report=_print_message)
    _print_message(f"wrote {out}")


def _print_message(text: str) -> None:
    messages.print(text, markup=False, soft_wrap=True)

"""`mirrorbake info` and `mirrorbake verify`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from mirrorbake.commands.errors import reports_errors
from mirrorbake.commands.options import Json, Place
from mirrorbake.commands.progress import messages, progress

if TYPE_CHECKING:
    from mirrorbake.pem.store import PemStore

EXIT_DAMAGED = 3


@reports_errors
def info_command(directory: Place, json: Json = False) -> None:
    """Tell what a PEM holds: its space, parts, shells, maps, plan and bytes."""
    import json as json_module

    from mirrorbake.pem.store import PemStore

    description = _describe(PemStore.open(directory))
    if json:
        typer.echo(json_module.dumps(description, indent=1))
        return
    for key, value in description.items():
        lines = value if isinstance(value, list) else [value]
        for line in lines:
            typer.echo(f"{key:12}{line}")
            key = ""


def _describe(store: PemStore) -> dict[str, Any]:
    header = store.header
    done = store.completed()
    width, height = header.image_size
    first = int(done.argmax()) if done.any() else None
    axes = [
        f"{axis.name}: {len(axis.values)} from {axis.values[0]:g} to {axis.values[-1]:g}"
        for axis in header.space.axes
    ]
    shells = [
        f"{part.name}: " + ", ".join(f"{shell.name} on {shell.proxy['shape']}" for shell in part.shells)
        for part in header.parts
    ]
    texels = f"{header.sizes_in_words} × {header.faces} texels"
    maps = f"{len(header.maps)} of {texels} with all levels, {header.precision}"
    size = "none yet" if first is None else f"{store.sample_bytes(first) / 1e6:.3g} MB (sample {first})"
    run_time = header.run_time
    return {
        "format": f"pem, made by mirrorbake {header.source.library}",
        "samples": f"{int(done.sum())} of {done.size}",
        "axes": axes or ["none"],
        "zero at": ", ".join(f"{x:.10g}" for x in header.origin) + " m of the scene's world",
        "parts": shells,
        "maps": maps,
        "pictures": f"{width} × {height} pixels",
        "a sample": size,
        "run time": f"{run_time['name']}, {run_time['lookups']} lookups a pixel",
        "fingerprint": header.fingerprint,
        "plan": header.plan.lines(),
        "inputs": [str(entry["path"]) for entry in header.source.inputs.values()] or ["none"],
    }


@reports_errors
def verify_command(directory: Place) -> None:
    """Read every chunk of a PEM and compare it with its checksum. Exit status 3 if anything is damaged."""
    from mirrorbake.pem.verify import verify

    with progress() as add_bar:
        verdict = verify(directory, add_bar("verify"))
    for problem in verdict.problems:
        typer.echo(problem)
    sound = verdict.samples - len(verdict.missing) - len(verdict.damaged)
    missing = f", {len(verdict.missing)} not baked" if verdict.missing else ""
    typer.echo(f"{directory}: {sound} of {verdict.samples} samples are sound{missing}")
    if verdict.problems:
        if verdict.damaged:
            messages.print("`mirrorbake bake` with the same scene makes damaged samples anew", markup=False)
        raise typer.Exit(EXIT_DAMAGED)

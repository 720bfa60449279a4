"""Maps of a PEM as files that other programs read."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from mirrorbake import _core
from mirrorbake.envmap import EnvMap
from mirrorbake.errors import InputError, OptionError
from mirrorbake.files import write_text
from mirrorbake.pem.export.frames import (
    FRAMES,
    Frame,
    cube_from_levels,
    move_proxy,
    source_from_panorama,
    turn_cube,
)
from mirrorbake.projection import MAP_PROJECTIONS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from mirrorbake.arrays import FloatArray
    from mirrorbake.literals import FaceLayout, PixelFormat
    from mirrorbake.pem.export.map_sets import MapSet, ShellMap

DESCRIPTION_NAME = "maps.json"
DESCRIPTION_VERSION = 2

FORMATS = ("ktx2", "exr")
PRECISIONS = ("half", "float32")


def export_maps(
    sets: Iterable[MapSet],
    folder: Path,
    *,
    format: str = "ktx2",
    convention: str = "threejs",
    precision: str = "half",
    axes: Sequence[Mapping[str, Any]] = (),
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    run_time: Mapping[str, Any] | None = None,
    fade_degrees: float | None = None,
    report: Callable[[str], None] | None = None,
) -> dict[str, Any]:
    """Write sets of maps and a `maps.json` that says what they are.

    Parameters
    ----------
    sets
        Read one after the other: not all are in memory at once. A shell that several parts share is
        written once.
    folder
        Made if it is not there. Files of the same names are replaced; `maps.json` is written last.
    format
        `ktx2`: all levels of a cube map in a file. `exr`: for programs that take cube maps, one image per
        level with its six faces in a row; for those that take panoramas (blender, unreal), the finest level
        as one.
    convention
        A name of `FRAMES`: whose coordinates and orientation.
    precision
        Of the files. `float32` keeps the values of all levels exactly; `half` rounds them.
    axes
        Of the parameter space, for the description.
    origin
        Where the zero of the maps' positions lies in the scene file's world, metres, for the description.
    run_time, fade_degrees
        How the maps are to be read, and how they fade to the static set, for the description.
    report
        Called with a sentence for each thing to know, such as values that were clamped.

    Returns
    -------
    dict
        What `maps.json` holds.

    Raises
    ------
    OptionError
        A name is unknown, or its program reads no cube maps and `format` is `ktx2`.
    InputError, mirrorbake.FileError
        The folder cannot be written.
    """
    frame = _frame(convention, format, precision)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise InputError(f"{folder}: cannot write: {failure.strerror or failure}") from None
    description: dict[str, Any] = {
        "generator": f"mirrorbake {_core.version()}",
        "version": DESCRIPTION_VERSION,
        "convention": convention,
        "space_from_world": frame.space_matrix.tolist(),
        "lookup_from_space": (frame.lookup_matrix @ frame.space_matrix.T).tolist(),
        "radiance": "scene-linear, Rec.709 primaries; four channels: premultiplied by the fourth, alpha",
        "shells": "front to back: L = L0 + (1 - a0) (L1 + (1 - a1) (...))",
        "origin": (frame.space_matrix @ np.array(origin)).tolist(),
        "runTime": None if run_time is None else dict(run_time),
        "fadeDegrees": fade_degrees,
        "axes": list(axes),
        "sets": [],
    }
    clamped, resampled = 0, False
    for maps in sets:
        resampled = resampled or any(
            shell.projection != "cube" for shells in maps.parts.values() for shell in shells
        )
        entry, count = _write_set(maps, folder, frame, format, precision)
        description["sets"].append(entry)
        clamped += count
    write_text(folder / DESCRIPTION_NAME, json.dumps(description, indent=1) + "\n")
    if report is not None:
        for note in _notes(resampled, clamped):
            report(note)
    return description


def _notes(resampled: bool, clamped: int) -> Iterator[str]:
    if resampled:
        yield "the maps are no cubes: they were resampled, every level by itself"
    if clamped:
        yield (
            f"{clamped} values beyond ±65504 were clamped to what half floats hold; use float32 to keep them"
        )


def _safe(name: str) -> str:
    """A name as a part of a file's name: names of objects may hold anything."""
    return re.sub(r"[^\w-]+", "_", name, flags=re.ASCII)[:60]


def _write_set(
    maps: MapSet, folder: Path, frame: Frame, format: str, precision: str
) -> tuple[dict[str, Any], int]:
    """Description of a set whose maps are written, and how many values were clamped."""
    clamped = 0
    parts = []
    stems: set[str] = set()
    written: dict[int, dict[str, Any]] = {}
    for part, shells in maps.parts.items():
        entries = []
        for shell in shells:
            if id(shell) not in written:
                everywhere = all(any(s is shell for s in others) for others in maps.parts.values())
                alone = shell.name == maps.name and everywhere
                stem = maps.name if alone else f"{maps.name}.{_safe(part)}.{_safe(shell.name)}"
                if stem in stems:
                    stem = f"{stem}.{len(stems)}"
                stems.add(stem)
                files, count = _write_shell(shell, folder, stem, frame, format, precision)
                clamped += count
                written[id(shell)] = _describe(shell, frame, files, format)
            entries.append(written[id(shell)])
        parts.append({"name": part, "shells": entries})
    point = None if maps.point is None else list(maps.point)
    return {"name": maps.name, "point": point, "parts": parts}, clamped


def _frame(convention: str, format: str, precision: str) -> Frame:
    for name, value, known in (
        ("format", format, FORMATS),
        ("precision", precision, PRECISIONS),
        ("convention", convention, tuple(FRAMES)),
    ):
        if value not in known:
            raise OptionError(f"{name} = {value!r}: expected {', '.join(known[:-1])} or {known[-1]}")
    if convention == "blender" and format == "ktx2":
        raise OptionError(
            "format = 'ktx2': Blender reads no cube maps; expected exr, which gives it a panorama"
        )
    return FRAMES[convention]


def _describe(shell: ShellMap, frame: Frame, files: list[str], format: str) -> dict[str, Any]:
    panorama = format == "exr" and frame.panorama is not None
    return {
        "name": shell.name,
        "proxy": move_proxy(shell.proxy, frame.space_matrix),
        "projection": "latlong" if panorama else "cube",
        "size": shell.size,
        "levels": 1 if panorama else shell.levels,
        "channels": shell.channels,
        "off_hull": shell.off_hull,
        "files": files,
    }


def _cube_levels(shell: ShellMap) -> list[FloatArray]:
    """All levels (6, s, s, C) as cube maps; others give a cube with as many texels a side of a face."""
    if shell.projection == "cube":
        return [shell.level(i) for i in range(shell.levels)]
    size = shell.size
    kept = MAP_PROJECTIONS[shell.projection].projection
    layout = _core.EnvMapLayout(kept, size, size, shell.levels, shell.channels)
    channels = ["R", "G", "B", "A"][: shell.channels]
    maps = EnvMap(layout, np.ascontiguousarray(shell.pyramid).reshape(-1), channels)
    return [cube_from_levels(maps, size >> i) for i in range(shell.levels)]


def _write_shell(
    shell: ShellMap, folder: Path, stem: str, frame: Frame, format: str, precision: str
) -> tuple[list[str], int]:
    """Write one map. Returns the names of its files and how many values were clamped."""
    channels = ["R", "G", "B", "A"][: shell.channels]

    def save(envmap: EnvMap, name: str, faces: FaceLayout = "automatic") -> int:
        return envmap.save(folder / name, faces=faces, format=cast("PixelFormat", precision)).clamped_to_half

    if format == "exr" and frame.panorama is not None:
        finest = EnvMap.from_array(shell.level(0), MAP_PROJECTIONS[shell.projection].projection, channels)
        panorama = finest.resample("latlong", 2 * shell.size, source_from_target=source_from_panorama(frame))
        return [f"{stem}.exr"], save(panorama, f"{stem}.exr")
    levels = [turn_cube(level, frame.lookup_matrix) for level in _cube_levels(shell)]
    if format == "exr":
        names = [f"{stem}.level{i}.exr" for i in range(shell.levels)]
        clamped = [
            save(EnvMap.from_array(level, "cube", channels), name, "strip")
            for level, name in zip(levels, names, strict=True)
        ]
        return names, sum(clamped)
    values = np.concatenate([level.reshape(-1) for level in levels])
    layout = _core.EnvMapLayout("cube", shell.size, shell.size, shell.levels, shell.channels)
    return [f"{stem}.ktx2"], save(EnvMap(layout, values, channels), f"{stem}.ktx2")

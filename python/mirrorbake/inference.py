"""Environment maps, inferred from views of a reflector whose layers are in files, as ``mb-infer`` does."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.envmap import EnvMap
from mirrorbake.projection import MAP_PROJECTIONS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from os import PathLike

COLOURS = {3: ["R", "G", "B"], 4: ["R", "G", "B", "A"]}


@dataclass(frozen=True)
class Inference:
    """What was inferred, and how well.

    Attributes
    ----------
    maps
        By the name of the shell, or `NAME.partN` of maps per part: all levels, premultiplied with alpha but
        for the last shell.
    residual
        Weighted root mean square of what the maps show less what was traced.
    iterations
        Of conjugate gradients, in the last pass.
    converged
        Whether the gradient met the tolerance.
    pixels
        To which the maps were fitted.
    rejected
        Pixels left out, since their light is not finite.
    """

    maps: dict[str, EnvMap]
    residual: float
    iterations: int
    converged: bool
    pixels: int
    rejected: int


def infer_maps(
    layers: Sequence[str | PathLike[str]],
    shells: Mapping[str, _core.Proxy] | None = None,
    *,
    size: int = 128,
    projection: str = "cube",
    run_time: str = "Web",
    maps_per_part: bool = False,
    reflector: str = "",
    options: _core.DisplayFitOptions | None = None,
) -> Inference:
    """Infer the maps of a reflector's shells from one or more views ([PEM] §4 "EM Inference").

    Parameters
    ----------
    layers
        EXR files of ``mb-trace layers --lookups``, or of another renderer with the same channels.
    shells
        Where the map of each shell lies, front to back; default all at infinity. A shell that is left out is
        held by the next one behind it.
    size
        Texels along a side of a face, a power of two.
    projection
        ``cube`` or ``dual_paraboloid``.
    run_time
        What will draw the maps: ``Web``, ``Web1`` or ``Reference``; the files have its lookups.
    maps_per_part
        Every part of the reflector gets maps of its own.
    reflector
        Name that its channels start with, where a view has several.
    options
        Of the fit.

    Returns
    -------
    Inference
        The maps and how the solver ended.

    Raises
    ------
    FileError
        If a file cannot be read, or lacks channels or lookups.
    InvalidArgument
        For options that do not fit to the files.
    """
    kept = {entry.projection: entry for entry in MAP_PROJECTIONS.values()}
    if projection not in kept:
        raise _core.InvalidArgument(f"projection is {projection!r}, expected {' or '.join(kept)}")
    topology = _core.TexelTopology.of(kept[projection], size)
    found = _core.infer_from_layers(
        list(layers),
        shells=list((shells or {}).items()),
        map=topology,
        run_time=_core.run_time_model(run_time),
        maps_per_part=maps_per_part,
        reflector=reflector,
        options=options or _core.DisplayFitOptions(),
    )
    maps = {}
    for name, texels in found.maps.items():
        channels = texels.shape[1]
        layout = _core.EnvMapLayout(projection, size, size, topology.levels, channels)
        maps[name] = EnvMap(layout, np.ascontiguousarray(texels).reshape(-1), COLOURS[channels])
    report = found.report
    return Inference(
        maps,
        float(report.rms_error),
        report.iterations,
        report.converged,
        found.pixels,
        found.rejected,
    )

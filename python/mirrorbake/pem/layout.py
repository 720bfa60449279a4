"""The arrays of a PEM: their shapes, chunks and codecs, and how values are put into them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import zarr
from zarr.codecs import BloscCodec, BloscShuffle, Crc32cCodec

from mirrorbake.pem.pyramid import LARGEST_HALF, join_pyramid, residual_texels, split_pyramid

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from zarr.abc.store import Store

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.header import Header
    from mirrorbake.pem.view_images import ViewImages

ATTRIBUTE = "mirrorbake"
"""Of the group, with all that is no array."""


@dataclass(frozen=True)
class Timings:
    """Seconds of wall-clock time that a sample took."""

    trace_s: float
    build_s: float
    solve_s: float


@dataclass(frozen=True)
class SolverReport:
    """How the solving of one map ended."""

    iterations: int
    gradient: float
    """Its norm over that at the start."""
    converged: bool


@dataclass(frozen=True)
class Layout:
    """Shape, chunk and type of one array, as a header implies them."""

    shape: tuple[int, ...]
    chunk: tuple[int, ...]
    """What is compressed and checked as one."""
    shard: tuple[int, ...] | None
    """What is one object; None: every chunk is."""
    dtype: str
    dimensions: tuple[str, ...]


@dataclass(frozen=True)
class Contents:
    """What all samples of a PEM share."""

    header: Header
    capture: FloatArray
    """The captured map's finest level, shape (F, S, S, 3), F faces."""
    irradiance: FloatArray | None
    """Diffuse layer, shape (1, R, C), or (N, R, C) that each sample fills; None: there is none.

    R is a row for each vertex, or for each texel of a lightmap. C is 3, the fronts alone, or 6, fronts and
    backs.
    """
    local_triangles: NDArray[np.uint8] | None
    """Shape (T,), 0 for triangles of the reflector that shells for `off hull` leave out; None: for none."""
    static_maps: tuple[FloatArray, ...] | None = None
    """The static set: of each map its pyramid (T, 4), premultiplied radiance and α; None: there is none."""
    lit_sides: int = 1
    """1 if diffuse light falls on the fronts of triangles alone, 2 if on their backs, too."""


def sample_layouts(header: Header) -> dict[str, Layout]:
    """Return the arrays that have an object per sample."""
    samples, maps = len(header.space), header.maps
    width, height = header.image_size
    texels = header.topology.texels
    channels = max(entry.channels for entry in maps)
    columns = len(header.record_columns)
    return {
        "maps": Layout(
            (samples, len(maps), texels, channels),
            (1, 1, texels, channels),
            (1, len(maps), texels, channels),
            header.precision,
            ("sample", "map", "texel", "channel"),
        ),
        "reference": Layout(
            (samples, height, width, 7),
            (1, height, width, 7),
            (1, height, width, 7),
            header.precision,
            ("sample", "row", "column", "channel"),
        ),
        "record": Layout((samples, columns), (1, columns), (1, columns), "float64", ("sample", "column")),
    }


MOST_OF_A_MESH = 1 << 28
"""Vertices or triangles that a reflector may have, and texels of a lightmap."""


def shared_layout(name: str, shape: tuple[int, ...], header: Header) -> Layout:
    """Return the layout of an array that all samples share.

    Parameters
    ----------
    name
        Of the array.
    shape
        That is stored: it says how many vertices or triangles of the reflector there are rows for, and
        whether irradiance has backs.
    header
        Of the PEM.
    """
    size, texels, counted = header.map_size, header.topology.texels, counted_in(name, shape)
    if name == "static/capture":
        faces = (header.faces, size, size, 3)
        return Layout(faces, faces, None, "float32", ("face", "row", "column", "channel"))
    if name == "static/maps":
        maps = (len(header.maps), texels, 4)
        return Layout(maps, (1, texels, 4), None, header.precision, ("map", "texel", "channel"))
    if name == "local_triangles":
        return Layout((counted,), (counted,), None, "uint8", ("triangle",))
    samples = len(header.space) if header.space.changes_scene else 1
    channels = 6 if shape[-1:] == (6,) else 3
    whole, chunk = (samples, counted, channels), (1, counted, channels)
    return Layout(whole, chunk, None, "float32", ("sample", _row_name(header), "channel"))


def counted_in(name: str, shape: tuple[int, ...]) -> int:
    """Return how many vertices or triangles an array of this shape is for; 0 if none can be."""
    place = {"local_triangles": 0, "diffuse/irradiance": 1}.get(name)
    count = shape[place] if place is not None and place < len(shape) else 0
    return count if 0 < count <= MOST_OF_A_MESH else 0


def _row_name(header: Header) -> str:
    return "texel" if header.lightmap else "vertex"


def codecs_of(dtype: str) -> tuple[BloscCodec, Crc32cCodec]:
    size = np.dtype(dtype).itemsize
    return BloscCodec(cname="zstd", clevel=3, shuffle=BloscShuffle.shuffle, typesize=size), Crc32cCodec()


def fill_group(store: Store, contents: Contents) -> None:
    """Make the arrays and write what all samples share, the attributes last."""
    header, capture, irradiance = contents.header, contents.capture, contents.irradiance
    local_triangles = contents.local_triangles
    group = zarr.open_group(store, mode="a", zarr_format=3)
    for name, layout in sample_layouts(header).items():
        group.create_array(
            name,
            shape=layout.shape,
            chunks=layout.chunk,
            shards=layout.shard,
            dtype=layout.dtype,
            fill_value=0,
            compressors=codecs_of(layout.dtype),
            dimension_names=layout.dimensions,
            config={"write_empty_chunks": True},
            overwrite=True,
        )
    dimensions = ("face", "row", "column", "channel")
    _make(group, "static/capture", capture, dimensions, capture.shape)[...] = capture
    if irradiance is not None:
        shape = (1, *irradiance.shape[1:])
        dimensions_of = ("sample", _row_name(header), "channel")
        array = _make(group, "diffuse/irradiance", irradiance, dimensions_of, shape)
        # Where the scene changes, every sample writes its own.
        if not header.space.changes_scene:
            array[...] = irradiance
    if contents.static_maps is not None:
        stored = np.zeros((len(header.maps), header.topology.texels, 4), header.precision)
        for number, pyramid in enumerate(contents.static_maps):
            values, _ = stored_map(pyramid, header.maps[number].size, header)
            stored[number, : len(values)] = values
        chunk = (1, *stored.shape[1:])
        _make(group, "static/maps", stored, ("map", "texel", "channel"), chunk)[...] = stored
    if local_triangles is not None:
        shape = local_triangles.shape
        _make(group, "local_triangles", local_triangles, ("triangle",), shape)[...] = local_triangles
    group.attrs[ATTRIBUTE] = header.to_attributes()


def _make(
    group: zarr.Group, name: str, data: NDArray[Any], dimensions: tuple[str, ...], chunk: tuple[int, ...]
) -> zarr.Array[Any]:
    """Make an array for data, empty."""
    return group.create_array(
        name,
        shape=data.shape,
        chunks=chunk,
        dtype=data.dtype.name,
        fill_value=0,
        compressors=codecs_of(data.dtype.name),
        dimension_names=dimensions,
        config={"write_empty_chunks": True},
        overwrite=True,
    )


def stored_map(pyramid: FloatArray, size: int, header: Header) -> tuple[NDArray[Any], int]:
    """Return a pyramid of a size as `maps` begins with it, (T, C), and how many values were clamped."""
    finest, residuals, clamped = split_pyramid(pyramid, size, header.precision, header.faces)
    return np.concatenate([finest.reshape(-1, finest.shape[-1]), residuals]), clamped


def read_back(stored: NDArray[Any], size: int, header: Header) -> FloatArray:
    """Inverse of `stored_map`, up to the rounding of the storage; what is stored may be longer."""
    count = header.faces * size**2
    shape = (header.faces, size, size, stored.shape[-1])
    end = count + residual_texels(size, header.faces)
    return join_pyramid(stored[:count].reshape(shape), stored[count:end])


def stored_images(images: ViewImages, precision: str) -> tuple[NDArray[Any], int]:
    """Return images as `reference` holds them, (H, W, 7), and how many values were clamped."""
    values = np.concatenate([images.object, images.coverage[..., None], images.background], axis=-1)
    if precision == "float32":
        return values.astype(np.float32), 0
    clamped = int(np.count_nonzero(np.abs(values) > LARGEST_HALF))
    return np.clip(values, -LARGEST_HALF, LARGEST_HALF).astype(np.float16), clamped

"""The arrays of a PEM: their shapes, chunks and codecs, and how values are put into them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import zarr
from zarr.codecs import BloscCodec, BloscShuffle, Crc32cCodec

from mirrorbake.pem.pyramid import LARGEST_HALF, residual_texels, split_pyramid

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
    shard: tuple[int, ...]
    """What is one object."""
    dtype: str
    dimensions: tuple[str, ...]


@dataclass(frozen=True)
class Contents:
    """What all samples of a PEM share."""

    header: Header
    capture: FloatArray
    """The static map's finest level, shape (6, S, S, 3)."""
    irradiance: FloatArray | None
    """Diffuse layer, shape (1, V, 3), or (N, V, 3) that each sample fills; None: there is none."""
    local_triangles: NDArray[np.uint8] | None
    """Shape (T,), 0 for triangles of the reflector that shells for `off hull` leave out; None: for none."""


def sample_layouts(header: Header) -> dict[str, Layout]:
    """Return the arrays that have an object per sample."""
    samples, maps, size = len(header.space), header.maps, header.map_size
    width, height = header.image_size
    texels = 6 * size * size + residual_texels(size)
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
    _put(group, "static/capture", capture, ("face", "row", "column", "channel"), capture.shape)
    if irradiance is not None:
        shape = (1, *irradiance.shape[1:])
        _put(group, "diffuse/irradiance", irradiance, ("sample", "vertex", "channel"), shape)
    if local_triangles is not None:
        _put(group, "local_triangles", local_triangles, ("triangle",), local_triangles.shape)
    group.attrs[ATTRIBUTE] = header.to_attributes()


def _put(
    group: zarr.Group,
    name: str,
    data: FloatArray | NDArray[np.uint8],
    dimensions: tuple[str, ...],
    chunk: tuple[int, ...],
) -> None:
    array = group.create_array(
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
    if data.shape[0] == chunk[0]:
        array[...] = data


def stored_map(pyramid: FloatArray, header: Header) -> tuple[NDArray[Any], int]:
    """Return a pyramid as `maps` holds it, (T, C), and how many values were clamped."""
    finest, residuals, clamped = split_pyramid(pyramid, header.map_size, header.precision)
    return np.concatenate([finest.reshape(-1, finest.shape[-1]), residuals]), clamped


def stored_images(images: ViewImages, precision: str) -> tuple[NDArray[Any], int]:
    """Return images as `reference` holds them, (H, W, 7), and how many values were clamped."""
    values = np.concatenate([images.object, images.coverage[..., None], images.background], axis=-1)
    if precision == "float32":
        return values.astype(np.float32), 0
    clamped = int(np.count_nonzero(np.abs(values) > LARGEST_HALF))
    return np.clip(values, -LARGEST_HALF, LARGEST_HALF).astype(np.float16), clamped

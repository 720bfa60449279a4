"""A parameterized environment map on disk: a Zarr v3 group, one chunk per view, readable by anyone.

`DIR/pem.zarr` holds, for N views and maps of S² texels a face:

=========================== ================= ======================================================
array                       shape             holds
=========================== ================= ======================================================
`maps/PART/LAYER/finest`    (N, 6, S, S, C)   finest level; faces +X −X +Y −Y +Z −Z as in OpenGL
`maps/PART/LAYER/residuals` (N, R, C)         coarser levels in turn, minus the decimated finest level
`reference/object`          (N, H, W, 3)      ray-traced object: mean over the samples that see it
`reference/coverage`        (N, H, W)         fraction of a pixel's samples that see the object
`reference/background`      (N, H, W, 3)      what the other samples see, times their fraction
`static/capture`            (6, S, S, 3)      traced from the object's centre, the object removed
`diffuse/irradiance`        (V, 3)            W m⁻² at the object's vertices, if it has a diffuse layer
`local_triangles`           (T,)              0: on the convex hull, no local layer; if that is split off
`timings`                   (N, 3)            seconds spent tracing, building matrices, solving
`complete`                  (N,)              1: every chunk of this view is there. Written last
=========================== ================= ======================================================

LAYER is `local` (RGBA, premultiplied by α) or `distant` (RGB). Row 0 is the top. A coarser level l, of
(S >> l)² texels a face, is its residual plus the mean over each 2×2 block, repeated l times, of `finest`
([PEM] §4). The group's attribute `mirrorbake` holds the format's version, the scene, its input files with
their hashes, what was decided before the bake and why, the parameter of every view, and each part's proxy
geometry and origins.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import zarr
import zarr.errors
from zarr.codecs import BloscCodec, BloscShuffle

from mirrorbake.errors import StoreError
from mirrorbake.pem.header import FORMAT_VERSION, Header
from mirrorbake.pem.pyramid import LARGEST_HALF, join_pyramid, residual_texels, split_pyramid
from mirrorbake.pem.view_images import ViewImages

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

GROUP_NAME = "pem.zarr"
ATTRIBUTE = "mirrorbake"

LAYER_CHANNELS: Mapping[str, int] = {"local": 4, "distant": 3}
"""Channels of a map: RGBA of the local layer, RGB of the distant one."""


@dataclass(frozen=True)
class Timings:
    """Seconds of wall-clock time that a view took."""

    trace_s: float
    build_s: float
    solve_s: float


class PemStore:
    """A PEM on disk; see the module's description for the arrays.

    A view counts only when its mark in `complete`, which is written after everything else, is set: a bake
    that is killed loses the view in flight and nothing more.
    """

    def __init__(self, directory: Path, group: zarr.Group, header: Header) -> None:
        self.directory = directory
        self.header = header
        self._group = group

    @staticmethod
    def create(
        directory: Path,
        header: Header,
        capture: FloatArray,
        irradiance: FloatArray | None,
        local_triangles: NDArray[np.uint8] | None = None,
    ) -> PemStore:
        """Make a PEM without views in an existing folder.

        Parameters
        ----------
        directory
            Holds no PEM yet. The group appears in it by a rename, once all its arrays exist.
        header
            Goes to the attributes.
        capture
            The static map's finest level, shape (6, S, S, 3).
        irradiance
            Diffuse layer, shape (V, 3), or None.
        local_triangles
            Shape (T,), 0 for triangles of the reflector that the local layers leave out, or None.

        Raises
        ------
        StoreError
            The folder cannot be written to.
        """
        partial = directory / f".{GROUP_NAME}.partial"
        try:
            shutil.rmtree(partial, ignore_errors=True)
            group = zarr.open_group(partial, mode="w-", zarr_format=3)
            group.attrs[ATTRIBUTE] = header.to_attributes()
            _create_arrays(group, header)
            _put(group, "static/capture", capture, ("face", "row", "column", "channel"))
            if irradiance is not None:
                _put(group, "diffuse/irradiance", irradiance, ("vertex", "channel"))
            if local_triangles is not None:
                _put(group, "local_triangles", local_triangles, ("triangle",))
            partial.rename(directory / GROUP_NAME)
        except OSError as failure:
            raise StoreError(f"{directory}: cannot write: {failure.strerror or failure}") from None
        return PemStore.open(directory, writable=True)

    @staticmethod
    def exists(directory: Path) -> bool:
        """Whether a folder holds a PEM, complete or not."""
        return (directory / GROUP_NAME).is_dir()

    @staticmethod
    def open(directory: Path, *, writable: bool = False) -> PemStore:
        """Open a PEM.

        Raises
        ------
        StoreError
            There is none, or it is damaged, or of a version that this library does not know.
        """
        path = directory / GROUP_NAME
        if not path.is_dir():
            raise StoreError(
                f"{directory}: holds no PEM (expected the folder {GROUP_NAME} that `bake` makes)"
            )
        try:
            group = zarr.open_group(path, mode="r+" if writable else "r", zarr_format=3)
            attributes = cast("Mapping[str, Any]", group.attrs[ATTRIBUTE])
            version = attributes["format_version"]
            if version != FORMAT_VERSION:
                raise StoreError(f"{path}: format version {version}, this library reads {FORMAT_VERSION}")
            header = Header.from_attributes(attributes)
            if header.fingerprint != attributes["fingerprint"]:
                raise StoreError(f"{path}: damaged: what it was made from does not match its fingerprint")
        except (OSError, KeyError, TypeError, ValueError, zarr.errors.BaseZarrError) as failure:
            if isinstance(failure, StoreError):
                raise
            raise StoreError(f"{path}: damaged, or not a PEM: {failure}") from None
        return PemStore(directory, group, header)

    def _array(self, name: str) -> zarr.Array[Any]:
        try:
            array = self._group[name]
        except KeyError:
            raise StoreError(f"{self.directory / GROUP_NAME}: damaged: the array {name} is missing") from None
        if not isinstance(array, zarr.Array):
            raise StoreError(f"{self.directory / GROUP_NAME}: damaged: {name} is not an array")
        return array

    def _read(self, name: str, index: Any = ...) -> NDArray[Any]:
        # zarr reports a chunk that does not decode as whatever its codec raised: RuntimeError, ValueError,
        # OSError.
        array = self._array(name)
        try:
            return np.asarray(array[index])
        except (OSError, ValueError, RuntimeError) as failure:
            raise StoreError(
                f"{self.directory / GROUP_NAME}: damaged: {name} cannot be read: {failure}"
            ) from None

    def completed(self) -> NDArray[np.bool_]:
        """Which views are there, shape (N,)."""
        return self._read("complete").astype(bool)

    def require_complete(self) -> None:
        """Raise StoreError unless every view is there."""
        completed = self.completed()
        if not completed.all():
            raise StoreError(
                f"{self.directory}: only {int(completed.sum())} of {completed.size} views are baked; "
                "run `mirrorbake bake` again with the same scene to finish it"
            )

    def write_view(
        self,
        index: int,
        maps: Mapping[tuple[str, str], FloatArray],
        images: ViewImages,
        timings: Timings,
    ) -> int:
        """Write one view, its mark last.

        Parameters
        ----------
        index
            Of the view.
        maps
            One pyramid (texels, C) for each of the header's `map_names`.
        images
            The ray-traced reference.
        timings
            What the view took.

        Returns
        -------
        int
            How many values of the maps were clamped because float16 cannot hold them.

        Raises
        ------
        StoreError
            The disk cannot be written to.
        """
        clamped = 0
        try:
            self._array("complete")[index] = 0
            for part, layer in self.header.map_names():
                finest, residuals, count = split_pyramid(
                    maps[part, layer], self.header.map_size, self.header.precision
                )
                clamped += count
                self._array(f"maps/{part}/{layer}/finest")[index] = finest
                self._array(f"maps/{part}/{layer}/residuals")[index] = residuals
            for name, image in (
                ("object", images.object),
                ("coverage", images.coverage),
                ("background", images.background),
            ):
                half = np.clip(image, -LARGEST_HALF, LARGEST_HALF).astype(np.float16)
                self._array(f"reference/{name}")[index] = half
            self._array("timings")[index] = np.array([timings.trace_s, timings.build_s, timings.solve_s])
            self._array("complete")[index] = 1
        except OSError as failure:
            raise StoreError(f"{self.directory}: cannot write: {failure.strerror or failure}") from None
        return clamped

    def read_map(self, part: str, layer: str, index: int) -> FloatArray:
        """Pyramid of one map of one view, shape (texels, C), float32."""
        name = f"maps/{part}/{layer}"
        return join_pyramid(self._read(f"{name}/finest", index), self._read(f"{name}/residuals", index))

    def read_images(self, index: int) -> ViewImages:
        """Ray-traced images of one view."""
        return ViewImages(
            *(
                self._read(f"reference/{name}", index).astype(np.float32)
                for name in ("object", "coverage", "background")
            )
        )

    def read_timings(self, index: int) -> Timings:
        """What one view took."""
        return Timings(*(float(value) for value in self._read("timings", index)))

    def read_capture(self) -> FloatArray:
        """Finest level of the static map, shape (6, S, S, 3)."""
        return self._read("static/capture").astype(np.float32)

    def read_irradiance(self) -> FloatArray | None:
        """Irradiance at the object's vertices, shape (V, 3), or None if it has no diffuse layer."""
        if "diffuse/irradiance" not in self._group:
            return None
        return self._read("diffuse/irradiance").astype(np.float32)

    def read_local_triangles(self) -> NDArray[np.uint8] | None:
        """Shape (T,): 0 for triangles that the local layers leave out; None if they cover all."""
        if "local_triangles" not in self._group:
            return None
        return self._read("local_triangles").astype(np.uint8)

    def remove_stray_files(self) -> None:
        """Remove what a killed write left behind."""
        for stray in (self.directory / GROUP_NAME).rglob("*.partial"):
            stray.unlink(missing_ok=True)


@contextlib.contextmanager
def exclusive(directory: Path) -> Iterator[None]:
    """Hold a folder's lock, which ends with the process however it dies.

    Raises
    ------
    StoreError
        Another process holds it.
    """
    handle = os.open(directory, os.O_RDONLY)
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise StoreError(f"{directory}: another bake is writing to it") from None
        yield
    finally:
        os.close(handle)


def _compressor(dtype: str) -> BloscCodec:
    return BloscCodec(cname="zstd", clevel=3, shuffle=BloscShuffle.shuffle, typesize=np.dtype(dtype).itemsize)


def _create_arrays(group: zarr.Group, header: Header) -> None:
    views, size = len(header.space), header.map_size
    width, height = header.image_size

    def create(name: str, shape: tuple[int, ...], dtype: str, dimensions: tuple[str, ...]) -> None:
        group.create_array(
            name,
            shape=(views, *shape),
            chunks=(1, *shape),
            dtype=dtype,
            fill_value=0,
            compressors=_compressor(dtype),
            dimension_names=("view", *dimensions),
        )

    for part, layer in header.map_names():
        channels = LAYER_CHANNELS[layer]
        name = f"maps/{part}/{layer}"
        create(
            f"{name}/finest",
            (6, size, size, channels),
            header.precision,
            ("face", "row", "column", "channel"),
        )
        create(f"{name}/residuals", (residual_texels(size), channels), header.precision, ("texel", "channel"))
    create("reference/object", (height, width, 3), "float16", ("row", "column", "channel"))
    create("reference/coverage", (height, width), "float16", ("row", "column"))
    create("reference/background", (height, width, 3), "float16", ("row", "column", "channel"))
    create("timings", (3,), "float64", ("stage",))
    create("complete", (), "uint8", ())


def _put(
    group: zarr.Group, name: str, data: FloatArray | NDArray[np.uint8], dimensions: tuple[str, ...]
) -> None:
    array = group.create_array(
        name,
        shape=data.shape,
        chunks=data.shape,
        dtype=data.dtype.name,
        fill_value=0,
        compressors=_compressor(data.dtype.name),
        dimension_names=dimensions,
    )
    array[...] = data

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
import hashlib
import json
import os
import shutil
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, cast

import numpy as np
import zarr
import zarr.errors
from zarr.codecs import BloscCodec, BloscShuffle

from mirrorbake.errors import StoreError
from mirrorbake.plan import Plan

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from mirrorbake.metrics import FloatArray

FORMAT_VERSION = 2
GROUP_NAME = "pem.zarr"
ATTRIBUTE = "mirrorbake"
LARGEST_HALF = 65504.0

LAYER_CHANNELS: Mapping[str, int] = {"local": 4, "distant": 3}
"""Channels of a map: RGBA of the local layer, RGB of the distant one."""


def decimate(level: FloatArray) -> FloatArray:
    """Next coarser level: the mean of every 2×2 block of each face.

    Parameters
    ----------
    level
        Shape (6, S, S, C), S even, float32.

    Returns
    -------
    array
        Shape (6, S/2, S/2, C), float32.
    """
    top = level[:, 0::2, 0::2] + level[:, 0::2, 1::2]
    bottom = level[:, 1::2, 0::2] + level[:, 1::2, 1::2]
    return (top + bottom) * np.float32(0.25)


def residual_texels(size: int) -> int:
    """Number of texels of all levels but the finest, for a power of two."""
    return sum(6 * s * s for s in coarser_sizes(size))


def coarser_sizes(size: int) -> list[int]:
    """Sides of the levels below one of `size` texels, down to 1."""
    return [size >> level for level in range(1, size.bit_length())]


def split_pyramid(pyramid: FloatArray, size: int, dtype: str) -> tuple[NDArray[Any], NDArray[Any], int]:
    """Split a pyramid into what is stored: the finest level and the residuals of the others.

    Parameters
    ----------
    pyramid
        Shape (texels, C): levels one after the other, the finest first.
    size
        Texels along a side of the finest level.
    dtype
        'float16' or 'float32'. Residuals refer to the finest level as it is stored, so they also take up its
        rounding.

    Returns
    -------
    tuple
        The finest level (6, S, S, C), the residuals (R, C), and how many values were clamped to ±65504
        because float16 ends there.
    """
    channels = pyramid.shape[1]
    clamped = 0
    if dtype == "float16":
        clamped = int(np.count_nonzero(np.abs(pyramid) > LARGEST_HALF))
        pyramid = np.clip(pyramid, -LARGEST_HALF, LARGEST_HALF)
    count = 6 * size * size
    finest = pyramid[:count].reshape(6, size, size, channels).astype(dtype)
    residuals = np.empty((residual_texels(size), channels), dtype)
    level = finest.astype(np.float32)
    offset = 0
    for s in coarser_sizes(size):
        level = decimate(level)
        texels = 6 * s * s
        values = pyramid[count + offset : count + offset + texels]
        residuals[offset : offset + texels] = (values - level.reshape(texels, channels)).astype(dtype)
        offset += texels
    return finest, residuals, clamped


def join_pyramid(finest: NDArray[Any], residuals: NDArray[Any]) -> FloatArray:
    """Inverse of `split_pyramid`, up to the rounding of the storage. Returns shape (texels, C), float32."""
    size, channels = finest.shape[1], finest.shape[3]
    level = finest.astype(np.float32)
    pyramid = np.empty((6 * size * size + residuals.shape[0], channels), np.float32)
    offset = 6 * size * size
    pyramid[:offset] = level.reshape(-1, channels)
    for s in coarser_sizes(size):
        level = decimate(level)
        texels = 6 * s * s
        start = offset - 6 * size * size
        pyramid[offset : offset + texels] = (
            level.reshape(texels, channels) + residuals[start : start + texels]
        )
        offset += texels
    return pyramid


Inputs: TypeAlias = dict[str, dict[str, Any]]
"""Files of a scene: key → {path, sha256, files}; `files`, if it refers to any, are {name: sha256}."""


@dataclass(frozen=True)
class Source:
    """What a PEM is made from."""

    library: str
    """Version of mirrorbake that writes it."""
    config: dict[str, Any]
    """The scene file with its defaults filled in and absolute paths."""
    inputs: Inputs
    """Files that the scene uses."""

    @property
    def fingerprint(self) -> str:
        """Changes with everything that decides what a bake computes, but not with where its inputs lie."""
        text = json.dumps([FORMAT_VERSION, self.library, self._content()], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def _content(self) -> dict[str, Any]:
        content: dict[str, Any] = json.loads(json.dumps(self.config))
        for key, source in self.inputs.items():
            section, name = key.split(".")
            content[section][name] = {"sha256": source["sha256"], "files": source.get("files", {})}
        return content

    def difference_from(self, other: Source) -> str:
        """Words for the first thing in which this source differs from another."""
        if self.library != other.library:
            return f"mirrorbake {other.library} instead of {self.library}"
        mine, others = self._content(), other._content()
        for section, table in mine.items():
            present = others[section] or {}
            for key, value in (table or {}).items():
                theirs = present.get(key)
                if theirs != value:
                    name = f"{section}.{key}"
                    if name in self.inputs and name in other.inputs:
                        assert theirs is not None
                        return f"{name}: {_changed_file(value, theirs)}"
                    return f"{name} = {theirs!r} instead of {value!r}"
            if table is None and others[section] is not None:
                return f"a section [{section}] instead of none"
        return "nothing"


def _changed_file(mine: Mapping[str, Any], theirs: Mapping[str, Any]) -> str:
    if mine["sha256"] != theirs["sha256"]:
        return "a file of other content"
    a, b = mine["files"], theirs["files"]
    name = min(name for name in {**a, **b} if a.get(name) != b.get(name))
    if name not in a:
        return f"its file {name} is missing"
    return f"its file {name} " + ("has another content" if name in b else "was not there")


@dataclass(frozen=True)
class Header:
    """What the attributes of a PEM say."""

    source: Source
    plan: Plan
    """What was decided before the bake; a resumed one keeps to it."""
    parameters: list[float]
    """t of every view, in [0,1]."""
    parts: list[dict[str, Any]]
    """Per part of the reflector, in order: name, and layers as {layer name: proxy}."""
    static: dict[str, Any]
    """Proxies of the static maps: `infinite`, and `proxy`: the distant layer's, None if that is infinite."""
    map_size: int
    precision: Literal["float16", "float32"]
    image_size: tuple[int, int]
    """Pixels: width, height."""

    @property
    def fingerprint(self) -> str:
        """Changes with everything that decides what a bake computes: its source and its plan."""
        text = json.dumps([self.source.fingerprint, self.plan.to_json()], sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()

    def to_attributes(self) -> dict[str, Any]:
        """Return the JSON-like value of the group's attribute."""
        return {
            "format": "pem",
            "format_version": FORMAT_VERSION,
            "library": self.source.library,
            "fingerprint": self.fingerprint,
            "conventions": {
                "world": "right-handed, +Y up, metres",
                "radiance": "scene-linear, Rec.709 primaries",
                "faces": "+X -X +Y -Y +Z -Z, OpenGL orientation, row 0 on top",
                "residuals": "level l = mean of 2x2 blocks of level l-1, from `finest` down, plus residual",
                "level_sizes": [self.map_size, *coarser_sizes(self.map_size)],
            },
            "map_size": self.map_size,
            "precision": self.precision,
            "image_size": list(self.image_size),
            "parameters": self.parameters,
            "parts": self.parts,
            "static": self.static,
            "config": self.source.config,
            "plan": self.plan.to_json(),
            "inputs": self.source.inputs,
        }

    @staticmethod
    def from_attributes(attributes: Mapping[str, Any]) -> Header:
        """Inverse of `to_attributes`. Raises KeyError or TypeError for what is not one."""
        width, height = attributes["image_size"]
        return Header(
            source=Source(attributes["library"], attributes["config"], attributes["inputs"]),
            plan=Plan.from_json(attributes["plan"]),
            parameters=list(attributes["parameters"]),
            parts=attributes["parts"],
            static=attributes["static"],
            map_size=attributes["map_size"],
            precision=attributes["precision"],
            image_size=(width, height),
        )

    def map_names(self) -> list[tuple[str, str]]:
        """(part, layer) of every map of a view."""
        return [(part["name"], layer) for part in self.parts for layer in part["layers"]]


@dataclass(frozen=True)
class ViewImages:
    """Ray-traced images of one view, float32."""

    object: FloatArray
    """(H, W, 3) radiance of the object, mean over the samples that see it; 0 elsewhere."""
    coverage: FloatArray
    """(H, W) fraction of the pixel's samples that see the object."""
    background: FloatArray
    """(H, W, 3) radiance of the others, times their fraction."""

    def composite(self, object_radiance: FloatArray) -> FloatArray:
        """The whole picture with another rendering (H, W, 3) of the object in it."""
        return self.background + self.coverage[..., None] * object_radiance

    @property
    def beauty(self) -> FloatArray:
        """The ray-traced picture (H, W, 3)."""
        return self.composite(self.object)


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
    views, size = len(header.parameters), header.map_size
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

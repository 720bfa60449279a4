"""A parameterized environment map on disk: a Zarr v3 group, readable by anyone.

`DIR/pem.zarr` holds, for N samples and M maps of F faces of S² texels:

===================== =============== ================================================================
array                 shape           holds
===================== =============== ================================================================
`maps`                (N, M, T, C)    every map of a sample: finest level, residuals of the others, then 0
`reference`           (N, H, W, 7)    ray traced: object R G B, its coverage, background R G B
`record`              (N, K)          seconds, clamped values and the solver's report. Written last
`diffuse/irradiance`  (1|N, V, 3|6)   W m⁻² at the object's vertices: on fronts, and on backs if lit. Or
                      (1|N, L², 3|6)  in a lightmap of L² texels, rows from the top (`layers.lightmap`)
`static/capture`      (F, S, S, 3)    traced from the object's centre, the object removed
`static/maps`         (M, T, 4)       the static set: maps for views far from all samples, if there is one
`local_triangles`     (T,)            0: on the convex hull, where no shell for `off hull` is read
===================== =============== ================================================================

A sample is one object of `maps`, of `reference` and of `record` each (Zarr's sharding codec; a map is a chunk
within its sample's object), with checksums (crc32c). A sample counts once its record is there. C is 4 if any
map is RGBA; opaque maps then hold α = 1. A coarser level l, of (S >> l)² texels a face, is its residual plus
the mean over each 2×2 block, repeated l times, of the finest ([PEM] §4). The group's attribute `mirrorbake`
holds the rest; `mirrorbake.pem.schema` says what.
"""

from __future__ import annotations

import contextlib
import shutil
from typing import TYPE_CHECKING, Any

import numpy as np
import zarr

from mirrorbake.errors import StoreError
from mirrorbake.pem.header import MAP_RECORD, RECORD, Header
from mirrorbake.pem.layout import (
    ATTRIBUTE,
    Contents,
    SolverReport,
    Timings,
    counted_in,
    fill_group,
    read_back,
    sample_layouts,
    shared_layout,
    stored_images,
    stored_map,
)
from mirrorbake.pem.location import (
    GROUP_NAME,
    Location,
    delete_key,
    exclusive,
    has_key,
    keys_there,
    rename_unless_there,
    stored_bytes,
)
from mirrorbake.pem.schema import check_attributes
from mirrorbake.pem.view_images import ViewImages

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray

__all__ = ["GROUP_NAME", "Contents", "PemStore", "SolverReport", "Timings", "exclusive"]

_SAMPLE_ARRAYS = ("maps", "reference", "record")


class PemStore:
    """A PEM; see the module's description for the arrays.

    A sample counts only when its record, which is written after everything else, is there: a bake that is
    killed loses the samples in flight and nothing more. Two processes that write the same sample write the
    same bits.
    """

    def __init__(self, location: Location, group: zarr.Group, header: Header) -> None:
        self.location = location
        self.header = header
        self._group = group

    @property
    def directory(self) -> Path:
        """The folder; StoreError for a URL."""
        return self.location.path

    @staticmethod
    def create(place: Location | Path | str, contents: Contents) -> PemStore:
        """Make a PEM without samples, or open one that another process has made meanwhile.

        Parameters
        ----------
        place
            An existing folder, or a URL. In a folder the group appears by a rename, once all its arrays
            exist; at a URL its attributes are written last.
        contents
            What all samples share; of a diffuse layer that is not the same for all, its shape.

        Raises
        ------
        StoreError
            It cannot be written to.
        """
        location = Location.of(place)
        try:
            if location.is_remote:
                fill_group(location.store(writable=True), contents)
            else:
                name = location.partial_name
                partial = location.path / name
                try:
                    store = location.store(writable=True, name=name)
                    fill_group(store, contents)
                    with contextlib.suppress(FileExistsError, NotADirectoryError):
                        rename_unless_there(partial, location.path / GROUP_NAME)
                finally:
                    shutil.rmtree(partial, ignore_errors=True)
        except OSError as failure:
            raise StoreError(f"{location}: cannot write: {failure.strerror or failure}") from None
        return PemStore.open(location, writable=True)

    @staticmethod
    def exists(place: Location | Path | str) -> bool:
        """Whether a place holds a PEM, complete or not."""
        return Location.of(place).exists()

    @staticmethod
    def open(place: Location | Path | str, *, writable: bool = False) -> PemStore:
        """Open a PEM.

        Raises
        ------
        StoreError
            There is none, or it is damaged, or of a version that this library does not know.
        """
        location = Location.of(place)
        if not location.exists():
            raise StoreError(f"{location}: holds no PEM (expected the folder {GROUP_NAME} that `bake` makes)")
        where = f"{location}/{GROUP_NAME}"
        try:
            group = zarr.open_group(
                location.store(writable=writable), mode="r+" if writable else "r", zarr_format=3
            )
            attributes = dict(group.attrs).get(ATTRIBUTE)
        except StoreError:
            raise
        # Metadata that is damaged makes zarr raise whatever its parsers raise.
        except Exception as failure:
            raise StoreError(f"{where}: damaged, or not a PEM: {failure}") from None
        checked = check_attributes(attributes, where)
        try:
            header = Header.from_attributes(checked)
        except (KeyError, TypeError, ValueError) as failure:
            raise StoreError(f"{where}: damaged: the plan lacks {failure}") from None
        if header.fingerprint != checked["fingerprint"]:
            raise StoreError(f"{where}: damaged: what it was made from does not match its fingerprint")
        return PemStore(location, group, header)

    def _array(self, name: str) -> zarr.Array[Any]:
        where = f"{self.location}/{GROUP_NAME}"
        try:
            array = self._group[name]
        except KeyError:
            raise StoreError(f"{where}: damaged: the array {name} is missing") from None
        except Exception as failure:
            raise StoreError(f"{where}: damaged: {name}: {failure}") from None
        if not isinstance(array, zarr.Array):
            raise StoreError(f"{where}: damaged: {name} is not an array")
        layout = sample_layouts(self.header).get(name) or shared_layout(name, array.shape, self.header)
        found = (array.shape, array.chunks, array.shards, str(array.dtype))
        expected = (layout.shape, layout.chunk, layout.shard, layout.dtype)
        if found != expected:
            raise StoreError(f"{where}: damaged: {name} has the layout {found}, expected {expected}")
        # Black is written like any other colour: a chunk that is not there is damage.
        return array.with_config({"write_empty_chunks": True})

    def _has(self, name: str) -> bool:
        """Whether there is an array that not every PEM has, or should be by what the header says."""
        header = self.header
        expected = {
            "static/maps": header.static["fade"] is not None,
            "local_triangles": any(s.polygons == "off hull" for part in header.parts for s in part.shells),
            "diffuse/irradiance": bool(header.plan.value("layers.diffuse")),
        }
        return expected.get(name, False) or has_key(self._group.store, f"{name}/zarr.json")

    def _read(self, name: str, index: Any = ...) -> NDArray[Any]:
        # zarr reports a chunk that does not decode as whatever its codec raised.
        array = self._array(name)
        where = f"{self.location}/{GROUP_NAME}"
        sample = index[0] if isinstance(index, tuple) else index
        at = name if sample is ... else f"sample {sample} of {name}"
        objects = range(array.shape[0] // array.chunks[0]) if sample is ... else (sample,)
        try:
            if not all(has_key(self._group.store, _key(array, name, i)) for i in objects):
                raise StoreError(f"{where}: damaged: {at} is missing")
            return np.asarray(array[index])
        except (StoreError, MemoryError):
            raise
        except Exception as failure:
            raise StoreError(f"{where}: damaged: {at} cannot be read: {failure}") from None

    def completed(self) -> NDArray[np.bool_]:
        """Which samples are there, shape (N,)."""
        names = [f"record/c/{index}/0" for index in range(len(self.header.space))]
        return np.array(keys_there(self._group.store, "record/c/", names), bool)

    def require_complete(self) -> None:
        """Raise StoreError unless every sample is there."""
        completed = self.completed()
        if not completed.all():
            raise StoreError(
                f"{self.location}: only {int(completed.sum())} of {completed.size} samples are baked; "
                "run `mirrorbake bake` again with the same scene to finish it"
            )

    def write_view(
        self,
        index: int,
        maps: Mapping[tuple[str, str], FloatArray],
        images: ViewImages,
        timings: Timings,
        reports: Mapping[tuple[str, str], SolverReport] | None = None,
    ) -> int:
        """Write one sample, its record last.

        Parameters
        ----------
        index
            Of the sample.
        maps
            One pyramid (texels, C) for each of the header's `map_names`; of those that share a map, any.
        images
            The ray-traced reference.
        timings
            What the sample took.
        reports
            How the solving of each map ended, if it was solved.

        Returns
        -------
        int
            How many values were clamped because float16 cannot hold them.

        Raises
        ------
        StoreError
            It cannot be written to.
        """
        header = self.header
        layouts = sample_layouts(header)
        texels = np.ones(layouts["maps"].shape[1:], header.precision)
        record = np.zeros(len(header.record_columns))
        clamped = 0
        try:
            self.forget(index)
            for name in header.map_names():
                number = header.map_of(*name)
                values, count = stored_map(maps[name], header.maps[number].size, header)
                texels[number, : len(values), : values.shape[1]], texels[number, len(values) :] = values, 0
                clamped += count
                report = (reports or {}).get(name, SolverReport(0, 0.0, True))
                start = len(RECORD) + number * len(MAP_RECORD)
                record[start : start + len(MAP_RECORD)] = (
                    report.iterations,
                    report.gradient,
                    report.converged,
                )
            reference, clamped_reference = stored_images(images, header.precision)
            record[: len(RECORD)] = (
                timings.trace_s,
                timings.build_s,
                timings.solve_s,
                clamped,
                clamped_reference,
            )
            self._array("maps")[index] = texels
            self._array("reference")[index] = reference
            self._array("record")[index] = record
        except OSError as failure:
            raise StoreError(f"{self.location}: cannot write: {failure.strerror or failure}") from None
        return clamped + clamped_reference

    def forget(self, index: int) -> None:
        """Take away the record of a sample, so that it counts as not baked."""
        delete_key(self._group.store, f"record/c/{index}/0")

    def write_irradiance(self, index: int, irradiance: FloatArray) -> None:
        """Write the irradiance (V or L², 3 or 6) of one sample, where it is not the same for all."""
        self._array("diffuse/irradiance")[index] = irradiance

    def read_map(self, part: str, layer: str, index: int) -> FloatArray:
        """Pyramid of the map of a part's shell in one sample, shape (texels, C), float32."""
        number = self.header.map_of(part, layer)
        entry = self.header.maps[number]
        return read_back(self._read("maps", (index, number))[:, : entry.channels], entry.size, self.header)

    def read_images(self, index: int) -> ViewImages:
        """Ray-traced images of one sample."""
        values = self._read("reference", index).astype(np.float32)
        return ViewImages(values[..., :3], values[..., 3], values[..., 4:])

    def read_record(self, index: int) -> dict[str, float]:
        """What was recorded of one sample, by the header's `record_columns`."""
        values = self._read("record", index)
        return dict(zip(self.header.record_columns, (float(value) for value in values), strict=True))

    def read_timings(self, index: int) -> Timings:
        """What one sample took."""
        record = self.read_record(index)
        return Timings(record["trace_s"], record["build_s"], record["solve_s"])

    def contents(self) -> Contents:
        """What all samples share; a diffuse layer of single samples is left out."""
        irradiance = None if self.has_irradiance_per_sample else self.read_irradiance()
        return Contents(
            self.header,
            self.read_capture(),
            None if irradiance is None else irradiance[None],
            self.read_local_triangles(),
            self.read_static_maps(),
            self._array("diffuse/irradiance").shape[2] // 3 if self._has("diffuse/irradiance") else 1,
        )

    def read_capture(self) -> FloatArray:
        """Finest level of the static map, shape (F, S, S, 3)."""
        return self._read("static/capture").astype(np.float32)

    def read_static_maps(self) -> tuple[FloatArray, ...] | None:
        """The static set: pyramids (texels, 4) of all maps; None if there is none."""
        if not self._has("static/maps"):
            return None
        sizes = [entry.size for entry in self.header.maps]
        return tuple(map(read_back, self._read("static/maps"), sizes, [self.header] * len(sizes)))

    def read_irradiance(self, index: int = 0) -> FloatArray | None:
        """Irradiance in one sample, (V, 3) or in a lightmap (L², 3), or (…, 6) with backs; or None."""
        if not self._has("diffuse/irradiance"):
            return None
        return self._read("diffuse/irradiance", index if self.has_irradiance_per_sample else 0).astype(
            np.float32
        )

    @property
    def has_irradiance_per_sample(self) -> bool:
        """Whether the diffuse layer changes from sample to sample."""
        return self.header.space.changes_scene

    def read_local_triangles(self) -> NDArray[np.uint8] | None:
        """Shape (T,): 0 for triangles that shells for `off hull` leave out; None if there are none."""
        if not self._has("local_triangles"):
            return None
        return self._read("local_triangles").astype(np.uint8)

    def sample_bytes(self, index: int) -> int:
        """Bytes that a sample takes."""
        per_sample = self._has("diffuse/irradiance") and self.has_irradiance_per_sample
        names = [*_SAMPLE_ARRAYS, *(["diffuse/irradiance"] if per_sample else [])]
        return sum(stored_bytes(self._group.store, _key(self._array(name), name, index)) for name in names)

    def map_bytes(self, index: int) -> int:
        """Bytes that a sample's maps take."""
        return stored_bytes(self._group.store, _key(self._array("maps"), "maps", index))

    def check_mesh(self, vertices: int, triangles: int) -> None:
        """Raise StoreError unless what is stored of the mesh is for so many vertices and triangles."""
        rows = self.header.lightmap**2 or vertices
        for name, count in (("diffuse/irradiance", rows), ("local_triangles", triangles)):
            stored = counted_in(name, self._array(name).shape) if self._has(name) else count
            if stored != count:
                where = f"{self.location}/{GROUP_NAME}"
                raise StoreError(f"{where}: damaged: {name} has {stored} rows, expected {count}")

    def array_names(self) -> list[str]:
        """Names of the arrays that are not of single samples."""
        names = ["static/capture", "static/maps", "local_triangles"]
        if not self.has_irradiance_per_sample:
            names.append("diffuse/irradiance")
        return [name for name in names if self._has(name)]

    def check_array(self, name: str) -> None:
        """Read a whole array; StoreError where it is damaged."""
        self._read(name, 0 if name == "diffuse/irradiance" else ...)

    def check_sample(self, index: int) -> None:
        """Read all of a sample; StoreError where it is damaged."""
        for name in _SAMPLE_ARRAYS:
            self._read(name, index)
        if self._has("diffuse/irradiance") and self.has_irradiance_per_sample:
            self._read("diffuse/irradiance", index)


def _key(array: zarr.Array[Any], name: str, index: int) -> str:
    return "/".join([name, "c", str(index), *("0" for _ in array.shape[1:])])

"""Environment maps: load, save, resample, filter, sample and compare.

Examples
--------
>>> import numpy as np
>>> panorama = EnvMap.from_array(np.ones((64, 128, 3), np.float32), "latlong")
>>> cube = panorama.resample("cube", 32).mips()
>>> cube.levels, cube.level(5).shape
(6, (6, 1, 1, 3))
>>> cube.sample([0.0, 1.0, 0.0]).round(5).tolist()
[1.0, 1.0, 1.0]
"""

from __future__ import annotations

import tempfile
import warnings
from dataclasses import dataclass
from os import fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.arrays import real_array
from mirrorbake.projection import vectors
from mirrorbake.resample import Resampler, make_resampler, resampled

if TYPE_CHECKING:
    from os import PathLike

    from numpy.typing import ArrayLike, DTypeLike, NDArray

    from mirrorbake.literals import (
        ConventionWay,
        FaceLayout,
        MipFilter,
        PixelFormat,
        ResampleFilter,
        SampleFilter,
    )

__all__ = ["EnvMap", "Resampler"]

_NAMES = {1: ["Y"], 2: ["Y", "A"], 3: ["R", "G", "B"], 4: ["R", "G", "B", "A"]}


@dataclass(frozen=True, eq=False, repr=False)
class EnvMap:
    """An environment map in one block of float32 values: levels, faces, rows, columns, channels.

    Attributes
    ----------
    layout
        Projection, size, levels and channels.
    values
        The block, one-dimensional. `level` gives views of it.
    channels
        Names of the channels.
    """

    layout: _core.EnvMapLayout
    values: NDArray[np.float32]
    channels: list[str]

    def __post_init__(self) -> None:
        """Check that the parts agree."""
        if self.values.size != self.layout.size:
            raise ValueError(f"values has {self.values.size} numbers, expected {self.layout.size}")
        if len(self.channels) != self.layout.channels:
            raise ValueError(f"channels has {len(self.channels)} names, expected {self.layout.channels}")

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        """Give NumPy the finest level, as `level` does."""
        level = self.level()
        if copy is False and dtype is not None and np.dtype(dtype) != level.dtype:
            raise ValueError(f"cannot see float32 values as {np.dtype(dtype)} without a copy")
        return np.array(level, dtype) if copy else np.asarray(level, dtype)

    def __repr__(self) -> str:
        """Tell the projection, size, levels and channels, not the values."""
        size = f"{self.layout.width}x{self.layout.height}"
        faces = f"{self.layout.faces} faces of " if self.layout.faces > 1 else ""
        return f"EnvMap({self.projection}, {faces}{size}, levels={self.levels}, channels={self.channels})"

    def _repr_png_(self) -> bytes:
        """Show the finest level in a notebook: faces side by side, clipped to [0, 1], as sRGB."""
        level = self.level()
        picture = np.concatenate(list(level), axis=1) if self.layout.faces > 1 else level
        shown = picture[..., :3] if picture.shape[-1] >= 3 else picture[..., :1]
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "map.png"
            _core.save_image(path, np.ascontiguousarray(np.clip(np.nan_to_num(shown), 0, 1)))
            return path.read_bytes()

    @classmethod
    def from_array(cls, array: ArrayLike, projection: str, channels: list[str] | None = None) -> EnvMap:
        """See an array as a map, without a copy if it is C-contiguous float32.

        Parameters
        ----------
        array
            Shape (6, n, n, C) for a cube, (2, h, w, C) for a dual paraboloid, (h, w, C) otherwise.
        projection
            Name of the projection.
        channels
            Names; by default Y, YA, RGB, RGBA, or numbers.

        Raises
        ------
        TypeError
            The array is not one of real numbers.
        ValueError
            It has another shape.
        """
        block = np.ascontiguousarray(real_array("array", array, np.float32))
        faces = _core.face_count(projection)
        expected = 4 if faces > 1 else 3
        if block.ndim != expected or (faces > 1 and block.shape[0] != faces):
            shape = f"({faces}, height, width, channels)" if faces > 1 else "(height, width, channels)"
            raise ValueError(f"array has the shape {block.shape}, expected {shape} for {projection}")
        height, width, count = block.shape[-3:]
        layout = _core.EnvMapLayout(projection, width, height, 1, count)
        names = channels or _NAMES.get(count) or [str(i) for i in range(count)]
        return cls(layout, block.reshape(-1), names)

    @classmethod
    def load(
        cls,
        path: str | PathLike[str],
        projection: str | None = None,
        *,
        faces: FaceLayout = "automatic",
        layer: str = "",
        part: str = "",
        repair: bool = False,
    ) -> EnvMap:
        """Read an EXR, HDR, TIFF, PNG, JPEG, KTX2 or DDS.

        Parameters
        ----------
        path
            A ``{}`` in it stands for px, nx, py, ny, pz, nz: one image per face.
        projection
            By default found from the shape of the image.
        faces
            How faces share the image: strip, column, grid, cross, vertical_cross, or automatic.
        layer, part
            Of an EXR file: the channels of one layer, and the part by name or number; by default all
            channels of the first part that has colours.
        repair
            Fill values that are NaN or infinite from their surroundings, instead of warning of them.

        Raises
        ------
        FileError
            If there is no such file, or it is damaged, or its shape fits no projection.
        """
        layout, values, names, bad = _core.load_envmap(fspath(path), projection, faces, layer, part, repair)
        if bad and not repair:
            warnings.warn(
                f"{fspath(path)}: {bad} values are NaN or infinite; repair=True fills them", stacklevel=2
            )
        return cls(layout, values, names)

    def save(
        self, path: str | PathLike[str], *, faces: FaceLayout = "automatic", format: PixelFormat = "automatic"
    ) -> _core.SaveReport:
        """Write the finest level as an image, or all levels as KTX2 or DDS, atomically.

        Parameters
        ----------
        path
            The extension decides the kind of file; ``{}`` in it stands for the name of the face.
        faces
            ``automatic``, ``strip``, ``column``, ``grid``, ``cross``, ``vertical_cross`` or ``files``.
        format
            ``automatic``, ``half``, ``float32``, ``uint8`` or ``uint16``; `mirrorbake.bc6h.save_bc6h` writes
            BC6H.

        Raises
        ------
        FileError
            If the path cannot be written, or that kind of file does not hold the format or the channels.
        InvalidArgument
            For unknown names, and faces that do not fit the projection or the path.
        """
        return _core.save_envmap(fspath(path), self.layout, self.values, self.channels, faces, format)

    @property
    def projection(self) -> str:
        """Name of the projection."""
        return self.layout.projection

    @property
    def levels(self) -> int:
        """Number of levels."""
        return self.layout.levels

    def level(self, index: int = 0) -> NDArray[np.float32]:
        """View of a level: (6, n, n, C), (2, h, w, C) or (h, w, C)."""
        if not 0 <= index < self.levels:
            raise IndexError(f"level is {index}, expected 0 to {self.levels - 1}")
        block = self.values[self.layout.level_offset(index) : self.layout.level_offset(index + 1)]
        shape = (self.layout.level_height(index), self.layout.level_width(index), self.layout.channels)
        return block.reshape((self.layout.faces, *shape) if self.layout.faces > 1 else shape)

    def half(self) -> tuple[NDArray[np.float16], int]:
        """Return the map in half the memory, and how many values were clamped to ±65504.

        What `from_array` takes back, exactly; of a map with several levels all of them, one after the other.

        >>> bright = EnvMap.from_array(np.full((1, 2, 1), 1e6, np.float32), "latlong")
        >>> values, clamped = bright.half()
        >>> EnvMap.from_array(values, "latlong").values.tolist(), clamped
        ([65504.0, 65504.0], 2)
        """
        bits, clamped = _core.half_from_float(self.layout, self.values)
        values = bits.view(np.float16)
        return (values.reshape(self.level().shape) if self.levels == 1 else values), clamped

    def resample(
        self,
        projection: str,
        size: int | tuple[int, int],
        *,
        filter: ResampleFilter = "automatic",
        source_from_target: ArrayLike | None = None,
    ) -> EnvMap:
        """Return the finest level in another projection and size.

        Parameters
        ----------
        projection
            Name of the projection to make.
        size
            Height of a face, or (height, width). A latlong and an equal_area are twice as wide as high.
        filter
            ``area``: exact mean over the area of a texel; ``bilinear``; ``nearest``; ``automatic``: area
            where the map shrinks, interpolation where it grows.
        source_from_target
            Rotation or reflection of directions, 3×3.

        Raises
        ------
        InvalidArgument
            For unknown names, sizes that are not 1 to 65536 or do not fit the projection, and matrices that
            are not orthonormal.
        """
        resampler = make_resampler(self.layout, projection, size, filter, source_from_target, 0)
        return resampled(resampler, self)

    def mips(self, filter: MipFilter = "seamless") -> EnvMap:
        """All levels down to 1×1, by ``box``, ``solid_angle`` or ``seamless``; else InvalidArgument."""
        values = _core.build_mips(self.layout, self.values, filter)
        width, height = self.layout.width, self.layout.height
        levels = _core.full_level_count(width, height)
        layout = _core.EnvMapLayout(self.projection, width, height, levels, self.layout.channels)
        return EnvMap(layout, values, self.channels)

    def seam(self, level: int = 0) -> tuple[float, float]:
        """Largest step between neighbouring texels across edges of faces, and inside of faces."""
        return _core.measure_seam(self.layout, self.values, level)

    def with_border(self, border: int, level: int = 0) -> NDArray[np.float32]:
        """Faces of a level with ``border`` texels of their neighbours around: (faces, height, width, C).

        Raises
        ------
        InvalidArgument
            For a border below 0 or wider than a face.
        """
        return _core.add_border(self.layout, self.values, level, border)

    def sample(
        self,
        directions: ArrayLike,
        ddx: ArrayLike | None = None,
        ddy: ArrayLike | None = None,
        *,
        filter: SampleFilter = "bilinear",
        level: ArrayLike | None = None,
        bias: float = 0.0,
        max_anisotropy: float = 16.0,
    ) -> NDArray[np.float32]:
        """Values (..., C) in directions (..., 3), read across the edges of faces.

        Parameters
        ----------
        directions
            Shape (..., 3), of any length above 0.
        ddx, ddy
            Differentials of the directions over a pixel, of the same shape: ``trilinear`` and ``ewa`` need
            them.
        filter
            ``nearest`` and ``bilinear`` read the finest level; ``trilinear`` the two whose texels are next in
            size to the longer differential; ``ewa`` averages an ellipse.
        level
            Of ``trilinear``, instead of differentials: the level of detail itself, a number or an array that
            broadcasts to the shape (...). Levels that do not exist count as the nearest that does.
        bias
            Added to the level of detail, as a renderer's bias for gloss is: of ``trilinear`` and ``ewa``,
            whose differentials grow by the factor 2^bias; -64 to 64.
        max_anisotropy
            Of ``ewa``: longer ellipses are widened to this ratio, at least 1.

        Raises
        ------
        InvalidArgument
            For NaN, infinite and zero directions, for missing differentials, for options that contradict each
            other, and for other shapes.

        Examples
        --------
        >>> step = np.zeros((6, 2, 2, 1), np.float32)
        >>> step[0] = 1.0  # the face of +x
        >>> cube = EnvMap.from_array(step, "cube").mips("solid_angle")
        >>> cube.sample([1.0, 0.0, 0.0], filter="trilinear", level=1.0).tolist()
        [1.0]
        """
        array = vectors("directions", directions, 3)

        def differentials(name: str, a: ArrayLike | None) -> NDArray[np.float32] | None:
            return None if a is None else np.broadcast_to(vectors(name, a, 3), array.shape).reshape(-1, 3)

        levels = None
        if level is not None:
            given = real_array("level", level, np.float32)
            try:
                given = given if given.ndim == 0 else np.broadcast_to(given, array.shape[:-1])
            except ValueError:
                raise _core.InvalidArgument(
                    f"level has the shape {given.shape}, expected a number, or {array.shape[:-1]}"
                ) from None
            levels = np.ascontiguousarray(given).reshape(-1)
        values = _core.sample(
            self.layout,
            self.values,
            array.reshape(-1, 3),
            differentials("ddx", ddx),
            differentials("ddy", ddy),
            filter,
            levels,
            bias,
            max_anisotropy,
        )
        return values.reshape((*array.shape[:-1], self.layout.channels))

    def to_convention(self, name: str) -> EnvMap:
        """Return the map as openexr, oiio, mitsuba, threejs or ktx2 orient it. One level only."""
        return self._converted(name, "to_foreign")

    def from_convention(self, name: str) -> EnvMap:
        """Return our map of one that openexr, oiio, mitsuba, threejs or ktx2 orient. One level only."""
        return self._converted(name, "from_foreign")

    def _converted(self, name: str, way: ConventionWay) -> EnvMap:
        values = _core.convert_convention(self.layout, self.values, name, way)
        return EnvMap(self.layout, values, self.channels)

    def flux(self, level: int = 0) -> NDArray[np.float64]:
        """∫ L dω per channel, in radiance times steradian."""
        return np.asarray(_core.integrate(self.layout, self.values, level))

    def compare(self, reference: EnvMap) -> _core.Comparison:
        """Errors of the finest level against a reference; InvalidArgument unless its layout is the same."""
        return _core.compare_envmaps(self.layout, self.values, reference.layout, reference.values)

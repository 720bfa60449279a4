"""Compiled part of mirrorbake. Use it through the package `mirrorbake`."""

from collections.abc import Sequence
from typing import Annotated

import numpy
from numpy.typing import NDArray


class InvalidArgument(ValueError):
    pass

class FileError(OSError):
    pass

class NumericalError(ArithmeticError):
    pass

def version() -> str:
    """Version of the compiled library, 'MAJOR.MINOR.PATCH'."""

def thread_count() -> int:
    """Number of threads that parallel loops use now."""

class ThreadLimit:
    """
    While it lives, the library uses at most `threads` threads (0: all cores).
    """

    def __init__(self, threads: int) -> None: ...

class Proxy:
    """
    The shape on which an environment map lies ([PEM] section 4), with the map's origin.

    Made by the static constructors. Immutable. Positions and extents are world space, in metres; `axes` is a (3, 3)
    array whose rows are the shape's own axes in world space (default: aligned with the world's).
    """

    @staticmethod
    def infinite(origin: Sequence[float] = (0.0, 0.0, 0.0)) -> Proxy:
        """The classic environment map: only the direction counts."""

    @staticmethod
    def box(centre: Sequence[float], half_extent: Sequence[float], origin: Sequence[float] | None = None, axes: Annotated[NDArray[numpy.float32], dict(shape=(3, 3), order='C', device='cpu', writable=False)] | None = None) -> Proxy:
        """
        A box. `origin` defaults to its centre and has to lie inside. Raises InvalidArgument for unusable values.
        """

    @staticmethod
    def ellipsoid(centre: Sequence[float], radii: Sequence[float], origin: Sequence[float] | None = None, axes: Annotated[NDArray[numpy.float32], dict(shape=(3, 3), order='C', device='cpu', writable=False)] | None = None) -> Proxy:
        """
        An ellipsoid. `origin` defaults to its centre and has to lie inside. Raises InvalidArgument for unusable values.
        """

    @staticmethod
    def sphere(centre: Sequence[float], radius: float, origin: Sequence[float] | None = None) -> Proxy:
        """A finite sphere: an ellipsoid with three equal radii."""

    @staticmethod
    def hemisphere(centre: Sequence[float], radius: float, origin: Sequence[float], axes: Annotated[NDArray[numpy.float32], dict(shape=(3, 3), order='C', device='cpu', writable=False)] | None = None) -> Proxy:
        """
        The half of a sphere above its own y = 0, closed by a flat floor. `origin` has to lie inside, above the floor.
        """

    @property
    def kind(self) -> str:
        """'infinite', 'box', 'ellipsoid' or 'hemisphere'."""

    @property
    def origin(self) -> Sequence[float]:
        """Origin of the map: lookups are directions seen from here."""

    @property
    def centre(self) -> Sequence[float]:
        """
        Centre of the shape (of its floor, for the hemisphere). AttributeError if it is infinite.
        """

    @property
    def half_extent(self) -> Sequence[float]:
        """
        Half the box's edge lengths, along its axes. AttributeError for other kinds.
        """

    @property
    def radii(self) -> Sequence[float]:
        """Radii of the ellipsoid along its axes. AttributeError for other kinds."""

    @property
    def radius(self) -> float:
        """Radius of the hemisphere. AttributeError for other kinds."""

    @property
    def axes(self) -> NDArray[numpy.float32]:
        """
        The shape's own axes in world space, one per row. AttributeError if it is infinite.
        """

    def lookup(self, positions: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], directions: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)]) -> NDArray[numpy.float32]:
        """
        Directions in which the map is read by rays.

        From the map's origin to where each ray leaves the shape, not normalised; `directions` itself for the infinite shape.
        Positions outside and rays that miss get a continuous answer, never NaN.

        Parameters
        ----------
        positions, directions
            (..., 3), of one shape, finite, world space; directions of any length > 0.

        Returns
        -------
            Array of the same shape. Computed in float64 and rounded.

        Raises
        ------
        InvalidArgument
            Shapes that differ or do not end in 3, NaN or infinite values (the row is named).
        """

    def lookup_float64(self, positions: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], directions: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)]) -> NDArray[numpy.float64]:
        """lookup() with float64 coordinates and results."""

    def validate(self) -> None:
        """Raises InvalidArgument, naming the field, if the proxy is not usable."""

    def __repr__(self) -> str: ...

def area_weighted_centroid(positions: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], triangles: Annotated[NDArray[numpy.uint32], dict(shape=(None, 3), order='C', device='cpu', writable=False)]) -> Sequence[float]:
    """
    Area-weighted mean of the triangles' centroids: the origin of an object's maps ([PEM] section 4).

    `positions` (n, 3) in metres, `triangles` (m, 3) indices. Returns (x, y, z). Raises InvalidArgument for indices out of range and for meshes without area.
    """

def fit_ellipsoid(points: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], centre: Sequence[float], origin: Sequence[float] | None = None) -> Proxy:
    """
    Minimum-volume axis-aligned ellipsoid around `centre` that encloses every point, to a relative volume of 1e-6.

    `points` (n, 3). `origin` of the returned Proxy defaults to `centre`. Flat input gets radii of at least 1e-4 of the largest extent. Raises InvalidArgument if all points lie at the centre.
    """

def fit_box_mean_distance(hits: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], origin: Sequence[float], floor: float) -> Proxy:
    """
    Box by [PEM] section 4: bottom on the plane y = `floor`, the other sides at the mean distance of the hits on that side.

    `hits` (n, 3): where rays from around the object meet the surroundings. Returns a Proxy with the given origin.
    """

def fit_box_robust(hits: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], origin: Sequence[float]) -> Proxy:
    """
    Axis-aligned box around `origin` that fits the hits best, by robust (Huber) least squares of their distances to its surface.

    `hits` (n, 3). Returns a Proxy with the given origin.
    """

class SaveReport:
    """What a file format could not hold."""

    @property
    def clamped_to_half(self) -> int:
        """
        Number of values beyond ±65504 that were clamped because the file stores float16.
        """

    @property
    def clipped(self) -> int:
        """
        Number of values outside [0,1] (in HDR: below 0), or NaN, that were clipped.
        """

    def __repr__(self) -> str: ...

def load_image(path: str) -> tuple[NDArray[numpy.float32], list[str]]:
    """
    Read an EXR, HDR, TIFF, PNG or JPEG as scene-linear float32 of shape (height, width, channels), with the
    names of the channels. Integer formats are decoded from sRGB. Raises FileError.
    """

def save_image(path: str, pixels: Annotated[NDArray[numpy.float32], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], channels: Sequence[str] | None = None, format: str = 'automatic') -> SaveReport:
    """
    Write scene-linear pixels of shape (height, width, channels) atomically; the extension of the path decides the
    format. `channels` names the channels (default Y, YA, RGB or RGBA). `format`: automatic, half, float32, uint8
    or uint16. Raises FileError and InvalidArgument.
    """

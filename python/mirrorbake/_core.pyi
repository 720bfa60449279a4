"""Compiled part of mirrorbake. Use it through the package `mirrorbake`."""

from collections.abc import Sequence
from typing import Annotated

import numpy
import numpy.typing
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

class CubePyramidLayout:
    """
    Order of the texels of a cube map with all its mip levels: the finest level first, in a level the six faces (+X -X +Y -Y +Z -Z), in a face the rows from the top.
    """

    def __init__(self, size: int) -> None:
        """Full pyramid for faces of `size` texels a side, 1 to 16384."""

    @property
    def size(self) -> int:
        """Texels along a side of the finest level."""

    @property
    def levels(self) -> int:
        """Number of levels."""

    @property
    def texels(self) -> int:
        """Number of texels of all levels."""

    def level_size(self, level: int) -> int:
        """Texels along a side of a level."""

    def level_offset(self, level: int) -> int:
        """Index of a level's first texel."""

def build_cube_pyramid(faces: Annotated[NDArray[numpy.float32], dict(shape=(6, None, None, None), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float32]:
    """
    All levels of a cube map.

    faces: float32 (6, N, N, C). Returns float32 (texels, C): every level is the mean of the finer one's 2x2 texels weighted by their solid angles ([EMT] section 2.4).
    """

class LookupOptions:
    """How a renderer reads the map."""

    def __init__(self, *, footprint_scale: float = 0.5) -> None: ...

    @property
    def footprint_scale(self) -> float:
        """
        Size of a lookup's footprint in pixels, in (0, 1024]. 1: the pixel's, as graphics hardware does.
        """

    @footprint_scale.setter
    def footprint_scale(self, arg: float, /) -> None: ...

class RenderingMatrix:
    """
    Sparse matrix A of b = A x: one row per pixel, one column per texel of every mip level.
    """

    @property
    def rows(self) -> int: ...

    @property
    def columns(self) -> int: ...

    @property
    def nonzeros(self) -> int: ...

    @property
    def row_offsets(self) -> Annotated[NDArray[numpy.uint64], dict(writable=False)]:
        """uint64 (rows + 1,): where each row's entries start."""

    @property
    def texels(self) -> Annotated[NDArray[numpy.uint32], dict(writable=False)]:
        """uint32 (nonzeros,): column of each entry."""

    @property
    def weights(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """float32 (nonzeros,): value of each entry."""

    @property
    def row_pixels(self) -> Annotated[NDArray[numpy.uint32], dict(writable=False)]:
        """uint32 (rows,): y * width + x of each row's pixel."""

    @property
    def row_samples(self) -> Annotated[NDArray[numpy.uint32], dict(writable=False)]:
        """uint32 (rows,): how many samples of the pixel see the part."""

    def average(self, samples: "mirrorbake::SurfaceSamples", part: int, values: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float32]:
        """
        Mean of per-sample values, float32 (len(samples), C), over each row's samples: float32 (rows, C).
        """

    def multiply(self, x: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float32]:
        """b = A x for x float32 (columns, C): float32 (rows, C)."""

def build_rendering_matrix(samples: "mirrorbake::SurfaceSamples", part: int, proxy: Proxy, layout: CubePyramidLayout, options: LookupOptions = ...) -> RenderingMatrix:
    """
    Rendering matrix of the samples that lie on `part` ([PEM] section 4), built from their lookups.
    """

def display_row_weights(matrix: RenderingMatrix, samples_per_pixel: int, target: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float32]:
    """
    Row weights for a target that will be looked at on a display: coverage / (1 + luminance)^2, float32 (rows,).
    """

class SolveOptions:
    """Weights of the regulariser and when to stop."""

    def __init__(self, *, smoothness: float = 0.0010000000474974513, level_agreement: float = 0.0010000000474974513, prior_weight: float = 0.009999999776482582, tolerance: float = 0.0010000000474974513, max_iterations: int = 200) -> None: ...

    @property
    def smoothness(self) -> float:
        """Weight of squared differences of neighbouring texels, >= 0."""

    @smoothness.setter
    def smoothness(self, arg: float, /) -> None: ...

    @property
    def level_agreement(self) -> float:
        """
        Weight of a texel's squared difference from the mean of its children, >= 0.
        """

    @level_agreement.setter
    def level_agreement(self, arg: float, /) -> None: ...

    @property
    def prior_weight(self) -> float:
        """Weight of the squared difference from the prior, >= 0."""

    @prior_weight.setter
    def prior_weight(self, arg: float, /) -> None: ...

    @property
    def tolerance(self) -> float:
        """Stop when the gradient has shrunk to this fraction, > 0."""

    @tolerance.setter
    def tolerance(self, arg: float, /) -> None: ...

    @property
    def max_iterations(self) -> int:
        """0 to 100000."""

    @max_iterations.setter
    def max_iterations(self, arg: int, /) -> None: ...

class SolveReport:
    """What a solve did."""

    @property
    def iterations(self) -> int: ...

    @property
    def relative_gradient(self) -> float:
        """What `tolerance` is compared with."""

    @property
    def unknowns(self) -> int:
        """Texels that some row sees."""

    @property
    def rms_error(self) -> float:
        """Weighted root mean square of A x - b."""

class MapSolver:
    """
    Regularised least squares for maps of one rendering matrix ([PEM] section 4): what all solves share is computed once.
    """

    def __init__(self, matrix: RenderingMatrix, row_weights: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C', device='cpu', writable=False)], layout: CubePyramidLayout, options: SolveOptions = ...) -> None: ...

    def solve(self, target: numpy.typing.NDArray[numpy.float32], prior: numpy.typing.NDArray[numpy.float32] | None = None, initial: numpy.typing.NDArray[numpy.float32] | None = None) -> tuple[numpy.typing.NDArray[numpy.float32], SolveReport]:
        """
        Solves for a map.

        target: float32 (rows, C), 1 to 4 channels, the fourth is coverage. prior, initial: float32 (texels, C). Returns the map, float32 (texels, C), clamped to [0, inf) (coverage to [0, 1]), and a report.
        """

class PartMaps:
    """Environment maps of one part of the reflector."""

    def __init__(self, distant_proxy: Proxy, distant: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)], local_proxy: Proxy = ..., local: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)] | None = None) -> None:
        """
        distant: float32 (texels, 3). local: float32 (texels, 4), premultiplied RGBA, or None for a part without a local layer.
        """

def render_reflector(samples: "mirrorbake::SurfaceSamples", parts: Sequence[PartMaps], layout: CubePyramidLayout, diffuse: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)] | None = None, options: LookupOptions = ...) -> NDArray[numpy.float32]:
    """
    Draws the reflector from its maps: (L_local + (1 - alpha) L_distant) F + D per sample, averaged over the pixel.

    diffuse: float32 (len(samples), 3) or None for black. Returns float32 (H, W, 4): light times coverage, and coverage.
    """

def diffuse_from_irradiance(samples: "mirrorbake::SurfaceSamples", triangles: Annotated[NDArray[numpy.uint32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], vertex_irradiance: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float32]:
    """
    Diffuse radiance of every sample, float32 (len(samples), 3), from irradiance baked per vertex (V, 3).
    """

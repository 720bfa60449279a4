"""Compiled part of mirrorbake. Use it through the package `mirrorbake`."""

from collections.abc import Callable, Sequence
import enum
import os
from typing import Annotated, Final, Literal, overload

import numpy
import numpy.typing
from numpy.typing import NDArray


class InvalidArgument(ValueError):
    pass

class FileError(OSError):
    pass

class MissingLibrary(ImportError):
    pass

class NumericalError(ArithmeticError):
    pass

def version() -> str:
    """Version of the compiled library, 'MAJOR.MINOR.PATCH'."""

def thread_count() -> int:
    """Number of threads that parallel loops use now."""

class ThreadLimit:
    """
    The library uses at most `threads` threads, 0 to 1024 (0: all cores), to the end of a block
    `with ThreadLimit(1): ...`, or else while the object lives. The smallest of several holds.
    """

    def __init__(self, threads: int) -> None: ...

    def __enter__(self) -> ThreadLimit: ...

    def __exit__(self, *exception: object) -> None: ...

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
    def sphere(centre: Sequence[float], radius: float, origin: Sequence[float] | None = None) -> Proxy:
        """A finite sphere: an ellipsoid with three equal radii."""

    @staticmethod
    def box(centre: Sequence[float], half_extent: Sequence[float], origin: Sequence[float] | None = None, axes: Annotated[NDArray[numpy.float32], dict(shape=(3, 3), order='C', device='cpu', writable=False)] | None = None) -> Proxy:
        """
        A box. `origin` has to lie inside (default: the
        centre, or above it where that is on a wall). Raises InvalidArgument for unusable values.
        """

    @staticmethod
    def ellipsoid(centre: Sequence[float], radii: Sequence[float], origin: Sequence[float] | None = None, axes: Annotated[NDArray[numpy.float32], dict(shape=(3, 3), order='C', device='cpu', writable=False)] | None = None) -> Proxy:
        """
        An ellipsoid. `origin` has to lie inside (default: the
        centre, or above it where that is on a wall). Raises InvalidArgument for unusable values.
        """

    @staticmethod
    def hemisphere(centre: Sequence[float], radius: float, origin: Sequence[float] | None = None, axes: Annotated[NDArray[numpy.float32], dict(shape=(3, 3), order='C', device='cpu', writable=False)] | None = None) -> Proxy:
        """
        The half of a sphere above its own y = 0, closed by a flat floor. `origin` has to lie inside (default: the
        centre, or above it where that is on a wall). Raises InvalidArgument for unusable values.
        """

    @property
    def kind(self) -> str:
        """Name of the shape, which is that of its constructor."""

    @property
    def origin(self) -> Sequence[float]:
        """Origin of the map: lookups are directions seen from here."""

    @property
    def centre(self) -> Sequence[float]:
        """
        Centre of the shape (of its floor, for the hemisphere). AttributeError if it is infinite.
        """

    @property
    def axes(self) -> NDArray[numpy.float32]:
        """
        The shape's own axes in world space, one per row. AttributeError if it is infinite.
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

    def mirror_lookup(self, eye: Sequence[float], positions: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], normals: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)]) -> NDArray[numpy.float32]:
        """
        Texture coordinates of a mirror's vertices or pixels in one layer ([PEM] section 4).

        Lookups along the reflections of the rays from `eye` (x, y, z) to the `positions` about the `normals`.

        Parameters
        ----------
        positions, normals
            (..., 3), of one shape, finite, world space; normals of any length > 0.

        Returns
        -------
            Array of the same shape: directions in which the map is read, not normalised.

        Raises
        ------
        InvalidArgument
            Shapes that differ or do not end in 3, NaN or infinite values (the row is named).
        """

    def __getstate__(self) -> tuple: ...

    def __setstate__(self, arg: tuple[str, Sequence[float], Sequence[float], Sequence[float], Sequence[float]], /) -> None: ...

    def validate(self) -> None:
        """Raises InvalidArgument, naming the field, if the proxy is not usable."""

    def __repr__(self) -> str: ...

def proxy_shapes() -> dict[str, tuple[str, ...]]:
    """
    What tells a shape besides the map's origin, by the name of the shape: attributes of a Proxy, and
    arguments of the constructor that bears the name.
    """

def mirror_lookups(proxies: Sequence[Proxy], eye: Sequence[float], positions: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], normals: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)]) -> NDArray[numpy.float32]:
    """
    Texture coordinates of a mirror's vertices or pixels in several layers at once.

    As Proxy.mirror_lookup() of each of the `proxies`, to the bit, but vertices are read and rays reflected once.

    Parameters
    ----------
    proxies
        One per layer, at least one.
    eye, positions, normals
        As for Proxy.mirror_lookup().

    Returns
    -------
        Array of shape (len(proxies), ..., 3): directions in which the maps are read, not normalised.

    Raises
    ------
    InvalidArgument
        As Proxy.mirror_lookup(); no proxies.
    """

def area_weighted_centroid(positions: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], triangles: Annotated[NDArray[numpy.uint32], dict(shape=(None, 3), order='C', device='cpu', writable=False)]) -> Sequence[float]:
    """
    Area-weighted mean of the triangles' centroids: the origin of an object's maps ([PEM] section
    4).

    `positions` (n, 3) in metres, `triangles` (m, 3) indices. Returns (x, y, z). Raises InvalidArgument for
    indices out of range and for meshes without area.
    """

def fit_ellipsoid(points: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], centre: Sequence[float], origin: Sequence[float] | None = None) -> Proxy:
    """
    Minimum-volume axis-aligned ellipsoid around `centre` that encloses every point, to a relative
    volume of 1e-6.

    `points` (n, 3). `origin` of the returned Proxy defaults to `centre`. Flat input gets radii of at least
    1e-4 of the largest extent. Raises InvalidArgument if all points lie at the centre.
    """

def fit_box_mean_distance(hits: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], origin: Sequence[float], floor: float) -> Proxy:
    """
    Box by [PEM] section 4: bottom on the plane y = `floor`, the other sides at the mean distance of
    the hits on that side.

    `hits` (n, 3): where rays from around the object meet the surroundings. Returns a Proxy with the given
    origin.
    """

def fit_box_robust(hits: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], origin: Sequence[float]) -> Proxy:
    """
    Axis-aligned box around `origin` that fits the hits best, by robust (Huber) least squares of
    their distances to its surface.

    `hits` (n, 3). Returns a Proxy with the given origin.
    """

def proxy_families() -> list[str]:
    """
    Names of the families of shapes that choose_proxy() fits, in rising order of parameters.
    """

class ProxyCandidate:
    """A shape that choose_proxy() fitted."""

    @property
    def name(self) -> str:
        """One of proxy_families()."""

    @property
    def parameters(self) -> int:
        """Numbers that the fit sets."""

    @property
    def proxy(self) -> Proxy:
        """The shape, fitted to all views."""

    @property
    def fit_error(self) -> float:
        """Mean angle over the rays of the fit, radians."""

    @property
    def off_view_error(self) -> float:
        """
        Predicted mean angle in other views, by cross-validation over the views, radians.
        """

class ProxyChoice:
    """What choose_proxy() found."""

    @property
    def candidates(self) -> list[ProxyCandidate]:
        """All shapes, in rising order of parameters."""

    @property
    def best(self) -> ProxyCandidate:
        """The chosen candidate."""

    @property
    def reason(self) -> str:
        """Why, in a sentence."""

def choose_proxy(positions: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], directions: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], distances: Annotated[NDArray[numpy.float32], dict(shape=(None,), order='C', device='cpu', writable=False)], views: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], origin: Sequence[float], tolerance: float = 0.05, negligible_angle: float = 0.0006, max_rays_per_view: int = 1000) -> ProxyChoice:
    """
    Chooses the geometry of a map from traced reflections of a few views.

    Fits every shape, predicts how far off its lookups are in views that it was not fitted to (each view is left out in
    turn; a single one is cut in two) and takes the simplest shape within `tolerance` of the best.

    Parameters
    ----------
    positions, directions
        (n, 3): rays as they leave the object, world space, metres.
    distances
        (n,): to the surroundings, metres, > 0; inf for rays that leave the scene.
    views
        (n,) integers: the view of each ray.
    origin
        Of the map, world space.
    tolerance
        Relative excess of error at which a simpler shape is still preferred.
    negligible_angle
        Errors below it do not count, radians; the default is a tenth of a texel of a cube map of 256 x 256 x 6.
    max_rays_per_view
        Of each view at most so many rays, evenly spaced, are used.

    Returns
    -------
        ProxyChoice with `best`, `reason` and all `candidates`.

    Raises
    ------
    InvalidArgument
        Arrays of different length, fewer than 16 rays, values that are not usable (the index is named).
    """

def hull_triangles(positions: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], triangles: Annotated[NDArray[numpy.uint32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], tolerance: float = 0.0001) -> NDArray[numpy.uint8]:
    """
    1 for every triangle that lies on the mesh's convex hull, else 0; see
    mirrorbake.proxy.hull_triangles.
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

def load_image(path: str | os.PathLike[str]) -> tuple[NDArray[numpy.float32], list[str]]:
    """
    Read an EXR, HDR, TIFF, PNG or JPEG as scene-linear float32 of shape (height, width, channels),
    with the names of the channels. Integer formats are decoded from sRGB. Raises FileError.
    """

def save_image(path: str | os.PathLike[str], pixels: Annotated[NDArray[numpy.float32], dict(shape=(None, None, None), order='C', device='cpu', writable=False)], channels: Sequence[str] | None = None, format: Literal['automatic', 'half', 'float32', 'uint8', 'uint16'] = 'automatic') -> SaveReport:
    """
    Write scene-linear pixels of shape (height, width, channels) atomically; the extension of the
    path decides the format. `channels` names the channels (default Y, YA, RGB or RGBA). `format`: automatic,
    half, float32, uint8 or uint16. Raises FileError and InvalidArgument.
    """

def set_texture_cache_bytes(bytes: int) -> None:
    """
    Bound the cache of all texture files together; 1 GiB until it is set, at least 16 MiB.
    """

class TextureReference:
    """
    A texture of a scene, by its index (−1: none), and the transform of the texture coordinates as
    of KHR_texture_transform, whose v counts downwards: scaled, turned counter-clockwise by `rotation`
    radians about (0, 0), then moved.
    """

    def __init__(self, texture: int = -1, offset: Sequence[float] = (0.0, 0.0), scale: Sequence[float] = (1.0, 1.0), rotation: float = 0.0) -> None: ...

    @property
    def texture(self) -> int: ...

    @texture.setter
    def texture(self, arg: int, /) -> None: ...

    @property
    def offset(self) -> Sequence[float]: ...

    @offset.setter
    def offset(self, arg: Sequence[float], /) -> None: ...

    @property
    def scale(self) -> Sequence[float]: ...

    @scale.setter
    def scale(self, arg: Sequence[float], /) -> None: ...

    @property
    def rotation(self) -> float: ...

    @rotation.setter
    def rotation(self, arg: float, /) -> None: ...

    def __eq__(self, other: object) -> bool: ...

    def __repr__(self) -> str: ...

    def __getstate__(self) -> dict: ...

    def __setstate__(self, arg: dict, /) -> None: ...

class Fresnel:
    """Reflectance per colour channel as a function of the angle."""

    def __init__(self, model: Literal['constant', 'schlick', 'dielectric', 'conductor'] = 'constant', r0: Sequence[float] = (0.0, 0.0, 0.0), eta: Sequence[float] = (1.5, 1.5, 1.5), k: Sequence[float] = (0.0, 0.0, 0.0)) -> None: ...

    @property
    def model(self) -> Literal['constant', 'schlick', 'dielectric', 'conductor']: ...

    @model.setter
    def model(self, arg: Literal['constant', 'schlick', 'dielectric', 'conductor'], /) -> None: ...

    @property
    def r0(self) -> Sequence[float]:
        """
        constant: reflectance; schlick: reflectance at normal incidence; in [0, 1]
        """

    @r0.setter
    def r0(self, arg: Sequence[float], /) -> None: ...

    @property
    def eta(self) -> Sequence[float]:
        """dielectric, conductor: real part of the relative index, above 0"""

    @eta.setter
    def eta(self, arg: Sequence[float], /) -> None: ...

    @property
    def k(self) -> Sequence[float]:
        """conductor: extinction coefficient, at least 0"""

    @k.setter
    def k(self, arg: Sequence[float], /) -> None: ...

    def __repr__(self) -> str: ...

    def __getstate__(self) -> dict: ...

    def __setstate__(self, arg: dict, /) -> None: ...

class Material:
    """What a surface does with light."""

    def __init__(self, *, name: str = '', albedo: Sequence[float] = (0.5, 0.5, 0.5), albedo_texture: TextureReference = ..., specular: bool = False, fresnel: Fresnel = ..., specular_texture: TextureReference = ..., lobe: Literal['mirror', 'ggx', 'phong'] = 'mirror', roughness: float = 0.10000000149011612, roughness_texture: TextureReference = ..., exponent: float = 100.0, layers: Literal['additive', 'coated'] = 'additive', emission: Sequence[float] = (0.0, 0.0, 0.0), emission_texture: TextureReference = ..., opacity: float = 1.0, opacity_texture: TextureReference = ..., opacity_cutoff: float | None = None, normal_texture: TextureReference = ..., normal_scale: float = 1.0, colors_tint_reflectance: bool = False) -> None: ...

    @property
    def name(self) -> str: ...

    @name.setter
    def name(self, arg: str, /) -> None: ...

    @property
    def albedo(self) -> Sequence[float]:
        """Lambertian reflectance per channel, in [0, 1]"""

    @albedo.setter
    def albedo(self, arg: Sequence[float], /) -> None: ...

    @property
    def albedo_texture(self) -> TextureReference:
        """multiplies `albedo`"""

    @albedo_texture.setter
    def albedo_texture(self, arg: TextureReference, /) -> None: ...

    @property
    def specular(self) -> bool:
        """whether it has a specular lobe, weighted by `fresnel`"""

    @specular.setter
    def specular(self, arg: bool, /) -> None: ...

    @property
    def fresnel(self) -> Fresnel: ...

    @fresnel.setter
    def fresnel(self, arg: Fresnel, /) -> None: ...

    @property
    def specular_texture(self) -> TextureReference:
        """multiplies the `r0` of a constant or Schlick's reflectance"""

    @specular_texture.setter
    def specular_texture(self, arg: TextureReference, /) -> None: ...

    @property
    def lobe(self) -> Literal['mirror', 'ggx', 'phong']: ...

    @lobe.setter
    def lobe(self, arg: Literal['mirror', 'ggx', 'phong'], /) -> None: ...

    @property
    def roughness(self) -> float:
        """of the lobe `ggx`: its α, in (0, 1]"""

    @roughness.setter
    def roughness(self, arg: float, /) -> None: ...

    @property
    def roughness_texture(self) -> TextureReference:
        """its first channel multiplies `roughness`"""

    @roughness_texture.setter
    def roughness_texture(self, arg: TextureReference, /) -> None: ...

    @property
    def exponent(self) -> float:
        """of the lobe `phong`: N, in [1, 1e6]"""

    @exponent.setter
    def exponent(self, arg: float, /) -> None: ...

    @property
    def layers(self) -> Literal['additive', 'coated']: ...

    @layers.setter
    def layers(self, arg: Literal['additive', 'coated'], /) -> None: ...

    @property
    def emission(self) -> Sequence[float]:
        """radiance emitted on the front side, W sr⁻¹ m⁻²"""

    @emission.setter
    def emission(self, arg: Sequence[float], /) -> None: ...

    @property
    def emission_texture(self) -> TextureReference:
        """multiplies `emission`"""

    @emission_texture.setter
    def emission_texture(self, arg: TextureReference, /) -> None: ...

    @property
    def opacity(self) -> float:
        """part of the surface that is there, in [0, 1]: rays pass between"""

    @opacity.setter
    def opacity(self, arg: float, /) -> None: ...

    @property
    def opacity_texture(self) -> TextureReference:
        """
        its first channel multiplies `opacity`; its texels have to be in memory
        """

    @opacity_texture.setter
    def opacity_texture(self, arg: TextureReference, /) -> None: ...

    @property
    def opacity_cutoff(self) -> float | None:
        """
        None, or: all is there where the opacity is at least this, nothing elsewhere
        """

    @opacity_cutoff.setter
    def opacity_cutoff(self, arg: float | None, /) -> None: ...

    @property
    def normal_texture(self) -> TextureReference:
        """
        bends the normal: texels (x, y, z)/2 + 1/2 along ∂p/∂u, ∂p/∂v (v up) and the normal
        """

    @normal_texture.setter
    def normal_texture(self, arg: TextureReference, /) -> None: ...

    @property
    def normal_scale(self) -> float:
        """of the x and y of `normal_texture`"""

    @normal_scale.setter
    def normal_scale(self, arg: float, /) -> None: ...

    @property
    def colors_tint_reflectance(self) -> bool:
        """the mesh's colours multiply `fresnel.r0`, too: of a metal"""

    @colors_tint_reflectance.setter
    def colors_tint_reflectance(self, arg: bool, /) -> None: ...

    def __repr__(self) -> str: ...

    def __getstate__(self) -> dict: ...

    def __setstate__(self, arg: dict, /) -> None: ...

class TriangleMesh:
    """
    Triangles with optional vertex normals, texture coordinates and parts. World space, metres.
    """

    def __init__(self, positions: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], triangles: Annotated[NDArray[numpy.uint32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], normals: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)] | None = None, uvs: Annotated[NDArray[numpy.float32], dict(shape=(None, 2), order='C', device='cpu', writable=False)] | None = None, parts: Annotated[NDArray[numpy.uint16], dict(shape=(None,), order='C', device='cpu', writable=False)] | None = None, colors: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)] | None = None, tangents: Annotated[NDArray[numpy.float32], dict(shape=(None, 4), order='C', device='cpu', writable=False)] | None = None) -> None:
        """
        Copies positions (V, 3), triangles (T, 3) of vertex indices, counter-clockwise seen from
        outside, unit normals (V, 3) (default: flat shading), uvs (V, 2) with v up, the part of each triangle
        (T,), colours (V, 3) in [0, 1], linear, that multiply the material's albedo, and tangents (V, 4) of normal
        textures: the unit direction in which u grows and the sign of the bitangent, ±1, or zeros for none (default:
        from the coordinates). Raises InvalidArgument for anything not finite, indices out of range or a mesh without
        area.
        """

    @property
    def positions(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """Vertices, (V, 3), a read-only view."""

    @property
    def normals(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """Unit vertex normals, (V, 3), or (0, 3) for flat shading."""

    @property
    def uvs(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """Texture coordinates, (V, 2), v up, or (0, 2)."""

    @property
    def triangles(self) -> Annotated[NDArray[numpy.uint32], dict(writable=False)]:
        """Vertex indices, (T, 3)."""

    @property
    def parts(self) -> Annotated[NDArray[numpy.uint16], dict(writable=False)]:
        """Part of each triangle, (T,), or (0,) if all belong to part 0."""

    @property
    def colors(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """Colours of the vertices, (V, 3), linear, or (0, 3) if they have none."""

    @property
    def tangents(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """
        Tangents of normal textures, (V, 4): direction of u and sign of the bitangent; or (0, 4).
        """

    def __getstate__(self) -> tuple: ...

    def __setstate__(self, arg: tuple[Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], Annotated[NDArray[numpy.uint32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], Annotated[NDArray[numpy.float32], dict(shape=(None, 2), order='C', device='cpu', writable=False)], Annotated[NDArray[numpy.uint16], dict(shape=(None,), order='C', device='cpu', writable=False)], Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], Annotated[NDArray[numpy.float32], dict(shape=(None, 4), order='C', device='cpu', writable=False)]], /) -> None: ...

    def __repr__(self) -> str: ...

def bounds(mesh: TriangleMesh) -> tuple[Sequence[float], Sequence[float]]:
    """Smallest and largest coordinates of a mesh's vertices."""

def make_teapot(subdivisions: int = 25, height: float = 0.15000000596046448) -> TriangleMesh:
    """
    The Utah teapot of 32 Bezier patches, `subdivisions`² × 2 triangles each (1 to 512; 25 gives
    the 40,000 of [PEM] §6), `height` metres high, standing on y = 0 with the spout along +X. Parts: 0 body,
    1 lid.
    """

def teapot_part_names() -> list[str]:
    """Names of the teapot's parts, in order."""

def make_box(min: Sequence[float], max: Sequence[float]) -> TriangleMesh:
    """Box with axis-aligned sides, each with texture coordinates 0 to 1."""

def make_sphere(centre: Sequence[float], radius: float, segments: int = 48) -> TriangleMesh:
    """
    Latitude-longitude sphere with `segments` (3 to 4096) around the equator.
    """

def make_cylinder(base: Sequence[float], radius: float, height: float, segments: int = 48) -> TriangleMesh:
    """Upright closed cylinder; `base` is the centre of its lower cap."""

def make_cone(base: Sequence[float], radius: float, height: float, segments: int = 48) -> TriangleMesh:
    """Upright closed cone; `base` is the centre of its base."""

def make_torus(centre: Sequence[float], ring_radius: float, tube_radius: float, segments: int = 48) -> TriangleMesh:
    """Torus about the vertical axis through `centre`."""

def make_rectangle(corner: Sequence[float], u: Sequence[float], v: Sequence[float]) -> TriangleMesh:
    """
    Rectangle corner, corner + u, corner + u + v, corner + v, facing u × v.
    """

def load_mesh(path: str | os.PathLike[str], *, origin: Sequence[float] = [0.0, 0.0, 0.0]) -> TriangleMesh:
    """
    Every triangle of an .obj, .gltf or .glb file as one mesh of one part, with node transforms
    applied (instances become copies) and missing vertex normals made by angle-weighted averaging. `origin`:
    as of load_scene. Raises FileError if the file is missing, corrupt, empty or refers to files outside its
    directory.
    """

def winding_number(mesh: TriangleMesh, point: Sequence[float]) -> float:
    """
    How often a mesh winds about a point: 1 inside of a closed mesh, 0 outside, else between (van
    Oosterom and Strackee 1983). Exactly 0 outside of the bounding box.
    """

def encloses(mesh: TriangleMesh, point: Sequence[float]) -> bool:
    """
    Whether a point, such as an eye, lies inside of a body: whether it winds about it more than half.
    """

class Visibility(enum.Flag):
    """A set of the kinds of rays that see an object."""

    none = 0

    camera = 1
    """rays from the eye, and those of a capture"""

    reflection = 2
    """rays that leave a surface, specular or diffuse"""

    shadow = 4
    """rays towards a light"""

    all = 7

class Scene:
    """
    Objects, materials, textures and lights. World space is right-handed, +Y up, in metres; colours
    and radiance are scene-linear with Rec.709 primaries. The add_ functions return the new thing's index.
    """

    def __init__(self) -> None: ...

    def __repr__(self) -> str: ...

    def translate(self, by: Sequence[float]) -> None:
        """
        Move everything that has a place: objects, and lights that are not at infinity.
        """

    def add_texture(self, pixels: Annotated[NDArray[numpy.float32], dict(shape=(None, None, 3), order='C', device='cpu', writable=False)], wrap_u: Literal['repeat', 'clamp', 'mirror'] = 'repeat', wrap_v: Literal['repeat', 'clamp', 'mirror'] = 'repeat') -> int:
        """
        Add a texture of shape (height, width, 3), values in [0, 1], row 0 at the top.
        """

    def add_texture_file(self, path: str | os.PathLike[str], wrap_u: Literal['repeat', 'clamp', 'mirror'] = 'repeat', wrap_v: Literal['repeat', 'clamp', 'mirror'] = 'repeat', transfer: Literal['automatic', 'srgb', 'linear'] = 'automatic') -> int:
        """
        Add a texture whose texels are read from an image file when they are needed, and kept in a
        cache of bounded size. Raises FileError if the file is missing, damaged or has values outside [0, 1].
        """

    def texture_pixels(self, texture: int) -> NDArray[numpy.float32]:
        """
        Copy of a texture's texels, (height, width, 3), or (height, width, 1) for one channel that
        stands for all three; scene-linear, row 0 at the top. Raises FileError if its file has changed.
        """

    def texture_wrap(self, texture: int) -> tuple[Literal['repeat', 'clamp', 'mirror'], Literal['repeat', 'clamp', 'mirror']]:
        """How coordinates outside [0,1] find texels, along u and v."""

    def add_material(self, material: Material) -> int:
        """Add a copy of a material."""

    def add_object(self, name: str, mesh: TriangleMesh, material: int, part_names: Sequence[str] = [], visibility: Visibility = Visibility.all, part_materials: Sequence[int] = []) -> int:
        """
        Add a copy of a mesh, in world space, with the material of that index. `part_names` names
        its parts, if it has more than one; `part_materials` gives each a material of its own.
        """

    def add_rectangle_light(self, corner: Sequence[float], edge_u: Sequence[float], edge_v: Sequence[float], radiance: Sequence[float]) -> int:
        """
        Add a rectangle that emits `radiance` (W sr⁻¹ m⁻²) along edge_u × edge_v.
        """

    def add_point_light(self, position: Sequence[float], intensity: Sequence[float]) -> int:
        """Add a light of `intensity` W sr⁻¹ in every direction."""

    def add_sphere_light(self, centre: Sequence[float], radius: float, radiance: Sequence[float]) -> int:
        """Add a sphere that emits `radiance` (W sr⁻¹ m⁻²) outwards."""

    def add_directional_light(self, direction: Sequence[float], irradiance: Sequence[float]) -> int:
        """
        Add parallel light that travels along the unit vector `direction` and gives a surface that
        faces it `irradiance` W m⁻².
        """

    def add_spot_light(self, position: Sequence[float], direction: Sequence[float], intensity: Sequence[float], inner_degrees: float = 0.0, outer_degrees: float = 45.0) -> int:
        """
        Add a light of `intensity` W sr⁻¹ along the unit vector `direction`: in full up to
        `inner_degrees` from that axis, falling to 0 at `outer_degrees` (at most 90).
        """

    def set_environment(self, panorama: Annotated[NDArray[numpy.float32], dict(shape=(None, None, 3), order='C', device='cpu', writable=False)], scale: float = 1.0, rotation_degrees: float = 0.0) -> None:
        """
        Surround the scene with a latitude-longitude panorama of radiance, shape (height, width, 3):
        its centre looks along −Z, +X is to the right of the centre, +Y is the top row. It is multiplied with
        `scale` and turned counter-clockwise about +Y, seen from above.
        """

    def add_materials(self, other: Scene) -> int:
        """
        Add copies of another scene's textures and materials; returns the index of the first material.
        """

    def join_objects(self, most_parts: int) -> tuple[TriangleMesh, list[str], list[int]]:
        """
        All objects in one mesh: (mesh, part names, index of each part's material). A part is an
        object, or, if there are more than `most_parts`, what is of one material.
        """

    @property
    def object_names(self) -> list[str]: ...

    @property
    def material_names(self) -> list[str]: ...

    def object_mesh(self, object: int) -> TriangleMesh:
        """Copy of an object's mesh."""

    def object_material(self, object: int) -> int:
        """Index of an object's material."""

    def object_part_materials(self, object: int) -> list[int]:
        """Index of the material of each part of an object."""

    def set_object_material(self, object: int, material: int) -> None:
        """Give an object, all its parts, the material of that index."""

    def object_part_names(self, object: int) -> list[str]:
        """Names of an object's parts; its own if it has only one."""

    def object_visibility(self, object: int) -> Visibility:
        """The kinds of rays that see an object."""

    def set_object_visibility(self, object: int, visibility: Visibility) -> None:
        """Choose the kinds of rays that see an object."""

    def material(self, material: int) -> Material:
        """Copy of a material."""

    def set_material(self, index: int, material: Material) -> None:
        """Replace a material."""

    def bounds(self, object: int) -> tuple[Sequence[float], Sequence[float]]:
        """Smallest and largest coordinates of an object's vertices."""

    def validate(self) -> None:
        """
        Raise InvalidArgument, naming the object and the field, if anything in the scene is unusable.
        """

class SceneCamera:
    """A viewpoint that a scene file proposes."""

    @property
    def name(self) -> str: ...

    @property
    def eye(self) -> Sequence[float]: ...

    @property
    def direction(self) -> Sequence[float]:
        """unit vector along the view"""

    @property
    def up(self) -> Sequence[float]:
        """unit vector, upright to `direction`"""

    @property
    def vertical_fov_degrees(self) -> float: ...

    def __repr__(self) -> str: ...

class SceneWarning:
    """Something in a file that the scene does not show."""

    @property
    def message(self) -> str: ...

    @property
    def count(self) -> int:
        """how often it occurs"""

    def __repr__(self) -> str: ...

class LoadedScene:
    """What a scene file holds."""

    @property
    def scene(self) -> Scene: ...

    @property
    def cameras(self) -> list[SceneCamera]: ...

    @property
    def warnings(self) -> list[SceneWarning]: ...

    def __repr__(self) -> str: ...

def load_scene(path: str | os.PathLike[str], *, max_texture_side: int = 16384, max_texture_bytes: int = 4294967296, cache_textures_above: int = 67108864, max_vertices: int = 50000000, max_triangles: int = 50000000, luminous_efficacy: float = 1.0, origin: Sequence[float] = [0.0, 0.0, 0.0]) -> LoadedScene:
    """
    Read a scene from an .obj (with its .mtl), .gltf or .glb file: one object per node and material,
    materials, textures, lights and cameras. Image files larger than `cache_textures_above` bytes in memory
    are read through the cache of texture files. glTF's candela, lux and nits are divided by
    `luminous_efficacy` (lumens per watt). The place `origin` of the file's world becomes the scene's zero,
    before positions are rounded to float32. Raises FileError if a file is missing, corrupt, beyond a limit
    or refers to files outside its directory.
    """

def referenced_files(path: str | os.PathLike[str], content: Literal['mesh', 'scene']) -> list[str]:
    """
    The files beside `path` that load_mesh or load_scene would read: the external buffers of a glTF
    file and, for a scene, its images, or the material libraries of an OBJ file and their images. Absolute,
    each once, not those that do not exist. Raises FileError if `path` or a library is missing or corrupt.
    """

def make_room() -> Scene:
    """
    The built-in furnished room. The table's top is the plane y = 0 with its centre at the origin;
    the reflector, which is not part of it, stands there.
    """

class ShellLight:
    """
    Light that the reflected rays of SurfaceSamples bring from one shell of the environment.
    """

    @property
    def name(self) -> str: ...

    @property
    def radiance(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """
        (n, 4): incident radiance, premultiplied, and alpha, which is 1 in the last shell.
        """

    @property
    def hit_distance(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n,): metres along the ray to what it meets; inf: nothing."""

class SurfaceSamples:
    """
    Where the samples of an image's pixels first meet the reflector: one entry per sample that sees
    it, ordered by pixel, then by sample. All arrays are read-only views; `diffuse` and `shells` are empty
    when no light was traced.
    """

    @property
    def width(self) -> int:
        """Of the image, pixels."""

    @property
    def height(self) -> int:
        """Of the image, pixels."""

    @property
    def samples_per_pixel(self) -> int: ...

    @property
    def pixel_samples(self) -> Annotated[NDArray[numpy.uint32], dict(writable=False)]:
        """
        (height * width,) uint32: samples traced per pixel; empty if all are `samples_per_pixel`.
        """

    def __len__(self) -> int: ...

    @property
    def pixel(self) -> Annotated[NDArray[numpy.uint32], dict(writable=False)]:
        """(n,) uint32: y * width + x."""

    @property
    def part(self) -> Annotated[NDArray[numpy.uint16], dict(writable=False)]:
        """(n,) uint16: part of the reflector."""

    @property
    def triangle(self) -> Annotated[NDArray[numpy.uint32], dict(writable=False)]:
        """(n,) uint32: triangle of the reflector's mesh."""

    @property
    def barycentric(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n, 2): weights of the triangle's second and third vertex."""

    @property
    def position(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n, 3): metres, relative to `origin`."""

    @property
    def origin(self) -> tuple[float, float, float]:
        """
        Where in the scene the positions' zero is: 0, but for scenes far from their own zero.
        """

    @property
    def normal(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n, 3): unit shading normal, towards the eye."""

    @property
    def reflection(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n, 3): unit direction r = 2(n·v)n - v."""

    @property
    def dposition_dx(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n, 3): change of `position` per pixel to the right."""

    @property
    def dposition_dy(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n, 3): change of `position` per pixel down."""

    @property
    def dreflection_dx(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n, 3): change of `reflection` per pixel to the right."""

    @property
    def dreflection_dy(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n, 3): change of `reflection` per pixel down."""

    @property
    def fresnel(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n, 3): Fresnel reflectance F of the first bounce."""

    @property
    def albedo(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n, 3): diffuse albedo, times (1 - F) under a coat."""

    @property
    def emission(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n, 3): radiance of the surface's own; (0, 3): none."""

    @property
    def back(self) -> Annotated[NDArray[numpy.uint8], dict(writable=False)]:
        """
        (n,) uint8: 1 where the eye sees the back of the triangle; (0,): nowhere.
        """

    @property
    def diffuse(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(n, 3): radiance D that the body reflects and emits."""

    @property
    def shells(self) -> list[ShellLight]:
        """Front to back: the incident radiance is L0 + (1 - a0)(L1 + ...)."""

def with_vertex_lookups(samples: SurfaceSamples, positions: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], triangles: Annotated[NDArray[numpy.uint32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], lookups: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)]) -> SurfaceSamples:
    """
    Samples that read a map at coordinates of the vertices, float32 (V, 3), interpolated over every
    triangle ([PEM] section 5): texture coordinates (u, v, 0), or lookups on a proxy. To be read through
    Proxy.infinite, since `reflection` is then the lookup itself, of any length.
    """

def texture_samples(positions: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], triangles: Annotated[NDArray[numpy.uint32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], uvs: Annotated[NDArray[numpy.float32], dict(shape=(None, 2), order='C', device='cpu', writable=False)], size: int, per_side: int = 2) -> SurfaceSamples:
    """
    A surface as its texture sees it: samples of an image whose pixels are the `size`^2 texels (1 to
    4096) of a map on the texture coordinates, float32 (V, 2), v up, at `per_side`^2 (1 to 8) places of each,
    where a triangle has any. To be read through Proxy.infinite: `reflection` is (u, 1 - v, 0).
    """

class RunTimeModel:
    """
    How the renderer that will draw the maps reads them: what a map is inferred for.
    """

    def __init__(self, *, name: str, places: Sequence[Sequence[float]], footprint_scale: float, filter: Literal['nearest', 'bilinear', 'trilinear', 'anisotropic'] = 'anisotropic', max_taps: int = 4) -> None: ...

    @property
    def name(self) -> str: ...

    @property
    def places(self) -> list[Sequence[float]]:
        """
        Where in a pixel the lookups lie: (x, y) in [0, 1) from its top left corner.
        """

    @property
    def footprint_scale(self) -> float:
        """Size of a lookup's footprint in pixels, in (0, 1024]."""

    @property
    def filter(self) -> Literal['nearest', 'bilinear', 'trilinear', 'anisotropic']: ...

    @property
    def max_taps(self) -> int:
        """Of `anisotropic`: 1, or an even number up to 16."""

    def __repr__(self) -> str: ...

    def __eq__(self, other: object, /) -> bool: ...

def run_time_model(name: str) -> RunTimeModel:
    """
    Web (four lookups per pixel on a rotated grid, footprint 1/2, up to 4 taps), Web1 (one lookup)
    or Reference (16 lookups, footprint 1/4).
    """

class Camera:
    """A pinhole camera. Pixel (0,0) is the top left one."""

    def __init__(self, eye: Sequence[float], target: Sequence[float], up: Sequence[float] = (0.0, 1.0, 0.0), vertical_fov_degrees: float = 40.0, width: int = 512, height: int = 512) -> None: ...

    @property
    def eye(self) -> Sequence[float]: ...

    @eye.setter
    def eye(self, arg: Sequence[float], /) -> None: ...

    @property
    def target(self) -> Sequence[float]: ...

    @target.setter
    def target(self, arg: Sequence[float], /) -> None: ...

    @property
    def up(self) -> Sequence[float]: ...

    @up.setter
    def up(self, arg: Sequence[float], /) -> None: ...

    @property
    def vertical_fov_degrees(self) -> float:
        """In (0, 180)."""

    @vertical_fov_degrees.setter
    def vertical_fov_degrees(self, arg: float, /) -> None: ...

    @property
    def width(self) -> int:
        """Pixels, 1 to 16384."""

    @width.setter
    def width(self, arg: int, /) -> None: ...

    @property
    def height(self) -> int:
        """Pixels, 1 to 16384."""

    @height.setter
    def height(self, arg: int, /) -> None: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __repr__(self) -> str: ...

    def __getstate__(self) -> dict: ...

    def __setstate__(self, arg: dict, /) -> None: ...

class TracerOptions:
    """What is decided once per scene."""

    def __init__(self, *, indirect: Literal['none', 'cached', 'path'] = 'cached', cache_rays: int = 96, cache_bounces: int = 6, seed: int = 0, focus: int = -1) -> None: ...

    @property
    def indirect(self) -> Literal['none', 'cached', 'path']: ...

    @indirect.setter
    def indirect(self, arg: Literal['none', 'cached', 'path'], /) -> None: ...

    @property
    def cache_rays(self) -> int:
        """Gather rays per vertex, 1 to 65536; a quarter after the first bounce."""

    @cache_rays.setter
    def cache_rays(self, arg: int, /) -> None: ...

    @property
    def cache_bounces(self) -> int:
        """Diffuse bounces of the cache, 1 to 16."""

    @cache_bounces.setter
    def cache_bounces(self, arg: int, /) -> None: ...

    @property
    def seed(self) -> int:
        """Of the cache."""

    @seed.setter
    def seed(self, arg: int, /) -> None: ...

    @property
    def focus(self) -> int:
        """
        Object number. It mirrors what is close to it, so the cache is finer there; below 0: none.
        """

    @focus.setter
    def focus(self, arg: int, /) -> None: ...

    def __repr__(self) -> str: ...

    def __getstate__(self) -> dict: ...

    def __setstate__(self, arg: dict, /) -> None: ...

class ShellRule:
    """
    What one shell of a reflector's environment holds: the things that a reflected ray meets first,
    as the first rule of a list says that they match. The last rule takes the rest, and the background.
    """

    def __init__(self, name: str, objects: Sequence[int] = [], nearer_than: float = float('inf')) -> None: ...

    @property
    def name(self) -> str:
        """Letters, digits, _ and -."""

    @name.setter
    def name(self, arg: str, /) -> None: ...

    @property
    def objects(self) -> list[int]:
        """Numbers of objects, ITSELF for the reflector; empty: any, and lights."""

    @objects.setter
    def objects(self, arg: Sequence[int], /) -> None: ...

    @property
    def nearer_than(self) -> float:
        """Along the reflected ray, metres, more than 0."""

    @nearer_than.setter
    def nearer_than(self, arg: float, /) -> None: ...

    ITSELF: Final[int] = ...
    """The reflector, as an entry of `objects`."""

    @property
    def has_limits(self) -> bool:
        """
        Whether it holds some of the places of its things alone, so that those may be met again
        behind.
        """

    def holds(self, objects: NDArray[numpy.int32], distances: NDArray[numpy.float32], reflector: int) -> NDArray[numpy.uint8]:
        """
        1 where the rule holds what a ray meets, else 0: objects' numbers (n,), -1 for a light, at
        distances (n,) along the ray, metres.
        """

    def __eq__(self, other: object, /) -> bool: ...

    def __repr__(self) -> str: ...

    def __getstate__(self) -> dict: ...

    def __setstate__(self, arg: dict, /) -> None: ...

def default_shell_rules() -> list[ShellRule]:
    """`local`, the reflector itself, and `distant`, the rest."""

MOST_SHELLS: int = 8

class TraceOptions:
    """What is decided per image."""

    def __init__(self, *, samples_per_pixel: int = 16, max_specular_depth: int = 8, max_diffuse_depth: int = 4, seed: int = 0, window: Sequence[int] = [0, 0, 0, 0], noise: float = 0.0, most_samples_per_pixel: int = 256, shells: Sequence[ShellRule] = ...) -> None: ...

    @property
    def samples_per_pixel(self) -> int:
        """1 to 65536."""

    @samples_per_pixel.setter
    def samples_per_pixel(self, arg: int, /) -> None: ...

    @property
    def max_specular_depth(self) -> int:
        """Specular bounces after the first, 0 to 64."""

    @max_specular_depth.setter
    def max_specular_depth(self, arg: int, /) -> None: ...

    @property
    def max_diffuse_depth(self) -> int:
        """Diffuse bounces of IndirectLight.path, 0 to 64."""

    @max_diffuse_depth.setter
    def max_diffuse_depth(self, arg: int, /) -> None: ...

    @property
    def seed(self) -> int: ...

    @seed.setter
    def seed(self, arg: int, /) -> None: ...

    @property
    def noise(self) -> float:
        """
        0, or the standard error of a pixel's displayed value (sRGB, 0 to 1) for which
        trace_layers takes more samples where they are needed.
        """

    @noise.setter
    def noise(self, arg: float, /) -> None: ...

    @property
    def most_samples_per_pixel(self) -> int:
        """Of trace_layers with `noise`, 1 to 65536."""

    @most_samples_per_pixel.setter
    def most_samples_per_pixel(self, arg: int, /) -> None: ...

    @property
    def shells(self) -> list[ShellRule]:
        """
        How trace_layers splits the incident light, front to back: 1 to MOST_SHELLS rules.
        """

    @shells.setter
    def shells(self, arg: Sequence[ShellRule], /) -> None: ...

    @property
    def window(self) -> list[int]:
        """
        x, y, width, height of the part of the image to trace, in pixels; of no size: everything.
        """

    @window.setter
    def window(self, arg: Sequence[int], /) -> None: ...

    def __repr__(self) -> str: ...

    def __getstate__(self) -> dict: ...

    def __setstate__(self, arg: dict, /) -> None: ...

class BeautyTrace:
    """An image that was traced until its noise was below a limit."""

    @property
    def image(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(height, width, 3) float32 radiance, read-only."""

    @property
    def noise(self) -> float:
        """
        Relative standard error of a pixel's luminance, root mean square over the tiles.
        """

    @property
    def mean_samples_per_pixel(self) -> float: ...

    @property
    def share_above(self) -> float:
        """
        Share of the tiles that samples_per_pixel ended before they reached the limit.
        """

class LayerTrace:
    """The layers of one reflector in one view."""

    @property
    def layers(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """
        (height, width, channels) float32, read-only: means over each pixel's samples.
        """

    @property
    def channels(self) -> list[str]:
        """Names of the channels of `layers`."""

    @property
    def samples(self) -> SurfaceSamples:
        """The samples that see the reflector, with the traced light."""

    @property
    def sample_beauty(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """
        (n, 3): beauty value of each entry of `samples`: what the layers add up to.
        """

    @property
    def display_variance(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """
        (height * width,): squared standard error of the displayed value (sRGB, 0 to 1) of the mean
        of a pixel's covered samples, estimated.
        """

class Tracer:
    """
    A scene made ready for tracing. Same arguments give the same bits on any number of threads.
    """

    def __init__(self, scene: Scene, options: TracerOptions = ...) -> None:
        """
        Copies the scene, builds the acceleration structure and, with IndirectLight.cached, gathers
        the cache.
        """

    @property
    def scene(self) -> Scene: ...

    def with_parts(self, object: int, parts: Sequence[int], part_names: Sequence[str], part_materials: Sequence[int]) -> Tracer:
        """
        The same scene with an object cut into other parts, `parts` giving that of every triangle; what
        was gathered is kept, so this is much faster than a new tracer. No triangle may change its material.
        """

    def trace_beauty(self, camera: Camera, options: TraceOptions = ...) -> NDArray[numpy.float32]:
        """Image of everything: (height, width, 3) float32 radiance."""

    def trace_beauty_to_noise(self, camera: Camera, noise: float, options: TraceOptions = ...) -> BeautyTrace:
        """
        The same with as many samples as each tile of 16² pixels needs for a relative standard error
        of `noise`, at most options.samples_per_pixel.
        """

    @overload
    def trace_layers(self, camera: Camera, reflector: int, options: TraceOptions = ...) -> LayerTrace:
        """Layers of object number `reflector`, whose material must be specular."""

    @overload
    def trace_layers(self, camera: Camera, reflectors: Sequence[int], options: TraceOptions = ...) -> list[LayerTrace]:
        """
        Layers of several reflectors, which share the rays from the eye: one LayerTrace each, as
        trace_layers gives.
        """

    def trace_visibility(self, camera: Camera, reflector: int, options: TraceOptions = ..., places: Sequence[Sequence[float]] = ()) -> SurfaceSamples:
        """
        Only the geometry of `reflector`, by the same camera rays as trace_layers with the same
        options. With `places` (x, y in [0, 1) from the pixel's top left corner) the rays go through those places
        of every pixel instead, as a renderer's lookups do (RunTimeModel.places).
        """

    def capture(self, origin: Sequence[float], projection: str, width: int, height: int, hidden: Sequence[int] = ..., options: TraceOptions = ...) -> NDArray[numpy.float32]:
        """
        The radiance that arrives at `origin` in any projection, (faces, height, width, 3) or, of
        one face, (height, width, 3): what EnvMap.from_array takes. The rays go straight through the texels of
        the projection and pass through the objects in `hidden`, whose shadows and reflections on other things
        remain.
        """

    def capture_cube(self, origin: Sequence[float], size: int, hidden: Sequence[int] = ..., options: TraceOptions = ...) -> NDArray[numpy.float32]:
        """
        Cube map (6, size, size, 3) of the radiance that arrives at `origin`, the rays passing
        through the objects in `hidden`, whose shadows and reflections on other things remain.
        """

    def intersect(self, origins: NDArray[numpy.float32], directions: NDArray[numpy.float32], hidden: Sequence[int] = ...) -> tuple[NDArray[numpy.float32], NDArray[numpy.int32], NDArray[numpy.float32]]:
        """
        First hits of rays, arrays of shape (n, 3), through the objects in `hidden`. Returns the
        distance in metres (n,), inf for a miss; the object (n,), -1 for a miss or a light; the geometric normal
        (n, 3).
        """

    def intersect_distance(self, origins: NDArray[numpy.float32], directions: NDArray[numpy.float32], hidden: Sequence[int] = ...) -> tuple[NDArray[numpy.float32], NDArray[numpy.int32]]:
        """Distance and object of `intersect` alone, which is faster."""

    def vertex_irradiance(self, object: int, rays: int = ..., seed: int = ..., side: Literal['front', 'back'] = ...) -> NDArray[numpy.float32]:
        """
        Irradiance on one side of an object at every vertex, (vertices, 3), all light included.
        """

    def surface_irradiance(self, object: int, triangles: NDArray[numpy.uint32], barycentric: NDArray[numpy.float32], rays: int = ..., seed: int = ..., side: Literal['front', 'back'] = ...) -> NDArray[numpy.float32]:
        """
        The same at points of an object's surface, (n, 3): triangles (n,) and the weights (n, 2) of
        their second and third vertex.
        """

def points_from_directions(projection: str, directions: NDArray[numpy.float32]) -> tuple[NDArray[numpy.int32], NDArray[numpy.float32]]:
    """
    Faces (n) and positions (n, 2), x to the right and y up in [-1, 1], of directions (n, 3). Raises
    InvalidArgument for NaN, infinite and zero directions.
    """

def directions_from_points(projection: str, faces: Annotated[NDArray[numpy.int32], dict(shape=(None,), order='C', device='cpu', writable=False)], points: Annotated[NDArray[numpy.float32], dict(shape=(None, 2), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float32]:
    """
    Unit directions (n, 3) at positions (n, 2) of faces (n). Raises InvalidArgument for faces that
    do not exist and positions that are not finite.
    """

def texel_solid_angles(projection: str, width: int, height: int) -> NDArray[numpy.float64]:
    """
    Solid angles in steradians of the texels of a face, float64 of shape (height, width). Faces are
    alike.
    """

def face_count(projection: str) -> int:
    """Faces of a map: 6 of a cube, 2 of dual paraboloids, else 1."""

def natural_aspect(projection: str) -> int:
    """
    Width over height that makes texels roughly square: 2 of panoramas, else 1.
    """

def solid_angle_density(projection: str, face: int, x: float, y: float) -> float:
    """
    Solid angle per unit of area of (x, y) at a position of a face, in steradians.
    """

def dual_paraboloid_texture_matrix(frame_from_map: Annotated[NDArray[numpy.float32], dict(shape=(3, 3), order='C', device='cpu', writable=False)], face: int) -> NDArray[numpy.float32]:
    """
    The 4x4 texture matrix of [EMT] eq. 9-12 for the front (0) or back (1) map: applied to (r, 1) it
    gives (s q, t q, ., q), t downwards.
    """

class EnvMapLayout:
    """
    Order of the values of an environment map: levels, faces, rows, columns, channels.
    """

    def __init__(self, projection: str, width: int, height: int, levels: int = 1, channels: int = 3) -> None: ...

    def __repr__(self) -> str: ...

    def __eq__(self, other: object, /) -> bool: ...

    def __getstate__(self) -> tuple[str, int, int, int, int]: ...

    def __setstate__(self, arg: tuple[str, int, int, int, int], /) -> None: ...

    @property
    def projection(self) -> str:
        """Name of the projection."""

    @property
    def width(self) -> int:
        """Texels of a face of the finest level."""

    @property
    def height(self) -> int:
        """Texels of a face of the finest level."""

    @property
    def levels(self) -> int:
        """Number of levels, counted from the finest."""

    @property
    def channels(self) -> int:
        """Values per texel."""

    @property
    def faces(self) -> int:
        """Number of faces."""

    @property
    def size(self) -> int:
        """Number of values."""

    def level_width(self, level: int) -> int:
        """Texels of a face of a level."""

    def level_height(self, level: int) -> int:
        """Texels of a face of a level."""

    def level_offset(self, level: int) -> int:
        """Index of the first value of a level."""

def full_level_count(width: int, height: int) -> int:
    """Number of levels down to 1x1."""

def integrate(layout: EnvMapLayout, values: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], level: int = 0) -> list[float]:
    """Sum of value times solid angle over the sphere, per channel."""

def half_from_float(layout: EnvMapLayout, values: NDArray[numpy.float32]) -> tuple[NDArray[numpy.uint16], int]:
    """
    The bits of all values as IEEE 754 binary16, and how many were clamped to 65504.
    """

class Resampler:
    """Resamples maps of one layout, and keeps what every texel is made from."""

    def __init__(self, source: EnvMapLayout, projection: str, width: int, height: int, filter: Literal['automatic', 'area', 'bilinear', 'nearest'], source_from_target: Annotated[NDArray[numpy.float32], dict(shape=(3, 3), order='C', device='cpu', writable=False)], max_bytes: int) -> None: ...

    def apply(self, layout: EnvMapLayout, values: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], result: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu')]) -> None:
        """
        Writes the finest level of a map in the other projection and size into all of `result`.
        """

    def layout(self, channels: int) -> EnvMapLayout:
        """Layout of the result for so many channels."""

    @property
    def bytes(self) -> int:
        """Memory of what is kept."""

def build_mips(layout: EnvMapLayout, values: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], filter: Literal['box', 'solid_angle', 'seamless']) -> NDArray[numpy.float32]:
    """All levels from the finest: box, solid_angle or seamless."""

def measure_seam(layout: EnvMapLayout, values: NDArray[numpy.float32], level: int) -> tuple[float, float]:
    """
    Largest steps between neighbouring texels: across the edges of faces, and inside of faces.
    """

def add_border(layout: EnvMapLayout, values: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], level: int, border: int) -> NDArray[numpy.float32]:
    """
    Faces of a level with a border of their neighbours' texels: (faces, height, width, channels).
    """

def sample(layout: EnvMapLayout, values: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], directions: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], ddx: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)] | None = None, ddy: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)] | None = None, filter: Literal['nearest', 'bilinear', 'trilinear', 'ewa'] = 'bilinear', level: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)] | None = None, bias: float = 0.0, max_anisotropy: float = 16.0) -> NDArray[numpy.float32]:
    """
    Values in directions (n, 3): nearest, bilinear, trilinear or ewa, the last two with
    differentials (n, 3), or trilinear at levels, one or n of them.
    """

def quad_differentials(directions: NDArray[numpy.float32]) -> tuple[NDArray[numpy.float32], NDArray[numpy.float32]]:
    """
    Differences within quads of 2x2 pixels of an image of directions (height, width, 3): two arrays
    (height * width, 3).
    """

def footprint_from_corners(top_left: Sequence[float], top_right: Sequence[float], bottom_right: Sequence[float], bottom_left: Sequence[float]) -> tuple:
    """
    Direction and differentials of the reflection cone through a pixel's corners.
    """

def reflected_differential(direction: Sequence[float], normal: Sequence[float], dd: Sequence[float], dn: Sequence[float]) -> Sequence[float]:
    """Differential of the mirror direction of a ray (Igehy 1999)."""

def convert_convention(layout: EnvMapLayout, values: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], name: str, way: Literal['from_foreign', 'to_foreign']) -> NDArray[numpy.float32]:
    """
    The map in, or from, the orientation of openexr, oiio, mitsuba, threejs or ktx2.
    """

def load_envmap(path: str | os.PathLike[str], projection: str | None = None, faces: Literal['automatic', 'strip', 'column', 'grid', 'cross', 'vertical_cross', 'files'] = 'automatic', layer: str = '', part: str = '', repair: bool = False) -> tuple[EnvMapLayout, NDArray[numpy.float32], list[str], int]:
    """
    Layout, values and names of the channels of a map in an image, KTX2 or DDS file, and how many values
    are NaN or infinite there, which `repair` fills from their surroundings.
    """

def load_panorama(path: str | os.PathLike[str], layer: str = '', part: str = '', repair: bool = False) -> tuple[NDArray[numpy.float32], int, int]:
    """
    A map as light: a latlong of R, G and B, (height, width, 3), finite and nowhere below 0; how many
    values were negative in the file, and how many NaN or infinite. Cubes are recognised by their shape and
    resampled; alpha, depth and other channels are left out. `layer` and `part` choose in an EXR file. Raises
    FileError for a picture that is no panorama, and for values that are not finite unless `repair` fills
    them from their surroundings.
    """

def save_envmap(path: str | os.PathLike[str], layout: EnvMapLayout, values: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], channels: Sequence[str], faces: Literal['automatic', 'strip', 'column', 'grid', 'cross', 'vertical_cross', 'files'] = 'automatic', format: Literal['automatic', 'half', 'float32', 'uint8', 'uint16'] = 'automatic') -> SaveReport:
    """Write the finest level as an image, or all levels as KTX2 or DDS."""

def save_dds_bc6h(path: str | os.PathLike[str], layout: EnvMapLayout, blocks: bytes) -> None:
    """
    Write encoded blocks of a cube: all levels of a face, one face after the other.
    """

class Comparison:
    """How two maps differ, texels weighted by solid angle."""

    @property
    def max_error(self) -> float:
        """Largest difference."""

    @property
    def mean_error(self) -> float:
        """Mean difference over the sphere."""

    @property
    def rms_error(self) -> float:
        """Root of the mean squared difference."""

    @property
    def relative_l2(self) -> float:
        """RMS error over the RMS of the reference."""

    @property
    def psnr(self) -> float:
        """20 log10(largest value of the reference / RMS error), dB."""

    @property
    def flux_ratio(self) -> float:
        """Flux of the map over that of the reference."""

    @property
    def not_finite(self) -> int:
        """Number of NaN and infinite values, left out of the rest."""

    def __repr__(self) -> str: ...

def compare_envmaps(layout: EnvMapLayout, values: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], reference_layout: EnvMapLayout, reference: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)]) -> Comparison:
    """The finest level of a map against a reference."""

class CubePyramidLayout:
    """
    Order of the texels of a cube map with all its mip levels: the finest level first, in a level
    the six faces (+X -X +Y -Y +Z -Z), in a face the rows from the top.
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

    faces: float32 (6, N, N, C). Returns float32 (texels, C): every level is the mean of the finer one's 2x2
    texels weighted by their solid angles ([EMT] section 2.4).
    """

class MapProjection:
    """A projection in which the maps of a PEM can be kept."""

    @property
    def name(self) -> str:
        """In scene files and in PEMs."""

    @property
    def projection(self) -> str:
        """Of the EnvMap that such a map is."""

    @property
    def faces(self) -> int: ...

    @property
    def faces_in_a_row(self) -> int:
        """Of a level in the images of the web format."""

    @property
    def order(self) -> str:
        """Of the faces, and of their texels, in words."""

    def __repr__(self) -> str: ...

def map_projections() -> dict[str, MapProjection]:
    """
    The projections in which the maps of a PEM can be kept, by the names that scene files have for them.
    """

class TexelTopology:
    """
    How the texels of a map with mip levels lie to each other. Numbered as the
    values of an EnvMap are: levels from the finest, in a level the faces, in a face the rows from the top.
    """

    def __init__(self, arg: CubePyramidLayout, /) -> None: ...

    @staticmethod
    def of(projection: MapProjection, size: int) -> TexelTopology:
        """Of a map kept in a projection; a power of two, 1 to 16384."""

    @staticmethod
    def cube(size: int) -> TexelTopology:
        """Six faces; a power of two, 1 to 16384."""

    @staticmethod
    def dual_paraboloid(size: int) -> TexelTopology:
        """Two faces, front first; a power of two, 1 to 16384."""

    @staticmethod
    def atlas(width: int, height: int) -> TexelTopology:
        """One sheet on texture coordinates; powers of two, 1 to 16384."""

    @property
    def texels(self) -> int:
        """Number of texels of all levels."""

    @property
    def levels(self) -> int: ...

    @property
    def faces(self) -> int: ...

    def level_offset(self, level: int) -> int:
        """Index of a level's first texel."""

    def width(self, level: int = 0) -> int:
        """Texels of a face of a level."""

    def height(self, level: int = 0) -> int:
        """Texels of a face of a level."""

    def __repr__(self) -> str: ...

    def __eq__(self, other: object, /) -> bool: ...

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
    def row_samples(self) -> NDArray[numpy.uint32]:
        """uint32 (rows,): how many samples of the pixel see the part."""

    def row_means(self, values: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float32]:
        """
        Mean of per-sample values, float32 (samples, C), over each row's samples: float32 (rows, C).
        """

    def multiply(self, x: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float32]:
        """b = A x for x float32 (columns, C): float32 (rows, C)."""

def build_rendering_matrix(samples: SurfaceSamples, part: int, proxy: Proxy, topology: TexelTopology | CubePyramidLayout, run_time: RunTimeModel = ..., triangles: numpy.typing.NDArray[numpy.uint8] | None = None) -> RenderingMatrix:
    """
    Rendering matrix of the samples that lie on `part` ([PEM] section 4), built from their lookups.
    `triangles`: uint8, 0 for each triangle of the reflector whose samples are left out; None: all count.
    """

def display_row_weights(matrix: RenderingMatrix, samples_per_pixel: int, target: Annotated[NDArray[numpy.float32], dict(shape=(None, None), order='C', device='cpu', writable=False)], pixel_samples: Sequence[int] = []) -> NDArray[numpy.float32]:
    """
    Row weights for a target that will be looked at on a display: coverage / (1 + luminance)^2,
    float32 (rows, C). `pixel_samples` as SurfaceSamples has it stands in for samples_per_pixel.
    """

class SolveOptions:
    """Weights of the regulariser and when to stop."""

    def __init__(self, *, smoothness: float = 0.001, level_agreement: float = 0.001, prior_weight: float = 0.001, tolerance: float = 0.001, max_iterations: int = 600) -> None: ...

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

    def __repr__(self) -> str: ...

    def __getstate__(self) -> dict: ...

    def __setstate__(self, arg: dict, /) -> None: ...

SOLVE_WEIGHTS: tuple = ('smoothness', 'level_agreement', 'prior_weight')

class SolveReport:
    """What a solve did."""

    @property
    def iterations(self) -> int: ...

    @property
    def rounds(self) -> int:
        """Of the active set that keeps the map within its bounds."""

    @property
    def converged(self) -> bool:
        """The gradient met the tolerance, and the bounds are settled."""

    @property
    def relative_gradient(self) -> float:
        """What `tolerance` is compared with."""

    @property
    def unknowns(self) -> int:
        """Texels that some row sees."""

    @property
    def rms_error(self) -> float:
        """Weighted root mean square of A x - b."""

    def __repr__(self) -> str: ...

class MapSolver:
    """
    Regularised least squares for the maps of one or several nodes, seen by one or
    several views ([PEM] section 4): what all solves share is computed once.
    """

    def __init__(self, views: Sequence[tuple[RenderingMatrix, Sequence[tuple[int, float]]]], maps: Sequence[TexelTopology | CubePyramidLayout], nodes: int = 1, options: SolveOptions = ...) -> None:
        """
        views: matrices, each with the nodes whose maps it sees and their weights in the blend: [(0,
        1.0)] for the only one. maps: those of a node, stacked as the columns are.
        """

    def solve(self, targets: Sequence[numpy.typing.NDArray[numpy.float32]], row_weights: Sequence[numpy.typing.NDArray[numpy.float32]], prior: numpy.typing.NDArray[numpy.float32] | None = None, initial: numpy.typing.NDArray[numpy.float32] | None = None) -> tuple[numpy.typing.NDArray[numpy.float32], SolveReport]:
        """
        Solves for the maps.

        targets, row_weights: of each view, float32 (rows, C), 1 to 4 channels, the fourth is coverage. prior,
        initial: float32 (nodes * texels, C). Returns the maps, float32 (nodes * texels, C), within [0, inf)
        (coverage in [0, 1]), and a report.
        """

class ViewTargets:
    """
    What maps should make a view look like: sums over traced samples, pixel by pixel, so that a view
    of many samples never has to be in memory at once.
    """

    def __init__(self, width: int, height: int, parts: int, shells: int, stacks: Sequence[Sequence[int]] = []) -> None:
        """
        `stacks`: for each part, front to back, the number of the traced shell that each of its own
        shells ends with; empty: the traced ones.
        """

    def add(self, samples: SurfaceSamples, x: int = 0, y: int = 0) -> None:
        """
        Adds samples with traced light, at most one trace of every pixel; (x, y): where their
        image's top left pixel lies in this one.
        """

    @property
    def width(self) -> int: ...

    @property
    def height(self) -> int: ...

    @property
    def parts(self) -> int: ...

    @property
    def shells(self) -> int: ...

    @property
    def rejected(self) -> int:
        """
        Samples that were left out so far, since their light is NaN or infinite.
        """

class FitShell:
    """A shell as a part of the reflector sees it."""

    def __init__(self, proxy: Proxy, map: int, triangles: Annotated[NDArray[numpy.uint8], dict(shape=(None,), order='C', device='cpu', writable=False)] | None = None) -> None:
        """
        map: number of its map, which several parts may share. triangles: uint8, 0 for each triangle
        of the reflector that the shell leaves out, or None if it covers all.
        """

class DisplayView:
    """A traced view, as the run time will look up its maps."""

    def __init__(self, lookups: SurfaceSamples, targets: ViewTargets, nodes: Sequence[tuple[int, float]] = ((0, 1.0),), weight: float = 1.0, render: Callable[[numpy.typing.NDArray[numpy.float32]], numpy.typing.NDArray[numpy.float32]] | None = None, layer_rows: bool = True) -> None:
        """
        lookups: where the run time's lookups meet the reflector (Tracer.trace_visibility at
        RunTimeModel.places). nodes: whose maps are blended for the view, with their weights. weight: of its
        rows, >= 0. render: draws the view with the texels of all maps of a node, float32 (texels, 4), premultiplied
        radiance and alpha, all levels as given, and returns float32 (lookups, height, width, 4): the light that the
        object reflects, times coverage, and coverage, of each lookup of a pixel; the view's rows are then probed from
        such pictures. None: they are analytic. layer_rows: whether the rows of its layers, each by itself, stand
        beside its pixels'; else they only help to find alpha and where to start.
        """

class DisplayFitOptions:
    """How maps are fitted to displayed pixels."""

    def __init__(self, *, solve: SolveOptions = ..., layer_weight: float = 0.029999999329447746, softening: float = 0.029999999329447746, over_white: float = 0.10000000149011612, passes: int = 2) -> None: ...

    @property
    def solve(self) -> SolveOptions: ...

    @property
    def layer_weight(self) -> float:
        """Weight of the layers' own rows beside the pixels', >= 0."""

    @property
    def softening(self) -> float:
        """
        Below this radiance the derivative of the display's curve is held, in (0, 1].
        """

    @property
    def over_white(self) -> float:
        """
        Of that derivative, the share kept where target and image are over white, in (0, 1].
        """

    @property
    def passes(self) -> int:
        """
        How often the rows' weights are taken from the model's own image, 1 to 16.
        """

class ProbingReport:
    """What probing the views of a fit took and left."""

    @property
    def renderings(self) -> int:
        """Pictures that were asked for."""

    @property
    def most_of_a_map(self) -> int:
        """The most that one map of a view took at a time."""

    @property
    def unresolved(self) -> int:
        """Pixels that see the object and are left out, since they have no row."""

    def __repr__(self) -> str: ...

def fit_display(views: Sequence[DisplayView], parts: Sequence[Sequence[FitShell]], maps: Sequence[TexelTopology], nodes: int = 1, run_time: RunTimeModel = ..., options: DisplayFitOptions = ..., prior: numpy.typing.NDArray[numpy.float32] | None = None) -> tuple[numpy.typing.NDArray[numpy.float32], list[SolveReport], ProbingReport]:
    """
    Infers the maps of all shells and parts, of one or several nodes, together, from the pixels that
    the run time will show.

    parts: the shells of each part, front to back, in the order of the traced shells; the last is opaque.
    prior: float32 (nodes * texels, 3) or None. Returns the maps, float32 (nodes * texels, 4), premultiplied
    radiance and alpha, those of a node stacked in the order of `maps`; reports of the layers' own fit, then of
    each pass; and what probing the views that have a renderer took.
    """

class LayerInference:
    """Maps that were inferred from images of layers."""

    @property
    def maps(self) -> dict[str, NDArray[numpy.float32]]:
        """
        By name, float32 (texels, 3), or (texels, 4), premultiplied, with alpha. A new copy every time.
        """

    @property
    def report(self) -> SolveReport:
        """Of the solver's last pass."""

    @property
    def pixels(self) -> int:
        """To which the maps were fitted."""

    @property
    def rejected(self) -> int:
        """Pixels left out, since their light is not finite."""

    def __repr__(self) -> str: ...

def infer_from_layers(paths: Sequence[str | os.PathLike[str]], *, shells: Sequence[tuple[str, Proxy]] = (), map: TexelTopology = ..., run_time: RunTimeModel = ..., maps_per_part: bool = False, reflector: str = '', options: DisplayFitOptions = ...) -> LayerInference:
    """
    Infers maps from the images of layers that mb-trace writes. Use `mirrorbake.inference.infer_maps`.
    """

class ShellMap:
    """The map of one shell, as a part of the reflector reads it."""

    def __init__(self, proxy: Proxy, topology: TexelTopology | CubePyramidLayout, texels: numpy.typing.NDArray[numpy.float32], triangles: numpy.typing.NDArray[numpy.uint8] | None = None) -> None:
        """
        texels: float32 (texels, 4), premultiplied RGBA, or (texels, 3), opaque. triangles: uint8, 0
        for each triangle of the reflector that the shell leaves out, or None if it covers all.
        """

    @property
    def proxy(self) -> Proxy: ...

    @property
    def topology(self) -> TexelTopology: ...

    @property
    def texels(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """(texels, 3) or (texels, 4), read-only."""

    @property
    def triangles(self) -> Annotated[NDArray[numpy.uint8], dict(writable=False)] | None:
        """
        uint8, 0 for those that the shell leaves out, read-only; None: it covers all.
        """

def render_reflector(samples: SurfaceSamples, parts: Sequence[Sequence[ShellMap]], diffuse: numpy.typing.NDArray[numpy.float32] | None = None, run_time: RunTimeModel = ...) -> numpy.typing.NDArray[numpy.float32]:
    """
    Draws the reflector from its maps: (L0 + (1 - a0)(L1 + ...)) F + D per sample, averaged over the
    pixel.

    parts: the shells of each part, front to back. diffuse: float32 (len(samples), 3) or None for black.
    Returns float32 (H, W, 4): light times coverage, and coverage.
    """

def shell_light(samples: SurfaceSamples, map: ShellMap, run_time: RunTimeModel = ...) -> numpy.typing.NDArray[numpy.float32]:
    """
    What every sample reads of one shell's map, float32 (len(samples), 4): premultiplied light, not
    yet times F, and alpha, which is 0 where the shell leaves the sample's triangle out.
    """

def diffuse_from_irradiance(samples: SurfaceSamples, triangles: Annotated[NDArray[numpy.uint32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], vertex_irradiance: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], back_irradiance: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)] | None = None) -> NDArray[numpy.float32]:
    """
    Diffuse radiance of every sample, float32 (len(samples), 3), from irradiance baked per vertex
    (V, 3). Samples that see the back of a triangle take that of `back_irradiance`, if it is given.
    """

def diffuse_from_lightmap(samples: SurfaceSamples, triangles: Annotated[NDArray[numpy.uint32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], uvs: Annotated[NDArray[numpy.float32], dict(shape=(None, 2), order='C', device='cpu', writable=False)], size: int, lightmap: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], back_lightmap: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)] | None = None) -> NDArray[numpy.float32]:
    """
    The same from a lightmap: irradiance (size * size, 3) in texels on the texture coordinates (V, 2),
    rows from the top, v up, read bilinearly.
    """

class ProbedMatrix:
    """What `probe_rendering_matrix` found out about a renderer."""

    @property
    def matrix(self) -> RenderingMatrix:
        """RenderingMatrix whose rows sum to 1; it has no row_samples."""

    @property
    def scales(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """
        float32 (rows, 3): what a white map shows in each row's pixel, less what a black one does.
        """

    @property
    def errors(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """
        float32 (rows,): largest error of pictures of random texels, relative to the scale.
        """

    @property
    def renderings(self) -> int:
        """How many pictures were drawn."""

    @property
    def colours(self) -> int:
        """Groups of texels, no two of one group in any row."""

    @property
    def unresolved(self) -> int:
        """How many pixels see the map and have no row."""

def probe_rendering_matrix(topology: TexelTopology | CubePyramidLayout, render: Callable[[numpy.typing.NDArray[numpy.float32]], numpy.typing.NDArray[numpy.float32]], *, most_renderings: int = 64, step: float = 0.0, tolerance: float = 1e-4) -> ProbedMatrix:
    """
    Rendering matrix of a renderer of which only pictures are to be had ([PEM] section 4).

    topology: of the map. render: draws the view with the map's texels, float32 (texels, 3) in [0, 1], all levels as
    given, and returns float32 (height, width, 3), linear in the texels but for a constant: no tone mapping, no
    clamping. The channels may differ by a factor per pixel, such as Fresnel reflectance. most_renderings: 16 to 1024.
    step: between the values that the renderer can return, 0 for floats, 1/255 for eight bits. tolerance: rows that
    reproduce pictures of random texels worse than this, relative to their scale, are left out and counted.

    A map of 128 x 128 texels a face with all levels takes about 50 pictures: three colours of texels a picture, no two
    of one colour in any pixel. Raises ValueError for options out of range and pictures of changing size or with values
    that are not finite.
    """

class Lobe:
    """A radially symmetric lobe of weights."""

    def __init__(self, kind: Literal['lambert', 'phong', 'ggx', 'table'], parameter: float = 1.0, table: Sequence[float] = []) -> None:
        """
        lambert; phong (exponent); ggx (alpha); table (largest angle in degrees, weights at equal steps).
        """

    def weight(self, cosine: float) -> float:
        """Weight at an angle with this cosine."""

    @property
    def integral(self) -> float:
        """Integral of the weight over the sphere, steradians."""

    @property
    def is_mirror(self) -> bool:
        """Whether it is a single direction."""

def alpha_from_exponent(exponent: float) -> float:
    """Alpha of the microfacets whose highlight is as wide as Phong's."""

def exponent_from_alpha(alpha: float) -> float:
    """
    Phong's exponent whose highlight is as wide as that of the microfacets.
    """

class Convolver:
    """Convolves one map with any number of lobes."""

    def __init__(self, layout: EnvMapLayout, values: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)]) -> None: ...

    def apply(self, lobe: Lobe, projection: str, width: int, height: int, scale: Literal['mean', 'sum'], progress: Callable[[float], None] | None = None) -> tuple[EnvMapLayout, NDArray[numpy.float32]]:
        """Layout and values of the map, by the direction of the lobe's axis."""

    def sample(self, lobe: Lobe, directions: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], scale: Literal['mean', 'sum'], channels: int) -> NDArray[numpy.float32]:
        """Values (n, channels) for lobes about unit directions (n, 3)."""

def ggx_chain(layout: EnvMapLayout, values: NDArray[numpy.float32], size: int, levels: int, roughness: Literal['squared', 'linear'], progress: Callable[[int, int], None] | None = None) -> tuple[EnvMapLayout, NDArray[numpy.float32]]:
    """A cube whose levels are prefiltered with GGX of rising alpha."""

def chain_alpha(level: int, levels: int, roughness: Literal['squared', 'linear']) -> float:
    """Alpha of a level of a chain."""

def project_harmonics(layout: EnvMapLayout, values: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], order: int) -> NDArray[numpy.float64]:
    """Coefficients ((order + 1)^2, channels) of the finest level."""

def harmonic_basis(directions: Annotated[NDArray[numpy.float32], dict(shape=(None, 3), order='C', device='cpu', writable=False)], order: int) -> NDArray[numpy.float64]:
    """Values (n, (order + 1)^2) of all functions in unit directions (n, 3)."""

def lambert_factor(band: int) -> float:
    """What a cosine lobe multiplies a band by."""

def lambert_harmonics(radiance: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float64]:
    """Coefficients of irradiance from those of radiance."""

def window_harmonics(coefficients: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)], window: Literal['none', 'hanning', 'sloan']) -> NDArray[numpy.float64]:
    """Coefficients damped against ringing."""

def evaluate_harmonics(coefficients: NDArray[numpy.float64], projection: str, width: int, height: int, negative: Literal['clamp', 'keep']) -> tuple[EnvMapLayout, NDArray[numpy.float32]]:
    """Layout and values of the map of the sums."""

def harmonic_constants(radiance: Annotated[NDArray[numpy.float64], dict(shape=(None, None), order='C', device='cpu', writable=False)]) -> NDArray[numpy.float64]:
    """
    Nine constants (9, channels) of E/pi for a shader, in Filament's order.
    """

def split_sum(cosine: float, alpha: float) -> tuple[float, float]:
    """Scale and bias of the reflectance at normal incidence."""

def split_sum_table(size: int, roughness: Literal['squared', 'linear']) -> NDArray[numpy.float32]:
    """Scale, bias and their sum (roughness, n.v, 3)."""

def lens_directions(lens: Literal['perspective', 'fisheye'], width: int, height: int, field_of_view: float) -> NDArray[numpy.float64]:
    """
    Directions (height, width, 3) of the pixels of a camera; NaN beyond the disc of a fisheye.
    """

def background(layout: EnvMapLayout, values: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], directions: Annotated[NDArray[numpy.float64], dict(shape=(None, None, 3), order='C', device='cpu', writable=False)], world_from_camera: Annotated[NDArray[numpy.float64], dict(shape=(3, 3), order='C', device='cpu', writable=False)], world_from_camera_end: Annotated[NDArray[numpy.float64], dict(shape=(3, 3), order='C', device='cpu', writable=False)], steps: int) -> NDArray[numpy.float32]:
    """Picture (height, width, channels) of what a camera that turns sees."""

@overload
def fresnel_schlick(c: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], r0: float, f: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu')]) -> None: ...

@overload
def fresnel_schlick(c: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], r0: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], f: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu')]) -> None: ...

@overload
def fresnel_schlick(c: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], r0: float, f: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None: ...

@overload
def fresnel_schlick(c: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], r0: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], f: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None: ...

@overload
def fresnel_dielectric(c: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], ior: float, f: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu')]) -> None: ...

@overload
def fresnel_dielectric(c: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], ior: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], f: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu')]) -> None: ...

@overload
def fresnel_dielectric(c: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], ior: float, f: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None: ...

@overload
def fresnel_dielectric(c: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], ior: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], f: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None: ...

@overload
def fresnel_conductor(c: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], eta: float, k: float, f: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu')]) -> None: ...

@overload
def fresnel_conductor(c: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], eta: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], k: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], f: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu')]) -> None: ...

@overload
def fresnel_conductor(c: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], eta: float, k: float, f: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None: ...

@overload
def fresnel_conductor(c: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], eta: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], k: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], f: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None: ...

def fresnel_dielectric_transmittance(c: float, ior: float) -> float:
    """1 − F without cancellation."""

class FresnelTable:
    """Reflectance at equal steps of the cosine, interpolated linearly."""

    @property
    def values(self) -> Annotated[NDArray[numpy.float32], dict(writable=False)]:
        """float32 (size,): reflectance at c = 0, 1/(size − 1), …, 1."""

    @property
    def max_error(self) -> float:
        """Largest deviation from the exact curve."""

    @overload
    def evaluate(self, c: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu', writable=False)], f: Annotated[NDArray[numpy.float32], dict(order='C', device='cpu')]) -> None: ...

    @overload
    def evaluate(self, c: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], f: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu')]) -> None:
        """Fills `f` with interpolated reflectance."""

def make_fresnel_table(model: Literal['constant', 'schlick', 'dielectric', 'conductor'], first: float, k: float, size: int) -> FresnelTable:
    """
    first: r0, relative index or eta, as the model has it; k for conductors.
    """

def fresnel_table_for_error(model: Literal['constant', 'schlick', 'dielectric', 'conductor'], first: float, k: float, max_error: float) -> FresnelTable: ...

def metal_names() -> list[str]:
    """Names of the metals with measured optical constants."""

def metal_source(metal: str) -> str:
    """Publication of the metal's optical constants."""

def metal_optical_constants(metal: str) -> NDArray[numpy.float64]:
    """float64 (n, 3): wavelength in nm, eta, k."""

def metal_reflectance(metal: str, c: Annotated[NDArray[numpy.float64], dict(order='C', device='cpu', writable=False)], illuminant: Literal['D65', 'E']) -> NDArray[numpy.float64]:
    """float64 (c.size, 3): linear Rec.709."""

class MetalFit:
    """
    Three-channel models of a metal, and their largest error over all angles.
    """

    @property
    def r0(self) -> tuple[float, float, float]:
        """of Schlick's model"""

    @property
    def r0_error(self) -> tuple[float, float, float]: ...

    @property
    def eta(self) -> tuple[float, float, float]:
        """of the conductor"""

    @property
    def k(self) -> tuple[float, float, float]:
        """of the conductor"""

    @property
    def index_error(self) -> tuple[float, float, float]: ...

def fit_metal(metal: str, illuminant: Literal['D65', 'E']) -> MetalFit: ...

def active_isa() -> str:
    """Instruction set in use: 'baseline', 'sse42', 'avx2' or 'avx512'."""

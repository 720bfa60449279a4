"""Drawing the reflector from maps, in software: the PEM at any parameter, and static maps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.errors import StoreError
from mirrorbake.pem.pyramid import pyramid_of, topology_of
from mirrorbake.proxy import proxy_from_attributes
from mirrorbake.scene.config_axes import arranged
from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.body_light import BodyLight
    from mirrorbake.pem.header import Header
    from mirrorbake.pem.store import PemStore
    from mirrorbake.scene.parameters import PointLike
    from mirrorbake.scene.pose import Pose


def blended(shares: Sequence[tuple[FloatArray, float]]) -> FloatArray:
    """Return the weighted sum of arrays of one shape; an array of weight 1 alone comes out as it is."""
    first, weight = shares[0]
    if len(shares) == 1 and weight == 1.0:
        return first
    total = np.float32(weight) * first
    for values, weight in shares[1:]:
        total += np.float32(weight) * values
    return total


def lookups_of(footprint_scale: float) -> _core.RunTimeModel:
    """Return the run time that PEMs are inferred for and drawn by: one isotropic lookup per traced sample."""
    return _core.RunTimeModel(
        name="traced samples",
        places=_core.run_time_model("Reference").places,
        footprint_scale=footprint_scale,
        filter="trilinear",
    )


def model_of(run_time: Mapping[str, Any]) -> _core.RunTimeModel:
    """Return the run time that a PEM's attributes name."""
    if run_time["name"] == TRACED_SAMPLES:
        return lookups_of(run_time["footprint_scale"])
    return _core.run_time_model(run_time["name"])


def fade_weight(degrees: float, away: float) -> float:
    """Return how much of a PEM is drawn in a view beyond its samples; the rest is its static set.

    1 / (1 + (δ/δ₀)²), which is 1 on the samples and ½ at δ₀.

    Parameters
    ----------
    degrees
        δ₀, of the header's `static["fade"]`.
    away
        δ, degrees between the eye and the nearest place of the samples' cameras, seen from their centre.

    Examples
    --------
    >>> fade_weight(4.0, 0.0), fade_weight(4.0, 4.0)
    (1.0, 0.5)
    """
    return 1.0 / (1.0 + (away / degrees) ** 2)


def shell_maps(
    header: Header,
    read: Callable[[str, str], FloatArray],
    pose: Pose,
    local_triangles: NDArray[np.uint8] | None,
) -> list[list[_core.ShellMap]]:
    """Return the shells of all parts, to be drawn; `read(part, shell)` gives the texels of a map."""
    return [
        [
            _core.ShellMap(
                shell.proxy_at(pose),
                topology_of(header.projection, shell.size),
                read(part.name, shell.name),
                local_triangles if shell.polygons == "off hull" else None,
            )
            for shell in part.shells
        ]
        for part in header.parts
    ]


TRACED_SAMPLES = "reference"
"""Name of the run time that reads maps once for every traced sample."""


@dataclass
class RunTime:
    """A PEM opened for drawing.

    The maps of the last blend are kept in memory, so that walking along an axis reads each sample once.
    """

    store: PemStore
    body: BodyLight
    """How the light of the reflector's body is read."""
    remap: Callable[[FloatArray], FloatArray] | None = None
    """What a map (texels, C) of a view becomes before it is drawn; None: it stays as it is stored."""

    def __post_init__(self) -> None:
        self._header: Header = self.store.header
        self._topology = self._header.topology
        self._options = model_of(self._header.run_time)
        self._config = parse_config(self._header.source.config, str(self.store.location))
        self._irradiance = self.store.read_irradiance()
        self._local_triangles = self.store.read_local_triangles()
        self._static = pyramid_of(self.store.read_capture(), self._header.projection)
        self._views: dict[int, dict[tuple[str, str], FloatArray]] = {}
        self._static_maps = self._read_static_maps()

    @property
    def model(self) -> _core.RunTimeModel:
        """How the maps were read when they were inferred."""
        return self._options

    @property
    def places(self) -> Sequence[Sequence[float]]:
        """Where in a pixel the model reads; none for one that reads at the traced samples."""
        return () if self._header.run_time["name"] == TRACED_SAMPLES else self._options.places

    @property
    def has_static_set(self) -> bool:
        """Whether there are maps for views far from all samples."""
        return self._static_maps is not None

    @property
    def has_static_proxy(self) -> bool:
        """Whether the static map on the distant layer's geometry is a contender: it is not at infinity."""
        return self._header.static["proxy"] is not None

    def render(
        self,
        contender: str,
        point: PointLike,
        samples: _core.SurfaceSamples,
        model: _core.RunTimeModel | None = None,
        away: float = 0.0,
    ) -> FloatArray:
        """Draw the reflector.

        Parameters
        ----------
        contender
            `pem`, `static_set`, `static_infinite` or `static_proxy`.
        point
            Of the parameter space; between nodes the PEM blends their maps by multilinear weights.
        samples
            Where the camera of the point sees the reflector, at the places of the run time.
        model
            How maps are read; None: as they were when they were inferred.
        away
            Degrees from the eye to the cameras of the space (`Cameras.degrees_outside`): the PEM fades to its
            static set, if it has one.

        Returns
        -------
        array
            Radiance (H, W, 3), the mean over the samples that see the reflector; 0 where there are none.
        """
        return self.render_parts(self.parts_of(contender, point, away), samples, point, model)

    def parts_of(self, contender: str, point: PointLike, away: float = 0.0) -> list[list[_core.ShellMap]]:
        """Return the shells of all parts as `render` draws them: front to back, blended, where they are."""
        if contender == "pem":
            return self._pem_parts(point, away)
        if contender == "static_set":
            return self._shells(self._static_texels, point)
        return self._static_parts("infinite" if contender == "static_infinite" else "proxy")

    def render_parts(
        self,
        parts: list[list[_core.ShellMap]],
        samples: _core.SurfaceSamples,
        point: PointLike,
        model: _core.RunTimeModel | None = None,
    ) -> FloatArray:
        """Draw the reflector from maps of each part, with the diffuse layer of a point; as `render`."""
        diffuse = self.diffuse_at(samples, point)
        image = _core.render_reflector(samples, parts, diffuse, model or self._options)
        coverage = image[..., 3:]
        return np.divide(image[..., :3], coverage, out=np.zeros_like(image[..., :3]), where=coverage > 0.0)

    def diffuse_at(self, samples: _core.SurfaceSamples, point: PointLike) -> FloatArray | None:
        """Return the radiance (n, 3) that the body of samples reflects and emits; None without that layer."""
        irradiance = self._irradiance_at(point)
        if irradiance is None:
            return None
        return self.body.radiance(samples, irradiance)

    def _pem_parts(self, point: PointLike, away: float) -> list[list[_core.ShellMap]]:
        blend = self._header.space.neighbours(point)
        self._views = {i: self._views.get(i) or self._read_view(i) for i, _ in blend}
        fade = self._header.static["fade"]
        share = 1.0 if fade is None else fade_weight(fade["degrees"], away)

        def read(part: str, shell: str) -> FloatArray:
            shares = [(self._views[i][part, shell], share * weight) for i, weight in blend]
            if share < 1.0:
                shares.append((self._static_texels(part, shell), 1.0 - share))
            return blended(shares)

        return self._shells(read, point)

    def _shells(self, read: Callable[[str, str], FloatArray], point: PointLike) -> list[list[_core.ShellMap]]:
        return shell_maps(self._header, read, self._pose_at(point), self._local_triangles)

    def _static_texels(self, part: str, shell: str) -> FloatArray:
        if self._static_maps is None:
            raise StoreError(f"{self.store.location}: has no static set")
        return self._static_maps[part, shell]

    def _read_static_maps(self) -> dict[tuple[str, str], FloatArray] | None:
        stored = self.store.read_static_maps()
        if stored is None:
            return None
        found = {}
        for name in self._header.map_names():
            number = self._header.map_of(*name)
            texels = np.ascontiguousarray(stored[number][:, : self._header.maps[number].channels])
            found[name] = texels if self.remap is None else self.remap(texels)
        return found

    def _pose_at(self, point: PointLike) -> Pose:
        space = self._header.space
        return arranged(self._config, space.scene_coordinates(space.point(point))).pose

    def _irradiance_at(self, point: PointLike) -> FloatArray | None:
        if self.store.has_irradiance_per_sample and self._irradiance is not None:
            shares = []
            for index, weight in self._header.space.neighbours(point):
                values = self.store.read_irradiance(index)
                assert values is not None
                shares.append((values, weight))
            return blended(shares)
        return self._irradiance

    def _read_view(self, index: int) -> dict[tuple[str, str], FloatArray]:
        maps = {name: self.store.read_map(*name, index) for name in self._header.map_names()}
        return maps if self.remap is None else {name: self.remap(texels) for name, texels in maps.items()}

    def _static_parts(self, shape: str) -> list[list[_core.ShellMap]]:
        proxy = proxy_from_attributes(self._header.static[shape])
        return [[_core.ShellMap(proxy, self._topology, self._static)] for _ in self._header.parts]

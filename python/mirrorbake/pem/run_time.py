"""Drawing the reflector from maps, in software: the PEM at any parameter, and static maps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core
from mirrorbake.proxy import proxy_from_attributes
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.pose import Pose

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.header import Header
    from mirrorbake.pem.shells import Part
    from mirrorbake.pem.store import PemStore
    from mirrorbake.scene.parameters import PointLike


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


TRACED_SAMPLES = "reference"
"""Name of the run time that reads maps once for every traced sample."""


@dataclass
class RunTime:
    """A PEM opened for drawing.

    The maps of the last blend are kept in memory, so that walking along an axis reads each sample once.
    """

    store: PemStore
    triangles: NDArray[np.uint32]
    """(T, 3) of the reflector."""
    remap: Callable[[FloatArray], FloatArray] | None = None
    """What a map (texels, C) of a view becomes before it is drawn; None: it stays as it is stored."""

    def __post_init__(self) -> None:
        self._header: Header = self.store.header
        self._layout = _core.CubePyramidLayout(self._header.map_size)
        self._options = model_of(self._header.run_time)
        self._config = parse_config(self._header.source.config, str(self.store.location))
        self._irradiance = self.store.read_irradiance()
        self._local_triangles = self.store.read_local_triangles()
        self._static = _core.build_cube_pyramid(self.store.read_capture())
        self._views: dict[int, dict[tuple[str, str], FloatArray]] = {}

    @property
    def model(self) -> _core.RunTimeModel:
        """How the maps were read when they were inferred."""
        return self._options

    @property
    def places(self) -> Sequence[Sequence[float]]:
        """Where in a pixel the model reads; none for one that reads at the traced samples."""
        return () if self._header.run_time["name"] == TRACED_SAMPLES else self._options.places

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
    ) -> FloatArray:
        """Draw the reflector.

        Parameters
        ----------
        contender
            `pem`, `static_infinite` or `static_proxy`.
        point
            Of the parameter space; between nodes the PEM blends their maps by multilinear weights.
        samples
            Where the camera of the point sees the reflector, at the places of the run time.
        model
            How maps are read; None: as they were when they were inferred.

        Returns
        -------
        array
            Radiance (H, W, 3), the mean over the samples that see the reflector; 0 where there are none.
        """
        if contender == "pem":
            parts = self._pem_parts(point)
        else:
            parts = self._static_parts("infinite" if contender == "static_infinite" else "proxy")
        return self.render_parts(parts, samples, point, model)

    def render_parts(
        self,
        parts: list[list[_core.ShellMap]],
        samples: _core.SurfaceSamples,
        point: PointLike,
        model: _core.RunTimeModel | None = None,
    ) -> FloatArray:
        """Draw the reflector from maps of each part, with the diffuse layer of a point; as `render`."""
        diffuse, irradiance = None, self._diffuse_at(point)
        if irradiance is not None:
            diffuse = _core.diffuse_from_irradiance(samples, self.triangles, irradiance)
        image = _core.render_reflector(samples, parts, diffuse, model or self._options)
        coverage = image[..., 3:]
        return np.divide(image[..., :3], coverage, out=np.zeros_like(image[..., :3]), where=coverage > 0.0)

    def _pem_parts(self, point: PointLike) -> list[list[_core.ShellMap]]:
        blend = self._header.space.neighbours(point)
        self._views = {i: self._views.get(i) or self._read_view(i) for i, _ in blend}
        pose = self._pose_at(point)
        return [self._part_maps(part, blend, pose) for part in self._header.parts]

    def _part_maps(self, part: Part, blend: list[tuple[int, float]], pose: Pose) -> list[_core.ShellMap]:
        shells = []
        for shell in part.shells:
            texels = blended([(self._views[i][part.name, shell.name], share) for i, share in blend])
            off_hull = self._local_triangles if shell.polygons == "off hull" else None
            shells.append(_core.ShellMap(shell.proxy_at(pose), self._layout, texels, off_hull))
        return shells

    def _pose_at(self, point: PointLike) -> Pose:
        space = self._header.space
        return Pose.of(self._config, space.scene_coordinates(space.point(point)).get("motion", 0.0))

    def _diffuse_at(self, point: PointLike) -> FloatArray | None:
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
        return [[_core.ShellMap(proxy, self._layout, self._static)] for _ in self._header.parts]

"""Drawing the reflector from maps, in software: the PEM at any parameter, and static maps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.proxy import proxy_from_attributes

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.pem.header import Header
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
        self._options = lookups_of(self._header.source.config["infer"]["footprint_scale"])
        self._irradiance = self.store.read_irradiance()
        self._local_triangles = self.store.read_local_triangles()
        self._static = _core.build_cube_pyramid(self.store.read_capture())
        self._views: dict[int, dict[tuple[str, str], FloatArray]] = {}

    @property
    def model(self) -> _core.RunTimeModel:
        """How the maps were read when they were inferred."""
        return self._options

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
            parts = self._pem_parts(self._header.space.neighbours(point))
        else:
            parts = self._static_parts("infinite" if contender == "static_infinite" else "proxy")
        return self.render_parts(parts, samples, model)

    def render_parts(
        self,
        parts: list[list[_core.ShellMap]],
        samples: _core.SurfaceSamples,
        model: _core.RunTimeModel | None = None,
    ) -> FloatArray:
        """Draw the reflector from maps of each part, with the PEM's diffuse layer; returns as `render`."""
        diffuse = None
        if self._irradiance is not None:
            diffuse = _core.diffuse_from_irradiance(samples, self.triangles, self._irradiance)
        image = _core.render_reflector(samples, parts, diffuse, model or self._options)
        coverage = image[..., 3:]
        return np.divide(image[..., :3], coverage, out=np.zeros_like(image[..., :3]), where=coverage > 0.0)

    def _pem_parts(self, blend: list[tuple[int, float]]) -> list[list[_core.ShellMap]]:
        self._views = {i: self._views.get(i) or self._read_view(i) for i, _ in blend}
        parts = []
        for part in self._header.parts:
            maps = {}
            for layer in part["layers"]:
                maps[layer] = blended([(self._views[i][part["name"], layer], share) for i, share in blend])
            distant = proxy_from_attributes(part["layers"]["distant"])
            shells = [_core.ShellMap(distant, self._layout, maps["distant"])]
            if "local" in maps:
                local = proxy_from_attributes(part["layers"]["local"])
                shells.insert(0, _core.ShellMap(local, self._layout, maps["local"], self._local_triangles))
            parts.append(shells)
        return parts

    def _read_view(self, index: int) -> dict[tuple[str, str], FloatArray]:
        maps = {name: self.store.read_map(*name, index) for name in self._header.map_names()}
        return maps if self.remap is None else {name: self.remap(texels) for name, texels in maps.items()}

    def _static_parts(self, shape: str) -> list[list[_core.ShellMap]]:
        proxy = proxy_from_attributes(self._header.static[shape])
        return [[_core.ShellMap(proxy, self._layout, self._static)] for _ in self._header.parts]

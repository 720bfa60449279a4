"""Which texels of a sample's maps are read near its view: all that a page needs of it."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core
from mirrorbake.scene.config_axes import arranged

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from mirrorbake.pem.opened import OpenedPem
    from mirrorbake.scene.parameters import Axis, ParameterSpace, Point

AROUND_DEGREES = 1.0
"""How far from a sample's view, to all sides, what is read belongs to it."""
REACH = 0.75
"""Of the way to the next nodes, as far as a sample's maps have a share worth keeping."""
LEAST_READ = 0.01
"""Pixels, in all views together: texels that are read less are left out."""


def texels_read(pem: OpenedPem, sample: int) -> list[NDArray[np.bool_]]:
    """Find the texels of each map, (texels,), that views on a sample and around it read.

    The views are those of points up to three quarters of the way to the next nodes along every axis, and
    those of eyes one degree to all sides of the sample's own.
    """
    header, stage = pem.store.header, pem.stage
    numbers = {entry.name: number for number, entry in enumerate(header.maps)}
    local = pem.store.read_local_triangles()
    config = stage.config
    topologies = header.topologies
    read = [np.zeros(topology.texels) for topology in topologies]
    for point, camera in _views(pem, sample):
        here = stage.at(point)
        pose = arranged(config, header.space.scene_coordinates(point)).pose
        seen = here.tracer.trace_visibility(camera, here.built.reflector, here.options, pem.run_time.places)
        for number, part in enumerate(header.parts):
            for shell in part.shells:
                its_map = numbers[shell.map]
                topology = topologies[its_map]
                off_hull = local if shell.polygons == "off hull" else None
                matrix = _core.build_rendering_matrix(
                    seen, number, shell.proxy_at(pose), topology, pem.run_time.model, off_hull
                )
                read[its_map] += np.bincount(matrix.texels, np.abs(matrix.weights), topology.texels)
    return [weights > LEAST_READ for weights in read]


def _views(pem: OpenedPem, sample: int) -> Iterator[tuple[Point, _core.Camera]]:
    space = pem.store.header.space
    own = space.sample(sample)
    for point in points_around(space, sample):
        yield point, pem.stage.at(point).built.cameras.camera(point)
    cameras = pem.stage.at(own).built.cameras
    azimuth, elevation = cameras.angles_of(cameras.eye(own))
    for aside, up in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        if abs(elevation + up * AROUND_DEGREES) < 90.0:
            yield own, cameras.around(azimuth + aside * AROUND_DEGREES, elevation + up * AROUND_DEGREES)


def points_around(space: ParameterSpace, sample: int) -> list[Point]:
    """Return a node's point and those around it at which its maps have a share; the node's own is the first.

    Examples
    --------
    >>> from mirrorbake.scene.parameters import Axis, ParameterSpace
    >>> points_around(ParameterSpace((Axis("arc", (0.0, 0.5, 1.0), 0.0, 1.0),)), 1)
    [(0.5,), (0.125,), (0.875,)]
    """
    places = zip(space.axes, space.places(sample), strict=True)
    along = [_coordinates(axis, place) for axis, place in places]
    return [space.point(point) for point in itertools.product(*along)]


def _coordinates(axis: Axis, place: int) -> list[float]:
    values, own = axis.values, axis.values[place]
    if len(values) == 1:
        # The same maps serve the whole axis.
        return list(dict.fromkeys([own, *np.linspace(axis.low, axis.high, 5).tolist()]))
    found = [own]
    for step in (-1, 1):
        turns, other = divmod(place + step, len(values))
        if turns == 0 or axis.period is not None:
            found.append(own + REACH * (values[other] + turns * (axis.period or 0.0) - own))
    return found

"""Other programs' coordinates, and how their cube maps and panoramas lie in them.

A program has a matrix `space_from_world` that takes our positions (right-handed, +Y up) to its own, as its
importer of glTF files does with the mesh, and `lookup_from_world`: a cube map is turned so that what the
graphics hardware reads with `lookup_from_world @ d` is what we read with d.

========== ========= ========= ====================================================================
name       space     lookup    source
========== ========= ========= ====================================================================
threejs    x, y, z   -x, y, z  its shaders look cube maps up with -x (`flipEnvMap`)
unity      -x, y, z  the same  left-handed, +Y up; glTFast and UnityGLTF negate x
unreal     x, z, y   the same  left-handed, +Z up; its importer swaps y and z
blender    x, -z, y  none      right-handed, +Z up; its importer turns by 90 degrees about x
godot      x, y, z   the same  right-handed, +Y up, as glTF
========== ========= ========= ====================================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from mirrorbake.arrays import FloatArray
    from mirrorbake.envmap import EnvMap

# Directions of the centre, the right and the bottom of every face in OpenGL, Direct3D and Vulkan.
_FACES = np.array(
    [
        [[1, 0, 0], [0, 0, -1], [0, -1, 0]],
        [[-1, 0, 0], [0, 0, 1], [0, -1, 0]],
        [[0, 1, 0], [1, 0, 0], [0, 0, 1]],
        [[0, -1, 0], [1, 0, 0], [0, 0, -1]],
        [[0, 0, 1], [1, 0, 0], [0, -1, 0]],
        [[0, 0, -1], [-1, 0, 0], [0, -1, 0]],
    ]
)


@dataclass(frozen=True)
class Frame:
    """How a program sees the world and its environment maps."""

    name: str
    lookup_from_world: tuple[tuple[int, int, int], ...]
    """Takes a direction of the world to the one with which the hardware reads the cube map."""
    space_from_world: tuple[tuple[int, int, int], ...]
    """Takes a position of the world to the program's, in metres."""
    panorama: tuple[str, str, str] | None = None
    """Directions of the *world* in the centre, at the right of the centre and at the top of its panoramas."""

    @property
    def lookup_matrix(self) -> NDArray[np.int64]:
        """`lookup_from_world` as an array (3, 3)."""
        return np.array(self.lookup_from_world)

    @property
    def space_matrix(self) -> NDArray[np.int64]:
        """`space_from_world` as an array (3, 3)."""
        return np.array(self.space_from_world)


_SAME = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
_MIRRORED = ((-1, 0, 0), (0, 1, 0), (0, 0, 1))
_SWAPPED = ((1, 0, 0), (0, 0, 1), (0, 1, 0))
_TURNED = ((1, 0, 0), (0, 0, -1), (0, 1, 0))

FRAMES: Mapping[str, Frame] = {
    frame.name: frame
    for frame in (
        Frame("threejs", _MIRRORED, _SAME),
        Frame("unity", _MIRRORED, _MIRRORED),
        # Its importer of long-lat images has -y of its own axes in the centre and +x at the right.
        Frame("unreal", _SWAPPED, _SWAPPED, ("-z", "+x", "+y")),
        # Cycles: u = 1/2 - atan2(y, x) / 2π of its own axes: +x in the centre, -y at the right.
        Frame("blender", _TURNED, _TURNED, ("+x", "+z", "+y")),
        Frame("godot", _SAME, _SAME),
    )
}


def turn_cube(level: FloatArray, lookup_from_world: NDArray[np.int64]) -> FloatArray:
    """The faces of a cube map in another order and turned, texel by texel: no value changes.

    Parameters
    ----------
    level
        Shape (6, s, s, C), our orientation.
    lookup_from_world
        Matrix (3, 3) that permutes and negates axes.

    Returns
    -------
    array
        Shape (6, s, s, C): what a lookup with `lookup_from_world @ d` finds is what d finds in `level`.
    """
    turned = np.empty_like(level)
    for face, axes in enumerate(_FACES):
        centre, right, down = axes @ lookup_from_world  # rows times M: each axis by the inverse, Mᵀ
        source = int(np.flatnonzero((_FACES[:, 0] == centre).all(axis=1))[0])
        texels = level[source]
        _, source_right, source_down = _FACES[source]
        if right @ source_right == 0:
            texels = texels.swapaxes(0, 1)  # now its columns run along the source's rows
            source_right, source_down = source_down, source_right
        turned[face] = texels[:: int(down @ source_down), :: int(right @ source_right)]
    return turned


def cube_from_levels(level_maps: EnvMap, size: int) -> FloatArray:
    """A level of a cube map as a lookup reads it from the levels of a map of another projection.

    Each texel is the lookup in the direction of its centre with a footprint of one texel: from the two levels
    of the map whose texels are next in size to the cube's there. Levels that were inferred stay what
    they are for.

    Parameters
    ----------
    level_maps
        All levels of the map.
    size
        Texels along a side of the cube's level.

    Returns
    -------
    array
        Shape (6, size, size, C), our orientation.
    """
    places = (2.0 * np.arange(size) + 1.0) / size - 1.0
    centre, right, down = (_FACES[:, None, None, k, :].astype(np.float64) for k in range(3))
    directions = centre + places[None, None, :, None] * right + places[None, :, None, None] * down
    steps = [np.broadcast_to(2.0 / size * step, directions.shape) for step in (right, down)]
    return level_maps.sample(directions, *steps, filter="trilinear")


def axis(name: str) -> NDArray[np.float64]:
    """Unit vector of `+x`, `-z` and so on."""
    vector = np.zeros(3)
    vector["xyz".index(name[1])] = 1.0 if name[0] == "+" else -1.0
    return vector


def source_from_panorama(frame: Frame) -> NDArray[np.float32]:
    """Matrix (3, 3) from a texel's direction in our panorama to that of the world in the program's."""
    assert frame.panorama is not None
    centre, right, up = (axis(name) for name in frame.panorama)
    return np.stack([right, up, -centre], axis=1).astype(np.float32)


def move_proxy(proxy: Mapping[str, Any], space_from_world: NDArray[np.int64]) -> dict[str, Any]:
    """The description of a proxy in another program's coordinates; lengths stay, in metres."""
    moved: dict[str, Any] = {"shape": proxy["shape"]}
    for key, value in proxy.items():
        if key in ("centre", "origin"):
            moved[key] = (space_from_world @ np.array(value)).tolist()
        elif key == "axes":
            moved[key] = (np.array(value) @ space_from_world.T).tolist()
        elif key != "shape":
            moved[key] = value
    return moved

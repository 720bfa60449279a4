"""Cutting surfaces into parts, for surfaces of which it is known where."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.scene.surface_parts import split_surface

if TYPE_CHECKING:
    from numpy.typing import NDArray

BALL = _core.make_sphere((0.0, 0.0, 0.0), 1.0, 24)


def joined(*meshes: _core.TriangleMesh) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    starts = np.cumsum([0] + [len(mesh.positions) for mesh in meshes])
    triangles = [mesh.triangles + np.uint32(start) for mesh, start in zip(meshes, starts[:-1], strict=True)]
    return np.concatenate([mesh.positions for mesh in meshes]), np.concatenate(triangles)


def moved(mesh: _core.TriangleMesh, x: float) -> _core.TriangleMesh:
    return _core.TriangleMesh(mesh.positions + np.array([x, 0.0, 0.0], np.float32), mesh.triangles)


def test_balls_that_do_not_touch_are_parts_of_their_own() -> None:
    positions, triangles = joined(BALL, moved(BALL, 3.0), moved(BALL, 6.0))
    parts = split_surface(positions, triangles).parts(3)
    number = np.arange(len(triangles)) // len(BALL.triangles)
    pairs = set(zip(number.tolist(), parts.tolist(), strict=True))
    assert len(pairs) == 3
    assert {part for _, part in pairs} == {0, 1, 2}


@pytest.mark.parametrize("count", [1, 2, 5, 16])
def test_there_are_as_many_parts_as_asked_for_the_largest_first(count: int) -> None:
    mesh = _core.make_torus((0.0, 0.0, 0.0), 1.0, 0.4, 32)
    parts = split_surface(mesh.positions, mesh.triangles).parts(count)
    sizes = np.bincount(parts)
    assert len(sizes) == count
    assert sizes.tolist() == sorted(sizes.tolist(), reverse=True)


def test_more_parts_are_cut_out_of_fewer() -> None:
    mesh = _core.make_torus((0.0, 0.0, 0.0), 1.0, 0.4, 32)
    split = split_surface(mesh.positions, mesh.triangles)
    for count in range(2, 9):
        coarse, fine = split.parts(count - 1), split.parts(count)
        assert len(set(zip(coarse.tolist(), fine.tolist(), strict=True))) == count


def test_parts_keep_kinds_apart() -> None:
    kind = (np.arange(len(BALL.triangles)) % 2).astype(np.int64)
    split = split_surface(BALL.positions, BALL.triangles, kind)
    assert split.fewest == 2
    parts = split.parts(1)
    assert all(len(np.unique(kind[parts == part])) == 1 for part in range(2))


def test_no_part_is_without_area() -> None:
    """Triangles of no area go with what they touch, or with the largest part."""
    positions, triangles = np.asarray(BALL.positions), np.asarray(BALL.triangles)
    positions = np.concatenate([positions, np.full((3, 3), 9.0, np.float32)])
    far = len(positions) - np.array([[3, 2, 1]])
    triangles = np.concatenate([triangles, far, [[0, 0, 1]]]).astype(np.uint32)
    split = split_surface(positions, triangles)
    corners = positions[triangles].astype(np.float64)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    assert np.bincount(split.parts(split.most), area).min() > 0.0


def test_order_of_triangles_changes_no_part_of_separate_balls() -> None:
    positions, triangles = joined(BALL, moved(BALL, 3.0))
    order = np.random.default_rng(5).permutation(len(triangles))
    straight = split_surface(positions, triangles).parts(2)
    shuffled = split_surface(positions, triangles[order]).parts(2)
    assert len(set(zip(straight[order].tolist(), shuffled.tolist(), strict=True))) == 2

"""The automatic choice of geometry on traced scenes: a teapot in six different surroundings."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mirrorbake._core import (
    Camera,
    Material,
    Scene,
    Tracer,
    TracerOptions,
    TriangleMesh,
    make_box,
    make_cylinder,
    make_rectangle,
    make_room,
    make_sphere,
    make_teapot,
    teapot_part_names,
)
from mirrorbake.proxy import Proxy, area_weighted_centroid, choose_proxy, fit_ellipsoid, hull_triangles

Floats = NDArray[np.float32]


def scaled_sphere(centre: tuple[float, float, float], radii: tuple[float, float, float]) -> TriangleMesh:
    unit = make_sphere((0, 0, 0), 1, 200)
    return TriangleMesh(
        (unit.positions * np.array(radii, np.float32) + np.array(centre, np.float32)).astype(np.float32),
        unit.triangles,
    )


def turned_box(
    low: tuple[float, float, float], high: tuple[float, float, float], angle: float
) -> TriangleMesh:
    box = make_box(low, high)
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    return TriangleMesh((box.positions @ turn.T).astype(np.float32), box.triangles)


def surroundings(name: str) -> Scene:
    if name == "furnished room":
        return make_room()
    meshes = {
        "box room": [make_box((-2, -0.8, -3), (3, 1.7, 2))],
        "elliptical room": [scaled_sphere((0.2, 0.4, 0.1), (2, 1.2, 3))],
        "distant panorama": [scaled_sphere((0, 0, 0), (500, 500, 500))],
        "turned room": [turned_box((-1.5, -0.8, -3), (2, 1.7, 2), 0.5)],
        "columned hall": [
            make_rectangle((-6, -0.5, -8), (0, 0, 16), (12, 0, 0)),
            make_rectangle((-6, 4, -8), (12, 0, 0), (0, 0, 16)),
            *[make_cylinder((x, -0.5, z), 0.3, 4.5) for x in (-3, 3) for z in (-6, -3, 0, 3, 6)],
        ],
    }[name]
    scene = Scene()
    material = scene.add_material(Material(name="wall"))
    for i, mesh in enumerate(meshes):
        scene.add_object(f"wall {i}", mesh, material)
    return scene


def reflections(
    tracer: Tracer, reflector: int, degrees: list[float]
) -> tuple[Floats, Floats, Floats, NDArray[np.int32]]:
    """Positions, directions, distances past the reflector, and view numbers of what cameras on an arc see."""
    rays: list[tuple[Any, ...]] = []
    for view, angle in enumerate(np.radians(degrees)):
        eye = (0.6 * np.cos(angle), 0.3, 0.6 * np.sin(angle))
        camera = Camera(eye, (0, 0.075, 0), vertical_fov_degrees=30, width=48, height=48)
        samples = tracer.trace_visibility(camera, reflector)
        positions, directions = np.array(samples.position), np.array(samples.reflection)
        distances = tracer.intersect(positions, directions, hidden=[reflector])[0]
        rays.append((positions, directions, distances, np.full(len(positions), view, np.int32)))
    p, d, t, v = (np.concatenate(parts) for parts in zip(*rays, strict=True))
    keep = t > 0
    return p[keep], d[keep], t[keep], v[keep]


def mean_error(proxy: Proxy, positions: Floats, directions: Floats, distances: Floats) -> float:
    far = np.isinf(distances)
    hits = positions + np.where(far, 0, distances)[:, None] * directions
    truth = np.where(far[:, None], directions, hits - np.array(proxy.origin)).astype(np.float64)
    lookup = proxy.lookup_float64(positions.astype(np.float64), directions.astype(np.float64))
    sine = np.linalg.norm(np.cross(truth, lookup), axis=1)
    return float(np.mean(np.arctan2(sine, np.sum(truth * lookup, axis=1))))


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("box room", "box"),
        ("elliptical room", "ellipsoid"),
        ("distant panorama", "infinite"),
        ("turned room", "rotated box"),
        ("furnished room", None),
        ("columned hall", None),
    ],
)
def test_choice_is_near_the_best_shape_in_unseen_views(name: str, expected: str | None) -> None:
    """At most 1.1 times the error of the best candidate in views between and beyond those it has seen."""
    scene = surroundings(name)
    teapot = make_teapot(8)
    reflector = scene.add_object(
        "teapot", teapot, scene.add_material(Material(name="mirror", specular=True)), teapot_part_names()
    )
    tracer = Tracer(scene, TracerOptions(indirect="none"))
    origin = area_weighted_centroid(teapot.positions, teapot.triangles)
    choice = choose_proxy(
        *reflections(tracer, reflector, [0, 10, 20, 30]), origin=origin, max_rays_per_view=300
    )
    unseen = reflections(tracer, reflector, [5, 15, 25, 36])
    errors = {c.name: mean_error(c.proxy, *unseen[:3]) for c in choice.candidates}
    assert len(errors) == 7
    if expected is not None:
        assert choice.best.name == expected, (choice.reason, errors)
    negligible = 6e-4
    assert errors[choice.best.name] <= max(1.1 * min(errors.values()), negligible), (choice.reason, errors)
    assert choice.best.name in choice.reason


def test_ellipsoid_of_the_teapot_encloses_it() -> None:
    teapot = make_teapot()
    centre = area_weighted_centroid(teapot.positions, teapot.triangles)
    ellipsoid = fit_ellipsoid(teapot.positions, centre)
    local = (np.asarray(teapot.positions, np.float64) - np.array(centre)) / np.array(ellipsoid.radii)
    assert np.sum(local**2, axis=1).max() <= 1


def test_teapot_splits_into_hull_and_dents() -> None:
    """Rays that leave the hull's triangles along their normals' hemisphere never meet the teapot again."""
    teapot = make_teapot(6)
    on_hull = hull_triangles(teapot.positions, teapot.triangles)
    assert 0.1 < on_hull.mean() < 0.9
    scene = Scene()
    scene.add_object(
        "teapot", teapot, scene.add_material(Material(name="mirror", specular=True)), teapot_part_names()
    )
    tracer = Tracer(scene, TracerOptions(indirect="none"))
    rng = np.random.default_rng(1)
    corners = np.asarray(teapot.positions, np.float64)[teapot.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.linalg.norm(normals, axis=1, keepdims=True)
    normals /= np.maximum(areas, 1e-30)
    hits = {}
    for group in (True, False):
        chosen = np.repeat(np.flatnonzero((on_hull == group) & (areas[:, 0] > 0)), 20)
        directions = rng.normal(size=(len(chosen), 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        cosine = np.sum(directions * normals[chosen], axis=1, keepdims=True)
        directions -= 2 * np.minimum(cosine, 0) * normals[chosen]
        # The split tolerates dents of 1e-4 of the diagonal, 0.3 m: start above those, a degree off the plane.
        steep = np.abs(cosine[:, 0]) > 0.02
        origins = corners[chosen].mean(axis=1) + 1e-4 * normals[chosen]
        distances = tracer.intersect(origins[steep].astype(np.float32), directions[steep].astype(np.float32))[
            0
        ]
        hits[group] = np.isfinite(distances).mean()
    assert hits[True] == 0
    assert hits[False] > 0.05

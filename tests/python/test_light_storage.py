"""Light of the body under the mirror, at vertices of a mesh that gets finer for it, or in a lightmap."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.bake.analyze import analyze
from mirrorbake.bake.bake import bake
from mirrorbake.bake.body_light import Lightmap, irradiance_of, lit_sides, texels_near
from mirrorbake.errors import InputError
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.pem.view_images import images_of_trace
from mirrorbake.scene import refine
from mirrorbake.scene.build import build_scene
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.refine import refined
from mirrorbake.scene.stage import prepare_stage
from unwrapped import FACES, NORMALS, PLATE, POST, write_post_on_plate, write_sun

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from mirrorbake.scene.plan import Decision, Plan

    Box = tuple[Sequence[float], Sequence[float]]


def corners_of(box: Box) -> np.ndarray:
    (x0, y0, z0), (x1, y1, z1) = box
    low = [(x0, y0, z0), (x1, y0, z0), (x1, y1, z0), (x0, y1, z0)]
    return np.array([*low, *((x, y, z1) for x, y, _ in low)], np.float32)


def cube(*, normals: bool) -> _core.TriangleMesh:
    """A cube of two parts whose faces have normals and vertices of their own, or share eight."""
    quads = np.array(FACES)
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    places, parts = corners_of(((0, 0, 0), (1, 1, 1))), np.tile(np.array([0, 0, 0, 1, 1, 1], np.uint16), 2)
    if not normals:
        return _core.TriangleMesh(places, triangles.astype(np.uint32), parts=parts)
    corners = places[triangles]
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    positions = corners.reshape(-1, 3)
    return _core.TriangleMesh(
        positions,
        np.arange(36, dtype=np.uint32).reshape(-1, 3),
        np.repeat(facing, 3, axis=0).astype(np.float32),
        np.ascontiguousarray(positions[:, :2] + 2.0 * positions[:, 2:]),
        parts,
        np.ascontiguousarray(0.5 * positions),
        np.concatenate([np.roll(np.repeat(facing, 3, axis=0), 1, axis=1), np.ones((36, 1))], axis=1).astype(
            np.float32
        ),
    )


def edges_of(mesh: _core.TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of numbers of places, each edge in the direction in which its triangle has it, and lengths."""
    _, place = np.unique(mesh.positions, axis=0, return_inverse=True)
    ends = np.stack([mesh.triangles, np.roll(mesh.triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    lengths = np.linalg.norm(mesh.positions[ends[:, 1]] - mesh.positions[ends[:, 0]], axis=1)
    return place.reshape(-1)[ends], lengths


def areas_of(mesh: _core.TriangleMesh) -> np.ndarray:
    a, b, c = (mesh.positions[mesh.triangles[:, k]].astype(np.float64) for k in range(3))
    return np.cross(b - a, c - a) / 2.0


@pytest.mark.parametrize("normals", [True, False])
@pytest.mark.parametrize("limit", [2.0, 1.2, 0.8, 0.3, 0.1])
def test_a_finer_cube_is_as_closed_and_has_no_longer_edges(normals: bool, limit: float) -> None:
    mesh = cube(normals=normals)
    finer = refined(mesh, limit)
    ends, lengths = edges_of(finer)
    assert lengths.max() <= limit
    # Every edge is there once in each direction: what lies on both sides of it is cut alike.
    directed = {tuple(pair) for pair in ends.tolist()}
    assert len(directed) == len(ends)
    assert all((b, a) in directed for a, b in directed)
    areas = areas_of(finer)
    assert np.linalg.norm(areas, axis=1).sum() == pytest.approx(6.0, rel=1e-6)
    assert np.bincount(finer.parts, np.linalg.norm(areas, axis=1)).tolist() == pytest.approx([3.0, 3.0])
    np.testing.assert_allclose(np.sort(areas.sum(axis=0)), 0.0, atol=1e-6)
    if limit > 1.5:
        assert len(finer.triangles) == 12


def test_values_of_new_vertices_are_those_of_the_surface_there() -> None:
    finer = refined(cube(normals=True), 0.15)
    np.testing.assert_allclose(finer.uvs, finer.positions[:, :2] + 2.0 * finer.positions[:, 2:], atol=1e-6)
    np.testing.assert_allclose(finer.colors, 0.5 * finer.positions, atol=1e-6)
    units = np.repeat(areas_of(finer) / np.linalg.norm(areas_of(finer), axis=1, keepdims=True), 3, axis=0)
    np.testing.assert_allclose(finer.normals[finer.triangles.reshape(-1)], units, atol=1e-6)
    np.testing.assert_allclose(finer.tangents[:, :3], np.roll(finer.normals, 1, axis=1), atol=1e-6)
    assert np.all(finer.tangents[:, 3] == 1.0)


def test_normals_between_others_are_unit_and_tangents_of_mirrored_halves_meet_in_none() -> None:
    triangle = _core.TriangleMesh(
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32),
        np.array([[0, 1, 2]], np.uint32),
        np.array([[0, 0, 1], [1, 0, 0], [0, 0, -1]], np.float32),
        tangents=np.array([[1, 0, 0, 1], [0, 1, 0, -1], [0, 1, 0, 1]], np.float32),
    )
    finer = refined(triangle, 0.8)
    assert len(finer.triangles) == 4
    np.testing.assert_allclose(np.linalg.norm(finer.normals, axis=1), 1.0, atol=1e-6)
    middle = {tuple(place): n for n, place in enumerate(finer.positions.tolist())}
    np.testing.assert_allclose(finer.normals[middle[0.5, 0.0, 0.0]], [0.5**0.5, 0, 0.5**0.5], atol=1e-6)
    # Opposite normals have no mean: the first's.
    np.testing.assert_allclose(finer.normals[middle[0.0, 0.5, 0.0]], [0, 0, 1], atol=1e-6)
    assert not finer.tangents[middle[0.5, 0.0, 0.0]].any()
    np.testing.assert_allclose(finer.tangents[middle[0.0, 0.5, 0.0]], [0.5**0.5, 0.5**0.5, 0, 1], atol=1e-6)


def test_without_normals_triangles_share_vertices_in_one_plane_only() -> None:
    finer = refined(cube(normals=False), 0.6)
    assert not len(finer.normals)
    facing = np.argmax(np.abs(areas_of(finer)), axis=1) + 3 * (areas_of(finer).sum(axis=1) > 0.0)
    for vertex in range(len(finer.positions)):
        assert len(set(facing[(finer.triangles == vertex).any(axis=1)].tolist())) == 1


def test_edges_that_are_too_short_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(refine, "MOST_TRIANGLES", 1000)
    with pytest.raises(InputError, match=r"reflector.longest_edge: 0\.02 .* or more; expected at most 1000"):
        refined(cube(normals=True), 0.02, 2.0)


# In a scene


def coated(folder: Path, boxes: Sequence[Box] | None = None, **sections: dict[str, Any]) -> dict[str, Any]:
    """Boxes of one mesh in plastic, under a small sun; None: a post on a plate, with texture coordinates."""
    path = folder / ("unwrapped.obj" if boxes is None else f"boxes-{len(boxes)}.obj")
    if boxes is None:
        write_post_on_plate(path)
    else:
        lines, faces = [], []
        for number, box in enumerate(boxes):
            lines += [f"v {x} {y} {z}" for x, y, z in corners_of(box).tolist()]
            faces += [
                "f " + " ".join(f"{corner + 8 * number + 1}//{side + 1}" for corner in quad)
                for side, quad in enumerate(FACES)
            ]
        path.write_text("\n".join([*lines, *(f"vn {normal}" for normal in NORMALS), *faces]) + "\n")
    write_sun(folder / "sky.exr")
    scene: dict[str, dict[str, Any]] = {
        "reflector": {"mesh": str(path), "height": 1.0, "parts": "joined"},
        "material": {
            "ior": [1.5] * 3,
            "fresnel": "dielectric",
            "albedo": [0.7, 0.6, 0.5],
            "layers": "coated",
        },
        "surroundings": {"panorama": str(folder / "sky.exr")},
        "views": {"count": 2, "start": 20.0, "degrees": 2.0, "size": [80, 80]},
        "trace": {"indirect": "none", "samples": 16, "noise": 0, "depth": 0},
        "maps": {"size": 8},
        "static": {"views": 0},
    }
    for name, section in sections.items():
        scene[name] = {**scene.get(name, {}), **section}
    return scene


def decision_of(plan: Plan, key: str = "reflector.longest_edge") -> Decision:
    (decision,) = (decision for decision in plan.decisions if decision.key == key)
    return decision


def decibels_of(pem: OpenedPem, point: float = 0.0) -> float:
    """How well a PEM shows the view of a point, against a tracing of its own."""
    stage, options = pem.stage.at(point), pem.stage.options
    options.samples_per_pixel, options.seed = 256, 7
    camera = stage.built.cameras.camera((point,))
    truth = images_of_trace(stage.tracer.trace_layers(camera, stage.built.reflector, options))
    drawn = pem.run_time.render("pem", point, pem.stage.visibility(point, pem.run_time.places))
    return psnr(drawn, truth.object, truth.coverage > 0.999)


def test_a_shadow_on_a_large_triangle_makes_the_mesh_finer(tmp_path: Path) -> None:
    decibels, sizes = {}, {}
    for edge in (0, "auto"):
        scene = coated(tmp_path, [PLATE, POST], reflector={"longest_edge": edge})
        bake(parse_config(scene, "plate"), tmp_path / str(edge))
        pem = open_pem(tmp_path / str(edge))
        sizes[edge] = len(pem.stage.built.positions)
        decibels[edge] = decibels_of(pem)
        decision = decision_of(pem.store.header.plan)
        assert decision.automatic == (edge == "auto")
    assert sizes[0] == 48
    assert 300 < sizes["auto"] < 20_000
    assert "beyond noise" in decision.reason
    assert decibels["auto"] > decibels[0] + 6.0
    # What was baked is opened and exported with the mesh that it was baked for.
    built = build_scene(pem.store.header.plan.shaped(parse_config(scene, "plate")))
    assert len(built.positions) == sizes["auto"]


@pytest.mark.parametrize(
    ("boxes", "sections", "reason"),
    [
        ([PLATE], {}, "changes the picture by 0"),
        (
            [PLATE, POST],
            {"material": {"albedo": [0, 0, 0], "layers": "additive"}},
            "there is no diffuse layer",
        ),
        ([PLATE, POST], {"reflector": {"longest_edge": 0.05}}, "set in the scene"),
    ],
)
def test_the_mesh_stays_as_it_is_where_that_changes_nothing(
    tmp_path: Path, boxes: list[Box], sections: dict[str, Any], reason: str
) -> None:
    stage = prepare_stage(parse_config(coated(tmp_path, boxes, **sections), "plate"))
    decision = decision_of(analyze(stage))
    assert reason in decision.reason
    assert decision.value == (0.05 if "set" in reason else 0.0)


def test_fine_meshes_are_not_measured(tmp_path: Path) -> None:
    scene = coated(tmp_path, [PLATE])
    scene["reflector"] = {"object": "teapot"}
    decision = decision_of(analyze(prepare_stage(parse_config(scene, "teapot"))))
    assert (decision.value, decision.measured) == (0.0, None)
    assert decision.reason == "triangles are small in the picture"


# In a lightmap


def test_a_shadow_on_a_mesh_with_texture_coordinates_lies_in_a_lightmap(tmp_path: Path) -> None:
    decibels = {}
    for size in (0, "auto"):
        scene = coated(tmp_path, layers={"lightmap": size})
        bake(parse_config(scene, "plate"), tmp_path / str(size))
        pem = open_pem(tmp_path / str(size))
        decibels[size] = decibels_of(pem)
    plan = pem.store.header.plan
    decision, edge = decision_of(plan, "layers.lightmap"), decision_of(plan)
    assert decision.automatic
    assert isinstance(decision.value, int)
    assert 16 <= decision.value <= 256
    assert "in a map" in decision.reason
    assert (edge.value, edge.reason) == (0.0, "the diffuse light is in a map")
    assert len(pem.stage.built.positions) == 48
    texels = pem.store.read_irradiance()
    assert texels is not None
    assert texels.shape == (decision.value**2, 3)
    # As good as at the vertices of a finer mesh, which is better than at its own (see above).
    assert decibels["auto"] > decibels[0] - 0.5


def test_a_lightmap_of_linear_light_is_linear_and_black_where_nothing_reads_it(tmp_path: Path) -> None:
    stage = prepare_stage(parse_config(coated(tmp_path), "plate"))
    lightmap = Lightmap(stage, 32)
    places = np.asarray(lightmap.samples.reflection)[:, :2]
    light = np.stack([1.0 + places[:, 0], 2.0 * places[:, 1], places.sum(axis=1)], axis=1)
    texels = lightmap.inferred(light.astype(np.float32)).reshape(32, 32, 3)
    middle = (np.arange(32) + 0.5) / 32
    linear = np.stack(np.broadcast_arrays(1.0 + middle, 2.0 * middle[:, None], middle + middle[:, None]), -1)
    seen = np.bincount(np.asarray(lightmap.samples.pixel), minlength=32 * 32).reshape(32, 32) == 9
    assert seen.sum() > 300
    np.testing.assert_allclose(texels[seen], linear[seen], atol=0.01)
    black = ~texels.any(axis=-1)
    assert 32 * 32 - black.sum() == lightmap.texels
    assert black.sum() > 20


def test_texels_near_some_are_those_and_the_eight_around() -> None:
    near = texels_near(np.array([0, 27], np.uint32), 8).reshape(8, 8)
    expected = np.zeros((8, 8), np.bool_)
    expected[:2, :2] = expected[2:5, 2:5] = True
    assert np.array_equal(near, expected)


def test_a_lightmap_has_both_sides_of_a_sheet(tmp_path: Path) -> None:
    sheet = tmp_path / "sheet.obj"
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    sheet.write_text(
        "".join(f"v {x} {0.5 * x + 1.0} {-z}\nvt {(x + 1) / 2} {(z + 1) / 2}\n" for x, z in corners)
        + "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"
    )
    scene = coated(tmp_path, [PLATE], layers={"lightmap": 16})
    scene["reflector"] = {"mesh": str(sheet), "height": 1.0}
    stage = prepare_stage(parse_config(scene, "sheet"))
    assert lit_sides(stage) == 2
    texels, vertices = irradiance_of(stage, 2, 16), irradiance_of(stage, 2)
    # Nothing shades it: each side is lit alike everywhere, and otherwise than the other one.
    np.testing.assert_allclose(texels.mean(axis=0), vertices.mean(axis=0), rtol=0.05)
    assert abs(texels[:, 0].mean() - texels[:, 3].mean()) > 0.5 * texels[:, 3].mean()


def test_a_lightmap_changes_with_the_scene(tmp_path: Path) -> None:
    scene = coated(tmp_path, layers={"lightmap": 32})
    scene["views"] = {"count": 1, "start": 20.0, "size": [64, 64]}
    scene["light"] = {"turn": 90.0, "count": 2}
    bake(parse_config(scene, "plate"), tmp_path / "pem")
    pem = open_pem(tmp_path / "pem")
    assert pem.store.has_irradiance_per_sample
    first, last = (pem.store.read_irradiance(sample) for sample in (0, 1))
    assert first is not None
    assert last is not None
    assert first.shape == last.shape == (32 * 32, 3)
    assert np.abs(first - last).max() > 0.5 * first.max()


def test_a_mesh_without_coordinates_of_its_own_has_no_lightmap(tmp_path: Path) -> None:
    stage = prepare_stage(parse_config(coated(tmp_path, [PLATE], layers={"lightmap": 64}), "plate"))
    with pytest.raises(InputError, match=r"layers.lightmap: 64: the mesh has no texture coordinates, or"):
        analyze(stage)


@pytest.mark.parametrize("size", [-1, 3, 8192, "big"])
def test_lightmaps_of_other_sizes_are_refused(tmp_path: Path, size: Any) -> None:
    expected = {-1: "greater than or equal to 0", 3: "a power of two", 8192: "less than or equal to 4096"}
    words = expected.get(size, "integer")
    with pytest.raises(InputError, match=rf"layers\.lightmap.*should be .*{words}"):
        parse_config(coated(tmp_path, [PLATE], layers={"lightmap": size}), "plate")

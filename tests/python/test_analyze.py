"""What a scene requires, for scenes of which it is known, and that a bake keeps to it."""

from __future__ import annotations

import math
import re
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.bake.analyze import FIRST_SAMPLES, LOBE_NOISE, MAX_DEPTH, MOST_FIRST_SAMPLES, analyze
from mirrorbake.bake.bake import bake
from mirrorbake.bake.count_parts import disagreement
from mirrorbake.bake.map_sizes import LARGEST_MAP, SMALLEST_MAP
from mirrorbake.bake.probe import Probe, displayed_noise
from mirrorbake.errors import InputError
from mirrorbake.pem.opened import open_pem
from mirrorbake.pem.store import PemStore
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import prepare_stage
from mirrorbake.scene.surface_parts import split_surface

from .gltf_scene import SQUARE, SQUARE_TRIANGLES, GlbScene

if TYPE_CHECKING:
    from pathlib import Path

    from mirrorbake.scene.plan import Decision, Plan
    from mirrorbake.scene.stage import Stage

CONVEX = _core.make_box((-0.5, 0, -0.5), (0.5, 1, 0.5))
RING = _core.make_torus((0, 0.5, 0), 0.6, 0.3, 48)
BALL = _core.make_sphere((0, 0.5, 0), 0.5, 96)

SET = "set in the scene"


def make_stage(folder: Path, mesh: _core.TriangleMesh, **sections: dict[str, Any]) -> Stage:
    """Prepare a mesh of 1 m under a sky that is brighter above, seen from a quarter circle."""
    lines = [f"v {x} {y} {z}" for x, y, z in mesh.positions.tolist()]
    lines += ["f " + " ".join(str(i + 1) for i in t) for t in mesh.triangles.tolist()]
    (folder / "mesh.obj").write_text("\n".join(lines) + "\n")
    rows = np.linspace(0.2, 2.0, 16, dtype=np.float32)[:, None, None]
    sky = np.ascontiguousarray(np.broadcast_to(rows, (16, 32, 3)))
    _core.save_image(str(folder / "sky.exr"), sky, ["R", "G", "B"])
    scene: dict[str, dict[str, Any]] = {
        "reflector": {"mesh": str(folder / "mesh.obj"), "height": 1.0},
        "material": {"fresnel": "constant", "r0": 0.9},
        "surroundings": {"panorama": str(folder / "sky.exr")},
        "views": {"count": 3, "size": [64, 64]},
        "trace": {"indirect": "none", "samples": 4},
    }
    for name, section in sections.items():
        scene[name] = {**scene.get(name, {}), **section}
    return prepare_stage(parse_config(scene, "scene"))


def of(plan: Plan, key: str) -> Decision:
    return next(decision for decision in plan.decisions if decision.key == key)


def test_a_convex_black_mirror_needs_the_distant_layer_alone(tmp_path: Path) -> None:
    plan = analyze(make_stage(tmp_path, CONVEX))
    assert not plan.has_diffuse
    assert "black" in of(plan, "layers.diffuse").reason
    assert not plan.has_local("object")
    assert "convex hull" in of(plan, "layers.local").reason
    # Nothing to reflect but the sky: the first reflection is the last.
    assert plan.depth == 0
    assert of(plan, "trace.depth").measured == 0.0
    assert plan.distant["shape"] == "infinite"


def test_a_ring_reflects_itself_and_paint_is_diffuse(tmp_path: Path) -> None:
    plan = analyze(
        make_stage(tmp_path, RING, reflector={"parts": "split"}, material={"albedo": [0.5, 0.1, 0.1]})
    )
    assert plan.has_diffuse
    assert plan.has_local("object")
    for key in ("layers.diffuse", "layers.local"):
        measured = of(plan, key).measured
        assert measured is not None
        assert measured > 0.03


def test_bounces_end_where_they_change_the_picture_by_less_than_the_tolerance(tmp_path: Path) -> None:
    depths = []
    for tolerance in (0.3, 0.1, 0.01):
        stage = make_stage(tmp_path, RING, auto={"tolerance": tolerance})
        decision = of(analyze(stage), "trace.depth")
        depths.append(cast("int", decision.value))
        assert decision.measured is not None
        assert decision.measured <= tolerance
        # The picture itself, to the depth that was found and to one that leaves nothing out.
        exact, found = (beauty(stage, depth) for depth in (64, depths[-1]))
        # 64² pixels of another number of samples measure the same to some tenths.
        assert change(exact, found) < 2.0 * tolerance
        if depths[-1]:
            assert change(exact, beauty(stage, depths[-1] - 1)) > tolerance / 2.0
    assert depths[0] <= depths[1] < depths[2] < MAX_DEPTH


def beauty(stage: Stage, depth: int) -> Any:
    options = _core.TraceOptions(samples_per_pixel=4, max_specular_depth=depth)
    pictures = []
    for t in (0.0, 0.5, 1.0):
        trace = stage.tracer.trace_layers(stage.built.cameras.camera((t,)), stage.built.reflector, options)
        channels = list(trace.channels)
        layers = np.asarray(trace.layers)
        seen = layers[..., channels.index("coverage")] > 0.5
        pictures.append(layers[seen][:, [channels.index(name) for name in "RGB"]])
    return np.concatenate(pictures).astype(float)


def change(exact: Any, other: Any) -> float:
    return float(np.sqrt(np.mean((exact - other) ** 2) / np.mean(exact**2)))


def test_map_size_follows_the_curvature_of_the_mirror(tmp_path: Path) -> None:
    plan = analyze(make_stage(tmp_path, BALL))
    # On a sphere of radius r a pixel of p metres turns the normal by p/r and the reflection by twice that in
    # the middle of the image, more towards the rim: the sphere fills 0.9 of 64 pixels.
    step = 2 * (1 / 0.9 / 64) / 0.5
    assert 2 / step / 2 <= plan.map_size <= 2 * 2 / step
    assert plan.map_size == 2 ** round(math.log2(plan.map_size))


def test_a_flat_mirror_asks_for_no_more_than_the_largest_map(tmp_path: Path) -> None:
    plan = analyze(make_stage(tmp_path, CONVEX, views={"size": [2048, 2048], "count": 1}))
    assert plan.map_size == LARGEST_MAP
    assert str(LARGEST_MAP) in of(plan, "maps.size").reason


def box_and_ball(folder: Path) -> Stage:
    """Prepare a mirror of two parts: a flat one, and a small ball on it that sees itself in it."""
    path = folder / "two.obj"
    ball = _core.make_sphere((0, 1.1, 0), 0.1, 32)
    lines = []
    for name, mesh, first in (("flat", CONVEX, 1), ("round", ball, 1 + len(CONVEX.positions))):
        lines += [f"o {name}", *("v {:g} {:g} {:g}".format(*p) for p in mesh.positions)]
        lines += ["f {} {} {}".format(*(first + corners)) for corners in mesh.triangles.astype(int)]
    path.write_text("\n".join(lines) + "\n")
    stage = make_stage(folder, CONVEX)
    data = stage.config.model_dump(mode="json", exclude_unset=True)
    data["reflector"] = {"mesh": str(path), "height": 1.2, "parts": "split"}
    # With a material of the scene file an OBJ file is one part; this one has none, so that it is a mirror.
    del data["material"]
    return prepare_stage(parse_config(data, "scene"))


def test_a_flat_part_gets_larger_maps_than_a_small_ball(tmp_path: Path) -> None:
    stage = box_and_ball(tmp_path)
    plan = analyze(stage)
    flat, ball = stage.built.part_names
    assert plan.size_of(flat, "distant") > plan.size_of(ball, "distant")
    assert plan.map_size == max(d.value for d in plan.decisions if d.key == "maps.size")
    bake(stage.config, tmp_path / "pem", stage=stage)
    header, sizes = PemStore.open(tmp_path / "pem").header, set[int]()
    for part in header.parts:
        for shell in part.shells:
            assert shell.size == plan.size_of(part.name, shell.name)
            sizes.add(shell.size)
    assert len(sizes) > 1
    assert [entry.size for entry in header.maps] == [
        plan.size_of(*entry.name.split("/")) for entry in header.maps
    ]


def test_what_a_part_sees_of_the_object_lies_about_it_unless_told(tmp_path: Path) -> None:
    plan = analyze(make_stage(tmp_path, RING))
    shapes = [decision for decision in plan.decisions if decision.key == "shells.proxy"]
    assert {(shape.part, shape.shell) for shape in shapes} == {
        (part, "local") for part in plan.shells[0].proxies
    }
    for shape in shapes:
        assert shape.automatic
        assert shape.measured is not None
        # The best of the fitted shapes is named beside it.
        assert re.search(r"best fitted shape, [a-z ]+, by \d\.\d{3}$", shape.reason)
        assert shape.value == "enclosing ellipsoid"
    table = {"name": "local", "objects": ["itself"], "proxy": "enclosing ellipsoid"}
    data = make_stage(tmp_path, RING).config.model_dump(mode="json", exclude_unset=True)
    shells = [table, {"name": "distant"}]
    fixed = analyze(prepare_stage(parse_config({**data, "shells": shells}, "scene")))
    for attributes in fixed.shells[0].proxies.values():
        assert attributes["shape"] == "ellipsoid"
        assert attributes["centre"] == attributes["origin"]


def shiny_ball(folder: Path, roughness: float, lamp: float = 3.0) -> Stage:
    """Prepare a ball of metal in a file, on a floor that is lit from one side."""
    floor, metal = (
        {"pbrMetallicRoughness": {"metallicFactor": factor, "roughnessFactor": rough}}
        for factor, rough in ((0.0, 1.0), (1.0, roughness))
    )
    scene = GlbScene(materials=[floor, metal])
    square = scene.add_mesh(5 * SQUARE, SQUARE_TRIANGLES, 0)
    ball = scene.add_mesh(BALL.positions, BALL.triangles, 1, BALL.normals)
    scene.nodes = [{"name": "floor", "mesh": square}, {"name": "ball", "mesh": ball}]
    path = folder / "ball.glb"
    scene.write(path)
    panorama = np.full((16, 32, 3), 0.1, np.float32)
    panorama[4:7, 8:16] = lamp
    _core.save_image(str(folder / "sky.exr"), panorama, ["R", "G", "B"])
    config = {
        "reflector": {"scene_object": "ball"},
        "surroundings": {"scene": str(path), "panorama": str(folder / "sky.exr")},
        "views": {"count": 2, "degrees": 10, "size": [96, 96]},
        "trace": {"indirect": "none"},
    }
    return prepare_stage(parse_config(config, "scene"))


def test_only_a_rough_reflector_gets_small_maps(tmp_path: Path) -> None:
    mirror = analyze(shiny_ball(tmp_path, 0.0))
    # Perceptual roughness: α is its square.
    rough = analyze(shiny_ball(tmp_path, 0.7))
    width = 4 * math.atan(0.49 * math.sqrt(math.sqrt(2) - 1))
    assert SMALLEST_MAP <= rough.map_size < mirror.map_size
    assert width / 8 <= 2 / rough.map_size <= width / 4 or rough.map_size == SMALLEST_MAP


@pytest.mark.parametrize(
    ("roughness", "lamp", "more"), [(0.0, 3.0, False), (0.3, 0.1, False), (0.7, 8.0, True)]
)
def test_first_samples_go_by_the_noise_of_a_rough_lobe(
    tmp_path: Path, roughness: float, lamp: float, more: bool
) -> None:
    decision = of(analyze(shiny_ball(tmp_path, roughness, lamp)), "trace.samples")
    assert decision.reason.endswith("; noisy pixels get more, by trace.noise")
    assert decision.measured is not None
    assert isinstance(decision.value, int)
    left = decision.measured * math.sqrt(FIRST_SAMPLES / decision.value)
    if more:
        assert FIRST_SAMPLES < decision.value <= MOST_FIRST_SAMPLES
        assert left <= LOBE_NOISE or decision.value == MOST_FIRST_SAMPLES
        assert left > 0.5 * LOBE_NOISE
    else:
        assert decision.value == FIRST_SAMPLES
        assert roughness == 0.0 or left <= LOBE_NOISE


def test_what_the_scene_sets_is_obeyed_and_not_measured(tmp_path: Path) -> None:
    stage = make_stage(
        tmp_path,
        CONVEX,
        reflector={"parts": "split", "longest_edge": 0},
        layers={"diffuse": True, "lightmap": 0, "local": True, "hull_split": False},
        maps={"size": 32, "distant": "infinite", "shared_distant": False},
        trace={"depth": 5},
    )
    plan = analyze(stage)
    decided = [decision for decision in plan.decisions if not decision.automatic]
    expected = [0, "split", 5, 4, True, 0, True, False, "infinite", False, 32]
    assert [decision.value for decision in decided] == expected
    assert all(decision.reason == SET for decision in decided)
    # What the quality decides needs no measuring, nor do the shells of [PEM] §4, but for their shapes.
    others = [d for d in plan.decisions if d.automatic and d.key not in ("shells", "shells.proxy")]
    assert all(decision.reason.startswith("normal quality") for decision in others)
    bake(stage.config, tmp_path / "pem", None, stage)
    pem = open_pem(tmp_path / "pem", stage)
    assert pem.store.header.map_names() == [("object", "local"), ("object", "distant")]
    assert pem.stage.options.max_specular_depth == 5
    # Asked for, though the material is black.
    assert pem.store.read_irradiance() is not None


def test_layers_that_are_left_out_are_not_missed(tmp_path: Path) -> None:
    pictures = {}
    for name, wanted in (("decided", "auto"), ("all", True)):
        stage = make_stage(
            tmp_path,
            CONVEX,
            layers={"diffuse": wanted, "local": wanted},
            maps={"size": 32},
            views={"count": 1},
            infer={"fit": "layers"},
        )
        bake(stage.config, tmp_path / name, None, stage)
        pem = open_pem(tmp_path / name, stage)
        pictures[name] = pem.run_time.render("pem", 0.0, pem.stage.visibility(0.0))
        assert (pem.store.read_irradiance() is not None) == (wanted is True)
        layers = [layer for _, layer in pem.store.header.map_names()]
        assert layers == (["local", "distant"] if wanted is True else ["distant"])
    assert pictures["all"].max() > 0.5
    # float16 on disk; the maps' solution does not depend on layers that hold nothing.
    np.testing.assert_allclose(pictures["decided"], pictures["all"], rtol=0, atol=1e-4)


def test_a_finite_shape_needs_something_to_fit_it_to(tmp_path: Path) -> None:
    stage = make_stage(tmp_path, CONVEX, maps={"distant": "hemisphere"})
    with pytest.raises(InputError, match=r"maps\.distant = 'hemisphere'"):
        analyze(stage)


@pytest.mark.parametrize(
    "shape", ["sphere", "hemisphere", "box", "ellipsoid", "rotated box", "rotated ellipsoid"]
)
def test_every_shape_of_the_distant_layer_is_baked_and_drawn(tmp_path: Path, shape: str) -> None:
    ground = {"ground": {"radius": 3.0}}
    stage = make_stage(
        tmp_path, BALL, surroundings=ground, maps={"size": 64, "distant": shape}, views={"count": 1}
    )
    bake(stage.config, tmp_path / "pem", None, stage)
    pem = open_pem(tmp_path / "pem", stage)
    kinds = {"sphere": "ellipsoid", "rotated box": "box", "rotated ellipsoid": "ellipsoid"}
    assert pem.store.header.plan.distant["shape"] == kinds.get(shape, shape)
    drawn = pem.run_time.render("pem", 0.0, pem.stage.visibility(0.0))
    images = pem.store.read_images(0)
    seen = images.coverage > 0.9
    # The smooth sky and its horizon.
    assert np.sqrt(np.mean((drawn[seen] - images.object[seen]) ** 2)) < 0.05


def test_a_reflector_that_no_view_sees_needs_nothing(tmp_path: Path) -> None:
    plan = analyze(
        make_stage(tmp_path, RING, views={"centre": [0.0, 50.0, 0.0], "radius": 1.0, "height": 0.0})
    )
    assert (plan.depth, plan.has_local("object"), plan.map_size) == (0, False, SMALLEST_MAP)
    assert plan.distant["shape"] == "infinite"


def test_a_surface_is_cut_where_equal_reflections_want_different_light(tmp_path: Path) -> None:
    """Two balls on a chequered ground: rays that both send into one direction end at different squares."""
    low = _core.make_sphere((-1.2, 0.5, 0.0), 0.5, 24)
    count = len(low.positions)
    pair = _core.TriangleMesh(
        np.concatenate([low.positions, low.positions + np.array([2.4, 0.0, 0.0], np.float32)]),
        np.concatenate([low.triangles, low.triangles + np.uint32(count)]),
    )
    room = {"panorama": None, "room": "furnished"}
    stage = make_stage(tmp_path, pair, reflector={"height": 0.1}, surroundings=room)
    decision = of(analyze(stage), "reflector.parts")
    assert decision.automatic
    assert isinstance(decision.value, int)
    assert decision.value >= 2
    assert "by" in decision.reason
    labels = split_surface(stage.built.positions, stage.built.triangles).parts(2)
    # Of two parts each is a ball.
    assert len(np.unique(labels[: len(low.triangles)])) == 1
    assert labels[0] != labels[-1]
    # The same samples in parts that do not collide differ less.
    probe = Probe.of(stage, 2)
    assert disagreement(probe, labels) < 0.8 * disagreement(probe, np.zeros_like(labels))


def test_a_planned_stage_has_the_parts_that_were_decided(tmp_path: Path) -> None:
    stage = make_stage(tmp_path, RING, reflector={"parts": 5})
    assert stage.built.part_names == [f"part-{number}" for number in range(1, 6)]
    assert stage.in_parts(5) is stage
    other = stage.in_parts(3)
    assert len(other.built.part_names) == 3
    assert stage.in_parts(3) is other
    np.testing.assert_array_equal(other.built.triangles, stage.built.triangles)


def test_the_noise_of_displayed_pixels_is_that_of_their_samples() -> None:
    samples, pixels, deviation = 16, 20_000, 0.02
    random = np.random.default_rng(3)
    probe = SimpleNamespace(
        pixel=np.repeat(np.arange(pixels), samples),
        beauty=random.normal(0.5, deviation, (samples * pixels, 3)),
    )
    # The derivative of the sRGB curve at 0.5, and four times less noise in a mean of 16. Of 20,000 pixels the
    # estimate is good to half a per cent.
    expected = 1.055 / 2.4 * 0.5 ** (1.0 / 2.4 - 1.0) * deviation / 4.0
    assert displayed_noise(cast("Probe", probe)) == pytest.approx(expected, rel=0.02)


def test_a_mirror_whose_noise_nothing_mends_gets_more_samples(tmp_path: Path) -> None:
    def samples(noise: float, limit: float) -> Decision:
        trace = {"noise": noise, "samples": "auto"}
        return of(analyze(make_stage(tmp_path, RING, trace=trace, auto={"noise": limit})), "trace.samples")

    measured = samples(0.0, 0.9).measured
    assert samples(0.0, 0.9).value == FIRST_SAMPLES
    assert measured is not None
    assert samples(0.0, measured / 1.9).value == 4 * FIRST_SAMPLES
    assert samples(0.01, measured / 1.9).value == FIRST_SAMPLES


# What a scene would do without


def test_a_captured_map_of_a_far_sky_leaves_nothing_to_a_pem(tmp_path: Path) -> None:
    advice = analyze(make_stage(tmp_path, BALL)).advice
    assert any(words.startswith("a PEM is not worth it: one captured map at infinity") for words in advice)
    # Not asked of what is a static set itself.
    alone = analyze(make_stage(tmp_path, BALL, views={"kind": "none", "count": 3}))
    assert not any("a PEM" in words for words in alone.advice)


def test_an_object_that_reflects_itself_is_worth_a_pem(tmp_path: Path) -> None:
    stage = make_stage(tmp_path, RING, reflector={"rotation": [70.0, 0.0, 0.0]}, auto={"tolerance": 0.003})
    assert any(words.startswith("a PEM is worth its bytes") for words in analyze(stage).advice)


def test_one_lookup_does_where_reflections_are_straight_across_a_pixel(tmp_path: Path) -> None:
    near = {"views": {"size": [256, 256]}}
    flat = analyze(make_stage(tmp_path, CONVEX, maps={"size": 16}, **near)).advice
    assert any(words.startswith("one lookup a pixel follows") for words in flat)
    fine = analyze(make_stage(tmp_path, BALL, maps={"size": 1024}, views={"size": [32, 32]})).advice
    assert any("a single lookup would miss" in words for words in fine)


def test_schlicks_formula_is_measured_where_a_material_has_another(tmp_path: Path) -> None:
    def words(material: dict[str, Any]) -> list[str]:
        advice = analyze(make_stage(tmp_path, BALL, material={"r0": None, **material})).advice
        return [sentence for sentence in advice if "Schlick" in sentence]

    gold = {"fresnel": "conductor", "metal": "gold"}
    assert words(gold)[0].startswith("Schlick's formula does for the conductor")
    water = {"fresnel": "dielectric", "ior": 1.1}
    assert words(water)[0].startswith("the dielectric needs its own equations")
    assert words({"fresnel": "schlick", "r0": 0.5}) == []


def test_parts_share_a_map_where_they_want_the_same_of_it(tmp_path: Path) -> None:
    def decision(surroundings: dict[str, Any]) -> Decision:
        scene = {
            "reflector": {"object": "teapot", "subdivisions": 6},
            "surroundings": surroundings,
            "views": {"count": 3, "degrees": 20.0, "height": 0.5, "size": [128, 128]},
            "maps": {"size": 32, "distant": "infinite"},
            "trace": {"indirect": "none"},
        }
        return of(analyze(prepare_stage(parse_config(scene, "scene"))), "maps.shared_distant")

    grey = np.full((16, 32, 3), 0.5, np.float32)
    _core.save_image(str(tmp_path / "grey.exr"), grey, ["R", "G", "B"])
    # A sky at infinity is the same for all; a room at infinity is seen from elsewhere by lid and body.
    sky = decision({"panorama": str(tmp_path / "grey.exr")})
    assert sky.value is True
    assert sky.measured == pytest.approx(0.0, abs=0.005)
    room = decision({"room": "furnished"})
    assert room.value is False
    assert room.measured is not None
    assert room.measured > 0.02

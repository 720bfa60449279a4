"""Shells of a scene file: any number of maps on shapes of their own, by what reflected rays meet."""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import mirrorbake as mb
from mirrorbake import _core
from mirrorbake.bake.analyze import analyze
from mirrorbake.bake.bake import bake
from mirrorbake.bake.capture_place import capture_place
from mirrorbake.bake.captured import captured_shells
from mirrorbake.bake.probe import Probe
from mirrorbake.bake.sample import SampleBaker
from mirrorbake.bake.shell_shapes import plane_through
from mirrorbake.bake.split_shells import captured_error
from mirrorbake.errors import InputError
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.pem.export.glb import export_glb
from mirrorbake.pem.export.map_sets import sample_set
from mirrorbake.pem.export.maps import export_maps
from mirrorbake.pem.export.source import export_source
from mirrorbake.pem.export.web import MANIFEST_NAME, WebPem
from mirrorbake.pem.layout import read_back, stored_map
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.pem.pyramid import size_of
from mirrorbake.pem.view_images import images_of_trace
from mirrorbake.proxy import proxy_from_attributes
from mirrorbake.scene.build import build_scene
from mirrorbake.scene.config_shells import DEFAULT_SHELLS
from mirrorbake.scene.load import load_config, parse_config
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from mirrorbake.pem.store import PemStore

THREE = [
    {"name": "local", "objects": ["itself"]},
    {"name": "screens", "objects": ["screen_*"]},
    {"name": "rest"},
]
TWO = [{"name": "local", "objects": ["itself"]}, {"name": "distant"}]


def tiles(folder: Path) -> str:
    """An OBJ file of a chequered floor, y = 0, and two screens that stand on it, x = -0.4 and 0.4."""
    faces: dict[str, list[str]] = {
        f"{what}_{tone}": [] for what in ("floor", "screen") for tone in ("dark", "light")
    }
    vertices: list[str] = []

    def tile(what: str, corner: Any, along: Any, up: Any, odd: int) -> None:
        corner, along, up = (np.array(v, float) for v in (corner, along, up))
        for point in (corner, corner + along, corner + along + up, corner + up):
            vertices.append("v " + " ".join(f"{x:.6g}" for x in point))
        name = f"{what}_{'dark' if odd % 2 else 'light'}"
        faces[name].append("f " + " ".join(str(len(vertices) - 3 + k) for k in range(4)))

    for i in range(-6, 6):
        for k in range(-6, 6):
            tile("floor", (0.1 * i, 0.0, 0.1 * k), (0.0, 0.0, 0.1), (0.1, 0.0, 0.0), i + k)
    for i in range(-4, 4):
        for k in range(4):
            tile("screen", (-0.4, 0.1 * k, 0.1 * i), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1), i + k)
            tile("screen", (0.4, 0.1 * k, 0.1 * i), (0.0, 0.0, 0.1), (0.0, 0.1, 0.0), i + k)
    text = ["mtllib tiles.mtl", *vertices]
    for name, indices in faces.items():
        text += [f"o {name}", f"usemtl {name}", *indices]
    (folder / "tiles.obj").write_text("\n".join(text) + "\n")
    colours = {
        "floor_dark": "0.1 0.1 0.3", "floor_light": "0.8 0.7 0.5", "screen_dark": "0.5 0.1 0.1",
        "screen_light": "0.9 0.8 0.2",
    }  # fmt: skip
    (folder / "tiles.mtl").write_text("".join(f"newmtl {n}\nKd {kd}\n" for n, kd in colours.items()))
    return str(folder / "tiles.obj")


def steps(folder: Path) -> str:
    """An OBJ file of two mirrors at a right angle on two blocks: flat faces, which see each other."""
    profile = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]
    lines = [f"v {x} {y} {z}" for z in (0.0, 1.5) for x, y in profile]
    for k in range(6):
        lines.append(f"f {k + 1} {(k + 1) % 6 + 1} {(k + 1) % 6 + 7} {k + 7}")
    lines += ["f 6 5 4 1", "f 4 3 2 1", "f 7 10 11 12", "f 7 8 9 10"]
    (folder / "steps.obj").write_text("\n".join(lines) + "\n")
    return str(folder / "steps.obj")


def scene(folder: Path, shells: Any = THREE, **changes: Any) -> dict[str, Any]:
    v, u = np.mgrid[0:32, 0:64].astype(np.float32)
    sky = 0.3 + 0.7 * np.stack(
        [0.5 + 0.5 * np.sin(0.4 * u), 1 - v / 32, 0.5 + 0.5 * np.cos(0.3 * u)], axis=-1
    )
    mb.save_image(str(folder / "sky.exr"), sky.astype(np.float32), ["R", "G", "B"], format="float32")
    sections = {
        "reflector": {
            "mesh": steps(folder),
            "height": 0.15,
            "rotation": [0.0, -25.0, 0.0],
            "parts": "joined",
        },
        "material": {},
        "surroundings": {"scene": tiles(folder), "panorama": str(folder / "sky.exr")},
        "views": {"count": 2, "degrees": 2.0, "start": 22.0, "size": [80, 60]},
        "layers": {"diffuse": False},
        "maps": {"size": 32},
        "trace": {"samples": 64, "depth": 2, "indirect": "none"},
        "auto": {"quality": "draft"},
    }
    return {**sections, "shells": shells, **changes}


@pytest.fixture(scope="module")
def three(tmp_path_factory: pytest.TempPathFactory) -> OpenedPem:
    folder = tmp_path_factory.mktemp("three")
    bake(parse_config(scene(folder), "three"), folder / "pem")
    return open_pem(folder / "pem")


def test_the_light_of_three_shells_composes_to_what_arrives(three: OpenedPem) -> None:
    trace = three.stage.trace(0.5)
    samples = trace.samples
    assert [shell.name for shell in samples.shells] == ["local", "screens", "rest"]
    light = np.asarray(samples.shells[2].radiance)[:, :3]
    for shell in samples.shells[1::-1]:
        layer = np.asarray(shell.radiance)
        light = layer[:, :3] + (1.0 - layer[:, 3:]) * light
    composed = np.asarray(samples.diffuse) + np.asarray(samples.fresnel) * light
    np.testing.assert_allclose(composed, np.asarray(trace.sample_beauty), rtol=1e-5, atol=1e-6)
    shares = [float(np.mean(np.asarray(shell.radiance)[:, 3])) for shell in samples.shells]
    assert min(shares) > 0.005, shares


def test_a_pem_keeps_its_shells(three: OpenedPem) -> None:
    header = three.store.header
    assert [(rule.name, rule.objects, rule.nearer_than) for rule in header.rules] == [
        ("local", ("itself",), None), ("screens", ("screen_*",), None), ("rest", (), None),
    ]  # fmt: skip
    local, screens, rest = header.parts[0].shells
    assert (local.moves, screens.moves, rest.moves) == (True, False, False)
    assert (local.polygons, screens.polygons) == ("off hull", "all")
    assert [entry.channels for entry in header.maps] == [4, 4, 3]
    # Fitted to what its rays meet: the box's walls are the screens.
    box = screens.proxy
    assert box["shape"] == "box"
    assert [
        box["centre"][0] - box["half_extent"][0],
        box["centre"][0] + box["half_extent"][0],
    ] == pytest.approx([-0.4, 0.4], abs=0.02)
    # A bake that is resumed keeps to what was decided.
    assert three.stage.shell_rules[1].name == "screens"


def off_samples(pem: OpenedPem) -> float:
    """Decibels of two views away from the samples."""
    cameras, total = pem.stage.built.cameras, 0.0
    for azimuth, elevation in ((35.0, 20.0), (23.0, 32.0)):
        camera = cameras.around(azimuth, elevation)
        options = pem.stage.options
        options.samples_per_pixel = 256
        traced = images_of_trace(pem.stage.tracer.trace_layers(camera, pem.stage.built.reflector, options))
        seen = pem.stage.tracer.trace_visibility(
            camera, pem.stage.built.reflector, options, pem.run_time.places
        )
        drawn = pem.run_time.render("pem", 0.5, seen)
        total += psnr(drawn, traced.object, traced.coverage > 0.99)
    return 0.5 * total


def test_screens_of_their_own_are_better_away_from_the_samples(tmp_path: Path, three: OpenedPem) -> None:
    bake(parse_config(scene(tmp_path, TWO), "two"), tmp_path / "pem")
    two = off_samples(open_pem(tmp_path / "pem"))
    # Of 26.8 and 29.9 dB: one shape fits the screens or the floor and the sky, not all of them.
    assert off_samples(three) > two + 1.5


def test_samples_of_three_shells_have_the_same_bits_in_any_order(tmp_path: Path, three: OpenedPem) -> None:
    stage, contents = three.stage, three.store.contents()
    for threads, order in ((1, (0, 1)), (2, (1, 0)), (8, (1,))):
        with mb.ThreadLimit(threads):
            baker = SampleBaker(stage, contents)
            for index in order:
                for name, texels in baker.bake(index).maps.items():
                    stored = three.store.read_map(*name, index)
                    # As they are stored: float16.
                    mine = _stored(three.store, texels)
                    np.testing.assert_array_equal(mine, stored, err_msg=f"{threads} threads, {name}")


def _stored(store: PemStore, texels: NDArray[np.float32]) -> NDArray[np.float32]:
    size = size_of(len(texels))
    return read_back(stored_map(texels, size, store.header)[0], size, store.header)


def test_every_export_has_all_shells(tmp_path: Path, three: OpenedPem) -> None:
    web = WebPem(export_source(three))
    manifest = json.loads(web.read(MANIFEST_NAME))
    assert [shell["name"] for shell in manifest["parts"][0]["shells"]] == ["local", "screens", "rest"]
    assert [shell["proxy"]["shape"] for shell in manifest["parts"][0]["shells"]] == [
        "ellipsoid", "box", "hemisphere",
    ]  # fmt: skip
    assert [entry["opaque"] for entry in manifest["maps"]] == [False, False, True]
    described = export_maps([sample_set(three.store, 0)], tmp_path / "maps")
    assert [shell["name"] for shell in described["sets"][0]["parts"][0]["shells"]] == [
        "local",
        "screens",
        "rest",
    ]
    export_glb(three.store, three.stage.built, tmp_path / "a.glb", samples=[0])
    data = (tmp_path / "a.glb").read_bytes()
    document = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
    sets = document["extensions"]["EXT_mirrorbake_pem"]["sets"]
    assert [shell["name"] for shell in sets[1]["parts"][0]["shells"]] == ["local", "screens", "rest"]


def test_what_a_part_has_no_map_of_is_in_the_shell_behind(tmp_path: Path) -> None:
    world = mb.Scene()
    mirror = world.add_material(
        mb.Material(albedo=(0, 0, 0), specular=True, fresnel=mb.Fresnel("constant", r0=(1, 1, 1)))
    )
    ball = world.add_object("ball", mb.make_sphere((0, 0, 0), 1.0), mirror)
    lamp = world.add_material(mb.Material(albedo=(0, 0, 0), emission=(2, 3, 4)))
    near = world.add_object("near", mb.make_sphere((0, 0, 3), 1.0), lamp)
    world.set_environment(np.full((4, 8, 3), 0.5, np.float32))
    options = mb.TraceOptions(
        samples_per_pixel=4,
        shells=[
            _core.ShellRule("local", [_core.ShellRule.ITSELF]),
            _core.ShellRule("near", [near]),
            _core.ShellRule("sky"),
        ],
    )
    camera = mb.Camera((4, 1, 3), (0, 0, 0), width=24, height=24)
    trace = mb.Tracer(world, mb.TracerOptions(indirect="none")).trace_layers(camera, ball, options)
    assert _core.MOST_SHELLS == 8
    with pytest.raises(mb.InvalidArgument, match=r"stacks\[0\].*\[1, 0\].*rising numbers"):
        mb.ViewTargets(24, 24, 1, 3, [[1, 0]])
    with pytest.raises(mb.InvalidArgument, match="one per part"):
        mb.ViewTargets(24, 24, 1, 3, [[2], [2]])
    for stacks in ([[0, 1, 2]], [[1, 2]], [[2]]):
        targets = mb.ViewTargets(24, 24, 1, 3, stacks)
        targets.add(trace.samples)
        assert targets.shells == 3


def test_a_rule_holds_its_objects_within_its_limits() -> None:
    rule = _core.ShellRule("near", [_core.ShellRule.ITSELF, 4], nearer_than=2.0)
    objects = np.array([1, 4, 4, 0, -1], np.int32)
    distances = np.array([1.0, 1.0, 2.0, 1.0, 1.0], np.float32)
    # -1 is a light, not the reflector.
    assert rule.holds(objects, distances, 1).tolist() == [1, 1, 0, 0, 0]
    assert rule.has_limits
    assert not _core.ShellRule("ball", [1]).has_limits
    with pytest.raises(mb.InvalidArgument, match=r"distances.*4 elements.*expected 5"):
        rule.holds(objects, distances[:4], 1)


@pytest.mark.parametrize(
    ("shells", "message"),
    [
        ([], r"shells: 0 of them; expected 1 to 8"),
        ([{"name": f"s{k}", "objects": [f"o{k}"]} for k in range(8)] + [{"name": "rest"}], "9 of them"),
        ([{"name": "a", "objects": ["x"]}], "'a', holds some things alone; expected one that takes the rest"),
        ([{"name": "a"}, {"name": "b"}], "'a' takes the rest, so that nothing is left for others"),
        ([{"name": "a", "objects": ["x"]}, {"name": "a"}], "two are named 'a'"),
        (
            [{"name": "a", "objects": ["x"]}, {"name": "b", "objects": ["x"]}, {"name": "c"}],
            "'x' is in 'a' and",
        ),
        ([{"name": "a", "nearer_than": 0.0}, {"name": "b"}], "nearer_than = 0.0: should be greater than 0"),
        ([{"name": "a b"}], "name = 'a b'"),
        ([{"name": "a", "objects": ["x"], "proxi": "box"}, {"name": "b"}], "did you mean `proxy`"),
        ([{"name": "a", "objects": ["x"], "proxy": "cone"}, {"name": "b"}], "proxy = 'cone'"),
        ([{"name": "a", "proxy": "plane"}], "holds the background too, which is on no plane"),
    ],
)
def test_wrong_shells_are_one_line(shells: list[dict[str, Any]], message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message) if "(" in message else message) as caught:
        parse_config({"shells": shells}, "wrong")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("shells", "message"),
    [
        (
            [{"name": "a", "objects": ["flor"]}, {"name": "b"}],
            r"shells\.a: the scene has no object 'flor'; .*screen_dark",
        ),
        (
            [{"name": "a", "objects": ["reflector"]}, {"name": "b"}],
            "'reflector' is the reflector; .*'itself'",
        ),
        (
            [{"name": "a", "objects": ["floor*"]}, {"name": "b", "objects": ["floor_dark"]}, {"name": "c"}],
            "'floor_dark' is in 'a' and again in 'b'",
        ),
    ],
)
def test_shells_of_things_that_are_not_there_are_one_line(
    tmp_path: Path, shells: list[dict[str, Any]], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        build_scene(parse_config(scene(tmp_path, shells), "wrong"))


def test_shells_are_read_from_a_file_and_have_no_layers_beside_them(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(
        '[[shells]]\nname = "near"\nobjects = ["itself", "cup"]\nnearer_than = 2.5\nproxy = "box"\n\n'
        '[[shells]]\nname = "rest"\n'
    )
    config = load_config(path)
    assert config.shells is not None
    assert [shell.name for shell in config.shells] == ["near", "rest"]
    assert (config.shells[0].objects, config.shells[0].nearer_than) == (("itself", "cup"), 2.5)
    again = parse_config(json.loads(config.model_dump_json()), "stored")
    assert again == config
    assert parse_config({"shells": "auto"}, "auto").shells is None
    with pytest.raises(InputError, match=r"layers\.local has no meaning beside \[\[shells\]\]"):
        parse_config({"shells": TWO, "layers": {"local": True}}, "both")
    with pytest.raises(InputError, match=r"maps\.distant and the proxy of 'b' are one"):
        parse_config({"shells": [{"name": "b", "proxy": "box"}], "maps": {"distant": "box"}}, "both")


def test_a_ground_on_its_plane_is_captured_apart_and_composes_to_the_capture(tmp_path: Path) -> None:
    floor = [THREE[0], {"name": "ground", "objects": ["floor*"], "proxy": "plane"}, {"name": "sky"}]
    stage = prepare_stage(parse_config(scene(tmp_path, floor), "floor"))
    origin = (0.0, 0.08, 0.0)
    none, ground, sky = captured_shells(stage, origin, "cube", 32)
    assert none is None
    assert ground is not None
    assert sky is not None
    whole = stage.tracer.capture_cube(origin, 32, [stage.built.reflector], stage.options)
    composed = ground[..., :3] + (1.0 - ground[..., 3:]) * sky
    # Texels on the floor's rim are covered in part, by other rays than those that carry light.
    assert np.mean(np.abs(composed - whole) > 0.02) < 0.02
    # The face -Y looks at the floor alone, +Y at the sky.
    assert np.all(ground[3, ..., 3] == 1.0)
    assert np.all(ground[2, ..., 3] == 0.0)
    # Rays that look down meet the plane, which is the floor of a hemisphere.
    [_, plane, _] = analyze(stage).shells
    proxy = proxy_from_attributes(plane.proxies["object"])
    assert proxy.kind == "hemisphere"
    eye, down = np.array([[0.05, 0.1, -0.03]], np.float32), np.array([[0.3, -0.5, 0.2]], np.float32)
    met = np.asarray(proxy.lookup(eye, down))[0] + np.array(proxy.origin)
    np.testing.assert_allclose(met, eye[0] + 0.2 * down[0], atol=1e-3)


def test_a_ground_under_a_panorama_is_on_its_plane_by_itself(tmp_path: Path) -> None:
    sky = scene(tmp_path, "auto")["surroundings"]["panorama"]
    around = {"panorama": sky, "ground": {"radius": 0.5}}
    stage = prepare_stage(parse_config(scene(tmp_path, "auto", surroundings=around), "ground"))
    plan = analyze(stage)
    [local, ground, distant] = plan.shells
    assert (local.name, ground.name, distant.name) == ("local", "ground", "distant")
    below, above = ground.proxies["object"], distant.proxies["object"]
    # The floor of a hemisphere, just below the object; the sky is as far away as it is.
    assert (below["shape"], above["shape"]) == ("hemisphere", "infinite")
    np.testing.assert_allclose(below["centre"][1], 0.0, atol=1e-3)
    decision = next(decision for decision in plan.decisions if decision.key == "shells")
    assert decision.automatic
    assert decision.measured is not None
    assert re.search(
        r"ground, which \d+\.\d% of the rays meet, lies on a plane: .* by 0\.\d+ without", str(decision)
    )
    # A static map at infinity reads the ground elsewhere; on its plane it is read where it is met.
    probe = Probe.of(stage, 2)
    at_infinity = captured_error(
        stage, probe, DEFAULT_SHELLS, 2, _core.Proxy.infinite(capture_place(stage).position)
    )
    on_plane = captured_error(stage, probe, plan.shell_sections, 2)
    assert 20.0 * np.log10(at_infinity / on_plane) > 12.0
    assert decision.measured < 0.02


def test_screens_are_found_by_their_distance_and_pay(tmp_path: Path, three: OpenedPem) -> None:
    bake(parse_config(scene(tmp_path, "auto"), "found"), tmp_path / "found")
    found = open_pem(tmp_path / "found")
    rules = found.store.header.rules
    assert [rule.name for rule in rules] == ["local", "near", "ground", "distant"]
    assert sorted(rules[1].objects) == ["screen_dark", "screen_light"]
    assert sorted(rules[2].objects) == ["floor_dark", "floor_light"]
    # Off the samples nearly as good as shells that a person would write, 29.8 of 30.6 dB; two shells: 26.9.
    assert off_samples(found) > off_samples(three) - 1.0


@pytest.mark.parametrize(
    ("sections", "reason"),
    [
        ({"layers": {"diffuse": False, "local": True}}, "layers.local is about these two"),
        ({"maps": {"size": 32, "distant": "box"}}, "maps.distant is about these two"),
        ({"infer": {"fit": "layers"}}, 'infer.fit = "layers" is about these two'),
    ],
)
def test_what_is_about_two_shells_keeps_two(tmp_path: Path, sections: dict[str, Any], reason: str) -> None:
    plan = analyze(prepare_stage(parse_config(scene(tmp_path, "auto", **sections), "two")))
    assert [shell.name for shell in plan.shells] == ["local", "distant"]
    assert any(reason in str(decision) for decision in plan.decisions if decision.key == "shells")


def test_a_plane_is_found_through_points() -> None:
    random = np.random.default_rng(3)
    normal = np.array([0.2, 0.9, -0.1])
    normal /= np.linalg.norm(normal)
    across = np.linalg.svd(normal[None])[2][1:]
    points = random.uniform(-2, 2, (500, 2)) @ across + 0.5 * normal
    proxy, thickness = plane_through(points, (0.1, 2.0, 0.3))
    assert proxy is not None
    assert thickness < 1e-6
    rows = np.asarray(proxy.axes)
    np.testing.assert_allclose(np.abs(rows[1] @ normal), 1.0, atol=1e-6)
    # On the side of the origin, and right-handed.
    assert rows[1] @ (np.array([0.1, 2.0, 0.3]) - points[0]) > 0.0
    np.testing.assert_allclose(np.linalg.det(rows), 1.0, atol=1e-5)
    thick = points + random.normal(size=(500, 1)) * 0.5 * normal
    assert plane_through(thick, (0.1, 2.0, 0.3))[1] > 0.1
    flat, _ = plane_through(points, tuple(0.5 * normal))
    assert flat is None

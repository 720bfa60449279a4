from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import pytest

from mirrorbake.errors import InputError
from mirrorbake.scene.config import PATH_KEYS, SECTIONS, SceneConfig
from mirrorbake.scene.load import load_config, parse_config, parse_override
from mirrorbake.scene.parameters import space_of
from mirrorbake.scene.plan import DECIDED_KEYS


def test_an_empty_scene_is_the_teapot_in_its_room_at_the_papers_size() -> None:
    config = parse_config({}, "scene")
    assert config.reflector.object == "teapot"
    assert config.reflector.subdivisions == 25
    assert config.surroundings.room == "furnished"
    assert (config.views.count, config.views.degrees) == (100, 99.0)
    assert config.views.size == (512, 512)
    assert (config.maps.size, config.maps.distant) == (None, None)
    assert (config.trace.samples, config.trace.depth) == (None, None)
    assert (config.layers.diffuse, config.layers.local) == (None, None)


def test_auto_is_a_value_of_every_key_that_is_decided_before_a_bake() -> None:
    values: dict[str, bool | int | float | str] = {
        "trace.depth": 3, "trace.samples": 2, "layers.diffuse": True,
        "layers.local": False, "layers.hull_split": True, "maps.distant": "rotated box", "maps.size": 64,
        "maps.shared_distant": True,
        "trace.noise": 0.05, "views.traced": 1, "infer.passes": 3, "infer.neighbours": 0.5, "static.views": 8,
        "reflector.longest_edge": 0.5, "layers.lightmap": 64, "reflector.parts": 4, "views.around": 4,
    }  # fmt: skip
    # Shells are a list of tables, which has tests of its own.
    assert values.keys() | {"shells"} == set(DECIDED_KEYS)
    for key, value in values.items():
        section, name = key.split(".")
        explicit = parse_config({section: {name: value}}, "scene")
        assert getattr(getattr(explicit, section), name) == value
        automatic = parse_config({section: {name: "auto"}}, "scene")
        assert automatic == parse_config({}, "scene")
        # A PEM keeps the text, so that a bake with a value of its own is told from one that decides.
        dumped = json.loads(automatic.model_dump_json())
        assert dumped[section][name] == "auto"
        assert parse_config(dumped, "PEM") == automatic


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"maps": {"size": 100}}, "scene: maps.size = 100: should be a power of two"),
        ({"maps": {"size": "large"}}, "scene: maps.size = 'large': should be a valid integer, or 'auto'"),
        ({"trace": {"noise": "low"}}, "scene: trace.noise = 'low': should be a valid number, or 'auto'"),
        ({"layers": {"local": "on"}}, "scene: layers.local = 'on': should be a valid boolean, or 'auto'"),
        ({"trace": {"depth": 65}}, "scene: trace.depth = 65: should be less than or equal to 64"),
        ({"auto": {"tolerance": 1.0}}, "scene: auto.tolerance = 1.0: should be less than 1"),
        ({"maps": {"size": 0}}, "scene: maps.size = 0: should be greater than or equal to 1"),
        ({"maps": {"size": 8192}}, "scene: maps.size = 8192: should be less than or equal to 4096"),
        ({"maps": {"size": 64.0}}, "scene: maps.size = 64.0: should be a valid integer"),
        ({"maps": {"sise": 64}}, "scene: maps.sise: is not a key of this section; did you mean `size`?"),
        ({"map": {}}, "scene: map: is not a key of this section; did you mean `maps`?"),
        ({"maps": 3}, "scene: maps: should be a section"),
        ({"views": {"count": 0}}, "scene: views.count = 0: should be greater than or equal to 1"),
        ({"views": {"size": [512, 0]}}, "scene: views.size.1 = 0: should be greater than or equal to 1"),
        (
            {"views": {"size": [512, 16385]}},
            "scene: views.size.1 = 16385: should be less than or equal to 16384",
        ),
        ({"views": {"size": [512]}}, "scene: views.size.1: is required"),
        ({"views": {"fov": 180}}, "scene: views.fov = 180: should be less than 180"),
        ({"views": {"fov": float("nan")}}, "scene: views.fov = nan: should be a finite number"),
        ({"views": {"centre": [0, 1]}}, "scene: views.centre.2: is required"),
        (
            {"views": {"centre": [0, 1, float("inf")]}},
            "scene: views.centre.2 = inf: should be a finite number",
        ),
        ({"trace": {"samples": 0}}, "scene: trace.samples = 0: should be greater than or equal to 1"),
        ({"trace": {"samples": True}}, "scene: trace.samples = True: should be a valid integer"),
        ({"reflector": {"object": "cow"}}, "scene: reflector.object = 'cow': should be 'teapot'"),
        (
            {"reflector": {"object": "teapot", "mesh": "a.obj"}},
            "scene: reflector: give either `object`, `mesh` or `scene_object`",
        ),
        (
            {"material": {"r0": 1.5}},
            "scene: material.r0.0 = 1.5: should be less than or equal to 1 (and 2 more)",
        ),
        (
            {"material": {"fresnel": "schlick", "ior": 1.5}},
            "scene: material: `ior` has no meaning for fresnel = 'schlick'",
        ),
        (
            {"material": {"fresnel": "conductor", "metal": "mithril"}},
            "scene: material.metal = 'mithril': metal is mithril, expected aluminium, silver, gold, copper, "
            "chromium or titanium",
        ),
        (
            {"material": {"lobe": "phong", "roughness": 0.2}},
            "scene: material: `roughness` has no meaning for lobe = 'phong'",
        ),
        (
            {"material": {"roughness": 0.2, "exponent": 10}},
            "scene: material: `exponent` has no meaning for lobe = 'ggx'",
        ),
        (
            {"material": {"roughness": 0}},
            "scene: material.roughness = 0: should be greater than 0",
        ),
        (
            {"material": {"fresnel": "conductor", "eta": 0.2}},
            "scene: material: fresnel = 'conductor' needs either `metal`, or `eta` and `k`",
        ),
    ],
)
def test_a_wrong_key_is_named_with_its_value_and_what_was_expected(
    data: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError) as caught:
        parse_config(data, "scene")
    assert str(caught.value) == message


def test_one_number_stands_for_all_three_channels() -> None:
    config = parse_config({"material": {"fresnel": "dielectric", "ior": 1.5}}, "scene")
    assert config.material is not None
    assert config.material.ior == (1.5, 1.5, 1.5)


def test_views_are_spread_evenly_from_0_to_1() -> None:
    five, one = (space_of(parse_config({"views": {"count": n}}, "scene")).samples() for n in (5, 1))
    assert five == [(0,), (0.25,), (0.5,), (0.75,), (1,)]
    assert one == [(0,)]


def test_a_config_survives_the_way_through_json() -> None:
    import json

    config = parse_config({"material": {"albedo": 0.2}, "views": {"centre": [0, 0.1, 0]}}, "scene")
    assert parse_config(json.loads(config.model_dump_json()), "copy") == config


def test_paths_are_relative_to_the_scene_file_and_overrides_to_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, elsewhere = tmp_path / "scenes", tmp_path / "elsewhere"
    folder.mkdir()
    elsewhere.mkdir()
    scene = folder / "scene.toml"
    scene.write_text('[reflector]\nmesh = "cow.obj"\n[surroundings]\npanorama = "/abs/sky.exr"\n')
    monkeypatch.chdir(elsewhere)
    config = load_config(scene)
    assert config.reflector.mesh == str(folder / "cow.obj")
    assert config.surroundings.panorama == "/abs/sky.exr"
    config = load_config(scene, [parse_override("reflector.mesh=bunny.obj")])
    assert config.reflector.mesh == str(elsewhere / "bunny.obj")


def test_an_override_of_the_mesh_replaces_the_built_in_object(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text('[reflector]\nobject = "teapot"\n[surroundings]\nroom = "furnished"\n')
    overrides = [
        "reflector.mesh=/m.obj",
        "surroundings.panorama=/p.exr",
        "maps.size=32",
        "views.centre=[0,1,0]",
    ]
    config = load_config(scene, [parse_override(text) for text in overrides])
    assert (config.reflector.object, config.reflector.mesh) == (None, "/m.obj")
    assert (config.surroundings.room, config.surroundings.panorama) == (None, "/p.exr")
    assert config.maps.size == 32
    assert config.views.centre == (0, 1, 0)


def test_an_override_of_the_fresnel_model_drops_the_parameters_of_the_other(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text('[material]\nfresnel = "conductor"\nmetal = "gold"\n')
    overrides = [parse_override("material.fresnel=dielectric"), parse_override("material.ior=1.3")]
    material = load_config(scene, overrides).material
    assert material is not None
    assert (material.fresnel, material.ior, material.metal) == ("dielectric", (1.3, 1.3, 1.3), None)
    material = load_config(
        scene, [parse_override("material.eta=0.2"), parse_override("material.k=3")]
    ).material
    assert material is not None
    assert (material.eta, material.metal) == ((0.2, 0.2, 0.2), None)


@pytest.mark.parametrize("text", ["maps.size", "size=3", "=3", "maps.=3", ""])
def test_an_override_without_a_key_path_is_rejected(text: str) -> None:
    with pytest.raises(InputError, match=r"expected section\.key=value"):
        parse_override(text)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"[views\ncount = 3\n", "not valid TOML: "),
        (b"[views]\ncount = \n", "not valid TOML: .*line 2"),
        (b'title = "\xff\xfe"', "not UTF-8 text"),
        (b"a = " + b"[" * 100_000, "not valid TOML"),
        (b"#" * (1 << 20) + b"#", "at most 1048576"),
    ],
)
def test_a_file_that_is_not_toml_is_one_clear_error(tmp_path: Path, content: bytes, message: str) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        load_config(scene)
    assert str(caught.value).startswith(str(scene))


def test_a_byte_order_mark_is_no_part_of_a_scene_file(tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_bytes(b"\xef\xbb\xbf[views]\ncount = 3\n")
    assert load_config(scene).views.count == 3


def test_a_device_or_a_pipe_is_no_scene_file(tmp_path: Path) -> None:
    pipe = tmp_path / "scene.toml"
    os.mkfifo(pipe)
    for path in (pipe, Path("/dev/zero")):
        with pytest.raises(InputError, match="is not a regular file"):
            load_config(path)
    with pytest.raises(InputError, match=r"(Is a directory|is not a regular file)"):
        load_config(tmp_path)


def test_a_missing_scene_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.toml: No such file"):
        load_config(tmp_path / "nowhere.toml")


def test_every_key_of_the_scene_file_is_in_its_reference_page(request: pytest.FixtureRequest) -> None:
    page = request.config.rootpath / "docs" / "reference" / "scene-toml.md"
    text = page.read_text(encoding="utf-8")
    sections = {"material": {}, "motion": {"turn": 1}, "light": {}, "surroundings": {"panorama": "/sky.exr"}}
    config = parse_config(sections, "scene")
    for section in SceneConfig.model_fields:
        assert f"`[{section}]`" in text or f"`[[{section}]]`" in text
        for key in SECTIONS[section].model_fields:
            assert f"`{key}`" in text, f"{section}.{key} is not documented"
    for section, key in PATH_KEYS:
        assert key in type(getattr(config, section)).model_fields


def test_every_key_alone_has_defaults_beside_it() -> None:
    assert parse_config({"reflector": {"height": 0.2}}, "scene").reflector.object == "teapot"
    assert parse_config({"surroundings": {"rotation": 30.0}}, "scene").surroundings.room == "furnished"
    gold = parse_config({"material": {"metal": "gold"}}, "scene").material
    assert gold is not None
    assert gold.fresnel == "conductor"
    glass = parse_config({"material": {"ior": 1.7}}, "scene").material
    assert glass is not None
    assert glass.fresnel == "dielectric"
    chrome = parse_config({"material": {"metal": "Chrome"}}, "scene").material
    assert chrome is not None
    assert chrome.metal == "chromium"

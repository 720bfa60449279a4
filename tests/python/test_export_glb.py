"""A PEM as a glTF file, read back by code that shares nothing with the writer."""

from __future__ import annotations

import io
import json
import struct
import subprocess
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jsonschema
import numpy as np
import pytest
from PIL import Image

from mirrorbake import _core
from mirrorbake.bake import count_parts
from mirrorbake.bake.bake import bake
from mirrorbake.errors import InputError, OptionError
from mirrorbake.pem.export.glb import export_glb
from mirrorbake.pem.export.glb_file import GlbFile
from mirrorbake.pem.export.gltf_material import add_textures, gltf_material
from mirrorbake.pem.export.mesh_file import has_border
from mirrorbake.pem.opened import built_scene
from mirrorbake.pem.store import PemStore
from mirrorbake.scene.load import parse_config
from unwrapped import write_post_on_plate
from viewer_cases import case_scene, cases
from web_tools import node_folder

from .gltf_scene import pair_of_primitives

if TYPE_CHECKING:
    from mirrorbake.scene.build import BuiltScene

ROOT = Path(__file__).parents[2]
SCHEMA = json.loads((ROOT / "docs" / "reference" / "EXT_mirrorbake_pem.schema.json").read_text())
SIZE = 16
SMALL = {
    "reflector": {"object": "teapot", "subdivisions": 4, "parts": "split"},
    "material": {"albedo": 0.3, "fresnel": "dielectric", "ior": 1.6},
    "views": {"count": 2, "degrees": 2.0, "size": [48, 48]},
    "maps": {"size": SIZE},
    "layers": {"diffuse": True, "lightmap": 0, "local": True, "hull_split": True},
    "trace": {"samples": 2, "indirect": "none"},
    "auto": {"quality": "draft"},
}


class Glb:
    """A reader by the text of the specification."""

    def __init__(self, data: bytes) -> None:
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON"
        self.json: dict[str, Any] = json.loads(data[20 : 20 + size])
        binary, kind = struct.unpack_from("<I4s", data, 20 + size)
        assert kind == b"BIN\0"
        self.binary = data[28 + size : 28 + size + binary]

    def view(self, number: int) -> bytes:
        view = self.json["bufferViews"][number]
        return self.binary[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]

    def accessor(self, number: int) -> Any:
        accessor = self.json["accessors"][number]
        dtype = {5126: "<f4", 5125: "<u4"}[accessor["componentType"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        values = np.frombuffer(self.view(accessor["bufferView"]), dtype)
        return values.reshape(accessor["count"], width)

    def image(self, number: int) -> Any:
        return np.asarray(Image.open(io.BytesIO(self.view(self.json["images"][number]["bufferView"]))))

    @property
    def extension(self) -> dict[str, Any]:
        found: dict[str, Any] = self.json["extensions"]["EXT_mirrorbake_pem"]
        return found

    @property
    def primitives(self) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = self.json["meshes"][0]["primitives"]
        return found


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> tuple[PemStore, BuiltScene]:
    directory = tmp_path_factory.mktemp("glb") / "pem"
    config = parse_config(SMALL, "small")
    bake(config, directory)
    store = PemStore.open(directory)
    return store, built_scene(store)


@pytest.fixture(scope="module")
def path(baked: tuple[PemStore, BuiltScene], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("out") / "teapot.glb"
    export_glb(*baked, out, samples=[1])
    return out


@pytest.fixture(scope="module")
def glb(path: Path) -> Glb:
    return Glb(path.read_bytes())


def assert_valid(path: Path) -> None:
    done = subprocess.run(
        ["node", "validate.cjs", path],
        cwd=node_folder("tests/web"),
        capture_output=True,
        text=True,
        check=True,
    )
    issues = json.loads(done.stdout)
    assert issues["numErrors"] == 0, issues["messages"]
    assert issues["numWarnings"] == 0, issues["messages"]
    # What it says of the rest: our extension and what only that uses, and images that are no power of two.
    assert {m["code"] for m in issues["messages"]} <= {
        "UNSUPPORTED_EXTENSION",
        "UNUSED_OBJECT",
        "IMAGE_NPOT_DIMENSIONS",
    }


def test_the_khronos_validator_finds_no_fault(path: Path) -> None:
    assert_valid(path)


def test_the_extension_is_as_its_schema_says(glb: Glb) -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    jsonschema.validate(glb.extension, SCHEMA)
    for kind, objects in (("primitive", glb.primitives), ("material", glb.json["materials"])):
        for item in objects:
            part = {"$ref": f"#/$defs/{kind}", "$defs": SCHEMA["$defs"]}
            jsonschema.validate(item["extensions"]["EXT_mirrorbake_pem"], part)
    assert set(glb.json["extensionsUsed"]) == {"EXT_mirrorbake_pem", "KHR_materials_ior"}
    assert "extensionsRequired" not in glb.json
    broken = {**glb.extension, "sets": []}
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(broken, SCHEMA)


def test_parts_that_the_plan_has_cut_are_all_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(count_parts, "TOLERANCE", 0.0)
    monkeypatch.setattr(count_parts, "WORTH", 0.01)
    reflector = {"object": "teapot", "subdivisions": 8, "parts": "auto"}
    config = {**SMALL, "reflector": reflector, "layers": {"diffuse": False}}
    bake(parse_config(config, "parts"), tmp_path / "pem")
    store = PemStore.open(tmp_path / "pem")
    count = len(store.header.parts)
    assert count > 2
    built = built_scene(store)
    export_glb(store, built, tmp_path / "parts.glb")
    glb = Glb((tmp_path / "parts.glb").read_bytes())
    parts = [primitive["extensions"]["EXT_mirrorbake_pem"]["part"] for primitive in glb.primitives]
    assert sorted(parts) == list(range(count))
    assert sum(len(glb.accessor(p["indices"])) for p in glb.primitives) == 3 * len(built.triangles)


def test_the_mesh_is_the_reflector(glb: Glb, baked: tuple[PemStore, BuiltScene]) -> None:
    store, built = baked
    mesh = built.scene.object_mesh(built.reflector)
    attributes = glb.primitives[0]["attributes"]
    np.testing.assert_array_equal(glb.accessor(attributes["POSITION"]), built.positions)
    np.testing.assert_array_equal(glb.accessor(attributes["NORMAL"]), mesh.normals)
    np.testing.assert_allclose(
        glb.accessor(attributes["TEXCOORD_0"]), [[0, 1]] + mesh.uvs * [1, -1], atol=1e-7
    )
    irradiance = store.read_irradiance()
    assert irradiance is not None
    np.testing.assert_array_equal(glb.accessor(attributes["_IRRADIANCE"]), irradiance[:, :3])
    local = store.read_local_triangles()
    assert local is not None
    for primitive in glb.primitives:
        extension = primitive["extensions"]["EXT_mirrorbake_pem"]
        triangles = glb.accessor(primitive["indices"]).reshape(-1, 3)
        part = built.parts == extension["part"]
        stacked = extension["stackIndices"] // 3
        for written, expected in (
            (triangles[:stacked], built.triangles[part & (local != 0)]),
            (triangles[stacked:], built.triangles[part & (local == 0)]),
        ):
            assert len(written) > 0
            np.testing.assert_array_equal(written, expected)


def test_our_own_reader_takes_it_for_a_scene(path: Path, baked: tuple[PemStore, BuiltScene]) -> None:
    built = baked[1]
    loaded = _core.load_scene(str(path))
    read = [np.asarray(loaded.scene.object_mesh(i).triangles) for i in range(len(loaded.scene.object_names))]
    # It leaves out the triangles without area at the teapot's poles.
    corners = built.positions[built.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert sum(len(triangles) for triangles in read) == np.count_nonzero(np.abs(normals).sum(axis=1))
    material = loaded.scene.material(loaded.scene.object_material(0))
    assert material.specular
    np.testing.assert_allclose(material.albedo, 0.3, atol=1e-6)


def read_level(glb: Glb, shell: dict[str, Any], level: int, image: str) -> Any:
    """Faces of a level, by the text of docs/reference/ext-mirrorbake-pem.md."""
    codes = glb.image(shell[image])
    size, s = shell["size"], shell["size"] >> level
    top = 0 if level == 0 else 2 * size
    left = sum(3 * (size >> finer) for finer in range(1, level))
    rows = [codes[top + r * s : top + r * s + s, left : left + 3 * s] for r in range(2)]
    return np.stack([row[:, c * s : c * s + s] for row in rows for c in range(3)])


def test_every_level_of_every_map_comes_back(glb: Glb, baked: tuple[PemStore, BuiltScene]) -> None:
    store = baked[0]
    code = glb.extension["radianceCode"]
    static, sample = glb.extension["sets"]
    assert static["name"] == "static"
    assert "point" not in static
    assert sample["point"] == [1.0]
    assert [axis["name"] for axis in glb.extension["axes"]] == ["arc"]
    step = (code["high"] - code["low"]) / 255.0
    for part in sample["parts"]:
        assert [shell["name"] for shell in part["shells"]] == ["local", "distant"]
        for shell in part["shells"]:
            pyramid = store.read_map(part["name"], shell["name"], 1)
            offset = 0
            for level in range(SIZE.bit_length()):
                count = 6 * (SIZE >> level) ** 2
                expected = np.maximum(pyramid[offset : offset + count], 0.0)  # residuals may round below 0
                offset += count
                codes = read_level(glb, shell, level, "radiance").reshape(count, 3).astype(np.float64)
                radiance = np.maximum(np.exp2(code["low"] + codes * step) - code["epsilon"], 0.0)
                # Half a step of the code.
                bound = (expected[:, :3] + code["epsilon"]) * (2.0 ** (0.5 * step) - 1.0)
                assert (np.abs(radiance - expected[:, :3]) <= 1.001 * bound + 1e-6).all()
                if "alpha" in shell:
                    alpha = read_level(glb, shell, level, "alpha").reshape(count) / 255.0
                    np.testing.assert_allclose(alpha, np.clip(expected[:, 3], 0, 1), atol=0.5 / 255 + 1e-6)
        assert "alpha" not in part["shells"][-1]
        assert [shell.get("offHull", False) for shell in part["shells"]] == [True, False]


def test_the_static_map_of_all_parts_is_there_once(glb: Glb) -> None:
    numbers = [part["shells"][0]["radiance"] for part in glb.extension["sets"][0]["parts"]]
    assert len(numbers) == 2
    assert len(set(numbers)) == 1


def test_a_metal_is_a_metal_of_its_colour_and_glass_has_its_index() -> None:
    schlick = _core.Fresnel("schlick", (0.9, 0.6, 0.3))
    gold, _ = gltf_material(_core.Material(name="gold", specular=True, albedo=(0, 0, 0), fresnel=schlick))
    assert gold["pbrMetallicRoughness"]["metallicFactor"] == 1.0
    np.testing.assert_allclose(
        gold["pbrMetallicRoughness"]["baseColorFactor"], [0.9, 0.6, 0.3, 1.0], rtol=1e-6
    )
    # Silver at 550 nm, n = 0.125, k = 3.34: ((n-1)² + k²) / ((n+1)² + k²).
    silver = _core.Fresnel("conductor", eta=(0.125,) * 3, k=(3.34,) * 3)
    metal, _ = gltf_material(_core.Material(name="silver", specular=True, fresnel=silver))
    expected = (0.875**2 + 3.34**2) / (1.125**2 + 3.34**2)
    np.testing.assert_allclose(metal["pbrMetallicRoughness"]["baseColorFactor"][:3], expected, rtol=1e-4)
    glass = _core.Fresnel("dielectric", eta=(1.6,) * 3)
    coat, _ = gltf_material(
        _core.Material(name="glass", specular=True, albedo=(0.2, 0.3, 0.4), fresnel=glass)
    )
    assert coat["pbrMetallicRoughness"]["metallicFactor"] == 0.0
    assert coat["extensions"]["KHR_materials_ior"]["ior"] == pytest.approx(1.6, rel=1e-6)
    tinted = _core.Fresnel("schlick", (0.04, 0.02, 0.01))
    coat, _ = gltf_material(_core.Material(name="tinted", specular=True, fresnel=tinted))
    colour = coat["extensions"]["KHR_materials_specular"]["specularColorFactor"]
    np.testing.assert_allclose(colour, [1.0, 0.5, 0.25], rtol=1e-5)


def test_what_cannot_be_written_is_refused(baked: tuple[PemStore, BuiltScene], tmp_path: Path) -> None:
    with pytest.raises(OptionError, match="sample = 2: expected 0 to 1"):
        export_glb(*baked, tmp_path / "a.glb", samples=[2])
    with pytest.raises(InputError, match="cannot write"):
        export_glb(*baked, tmp_path / "missing" / "a.glb")
    assert not list(tmp_path.iterdir())


def test_textures_of_the_material_go_with_it() -> None:
    case = next(case for case in cases() if case.textured)
    materials = case_scene(case).materials
    first = materials.materials[0]
    for fresnel, base in ((first.fresnel, "reflectance"), (_core.Fresnel(r0=(0.04,) * 3), "albedo")):
        core = _core.Material(name="shiny", specular=True, albedo=(0.4, 0.4, 0.4), fresnel=fresnel)
        described, _ = gltf_material(core)
        described.setdefault("extensions", {})
        file = GlbFile()
        add_textures(described, first, materials.textures, file, 32, {})
        file.document["materials"] = [described]
        glb = Glb(file.to_bytes())
        material = glb.json["materials"][0]
        used = material["pbrMetallicRoughness"]["baseColorTexture"]
        texture = glb.json["textures"][used["index"]]
        number = first.reflectance_texture if base == "reflectance" else first.albedo_texture
        assert number is not None
        pixels = glb.image(texture["source"]) / 255.0
        linear = np.where(pixels <= 0.04045, pixels / 12.92, ((pixels + 0.055) / 1.055) ** 2.4)
        assert np.abs(linear - materials.textures[number.texture].pixels(32)).max() < 2.3 * 0.51 / 255.0
        wraps = [10497, 10497] if base == "albedo" else [33648, 33648]
        assert list(glb.json["samplers"][texture["sampler"]].values()) == wraps
        assert used["extensions"]["KHR_texture_transform"] == {
            "offset": list(number.offset),
            "scale": list(number.scale),
            "rotation": number.rotation,
        }
        assert material["normalTexture"]["scale"] == 1.0
        assert ("specularColorTexture" in material["extensions"].get("KHR_materials_specular", {})) == (
            base == "albedo"
        )


TWO_MATERIALS = """mtllib two.mtl
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
v 1 0 1
v 0 1 1
o front
usemtl gold
f 1 2 3
f 4 5 6
o side
usemtl cloth
f 1 3 4
"""


def test_every_part_has_its_own_material_and_the_static_set_is_the_pems(tmp_path: Path) -> None:
    (tmp_path / "two.mtl").write_text(
        "newmtl gold\nKs 0.9 0.7 0.2\nillum 3\nnewmtl cloth\nKd 0.2 0.4 0.6\nillum 1\n"
    )
    (tmp_path / "two.obj").write_text(TWO_MATERIALS)
    config = parse_config(
        {
            "reflector": {"mesh": str(tmp_path / "two.obj")},
            "views": {"count": 1, "size": [24, 24]},
            "maps": {"size": 8, "distant": "infinite"},
            "trace": {"samples": 2, "indirect": "none"},
            "auto": {"quality": "draft"},
            "static": {"views": 2},
        },
        "two",
    )
    bake(config, tmp_path / "pem")
    store = PemStore.open(tmp_path / "pem")
    built = built_scene(store)
    export_glb(store, built, tmp_path / "two.glb")
    glb = Glb((tmp_path / "two.glb").read_bytes())
    assert [material["name"] for material in glb.json["materials"]] == ["gold", "cloth"]
    by_part = {p["extensions"]["EXT_mirrorbake_pem"]["part"]: p for p in glb.primitives}
    assert [by_part[part]["material"] for part in range(2)] == [0, 1]
    assert [glb.json["accessors"][by_part[part]["indices"]]["count"] for part in range(2)] == [6, 3]
    jsonschema.validate(glb.extension, SCHEMA)
    fade = store.header.static["fade"]
    assert glb.extension["fadeDegrees"] == fade["degrees"]
    (static,) = glb.extension["sets"]
    stored, code = store.read_static_maps(), glb.extension["radianceCode"]
    assert stored is not None
    for part in static["parts"]:
        assert [shell["name"] for shell in part["shells"]] == [
            shell.name for shell in store.header.parts[0].shells
        ]
        last = part["shells"][-1]
        expected = stored[store.header.map_of(part["name"], last["name"])][: 6 * 64, :3]
        step = (code["high"] - code["low"]) / 255.0
        codes = read_level(glb, last, 0, "radiance").reshape(-1, 3).astype(np.float64)
        radiance = np.maximum(np.exp2(code["low"] + codes * step) - code["epsilon"], 0.0)
        bound = (np.maximum(expected, 0.0) + code["epsilon"]) * (2.0 ** (0.5 * step) - 1.0)
        assert (np.abs(radiance - np.maximum(expected, 0.0)) <= 1.001 * bound + 1e-6).all()


def test_primitives_with_a_normal_texture_keep_their_tangents(tmp_path: Path) -> None:
    config = parse_config(
        {
            "reflector": {"mesh": pair_of_primitives(tmp_path)},
            "views": {"count": 1, "size": [24, 24]},
            "maps": {"size": 8, "distant": "infinite"},
            "trace": {"samples": 2, "indirect": "none"},
            "auto": {"quality": "draft"},
        },
        "pair",
    )
    bake(config, tmp_path / "pem")
    store = PemStore.open(tmp_path / "pem")
    export_glb(store, built_scene(store), tmp_path / "pair.glb")
    glb = Glb((tmp_path / "pair.glb").read_bytes())
    by_material = {glb.json["materials"][p["material"]]["name"]: p for p in glb.primitives}
    assert "TANGENT" not in by_material["gold"]["attributes"]
    cloth = by_material["cloth"]
    tangents = glb.accessor(cloth["attributes"]["TANGENT"])
    used = tangents[glb.accessor(cloth["indices"])[:, 0]]
    np.testing.assert_allclose(used, [[0.6, 0.8, 0.0, -1.0]] * 6, atol=1e-6)
    assert_valid(tmp_path / "pair.glb")


BOWL = """v -1 1 -1
v 1 1 -1
v 1 1 1
v -1 1 1
v 0 0 0
f 1 5 2
f 2 5 3
f 3 5 4
f 4 5 1
"""


UNWRAPPED_BOWL = """v -1 1 -1
v 1 1 -1
v 1 1 1
v -1 1 1
v 0 0 0
vt 0 0
vt 1 0
vt 1 1
vt 0 1
vt 0.5 0.5
f 1/1 5/5 2/2
f 2/2 5/5 3/3
f 3/3 5/5 4/4
f 4/4 5/5 1/1
"""


def test_a_bowl_of_dual_paraboloids_keeps_them_and_the_light_on_its_backs(tmp_path: Path) -> None:
    (tmp_path / "bowl.obj").write_text(BOWL)
    config = parse_config(
        {
            "reflector": {"mesh": str(tmp_path / "bowl.obj")},
            "material": {"albedo": 0.5, "fresnel": "schlick", "r0": [0.5, 0.5, 0.5]},
            "views": {"count": 1, "size": [24, 24]},
            "maps": {"size": 8, "projection": "paraboloid"},
            "layers": {"diffuse": True},
            "trace": {"samples": 2, "indirect": "none"},
            "auto": {"quality": "draft"},
        },
        "bowl",
    )
    bake(config, tmp_path / "pem")
    store = PemStore.open(tmp_path / "pem")
    built = built_scene(store)
    export_glb(store, built, tmp_path / "bowl.glb", samples=[0])
    glb = Glb((tmp_path / "bowl.glb").read_bytes())
    jsonschema.validate(glb.extension, SCHEMA)
    assert glb.extension["projection"] == "paraboloid"
    assert all(material["doubleSided"] for material in glb.json["materials"])
    irradiance = store.read_irradiance()
    assert irradiance is not None
    assert irradiance.shape[1] == 6
    attributes = glb.primitives[0]["attributes"]
    np.testing.assert_array_equal(glb.accessor(attributes["_IRRADIANCE"]), irradiance[:, :3])
    np.testing.assert_array_equal(glb.accessor(attributes["_IRRADIANCE_BACK"]), irradiance[:, 3:])
    code = glb.extension["radianceCode"]
    step = (code["high"] - code["low"]) / 255.0
    sample = glb.extension["sets"][1]
    for part in sample["parts"]:
        for shell in part["shells"]:
            codes = glb.image(shell["radiance"]).astype(np.float64)
            assert codes.shape == (12, 16, 3)
            pyramid = np.maximum(store.read_map(part["name"], shell["name"], 0), 0.0)
            offset = 0
            for level in range(4):
                s = 8 >> level
                top, left = (0, 0) if level == 0 else (8, sum(2 * (8 >> finer) for finer in range(1, level)))
                faces = [codes[top : top + s, left + f * s : left + (f + 1) * s] for f in range(2)]
                radiance = np.exp2(code["low"] + np.stack(faces).reshape(-1, 3) * step) - code["epsilon"]
                expected = pyramid[offset : offset + 2 * s * s, :3]
                offset += 2 * s * s
                bound = (expected + code["epsilon"]) * (2.0 ** (0.5 * step) - 1.0)
                assert (np.abs(np.maximum(radiance, 0.0) - expected) <= 1.001 * bound + 1e-6).all()


@pytest.mark.parametrize("name", ["plate", "bowl"])
def test_a_lightmap_takes_the_place_of_the_light_at_the_vertices(name: str, tmp_path: Path) -> None:
    mesh = tmp_path / f"{name}.obj"
    if name == "plate":
        write_post_on_plate(mesh)
    else:
        mesh.write_text(UNWRAPPED_BOWL)
    config = parse_config(
        {
            "reflector": {"mesh": str(mesh), "parts": "joined"},
            "material": {"albedo": 0.5, "fresnel": "schlick", "r0": [0.5, 0.5, 0.5]},
            "views": {"count": 1, "size": [24, 24]},
            "maps": {"size": 8},
            "layers": {"diffuse": True, "lightmap": 16},
            "trace": {"samples": 2, "indirect": "none"},
            "auto": {"quality": "draft"},
        },
        name,
    )
    bake(config, tmp_path / "pem")
    store = PemStore.open(tmp_path / "pem")
    export_glb(store, built_scene(store), tmp_path / "lit.glb")
    assert_valid(tmp_path / "lit.glb")
    glb = Glb((tmp_path / "lit.glb").read_bytes())
    jsonschema.validate(glb.extension, SCHEMA)
    lightmap = glb.extension["lightmap"]
    assert lightmap["size"] == 16
    assert set(lightmap) == {"size", "low", "high", "front", *(["back"] if name == "bowl" else [])}
    irradiance = store.read_irradiance()
    assert irradiance is not None
    assert irradiance.any()
    np.testing.assert_array_equal(glb.accessor(lightmap["front"]), irradiance[:, :3])
    if name == "bowl":
        np.testing.assert_array_equal(glb.accessor(lightmap["back"]), irradiance[:, 3:])
    for primitive in glb.primitives:
        coordinates = glb.accessor(primitive["attributes"]["TEXCOORD_0"])
        assert lightmap["low"] == pytest.approx(coordinates.min(axis=0).tolist(), abs=1e-6)
        assert lightmap["high"] == pytest.approx(coordinates.max(axis=0).tolist(), abs=1e-6)
        assert not any(attribute.startswith("_IRRADIANCE") for attribute in primitive["attributes"])


def test_only_meshes_that_are_open_are_drawn_from_both_sides() -> None:
    torus = _core.make_torus((0, 0, 0), 1.0, 0.3, 16)
    positions, triangles = np.asarray(torus.positions), np.asarray(torus.triangles)
    assert not has_border(positions, triangles)
    assert has_border(positions, triangles[1:])

"""The files of a PEM on the web."""

import gzip
import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mirrorbake.pem.export.blocks import blocks_of, filled, pixels_of
from mirrorbake.pem.export.images import ImageFormat, probe_image
from mirrorbake.pem.export.mesh_file import ReflectorMesh, octahedral, write_mesh
from mirrorbake.pem.export.radiance_code import RadianceCode, atlas_shape, from_atlas, level_place, to_atlas
from mirrorbake.pem.export.source import ExportSource
from mirrorbake.pem.export.web import WebOptions, WebPem
from mirrorbake.pem.pyramid import topology_of
from mirrorbake.projection import MAP_PROJECTIONS
from viewer_cases import Case, CasePem, Scene, case_scene, case_source, cases, irradiance


@pytest.fixture(scope="module")
def scene() -> Scene:
    return case_scene(cases()[0])


def test_codes_of_radiance_are_off_by_half_a_step_of_their_logarithm() -> None:
    code = RadianceCode.for_range(bright=2.0, largest=40.0)
    radiance = np.linspace(0.0, 40.0, 100_001, dtype=np.float32)
    step = (code.high - code.low) / 255.0
    error = np.log2(code.decode(code.encode(radiance)) + code.epsilon) - np.log2(radiance + code.epsilon)
    assert np.abs(error).max() < 0.5 * step + 1e-5


def test_black_is_code_0_and_comes_back_as_black() -> None:
    code = RadianceCode.for_range(bright=2.0, largest=40.0)
    assert code.encode(np.zeros(3, np.float32)).tolist() == [0, 0, 0]
    assert code.table()[0] == 0.0


def test_radiance_beyond_the_range_is_clamped_to_its_ends() -> None:
    code = RadianceCode.for_range(bright=2.0, largest=40.0)
    assert code.encode(np.array([-1.0, 1e9], np.float32)).tolist() == [0, 255]


@pytest.mark.parametrize("bright", [0.0, 1e-6, 1.0])
def test_maps_that_are_black_have_a_code(bright: float) -> None:
    code = RadianceCode.for_range(bright, 0.0)
    assert code.high > code.low
    assert np.isfinite(code.table()).all()


PROJECTIONS = tuple(MAP_PROJECTIONS)
PAGE_PROJECTIONS = Path(__file__).parents[2] / "viewer" / "src" / "projection.ts"


def test_the_page_lays_the_faces_of_every_projection_as_the_exporter_does() -> None:
    found = re.findall(
        r"^  (\w+): mapProjection\({ faces: (\d+), across: (\d+), acrossEdge: (\w+)",
        PAGE_PROJECTIONS.read_text(encoding="utf-8"),
        re.MULTILINE,
    )
    ours = [(p.name, str(p.faces), str(p.faces_in_a_row)) for p in MAP_PROJECTIONS.values()]
    assert [entry[:3] for entry in found] == ours


@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("size", [1, 2, 8, 64])
def test_an_atlas_holds_every_texel_of_every_level_once(size: int, projection: str) -> None:
    texels = topology_of(projection, size).texels
    pyramid = np.random.default_rng(1).integers(0, 256, (texels, 3), np.uint8)
    atlas = to_atlas(pyramid, size, projection)
    assert atlas.shape == (*atlas_shape(size, projection), 3)
    assert np.array_equal(from_atlas(atlas, size, projection), pyramid)


@pytest.mark.parametrize(("projection", "rows", "columns"), [("cube", 2, 3), ("paraboloid", 1, 2)])
def test_levels_of_an_atlas_do_not_overlap(projection: str, rows: int, columns: int) -> None:
    size = 32
    taken = np.zeros(atlas_shape(size, projection), int)
    for level in range(size.bit_length()):
        row, column = level_place(size, level, projection)
        taken[row : row + rows * (size >> level), column : column + columns * (size >> level)] += 1
    assert taken.max() == 1


def test_exact_images_come_back_bit_by_bit() -> None:
    image = np.random.default_rng(2).integers(0, 256, (24, 40, 3), np.uint8)
    form = ImageFormat(exact=True)
    assert np.array_equal(form.decode(form.encode(image)), image)
    assert np.array_equal(form.decode(form.encode(image[..., 0]))[..., 1], image[..., 0])


def test_avif_images_are_near_and_smaller_with_less_quality() -> None:
    y, x = np.mgrid[0:64, 0:96]
    image = np.stack([2 * x, 3 * y, 255 - x - y], axis=-1).astype(np.uint8)
    good, poor = ImageFormat(exact=False), ImageFormat(exact=False, quality=30)
    error = good.decode(good.encode(image)).astype(float) - image
    assert np.sqrt(np.mean(error**2)) < 1.5
    assert len(poor.encode(image)) < len(good.encode(image))
    # Grey images obey the quality as well.
    noise = np.random.default_rng(3).integers(0, 256, (64, 64), np.uint8)
    assert len(poor.encode(noise)) < 0.5 * len(good.encode(noise))


def test_the_probe_tells_a_limited_range_and_swapped_channels_apart() -> None:
    image = probe_image().astype(float)
    limited = 16.0 + image * (219.0 / 255.0)
    assert np.abs(limited - image).max() > 8.0
    assert np.abs(image[..., ::-1] - image).max() > 8.0


def unfold(fractions: NDArray[np.int16]) -> NDArray[np.float64]:
    xy = fractions / 32767.0
    z = 1.0 - np.abs(xy).sum(axis=1)
    folded = (1.0 - np.abs(xy[:, ::-1])) * np.where(xy >= 0.0, 1.0, -1.0)
    n = np.column_stack([np.where(z[:, None] >= 0.0, xy, folded), z])
    unit: NDArray[np.float64] = n / np.linalg.norm(n, axis=1, keepdims=True)
    return unit


def test_normals_on_the_octahedron_are_within_1e_4_radians() -> None:
    n = np.random.default_rng(4).normal(size=(20_000, 3))
    n = np.concatenate([n, np.eye(3), -np.eye(3)])
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    error = np.linalg.norm(unfold(octahedral(n.astype(np.float32))) - n, axis=1)
    assert error.max() < 1e-4


def read_array(payload: bytes, array: dict[str, int | str]) -> NDArray[np.float64]:
    """What the page's `gather` does."""
    kind, count, components = np.dtype(str(array["type"])), int(array["count"]), int(array["components"])
    start = int(array["offset"])
    planes = np.frombuffer(payload, np.uint8, count * components * kind.itemsize, start)
    ordered = planes.reshape(components, kind.itemsize, count).transpose(2, 0, 1)
    stored = np.ascontiguousarray(ordered).view(kind)[..., 0]
    # Integers are what each adds to the one before.
    read = stored if kind.kind == "f" else np.add.accumulate(stored, axis=0, dtype=kind)
    values: NDArray[np.float64] = read.astype(np.float64)
    return values


def test_a_mesh_comes_back_sorted_by_part_and_shells(scene: Scene) -> None:
    mesh = scene.mesh
    data, layout = write_mesh(mesh)
    payload = gzip.decompress(data)
    assert len(payload) == layout["bytes"]
    arrays = layout["arrays"]
    triangles = read_array(payload, arrays["indices"])[:, 0].astype(np.int64).reshape(-1, 3)
    low, high = np.array(layout["bounds"]["low"]), np.array(layout["bounds"]["high"])
    positions = low + read_array(payload, arrays["positions"]) / 65535.0 * (high - low)
    start = 0
    for part, described in enumerate(layout["ranges"]):
        mine = mesh.parts == part
        assert described == {
            "part": part,
            "material": 0,
            "start": start,
            "stacked": np.count_nonzero(mine & mesh.whole_stack),
            "count": np.count_nonzero(mine),
        }
        start += described["count"]
        expected = np.concatenate(
            [mesh.triangles[mine & mesh.whole_stack], mesh.triangles[mine & ~mesh.whole_stack]]
        )
        seen = triangles[described["start"] : described["start"] + described["count"]]
        error = positions[seen] - mesh.positions[expected]
        # Half a step of 16 bits, and the rounding of float32.
        assert (np.abs(error) <= 0.51 / 65535.0 * (high - low)).all()


def test_triangles_are_sorted_by_material_within_a_part(scene: Scene) -> None:
    materials = (np.arange(len(scene.mesh.triangles)) % 3).astype(np.uint16)
    mesh = replace(scene.mesh, materials=materials)
    _, layout = write_mesh(mesh)
    assert [(r["part"], r["material"]) for r in layout["ranges"]] == [
        (part, material) for part in range(2) for material in range(3)
    ]
    counts = [
        np.count_nonzero((mesh.parts == r["part"]) & (materials == r["material"])) for r in layout["ranges"]
    ]
    assert [r["count"] for r in layout["ranges"]] == counts


def test_texture_coordinates_come_back_with_v_downwards() -> None:
    mesh = case_scene(textured()).mesh
    data, layout = write_mesh(mesh)
    payload, arrays = gzip.decompress(data), layout["arrays"]
    order = read_array(payload, arrays["indices"])[:, 0].astype(np.int64)
    low, high = np.array(layout["uvBounds"]["low"]), np.array(layout["uvBounds"]["high"])
    uvs = (low + read_array(payload, arrays["uvs"]) / 65535.0 * (high - low))[order]
    colors = (read_array(payload, arrays["colors"]) / 65535.0)[order]
    ranked = np.lexsort((~mesh.whole_stack, mesh.materials, mesh.parts))
    expected = mesh.uvs[mesh.triangles[ranked].ravel()] * [1.0, -1.0] + [0.0, 1.0]
    assert (np.abs(uvs - expected) <= 0.51 / 65535.0 * (high - low)).all()
    assert np.abs(colors - mesh.colors[mesh.triangles[ranked].ravel()]).max() <= 0.51 / 65535.0


def test_tangents_come_back_with_the_sign_of_the_bitangent_and_zeros_as_zeros() -> None:
    mesh = case_scene(textured()).mesh
    data, layout = write_mesh(mesh)
    payload, arrays = gzip.decompress(data), layout["arrays"]
    order = read_array(payload, arrays["indices"])[:, 0].astype(np.int64)
    stored = read_array(payload, arrays["tangents"])[order] / 32767.0
    ranked = np.lexsort((~mesh.whole_stack, mesh.materials, mesh.parts))
    expected = mesh.tangents[mesh.triangles[ranked].ravel()]
    np.testing.assert_array_equal(stored[:, 2], expected[:, 3])
    assert set(stored[:, 2]) == {0.0, -1.0}
    z = 1.0 - np.abs(stored[:, :2]).sum(axis=1)
    folded = (1.0 - np.abs(stored[:, 1::-1])) * np.where(stored[:, :2] >= 0.0, 1.0, -1.0)
    xy = np.where(z[:, None] >= 0.0, stored[:, :2], folded)
    found = np.concatenate([xy, z[:, None]], axis=1)
    found /= np.linalg.norm(found, axis=1, keepdims=True)
    turned = expected[:, 3] != 0.0
    # The largest error of 16 bits is 5e-5 rad (Cigolle et al. 2014).
    assert np.linalg.norm(found[turned] - expected[turned, :3], axis=1).max() < 1e-4


def textured() -> Case:
    return next(case for case in cases() if case.textured)


def test_textures_are_written_as_they_were_or_smaller() -> None:
    case = textured()
    source = case_source(case, case_scene(case), CasePem())
    texels = source.materials.textures[0].pixels(64)
    exact = ImageFormat(exact=True)
    web = WebPem(source, WebOptions(exact))
    described = json.loads(web.read("manifest.json"))
    assert [t["linear"] for t in described["textures"]] == [False, False, True]
    assert described["textures"][1]["wrap"] == ["mirror", "mirror"]
    seen = exact.decode(web.read(described["textures"][0]["image"] + ".webp")) / 255.0
    linear = np.where(seen <= 0.04045, seen / 12.92, ((seen + 0.055) / 1.055) ** 2.4)
    # Half a step of 8 bits, at sRGB's steepest 2.3 wide.
    assert np.abs(linear - texels).max() < 2.3 * 0.51 / 255.0
    small = WebPem(source, WebOptions(exact, texture_size=16))
    assert exact.decode(small.read("textures/0.webp")).shape == (16, 16, 3)
    means = texels.reshape(16, 4, 16, 4, 3).mean(axis=(1, 3))
    assert np.abs(source.materials.textures[0].pixels(16) - means).max() < 1e-6


def test_irradiance_that_changes_is_written_for_every_sample() -> None:
    case = next(case for case in cases() if case.moves)
    scene = case_scene(case)
    web = WebPem(case_source(case, scene, CasePem()), WebOptions())
    names = [sample["irradiance"] for sample in json.loads(web.read("manifest.json"))["samples"]]
    count = json.loads(web.read("manifest.json"))["mesh"]["arrays"]["positions"]["count"]
    array = {"type": "float16", "components": 3, "count": count, "offset": 0}
    read = [read_array(gzip.decompress(web.read(name)), array) for name in names]
    for k, values in enumerate(read):
        expected = irradiance(case, scene.mesh.normals, k)
        assert np.allclose(np.sort(values, axis=0)[[0, -1]], np.sort(expected, axis=0)[[0, -1]], rtol=1e-3)
    assert np.abs(read[0] - read[2]).max() > 0.1


@pytest.mark.parametrize("name", ["lightmap", "lightmap-open-moving"])
def test_a_lightmap_is_written_texel_by_texel_with_the_coordinates_that_read_it(name: str) -> None:
    case = next(case for case in cases() if case.name == name)
    scene = case_scene(case)
    web = WebPem(case_source(case, scene, CasePem()), WebOptions())
    manifest = json.loads(web.read("manifest.json"))
    mesh = manifest["mesh"]
    assert mesh["lightmap"] == case.lightmap
    assert mesh["arrays"]["uvs"]["count"] == mesh["arrays"]["positions"]["count"]
    # The library's map lies on the bounds of all vertices, whether a triangle uses them or not.
    ours = scene.mesh.uvs * [1.0, -1.0] + [0.0, 1.0]
    np.testing.assert_allclose(mesh["uvBounds"]["low"], ours.min(axis=0), atol=1e-6)
    np.testing.assert_allclose(mesh["uvBounds"]["high"], ours.max(axis=0), atol=1e-6)
    array = mesh["arrays"]["irradiance"]
    assert (array["count"], array["components"]) == (case.lightmap**2, 6 if case.open else 3)
    # Rows from the top, as they are stored; the cases' texels are half floats.
    read = read_array(gzip.decompress(web.read(mesh["file"])), array)
    np.testing.assert_array_equal(read, scene.mesh.irradiance)
    for k, sample in enumerate(manifest["samples"]):
        assert (sample["irradiance"] is not None) == case.moves
        if case.moves:
            own = read_array(gzip.decompress(web.read(sample["irradiance"])), {**array, "offset": 0})
            np.testing.assert_array_equal(own, irradiance(case, scene.mesh.normals, k))


def test_vertices_that_no_triangle_uses_are_left_out() -> None:
    mesh = ReflectorMesh(
        positions=np.array([[9, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32),
        normals=np.zeros((0, 3), np.float32),
        triangles=np.array([[1, 2, 3]], np.uint32),
        parts=np.zeros(1, np.uint16),
        whole_stack=np.ones(1, np.bool_),
        uvs=np.zeros((0, 2), np.float32),
        colors=np.zeros((0, 3), np.float32),
        tangents=np.zeros((0, 4), np.float32),
        materials=np.zeros(1, np.uint16),
        irradiance=None,
    )
    _, layout = write_mesh(mesh)
    assert layout["arrays"]["positions"]["count"] == 3
    assert layout["bounds"]["high"] == [1.0, 1.0, 1.0]
    assert "normals" not in layout["arrays"]


@pytest.mark.parametrize("name", ["infinite", "shells", "fading", "box-paraboloid", "lightmap"])
def test_the_manifest_names_every_file_and_no_other(name: str, scene: Scene) -> None:
    case = next(case for case in cases() if case.name == name)
    web = WebPem(case_source(case, scene, CasePem(case.projection)), WebOptions())
    manifest = json.loads(web.read("manifest.json"))
    suffix = manifest["images"]["suffix"]
    images = [manifest["static"]["image"]]
    for files in manifest["static"]["maps"] or ():
        images += [name for name in files.values() if name is not None]
    for sample in manifest["samples"]:
        images.append(sample["still"])
        assert sample["irradiance"] is None
        for files in sample["maps"]:
            images += [name for name in files.values() if name is not None]
    expected = {
        "manifest.json",
        manifest["mesh"]["file"],
        manifest["probe"]["file"],
        manifest["poster"]["file"],
    }
    expected |= {name + suffix for name in images} | {f"exact/{name}.webp" for name in images}
    assert set(web.names) == expected
    assert web.names[0] == "manifest.json"
    first = manifest["samples"][manifest["first"]]["maps"][0]["radiance"]
    assert web.names.index(first + suffix) < min(
        web.names.index(sample["maps"][0]["radiance"] + suffix)
        for i, sample in enumerate(manifest["samples"])
        if i != manifest["first"]
    )


def test_an_exact_image_of_a_map_holds_its_codes(scene: Scene) -> None:
    pem = CasePem()
    web = WebPem(case_source(cases()[0], scene, pem), WebOptions(ImageFormat(exact=True)))
    code = RadianceCode(**json.loads(web.read("manifest.json"))["radiance"])
    pyramid = pem.pyramid(1, 0)
    form = ImageFormat(exact=True)
    atlas = form.decode(web.read("samples/00001/0.webp"))
    assert np.array_equal(from_atlas(atlas, 32), code.encode(pyramid[:, :3]))
    alpha = form.decode(web.read("samples/00001/0.alpha.webp"))
    assert np.array_equal(from_atlas(alpha, 32)[:, 0], np.rint(pyramid[:, 3] * 255.0))


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_blocks_of_an_atlas_hold_the_texels_that_are_read_and_hardly_more(projection: str) -> None:
    size = 32
    count = topology_of(projection, size).texels
    read = np.zeros(count, np.bool_)
    read[[5, 700, count - 9]] = True
    blocks = blocks_of(read, size, projection)
    height, width = atlas_shape(size, projection)
    pixels = pixels_of(blocks, height, width)
    assert pixels.shape == (height, width)
    assert from_atlas(pixels[..., None].astype(np.uint8), size, projection)[read].all()
    assert blocks.sum() == 3


def test_pixels_that_nobody_reads_are_filled_smoothly_and_the_others_are_kept() -> None:
    image = np.random.default_rng(3).integers(0, 256, (48, 40, 3), np.uint8)
    known = np.zeros((48, 40), np.bool_)
    known[8:16, 8:24] = True
    result = filled(image, known)
    assert np.array_equal(result[known], image[known])
    # Beyond the smallest aligned square of 32 pixels that holds them all there is their mean alone.
    assert np.abs(result[40, 36].astype(float) - image[known].mean(axis=0)).max() <= 0.5
    assert len(ImageFormat(exact=False).encode(result)) < 0.3 * len(ImageFormat(exact=False).encode(image))
    nothing = filled(image, np.zeros((48, 40), np.bool_))
    assert (nothing == 0).all()


def fading() -> tuple[Case, ExportSource]:
    case = next(case for case in cases() if case.fade_degrees is not None)
    return case, case_source(case, case_scene(case), CasePem())


def test_a_sample_holds_what_is_read_near_it_and_the_static_set_the_rest() -> None:
    _, source = fading()
    texels = len(source.pyramid(0, 0))
    read = np.zeros(texels, np.bool_)
    read[: 4 * 32] = True
    trimmed = replace(source, reads=lambda sample: [read] * len(source.maps))
    web, whole = WebPem(trimmed, WebOptions()), WebPem(source, WebOptions())
    manifest = json.loads(web.read("manifest.json"))
    for sample in manifest["samples"]:
        bits = np.unpackbits(np.frombuffer(gzip.decompress(web.read(sample["blocks"])), np.uint8))
        # 96 × 96 pixels; four rows of 32 texels are eight blocks.
        assert len(bits) == len(source.maps) * 576
        assert bits.sum() == len(source.maps) * 8
    name = manifest["samples"][0]["maps"][0]["radiance"] + ".avif"
    assert len(web.read(name)) < 0.5 * len(whole.read(name))
    # A page can put a sample together as soon as its files are there.
    order = web.names
    assert order.index("static/2.avif") < order.index(manifest["samples"][1]["blocks"]) < order.index(name)


@pytest.mark.parametrize(
    "options", [WebOptions(trim=False), WebOptions(ImageFormat(exact=True)), WebOptions(fallback=False)]
)
def test_nothing_is_left_out_where_it_is_not_wanted_or_nothing_could_stand_in(options: WebOptions) -> None:
    _, source = fading()

    def fail(sample: int) -> list[NDArray[np.bool_]]:
        raise AssertionError(sample)

    if options.trim and not options.format.exact:
        source = replace(source, static_maps=None, fade_degrees=None)
    manifest = json.loads(WebPem(replace(source, reads=fail), options).read("manifest.json"))
    assert [sample["blocks"] for sample in manifest["samples"]] == [None] * 3

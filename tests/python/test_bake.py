"""From a scene to figures: a small bake, its evaluation and its pictures."""

from __future__ import annotations

import dataclasses
import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.bake.bake import bake
from mirrorbake.bake.local_shapes import enclosing_ellipsoid
from mirrorbake.errors import InputError
from mirrorbake.evaluate.contact_sheet import contact_sheet
from mirrorbake.evaluate.demo import demo_config
from mirrorbake.evaluate.evaluate import Evaluation, evaluate
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.pem.body_light import BodyLight
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.pem.run_time import RunTime, lookups_of
from mirrorbake.pem.store import PemStore
from mirrorbake.pem.view_images import images_of_trace
from mirrorbake.proxy import hull_triangles, proxy_from_attributes, proxy_to_attributes
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import Stage, prepare_stage

if TYPE_CHECKING:
    from pathlib import Path

# One degree between views, as in the paper, at a tenth of its pixels; light that bounces between diffuse
# surfaces is left out since it costs the most to prepare.
SMALL = {
    "reflector": {"object": "teapot", "subdivisions": 12, "parts": "split"},
    "views": {"count": 3, "degrees": 2.0, "start": 22.0, "size": [160, 120]},
    "maps": {"size": 64},
    "trace": {"samples": 8, "indirect": "none"},
    "infer": {"fit": "layers"},
}


@dataclasses.dataclass(frozen=True)
class Baked:
    directory: Path
    stage: Stage
    evaluation: Evaluation
    reports: list[tuple[int, int, str]]

    def open(self) -> OpenedPem:
        return open_pem(self.directory, self.stage)


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> Baked:
    directory = tmp_path_factory.mktemp("bake") / "pem"
    stage = prepare_stage(parse_config(SMALL, "small"))
    reports: list[tuple[int, int, str]] = []
    summary = bake(stage.config, directory, lambda *report: reports.append(report), stage)
    return Baked(directory, stage.planned(summary.plan), evaluate(directory, None, stage), reports)


def mean(evaluation: Evaluation, contender: str, place: str) -> float:
    value = evaluation.mean(contender, place)
    assert value is not None
    return value


def test_the_pem_beats_both_static_maps_on_and_between_its_samples(baked: Baked) -> None:
    # At full size the lead is more than 10 dB; maps and pictures of this size, and targets of 8 samples whose
    # noise the maps hold, cost a few dB of that.
    for place, lead in (("on", 6.5), ("between", 6.0)):
        pem = mean(baked.evaluation, "pem", place)
        infinite = mean(baked.evaluation, "static_infinite", place)
        box = mean(baked.evaluation, "static_proxy", place)
        assert pem - infinite > lead
        assert pem - box > lead - 3.0
        assert box > infinite


def test_the_box_is_the_room_that_the_teapot_sees(baked: Baked) -> None:
    header = PemStore.open(baked.directory).header
    box = header.static["proxy"]
    assert box["shape"] == "box"
    assert [part.name for part in header.parts] == ["body", "lid"]
    for part in header.parts:
        assert [shell.name for shell in part.shells] == ["local", "distant"]
        assert part.shells[1].proxy == box
    # It stands on the table, and is a room's size.
    assert abs(box["centre"][1] - box["half_extent"][1]) < 0.1
    assert all(0.5 < extent < 5.0 for extent in box["half_extent"])


def test_the_ellipsoid_of_each_part_encloses_it(baked: Baked) -> None:
    built = baked.stage.built
    for number in range(len(built.part_names)):
        ellipsoid = proxy_to_attributes(enclosing_ellipsoid(built, number))
        points = built.positions[np.unique(built.triangles[built.parts == number])]
        scaled = (points - np.array(ellipsoid["centre"])) / np.array(ellipsoid["radii"])
        farthest = np.linalg.norm(scaled, axis=1).max()
        assert 0.99 < farthest < 1.0 + 1e-4


def test_polygons_on_the_convex_hull_have_no_local_layer(baked: Baked) -> None:
    pem, built = baked.open(), baked.stage.built
    off_hull = ~hull_triangles(built.positions, built.triangles)
    stored = pem.store.read_local_triangles()
    assert stored is not None
    np.testing.assert_array_equal(stored.astype(bool), off_hull)
    assert 0.1 < off_hull.mean() < 0.9
    # Polygons of the hull are drawn from the distant map alone, whatever the local one holds.
    samples = baked.stage.visibility(0.0)
    drawn = pem.run_time.render("pem", 0.0, samples)
    pixel, on_hull = np.asarray(samples.pixel), ~off_hull[np.asarray(samples.triangle)]
    parts = [
        [
            _core.ShellMap(
                proxy_from_attributes(part.shells[1].proxy),
                _core.TexelTopology.cube(pem.store.header.map_size),
                pem.store.read_map(part.name, "distant", 0),
            )
        ]
        for part in pem.store.header.parts
    ]
    image = _core.render_reflector(samples, parts, None, lookups_of(0.25))
    alone = (image[..., :3] / np.maximum(image[..., 3:], 1e-9)).reshape(-1, 3)
    seen = np.bincount(pixel, minlength=len(alone))
    whole = (seen > 0) & (np.bincount(pixel, weights=on_hull, minlength=len(alone)) == seen)
    assert whole.sum() > 500
    np.testing.assert_array_equal(drawn.reshape(-1, 3)[whole], alone[whole])
    assert np.abs(drawn.reshape(-1, 3) - alone).max() > 0.1


def test_a_trace_is_the_object_over_its_background(baked: Baked) -> None:
    trace = baked.stage.trace(0.5)
    images = images_of_trace(trace)
    channels = list(trace.channels)
    beauty = np.asarray(trace.layers)[..., [channels.index(name) for name in "RGB"]]
    # Sums of 8 samples of radiance up to some 20, in another order.
    np.testing.assert_allclose(images.beauty, beauty, rtol=1e-4, atol=1e-4)
    coverage = np.asarray(trace.layers)[..., channels.index("coverage")]
    np.testing.assert_allclose(images.coverage, coverage, rtol=0, atol=1e-6)
    assert 0.1 < images.coverage.mean() < 0.6


def test_between_two_views_the_maps_are_blended_linearly(baked: Baked) -> None:
    pem = baked.open()
    samples = baked.stage.visibility(0.25)
    store = pem.store
    blended = pem.run_time.render("pem", 0.25, samples)
    split = store.read_local_triangles()
    topology = _core.TexelTopology.cube(store.header.map_size)
    # Compositing (L_local + (1 − α) L_distant) is not linear in α and L_distant together: maps are blended,
    # not pictures.
    parts = []
    for part in store.header.parts:
        maps = {
            layer: 0.5 * (store.read_map(part.name, layer, 0) + store.read_map(part.name, layer, 1))
            for layer in ("local", "distant")
        }
        proxies = {shell.name: proxy_from_attributes(shell.proxy) for shell in part.shells}
        local = _core.ShellMap(proxies["local"], topology, maps["local"], split)
        parts.append([local, _core.ShellMap(proxies["distant"], topology, maps["distant"])])
    image = _core.render_reflector(samples, parts, None, lookups_of(0.25))
    expected = image[..., :3] / np.maximum(image[..., 3:], 1e-9)
    np.testing.assert_allclose(blended, expected, rtol=1e-5, atol=1e-6)


def test_the_stored_reference_is_what_is_traced_again(baked: Baked) -> None:
    stored = PemStore.open(baked.directory).read_images(1)
    traced = images_of_trace(baked.stage.trace(0.5))
    np.testing.assert_array_equal(stored.coverage, traced.coverage)
    mask = traced.coverage > 0.5
    # Only the float16 storage lies between them: some 11 bits.
    assert psnr(stored.object, traced.object, mask) > 60


def test_progress_counts_up_to_the_number_of_views(baked: Baked) -> None:
    done = [report[0] for report in baked.reports]
    assert done == sorted(done)
    assert baked.reports[-1][:2] == (3, 3)


def test_the_contact_sheet_is_a_picture_with_all_contenders(baked: Baked, tmp_path: Path) -> None:
    sheet = tmp_path / "sheet.png"
    contact_sheet(baked.open(), sheet)
    pixels, _ = _core.load_image(str(sheet))
    height, width, _ = pixels.shape
    assert width > 1000
    assert height > 600
    # Four columns of pictures: none is the white of the paper.
    row = pixels[height // 5, :, :3]
    for column in range(4):
        cell = row[(2 * column + 1) * width // 8]
        assert (cell < 0.95).any()
    assert [path.name for path in tmp_path.iterdir()] == ["sheet.png"]


TURNED = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]], np.float32)


def test_proxies_survive_the_attributes() -> None:
    for proxy in (
        _core.Proxy.infinite((1.0, 2.0, 3.0)),
        _core.Proxy.box((0.0, 1.0, 0.0), (2.0, 1.0, 3.0), (0.0, 0.5, 0.0), TURNED),
        _core.Proxy.ellipsoid((0.0, 1.0, 0.0), (2.0, 1.0, 3.0), (0.0, 0.5, 0.0), TURNED),
        _core.Proxy.hemisphere((0.0, 1.0, 0.0), 4.0, (0.0, 1.5, 0.0), TURNED),
        _core.Proxy.box((0.0, 1.0, 0.0), (2.0, 1.0, 3.0), (0.0, 0.5, 0.0)),
        _core.Proxy.ellipsoid((0.0, 1.0, 0.0), (2.0, 1.0, 3.0), (0.0, 0.5, 0.0)),
    ):
        attributes = json.loads(json.dumps(proxy_to_attributes(proxy)))
        read = proxy_from_attributes(attributes)
        assert repr(read) == repr(proxy)
        points, rays = np.random.default_rng(1).normal(size=(2, 100, 3)).astype(np.float32)
        np.testing.assert_array_equal(read.lookup(points, rays), proxy.lookup(points, rays))


def make_sky(tmp_path: Path, *, sun: bool = True) -> Path:
    # Brighter above, a sun, colours that tell the sides apart.
    v, u = np.mgrid[0:32, 0:64].astype(np.float32)
    pixels = np.stack([u / 64, 1 - v / 32, 1 - u / 64], axis=-1)
    if sun:
        pixels[6:9, 20:23] = 8.0
    path = tmp_path / "sky.exr"
    _core.save_image(str(path), np.ascontiguousarray(pixels), ["R", "G", "B"])
    return path


def small_panorama_scene(tmp_path: Path, **sections: Any) -> dict[str, Any]:
    return {
        **SMALL,
        "surroundings": {"panorama": str(make_sky(tmp_path))},
        "views": {"count": 2, "degrees": 1.0, "size": [96, 72]},
        "trace": {"samples": 4, "indirect": "none"},
        "auto": {"quality": "draft"},
        **sections,
    }


def test_under_a_panorama_the_distant_map_lies_at_infinity(tmp_path: Path) -> None:
    stage = prepare_stage(parse_config(small_panorama_scene(tmp_path), "panorama"))
    bake(stage.config, tmp_path / "pem", None, stage)
    header = PemStore.open(tmp_path / "pem").header
    assert header.static["proxy"] is None
    assert all(part.shells[-1].proxy["shape"] == "infinite" for part in header.parts)
    evaluation = evaluate(tmp_path / "pem", None, stage)
    assert all("static_proxy" not in view.metrics["psnr"] for view in evaluation.views)
    lead = mean(evaluation, "pem", "on") - mean(evaluation, "static_infinite", "on")
    assert lead > 3.0
    pem = open_pem(tmp_path / "pem", stage)
    contact_sheet(pem, tmp_path / "sheet.png")
    assert (tmp_path / "sheet.png").is_file()


def test_a_convex_reflector_has_no_local_layer(tmp_path: Path) -> None:
    sphere = _core.make_sphere((0.0, 0.0, 0.0), 1.0, 24)
    lines = [f"v {x} {y} {z}" for x, y, z in np.asarray(sphere.positions)]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in np.asarray(sphere.triangles)]
    mesh = tmp_path / "sphere.obj"
    mesh.write_text("\n".join(lines))
    scene = small_panorama_scene(tmp_path, reflector={"mesh": str(mesh), "height": 0.2})
    stage = prepare_stage(parse_config(scene, "sphere"))
    bake(stage.config, tmp_path / "pem", None, stage)
    assert PemStore.open(tmp_path / "pem").header.map_names() == [("object", "distant")]


def test_without_a_local_layer_one_map_holds_everything(tmp_path: Path) -> None:
    stage = prepare_stage(parse_config(small_panorama_scene(tmp_path, layers={"local": False}), "single"))
    bake(stage.config, tmp_path / "pem", None, stage)
    pem = open_pem(tmp_path / "pem", stage)
    assert {layer for _, layer in pem.store.header.map_names()} == {"distant"}
    images = pem.store.read_images(0)
    drawn = pem.run_time.render("pem", 0.0, pem.stage.visibility(0.0))
    assert psnr(drawn, images.object, images.coverage >= 0.5) > 20


def test_a_diffuse_body_under_a_coat_has_a_diffuse_layer(tmp_path: Path) -> None:
    material = {"fresnel": "dielectric", "ior": 1.5, "albedo": [0.6, 0.1, 0.1], "layers": "coated"}
    # A sun would add noise to the reference, and shadow edges that vertices are too sparse for.
    scene = small_panorama_scene(tmp_path, material=material, trace={"samples": 16, "indirect": "none"})
    scene["surroundings"] = {"panorama": str(make_sky(tmp_path, sun=False)), "ground": {}}
    stage = prepare_stage(parse_config(scene, "coated"))
    bake(stage.config, tmp_path / "pem", None, stage)
    pem = open_pem(tmp_path / "pem", stage)
    irradiance = pem.store.read_irradiance()
    assert irradiance is not None
    # Fronts, and backs: light comes in under the teapot's lid.
    assert irradiance.shape == (len(stage.built.positions), 6)
    images = pem.store.read_images(0)
    mask = images.coverage >= 0.5
    drawn = pem.run_time.render("pem", 0.0, pem.stage.visibility(0.0))
    # Most of the light is diffuse: irradiance per vertex has to get it right.
    assert psnr(drawn, images.object, mask) > 25
    without = RunTime(pem.store, BodyLight.of(stage.built, 0))
    without._irradiance = None
    assert psnr(without.render("pem", 0.0, pem.stage.visibility(0.0)), images.object, mask) < 20


def test_clamped_radiance_is_counted(tmp_path: Path) -> None:
    sky = make_sky(tmp_path)
    scene = small_panorama_scene(tmp_path, surroundings={"panorama": str(sky), "scale": 1e5})
    assert bake(parse_config(scene, "bright"), tmp_path / "half").clamped > 0
    scene["maps"] = {"size": 64, "precision": "float32"}
    assert bake(parse_config(scene, "bright"), tmp_path / "full").clamped == 0


def test_a_box_needs_surroundings_at_a_distance(tmp_path: Path) -> None:
    scene = small_panorama_scene(tmp_path, maps={"size": 64, "distant": "box"})
    with pytest.raises(InputError, match=r"maps\.distant = 'box'"):
        bake(parse_config(scene, "box"), tmp_path / "pem")


def test_the_demonstration_is_the_teapot_at_one_degree() -> None:
    config = demo_config()
    assert config.reflector.subdivisions == 25
    assert config.views.count is not None
    assert config.views.degrees / (config.views.count - 1) == 1.0


@pytest.mark.parametrize("fit", ["layers", "display"])
def test_a_sample_has_the_same_bits_baked_alone_or_in_any_order_with_any_threads(
    tmp_path: Path, fit: str
) -> None:
    views = {"count": 3, "degrees": 20.0, "size": [40, 30]}
    config = parse_config({**SMALL, "maps": {"size": 16}, "views": views, "infer": {"fit": fit}}, "order")

    def maps(name: str, orders: list[list[int]], threads: int) -> list[bytes]:
        with _core.ThreadLimit(threads):
            for order in orders:
                bake(config, tmp_path / name, samples=order)
        store = PemStore.open(tmp_path / name)
        return [
            store.read_map(*map_name, index).tobytes() if store.completed()[index] else b""
            for index in range(3)
            for map_name in store.header.map_names()
        ]

    everything = maps("whole", [[0, 1, 2]], 1)
    assert all(everything)
    assert maps("backwards", [[2], [1], [0]], 2) == everything
    assert maps("apart", [[1], [0, 2]], 8) == everything
    per_sample = len(everything) // 3
    assert maps("alone", [[1]], 2)[per_sample : 2 * per_sample] == everything[per_sample : 2 * per_sample]

"""References of their own, places, contenders, and the figures of an evaluation."""

from __future__ import annotations

import functools
import io
import itertools
import json
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from rich.console import Console

from mirrorbake import _core
from mirrorbake.bake.bake import bake
from mirrorbake.evaluate import references
from mirrorbake.evaluate.contenders import CONTENDERS, TITLES, Frame, contenders_of, run_time_of
from mirrorbake.evaluate.evaluate import METRICS, Evaluation, ViewFigures, evaluate
from mirrorbake.evaluate.metrics import mean_squared_error, psnr
from mirrorbake.evaluate.places import View, angle_between, choose_views, elevation, turned
from mirrorbake.evaluate.references import (
    Half,
    Reference,
    ReferenceCache,
    extend_reference,
    object_window,
    refined_reference,
    trace_reference,
)
from mirrorbake.evaluate.single_maps import (
    SingleMaps,
    Targets,
    layer_at_infinity,
    layer_on_surface,
)
from mirrorbake.evaluate.table import metrics_tables
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.scene.cameras import Cameras
from mirrorbake.scene.config_axes import SCENE_AXES
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.parameters import Axis, ParameterSpace
from mirrorbake.scene.stage import Stage, prepare_stage
from mirrorbake.scene.texture_coordinates import has_own_texels

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

SMALL = {
    "reflector": {"object": "teapot", "subdivisions": 8, "parts": "split"},
    "views": {"count": 3, "degrees": 2.0, "start": 22.0, "size": [96, 72]},
    "maps": {"size": 32},
    "trace": {"samples": 8, "depth": 4, "indirect": "none"},
    "infer": {"fit": "layers"},
}


@dataclass(frozen=True)
class Baked:
    directory: Path
    stage: Stage
    evaluation: Evaluation

    def open(self) -> OpenedPem:
        return open_pem(self.directory, self.stage)


@pytest.fixture(scope="module")
def baked(tmp_path_factory: pytest.TempPathFactory) -> Baked:
    directory = tmp_path_factory.mktemp("evaluate") / "pem"
    stage = prepare_stage(parse_config(SMALL, "small"))
    summary = bake(stage.config, directory, None, stage)
    return Baked(directory, stage.planned(summary.plan), evaluate(directory, None, stage))


# References


def noisy_reference(sigma: float, samples: int = 2, seed: int = 0) -> tuple[Reference, NDArray[np.float32]]:
    """A grey picture, and a reference of it whose halves each have noise of standard deviation sigma·√2."""
    random = np.random.default_rng(seed)
    true = np.full((200, 150, 3), 0.2158605, np.float32)
    halves = []
    for _ in range(2):
        shown = 128 / 255 + random.normal(scale=sigma * math.sqrt(2), size=true.shape)
        light = np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)
        count = np.full(true.shape[:2], samples / 2)
        halves.append(Half(light * samples / 2, count, np.zeros(true.shape)))
    return Reference((0, 0, 150, 200), (halves[0], halves[1]), samples, 1, 0.0), true


@pytest.mark.parametrize("sigma", [0.002, 0.01, 0.03])
def test_the_ceiling_is_the_psnr_of_the_true_picture(sigma: float) -> None:
    reference, true = noisy_reference(sigma)
    # 90,000 values: the mean square scatters by 0.5 %, 0.02 dB; encoding the mean of the halves instead of
    # the mean of the codes adds a curvature of σ².
    assert reference.ceiling == pytest.approx(-20 * math.log10(sigma), abs=0.1)
    assert psnr(true, reference.images.object, reference.mask) == pytest.approx(reference.ceiling, abs=0.1)


def test_the_noise_of_the_reference_is_no_error_of_the_picture() -> None:
    # A picture that is off by 0.03 everywhere, against references with up to half of that noise: without the
    # correction the worst would read 1 dB too low.
    shown = 128 / 255 + 0.03
    image = np.full((200, 150, 3), ((shown + 0.055) / 1.055) ** 2.4, np.float32)
    expected = -20 * math.log10(0.03)
    for sigma in (0.001, 0.005, 0.015):
        reference, _ = noisy_reference(sigma)
        assert reference.psnr(image) == pytest.approx(expected, abs=0.1)
    assert psnr(image, reference.images.object, reference.mask) < expected - 0.8


def test_an_error_that_the_noise_hides_has_no_figure() -> None:
    reference, true = noisy_reference(0.02)
    assert reference.psnr(true) is None
    assert reference.error(true) is None


def reseeded(stage: Stage, seed: int) -> Stage:
    trace = stage.config.trace.model_copy(update={"seed": seed})
    return Stage(stage.config.model_copy(update={"trace": trace}), stage.built, stage.tracer)


def test_noise_falls_as_samples_are_added(baked: Baked) -> None:
    camera = baked.stage.built.cameras.camera((0.5,))
    window = object_window(baked.stage, camera)
    few = trace_reference(baked.stage, camera, window, 16)
    many = extend_reference(baked.stage, camera, few, 128)
    assert many.samples == 128
    assert many.mask.sum() > 500
    # 1/n would be 9 dB; stratified samples do better, heavy tails make a single estimate uncertain.
    assert 6.0 < many.ceiling - few.ceiling < 13.0


def test_the_ceiling_foretells_how_far_apart_references_of_other_seeds_are(baked: Baked) -> None:
    camera = baked.stage.built.cameras.camera((0.5,))
    window = object_window(baked.stage, camera)
    traced = [trace_reference(reseeded(baked.stage, 1000 * seed), camera, window, 16) for seed in range(8)]
    mask = np.all([reference.mask for reference in traced], axis=0)
    apart = [
        mean_squared_error(a.images.object, b.images.object, mask)
        for a, b in itertools.combinations(traced, 2)
    ]
    # A tenth of the pixels holds most of the noise, so that one estimate is off by some 20 %; of eight, 7 %.
    # Halves are encoded apart, so that clipping hides a little less of their noise than of their mean's.
    expected = 2 * np.mean([reference.noise for reference in traced])
    assert np.mean(apart) == pytest.approx(expected, rel=0.25)


def test_a_reference_is_as_good_as_what_it_measures_asks_for(baked: Baked, tmp_path: Path) -> None:
    pem, camera = baked.open(), baked.stage.built.cameras.camera((0.25,))
    window = object_window(baked.stage, camera)
    plan, source = pem.store.header.plan, pem.store.header.source
    cache = ReferenceCache(tmp_path, source, plan.depth)
    for wanted in (26.0, 32.0):
        error = functools.partial(lambda value, _: value, 10 ** (-wanted / 10))
        reference = refined_reference(baked.stage, camera, window, cache, error)
        assert reference.ceiling >= wanted + 6.0
        assert reference.samples < references.MOST_SAMPLES
    # The second went on where the first, which the cache had kept, stopped.
    kept = cache.load(camera, window)
    assert kept is not None
    assert kept.samples == reference.samples
    np.testing.assert_allclose(kept.images.object, reference.images.object, rtol=1e-5, atol=1e-5)


def test_references_are_kept_under_all_that_decides_their_light(baked: Baked, tmp_path: Path) -> None:
    pem, camera = baked.open(), baked.stage.built.cameras.camera((0.25,))
    header, window = pem.store.header, (0, 0, 4, 4)
    cache = ReferenceCache(tmp_path, header.source, header.plan.depth)
    names = {cache.place(camera, window)}
    names.add(cache.place(camera, (0, 0, 4, 5)))
    names.add(cache.place(baked.stage.built.cameras.camera((0.3,)), window))
    names.add(ReferenceCache(tmp_path, header.source, header.plan.depth + 1).place(camera, window))
    config = json.loads(json.dumps(header.source.config))
    config["material"]["r0"] = [0.5, 0.5, 0.5]
    changed = type(header.source)(header.source.library, config, header.source.inputs)
    names.add(ReferenceCache(tmp_path, changed, header.plan.depth).place(camera, window))
    assert len(names) == 5
    for axis in SCENE_AXES:
        config = {**header.source.config, axis: {"turn": 12.5}}
        changed = type(header.source)(header.source.library, config, header.source.inputs)
        names.add(ReferenceCache(tmp_path, changed, header.plan.depth).place(camera, window))
    assert len(names) == 5 + len(SCENE_AXES)
    # What is inferred from the light does not change it: studies share references.
    config = json.loads(json.dumps(header.source.config))
    config["infer"]["smoothness"], config["maps"]["size"] = 0.5, 8
    same = type(header.source)(header.source.library, config, header.source.inputs)
    assert ReferenceCache(tmp_path, same, header.plan.depth).place(camera, window) in names


def test_a_damaged_reference_is_traced_again(baked: Baked, tmp_path: Path) -> None:
    header, camera = baked.open().store.header, baked.stage.built.cameras.camera((0.25,))
    window = object_window(baked.stage, camera)
    cache = ReferenceCache(tmp_path, header.source, header.plan.depth)
    cache.save(camera, trace_reference(baked.stage, camera, window, 2))
    path = cache.place(camera, window).path
    whole = path.read_bytes()
    assert cache.load(camera, window) is not None
    for damaged in (b"", whole[: len(whole) // 2], b"nonsense" + whole[8:]):
        path.write_bytes(damaged)
        assert cache.load(camera, window) is None


# Places

ARC = Cameras("arc", (0.0, 0.1, 0.0), 0.5, 0.2, 20.0, 10.0, 30.0, (64, 48))


def arc_space(count: int) -> ParameterSpace:
    values = tuple(i / (count - 1) for i in range(count)) if count > 1 else (0.0,)
    return ParameterSpace((Axis("arc", values, 0.0, 1.0),))


def places(views: list[View]) -> list[str]:
    return [view.place for view in views]


def test_the_views_are_where_their_places_say() -> None:
    views = choose_views(ARC, arc_space(11))
    by_place = {view.place: view for view in views}
    assert places(views)[:4] == ["on", "between", "on", "between"]
    assert by_place["on"].degrees == 0.0
    tilt = math.cos(math.atan2(0.2, 0.5))
    # Directions at an elevation are nearer to each other than their azimuths.
    assert by_place["between"].degrees == pytest.approx(0.5 * tilt, rel=1e-3)
    for degrees in (1, 2, 5, 10, 15):
        view = by_place[f"off_{degrees}"]
        assert view.point == (1.0,)
        chord = 2 * math.degrees(math.asin(tilt * math.sin(math.radians(degrees / 2))))
        assert view.degrees == pytest.approx(chord, rel=1e-6)
    level = elevation(ARC.camera((0.5,)))
    assert elevation(by_place["above_10"].camera) == pytest.approx(level + 10)
    assert elevation(by_place["below_10"].camera) == pytest.approx(level - 10)
    dome = [view for view in views if view.place == "dome"]
    assert len({round(elevation(view.camera)) for view in dome}) == len(dome) == 3
    assert all(view.degrees > 5 for view in dome)


def test_a_dome_is_looked_at_on_its_maps_in_the_middle_of_cells_and_off_both() -> None:
    azimuth = Axis("azimuth", (0.0, 90.0, 180.0, 270.0), 0.0, 360.0, 360.0)
    space = ParameterSpace((azimuth, Axis("elevation", (10.0, 50.0), 10.0, 50.0)))
    cameras = Cameras("dome", (0.0, 0.0, 0.0), 1.0, 0.0, 0.0, 360.0, 30.0, (64, 48))
    views = choose_views(cameras, space, every=True)
    on = [view.point for view in views if view.place == "on"]
    assert on == space.samples()
    # The last cell closes the circle; the upper ring begins none.
    between = [view.point for view in views if view.place == "between"]
    assert between == [(45.0, 30.0), (135.0, 30.0), (225.0, 30.0), (315.0, 30.0)]
    dome = [view for view in views if view.place == "dome"]
    assert dome
    assert all(10 <= elevation(view.camera) <= 50 and view.degrees > 1 for view in dome)


def test_a_selection_is_spread_over_the_arc_and_all_is_all() -> None:
    on = [view.point[0] for view in choose_views(ARC, arc_space(100)) if view.place == "on"]
    assert len(on) == 5
    assert np.diff(on) == pytest.approx(20 / 99)
    every = places(choose_views(ARC, arc_space(100), every=True))
    assert (every.count("on"), every.count("between")) == (100, 99)


def test_a_full_circle_has_no_place_past_its_end() -> None:
    circle = Cameras("arc", (0.0, 0.1, 0.0), 0.5, 0.2, 0.0, 360.0 * 35 / 36, 30.0, (64, 48))
    names = places(choose_views(circle, arc_space(36)))
    assert {"on", "between", "above_10", "off_2", "off_5"} <= set(names)
    assert not {"off_10", "off_15"} & set(names)


def test_one_sample_alone_has_places_around_it() -> None:
    views = choose_views(Cameras("arc", (0, 0, 0), 0.5, 0.2, 0.0, 0.0, 30.0, (64, 48)), arc_space(1))
    assert {"on", "off_1", "off_15", "above_10", "below_10"} <= set(places(views))
    assert "between" not in places(views)


def test_turning_keeps_the_distance_and_the_target() -> None:
    camera = ARC.camera((0.3,))
    moved = turned(camera, 12.0, -5.0)
    assert moved.target == camera.target
    distances = [np.linalg.norm(np.subtract(c.eye, c.target)) for c in (camera, moved)]
    assert distances[0] == pytest.approx(distances[1])
    assert angle_between(turned(camera, 0.0, 7.0), camera) == pytest.approx(7.0)


# Contenders


def test_every_contender_draws_every_view(baked: Baked) -> None:
    pem = baked.open()
    contenders = contenders_of(pem)
    # Layers fitted apart have no static set.
    assert (*contenders, "static_set") == tuple(sorted(TITLES, key=lambda name: name == "static_set"))
    assert tuple(TITLES) == CONTENDERS
    view = View("off_5", 5.0, (1.0,), turned(baked.stage.built.cameras.camera((1.0,)), 5.0, 0.0))
    window = object_window(baked.stage, view.camera)
    frame = Frame(pem, view, window)
    pictures = {name: contender.render(frame, "reference") for name, contender in contenders.items()}
    for picture in pictures.values():
        assert picture.shape == (window[3], window[2], 3)
        assert np.isfinite(picture).all()
        assert picture.max() > 0.1
    # Past the end of the arc there is nothing to blend.
    np.testing.assert_array_equal(pictures["pem"], pictures["pem_nearest"])
    assert len({picture.tobytes() for name, picture in pictures.items() if name != "pem_nearest"}) == 5


def test_a_single_layer_at_infinity_is_good_on_its_sample_and_slides_off_it(baked: Baked) -> None:
    figures = baked.evaluation
    on = figures.mean("pem_single_infinite", "on")
    off = figures.mean("pem_single_infinite", "off_5")
    pem_off = figures.mean("pem", "off_5")
    static = figures.mean("static_infinite", "on")
    assert on is not None
    assert off is not None
    assert pem_off is not None
    assert static is not None
    # [PEM] figure 6: as an inferred map it fits its own sample, but holds nothing where it lies.
    assert on > static + 5.0
    assert on > off + 1.5
    assert pem_off > off


def test_a_texture_is_best_on_its_sample_and_pasted_on_off_it(baked: Baked) -> None:
    def figure(contender: str, place: str) -> float:
        value = baked.evaluation.mean(contender, place)
        assert value is not None
        return value

    # [PEM] figure 7: a texture shows its own view, whose reflections stick to the surface in all others.
    assert figure("ptm", "on") > figure("pem_single_infinite", "on")
    assert figure("ptm", "off_15") < figure("pem", "off_15") - 3.0
    assert figure("ptm", "on") - figure("ptm", "off_15") > figure("pem", "on") - figure("pem", "off_15") + 5.0


@pytest.mark.parametrize("fit", ["layers", "display"])
def test_single_maps_are_blended_as_a_pem_is(baked: Baked, tmp_path: Path, fit: str) -> None:
    pem = baked.open()
    if fit == "display":
        scene = {**SMALL, "infer": {"iterations": 40}, "auto": {"quality": "draft"}}
        stage = prepare_stage(parse_config(scene, "display"))
        bake(stage.config, tmp_path / "pem", None, stage)
        pem = open_pem(tmp_path / "pem", stage)
    targets = Targets(pem)
    camera = pem.stage.built.cameras.camera((0.25,))
    view = View("between", 0.5, (0.25,), camera)
    frame = Frame(pem, view, object_window(pem.stage, camera))
    on_surface = layer_on_surface(pem)
    assert on_surface is not None
    for layer in (layer_at_infinity(pem), on_surface):
        maps, model = SingleMaps(pem, targets, layer), run_time_of(pem, "web")
        samples = frame.samples("web")
        blend = maps.render((0.25,), samples, model)
        assert blend.max() > 0.1
        ends = [maps.render((t,), samples, model) for t in (0.0, 0.5)]
        # One layer is linear in its map.
        np.testing.assert_allclose(blend, 0.5 * (ends[0] + ends[1]), rtol=1e-4, atol=1e-5)


def test_only_coordinates_of_its_own_give_a_surface_a_texture() -> None:
    teapot = _core.make_teapot(6)
    positions, triangles = np.asarray(teapot.positions), np.asarray(teapot.triangles)
    uvs = np.asarray(teapot.uvs)
    assert has_own_texels(positions, triangles, uvs)
    assert not has_own_texels(positions, triangles, np.zeros((0, 2), np.float32))
    assert not has_own_texels(positions, triangles, np.float32(2.0) * uvs)
    # Two halves of the surface on the same half of the texture.
    mirrored = np.stack([np.abs(uvs[:, 0] - np.float32(0.5)), uvs[:, 1]], axis=1)
    assert not has_own_texels(positions, triangles, mirrored)
    assert not has_own_texels(positions, triangles, np.zeros_like(uvs))


# Figures


def test_every_figure_is_measured_against_a_cleaner_reference(baked: Baked) -> None:
    assert {view.place for view in baked.evaluation.views} >= {"on", "between", "off_1", "off_15", "above_10"}
    for view in baked.evaluation.views:
        values = [value for row in view.metrics["psnr"].values() for value in row.values()]
        assert all(value is not None and value + 5.9 <= view.ceiling for value in values), view.place
        assert view.samples <= references.MOST_SAMPLES


def test_metrics_json_holds_every_view_and_a_summary(baked: Baked) -> None:
    figures: dict[str, Any] = json.loads((baked.directory / "metrics.json").read_text())
    assert len(figures["views"]) == len(baked.evaluation.views)
    for view, line in zip(figures["views"], baked.evaluation.views, strict=True):
        assert (view["place"], view["ceiling"]) == (line.place, line.ceiling)
        assert view["psnr"] == line.metrics["psnr"]
        assert {"degrees", *METRICS} <= view.keys()
        sliding = view["sliding"]["pem"]["reference"]
        assert (sliding is not None) == (view["place"] == "between")
    summary = figures["summary"]
    assert summary.keys() == set(CONTENDERS)
    assert summary["pem"]["reference"]["on"] == baked.evaluation.mean("pem", "on")
    assert figures["config"]["maps"]["size"] == 32
    assert "sRGB" in figures["display_transform"]


def test_an_evaluation_that_is_repeated_finds_its_references(baked: Baked) -> None:
    kept = {path: path.stat().st_mtime_ns for path in (baked.directory / "references").iterdir()}
    assert len(kept) == len(baked.evaluation.views)
    again = evaluate(baked.directory, None, baked.stage)
    assert {path: path.stat().st_mtime_ns for path in (baked.directory / "references").iterdir()} == kept
    for first, second in zip(baked.evaluation.views, again.views, strict=True):
        # float32 on disk.
        assert first.ceiling == pytest.approx(second.ceiling, abs=1e-3)
        for name, row in first.metrics["psnr"].items():
            assert row["reference"] == pytest.approx(second.metrics["psnr"][name]["reference"], abs=1e-3)


def test_a_folder_that_cannot_be_written_to_is_evaluated_all_the_same(
    baked: Baked, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*args: Any, **kwargs: Any) -> Any:
        raise PermissionError(13, "Permission denied")

    # Root may write anywhere, so that permissions of a folder would not do.
    monkeypatch.setattr("mirrorbake.files.tempfile.mkstemp", refuse)
    evaluation = evaluate(baked.directory, None, baked.stage)
    assert not evaluation.written
    assert evaluation.mean("pem", "on") is not None
    assert any("Permission denied" in note for note in evaluation.notes)


def test_an_object_that_covers_no_pixel_has_no_figures(tmp_path: Path) -> None:
    scene = {**SMALL, "views": {"count": 1, "size": [4, 3], "radius": 1.9, "fov": 170.0}}
    stage = prepare_stage(parse_config(scene, "tiny"))
    bake(stage.config, tmp_path / "pem", None, stage)
    evaluation = evaluate(tmp_path / "pem", None, stage)
    assert evaluation.views == []
    assert "no pixel is wholly the object's from: on" in evaluation.notes[0]
    assert json.loads((tmp_path / "pem" / "metrics.json").read_text())["summary"]["pem"]["reference"] == {}


def made_up(place: str, pem: float | None, ceiling: float = 40.0) -> ViewFigures:
    metrics: dict[str, Any] = {metric: {} for metric in METRICS}
    metrics["psnr"] = {
        "pem": {"web": pem, "reference": pem},
        "static_infinite": {"web": 20.0, "reference": 20.0},
    }
    return ViewFigures(place, 0.0, (0.0,), ceiling, 64, 1.0, metrics)


def test_the_table_shows_means_by_place_and_leaves_out_what_does_not_exist() -> None:
    views = [made_up("on", 30.0), made_up("between", 28.0), made_up("on", 31.0), made_up("off_1", None)]
    output = io.StringIO()
    for table in metrics_tables(Evaluation(views, {})):
        Console(file=output, width=160).print(table)
    text = output.getvalue()
    rows = {line.split("│")[1].strip(): line for line in text.splitlines()[:10] if line.startswith("│")}
    assert "30.50" in rows["on a sample"]
    assert "28.00" in rows["half-way between two"]
    assert "–" in rows["1° past the end of the arc"]
    assert "geometry" not in text
    # What maps are inferred for by default comes first.
    assert text.index("run time web ") < text.index("run time reference ")


def test_the_run_time_that_maps_were_inferred_for_comes_first() -> None:
    for own in ("web", "web1", "reference"):
        first, *_, last = metrics_tables(Evaluation([made_up("on", 30.0)], {"run_time": own}))
        assert str(first.title).endswith(f"run time {own}")
        assert next(iter(last.columns[1].cells)) == own


def test_what_is_infinite_is_null_in_json() -> None:
    figures = json.loads(Evaluation([made_up("on", math.inf, math.inf)], {}).to_json())
    assert figures["views"][0]["psnr"]["pem"]["reference"] is None
    assert figures["views"][0]["ceiling"] is None

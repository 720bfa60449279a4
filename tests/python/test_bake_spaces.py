"""Bakes over every kind of parameter space, in pieces, on workers, killed and damaged."""

from __future__ import annotations

import copy
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.bake.bake import bake
from mirrorbake.bake.fade import fit_fade, held_out
from mirrorbake.bake.static_set import static_places
from mirrorbake.errors import InputError, OptionError, StoreError
from mirrorbake.evaluate.evaluate import evaluate
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.evaluate.report import report
from mirrorbake.pem.export.images import ImageFormat
from mirrorbake.pem.export.source import export_source
from mirrorbake.pem.export.web import WebPem
from mirrorbake.pem.location import Location
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.pem.render import render
from mirrorbake.pem.store import PemStore
from mirrorbake.pem.verify import verify
from mirrorbake.pem.view_images import images_of_trace
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import prepare_stage
from mirrorbake.tone import srgb_encoded
from web_server import served

if TYPE_CHECKING:
    from pathlib import Path

    from mirrorbake.bake.estimate import Estimate
    from mirrorbake.bake.sample import SampleBaker
    from mirrorbake.pem.store import Contents
    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.scene.stage import Stage

# Small enough for a second a sample.
TINY: dict[str, Any] = {
    "reflector": {"object": "teapot", "subdivisions": 8, "parts": "split"},
    "maps": {"size": 32, "distant": "infinite"},
    "trace": {"samples": 4, "depth": 2, "indirect": "none"},
    "auto": {"quality": "draft"},
    "layers": {"local": True, "hull_split": True},
}
DOME = {"kind": "dome", "start": 20, "degrees": 20, "count": 2, "rings": 2, "elevation": [15, 35]}


def sky(folder: Path) -> str:
    v, u = np.mgrid[0:32, 0:64].astype(np.float32)
    pixels = np.stack([u / 64, 1 - v / 32, 1 - u / 64], axis=-1)
    pixels[6:9, 20:23] = 8.0
    path = folder / "sky.exr"
    _core.save_image(str(path), np.ascontiguousarray(pixels), ["R", "G", "B"])
    return str(path)


def scene(folder: Path, views: dict[str, Any], **sections: Any) -> SceneConfig:
    sizes = {"size": [64, 48], **views}
    light = {} if "surroundings" in sections else {"surroundings": {"panorama": sky(folder)}}
    return parse_config({**TINY, **light, "views": sizes, **sections}, "scene")


def objects(directory: Path) -> dict[str, bytes]:
    """Maps and references of a PEM, by file; seconds are not the same in any two runs."""
    group = directory / "pem.zarr"
    return {
        str(path.relative_to(group)): path.read_bytes()
        for name in ("maps", "reference", "diffuse")
        for path in sorted((group / name).rglob("*"))
        if path.is_file() and path.name != "zarr.json"
    }


@pytest.mark.parametrize("kind", ["dome", "motion", "light"])
def test_a_pem_over_any_space_is_good_on_its_samples_and_between_them(kind: str, tmp_path: Path) -> None:
    material = {"fresnel": "schlick", "r0": 0.5, "albedo": 0.3}
    fixed = {"kind": "fixed", "start": 20}
    config = {
        "dome": lambda: scene(tmp_path, DOME),
        # A body with a diffuse layer, whose light changes as it moves.
        "motion": lambda: scene(
            tmp_path, fixed, motion={"to": [0.02, 0.0, 0.01], "turn": 4.0, "count": 2}, material=material
        ),
        "light": lambda: scene(tmp_path, fixed, light={"turn": 4.0, "count": 2}, material=material),
    }[kind]()
    bake(config, tmp_path / "pem")
    pem = open_pem(tmp_path / "pem")
    assert len(pem.space) == (4 if kind == "dome" else 2)
    middle = pem.space.middle_after(0)
    assert middle is not None
    for point, least in ((pem.space.sample(0), 20.0), (pem.space.sample(1), 20.0), (middle, 17.0)):
        trace = pem.stage.trace(point)
        images = images_of_trace(trace)
        drawn = pem.run_time.render("pem", point, trace.samples)
        # Pixels of this size hold silhouettes and glints; a map of a wrong place has 10 to 14 dB.
        assert psnr(drawn, images.object, images.coverage >= 0.99) > least, (kind, point)
    render(tmp_path / "pem", middle, tmp_path / "middle.png")
    assert (tmp_path / "middle.png").is_file()


def test_shells_of_the_object_itself_move_with_it(tmp_path: Path) -> None:
    motion = {"to": [0.1, 0.0, 0.0], "turn": 90.0, "count": 2}
    config = scene(tmp_path, {"kind": "fixed"}, motion=motion)
    bake(config, tmp_path / "pem")
    pem = open_pem(tmp_path / "pem")
    local, distant = pem.store.header.parts[0].shells
    assert (local.moves, distant.moves) == (True, False)
    moved = pem.stage.at((1.0,)).built
    body = moved.positions[np.unique(moved.triangles[moved.parts == 0])].astype(np.float64)
    proxy = local.proxy_at(pem.run_time._pose_at((1.0,)))
    inside = (body - np.array(proxy.centre)) @ np.asarray(proxy.axes, np.float64).T / np.array(proxy.radii)
    farthest = np.linalg.norm(inside, axis=1).max()
    assert 0.98 < farthest < 1.001
    # A quarter turn takes the spout from +X to -Z.
    rest = pem.stage.built.positions
    assert np.ptp(moved.positions[:, 2]) == pytest.approx(np.ptp(rest[:, 0]), rel=1e-5)


def test_pieces_of_a_bake_are_the_whole_and_workers_bake_the_same_bits(tmp_path: Path) -> None:
    config = scene(tmp_path, DOME)
    bake(config, tmp_path / "whole")
    whole = objects(tmp_path / "whole")
    assert len(whole) == 8
    for piece in (range(2, 4), range(1)):
        summary = bake(config, tmp_path / "pieces", samples=piece)
    assert summary.resumed == 0
    assert PemStore.open(tmp_path / "pieces").completed().tolist() == [True, False, True, True]
    summary = bake(config, tmp_path / "pieces", workers="2")
    assert summary.resumed == 3
    assert objects(tmp_path / "pieces") == whole
    url = f"memory://bake-{tmp_path.name}"
    bake(config, url)
    names = PemStore.open(url).header.map_names()
    for name in names:
        np.testing.assert_array_equal(
            PemStore.open(url).read_map(*name, 3), PemStore.open(tmp_path / "whole").read_map(*name, 3)
        )


def test_damaged_samples_are_baked_anew_to_the_same_bits(tmp_path: Path) -> None:
    config = scene(tmp_path, {"count": 3, "degrees": 20})
    bake(config, tmp_path / "pem")
    before = objects(tmp_path / "pem")
    group = tmp_path / "pem" / "pem.zarr"
    flipped = group / "maps" / "c" / "1" / "0" / "0" / "0"
    content = bytearray(flipped.read_bytes())
    content[len(content) // 2] ^= 4
    flipped.write_bytes(content)
    (group / "reference" / "c" / "2" / "0" / "0" / "0").unlink()
    assert verify(tmp_path / "pem").damaged == (1, 2)
    with pytest.raises(StoreError, match="sample 2 of reference is missing"):
        open_pem(tmp_path / "pem").store.read_images(2)
    summary = bake(config, tmp_path / "pem")
    assert summary.resumed == 1
    assert sum("baked anew" in note for note in summary.notes) == 2
    assert objects(tmp_path / "pem") == before
    assert verify(tmp_path / "pem").is_sound


def test_an_estimate_is_told_before_the_bake_and_may_end_it(tmp_path: Path) -> None:
    config = scene(tmp_path, {"count": 3, "degrees": 20})
    told: list[Estimate] = []

    def answer(estimate: Estimate) -> bool:
        told.append(estimate)
        return len(told) > 1

    bake(config, tmp_path / "pem", on_estimate=answer)
    assert not PemStore.exists(tmp_path / "pem")
    bake(config, tmp_path / "pem", on_estimate=answer)
    store = PemStore.open(tmp_path / "pem")
    assert told[0].samples == 3
    # The trial image is as large as these views are, so that only what compresses differs.
    actual = np.mean([store.sample_bytes(index) for index in range(3)])
    assert told[0].bytes == pytest.approx(actual, rel=0.3)
    assert "for 3 samples" in str(told[0])


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"samples": [4]}, OptionError, "sample 4: expected 0 to 2"),
        ({"workers": "0"}, OptionError, "workers = 0: expected 1 to 1024"),
        ({"workers": "tcp://127.0.0.1:1"}, InputError, "no scheduler answers there"),
    ],
)
def test_a_bake_that_cannot_be_is_refused(
    arguments: dict[str, Any], error: type[Exception], message: str, tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr("mirrorbake.bake.workers.CONNECT_SECONDS", 1)
    with pytest.raises(error, match=message):
        bake(scene(tmp_path, {"count": 3}), tmp_path / "pem", **arguments)


KILLS = int(os.environ.get("MIRRORBAKE_KILLS", "3"))
"""A long run tries 40."""


@pytest.mark.parametrize("workers", [None, "2"])
def test_a_bake_that_is_killed_at_any_moment_is_resumed_to_the_same_bits(
    workers: str | None, tmp_path: Path
) -> None:
    config = scene(tmp_path, {"count": 6, "degrees": 50})
    start = time.monotonic()
    bake(config, tmp_path / "whole")
    whole, seconds = objects(tmp_path / "whole"), time.monotonic() - start
    (tmp_path / "scene.json").write_text(config.model_dump_json())
    script = f"""
import json
from mirrorbake.bake.bake import bake
from mirrorbake.bake.static_set import static_places
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import prepare_stage
if __name__ == "__main__":
    config = parse_config(json.load(open({str(tmp_path / "scene.json")!r})), "scene")
    bake(config, {str(tmp_path / "killed")!r}, workers={workers!r})
"""
    (tmp_path / "run.py").write_text(script)
    random = np.random.default_rng(7)
    for _ in range(KILLS):
        process = subprocess.Popen(
            [sys.executable, str(tmp_path / "run.py")],
            start_new_session=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        time.sleep(float(random.uniform(0.5, 1.0)) * (2.0 + seconds))
        # Workers die with the process that started them, or at least with their connection to it.
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        if PemStore.exists(tmp_path / "killed") and PemStore.open(tmp_path / "killed").completed().all():
            # What is done cannot be killed any more: the next moments are those of another bake.
            assert objects(tmp_path / "killed") == whole
            shutil.rmtree(tmp_path / "killed")
    bake(config, tmp_path / "killed")
    assert objects(tmp_path / "killed") == whole
    assert verify(tmp_path / "killed").is_sound


def test_maps_fitted_to_the_display_draw_better_pixels_than_layers_fitted_apart(tmp_path: Path) -> None:
    drawn: dict[str, float] = {}
    for fit in ("layers", "display"):
        config = scene(tmp_path, {"count": 1, "start": 20}, infer={"fit": fit, "run_time": "Web"})
        bake(config, tmp_path / fit)
        pem = open_pem(tmp_path / fit)
        model = _core.run_time_model("Web")
        assert (pem.run_time.model == model) == (fit == "display")
        samples = pem.stage.visibility((0.0,), model.places)
        images = pem.store.read_images(0)
        picture = pem.run_time.render("pem", (0.0,), samples, model)
        drawn[fit] = psnr(picture, images.object, images.coverage >= 0.99)
    # Both are drawn as the page draws. At full size the fit of the pixels leads by several dB.
    assert drawn["display"] > drawn["layers"] + 1.0
    render(tmp_path / "display", (0.0,), tmp_path / "display.png")


# Whatever a scene leaves out: what the object reflects of itself, what is diffuse, a map for each part.
SCENES: dict[str, dict[str, Any]] = {
    "no local layer": {"layers": {"local": False, "hull_split": False}},
    "diffuse under a coat": {
        "material": {"ior": 1.5, "albedo": 0.4, "layers": "coated"},
        "surroundings": {"room": "furnished"},
        "maps": {"size": 32},
    },
    "on a ground": {"ground": True, "maps": {"size": 32}},
    "paraboloids": {"maps": {"size": 32, "distant": "infinite", "projection": "paraboloid"}},
    "a distant map for all": {"maps": {"size": 32, "distant": "infinite", "shared_distant": True}},
}


@pytest.mark.parametrize("name", SCENES)
def test_maps_are_fitted_to_the_display_in_every_kind_of_scene(name: str, tmp_path: Path) -> None:
    sections = copy.deepcopy(SCENES[name])
    if sections.pop("ground", False):
        sections["surroundings"] = {"panorama": sky(tmp_path), "ground": {"radius": 0.3, "albedo": 0.4}}
    config = scene(tmp_path, {"count": 1, "start": 20}, **sections)
    assert config.infer.fit == "display"
    bake(config, tmp_path / "pem")
    pem = open_pem(tmp_path / "pem")
    samples = pem.stage.visibility((0.0,), pem.run_time.places)
    images = pem.store.read_images(0)
    drawn = {
        contender: psnr(
            pem.run_time.render(contender, (0.0,), samples), images.object, images.coverage >= 0.99
        )
        for contender in ("pem", "static_infinite")
    }
    # A coat reflects a twentieth of the light, so that what it reflects counts less.
    assert drawn["pem"] > drawn["static_infinite"] + (1.0 if name == "diffuse under a coat" else 5.0)
    assert drawn["pem"] > 24.0
    header = pem.store.header
    assert header.faces == (2 if name == "paraboloids" else 6)
    assert len(header.maps) == {"no local layer": 2, "a distant map for all": 3}.get(name, 4)
    assert verify(tmp_path / "pem").is_sound


def test_the_page_draws_paraboloids_as_they_are(tmp_path: Path) -> None:
    config = scene(
        tmp_path,
        {"count": 1},
        maps={"size": 8, "distant": "infinite", "projection": "paraboloid"},
    )
    bake(config, tmp_path / "pem")
    pem = open_pem(tmp_path / "pem")
    web = WebPem(export_source(pem))
    assert json.loads(web.read("manifest.json"))["projection"] == "paraboloid"
    atlas = ImageFormat(exact=False).decode(web.read("samples/00000/0.avif"))
    assert atlas.shape == (8 + 4, 16, 3)


NEAR = {"count": 3, "degrees": 4.0, "start": 20}
"""Neighbours' views are fitted by a map itself, up to 3 degrees."""
FAR = {"count": 3, "degrees": 24.0, "start": 8}
"""Views between are fitted by the blend of maps."""


@pytest.mark.parametrize("views", [NEAR, FAR], ids=["near", "far"])
def test_samples_that_see_their_neighbours_are_the_same_in_any_order(
    views: dict[str, Any], tmp_path: Path
) -> None:
    config = scene(tmp_path, views, auto={"quality": "normal"}, static={"views": 3})
    bake(config, tmp_path / "whole")
    plan = PemStore.open(tmp_path / "whole").header.plan
    assert (plan.value("infer.neighbours"), plan.value("views.traced")) == (
        (0.3, 0) if views is NEAR else (0.0, 1)
    )
    whole = objects(tmp_path / "whole")
    with _core.ThreadLimit(1):
        for piece in ([2], [0], [1]):
            bake(config, tmp_path / "pieces", samples=piece)
    assert objects(tmp_path / "pieces") == whole


def decibels_at(pem: OpenedPem, contender: str, raised: float) -> float:
    """PSNR from so many degrees above the middle of an arc, against 64 samples per pixel."""
    cameras = pem.stage.built.cameras
    azimuth, elevation = cameras.angles_of(cameras.eye((0.5,)))
    camera = cameras.around(azimuth, elevation + raised)
    reflector, options = pem.stage.built.reflector, pem.stage.options
    options.noise, options.samples_per_pixel, options.seed = 0.0, 64, 99
    images = images_of_trace(pem.stage.tracer.trace_layers(camera, reflector, options))
    samples = pem.stage.tracer.trace_visibility(camera, reflector, options, pem.run_time.places)
    away = cameras.degrees_outside(camera.eye)
    drawn = pem.run_time.render(contender, (0.5,), samples, None, away)
    return psnr(drawn, images.object, images.coverage >= 0.99)


def test_a_pem_fades_to_its_static_set_with_the_distance_from_its_samples(tmp_path: Path) -> None:
    config = scene(tmp_path, NEAR, static={"views": 12, "elevation": [10, 60]})
    bake(config, tmp_path / "pem")
    pem = open_pem(tmp_path / "pem")
    assert pem.store.header.static["fade"]["degrees"] < 45.0
    on = {name: decibels_at(pem, name, 0.0) for name in ("pem", "static_set", "static_infinite")}
    # Its views are almost as near as the samples themselves at 64 x 48 pixels.
    assert on["pem"] > on["static_set"]
    far = {name: decibels_at(pem, name, 25.0) for name in ("pem", "static_set", "static_infinite")}
    # The fade is fitted to a handful of views of 64 x 48 pixels.
    assert far["pem"] > far["static_set"] - 0.5
    assert far["static_set"] > far["static_infinite"]
    render(tmp_path / "pem", (0.5,), tmp_path / "beyond.png", (3.0, 20.0))
    with pytest.raises(InputError, match="the eye would pass straight above"):
        render(tmp_path / "pem", (0.5,), tmp_path / "beyond.png", (0.0, 80.0))


def test_a_static_set_alone_has_no_parameters(tmp_path: Path) -> None:
    views = {"kind": "none", "start": -20, "degrees": 60, "count": 12, "elevation": [10, 50]}
    config = scene(tmp_path, views)
    bake(config, tmp_path / "pem")
    pem = open_pem(tmp_path / "pem")
    assert len(pem.space) == 1
    assert pem.space.sample(0) == ()
    samples = pem.stage.visibility((), pem.run_time.places)
    images = pem.store.read_images(0)
    drawn = {
        name: psnr(pem.run_time.render(name, (), samples), images.object, images.coverage >= 0.99)
        for name in ("pem", "static_infinite")
    }
    # The view that a PEM keeps lies in the middle of the dome and is none of those that it is inferred from.
    assert drawn["pem"] > drawn["static_infinite"] + 0.75


def test_a_third_of_the_views_of_a_static_set_lie_around_the_samples(tmp_path: Path) -> None:
    dome = {"views": 9, "elevation": [0.0, 60.0]}
    stage = prepare_stage(scene(tmp_path, {"count": 3, "degrees": 4.0, "start": 20.0}, static=dome))
    places = static_places(stage)
    (low, high), (bottom, top) = stage.built.cameras.range()
    near = [place for place, weight in places if weight == 1.0]
    far = [place for place, weight in places if weight < 1.0]
    assert (len(near), len(far)) == (3, 6)
    for azimuth, elevation in near:
        assert low - 10.0 <= azimuth <= high + 10.0
        assert bottom - 10.0 <= elevation <= top + 10.0
    assert max(azimuth for azimuth, _ in far) - min(azimuth for azimuth, _ in far) > 30.0
    # Alone it is inferred from all of its directions alike.
    alone = scene(tmp_path, {"kind": "none", "count": 6, "elevation": [0.0, 60.0]})
    assert [weight for _, weight in static_places(prepare_stage(alone))] == [1.0] * 6


def test_how_far_a_sample_holds_is_found_in_its_own_scene_with_its_own_light(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: list[float] = []

    def watched(stage: Stage, contents: Contents, baker: SampleBaker) -> float:
        for away, mine, _, truth in held_out(stage, contents, baker.bake(1), 1):
            if away < 4.0:
                shown = srgb_encoded(mine)
                found.append(-10.0 * math.log10(float(np.mean((shown - truth) ** 2))))
        return fit_fade(stage, contents, baker)

    monkeypatch.setattr("mirrorbake.bake.contents.fit_fade", watched)
    # Most of the light is the body's, and at the sample the object has turned by a right angle.
    config = scene(
        tmp_path,
        {"kind": "fixed", "start": 20},
        motion={"to": [0.05, 0.0, 0.0], "turn": 90.0, "count": 2},
        material={"fresnel": "schlick", "r0": 0.1, "albedo": 0.7},
        static={"views": 3},
    )
    bake(config, tmp_path / "pem")
    # Without its diffuse light there are 8 dB.
    assert found
    assert min(found) > 17.0


def test_a_pem_at_a_url_is_evaluated_and_reported_like_one_in_a_folder(tmp_path: Path) -> None:
    config = scene(tmp_path, {"kind": "fixed"})
    url = f"memory://evaluate-{tmp_path.name}"
    bake(config, url)
    bake(config, tmp_path / "pem")
    here, there = evaluate(tmp_path / "pem"), evaluate(url)
    assert there.written
    assert [view.metrics for view in there.views] == [view.metrics for view in here.views]
    # What the first evaluation traced and measured lies beside the PEM.
    place = Location(url)
    assert place.joined("metrics.json").read_bytes() == there.to_json().encode()
    again = evaluate(url)
    assert [view.seconds for view in again.views] == [view.seconds for view in there.views]
    with pytest.raises(OptionError, match=r"expected --out FILE"):
        report(url)
    page = report(url, tmp_path / "page.html").read_text(encoding="utf-8")
    assert "maps on disk" in page
    with served(tmp_path / "pem") as address:
        read_only = evaluate(address)
        from_the_web = report(address, tmp_path / "web.html").read_text(encoding="utf-8")
    # Nothing can be written there, which is said; the figures are those of the references that lie there.
    assert not read_only.written
    assert any("metrics.json: cannot write" in note for note in read_only.notes)
    assert [view.metrics for view in read_only.views] == [view.metrics for view in again.views]
    assert "maps on disk" in from_the_web
    with pytest.raises(StoreError, match=r"unknown://x/metrics\.json: cannot write: "):
        Location("unknown://x").joined("metrics.json").write_bytes(b"")

"""Views beside an arc: where they are, and that a PEM holds better off its arc for them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from mirrorbake.bake.around import STRIPS, WEIGHT, places_around
from mirrorbake.bake.bake import bake
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.pem.opened import open_pem
from mirrorbake.pem.view_images import images_of_trace
from mirrorbake.scene.cameras import Cameras
from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from pathlib import Path

ARC = Cameras("arc", (0.0, 0.0, 0.0), 1.0, math.tan(math.radians(20.0)), 20.0, 40.0, 30.0, (8, 8))


def distance(place: tuple[float, float], azimuth: float) -> float:
    """Degrees to a sample of `ARC`, small ones."""
    return math.hypot((place[0] - azimuth) * math.cos(math.radians(20.0)), place[1] - 20.0)


@pytest.mark.parametrize("count", [8, 16])
def test_half_of_the_views_are_next_to_a_sample_and_all_in_reach(count: int) -> None:
    near, far = [], []
    for step in range(41):
        places = places_around(ARC, (step / 40.0,), count)
        away = [distance(place[:2], 20.0 + step) for place in places]
        assert all(length <= STRIPS[1] + 1e-6 for length in away)
        near.append(sum(length <= STRIPS[0] for length in away))
        far.append(len(away) - near[-1])
        # What a view counts falls with its distance, and all together count less than a view of their own.
        order = np.argsort(away)
        assert np.all(np.diff([places[i].weight for i in order]) <= 0.0)
        assert sum(place.weight for place in places) < WEIGHT
    assert np.mean(near) == pytest.approx(count / 2, abs=0.25)
    assert np.mean(far) == pytest.approx(count / 2, abs=0.25)


def test_views_are_shared_between_samples_and_go_on_beyond_the_ends() -> None:
    all_of = [{place[:2] for place in places_around(ARC, (step / 40.0,), 8)} for step in range(41)]
    union = set().union(*all_of)
    # Eight a sample, but few more than one a degree in all.
    assert len(union) < 0.3 * sum(len(places) for places in all_of)
    assert min(place[0] for place in union) < 15.0
    assert max(place[0] for place in union) > 65.0
    assert places_around(ARC, (0.5,), 0) == []


def test_a_pem_holds_better_beyond_its_arc_with_views_from_there(tmp_path: Path) -> None:
    data = {
        "reflector": {"object": "teapot", "subdivisions": 8, "parts": "split"},
        "maps": {"size": 32, "distant": "box"},
        "trace": {"samples": 16, "depth": 2, "indirect": "none", "noise": 0.02},
        "static": {"views": 0},
        "layers": {"local": True, "hull_split": True},
    }
    views = {"count": 2, "degrees": 1.0, "start": 20.0, "size": [80, 60]}
    found = {}
    for around in (0, 8):
        config = parse_config({**data, "views": {**views, "around": around}}, "scene")
        bake(config, tmp_path / str(around))
        pem = open_pem(tmp_path / str(around))
        camera = pem.stage.built.cameras.around(23.5, 20.0)
        reflector, options = pem.stage.built.reflector, pem.stage.options
        options.noise, options.samples_per_pixel, options.seed = 0.0, 64, 99
        truth = images_of_trace(pem.stage.tracer.trace_layers(camera, reflector, options))
        seen = pem.stage.tracer.trace_visibility(camera, reflector, options, pem.run_time.places)
        drawn = pem.run_time.render("pem", 1.0, seen)
        found[around] = psnr(drawn, truth.object, truth.coverage >= 0.99)
    # 2.5 degrees past the last sample; 0.8 dB here, on larger pictures more.
    assert found[8] > found[0] + 0.4

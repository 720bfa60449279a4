"""The regulariser's weight by cross-validation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import mirrorbake as mb
from mirrorbake.bake.bake import bake
from mirrorbake.bake.choose_weights import CANDIDATES
from mirrorbake.errors import InputError
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.pem.opened import OpenedPem, open_pem
from mirrorbake.pem.view_images import images_of_trace
from mirrorbake.scene.load import parse_config

if TYPE_CHECKING:
    from pathlib import Path


def scene(folder: Path, **infer: Any) -> dict[str, Any]:
    """A teapot of few triangles under a panorama of many patches."""
    patches = np.random.default_rng(2).uniform(0.05, 1.0, (16, 32, 3)).repeat(4, 0).repeat(4, 1)
    mb.save_image(str(folder / "sky.exr"), patches.astype(np.float32), ["R", "G", "B"], format="float32")
    return {
        "reflector": {"subdivisions": 6, "parts": "joined"},
        "surroundings": {"panorama": str(folder / "sky.exr")},
        "views": {"count": 2, "degrees": 2.0, "start": 22.0, "size": [80, 60]},
        "layers": {"local": False},
        "maps": {"size": 32, "distant": "infinite"},
        "trace": {"samples": 16, "depth": 1},
        "auto": {"quality": "draft"},
        "infer": infer,
    }


def between_samples(pem: OpenedPem) -> float:
    """Decibels of the view half-way between the two samples, by the first one's maps alone."""
    stage, options = pem.stage, pem.stage.options
    options.samples_per_pixel, options.seed = 256, 5
    camera = stage.built.cameras.camera((0.5,))
    traced = images_of_trace(stage.tracer.trace_layers(camera, stage.built.reflector, options))
    seen = stage.tracer.trace_visibility(camera, stage.built.reflector, options, pem.run_time.places)
    return psnr(pem.run_time.render("pem", 0.0, seen), traced.object, traced.coverage > 0.99)


def test_the_weight_is_the_one_that_shows_best_what_it_did_not_see(tmp_path: Path) -> None:
    found = {}
    # Draft targets are noisy: the least regularised maps show their noise.
    for wanted in ("auto", min(CANDIDATES)):
        config = scene(tmp_path, smoothness=wanted, prior_weight=2e-4)
        bake(parse_config(config, "weights"), tmp_path / str(wanted))
        found[wanted] = open_pem(tmp_path / str(wanted))
    pem = found["auto"]
    decision = next(d for d in pem.store.header.plan.decisions if d.key == "infer.smoothness")
    assert decision.automatic
    assert decision.value in CANDIDATES
    assert "held out are met to" in decision.reason
    # An opened PEM has it, with the others in the ratio that they have to the usual 1e-4.
    infer = pem.stage.config.infer
    assert infer.smoothness == decision.value
    np.testing.assert_allclose(infer.prior_weight, 2.0 * decision.value)
    np.testing.assert_allclose(infer.level_agreement, decision.value)
    assert between_samples(pem) > between_samples(found[min(CANDIDATES)]) + 0.3


def test_layers_by_themselves_have_no_pixels_to_hold_out() -> None:
    with pytest.raises(InputError, match=r'infer\.smoothness = "auto" needs infer\.fit = "display"'):
        parse_config({"infer": {"smoothness": "auto", "fit": "layers"}}, "wrong")

"""The trial before a bake: how far its PEM will beat a captured map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from mirrorbake.bake.analyze import analyze
from mirrorbake.bake.bake import bake
from mirrorbake.bake.trial import WANTED_DECIBELS, Trial, advice_on, run_trial
from mirrorbake.evaluate.metrics import psnr
from mirrorbake.pem.opened import open_pem
from mirrorbake.pem.view_images import images_of_trace
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from pathlib import Path

    from mirrorbake.pem.opened import OpenedPem

TEAPOT: dict[str, Any] = {
    "reflector": {"object": "teapot", "subdivisions": 8, "parts": "split"},
    "views": {"count": 2, "degrees": 1.0, "start": 22.0, "size": [80, 60]},
    "maps": {"size": 32, "distant": "box"},
    "layers": {"local": True, "diffuse": False},
    "trace": {"samples": 32, "noise": 0, "depth": 1, "indirect": "none"},
    "static": {"views": 0},
}


def decibels(pem: OpenedPem, contender: str, point: float) -> float:
    """Of a view against a tracing of its own, whose noise is far below what is measured."""
    options = pem.stage.options
    options.samples_per_pixel, options.seed = 512, 77
    built = pem.stage.built
    traced = images_of_trace(
        pem.stage.tracer.trace_layers(built.cameras.camera((point,)), built.reflector, options)
    )
    samples = pem.stage.visibility(point, pem.run_time.places)
    return psnr(pem.run_time.render(contender, point, samples), traced.object, traced.coverage > 0.999)


@pytest.mark.parametrize("material", [{}, {"roughness": 0.2, "albedo": 0.3}], ids=["mirror", "rough"])
def test_the_trial_foretells_what_the_bake_reaches(tmp_path: Path, material: dict[str, Any]) -> None:
    layers = {**TEAPOT["layers"], "diffuse": bool(material)}
    config = parse_config({**TEAPOT, "material": material, "layers": layers}, "teapot")
    stage = prepare_stage(config)
    plan = analyze(stage)
    trial = run_trial(stage.planned(plan), plan)
    assert trial is not None
    assert f"by {trial.lead:.1f} dB" in plan.advice[0]
    assert trial.lead >= WANTED_DECIBELS
    bake(config, tmp_path / "pem", stage=stage)
    pem = open_pem(tmp_path / "pem", stage)
    # The pictures are as small as the trial's, so that the same is baked, by a solver that goes on longer;
    # the trial's reference has few samples, whose noise it takes off, but not without an error: on the sample
    # 64 a half say 31.9 dB and 1024 say 29.7.
    assert decibels(pem, "pem", 0.0) == pytest.approx(trial.on, abs=2.5)
    assert decibels(pem, "pem", 0.5) == pytest.approx(trial.between, abs=2.5)
    assert decibels(pem, "static_infinite", 0.5) == pytest.approx(trial.captured, abs=0.3)


def test_a_pem_that_gains_little_is_told_of_before_the_bake() -> None:
    # Maps of views 40 degrees apart blend to nothing that is there.
    scene = {**TEAPOT, "views": {**TEAPOT["views"], "degrees": 40.0}}
    words = next(words for words in analyze(prepare_stage(parse_config(scene, "far"))).advice)
    assert words.startswith("warning: half-way between samples the PEM beats a captured map at infinity by")
    assert "nearer samples help" in words


@pytest.mark.parametrize(
    ("trial", "reason"),
    [
        (Trial(on=36.0, between=33.0, captured=31.0, noise=45.0), "hard to beat"),
        (Trial(on=30.0, between=20.0, captured=18.0, noise=40.0), "nearer samples help"),
        (Trial(on=24.0, between=23.0, captured=18.0, noise=25.0), "noise of its targets is 25.0 dB"),
        (Trial(on=22.0, between=21.4, captured=16.7, noise=33.0), "more than its maps hold"),
    ],
)
def test_the_reason_is_what_limits(trial: Trial, reason: str) -> None:
    words = advice_on(trial)
    assert words.startswith("warning: ")
    assert reason in words


@pytest.mark.parametrize(
    "change",
    [
        {"views": {"count": 1, "size": [32, 24]}},
        {"auto": {"quality": "draft"}},
        {"infer": {"fit": "layers"}},
    ],
)
def test_where_there_is_nothing_to_try_nothing_is_said(change: dict[str, Any]) -> None:
    plan = analyze(prepare_stage(parse_config({**TEAPOT, **change}, "none")))
    assert not any("half-way" in words for words in plan.advice)

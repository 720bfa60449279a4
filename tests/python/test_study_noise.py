"""How far tracings of one view are apart, on pictures small enough for a test."""

import numpy as np
import pytest

from mirrorbake import _core
from mirrorbake.study.noise import BLOCK, View, bias, main

SIDE = 96
"""Pixels of a side; the page on the tracer has the figures of 256."""


@pytest.fixture(scope="module")
def view() -> View:
    return View(side=SIDE)


def test_samples_that_go_where_the_noise_is_beat_four_times_as_many_everywhere(view: View) -> None:
    even = view.agreement(64, 64)
    adapted = view.agreement(16, 16, noise=0.02)
    # 3 dB and more at 256² pixels, for half as many samples.
    assert adapted.decibels > even.decibels
    assert adapted.spent < 64


def test_four_times_the_samples_agree_better_by_at_least_their_share_of_the_variance(view: View) -> None:
    # Independent samples would gain 6.02 dB; stratified ones gain no less, up to the spread of one trial.
    assert view.agreement(64, 64).decibels > view.agreement(16, 16).decibels + 6.02 - 1.5


def test_a_tracing_agrees_with_itself_and_not_with_another_seed(view: View) -> None:
    first, covered, spent = view.trace(4, 1)
    again, _, _ = view.trace(4, 1)
    other, _, _ = view.trace(4, 2)
    assert spent == 4
    assert covered.sum() > SIDE * SIDE / 4
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


@pytest.fixture
def _one_ray_for_cached_light(monkeypatch: pytest.MonkeyPatch) -> None:
    real = _core.TracerOptions
    few = {"cache_rays": 1, "cache_bounces": 1}
    monkeypatch.setattr(_core, "TracerOptions", lambda **options: real(**(options | few)))


@pytest.mark.usefixtures("_one_ray_for_cached_light")
def test_the_worst_block_is_named_with_its_own_error() -> None:
    side = 4 * BLOCK
    found = bias(16, 3, side=side)["none"]
    pictures = View(side=side)
    block = found.block[0] * (side // BLOCK) + found.block[1]
    off = []
    for seed in range(3):
        (light, hits), (paths, path_hits) = (pictures.blocks(m, 16, seed) for m in ("none", "path"))
        off.append(light[block] / hits[block] - paths[block] / path_hits[block])
    # Shares of one mean radiance, so the ratio is free of it. Light is missing there, more than elsewhere.
    np.testing.assert_allclose(found.error / found.worst, np.std(off, ddof=1) / 3**0.5 / np.mean(off))
    assert found.worst < found.mean < 0


@pytest.mark.usefixtures("_one_ray_for_cached_light")
def test_another_seed_of_the_cache_is_another_cache() -> None:
    one, other, again = (View(side=2 * BLOCK, cache_seed=seed).blocks("cached", 4, 0) for seed in (0, 1, 0))
    np.testing.assert_array_equal(one[0], again[0])
    assert (one[0] != other[0]).any()


def test_a_seed_below_zero_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--bias", "--cache-seed", "-1"])
    assert "--cache-seed -1: expected 0 to 2^64 - 1" in capsys.readouterr().err


def test_a_seed_that_nothing_takes_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--cache-seed", "1"])
    assert "--cache-seed 1: is measured with --bias alone" in capsys.readouterr().err

"""How far tracings of one view are apart, on pictures small enough for a test."""

import numpy as np
import pytest

from mirrorbake.study.noise import View

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

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mirrorbake.evaluate.metrics import display_referred, mean_or_none, psnr


def test_the_transfer_function_has_the_published_values_of_srgb() -> None:
    # 8-bit codes and linear values by the formula of IEC 61966-2-1: code 0, the last on the linear segment,
    # middle grey and white.
    linear = np.array([0.0, 10 / 255 / 12.92, 0.2158605, 1.0], np.float32)
    codes = display_referred(linear) * 255
    np.testing.assert_allclose(codes, [0, 10, 128, 255], atol=2e-3)


def test_what_a_display_cannot_show_is_clipped() -> None:
    values = np.array([-1.0, -1e-30, 1.0, 1.5, 1e30, np.inf], np.float32)
    np.testing.assert_allclose(display_referred(values), [0, 0, 1, 1, 1, 1], rtol=0, atol=1e-15)


@given(st.floats(0, 1, width=32), st.floats(0, 1, width=32))
def test_the_transfer_function_is_monotonic(a: float, b: float) -> None:
    shown = display_referred(np.array(sorted((a, b)), np.float32))
    assert shown[0] <= shown[1]


def test_psnr_of_a_constant_error_is_its_closed_form() -> None:
    # 0.2158605 shows as 128/255, 0 as 0: the error is 128/255 everywhere.
    black = np.zeros((3, 4, 3), np.float32)
    grey = np.full((3, 4, 3), 0.2158605, np.float32)
    everywhere = np.ones((3, 4), bool)
    assert psnr(grey, black, everywhere) == pytest.approx(-20 * math.log10(128 / 255), abs=1e-4)


def test_only_pixels_of_the_mask_count() -> None:
    a, b = np.zeros((2, 2, 3), np.float32), np.zeros((2, 2, 3), np.float32)
    b[0, 0] = 1.0
    mask = np.ones((2, 2), bool)
    # One of four pixels is wrong by 1: the mean squared error is 1/4.
    assert psnr(a, b, mask) == pytest.approx(10 * math.log10(4))
    mask[0, 0] = False
    assert psnr(a, b, mask) == math.inf
    assert math.isnan(psnr(a, b, np.zeros((2, 2), bool)))


def test_nan_outside_of_the_mask_is_ignored_and_inside_is_an_error() -> None:
    a, b = np.zeros((2, 2, 3), np.float32), np.full((2, 2, 3), 0.5, np.float32)
    a[0, 0, 1] = np.nan
    mask = np.ones((2, 2), bool)
    with pytest.raises(ValueError, match="not finite"):
        psnr(a, b, mask)
    mask[0, 0] = False
    assert math.isfinite(psnr(a, b, mask))


def test_shapes_that_do_not_fit_are_rejected() -> None:
    with pytest.raises(ValueError, match="do not belong together"):
        psnr(np.zeros((2, 2, 3), np.float32), np.zeros((2, 3, 3), np.float32), np.ones((2, 2), bool))


def test_mean_leaves_out_what_is_not_a_number() -> None:
    assert mean_or_none([1.0, None, 3.0, math.inf, math.nan]) == 2.0
    assert mean_or_none([None, math.nan]) is None

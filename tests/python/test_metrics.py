from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter, shift

from mirrorbake.evaluate.metrics import (
    display_referred,
    flip,
    mean_or_none,
    motion,
    psnr,
    sliding,
    ssim,
    worst_error,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray


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


def linear(shown: NDArray[np.float64]) -> NDArray[np.float32]:
    """Inverse of `display_referred`."""
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4).astype(np.float32)


def picture(seed: int, shape: tuple[int, int] = (64, 80)) -> NDArray[np.float64]:
    """Smooth coloured structure of some ten pixels, in display values 0.2 to 0.8."""
    noise = np.random.default_rng(seed).normal(size=(*shape, 3))
    smooth = gaussian_filter(noise, (3, 3, 0))
    shown: NDArray[np.float64] = 0.5 + 0.3 * smooth / np.abs(smooth).max()
    return shown


def test_psnr_of_known_noise_is_its_closed_form() -> None:
    # The yardstick: noise of standard deviation σ in display values has -20 log10 σ. Of 57,600 values the
    # mean square scatters by √(2/57600) = 0.6 %: 0.026 dB.
    shown = picture(1, (120, 160))
    everywhere = np.ones(shown.shape[:2], bool)
    for sigma in (0.001, 0.01, 0.05):
        noise = np.random.default_rng(2).normal(scale=sigma, size=shown.shape)
        value = psnr(linear(shown + noise), linear(shown), everywhere)
        assert value == pytest.approx(-20 * math.log10(sigma), abs=0.1)


def test_equal_images_have_the_best_value_of_every_metric() -> None:
    image = linear(picture(3))
    everywhere = np.ones(image.shape[:2], bool)
    assert psnr(image, image, everywhere) == math.inf
    assert ssim(image, image, everywhere) == pytest.approx(1.0)
    assert flip(image, image, everywhere) == pytest.approx(0.0, abs=1e-6)
    assert worst_error(image, image, everywhere) == 0.0
    assert sliding((image, image), motion((image, image), everywhere)) == 0.0


def test_every_metric_gets_worse_with_more_noise() -> None:
    shown = picture(4)
    noise = np.random.default_rng(5).normal(size=shown.shape)
    image, little, much = linear(shown), linear(shown + 0.02 * noise), linear(shown + 0.1 * noise)
    everywhere = np.ones(shown.shape[:2], bool)
    assert psnr(little, image, everywhere) > psnr(much, image, everywhere) + 10
    assert ssim(little, image, everywhere) > ssim(much, image, everywhere) + 0.1
    assert flip(little, image, everywhere) + 0.02 < flip(much, image, everywhere)
    assert 4 * worst_error(little, image, everywhere) < worst_error(much, image, everywhere)


def test_the_worst_pixels_are_one_in_a_hundred() -> None:
    black, image = np.zeros((10, 20, 3), np.float32), np.zeros((10, 20, 3), np.float32)
    image[3, 4], image[5, 6] = 1.0, 1.0
    assert worst_error(image, black, np.ones((10, 20), bool)) == pytest.approx(1.0)
    image[5, 6] = 0.0
    # One of the two worst is black: √½.
    assert worst_error(image, black, np.ones((10, 20), bool)) == pytest.approx(math.sqrt(0.5))


def test_sliding_is_the_difference_of_the_motions() -> None:
    a = picture(6, (96, 120))
    everywhere = np.ones(a.shape[:2], bool)

    def moved(pixels: float) -> NDArray[np.float32]:
        return linear(shift(a, (0, pixels, 0), order=3, mode="wrap"))

    frames = {pixels: moved(pixels) for pixels in (0.0, 0.5, 1.0, 2.0)}
    # What moves as it should slides by nothing; what stands still slides by all of the motion.
    assert sliding((frames[0.0], frames[1.0]), motion((frames[0.0], frames[1.0]), everywhere)) == 0.0
    for pixels in (0.5, 1.0, 2.0):
        still = sliding((frames[0.0], frames[0.0]), motion((frames[0.0], frames[pixels]), everywhere))
        assert still == pytest.approx(pixels, rel=0.1)
    half = sliding((frames[0.0], frames[0.5]), motion((frames[0.0], frames[1.0]), everywhere))
    assert half == pytest.approx(0.5, rel=0.15)


def test_metrics_of_nothing_are_not_a_number() -> None:
    image, nothing = linear(picture(7)), np.zeros((64, 80), bool)
    for metric in (psnr, ssim, flip, worst_error):
        assert math.isnan(metric(image, image, nothing))
    assert math.isnan(sliding((image, image), motion((image, image), nothing)))
    # No texture determines a motion on a plain wall.
    wall = np.full((64, 80, 3), 0.3, np.float32)
    assert math.isnan(sliding((wall, wall), motion((wall, wall), ~nothing)))

"""Tone mapping against what the Khronos specification says of it."""

import numpy as np
import pytest

from mirrorbake.errors import OptionError
from mirrorbake.tone import displayed, srgb_bytes, tone_map


def reference(colour: list[float]) -> list[float]:
    """One colour by the steps of the Khronos PBR Neutral specification."""
    x = min(colour)
    offset = x - 6.25 * x * x if x < 0.08 else 0.04
    colour = [c - offset for c in colour]
    peak = max(colour)
    start = 0.8 - 0.04
    if peak < start:
        return colour
    d = 1.0 - start
    new_peak = 1.0 - d * d / (peak + d - start)
    colour = [c * new_peak / peak for c in colour]
    g = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0)
    return [c * (1.0 - g) + new_peak * g for c in colour]


def test_colours_are_mapped_as_the_specification_has_it() -> None:
    rng = np.random.default_rng(0)
    colours = np.exp(rng.uniform(-7.0, 5.0, (500, 3)))
    expected = [reference(list(colour)) for colour in colours]
    # float32 in and out, double between.
    np.testing.assert_allclose(tone_map(colours.astype(np.float32)), expected, atol=2e-6)


def test_painted_colours_stay_and_bright_ones_never_pass_white() -> None:
    # A grey of 0.5 seen with the 0.04 that its surface reflects of a white sky comes out as 0.5.
    np.testing.assert_allclose(tone_map(np.full((1, 3), 0.54, np.float32)), 0.5, atol=1e-6)
    bright = tone_map(np.array([[1e6, 2e5, 0.0], [0.0, 0.0, 0.0]], np.float32))
    assert bright.max() <= 1.0
    np.testing.assert_array_equal(bright[1], 0.0)


def test_exposure_is_in_stops_and_unknown_names_are_refused() -> None:
    np.testing.assert_array_equal(displayed(np.full((1, 3), 0.25, np.float32), 1.0, "none"), 0.5)
    with pytest.raises(OptionError, match="tone-map = 'filmic': expected none or neutral"):
        displayed(np.zeros((1, 3), np.float32), 0.0, "filmic")
    with pytest.raises(OptionError, match="exposure = 21: expected -20 to 20"):
        displayed(np.zeros((1, 3), np.float32), 21.0, "none")


def test_srgb_bytes_are_those_of_the_standard() -> None:
    values = np.array([-1.0, 0.0, 0.0031308, 0.2158605, 1.0, 9.0], np.float32)
    assert srgb_bytes(values).tolist() == [0, 0, 10, 128, 255, 255]

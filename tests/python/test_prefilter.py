"""Prefiltered maps: lobes, chains and harmonics as Python sees them."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mirrorbake import InvalidArgument
from mirrorbake.envmap import EnvMap
from mirrorbake.errors import InputError
from mirrorbake.prefilter import (
    Harmonics,
    Prefilter,
    chain_alphas,
    ggx,
    ggx_chain,
    irradiance,
    lambert,
    phong,
    prefilter,
    split_sum,
    split_sum_table,
    table,
)
from mirrorbake.projection import texel_directions, texel_solid_angles


@pytest.fixture(scope="module")
def sky() -> EnvMap:
    d = texel_directions("latlong", 128, 64)
    image = 0.4 + 0.3 * np.sin(4 * d) + np.random.default_rng(2).random(d.shape) * 0.2
    image[20, 90] = 3e4
    return EnvMap.from_array(image.astype(np.float32), "latlong")


def test_irradiance_is_the_sum_over_all_texels(sky: EnvMap) -> None:
    normals = texel_directions("cube", 6, 6, 2).reshape(-1, 3).astype(np.float64)
    lights = texel_directions("latlong", 128, 64).reshape(-1, 3).astype(np.float64)
    cosines = np.maximum(normals @ lights.T, 0) * texel_solid_angles("latlong", 128, 64).ravel()
    expected = cosines @ sky.level().reshape(-1, 3).astype(np.float64)
    ours = irradiance(sky, 6).level()[2].reshape(-1, 3)
    np.testing.assert_allclose(ours, expected, rtol=2e-6)  # float32 texel directions and results
    mean = prefilter(sky, lambert(), 6).level()[2].reshape(-1, 3)
    np.testing.assert_allclose(mean, expected / cosines.sum(1)[:, None], rtol=2e-6)


def test_maps_and_single_directions_agree(sky: EnvMap) -> None:
    several = Prefilter(sky)
    # Directions alone read the cells that suit them, tiles of texels those that suit all of them.
    for lobe, tolerance in ((lambert(), 1e-6), (phong(30), 2e-2), (phong(1e4), 1e-6), (ggx(0.3), 2e-2)):
        faces = several.apply(lobe, 4).level()
        directions = np.stack([texel_directions("cube", 4, 4, face) for face in range(6)])
        np.testing.assert_allclose(several.sample(lobe, directions), faces, rtol=tolerance)


def test_progress_is_told_and_may_end_the_work(sky: EnvMap) -> None:
    done: list[float] = []
    Prefilter(sky).apply(phong(30), 16, progress=done.append)
    assert done == sorted(done)
    assert done[-1] == 1.0

    def stop(share: float) -> None:
        raise RuntimeError(f"enough at {share}")

    several = Prefilter(sky)
    with pytest.raises(RuntimeError, match="enough"):
        several.apply(phong(30), 16, progress=stop)
    np.testing.assert_array_equal(several.apply(phong(30), 8).values, prefilter(sky, phong(30), 8).values)


def test_sums_are_means_times_the_integral_of_the_lobe(sky: EnvMap) -> None:
    lobe = ggx(0.4)
    sums = prefilter(sky, lobe, 4, scale="sum").values
    np.testing.assert_allclose(sums, prefilter(sky, lobe, 4).values * lobe.integral, rtol=2e-3)


def test_a_table_of_one_value_is_a_cone(sky: EnvMap) -> None:
    cone = table([1.0], 40.0)
    assert cone.weight(np.cos(np.radians(39))) == 1.0
    assert cone.weight(np.cos(np.radians(41))) == 0.0
    with pytest.raises(InvalidArgument, match="one dimension"):
        table([[1.0]])


def test_chains_have_the_levels_renderers_expect(sky: EnvMap) -> None:
    chain = ggx_chain(sky, 32, 4)
    assert [chain.level(i).shape for i in range(4)] == [(6, 32 >> i, 32 >> i, 3) for i in range(4)]
    np.testing.assert_array_equal(chain.level(0), sky.resample("cube", 32).level())
    np.testing.assert_allclose(chain_alphas(4), [0, 1 / 9, 4 / 9, 1])
    np.testing.assert_allclose(chain_alphas(4, roughness="linear"), [0, 1 / 3, 2 / 3, 1])
    alone = prefilter(sky, ggx(chain_alphas(4)[2]), 8).level()
    np.testing.assert_allclose(chain.level(2), alone, rtol=1e-6)  # sums of finer cells, in another order


def test_split_sum_is_what_sampling_gives() -> None:
    rng = np.random.default_rng(0)
    cosine, alpha = 0.6, 0.5
    u, v = rng.random((2, 400_000))
    cos_h = np.sqrt((1 - u) / (1 + (alpha**2 - 1) * u))
    sin_h = np.sqrt(1 - cos_h**2)
    v_h = sin_h * np.cos(2 * np.pi * v) * np.sqrt(1 - cosine**2) + cos_h * cosine
    n_l = 2 * v_h * cos_h - cosine
    seen = (n_l > 0) & (v_h > 0)
    c = np.stack([np.full_like(n_l, cosine), np.where(seen, n_l, 1)])
    hidden = 0.5 * (np.sqrt(1 + alpha**2 * (1 / c**2 - 1)) - 1)  # Λ of Heitz, JCGT 2014, eq. 72
    masking = 1 / (1 + hidden.sum(0))
    weight = np.where(seen, masking * v_h / (cos_h * cosine), 0)
    fresnel = (1 - np.clip(v_h, 0, 1)) ** 5
    scale, bias = split_sum(cosine, alpha)
    assert scale == pytest.approx(((1 - fresnel) * weight).mean(), abs=3e-3)  # noise of the samples
    assert bias == pytest.approx((fresnel * weight).mean(), abs=3e-3)
    assert split_sum_table(16).shape == (16, 16, 3)


def test_harmonics_go_through_json_and_to_three_js(sky: EnvMap) -> None:
    light = Harmonics.project(sky, 2)
    again = Harmonics.from_json(light.to_json())
    np.testing.assert_array_equal(again.coefficients, light.coefficients)
    probe = json.loads(json.dumps(light.three_js()))
    assert len(probe["sh"]) == 27
    assert probe["sh"][3:6] == light.coefficients[1].tolist()
    with pytest.raises(InvalidArgument, match="coefficients"):
        Harmonics.from_json("{}")
    with pytest.raises(InvalidArgument, match=r"\(16, 3\)"):
        Harmonics.project(sky, 3).three_js()


def test_harmonics_go_through_files(sky: EnvMap, tmp_path: Path) -> None:
    light = Harmonics.project(sky, 3)
    light.save(tmp_path / "light.json")
    np.testing.assert_array_equal(Harmonics.load(tmp_path / "light.json").coefficients, light.coefficients)
    light.save(tmp_path / "light.exr")
    again = Harmonics.load(tmp_path / "light.exr").coefficients
    np.testing.assert_array_equal(again, light.coefficients.astype(np.float32))
    EnvMap.from_array(np.ones((1, 5, 3), np.float32), "latlong").save(tmp_path / "five.exr")
    with pytest.raises(InvalidArgument, match="order"):
        Harmonics.load(tmp_path / "five.exr")
    sky.save(tmp_path / "sky.exr")
    with pytest.raises(InvalidArgument, match="64 rows"):
        Harmonics.load(tmp_path / "sky.exr")
    with pytest.raises(InputError, match=r"none\.json"):
        Harmonics.load(tmp_path / "none.json")


def test_error_map_is_nine_coefficients_against_all_texels(sky: EnvMap) -> None:
    error = Harmonics.project(sky).error_map(sky, 8)
    exact = irradiance(sky, 8)
    relative = np.abs(error.values).max() / exact.values.max()
    assert 1e-4 < relative < 0.1  # Ramamoorthi and Hanrahan: some percent at most


@pytest.mark.parametrize(
    "call",
    [
        lambda m: phong(0.5),
        lambda m: ggx(2),
        lambda m: prefilter(m, phong(5), 0),
        lambda m: Harmonics.project(m, 9),
        lambda m: ggx_chain(m, 16, 9),
    ],
)
def test_what_is_out_of_range_is_refused(sky: EnvMap, call: Callable[[EnvMap], object]) -> None:
    with pytest.raises(InvalidArgument, match="expected"):
        call(sky)


def test_values_that_are_not_finite_are_counted() -> None:
    image = np.ones((4, 8, 3), np.float32)
    image[0, 0] = np.nan
    with pytest.raises(InvalidArgument, match="3 NaN or infinite values"):
        Prefilter(EnvMap.from_array(image, "latlong"))


def test_half_precision_goes_in_and_comes_out(sky: EnvMap, tmp_path: Path) -> None:
    halves, clamped = sky.half()
    assert clamped == 0
    source = EnvMap.from_array(halves, sky.projection)
    ours = prefilter(source, phong(30), 8)
    # Values of the source have 11 bits, and so has their mean.
    np.testing.assert_allclose(ours.values, prefilter(sky, phong(30), 8).values, rtol=2**-11)
    ours.save(tmp_path / "half.exr", format="half")
    again = EnvMap.load(tmp_path / "half.exr", "cube")
    np.testing.assert_allclose(again.values, ours.values, rtol=2**-11)


def test_the_largest_half_float_stays_finite_in_every_lobe() -> None:
    values = np.zeros((32, 64, 3), np.float32)
    values[7, 11] = 65504
    source = EnvMap.from_array(values, "latlong")
    several = Prefilter(source)
    for lobe in (phong(1), phong(1e6), ggx(0.01), ggx(0.0), ggx(1.0)):
        made = several.apply(lobe, 16).values
        assert np.isfinite(made).all()
        assert made.min() >= 0
        assert made.max() <= 65504 * (1 + 1e-6)

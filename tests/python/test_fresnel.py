"""Fresnel reflectance against 50-digit arithmetic, and the Python side of it."""

import itertools
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mirrorbake import _core, fresnel

DIGITS = 50
# tan(pi/4 - x) near the critical angle doubles the digits lost; the rest is margin.
mpmath.mp.dps = 2 * DIGITS


def exact(c: float, n: complex) -> mpmath.mpf:
    """Snell's law and the amplitudes of both polarisations, as textbooks have them."""
    cosine = mpmath.mpf(c)
    index = mpmath.mpc(n)
    if index == 1:
        return mpmath.mpf(0)
    inner = mpmath.sqrt(index**2 - (1 - cosine**2))
    s = (cosine - inner) / (cosine + inner)
    p = (index**2 * cosine - inner) / (index**2 * cosine + inner)
    return (abs(s) ** 2 + abs(p) ** 2) / 2


def exact_schlick(c: float, r0: float) -> mpmath.mpf:
    return mpmath.mpf(r0) + (1 - mpmath.mpf(r0)) * (1 - mpmath.mpf(c)) ** 5


def allowance(value: mpmath.mpf, dtype: type[np.floating]) -> float:
    ulp = float(np.spacing(dtype(max(float(value), float(np.finfo(dtype).tiny)))))
    return 4 * ulp + (1e-7 if dtype is np.float32 else 1e-15)


def check(result: float, expected: mpmath.mpf, dtype: type[np.floating], what: object) -> None:
    assert 0 <= result <= 1, what
    error = float(abs(mpmath.mpf(float(result)) - expected))
    assert error <= allowance(expected, dtype), (what, float(expected), error)


EXTREME_COSINES = [0.0, 1e-45, 1e-30, 1e-7, 1e-3, 0.5, 1 - 1e-7, 1.0]
EXTREME_INDICES = [1e-6, 0.01, 0.66, 1 - 1e-7, 1.0, 1 + 1e-7, 1.0001, 1.049, 1.05, 1.5, 200.0, 1e6, 1e19]
EXTREME_K = [0.0, 1e-30, 1e-7, 1e-3, 0.7, 3.0, 1e3, 1e6]
DTYPES: list[type[np.floating[Any]]] = [np.float32, np.float64]


@pytest.mark.parametrize("dtype", DTYPES)
def test_dielectric_is_exact_at_the_extremes(dtype: type[np.floating]) -> None:
    for c, n in itertools.product(EXTREME_COSINES, EXTREME_INDICES):
        c, n = float(dtype(c)), float(dtype(n))
        check(fresnel.dielectric(np.array([c], dtype), n)[0], exact(c, n), dtype, (c, n))


@pytest.mark.parametrize("dtype", DTYPES)
def test_dielectric_is_exact_around_the_critical_angle(dtype: type[np.floating]) -> None:
    for n in [1e-4, 0.01, 0.3, 0.5, 0.66, 0.9, 0.9999, 1 - 1e-7]:
        n = float(dtype(n))
        critical = dtype(float(mpmath.sqrt(1 - mpmath.mpf(n) ** 2)))
        cosines = [critical]
        for direction in (dtype(0), dtype(1)):
            c = critical
            for _ in range(20):
                c = np.nextafter(c, direction)
                cosines.append(c)
        for c, f in zip(cosines, fresnel.dielectric(np.array(cosines, dtype), n), strict=True):
            check(f, exact(float(c), n), dtype, (float(c), n))


@pytest.mark.parametrize("dtype", DTYPES)
def test_conductor_is_exact_at_the_extremes(dtype: type[np.floating]) -> None:
    # 5000 elements, to meet the polynomials that long arrays use; the first ones are looked at.
    for n, k in itertools.product(EXTREME_INDICES[:-1], EXTREME_K):
        n, k = float(dtype(n)), float(dtype(k))
        cosines = np.resize(np.array(EXTREME_COSINES, dtype), 5000)
        results = fresnel.conductor(cosines, n, k)
        for c, f in zip(cosines[: len(EXTREME_COSINES)].tolist(), results.tolist(), strict=False):
            check(f, exact(c, complex(n, k)), dtype, (c, n, k))


unit32 = st.floats(0, 1, width=32)
unit64 = st.floats(0, 1)


@settings(max_examples=300, deadline=None)
@given(c=unit64, log_n=st.floats(-9, 12))
@example(c=0.0, log_n=0.0)
def test_dielectric_is_exact_everywhere(c: float, log_n: float) -> None:
    for dtype in DTYPES:
        c, n = float(dtype(c)), float(dtype(10**log_n))
        check(fresnel.dielectric(np.array([c], dtype), n)[0], exact(c, n), dtype, (c, n, dtype))


@settings(max_examples=300, deadline=None)
@given(c=unit64, log_n=st.floats(-6, 6), log_k=st.floats(-12, 6))
def test_conductor_is_exact_everywhere(c: float, log_n: float, log_k: float) -> None:
    for dtype in DTYPES:
        c, n, k = float(dtype(c)), float(dtype(10**log_n)), float(dtype(10**log_k))
        check(fresnel.conductor(np.array([c], dtype), n, k)[0], exact(c, complex(n, k)), dtype, (c, n, k))
        each = fresnel.conductor(np.array([c], dtype), np.array([n], dtype), np.array([k], dtype))[0]
        check(each, exact(c, complex(n, k)), dtype, (c, n, k, "each"))


@settings(max_examples=200, deadline=None)
@given(c=unit64, n=st.floats(0.05, 20), k=st.floats(0.05, 20))
def test_conductor_is_exact_for_long_arrays_of_metals(c: float, n: float, k: float) -> None:
    c, n, k = (float(np.float32(value)) for value in (c, n, k))
    f = fresnel.conductor(np.full(5000, c, np.float32), n, k)
    assert np.all(f == f[0])
    check(f[0], exact(c, complex(n, k)), np.float32, (c, n, k))


@settings(max_examples=200, deadline=None)
@given(c=unit64, r0=unit64)
def test_schlick_is_exact_everywhere(c: float, r0: float) -> None:
    for dtype in DTYPES:
        c, r0 = float(dtype(c)), float(dtype(r0))
        check(fresnel.schlick(np.array([c], dtype), r0)[0], exact_schlick(c, r0), dtype, (c, r0))


@settings(max_examples=200, deadline=None)
@given(c=unit64, log_n=st.floats(-3, 9))
def test_transmittance_is_exact_relative_to_itself(c: float, log_n: float) -> None:
    n = float(10**log_n)
    expected = 1 - exact(c, n)
    result = float(fresnel.dielectric_transmittance(c, n))
    # Below the critical angle both are 0, at it g is a square root of what cancels.
    assert result == pytest.approx(float(expected), rel=4e-15, abs=1e-60)


def test_results_broadcast_and_keep_float32() -> None:
    c = np.linspace(0, 1, 5, dtype=np.float32)
    ior = np.array([1.33, 1.5, 2.4], np.float32)
    f = fresnel.dielectric(c[:, None], ior)
    assert f.shape == (5, 3)
    assert f.dtype == np.float32
    for i, n in enumerate(ior):
        np.testing.assert_allclose(f[:, i], fresnel.dielectric(c, float(n)), rtol=5e-7)
    assert fresnel.dielectric(c, 1.5).dtype == np.float32
    assert fresnel.dielectric(c.astype(np.float64), ior[0]).dtype == np.float64
    assert fresnel.schlick(0.5, 0.04).shape == ()
    assert fresnel.conductor(c[::2], ior[:, None], 1.0).shape == (3, 3)
    assert fresnel.schlick(c, np.full((2, 5), 0.04, np.float32)).shape == (2, 5)
    assert fresnel.dielectric(np.zeros((0, 3)), 1.5).shape == (0, 3)
    np.testing.assert_array_equal(fresnel.dielectric([-1.0, 2.0, np.nan], 1.5), [1.0, 0.04, np.nan])
    swapped = c.astype(c.dtype.newbyteorder())
    np.testing.assert_allclose(fresnel.dielectric(swapped, 1.5), fresnel.dielectric(c, 1.5), rtol=5e-7)


def test_results_go_where_they_are_wanted() -> None:
    c = np.linspace(0, 1, 10).reshape(2, 5)
    out = np.empty((2, 5))
    assert fresnel.conductor(c, 0.2, 3.9, out=out) is out
    np.testing.assert_array_equal(out, fresnel.conductor(c, 0.2, 3.9))
    with pytest.raises(ValueError, match="out is float32"):
        fresnel.dielectric(c, 1.5, out=np.empty((2, 5), np.float32))
    with pytest.raises(ValueError, match="overlaps an input"):
        fresnel.schlick(out, 0.04, out=out)


def test_bad_parameters_are_value_errors_that_name_them() -> None:
    with pytest.raises(ValueError, match="ior is 0, expected"):
        fresnel.dielectric(0.5, 0.0)
    with pytest.raises(ValueError, match="r0 is 2"):
        fresnel.schlick(0.5, [2.0])
    with pytest.raises(ValueError, match="k is -1"):
        fresnel.conductor([0.5], 1.0, -1.0)
    with pytest.raises(ValueError, match="metal is mithril"):
        fresnel.metal_reflectance("mithril", 1.0)
    with pytest.raises(ValueError, match="illuminant is D50"):
        fresnel.metal_reflectance("gold", 1.0, "D50")  # type: ignore[arg-type]


@pytest.mark.parametrize("wanted", [1e-2, 1e-3, 1e-4])
def test_table_meets_the_wanted_error(wanted: float) -> None:
    c = np.linspace(0, 1, 20001)
    for model in (fresnel.Schlick(0.04), fresnel.Dielectric(1.5), fresnel.Conductor(0.2, 3.9)):
        table = fresnel.table_for_error(model, wanted)
        worst = np.abs(table(c) - model(c)).max()
        assert 0 < worst <= wanted
        assert table.max_error == pytest.approx(worst, rel=0.02)
        assert len(table) == len(table.values)
        assert table(c.astype(np.float32)).dtype == np.float32
        assert len(fresnel.make_table(model, 7)) == 7
    with pytest.raises(_core.NumericalError, match="65536"):
        fresnel.table_for_error(fresnel.Dielectric(0.66), 1e-4)
    with pytest.raises(ValueError, match="max_error"):
        fresnel.table_for_error(fresnel.Dielectric(1.5), 0.0)


def test_metal_colour_is_the_integral_of_its_spectrum() -> None:
    for metal in fresnel.metal_names():
        colour = fresnel.metal_colour(metal)
        assert colour.source.startswith(("Johnson", "Rakić"))
        c = np.linspace(0, 1, 33)
        rgb = fresnel.metal_reflectance(metal, c)
        assert rgb.shape == (33, 3)
        np.testing.assert_array_equal(rgb[-1], colour.normal)
        np.testing.assert_allclose(rgb[0], 1.0, atol=1e-12)
        for channel in range(3):
            fitted = fresnel.conductor(c, colour.eta[channel], colour.k[channel])
            assert np.abs(fitted - rgb[:, channel]).max() <= colour.index_error[channel] + 1e-6
            approximated = fresnel.schlick(c, colour.r0[channel])
            assert np.abs(approximated - rgb[:, channel]).max() <= colour.r0_error[channel] + 1e-6
    constants = _core.metal_optical_constants("Au")
    # Johnson & Christy 1972, table I: 2.26 eV.
    assert [548.6, 0.43, 2.455] in constants.tolist()


def test_an_instruction_set_is_in_use() -> None:
    assert _core.active_isa() in {"baseline", "sse42", "avx2", "avx512"}

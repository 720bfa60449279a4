"""What every Fresnel model costs and how far off it is (spec F5), over its whole domain.

Three questions: how exact float32 and float64 are against 50 digits; how far Schlick and tables are from the
full equations; and what an evaluation takes.
"""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from mirrorbake import _core, fresnel

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

INDICES = (1.0001, 1.001, 1.01, 1.1, 1.33, 1.5, 2.0, 2.4, 4.0, 10.0, 50.0, 200.0)
RARER = (0.3, 0.66, 0.99)  # below 1: seen from inside glass and water
DIGITS = 50
_TIMED = 1 << 20


def _models() -> dict[str, fresnel.Dielectric | fresnel.Conductor]:
    # Parameters that float32 holds exactly: what they are rounded by is not the models' error.
    models: dict[str, fresnel.Dielectric | fresnel.Conductor] = {
        f"n = {n:g}": fresnel.Dielectric(float(np.float32(n))) for n in INDICES
    }
    for metal in fresnel.metal_names():
        colour = fresnel.metal_colour(metal)
        models[f"{metal}, green"] = fresnel.Conductor(
            float(np.float32(colour.eta[1])), float(np.float32(colour.k[1]))
        )
    return models


def _nanoseconds(function: Callable[[], object]) -> float:
    best = float("inf")
    for _ in range(5):
        start = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - start)
    return 1e9 * best / _TIMED


def _approximations(wanted: float) -> list[dict[str, Any]]:
    """Largest error over the cosines and ns per float32 evaluation of F1 to F4, per material."""
    c = np.linspace(0, 1, _TIMED)
    narrow = c.astype(np.float32)
    out = np.empty_like(narrow)
    rows = []
    for name, model in _models().items():
        exact = model(narrow.astype(np.float64))
        f = model(narrow)
        schlick = fresnel.Schlick(float(model(1.0)))
        row: dict[str, Any] = {
            "material": name,
            "exact_error": float(np.abs(f - exact).max()),
            "exact_ns": _nanoseconds(lambda model=model: _fill(model, narrow, out)),  # type: ignore[misc]
            "schlick_error": float(np.abs(schlick(narrow) - exact).max()),
            "schlick_ns": _nanoseconds(lambda schlick=schlick: _fill(schlick, narrow, out)),  # type: ignore[misc]
        }
        try:
            table = fresnel.table_for_error(model, wanted)
        except _core.NumericalError:
            row |= {"table_size": None, "table_error": None, "table_ns": None}
        else:
            row |= {
                "table_size": len(table),
                "table_error": float(np.abs(table(narrow) - exact).max()),
                "table_ns": _nanoseconds(lambda table=table: table(narrow, out=out)),  # type: ignore[misc]
            }
        rows.append(row)
    return rows


def _fill(model: fresnel.Model, c: fresnel.Array, out: fresnel.Array) -> None:
    match model:
        case fresnel.Schlick(r0):
            fresnel.schlick(c, r0, out=out)
        case fresnel.Dielectric(ior):
            fresnel.dielectric(c, ior, out=out)
        case fresnel.Conductor(eta, k):
            fresnel.conductor(c, eta, k, out=out)


def _cosines(dtype: type[np.floating[Any]], count: int) -> Any:
    """Half of them evenly spaced, half evenly in the exponent: grazing incidence is where digits are lost."""
    low = np.geomspace(1e-12, 1, count // 2)
    return np.unique(np.concatenate([np.linspace(0, 1, count - count // 2), low]).astype(dtype))


def rounding(count: int) -> list[dict[str, Any]]:
    """Error curves of both precisions against mpmath."""
    import mpmath

    def exact(c: float, n: complex) -> Any:
        cosine, index = mpmath.mpf(c), mpmath.mpc(n)
        inner = mpmath.sqrt(index**2 - (1 - cosine**2))
        s = (cosine - inner) / (cosine + inner)
        p = (index**2 * cosine - inner) / (index**2 * cosine + inner)
        return (abs(s) ** 2 + abs(p) ** 2) / 2

    models: dict[str, fresnel.Dielectric | fresnel.Conductor] = {
        f"n = {n:g}": fresnel.Dielectric(n) for n in RARER
    }
    models |= _models()
    curves = []
    with mpmath.workdps(2 * DIGITS):
        for name, model in models.items():
            for dtype, absolute in ((np.float32, 1e-7), (np.float64, 1e-15)):
                c = _cosines(dtype, count)
                if isinstance(model, fresnel.Dielectric):
                    index = complex(float(dtype(model.ior)))
                    f = fresnel.dielectric(c, index.real)
                else:
                    index = complex(float(dtype(model.eta)), float(dtype(model.k)))
                    f = fresnel.conductor(np.resize(c, 5000), index.real, index.imag)[: len(c)]
                expected = [exact(float(x), index) for x in c]
                error = np.array(
                    [float(abs(mpmath.mpf(float(a)) - b)) for a, b in zip(f, expected, strict=True)]
                )
                ulp = np.spacing(np.array([float(b) for b in expected], dtype)).astype(np.float64)
                curves.append(
                    {
                        "material": name,
                        "dtype": np.dtype(dtype).name,
                        "max_error": float(error.max()),
                        "share_of_allowance": float((error / (4 * ulp + absolute)).max()),
                        "c": c.astype(float).tolist(),
                        "error": error.tolist(),
                    }
                )
    return curves


def study(max_error: float = 1e-3, samples: int = 200) -> dict[str, Any]:
    """Measure everything.

    Parameters
    ----------
    max_error : what tables are made for, 1e-6 to 1.
    samples : cosines per curve that are compared with 50 digits.

    Returns
    -------
    ``approximations``: one row per material, errors of Schlick and tables against the full equations, and
    ns per float32 evaluation with all threads. ``rounding``: per material and dtype the error curve against
    mpmath; ``share_of_allowance`` is its largest part of 4 ulp + 1e-7 (float32) or 4 ulp + 1e-15 (float64).
    ``metals``: colours and fitted models.
    """
    return {
        "digits": DIGITS,
        "isa": _core.active_isa(),
        "threads": _core.thread_count(),
        "max_error": max_error,
        "approximations": _approximations(max_error),
        "rounding": rounding(samples),
        "metals": [vars(fresnel.metal_colour(metal)) for metal in fresnel.metal_names()],
    }


def plot(result: dict[str, Any], folder: Path) -> list[Path]:
    """Write ``fresnel-rounding.png``, ``fresnel-approximations.png`` and ``fresnel-metals.png``."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    folder.mkdir(parents=True, exist_ok=True)
    paths = []

    figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
    for axis, dtype, absolute in zip(axes, ("float32", "float64"), (1e-7, 1e-15), strict=True):
        for curve in result["rounding"]:
            if curve["dtype"] == dtype:
                axis.plot(curve["c"], np.maximum(curve["error"], absolute * 1e-3), lw=0.5, alpha=0.7)
        allowed = absolute + 4 * np.spacing(np.array(0.99, dtype))
        axis.axhline(allowed, color="black", ls="--", lw=1, label="allowed where F is near 1")
        axis.set(
            yscale="log",
            xlim=(0, 1),
            xlabel="cosine",
            ylabel="|error|",
            title=f"F2 and F3, {dtype}",
        )
        axis.set_xscale("symlog", linthresh=1e-6)
        axis.legend(loc="lower right")
    paths.append(folder / "fresnel-rounding.png")
    figure.savefig(paths[-1], dpi=100)
    plt.close(figure)

    c = np.linspace(0, 1, 2001)
    figure, axes = plt.subplots(1, 2, figsize=(11, 4), layout="constrained")
    for axis, approximation in zip(axes, ("Schlick", "table"), strict=True):
        for number, (name, model) in enumerate(_models().items()):
            if approximation == "Schlick":
                f = fresnel.schlick(c, float(model(1.0)))
            else:
                try:
                    f = fresnel.table_for_error(model, result["max_error"])(c)
                except _core.NumericalError:
                    continue
            colour = plt.get_cmap("turbo")(number / 17)
            axis.plot(c, np.maximum(np.abs(f - model(c)), 1e-9), lw=0.8, color=colour, label=name)
        axis.set(
            yscale="log",
            ylim=(1e-8, 1),
            xlabel="cosine",
            ylabel="|error|",
            title=f"{approximation} against the full equations",
        )
    axes[1].legend(fontsize=6, ncols=2, loc="upper right")
    paths.append(folder / "fresnel-approximations.png")
    figure.savefig(paths[-1], dpi=100)
    plt.close(figure)

    figure, axes = plt.subplots(2, 3, figsize=(11, 6), layout="constrained", sharex=True)
    for axis, metal in zip(axes.flat, result["metals"], strict=True):
        rgb = fresnel.metal_reflectance(metal["metal"], c)
        for channel, line in enumerate(("#c33", "#292", "#33c")):
            axis.plot(c, rgb[:, channel], color=line, lw=1.5)
            axis.plot(c, fresnel.schlick(c, metal["r0"][channel]), color=line, lw=0.8, ls="--")
        axis.set(title=metal["metal"], xlim=(0, 1))
    figure.supxlabel("cosine; solid: spectral, dashed: Schlick fitted")
    figure.supylabel("reflectance, linear Rec.709")
    paths.append(folder / "fresnel-metals.png")
    figure.savefig(paths[-1], dpi=100)
    plt.close(figure)
    return paths

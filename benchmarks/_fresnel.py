"""F1 to F4 over arrays of float32 against NumPy expressions, Mitsuba's LLVM backend, and copying memory."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks._mitsuba import mitsuba
from benchmarks._report import Case, require, seconds, seconds_in_turn
from mirrorbake import _core, fresnel

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

# A quarter of a megabyte in and as much out lies in the second-level cache, 4 MB not; 64 MB in no cache.
COUNTS = (1 << 16, 1 << 20, 1 << 24)
EVALUATIONS = 1 << 25  # per contender and round
IOR = 1.5
GOLD = (0.43, 2.455)  # green, Johnson & Christy 1972
R0 = 0.04
TABLE_ERROR = 1e-3

# Two float32 implementations of one formula; the textbook form of F2 loses digits near grazing incidence.
SAME = 2e-5


def numpy_schlick(c: Any) -> Any:
    m = 1 - c
    m2 = m * m
    return np.float32(R0) + np.float32(1 - R0) * (m2 * m2 * m)


def numpy_dielectric(c: Any) -> Any:
    """[EMT] eq. 13 as it stands."""
    g = np.sqrt(np.float32(IOR * IOR - 1) + c * c)
    a = (g - c) / (g + c)
    b = (c * (g + c) - 1) / (c * (g - c) + 1)
    return np.float32(0.5) * (a * a) * (1 + b * b)


def numpy_conductor(c: Any) -> Any:
    n, k = np.float32(GOLD[0]), np.float32(GOLD[1])
    c2 = c * c
    s2 = 1 - c2
    t = n * n - k * k - s2
    m = np.sqrt(t * t + 4 * n * n * k * k)
    a = np.sqrt(np.float32(0.5) * (m + t))
    x = 2 * a * c
    rs = (m + c2 - x) / (m + c2 + x)
    p = m * c2 + s2 * s2
    y = x * s2
    return np.float32(0.5) * rs * (1 + (p - y) / (p + y))


def numpy_table(values: Any, c: Any) -> Any:
    x = c * np.float32(len(values) - 1)
    i = np.minimum(x.astype(np.int32), len(values) - 2)
    low = values[i]
    return low + (x - i.astype(np.float32)) * (values[i + 1] - low)


def mitsuba_kernels(mi: Any, values: Any) -> dict[str, Callable[[Any], Any]]:
    import drjit as dr

    gold = dr.llvm.ad.Complex2f(*GOLD)
    table = mi.Float(values)

    def schlick(c: Any) -> Any:
        m = 1 - c
        m2 = m * m
        return R0 + (1 - R0) * (m2 * m2 * m)

    def interpolate(c: Any) -> Any:
        x = c * (len(values) - 1)
        i = dr.minimum(mi.UInt32(x), len(values) - 2)
        low = dr.gather(mi.Float, table, i)
        return low + (x - mi.Float(i)) * (dr.gather(mi.Float, table, i + 1) - low)

    return {
        "F1 Schlick": schlick,
        "F2 dielectric": lambda c: mi.fresnel(c, IOR)[0],
        "F3 conductor": lambda c: mi.fresnel_conductor(c, gold),
        "F4 table": interpolate,
    }


def evaluator(mi: Any, kernel: Callable[[Any], Any], cosines: Any) -> Callable[[], Any]:
    import drjit as dr

    on_device = mi.Float(cosines)
    dr.eval(on_device)

    def evaluate() -> Any:
        result = kernel(on_device)
        dr.eval(result)
        dr.sync_thread()
        return result

    return evaluate


def cases() -> Iterator[Case]:
    table = fresnel.table_for_error(fresnel.Dielectric(IOR), TABLE_ERROR)
    values = np.array(table.values)
    exact: dict[str, Callable[[Any], Any]] = {
        "F1 Schlick": fresnel.Schlick(R0),
        "F2 dielectric": fresnel.Dielectric(IOR),
        "F3 conductor": fresnel.Conductor(*GOLD),
        "F4 table": table,
    }
    ours: dict[str, Callable[[Any, Any], Any]] = {
        "F1 Schlick": lambda c, f: fresnel.schlick(c, R0, out=f),
        "F2 dielectric": lambda c, f: fresnel.dielectric(c, IOR, out=f),
        "F3 conductor": lambda c, f: fresnel.conductor(c, *GOLD, out=f),
        "F4 table": lambda c, f: table(c, out=f),
    }
    in_numpy: dict[str, Callable[[Any], Any]] = {
        "F1 Schlick": numpy_schlick,
        "F2 dielectric": numpy_dielectric,
        "F3 conductor": numpy_conductor,
        "F4 table": partial(numpy_table, values),
    }
    mi = mitsuba("llvm_ad_rgb")
    in_mitsuba = mitsuba_kernels(mi, values) if mi is not None else {}
    for count in COUNTS:
        # Shuffled, as pixels are: neighbouring cosines are not neighbours in a table.
        cosines = np.random.default_rng(4).permutation(np.linspace(0, 1, count, dtype=np.float32))
        out = np.empty_like(cosines)
        scale, repetitions = 1e9 / count, EVALUATIONS // count
        for threads in (1, 2):
            limit = _core.ThreadLimit(threads)
            for name in ours:
                reference = exact[name](cosines.astype(np.float64))
                contenders: list[Callable[[], Any]] = [
                    partial(ours[name], cosines, out),
                    partial(np.copyto, out, cosines),
                ]
                if mi is not None:
                    import drjit as dr

                    dr.set_thread_count(threads)
                    contenders.append(evaluator(mi, in_mitsuba[name], cosines))
                times = [scale * time for time in seconds_in_turn(contenders, repetitions)]
                ours[name](cosines, out)
                error = float(np.abs(out - reference).max())
                peers: list[tuple[str, float, float]] = []
                if threads == 1:
                    time = scale * seconds(partial(in_numpy[name], cosines), max(1, repetitions // 16))
                    peers.append(("NumPy float32", time, np.abs(in_numpy[name](cosines) - reference).max()))
                if mi is not None:
                    result = np.asarray(contenders[2]())
                    peers.append(("Mitsuba llvm_ad_rgb", times[2], np.abs(result - reference).max()))
                # What a copy has to do with it is its time alone.
                peers.append(("memory copy, 1 thread", times[1], 0.0))
                for peer_name, peer_time, peer_error in peers:
                    require(
                        max(error, peer_error) < SAME,
                        f"{name}, {peer_name}: {error:.2g} and {peer_error:.2g}",
                    )
                    yield Case(
                        case=f"{name}, {count:,} cosines, {threads} thread{'s' if threads > 1 else ''}",
                        unit="ns per evaluation",
                        ours=times[0],
                        peer=peer_time,
                        peer_name=peer_name,
                        error_ours=error,
                        error_peer=float(peer_error),
                    )
            del limit

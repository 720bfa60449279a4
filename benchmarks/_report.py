"""What the benchmarks share: timing, the comparison of answers, and the two forms of output."""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence


@dataclass(frozen=True)
class Case:
    """One measured case; `ours` and `peer` are times in `unit`, the errors are against a common reference."""

    case: str
    unit: str
    ours: float
    peer: float
    peer_name: str
    error_ours: float
    error_peer: float

    @property
    def ratio(self) -> float:
        """How many times as fast as the peer."""
        return self.peer / self.ours


class Effort:
    """How long `run` measures: --quick sees that all of it runs and that the answers agree, no more."""

    quick = False


def seconds(function: Callable[[], object], repetitions: int = 5) -> float:
    """Shortest of several runs, after one that warms caches up."""
    function()
    best = float("inf")
    for _ in range(1 if Effort.quick else repetitions):
        start = time.perf_counter()
        function()
        best = min(best, time.perf_counter() - start)
    return best


def seconds_in_turn(functions: Sequence[Callable[[], object]], repetitions: int) -> list[float]:
    """`seconds` of each, in five rounds: a clock that changes with time is the same for all."""
    count = 1 if Effort.quick else 5
    rounds = [[seconds(function, repetitions) for function in functions] for _ in range(count)]
    return [min(times) for times in zip(*rounds, strict=True)]


def require(condition: bool, message: str) -> None:
    """End the benchmark with exit status 1: times of different answers must not be compared."""
    if not condition:
        sys.exit(f"benchmark: the answers differ: {message}")


def run(description: str, cases: Callable[[], Iterable[Case]]) -> None:
    """Command line of a benchmark: a table, or with --json one object per line."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--json", action="store_true", help="print one JSON object per case")
    parser.add_argument("--quick", action="store_true", help="measure once, to see that all of it runs")
    arguments = parser.parse_args()
    Effort.quick = arguments.quick
    report(cases(), as_json=arguments.json)


def report(cases: Iterable[Case], *, as_json: bool) -> None:
    """Print cases as they come: a table, or one JSON object per line."""
    table = Table("case", "unit", "mirrorbake", "peer", "peer is", "ratio", "our error", "peer's error")
    for case in cases:
        if as_json:
            print(json.dumps({**asdict(case), "ratio": case.ratio}), flush=True)
        else:
            row = (case.ours, case.peer), (case.ratio, case.error_ours, case.error_peer)
            table.add_row(
                case.case,
                case.unit,
                *(f"{value:.4g}" for value in row[0]),
                case.peer_name,
                *(f"{value:.3g}" for value in row[1]),
            )
    if not as_json:
        console = Console()
        Console(width=max(console.width, 140)).print(table)

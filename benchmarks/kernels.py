"""The numerical kernels that every pixel goes through, in nanoseconds per evaluation."""

from collections.abc import Iterator

from benchmarks import _fresnel, _proxy
from benchmarks._report import Case, run


def cases() -> Iterator[Case]:
    yield from _fresnel.cases()
    yield from _proxy.cases()


if __name__ == "__main__":
    run("Fresnel reflectance and proxy lookups against NumPy, Mitsuba and copying memory.", cases)

"""The numerical kernels that every pixel goes through, in nanoseconds per evaluation."""

from collections.abc import Iterator

from benchmarks import _fresnel
from benchmarks._report import Case, run


def cases() -> Iterator[Case]:
    yield from _fresnel.cases()


if __name__ == "__main__":
    run("Fresnel reflectance against NumPy, Mitsuba and copying memory.", cases)

"""Reading all of a PEM, to find what is damaged."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mirrorbake.errors import StoreError
from mirrorbake.pem.store import PemStore

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from mirrorbake.pem.location import Location


@dataclass(frozen=True)
class Verdict:
    """What reading a whole PEM found."""

    samples: int
    """That there should be."""
    missing: tuple[int, ...]
    """Numbers of samples that are not baked."""
    damaged: tuple[int, ...]
    """Numbers of samples that cannot be read; a bake of the same scene makes them anew."""
    problems: tuple[str, ...]
    """What is damaged, one line each."""

    @property
    def is_sound(self) -> bool:
        """Whether all samples are there and can be read."""
        return not self.missing and not self.problems


def damaged_samples(store: PemStore, samples: Sequence[int]) -> dict[int, str]:
    """Read whole samples and return those that are damaged, with what is wrong."""
    damaged = {}
    for index in samples:
        try:
            store.check_sample(index)
        except StoreError as failure:
            damaged[index] = str(failure)
    return damaged


def verify(place: Location | Path | str, progress: Callable[[int, int, str], None] | None = None) -> Verdict:
    """Read every chunk of a PEM and compare it with its checksum.

    Parameters
    ----------
    place
        Folder or URL of the PEM.
    progress
        Told about every sample.

    Raises
    ------
    StoreError
        There is no PEM, or its attributes are damaged, so that what it should hold is not known.
    """
    report = progress or (lambda done, total, text: None)
    store = PemStore.open(place)
    done = store.completed()
    problems, damaged = [], []
    for name in store.array_names():
        try:
            store.check_array(name)
        except StoreError as failure:
            problems.append(str(failure))
    for index in range(len(done)):
        report(index, len(done), f"sample {index + 1} of {len(done)}")
        if done[index]:
            found = damaged_samples(store, [index])
            damaged += list(found)
            problems += list(found.values())
    report(len(done), len(done), f"{len(done)} samples")
    missing = tuple(int(index) for index in (~done).nonzero()[0])
    return Verdict(len(done), missing, tuple(damaged), tuple(problems))

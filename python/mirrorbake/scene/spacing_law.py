"""The law of a scene: how well views between maps are met, by how far apart the maps are."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


@dataclass(frozen=True)
class SpacingTrial:
    """What a trial bake of maps so far apart reached."""

    degrees: float
    """Between neighbouring maps, along the axis where they are furthest apart."""
    traced: int
    """Views in a cell between them that were traced, too."""
    decibels: float
    """PSNR of views within the cell that were in no fit."""


@dataclass(frozen=True)
class SpacingLaw:
    """PSNR between maps as a function of their spacing.

    Piecewise linear in the logarithm of the spacing, through the trials with the fewest traced views of each
    spacing, made to fall; beyond them by the slope of all. More traced views add so many dB each time that
    the views of a cell double, with its node among them.
    """

    trials: tuple[SpacingTrial, ...]
    """At least one."""

    def decibels(self, degrees: float, traced: int | None = None) -> float:
        """Return the PSNR foretold of a spacing.

        Parameters
        ----------
        degrees
            Above 0.
        traced
            Views in a cell; None: as many as the trial of that spacing would have had.

        Examples
        --------
        >>> law = SpacingLaw((SpacingTrial(2.0, 0, 34.0), SpacingTrial(8.0, 4, 31.0)))
        >>> [round(law.decibels(degrees), 6) for degrees in (2.0, 4.0, 16.0)]
        [34.0, 32.5, 29.5]
        """
        base = self._base
        at = math.log2(degrees)
        places = [math.log2(trial.degrees) for trial in base]
        values = falling([trial.decibels for trial in base])
        found = float(np.interp(at, places, values)) - self.slope * (
            min(at - places[0], 0.0) + max(at - places[-1], 0.0)
        )
        if traced is None:
            return found
        usual = base[int(np.argmin([abs(at - place) for place in places]))].traced
        return found + self.gain * math.log2((1.0 + traced) / (1.0 + usual))

    @property
    def slope(self) -> float:
        """Decibels that twice the spacing costs, 0 at least: the straight line nearest to all spacings."""
        base = self._base
        if len(base) < 2:
            return 0.0
        places = [math.log2(trial.degrees) for trial in base]
        return max(0.0, -float(np.polyfit(places, [trial.decibels for trial in base], 1)[0]))

    @property
    def gain(self) -> float:
        """Decibels that twice the views of a cell are worth, 0 at least; 0 where it was not tried."""
        gains = [
            (b.decibels - a.decibels) / math.log2((1.0 + b.traced) / (1.0 + a.traced))
            for a, b in pairwise(self._ordered)
            if a.degrees == b.degrees
        ]
        return max(0.0, sum(gains) / len(gains)) if gains else 0.0

    def __str__(self) -> str:
        """Return the law in words."""
        points = ", ".join(
            f"{trial.decibels:.1f} dB {trial.degrees:.3g} degrees apart" for trial in self._base
        )
        words = f"between maps there are {points}"
        if len(self._base) > 1:
            words += f": twice as far apart costs {self.slope:.1f} dB"
        if any(a.degrees == b.degrees for a, b in pairwise(self._ordered)):
            words += f", twice the views in a cell are worth {self.gain:.1f} dB"
        return f"{words}, in trials of small pictures and maps"

    @property
    def _ordered(self) -> list[SpacingTrial]:
        return sorted(self.trials, key=lambda trial: (trial.degrees, trial.traced))

    @property
    def _base(self) -> list[SpacingTrial]:
        fewest = {trial.degrees: trial for trial in reversed(self._ordered)}
        return [fewest[degrees] for degrees in sorted(fewest)]

    def to_dict(self) -> list[dict[str, Any]]:
        """Return plain values."""
        return [asdict(trial) for trial in self.trials]

    @staticmethod
    def from_dict(trials: Sequence[Mapping[str, Any]]) -> SpacingLaw:
        """Inverse of `to_dict`. Raises TypeError for what is not one."""
        return SpacingLaw(tuple(SpacingTrial(**trial) for trial in trials))


def falling(values: list[float]) -> list[float]:
    """Return the nearest values, by least squares, none of which is above the one before it.

    Examples
    --------
    >>> falling([3.0, 1.0, 2.0, 0.0])
    [3.0, 1.5, 1.5, 0.0]
    """
    # Neighbours that rise are pooled to their mean, again and again.
    pools: list[tuple[float, int]] = []
    for value in values:
        pools.append((value, 1))
        while len(pools) > 1 and pools[-1][0] > pools[-2][0]:
            (a, n), (b, m) = pools[-2:]
            pools[-2:] = [((a * n + b * m) / (n + m), n + m)]
    return [value for value, count in pools for _ in range(count)]

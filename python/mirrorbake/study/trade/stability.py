"""Whether a study's fronts stay under another seed: two studies of a scene, trial by trial."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, replace
from typing import TYPE_CHECKING, Any

from mirrorbake.errors import InputError
from mirrorbake.study.trade.study import COSTS, NOTICEABLE, SAME_PRICE, STUDY_NAME, Study
from mirrorbake.study.trade.trial import Trial

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from mirrorbake.study.trade.notebook import Identity

NOUNS = {"bytes_per_degree": "bytes", "bake_s": "time to bake", "draw_ms": "time to draw"}
"""What the costs are called."""


@dataclass(frozen=True)
class FrontStability:
    """What another seed makes of a front."""

    steps: int
    """Of the other study's front."""
    kept: int
    """Of those that hold: what this study finds for no higher price is not better by `NOTICEABLE`."""
    off: float
    """DB at most that the other's front, drawn by this study's figures, is below this study's at its price;
    infinite where it has nothing as cheap."""
    ratio: float
    """Root mean square of the logarithm of a cost's ratio to the other's."""


@dataclass(frozen=True)
class Stability:
    """Two studies of one scene under different seeds, of the settings that both tried."""

    trials: int
    deviation: float
    """Root mean square of the differences of their figures, mean on a sample and between two, dB."""
    largest: float
    """Largest difference, dB."""
    fronts: dict[str, FrontStability]
    """By cost."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain values; None for an infinite one."""
        data = asdict(self)
        for front in data["fronts"].values():
            front["off"] = front["off"] if math.isfinite(front["off"]) else None
        return data

    def words(self) -> list[str]:
        """Sentences for people."""
        found = [
            f"under the other seed {self.trials} trials differ by {self.deviation:.2f} dB root mean square, "
            f"{self.largest:.2f} at most"
        ]
        for cost, front in self.fronts.items():
            below = "has nothing as cheap"
            if math.isfinite(front.off):
                below = f"is at most {front.off:.2f} dB below this one's best at any price"
            found.append(
                f"{NOUNS[cost]}: {front.kept} of {front.steps} steps of the other's front hold, nothing as "
                f"cheap is better by {NOTICEABLE} dB; it {below}; costs differ by {front.ratio:.0%}"
            )
        return found


def read_study(folder: Path, against: Identity | None = None) -> Study:
    """Return the study in a folder, as far as it has come.

    Parameters
    ----------
    folder
        Of the study.
    against
        What it will be compared with, if anything.

    Raises
    ------
    InputError
        There is none, or it is one of another scene, or under the same seed.
    """
    path = folder / STUDY_NAME
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        scene, seed = data["scene"], data["seed"]
        trials = [Trial.from_dict(trial) for trial in data["trials"]]
        base = next(trial for trial in trials if not trial.settings)
    except (OSError, ValueError, KeyError, TypeError, StopIteration) as failure:
        raise InputError(f"{path}: expected a study: {failure or 'it has no trials'}") from None
    if against is not None and scene != against.scene:
        raise InputError(f"{path}: a study of another scene, or by another version")
    if against is not None and seed == against.seed:
        raise InputError(f"{path}: under seed {seed}, too; expected one under another seed (--seed)")
    return Study(base, [], [trial for trial in trials if trial.settings], len(trials))


def combinations_of(study: Study) -> list[Mapping[str, str]]:
    """The settings of a study's combinations, labels by axis."""
    return [trial.settings for trial in study.trials if len(trial.settings) > 1]


def compare(study: Study, other: Study) -> Stability:
    """Compare a study with another one of the same scene, of the settings that both tried."""
    theirs = {_key(trial): trial for trial in other.all if trial.near is not None}
    pairs = [(trial, theirs[_key(trial)]) for trial in study.all if trial.near and _key(trial) in theirs]
    differences = [mine.near - their.near for mine, their in pairs if mine.near and their.near]
    if not differences:
        raise InputError("the studies have no trial in common")
    here, there = (_of(whole, [pair[n] for pair in pairs]) for n, whole in enumerate((study, other)))
    return Stability(
        len(pairs),
        _root_mean_square(differences),
        max(abs(difference) for difference in differences),
        {cost: _front_stability(here, there, cost, pairs) for cost in COSTS},
    )


def _front_stability(
    here: Study, there: Study, cost: str, pairs: Sequence[tuple[Trial, Trial]]
) -> FrontStability:
    mine = here.front(cost)
    theirs = {_key(trial) for trial in there.front(cost)}
    again = [trial for trial in here.all if _key(trial) in theirs]
    kept = sum(_best(mine, getattr(step, cost), cost) <= (step.near or 0.0) + NOTICEABLE for step in again)
    off = 0.0
    for step in mine:
        off = max(off, (step.near or 0.0) - _best(again, SAME_PRICE * getattr(step, cost), cost))
    ratios = [math.log(getattr(a, cost) / getattr(b, cost)) for a, b in pairs]
    return FrontStability(len(theirs), kept, off, _root_mean_square(ratios))


def _best(trials: Sequence[Trial], price: float, cost: str) -> float:
    """DB of the best of some trials for a price; -infinity if there is none."""
    return max((trial.near or 0.0 for trial in trials if getattr(trial, cost) <= price), default=-math.inf)


def _of(study: Study, trials: Sequence[Trial]) -> Study:
    """The study with these trials alone."""
    base = next((trial for trial in trials if not trial.settings), study.base)
    return replace(study, base=base, trials=[trial for trial in trials if trial.settings])


def _root_mean_square(values: Sequence[float]) -> float:
    return math.sqrt(sum(value * value for value in values) / len(values))


def _key(trial: Trial) -> str:
    return json.dumps(sorted(trial.settings.items()))

"""Trials of a study: measured as far as the time allows, and kept on disk, so that a study can go on."""

from __future__ import annotations

import hashlib
import json
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from mirrorbake import _core
from mirrorbake.errors import InputError
from mirrorbake.files import write_text
from mirrorbake.scene.inputs import hash_inputs
from mirrorbake.study.trade.trial import Trial

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.study.trade.axes import Setting
    from mirrorbake.study.trade.trial import Bench


def words_of(settings: Mapping[str, Setting]) -> str:
    """What a trial tries, for people."""
    return ", ".join(f"{axis} {setting.label}" for axis, setting in settings.items())


@dataclass(frozen=True)
class Identity:
    """What a study may go on with, or be compared with."""

    scene: str
    """Changes with the scene, its files and the library, not with the seed."""
    seed: int

    @classmethod
    def of(cls, config: SceneConfig) -> Identity:
        """The identity of a scene as it is studied."""
        inputs = {key: {**value, "path": None} for key, value in hash_inputs(config).items()}
        scene = json.loads(config.model_dump_json())
        seed = scene["trace"].pop("seed")
        text = json.dumps([_core.version(), scene, inputs], sort_keys=True)
        return cls(hashlib.sha256(text.encode()).hexdigest(), seed)


class Notebook:
    """Trials on disk, written after each."""

    def __init__(self, path: Path, identity: Identity) -> None:
        self._path, self._identity = path, identity
        self._trials: dict[str, Trial] = {}
        self.refused: dict[str, str] = {}
        if not path.exists():
            return
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            if Identity(data["scene"], data["seed"]) != identity:
                raise InputError(f"{path}: a study of another scene or seed; give another folder with --out")
            trials = [Trial.from_dict(trial) for trial in data["trials"]]
            self.refused = dict(data["refused"])
        except (OSError, ValueError, KeyError, TypeError) as failure:
            if isinstance(failure, InputError):
                raise
            raise InputError(f"{path}: damaged, or not a study: {failure}") from None
        self._trials = {_name(trial.settings): trial for trial in trials}

    def find(self, settings: Mapping[str, Setting]) -> Trial | None:
        """The trial of these settings, if it was measured."""
        return self._trials.get(_name({axis: setting.label for axis, setting in settings.items()}))

    def refusal(self, settings: Mapping[str, Setting]) -> str | None:
        """Why the scene refused them, if it did."""
        return self.refused.get(words_of(settings))

    def refuse(self, settings: Mapping[str, Setting], reason: str) -> None:
        """Write down that the scene refuses them."""
        self.refused[words_of(settings)] = reason
        self._write()

    def keep(self, trial: Trial) -> None:
        """Write a trial down."""
        self._trials[_name(trial.settings)] = trial
        self._write()

    def finish(self, results: Mapping[str, Any]) -> None:
        """Add what follows from the trials, for reports."""
        self._write(results)

    def _write(self, results: Mapping[str, Any] | None = None) -> None:
        data = {
            "scene": self._identity.scene,
            "seed": self._identity.seed,
            "library": _core.version(),
            "trials": [trial.to_dict() for trial in self._trials.values()],
            "refused": self.refused,
            **(results or {}),
        }
        write_text(self._path, json.dumps(data, indent=1) + "\n")


class Measurements:
    """Trials as far as the time allows; what the notebook holds is not measured again."""

    def __init__(self, bench: Bench, notebook: Notebook, began: float, minutes: float | None) -> None:
        self.bench, self.notebook = bench, notebook
        self.began = began
        self.minutes = minutes
        self.share = 1.0
        """Of the time, that trials may take up to now."""
        self.seconds: list[float] = []
        self.count = 0

    def trial(self, settings: Mapping[str, Setting]) -> Trial | None:
        """The trial of some settings; None where time is up or the scene refuses."""
        trial = self.notebook.find(settings)
        if trial is None and self.notebook.refusal(settings) is None and not self._is_late():
            trial = self._measure(settings)
        self.count += trial is not None
        return trial

    def _is_late(self) -> bool:
        # The first trial, that of the scene as it is, runs in any case.
        expected = max(self.seconds[-5:], default=0.0)
        if self.minutes is None or self.count == 0:
            return False
        return time.monotonic() + expected > self.began + 60.0 * self.share * self.minutes

    def _measure(self, settings: Mapping[str, Setting]) -> Trial | None:
        start = time.monotonic()
        try:
            trial = self.bench.measure(settings)
        except (InputError, _core.InvalidArgument, _core.NumericalError) as failure:
            self.notebook.refuse(settings, str(failure))
            return None
        self.seconds.append(time.monotonic() - start)
        self.notebook.keep(trial)
        return trial


def _name(settings: Mapping[str, str]) -> str:
    return json.dumps(sorted(settings.items()))

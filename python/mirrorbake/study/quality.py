"""The trade of `auto.quality`: what a scene's few views cost in each quality, and how far off they are."""

from __future__ import annotations

import multiprocessing
import resource
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from mirrorbake import _core
from mirrorbake.bake.bake import bake
from mirrorbake.bake.quality import QUALITIES
from mirrorbake.errors import OptionError
from mirrorbake.evaluate.contenders import main_run_time
from mirrorbake.evaluate.evaluate import Onlooker
from mirrorbake.evaluate.metrics import mean_or_none
from mirrorbake.evaluate.places import choose_views
from mirrorbake.pem.opened import open_pem
from mirrorbake.study.middle import in_the_middle, overridden

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from mirrorbake.scene.config import SceneConfig

PLACES = ("on", "between", "off_2", "off_5", "above_10")
"""From which maps are looked at."""
VIEWS = 5
"""Of the scene's arc, in its middle, unless told otherwise."""
CONTENDERS = ("pem", "static_set")


@dataclass(frozen=True)
class QualityFigures:
    """What one quality costs, and how far off it is."""

    quality: str
    preparation_s: float
    """Of processor time, all threads together: scene, plan and static set, before the first view."""
    first_view_s: float
    """Of processor time: the first one traces what those after it find."""
    further_view_s: float | None
    """Of processor time, the mean of those after the first; None if there are none."""
    peak_bytes: int
    """Of memory, of a process that bakes and nothing else."""
    sample_bytes: float
    """On disk, mean over the samples."""
    run_time: str
    """That draws the maps."""
    psnr: dict[str, float | None]
    """dB by place, mean over its views."""
    static_set: float | None
    """dB of the static set, mean over the places; None if there is none."""
    ceiling: dict[str, float]
    """dB of the references by place."""

    def to_dict(self) -> dict[str, Any]:
        """Return plain values."""
        return asdict(self)


class _Stopwatch:
    """Tells a bake's preparation from its samples, in processor time; to be given to it as its progress.

    Whatever has steps before the samples begins them anew.
    """

    def __init__(self) -> None:
        self._start = self._began = time.process_time()
        self._ends: list[float] = []

    def __call__(self, done: int, total: int, text: str) -> None:
        now = time.process_time()
        if done == 0:
            self._began, self._ends = now, []
        else:
            self._ends.append(now)

    @property
    def preparation(self) -> float:
        return self._began - self._start

    @property
    def samples(self) -> list[float]:
        starts = [self._began, *self._ends]
        return [end - start for start, end in zip(starts, self._ends, strict=False)]


def measured(config: SceneConfig, folder: Path, threads: int = 0) -> QualityFigures:
    """Bake a scene into a folder and look at it, in this process.

    Parameters
    ----------
    config
        The scene, of some quality.
    folder
        Takes the PEM, and in `references` beside it what all qualities are compared with.
    threads
        At most; 0: all cores.
    """
    quality = config.auto.quality
    with _core.ThreadLimit(threads):
        watch = _Stopwatch()
        bake(config, folder / quality, watch)
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        pem = open_pem(folder / quality)
        run_time = main_run_time(pem)
        onlooker = Onlooker(pem, folder / "references", only=CONTENDERS, run_times=(run_time,))
        found: dict[str, dict[str, list[float | None]]] = {name: {} for name in CONTENDERS}
        ceilings: dict[str, list[float]] = {}
        for view in choose_views(pem.stage.built.cameras, pem.space):
            seen = onlooker.look(view) if view.place in PLACES else None
            if seen is None:
                continue
            ceilings.setdefault(view.place, []).append(seen.reference.ceiling)
            for name, pictures in seen.pictures.items():
                decibels = seen.reference.psnr(pictures[run_time])
                found[name].setdefault(view.place, []).append(decibels)
    by_place = {
        name: {place: mean_or_none(values) for place, values in places.items()}
        for name, places in found.items()
    }
    first, *further = watch.samples
    count = len(pem.space)
    return QualityFigures(
        quality=quality,
        preparation_s=watch.preparation,
        first_view_s=first,
        further_view_s=sum(further) / len(further) if further else None,
        peak_bytes=peak,
        sample_bytes=sum(pem.store.sample_bytes(index) for index in range(count)) / count,
        run_time=run_time,
        psnr=by_place["pem"],
        static_set=mean_or_none(list(by_place["static_set"].values())),
        ceiling={place: sum(values) / len(values) for place, values in ceilings.items()},
    )


def study(
    config: SceneConfig,
    folder: Path,
    qualities: Sequence[str] = (),
    *,
    views: int = VIEWS,
    threads: int = 0,
    progress: Callable[[int, int, str], None] | None = None,
) -> list[QualityFigures]:
    """Bake few views of a scene in several qualities, each in a process of its own, and look at them.

    What the scene file sets stays as it is set.

    Parameters
    ----------
    config
        The scene.
    folder
        An empty folder.
    qualities
        Names of some; none: all.
    views
        Of an arc, around its middle and as far apart as there; other scenes are baked whole.
    threads
        At most; 0: all cores.
    progress
        Told about every quality.

    Raises
    ------
    OptionError
        A quality does not exist.
    InputError
        The scene is not usable.
    """
    for name in qualities:
        if name not in QUALITIES:
            raise OptionError(f"--qualities {name}: expected some of {', '.join(QUALITIES)}")
    names = [name for name in QUALITIES if name in qualities or not qualities]
    report = progress or (lambda done, total, text: None)
    small = in_the_middle(config, views)
    results = []
    for step, name in enumerate(names):
        report(step, len(names), name)
        # A process has one peak of memory, and a new one nothing that an earlier bake left in it.
        with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as process:
            of_quality = overridden(small, {"auto.quality": name})
            results.append(process.submit(measured, of_quality, folder, threads).result())
    report(len(names), len(names), f"{len(names)} qualities")
    return results

"""Baking samples on many processes and machines, by Dask."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING, Any, NamedTuple

from mirrorbake import _core
from mirrorbake.bake.sample import Probing, SampleBaker
from mirrorbake.errors import OptionError, StoreError
from mirrorbake.pem.store import PemStore
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import prepare_stage

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

CONNECT_SECONDS = 20
"""For which an answer of the scheduler is waited."""
RETRIES = 3
"""Of a sample whose worker died or failed."""

_bakers: dict[str, tuple[PemStore, SampleBaker]] = {}
"""The last scene that this process has prepared, by the PEM's fingerprint and place."""


class Counts(NamedTuple):
    """What a bake left out."""

    clamped: int = 0
    """Values that float16 could not hold."""
    rejected: int = 0
    """Traced samples whose light was NaN or infinite."""
    probing: Probing = Probing()
    """Of views whose rows were probed."""

    def plus(self, other: Counts) -> Counts:
        """Return the sum."""
        return Counts(
            self.clamped + other.clamped,
            self.rejected + other.rejected,
            self.probing.plus(other.probing),
        )


def bake_into(store: PemStore, baker: SampleBaker, index: int) -> Counts:
    """Bake a sample and write it; returns what was left out of it."""
    baked = baker.bake(index)
    store.forget(index)
    if baked.irradiance is not None:
        store.write_irradiance(index, baked.irradiance)
    clamped = store.write_view(index, baked.maps, baked.images, baked.timings, baked.reports)
    return Counts(clamped, baked.rejected, baked.probing)


def bake_one(place: str, fingerprint: str, index: int, threads: int) -> Counts:
    """Bake a sample of an existing PEM in this process; returns what was left out of it.

    The scene is prepared from the PEM's own attributes, once a process.
    """
    key = f"{fingerprint} {place}"
    with _core.ThreadLimit(threads):
        if key not in _bakers:
            _bakers.clear()
            store = PemStore.open(place, writable=True)
            if store.header.fingerprint != fingerprint:
                raise StoreError(f"{place}: is not the PEM that this worker was asked to bake")
            config = parse_config(store.header.source.config, place)
            plan = store.header.plan
            stage = prepare_stage(plan.shaped(config)).planned(plan)
            _bakers[key] = (store, SampleBaker(stage, store.contents()))
        return bake_into(*_bakers[key], index)


@contextlib.contextmanager
def _client(workers: str) -> Iterator[tuple[Any, int]]:
    """Yield a client and the threads that each worker may use (0: all of its machine)."""
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise OptionError(
            f"workers = {workers}: needs Dask, which `pip install mirrorbake[dask]` installs"
        ) from None
    if not workers.isdecimal():
        try:
            client = Client(workers, timeout=CONNECT_SECONDS)
        except (OSError, ValueError) as failure:
            raise OptionError(f"workers = {workers}: no scheduler answers there: {failure}") from None
        with client:
            yield client, 0
        return
    count = int(workers)
    if not 1 <= count <= 1024:
        raise OptionError(f"workers = {workers}: expected 1 to 1024 processes, or a scheduler's address")
    threads = max(_core.thread_count() // count, 1)
    cluster = LocalCluster(
        n_workers=count, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    )
    with cluster, Client(cluster) as client:
        yield client, threads


def bake_on_workers(
    store: PemStore, samples: Sequence[int], workers: str, progress: Callable[[int, int, str], None]
) -> Counts:
    """Bake samples on workers, in any order; returns what was left out.

    A worker that dies loses the sample that it was at, which another bakes again.

    Parameters
    ----------
    store
        The PEM, where all workers reach it under the same path or URL.
    samples
        Numbers of those to bake.
    workers
        A number of processes on this machine, or the address of a Dask scheduler.
    progress
        Told about every sample that is done.

    Raises
    ------
    OptionError
        `workers` is neither, or Dask is not installed.
    StoreError
        A sample failed `RETRIES` times.
    """
    place = str(store.location if store.location.is_remote else store.directory.resolve())
    counts = Counts()
    with _client(workers) as (client, threads):
        from distributed import as_completed

        futures = {
            client.submit(
                bake_one, place, store.header.fingerprint, index, threads, retries=RETRIES, pure=False
            ): index
            for index in samples
        }
        progress(0, len(samples), f"{len(samples)} samples on {workers}")
        for done, future in enumerate(as_completed(futures), start=1):
            failure = future.exception()
            if failure is not None:
                raise StoreError(f"{place}: sample {futures[future]} failed {RETRIES + 1} times: {failure}")
            counts = counts.plus(future.result())
            progress(done, len(samples), f"sample {futures[future] + 1}")
    return counts

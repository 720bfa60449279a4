"""A PEM with its scene, to be looked at from new views."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from mirrorbake.errors import StoreError
from mirrorbake.pem.body_light import BodyLight
from mirrorbake.pem.header import Source
from mirrorbake.pem.run_time import RunTime
from mirrorbake.pem.store import PemStore
from mirrorbake.scene.build import BuiltScene, build_scene
from mirrorbake.scene.inputs import hash_inputs
from mirrorbake.scene.load import parse_config
from mirrorbake.scene.stage import Stage, prepare_stage

if TYPE_CHECKING:
    from pathlib import Path

    from mirrorbake.pem.location import Location
    from mirrorbake.scene.config import SceneConfig
    from mirrorbake.scene.parameters import ParameterSpace


@dataclass(frozen=True)
class OpenedPem:
    """A complete PEM together with the scene it was baked from."""

    store: PemStore
    stage: Stage
    run_time: RunTime

    @property
    def space(self) -> ParameterSpace:
        """The parameter space, at whose nodes the maps are."""
        return self.store.header.space


def open_pem(directory: Location | Path | str, stage: Stage | None = None) -> OpenedPem:
    """Open a complete PEM and build its scene again, to look at it from new views.

    Parameters
    ----------
    directory
        Where the PEM is: a folder, or a URL.
    stage
        Its scene, if it has been prepared already.

    Raises
    ------
    StoreError
        There is no complete PEM, or a file that its scene uses has changed.
    InputError
        A file that its scene uses is gone.
    """
    store = PemStore.open(directory)
    store.require_complete()
    config = unchanged_config(store)
    plan = store.header.plan
    stage = (stage or prepare_stage(plan.shaped(config))).planned(plan)
    store.check_mesh(len(stage.built.positions), len(stage.built.triangles))
    return OpenedPem(store, stage, RunTime(store, BodyLight.of(stage.built, store.header.lightmap)))


def built_scene(store: PemStore) -> BuiltScene:
    """Build the scene of a complete PEM as it was baked, without a ray tracer; raises as `open_pem` does."""
    built = build_scene(store.header.plan.shaped(unchanged_config(store)))
    store.check_mesh(len(built.positions), len(built.triangles))
    return built


def unchanged_config(store: PemStore) -> SceneConfig:
    """Return the scene that a PEM was baked from; raises StoreError and InputError as `open_pem` does."""
    source = store.header.source
    config = parse_config(source.config, str(store.location))
    present = Source(source.library, source.config, hash_inputs(config))
    if present.fingerprint != source.fingerprint:
        raise StoreError(f"{store.location}: its scene has changed ({present.difference_from(source)})")
    return config

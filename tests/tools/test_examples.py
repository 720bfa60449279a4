"""The scene files under examples/ do what their comments say."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from mirrorbake.bake.bake import bake
from mirrorbake.envmap import EnvMap
from mirrorbake.evaluate.evaluate import evaluate
from mirrorbake.pem.store import PemStore
from mirrorbake.pem.verify import verify
from mirrorbake.scene.config import SceneConfig
from mirrorbake.scene.load import load_config, parse_override
from mirrorbake.scene.parameters import space_of
from mirrorbake.scene.stage import prepare_stage

EXAMPLES = Path(__file__).parents[2] / "examples"
DATA = os.environ.get("MIRRORBAKE_TEST_DATA")


def test_the_teapot_example_is_the_papers_set_up() -> None:
    config = load_config(EXAMPLES / "teapot-room.toml")
    assert config.views.count == 100
    assert config.views.degrees / (config.views.count - 1) == 1.0
    assert (config.maps.size, config.views.size, config.trace.samples) == (256, (512, 512), 16)
    defaults = SceneConfig()
    assert (config.layers.diffuse, config.layers.local, config.maps.distant) == (False, True, "box")
    # Lid and body, where the default cuts the surface as the views ask for.
    assert config.reflector == defaults.reflector.model_copy(update={"parts": "split"})
    for section in ("surroundings", "views", "infer"):
        assert getattr(config, section) == getattr(defaults, section)


@pytest.mark.skipif(DATA is None, reason="MIRRORBAKE_TEST_DATA is not set")
@pytest.mark.parametrize(("mesh", "panorama"), [("suzanne", "workshop"), ("spot", "venice")])
def test_the_mesh_example_takes_any_mesh_and_panorama(tmp_path: Path, mesh: str, panorama: str) -> None:
    assert DATA is not None
    assignments = [
        f"reflector.mesh={DATA}/{mesh}.obj",
        f"surroundings.panorama={DATA}/{panorama}.exr",
        "views.count=2",
        "views.degrees=1",
        "views.size=[96,96]",
        "maps.size=64",
        "trace.samples=4",
        "trace.indirect=none",
        "static.views=0",
    ]
    config = load_config(EXAMPLES / "mesh-panorama.toml", [parse_override(text) for text in assignments])
    stage = prepare_stage(config)
    # Both stand upright on the ground at the height that was asked for.
    heights = stage.built.positions[:, 1]
    assert heights.min() == pytest.approx(0.0, abs=1e-6)
    assert heights.max() == pytest.approx(config.reflector.height, rel=1e-5)
    bake(config, tmp_path / "pem", None, stage)
    evaluation = evaluate(tmp_path / "pem", None, stage)
    pem = evaluation.mean("pem", "on", run_time="web")  # that for which the maps were inferred
    static = evaluation.mean("static_infinite", "on", run_time="web")
    assert pem is not None
    assert static is not None
    # At full size the lead is 5 dB (Suzanne) and 8 dB (Spot); few pixels and noise take some of it.
    assert pem - static > 2.0


@pytest.mark.parametrize(
    ("name", "axes"),
    [
        ("dome", {"azimuth": 10, "elevation": 5}),
        ("moving-object", {"motion": 11}),
        ("turning-light", {"light": 11}),
        ("static-set", {}),
    ],
)
def test_the_examples_of_other_spaces_span_them(name: str, axes: dict[str, int]) -> None:
    space = space_of(load_config(EXAMPLES / f"{name}.toml"))
    assert {axis.name: len(axis.values) for axis in space.axes} == axes


SMALL = (
    "reflector.subdivisions=3",
    "reflector.parts=split",
    "views.size=[24,24]",
    "maps.size=8",
    "trace.samples=2",
    "trace.indirect=none",
    "static.views=0",
    "auto.quality=draft",
)


@pytest.mark.parametrize(
    ("name", "fewer", "samples"),
    [
        ("static-set", ["views.count=4"], 1),
        ("teapot-room", ["views.count=3", "views.degrees=10"], 3),
        ("dome", ["views.count=2", "views.rings=2"], 4),
        ("moving-object", ["motion.count=2"], 2),
        ("turning-light", ["light.count=3"], 3),
    ],
)
def test_an_example_of_every_parameter_space_is_baked_whole(
    name: str, fewer: list[str], samples: int, tmp_path: Path
) -> None:
    sky = np.random.default_rng(5).uniform(0.2, 1.0, (16, 32, 3)).astype(np.float32)
    EnvMap.from_array(sky, "latlong").save(tmp_path / "sky.exr")
    panorama = [f"surroundings.panorama={tmp_path}/sky.exr"] if name == "turning-light" else []
    config = load_config(
        EXAMPLES / f"{name}.toml", [parse_override(text) for text in (*SMALL, *fewer, *panorama)]
    )
    bake(config, tmp_path / "pem")
    store = PemStore.open(tmp_path / "pem")
    assert len(store.header.space) == samples
    assert store.completed().all()
    assert verify(tmp_path / "pem").is_sound

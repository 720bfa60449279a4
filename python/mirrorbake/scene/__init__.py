"""From a scene file to a scene in front of a ray tracer."""

from mirrorbake.scene.build import BuiltScene, build_scene
from mirrorbake.scene.config import SceneConfig
from mirrorbake.scene.inputs import hash_inputs
from mirrorbake.scene.load import load_config, parse_config
from mirrorbake.scene.parameters import Axis, ParameterSpace, Point, View
from mirrorbake.scene.plan import Decision, Plan
from mirrorbake.scene.stage import Stage, prepare_stage

__all__ = [
    "Axis",
    "BuiltScene",
    "Decision",
    "ParameterSpace",
    "Plan",
    "Point",
    "SceneConfig",
    "Stage",
    "View",
    "build_scene",
    "hash_inputs",
    "load_config",
    "parse_config",
    "prepare_stage",
]

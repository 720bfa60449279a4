"""The bake: from a scene to its PEM."""

from mirrorbake.bake.analyze import analyze
from mirrorbake.bake.bake import BakeSummary, PlanReport, ProgressReport, bake

__all__ = [
    "BakeSummary",
    "PlanReport",
    "ProgressReport",
    "analyze",
    "bake",
]

"""The page on accuracy: it has every row, every row holds, and every public numeric function has one."""

import re
from pathlib import Path
from types import ModuleType

import pytest

import mirrorbake
from mirrorbake import envmap, fresnel, inference, prefilter, projection, proxy, resample, tone
from mirrorbake.evaluate import metrics
from mirrorbake.study.accuracy import accuracy
from mirrorbake.study.accuracy_row import Accuracy

PAGE = (Path(__file__).parents[2] / "docs" / "reference" / "accuracy.md").read_text(encoding="utf-8")
ROWS = accuracy(cosines=24, rays=3)

MODULES = (mirrorbake, envmap, fresnel, inference, prefilter, projection, proxy, resample, tone, metrics)
"""What the reference of the API lists, but for whole bakes."""

WITHOUT_NUMBERS = {
    "files": {"load_image", "load_mesh", "load_scene", "save_image"},
    "shapes, scenes and layouts, made as they are described": {
        # What is in what order, and sums over samples that fit_display is measured with.
        *("CubePyramidLayout", "TexelTopology", "ViewTargets"),
        *("make_box", "make_cone", "make_cylinder", "make_rectangle", "make_room", "make_sphere"),
        *("make_teapot", "make_torus", "teapot_part_names", "Scene"),
    },
    "settings and names": {
        *("metal_names", "run_time_model", "set_texture_cache_bytes", "thread_count", "version"),
        *("check_display", "proxy_from_attributes", "proxy_to_attributes"),
    },
    "yes or no": {"hull_triangles"},
    "by other names in the table": {
        # Lobes are what the functions of their names compute.
        *("Lobe", "ggx", "lambert", "phong", "prefilter", "alpha_from_exponent"),
        # Maps are resampled by EnvMap.resample; the layers that infer_maps reads are fitted by fit_display.
        *("Resampler", "infer_maps"),
        # Rows of every projection's name: to points and back.
        *("directions_from_points", "points_from_directions"),
        # displayed encodes what tone_map gave; the decibels of psnr are those of a mean squared error.
        *("displayed", "decibels", "mean_squared_error"),
    },
    "other people's libraries": {"flip", "ssim"},
    "statistics of errors, tested in test_metrics.py": {"mean_or_none", "motion", "sliding", "worst_error"},
}
"""Public functions that have no row of their own, and why."""


def public_functions(module: ModuleType) -> set[str]:
    """Names of a module's functions; and of classes that compute."""
    names = getattr(module, "__all__", None) or [
        name
        for name, value in vars(module).items()
        if not name.startswith("_") and getattr(value, "__module__", "") == module.__name__
    ]
    return {name for name in names if callable(getattr(module, name)) and not _is_data(getattr(module, name))}


def _is_data(value: object) -> bool:
    """Whether a class only holds values, is an exception or an enumeration."""
    if not isinstance(value, type):
        return False
    computes = {name for name in vars(value) if not name.startswith("_") and callable(getattr(value, name))}
    return issubclass(value, Exception) or not computes


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row.function} {row.domain}")
def test_the_error_is_within_what_the_page_allows(row: Accuracy) -> None:
    assert row.error <= row.bound
    assert f"| {row.function} | {row.domain} | {row.against} |" in PAGE
    line = next(line for line in PAGE.splitlines() if line.startswith(f"| {row.function} | {row.domain} |"))
    assert line.endswith(f"| {row.bound:.2g} |")


def test_every_public_numeric_function_has_a_row() -> None:
    measured = set(re.findall(r"\w+", " ".join(row.function for row in ROWS)))
    excused = {name for names in WITHOUT_NUMBERS.values() for name in names}
    public = {name for module in MODULES for name in public_functions(module)}
    assert sorted(public - measured - excused) == []
    # What is excused exists: nothing stays on the list after it is gone.
    assert sorted(excused - {name for module in MODULES for name in dir(module)}) == []

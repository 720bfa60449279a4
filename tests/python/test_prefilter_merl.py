"""Measured materials: files of MERL, which the test writes from a formula."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from mirrorbake.envmap import EnvMap
from mirrorbake.errors import InputError
from mirrorbake.prefilter.brdf_lobes import lobe_of_view
from mirrorbake.prefilter.merl import MeasuredBrdf
from mirrorbake.prefilter.reflection_space import radiance_map

STEPS = (90, 90, 180)
SCALE = np.array([1, 1.15, 1.66]) / 1500


def formula(half: np.ndarray, difference: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    """A broad lobe about the normal that grows towards grazing light and leans by azimuth."""
    value: np.ndarray = 0.1 + np.cos(half) ** 8 * (1 + difference**2) * (1 + 0.1 * np.cos(azimuth) ** 2)
    return value


def write(path: Path, change: Callable[[np.ndarray], None] = lambda values: None) -> Path:
    i, j, k = (np.arange(n) + 0.5 for n in STEPS)
    half, difference = (i / 90) ** 2 * np.pi / 2, j / 90 * np.pi / 2
    values = formula(*np.meshgrid(half, difference, k / 180 * np.pi, indexing="ij"))
    stored = np.stack([values * factor / scale for factor, scale in zip((1, 0.5, 2), SCALE, strict=True)])
    change(stored)
    path.write_bytes(np.array(STEPS, "<i4").tobytes() + stored.astype("<f8").tobytes())
    return path


@pytest.fixture(scope="module")
def material(tmp_path_factory: pytest.TempPathFactory) -> MeasuredBrdf:
    return MeasuredBrdf.load(write(tmp_path_factory.mktemp("merl") / "formula.binary"))


def cosines(count: int) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(3)
    v, l = (rng.normal(size=(count, 3)) for _ in range(2))  # noqa: E741
    v, l = (np.abs(d) / np.linalg.norm(d, axis=1)[:, None] * [1, 1, 1] for d in (v, l))  # noqa: E741
    l[:, 0] *= np.where(rng.random(count) < 0.5, -1, 1)
    return v[:, 2], l[:, 2], (v * l).sum(1), v, l


def test_values_are_those_of_the_half_way_and_difference_angles(material: MeasuredBrdf) -> None:
    n_v, n_l, v_l, v, l = cosines(500)  # noqa: E741
    # Rusinkiewicz' angles by turning the light into the frame of h, as the files' own reader does.
    h = (v + l) / np.linalg.norm(v + l, axis=1)[:, None]
    half, turn = np.arccos(h[:, 2]), np.arctan2(h[:, 1], h[:, 0])
    x = l[:, 0] * np.cos(turn) + l[:, 1] * np.sin(turn)
    y = -l[:, 0] * np.sin(turn) + l[:, 1] * np.cos(turn)
    x, z = x * np.cos(half) - l[:, 2] * np.sin(half), x * np.sin(half) + l[:, 2] * np.cos(half)
    expected = formula(half, np.arccos(np.clip(z, -1, 1)), np.arctan2(y, x))
    found = material(n_v, n_l, v_l)
    # Straight lines between steps of a degree.
    np.testing.assert_allclose(found, expected[:, None] * [1, 0.5, 2], rtol=0.01)
    np.testing.assert_allclose(material.grey(n_v, n_l, v_l), expected * 3.5 / 3, rtol=0.01)
    np.testing.assert_allclose(material(n_l, n_v, v_l), found, rtol=0.01)  # Helmholtz


def test_measured_materials_make_maps_and_lobes(material: MeasuredBrdf) -> None:
    white = EnvMap.from_array(np.ones((16, 32, 3), np.float32), "latlong")
    shown = radiance_map(white, material, [0, 0, 1], 16).level()
    lobe = lobe_of_view(material.grey, 1.0)
    # The middle of the ball looks along the normal; the sky has few texels.
    assert shown[8, 8].mean() == pytest.approx(lobe.reflectance, rel=0.05)
    np.testing.assert_allclose(shown[8, 8] / shown[8, 8, 0], [1, 0.5, 2], rtol=1e-3)


def test_what_was_not_measured_is_black(tmp_path: Path) -> None:
    def nothing(stored: np.ndarray) -> None:
        stored[...] = -1

    dark = MeasuredBrdf.load(write(tmp_path / "dark.binary", nothing))
    assert not dark.values.any()


def test_damaged_files_are_named(tmp_path: Path) -> None:
    good = write(tmp_path / "good.binary").read_bytes()

    def broken(stored: np.ndarray) -> None:
        stored[1, 2, 3, 4:7] = [np.nan, np.inf, 1]

    with pytest.raises(InputError, match=r"nan\.binary has 2 values that are NaN"):
        MeasuredBrdf.load(write(tmp_path / "nan.binary", broken))
    for name, content, expected in (
        ("short.binary", good[:-1], "34992011 bytes, expected 34992012"),
        ("empty.binary", b"", "0 bytes"),
        ("steps.binary", np.array([90, 180, 90], "<i4").tobytes() + good[12:], r"\(90, 180, 90\) steps"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(InputError, match=expected):
            MeasuredBrdf.load(tmp_path / name)
    with pytest.raises(InputError, match=r"none\.binary cannot be read"):
        MeasuredBrdf.load(tmp_path / "none.binary")

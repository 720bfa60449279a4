"""DDS files of BC6H blocks, from the encoder through the file to the decoder."""

import sys
from pathlib import Path

import numpy as np
import pytest

from mirrorbake import InvalidArgument
from mirrorbake.bc6h import save_bc6h
from mirrorbake.envmap import EnvMap
from mirrorbake.projection import texel_directions

pytest.importorskip("ispc_texcomp", reason="the extra bc6h is not installed")


def sky(size: int) -> EnvMap:
    d = np.stack([texel_directions("cube", size, size, face) for face in range(6)])
    image = 100 * (0.5 + 0.4 * np.sin(3 * d + 1))
    return EnvMap.from_array(image.astype(np.float32), "cube")


def test_every_level_comes_back_within_what_blocks_can_hold(tmp_path: Path) -> None:
    cube = sky(30).mips()  # 30 and 15 are no multiples of 4
    assert save_bc6h(cube, tmp_path / "cube.DDS") == 0
    again = EnvMap.load(tmp_path / "cube.DDS")
    assert again.layout == cube.layout
    # The colours of a block lie on a line or two: an octant of the sky, in the coarsest levels, does not.
    for level, bound in enumerate((0.03, 0.07, 0.11, 0.18, 1e-3)):
        error = np.linalg.norm(again.level(level) - cube.level(level)) / np.linalg.norm(cube.level(level))
        assert error < bound, level


def test_what_bc6h_cannot_hold_is_clamped_and_counted(tmp_path: Path) -> None:
    values = np.ones((6, 4, 4, 3), np.float32)
    values[0, 0, 0] = [-1, 1e6, 1]
    assert save_bc6h(EnvMap.from_array(values, "cube"), tmp_path / "cube.dds") == 2
    again = EnvMap.load(tmp_path / "cube.dds").level()
    np.testing.assert_allclose(again[1:], 1, rtol=1e-3)
    assert again.min() >= 0


@pytest.mark.parametrize(
    ("envmap", "name", "expected"),
    [
        (sky(4), "cube.ktx2", "dds"),
        (sky(4).resample("latlong", 4), "cube.dds", "cube of 3"),
        (EnvMap.from_array(np.ones((6, 4, 4, 4), np.float32), "cube"), "cube.dds", "4 channels"),
        (EnvMap.from_array(np.full((6, 4, 4, 3), np.nan, np.float32), "cube"), "cube.dds", "288 NaN"),
    ],
)
def test_what_bc6h_is_not_for_is_refused(tmp_path: Path, envmap: EnvMap, name: str, expected: str) -> None:
    with pytest.raises(InvalidArgument, match=expected):
        save_bc6h(envmap, tmp_path / name)
    assert not (tmp_path / name).exists()


def test_without_the_encoder_the_error_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "ispc_texcomp", None)
    with pytest.raises(InvalidArgument, match=r"mirrorbake\[bc6h\]"):
        save_bc6h(sky(4), tmp_path / "cube.dds")

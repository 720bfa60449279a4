"""Image files through the binding; what the formats hold is tested in C++."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mirrorbake import _core


def test_pixels_and_channel_names_survive_a_file(tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).normal(size=(5, 7, 3)).astype(np.float32)
    path = str(tmp_path / "a.exr")
    report = _core.save_image(path, pixels, ["R", "G", "B"], "float32")
    assert (report.clamped_to_half, report.clipped) == (0, 0)
    again, names = _core.load_image(path)
    assert names == ["R", "G", "B"]
    assert again.dtype == np.float32
    np.testing.assert_array_equal(again, pixels)


def test_channels_are_named_by_their_count(tmp_path: Path) -> None:
    for count, names in {1: ["Y"], 2: ["Y", "A"], 3: ["R", "G", "B"], 4: ["R", "G", "B", "A"]}.items():
        path = str(tmp_path / f"{count}.exr")
        _core.save_image(path, np.ones((2, 2, count), np.float32))
        assert _core.load_image(path)[1] == names
    with pytest.raises(ValueError, match="channels is 5"):
        _core.save_image(str(tmp_path / "5.exr"), np.ones((2, 2, 5), np.float32))


def test_half_overflow_is_reported(tmp_path: Path) -> None:
    report = _core.save_image(str(tmp_path / "a.exr"), np.full((2, 3, 1), 1e6, np.float32))
    assert report.clamped_to_half == 6
    assert repr(report) == "SaveReport(clamped_to_half=6, clipped=0)"


def test_bad_files_and_arguments_raise_the_promised_errors(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="does not exist"):
        _core.load_image(str(tmp_path / "missing.exr"))
    with pytest.raises(ValueError, match="format is int3"):
        _core.save_image(str(tmp_path / "a.exr"), np.ones((2, 2, 3), np.float32), None, "int3")  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="at least one pixel"):
        _core.save_image(str(tmp_path / "a.exr"), np.ones((0, 2, 3), np.float32))


def test_an_error_of_the_library_that_is_loaded_for_png_is_an_os_error(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    _core.save_image(str(path), np.ones((40, 30, 3), np.float32))
    path.write_bytes(path.read_bytes()[:60])
    with pytest.raises(_core.FileError, match=r"a\.png: is truncated"):
        _core.load_image(str(path))
    # This one is found behind the boundary of the libraries.
    path = tmp_path / "a.tif"
    _core.save_image(str(path), np.ones((40, 30, 3), np.float32), None, "float32")
    content = path.read_bytes()
    path.write_bytes(content[:8] + bytes(len(content) // 4) + content[8 + len(content) // 4 :])
    with pytest.raises(_core.FileError, match=r"^\S*a\.tif: is damaged or truncated"):
        _core.load_image(str(path))


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc/self/maps")
def test_importing_and_reading_exr_do_not_load_openimageio(tmp_path: Path) -> None:
    code = f"""
from pathlib import Path
import mirrorbake
from mirrorbake import _core
import numpy as np
def is_loaded():
    return "libOpenImageIO" in Path("/proc/self/maps").read_text()
_core.save_image({str(tmp_path / "a.exr")!r}, np.ones((2, 2, 3), np.float32))
_core.load_image({str(tmp_path / "a.exr")!r})
before = is_loaded()
_core.save_image({str(tmp_path / "a.png")!r}, np.ones((2, 2, 3), np.float32))
print(before, is_loaded())
"""
    output = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
    assert output.split() == ["False", "True"]

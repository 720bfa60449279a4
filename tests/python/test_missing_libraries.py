"""What is said where a library that mirrorbake needs is not installed."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from mirrorbake import _core

PACKAGE = Path(_core.__file__).parent

SAVE = "import mirrorbake, numpy; mirrorbake.save_image('a.png', numpy.ones((2, 2, 3), numpy.float32))"


def needed(file: Path, name: str) -> str:
    """Return the name under which a library of ours loads another."""
    found = subprocess.run(["ldd", file], capture_output=True, text=True, check=True).stdout
    match = re.search(rf"^\s*({name}\S*\.so\S*) =>", found, re.MULTILINE)
    assert match is not None, found
    return match[1]


@pytest.mark.skipif(sys.platform != "linux", reason="names of libraries are those of Linux")
@pytest.mark.parametrize(
    ("file", "library", "package"),
    [
        (Path(_core.__file__), "libembree", "libembree-dev"),
        (PACKAGE / "libmirrorbake_openimageio.so", "libOpenImageIO", "libopenimageio-dev"),
    ],
)
def test_a_missing_library_is_an_import_error_that_says_what_to_install(
    tmp_path: Path, file: Path, library: str, package: str
) -> None:
    name = needed(file, library)
    # An empty file, found first, cannot be loaded either.
    (tmp_path / name).touch()
    environment = os.environ | {"LD_LIBRARY_PATH": str(tmp_path)}
    done = subprocess.run(
        [sys.executable, "-c", SAVE],
        capture_output=True,
        text=True,
        env=environment,
        cwd=tmp_path,
        check=False,
    )
    last = done.stderr.strip().splitlines()[-1]
    assert "ImportError: " in last or "MissingLibrary: " in last, done.stderr
    assert name in last
    assert f"apt-get install {package}" in last
    assert done.returncode == 1
    assert not (tmp_path / "a.png").exists()


def test_the_missing_librarys_error_is_an_import_error() -> None:
    assert issubclass(_core.MissingLibrary, ImportError)

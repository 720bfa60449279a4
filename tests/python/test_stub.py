"""The committed type stub of the extension module says what the module offers."""

import subprocess
import sys
from pathlib import Path

import mirrorbake

UPDATE = ".venv/bin/python -m nanobind.stubgen -q -m mirrorbake._core -o python/mirrorbake/_core.pyi"


def test_committed_stub_matches_the_extension_module(tmp_path: Path) -> None:
    generated = tmp_path / "_core.pyi"
    subprocess.run(
        [sys.executable, "-m", "nanobind.stubgen", "-q", "-m", "mirrorbake._core", "-o", str(generated)],
        check=True,
    )
    committed = Path(mirrorbake.__file__).with_name("_core.pyi")
    assert committed.read_text(encoding="utf-8") == generated.read_text(encoding="utf-8"), f"run {UPDATE}"


def test_package_is_marked_as_typed() -> None:
    assert Path(mirrorbake.__file__).with_name("py.typed").is_file()

"""The committed type stub of the extension module says what the module offers."""

import re
import subprocess
import sys
from pathlib import Path
from typing import get_args

import mirrorbake
from mirrorbake import literals

UPDATE = ".venv/bin/python -m nanobind.stubgen -q -m mirrorbake._core -o python/mirrorbake/_core.pyi"


def test_committed_stub_matches_the_extension_module(tmp_path: Path) -> None:
    generated = tmp_path / "_core.pyi"
    subprocess.run(
        [sys.executable, "-m", "nanobind.stubgen", "-q", "-m", "mirrorbake._core", "-o", str(generated)],
        check=True,
    )
    committed = Path(mirrorbake.__file__).with_name("_core.pyi")
    assert committed.read_text(encoding="utf-8") == generated.read_text(encoding="utf-8"), f"run {UPDATE}"


def test_literals_have_the_names_of_the_compiled_part() -> None:
    """A value that C++ has, and `mirrorbake.literals` not, would be refused by type checkers alone."""
    stub = Path(mirrorbake.__file__).with_name("_core.pyi").read_text(encoding="utf-8")
    known = {tuple(re.findall(r"'(\w+)'", names)) for names in re.findall(r"Literal\[([^\]]*)\]", stub)}
    for alias in literals.__all__:
        assert get_args(getattr(literals, alias)) in known, alias


def test_package_is_marked_as_typed() -> None:
    assert Path(mirrorbake.__file__).with_name("py.typed").is_file()

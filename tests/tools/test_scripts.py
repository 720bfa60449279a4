"""The scripts say what is wrong and what to do about it."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def run(script: Path, *arguments: str, path: Path | None = None) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PATH": str(path)} if path else None
    bash = shutil.which("bash")
    assert bash
    return subprocess.run(
        [bash, str(script), *arguments], env=environment, capture_output=True, text=True, check=False
    )


@pytest.fixture
def bare_checkout(tmp_path: Path) -> Path:
    """A copy of the scripts, beside a folder `bin` with nothing but what they start with."""
    shutil.copytree(ROOT / "script", tmp_path / "script")
    (tmp_path / "bin").mkdir()
    for name in ("bash", "dirname", "mkdir", "flock", "grep"):
        program = shutil.which(name)
        assert program
        (tmp_path / "bin" / name).symlink_to(program)
    return tmp_path


def test_bootstrap_without_apt_names_what_to_install(bare_checkout: Path) -> None:
    result = run(bare_checkout / "script" / "bootstrap", path=bare_checkout / "bin")
    assert result.returncode == 1
    assert result.stdout == ""
    for package in ("libembree-dev", "libopenimageio-dev", "python3-venv"):
        assert package in result.stderr
    assert "MIRRORBAKE_SYSTEM_PACKAGES=present" in result.stderr


def test_bootstrap_without_a_new_enough_python_says_which_it_needs(bare_checkout: Path) -> None:
    old = bare_checkout / "bin" / "python3"
    old.write_text('#!/bin/sh\n[ "$1" = --version ] && echo Python 3.9.2 && exit 0\nexit 1\n')
    old.chmod(0o755)
    for name in ("sha256sum", "head"):
        program = shutil.which(name)
        assert program
        (bare_checkout / "bin" / name).symlink_to(program)
    shutil.copy(ROOT / "pyproject.toml", bare_checkout)
    result = subprocess.run(
        ["bash", str(bare_checkout / "script" / "bootstrap")],
        env={"PATH": str(bare_checkout / "bin"), "MIRRORBAKE_SYSTEM_PACKAGES": "present"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 1
    assert "Python 3.11 or newer" in result.stderr
    assert "found Python 3.9.2" in result.stderr


def test_bench_lists_the_benchmarks_when_it_does_not_know_the_name() -> None:
    known = run(ROOT / "script" / "bench").stdout.split()
    assert "inference" in known
    assert not [name for name in known if name.startswith("_")]
    result = run(ROOT / "script" / "bench", "no-such-benchmark")
    assert result.returncode == 2
    assert result.stdout == ""
    assert all(name in result.stderr for name in known)


@pytest.mark.parametrize("arguments", [["a", "b"], ["--help"]])
def test_test_script_explains_its_usage(arguments: list[str]) -> None:
    result = run(ROOT / "script" / "test", *arguments)
    assert result.returncode == 2
    assert "script/test PATTERN" in result.stderr

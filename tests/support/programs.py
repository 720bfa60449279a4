"""The mb-* programs as the tests run them."""

import os
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def is_sanitized(tree: Path) -> bool:
    """Whether a build tree is one of sanitizers, which need the environment of their test preset."""
    cache = tree / "CMakeCache.txt"
    lines = cache.read_text().splitlines() if cache.is_file() else []
    return any(line.startswith("MIRRORBAKE_SANITIZERS:") and not line.endswith("=") for line in lines)


def find_program(name: str) -> Path | None:
    """Return the newest build of a program: that of MIRRORBAKE_TOOLS, or of any tree without sanitizers."""
    named = os.environ.get("MIRRORBAKE_TOOLS")
    trees = [tree for tree in (ROOT / "build").glob("*") if not is_sanitized(tree)]
    folders = [*([Path(named)] if named else []), *(tree / "cpp" / "tools" for tree in trees)]
    found = [folder / name for folder in folders if (folder / name).is_file()]
    return max(found, key=lambda path: path.stat().st_mtime, default=None)


def needs_program(name: str) -> pytest.MarkDecorator:
    """Skip a module's tests where the program is not built."""
    return pytest.mark.skipif(
        find_program(name) is None, reason=f"{name} is not built: cmake --build --preset dev --target {name}"
    )


def run_program(name: str, *arguments: object, status: int = 0) -> str:
    """Run a program that ends with `status`; return what it prints, or its error message."""
    program = find_program(name)
    assert program is not None
    done = subprocess.run(
        [program, *map(str, arguments)], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == status, done.stderr
    if status != 0:
        assert done.stdout == ""
        assert done.stderr.strip()
        return done.stderr
    return done.stdout

"""Programs that the benchmarks run, built as they are shipped."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def built_program(target: str, folder: str) -> Path:
    """Build `target` with the preset `release`, and return its path below `cpp/` of that build."""
    root = Path(__file__).parents[1]
    print(f"==> building {target} (some minutes the first time)", file=sys.stderr)
    for command in (["--preset", "release"], ["--build", "--preset", "release", "--target", target]):
        subprocess.run(["cmake", *command], cwd=root, stdout=subprocess.DEVNULL, check=True)
    return root / "build/release/cpp" / folder / target

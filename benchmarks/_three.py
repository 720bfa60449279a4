"""three.js' prefiltering, in a headless Chromium that Node.js drives (benchmarks/three)."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

FOLDER = Path(__file__).parent / "three"
CHROMIUM = Path(os.environ.get("CHROMIUM", "/usr/bin/chromium"))
LONGEST = 300  # seconds


@dataclass(frozen=True)
class Pmrem:
    """Size and number of levels of three.js' chain, its time, and roughness and values (n, 3) of levels."""

    size: int
    levels: int
    milliseconds: float
    found: list[tuple[float, NDArray[np.float64]]]


def pmrem(panorama: NDArray[np.float32], directions: NDArray[np.float64], levels: list[int]) -> Pmrem | None:
    """What `PMREMGenerator.fromEquirectangular` makes of a panorama (h, w, 3), read in directions (n, 3)."""
    if shutil.which("npm") is None or not CHROMIUM.exists():
        print("benchmark: without Node.js or Chromium (CHROMIUM=…) three.js is left out", file=sys.stderr)
        return None
    if not (FOLDER / "node_modules").is_dir():
        subprocess.run(["npm", "ci", "--silent", "--no-audit", "--no-fund"], cwd=FOLDER, check=True)
    height, width = panorama.shape[:2]
    # Rows from the bottom; three.js' panoramas have +X in their middle, and there -Z is to the left.
    rows = np.concatenate([panorama[::-1], np.ones((height, width, 1), np.float32)], axis=-1)
    points = np.zeros((len(directions), 4), np.float32)
    points[:, :3] = np.stack([-directions[:, 2], directions[:, 1], directions[:, 0]], axis=-1)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows.astype("<f4").tofile(folder / "panorama.f32")
        points.astype("<f4").tofile(folder / "directions.f32")
        request = {"width": width, "height": height, "count": len(directions), "levels": levels}
        (folder / "request.json").write_text(json.dumps(request), encoding="utf-8")
        answer = subprocess.run(
            ["node", FOLDER / "pmrem.mjs", folder], stdout=subprocess.PIPE, check=True, timeout=LONGEST
        )
    made = json.loads(answer.stdout)
    found = [
        (one["roughness"], np.array(one["values"], np.float64).reshape(-1, 4)[:, :3]) for one in made["found"]
    ]
    return Pmrem(made["size"], made["levels"], made["milliseconds"], found)

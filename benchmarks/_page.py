"""What a benchmark and a test take from the page: its shader's reads, and its layout of maps."""

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mirrorbake.envmap import EnvMap

SOURCES = Path(__file__).parents[1] / "viewer" / "src"


def reads_of_the_page() -> str:
    """The functions of the page's shader that read cube maps."""
    texts = (("gl/shaders.ts", "MAPS"), ("projection.ts", "CUBE"), ("gl/shaders.ts", "TAPS"))
    return "".join(_text(SOURCES / file, name) for file, name in texts)


def _text(path: Path, name: str) -> str:
    found = re.search(
        rf"^const {name} = `(.*?)`;", path.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE
    )
    if found is None:
        raise ValueError(f"{path}: has no {name}")
    return found.group(1)


def layers_of(levels: Sequence[EnvMap]) -> NDArray[np.float32]:
    """All levels of a cube map as the page keeps them (viewer/src/atlas.ts), with borders."""
    count, size = len(levels), levels[0].level().shape[2]
    height, width = max(size + 2, size - 1 + 2 * (count - 1)), size + 2 + size // 2 + 2
    layers = np.zeros((6, height, width, 3), np.float32)
    for level, envmap in enumerate(levels):
        n = size >> level
        x, y = (0, 0) if level == 0 else (size + 2, size - 2 * n + 2 * (level - 1))
        place = (np.arange(-1, n + 1) + 0.5) / n * 2.0 - 1.0
        s, t = np.meshgrid(place, place)
        for face in range(6):
            block = envmap.sample(beyond(face, s, t), filter="nearest")
            for row, column in ((0, 0), (0, -1), (-1, 0), (-1, -1)):
                r, c = (1 if row == 0 else -2), (1 if column == 0 else -2)
                block[row, column] = (block[r, c] + block[row, c] + block[r, column]) / 3.0
            layers[face, y : y + n + 2, x : x + n + 2] = block
    return layers


def beyond(face: int, s: NDArray[np.float64], t: NDArray[np.float64]) -> NDArray[np.float32]:
    """Directions of places of a face and around it, in OpenGL's orientation; t counts downwards."""
    one = np.ones_like(s)
    axes = [(one, -t, -s), (-one, -t, s), (s, one, t), (s, -one, -t), (s, -t, one), (-s, -t, -one)]
    return np.stack(axes[face], axis=-1).astype(np.float32)

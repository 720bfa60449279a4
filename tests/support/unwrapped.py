"""A mesh whose texture coordinates are its own everywhere, a post on a plate, and a sun for its shadow."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mirrorbake import _core

if TYPE_CHECKING:
    from pathlib import Path

PLATE = ((-1.0, 0.0, -1.0), (1.0, 0.1, 1.0))
POST = ((-0.1, 0.1, -0.1), (0.1, 1.0, 0.1))
FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
NORMALS = ("0 0 -1", "0 0 1", "0 -1 0", "1 0 0", "0 1 0", "-1 0 0")
PLATE_TOP = 4
MARGIN = 1.0 / 64.0
"""Of each face in its cell of the texture."""


def write_post_on_plate(path: Path) -> None:
    """Write an OBJ file. The plate's top has a quarter of the texture, every other face a sixteenth."""
    small = [(i / 4, j / 4, 0.25) for j in range(4) for i in range(4) if i > 1 or j > 1]
    lines = [f"vn {normal}" for normal in NORMALS]
    faces = []
    for box, ((x0, y0, z0), (x1, y1, z1)) in enumerate((PLATE, POST)):
        for z in (z0, z1):
            lines += [f"v {x} {y} {z}" for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
        for face, corners in enumerate(FACES):
            left, low, side = (0.0, 0.0, 0.5) if (box, face) == (0, PLATE_TOP) else small.pop()
            first = 24 * box + 4 * face + 1
            for right, up in ((0, 0), (1, 0), (1, 1), (0, 1)):
                u, v = (MARGIN + (side - 2.0 * MARGIN) * step for step in (right, up))
                lines.append(f"vt {left + u} {low + v}")
            faces.append(
                "f " + " ".join(f"{8 * box + c + 1}/{first + k}/{face + 1}" for k, c in enumerate(corners))
            )
    path.write_text("\n".join([*lines, *faces]) + "\n")


def write_sun(path: Path) -> None:
    """Write a panorama of a grey sky with a small bright spot."""
    sky = np.full((32, 64, 3), 0.3, np.float32)
    sky[8:10, 20:22] = 120.0
    _core.save_image(str(path), sky, ["R", "G", "B"], format="float32")

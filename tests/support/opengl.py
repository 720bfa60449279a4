"""Renderers on OpenGL, through EGL: a graphics card, or Mesa in software."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

if TYPE_CHECKING:
    from numpy.typing import NDArray

VERTEX = """#version 330
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
"""


def context() -> Any:
    """A context of OpenGL 3.3, or the test is skipped."""
    moderngl = pytest.importorskip("moderngl")
    try:
        return moderngl.create_standalone_context(backend="egl")
    except Exception as failure:  # moderngl raises whatever its backend does
        pytest.skip(f"no graphics card and no Mesa to be had through EGL ({failure})")


class Screen:
    """A shader that is run for every pixel of a float image, with float textures read by `texelFetch`."""

    def __init__(self, context: Any, fragment: str, inputs: dict[str, NDArray[np.float32]]) -> None:
        self._context = context
        self._program = context.program(vertex_shader=VERTEX, fragment_shader=fragment)
        self._triangle = context.vertex_array(self._program, [])
        self._textures: dict[str, Any] = {}
        moderngl = importlib.import_module("moderngl")
        for name, pixels in inputs.items():
            self._height, self._width = pixels.shape[:2]
            texture = context.texture((self._width, self._height), 3, pixels.tobytes(), dtype="f4")
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self._textures[name] = texture
        self._target = context.framebuffer([context.texture((self._width, self._height), 4, dtype="f4")])

    def draw(self, textures: dict[str, Any], values: dict[str, Any]) -> NDArray[np.float32]:
        """The image, (height, width, 3), rows in the order of the inputs' rows."""
        self._target.use()
        for unit, (name, texture) in enumerate({**self._textures, **textures}.items()):
            texture.use(unit)
            self._program[name] = unit
        for name, value in values.items():
            self._program[name] = value
        self._triangle.render(self._context.TRIANGLES, vertices=3)
        pixels = np.frombuffer(self._target.read(components=3, dtype="f4"), np.float32)
        return pixels.reshape(self._height, self._width, 3)

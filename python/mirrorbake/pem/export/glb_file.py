"""Binary glTF files, by the text of the specification (Khronos, glTF 2.0)."""

from __future__ import annotations

import io
import json
import struct
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from mirrorbake.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

_COMPONENTS = {"float32": 5126, "uint32": 5125}
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 34962, 34963
_WRAPS = {"repeat": 10497, "clamp": 33071, "mirror": 33648}
_LARGEST = 2**32 - 1


@dataclass
class GlbFile:
    """A binary glTF file in the making."""

    document: dict[str, Any] = field(default_factory=lambda: {"asset": {"version": "2.0"}})
    """Its JSON, but for the arrays that the methods fill."""
    _views: list[dict[str, int]] = field(default_factory=list)
    _accessors: list[dict[str, Any]] = field(default_factory=list)
    _images: list[dict[str, Any]] = field(default_factory=list)
    _samplers: list[dict[str, int]] = field(default_factory=list)
    _textures: list[dict[str, int]] = field(default_factory=list)
    _buffer: bytearray = field(default_factory=bytearray)

    def add_vertices(self, values: NDArray[np.float32], *, bounds: bool = False) -> int:
        """Add an attribute (V, C) or (V,), float32; returns its accessor. Positions need their bounds."""
        return self._accessor(values, _ARRAY_BUFFER, bounds)

    def add_values(self, values: NDArray[np.float32]) -> int:
        """Add values (N, C), float32, that belong to no vertex; returns their accessor."""
        return self._accessor(values, None, bounds=False)

    def add_indices(self, values: NDArray[np.uint32]) -> int:
        """Add indices (N,), uint32; returns their accessor."""
        return self._accessor(values, _ELEMENT_ARRAY_BUFFER, bounds=False)

    def add_png(self, name: str, pixels: NDArray[np.uint8]) -> int:
        """Add an image (H, W, 3), or a grey one (H, W); returns its number."""
        encoded = io.BytesIO()
        Image.fromarray(pixels).save(encoded, "PNG")
        view = self._view(encoded.getvalue(), None)
        self._images.append({"name": name, "mimeType": "image/png", "bufferView": view})
        return len(self._images) - 1

    def add_texture(self, name: str, pixels: NDArray[np.uint8], wrap: tuple[str, str]) -> int:
        """Add an image (H, W, 3) as a texture, wrapped along u and v as named; returns its number."""
        sampler = {"wrapS": _WRAPS[wrap[0]], "wrapT": _WRAPS[wrap[1]]}
        if sampler not in self._samplers:
            self._samplers.append(sampler)
        source = self.add_png(name, pixels)
        self._textures.append({"source": source, "sampler": self._samplers.index(sampler)})
        return len(self._textures) - 1

    def to_bytes(self) -> bytes:
        """The file.

        Raises
        ------
        InputError
            It would be larger than the 4 GiB that the format counts.
        """
        document = {
            **self.document,
            "accessors": self._accessors,
            "bufferViews": self._views,
            "images": self._images,
            "samplers": self._samplers,
            "textures": self._textures,
            "buffers": [{"byteLength": len(self._buffer)}],
        }
        text = json.dumps({key: value for key, value in document.items() if value != []}).encode()
        text += b" " * (-len(text) % 4)
        binary = bytes(self._buffer) + b"\0" * (-len(self._buffer) % 4)
        total = 12 + 8 + len(text) + 8 + len(binary)
        if total > _LARGEST:
            raise InputError(
                f"the GLB would hold {total} bytes, expected at most {_LARGEST}: export fewer samples"
            )
        return b"".join(
            (
                b"glTF" + struct.pack("<II", 2, total),
                struct.pack("<I", len(text)) + b"JSON" + text,
                struct.pack("<I", len(binary)) + b"BIN\0" + binary,
            )
        )

    def _accessor(self, values: NDArray[Any], target: int | None, bounds: bool) -> int:
        columns = values.reshape(len(values), -1)
        accessor: dict[str, Any] = {
            "bufferView": self._view(np.ascontiguousarray(values).tobytes(), target),
            "componentType": _COMPONENTS[values.dtype.name],
            "count": len(values),
            "type": _KINDS[columns.shape[1]],
        }
        if bounds:
            accessor["min"] = columns.min(axis=0).astype(float).tolist()
            accessor["max"] = columns.max(axis=0).astype(float).tolist()
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def _view(self, data: bytes, target: int | None) -> int:
        self._buffer += b"\0" * (-len(self._buffer) % 4)
        view = {"buffer": 0, "byteOffset": len(self._buffer), "byteLength": len(data)}
        self._views.append(view if target is None else {**view, "target": target})
        self._buffer += data
        return len(self._views) - 1

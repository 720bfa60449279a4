"""Writes small glTF scenes, by the text of the specification and not with the library."""

from __future__ import annotations

import json
import struct
import zlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray


def png(texels: NDArray[np.uint8]) -> bytes:
    """Encode (height, width, 3) bytes."""
    height, width, _ = texels.shape
    rows = b"".join(b"\0" + texels[y].tobytes() for y in range(height))

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + body


@dataclass
class GlbScene:
    """A binary glTF file in the making."""

    nodes: list[dict[str, Any]] = field(default_factory=list)
    children: list[int] = field(default_factory=list)
    """Nodes that are not roots."""
    materials: list[dict[str, Any]] = field(default_factory=list)
    meshes: list[dict[str, Any]] = field(default_factory=list)
    textures: list[dict[str, Any]] = field(default_factory=list)
    extra: dict[str, Any] = field(default_factory=dict)
    _views: list[dict[str, int]] = field(default_factory=list)
    _accessors: list[dict[str, Any]] = field(default_factory=list)
    _images: list[dict[str, Any]] = field(default_factory=list)
    _buffer: bytearray = field(default_factory=bytearray)

    def _view(self, data: bytes) -> int:
        self._buffer += b"\0" * (-len(self._buffer) % 4)
        self._views.append({"buffer": 0, "byteOffset": len(self._buffer), "byteLength": len(data)})
        self._buffer += data
        return len(self._views) - 1

    def _accessor(self, values: NDArray[Any], kind: str) -> int:
        component = {"float32": 5126, "uint32": 5125}[values.dtype.name]
        view = self._view(values.tobytes())
        accessor = {"bufferView": view, "componentType": component, "count": len(values), "type": kind}
        self._accessors.append(accessor)
        return len(self._accessors) - 1

    def add_mesh(
        self,
        positions: NDArray[Any],
        triangles: NDArray[Any],
        material: int,
        normals: NDArray[Any] | None = None,
        uvs: NDArray[Any] | None = None,
    ) -> int:
        """Add (V, 3), (T, 3), (V, 3) and (V, 2), v down; returns the mesh's number."""
        attributes = {"POSITION": self._accessor(np.asarray(positions, np.float32), "VEC3")}
        if normals is not None:
            attributes["NORMAL"] = self._accessor(np.asarray(normals, np.float32), "VEC3")
        if uvs is not None:
            attributes["TEXCOORD_0"] = self._accessor(np.asarray(uvs, np.float32), "VEC2")
        indices = self._accessor(np.asarray(triangles, np.uint32).reshape(-1), "SCALAR")
        primitive = {"attributes": attributes, "indices": indices, "material": material}
        self.meshes.append({"primitives": [primitive]})
        return len(self.meshes) - 1

    def add_texture(self, texels: NDArray[np.uint8]) -> int:
        """Add an sRGB image (height, width, 3); returns the texture's number."""
        self._images.append({"bufferView": self._view(png(texels)), "mimeType": "image/png"})
        self.textures.append({"source": len(self._images) - 1})
        return len(self.textures) - 1

    def write(self, path: Path) -> Path:
        roots = [i for i in range(len(self.nodes)) if i not in self.children]
        document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": roots}],
            "nodes": self.nodes,
            "materials": self.materials,
            "meshes": self.meshes,
            "textures": self.textures,
            "images": self._images,
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._buffer)}],
            **self.extra,
        }
        text = json.dumps({key: value for key, value in document.items() if value != []}).encode()
        text += b" " * (-len(text) % 4)
        body = bytes(self._buffer) + b"\0" * (-len(self._buffer) % 4)
        chunks = (
            struct.pack("<I", len(text)) + b"JSON" + text + struct.pack("<I", len(body)) + b"BIN\0" + body
        )
        path.write_bytes(b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks)
        return path


SQUARE = np.array([[-1, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]], np.float32)
SQUARE_TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]], np.uint32)
SQUARE_UVS = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
SQUARE_NORMALS = np.tile(np.array([0, 1, 0], np.float32), (4, 1))


def pair_of_primitives(folder: Path) -> str:
    """One glTF mesh of two primitives, a gold one and a matte one with a normal texture and tangents."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    arrays = {
        "POSITION": square,
        "NORMAL": np.tile(np.array([0, 0, 1], np.float32), (4, 1)),
        "TANGENT": np.tile(np.array([0.6, 0.8, 0, -1], np.float32), (4, 1)),
        "TEXCOORD_0": square[:, :2],
        "indices": np.array([0, 1, 2, 0, 2, 3], np.uint32),
    }
    types = {2: "VEC2", 3: "VEC3", 4: "VEC4"}
    buffer, views, accessors = b"", [], []
    for number, array in enumerate(arrays.values()):
        views.append({"buffer": 0, "byteOffset": len(buffer), "byteLength": array.nbytes})
        kind = (
            {"type": types[array.shape[1]], "componentType": 5126} if array.ndim == 2 else {"type": "SCALAR"}
        )
        accessors.append({"bufferView": number, "count": len(array), "componentType": 5125} | kind)
        buffer += array.tobytes()
    attributes = {name: number for number, name in enumerate(arrays) if name != "indices"}
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "box"}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 4, "material": m} for m in (1, 0)]}],
        "materials": [
            {
                "name": "cloth",
                "pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0.2, 0.4, 0.6, 1]},
                "normalTexture": {"index": 0},
            },
            {
                "name": "gold",
                "pbrMetallicRoughness": {"roughnessFactor": 0, "baseColorFactor": [0.9, 0.7, 0.2, 1]},
            },
        ],
        "textures": [{"source": 0}],
        "images": [{"uri": "bump.png"}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(buffer), "uri": "pair.bin"}],
    }
    (folder / "bump.png").write_bytes(png(np.full((2, 2, 3), [128, 128, 255], np.uint8)))
    (folder / "pair.bin").write_bytes(buffer)
    (folder / "pair.gltf").write_text(json.dumps(document))
    return str(folder / "pair.gltf")

"""Writes small files of every kind that is read, for the fuzz targets to begin with.

    .venv/bin/python tests/fuzz/seeds.py FOLDER

makes FOLDER/fuzz_load_envmap, FOLDER/fuzz_load_mesh and FOLDER/fuzz_load_scene. Each file has the byte in
front by which its target chooses how it is read.
"""

from __future__ import annotations

import json
import struct
import sys
import tempfile
import zlib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import mirrorbake
from mirrorbake.envmap import EnvMap

if TYPE_CHECKING:
    from collections.abc import Iterator

RGB = np.random.default_rng(1).random((4, 8, 3), np.float32)


def images(folder: Path) -> Iterator[tuple[str, bytes]]:
    """Files of what the library writes."""
    for channels, names in ((1, ["Y"]), (3, None), (4, None), (3, ["a.R", "a.G", "a.B"]), (2, ["Y", "Z"])):
        pixels = np.resize(RGB, (4, 8, channels))
        path = folder / "image.exr"
        mirrorbake.save_image(path, pixels, names)
        yield f"exr{channels}{names}", path.read_bytes()
    for suffix in ("hdr", "png", "tif", "jpg"):
        path = folder / f"image.{suffix}"
        mirrorbake.save_image(path, RGB)
        yield suffix, path.read_bytes()
    cube = EnvMap.from_array(np.resize(RGB, (6, 4, 4, 3)), "cube").mips()
    for suffix in ("ktx2", "dds"):
        for precision in ("half", "float32"):
            path = folder / f"cube.{suffix}"
            cube.save(path, format=precision)
            yield suffix + precision, path.read_bytes()


def hdr() -> Iterator[tuple[str, bytes]]:
    """Headers and encodings that are not written here."""
    texels = bytes(range(1, 129))
    flat = texels[: 4 * 32]
    runs = b"\x02\x02\x00\x08" + b"".join(b"\x84" + bytes([i]) + b"\x04" + bytes(4) for i in range(4))
    for name, head, size, body in (
        ("flat", b"FORMAT=32-bit_rle_rgbe\nEXPOSURE=2\n", b"-Y 4 +X 8", flat),
        ("xyze", b"FORMAT=32-bit_rle_xyze\r\n", b"+Y 4 -X 8", flat),
        ("old", b"FORMAT=32-bit_rle_rgbe\n", b"-X 4 +Y 8", texels[:4] + b"\x01\x01\x01\x1f"),
        ("rle", b"FORMAT=32-bit_rle_rgbe\n", b"-Y 2 +X 8", runs * 2),
    ):
        yield "hdr" + name, b"#?RADIANCE\n" + head + b"\n" + size + b"\n" + body


def ktx2() -> Iterator[tuple[str, bytes]]:
    """Every pixel format and packing."""
    formats = {9: 1, 16: 2, 23: 3, 37: 4, 43: 4, 44: 4, 70: 2, 91: 8, 76: 2, 97: 8, 100: 4, 109: 16}
    formats |= {122: 4, 123: 4}
    for (vk, size), faces in ((entry, faces) for entry in formats.items() for faces in (1, 6)):
        width = 4 if faces == 1 else 2
        raw = bytes(i * 37 % 256 for i in range(width * 2 * faces * size))
        for packing, data in ((0, raw), (3, zlib.compress(raw))):
            keys = b"KTXswizzle\0rgb1\0" if vk == 37 else b""
            keys = struct.pack("<I", len(keys)) + keys if keys else b""
            head = b"\xabKTX 20\xbb\r\n\x1a\n" + struct.pack("<9I", vk, 1, width, 2, 0, 0, faces, 1, packing)
            place = 80 + 24
            head += struct.pack("<4I2Q", place, 44, place + 44, len(keys), 0, 0)
            head += struct.pack("<3Q", place + 44 + len(keys), len(data), len(raw))
            head += struct.pack("<4I", 44, 0, 2 | 40 << 16, 1 | 1 << 8 | 1 << 16) + bytes(28)
            yield f"ktx2-{vk}-{faces}-{packing}", head + keys + data


def meshes() -> Iterator[tuple[int, str, bytes]]:
    """OBJ files, and glTF files as JSON and binary; the number is that of the format."""
    yield 0, "plain", b"o a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\n"
    yield (
        0,
        "odd",
        b"\xef\xbb\xbf# c\nv 0 0 0 \\\n\nv 1 0 0 1 1 1\nv 0 1 0\nl 1 2\nf -3// -2/ -1 # end\ncurv 0 1 1 2\n",
    )
    points = struct.pack("<9f3H", 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 2)
    views = [{"buffer": 0, "byteLength": 36}, {"buffer": 0, "byteOffset": 36, "byteLength": 6}]
    accessors = [
        {
            "bufferView": 0,
            "componentType": 5126,
            "count": 3,
            "type": "VEC3",
            "min": [0, 0, 0],
            "max": [1, 1, 0],
        },
        {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
    ]
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": [
            {"mesh": 0, "rotation": [0, 0, 0, 1]},
            {"camera": 0, "translation": [0, 0, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}],
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point"}]}},
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0.1}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(points)}],
    }
    body = json.dumps(document).encode()
    body += b" " * (-len(body) % 4)
    data = points + bytes(-len(points) % 4)
    glb = struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(body) + 8 + len(data))
    glb += struct.pack("<I4s", len(body), b"JSON") + body + struct.pack("<I4s", len(data), b"BIN\0") + data
    yield 2, "binary", glb
    import base64

    document["buffers"] = [
        {
            "byteLength": len(points),
            "uri": "data:application/octet-stream;base64," + base64.b64encode(points).decode(),
        }
    ]
    yield 1, "embedded", json.dumps(document).encode()


def main() -> None:
    root = Path(sys.argv[1])
    targets = {name: root / f"fuzz_load_{name}" for name in ("envmap", "mesh", "scene")}
    for folder in targets.values():
        folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work:
        maps = [*images(Path(work)), *hdr(), *ktx2()]
        picture = Path(work) / "texture.png"
        mirrorbake.save_image(picture, RGB)
        texture = picture.read_bytes()
    for number, (_, data) in enumerate(maps):
        for arrangement in (0, 65, 128):
            (targets["envmap"] / f"{number}-{arrangement}").write_bytes(bytes([arrangement]) + data)
    library = (
        b"newmtl a\nKd 1 1 1\nNs 100\nmap_Kd -s 1 1 1 image.png\nd 0.5\nnewmtl b\nKe 1 1 1\nNi 1.5\nillum 7\n"
    )
    for number, (kind, _, data) in enumerate(meshes()):
        (targets["mesh"] / str(number)).write_bytes(bytes([kind]) + data)
        uses = b"mtllib library.mtl\nusemtl a\n" if kind == 0 else b""
        whole = bytes([kind]) + uses + data + b"\n%%library%%\n" + library + b"\n%%image%%\n" + texture
        (targets["scene"] / str(number)).write_bytes(whole)


if __name__ == "__main__":
    main()

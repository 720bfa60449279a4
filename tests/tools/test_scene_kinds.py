"""Scene files as other programs write them, each read by a process of its own: what it says, and its memory.

What they hold is tested beside the readers; here it is that none crashes, hangs or grows.
"""

from __future__ import annotations

import base64
import json
import struct
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from programs import find_program, needs_program

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = needs_program("mb-trace")

SECONDS = 10
"""Of processor time: a process that hangs is ended then."""
BYTES = 200 << 20
"""Memory that any of these small files may take."""

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\n"
FACE = "f 1 2 3 4\n"
COMB = "".join(
    f"v {i // 2 if i % 2 == 0 else i // 2 + 0.5} {1 if i % 2 else 0.2} 0\n" for i in range(514)
) + ("f " + " ".join(str(i) for i in range(1, 515)) + "\n")

OBJ: dict[str, tuple[str, str | None, str]] = {
    # Name: OBJ, MTL, and words of a warning.
    "comment behind a face": (SQUARE + "f 1 2 3 4 # last\n", None, ""),
    "line that goes on": (SQUARE + "f 1 2 \\\n3 4\n", None, ""),
    "slashes at the end": (SQUARE + "f 1/ 2/ 3/ 4/\n", None, ""),
    "slashes around nothing": (SQUARE + "f 1//1 2//1 3//1 4//1\nf 1// 2// 3//\n", None, ""),
    "byte-order mark": ("\ufeff# made elsewhere\n" + SQUARE + FACE, None, ""),
    "concave polygon": (COMB, None, ""),
    "curves": (SQUARE + FACE + "cstype bezier\ndeg 3\ncurv 0 1 1 2 3 4\nparm u 0 1\nend\n", None, "curves"),
    "lines and points": (SQUARE + FACE + "l 1 2\np 3\n", None, "lines are not supported"),
    "groups": (SQUARE + "g left\nf 1 2 3\ng right\nf 1 3 4\n", None, ""),
    "vertex colours": ("v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n", None, ""),
    "indented names": (SQUARE + "\tusemtl  a\t\n" + FACE, "newmtl \ta \nKd 1 0 0\n", ""),
    "index of refraction 0": (SQUARE + "usemtl a\n" + FACE, "newmtl a\nNi 0\n", "Ni"),
    "transparency of three": (SQUARE + "usemtl a\n" + FACE, "newmtl a\nTr 0 0 0\n", ""),
    "colour in xyz": (SQUARE + "usemtl a\n" + FACE, "newmtl a\nKd xyz 0.4 0.4 0.4\n", ""),
    "library with a mark": (SQUARE + "usemtl a\n" + FACE, "\ufeffnewmtl a\nKd 1 0 0\n", ""),
    "map without a name": (SQUARE + "usemtl a\n" + FACE, "newmtl a\nmap_Kd\n", "map_Kd"),
    "map that is missing": (SQUARE + "usemtl a\n" + FACE, "newmtl a\nmap_Kd none.png\n", "none.png"),
}

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], np.float32)


def gltf(**changes: Any) -> dict[str, Any]:
    """Return a triangle, with other sections in place of its own."""
    document: dict[str, Any] = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
        "materials": [{}],
        "buffers": [{"byteLength": 36, "uri": uri(CORNERS.tobytes())}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [accessor(bufferView=0)],
    }
    return {**document, **changes}


def uri(data: bytes, kind: str = "application/octet-stream") -> str:
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


def accessor(**more: Any) -> dict[str, Any]:
    low, high = CORNERS.min(axis=0).tolist(), CORNERS.max(axis=0).tolist()
    return {"componentType": 5126, "count": 3, "type": "VEC3", "min": low, "max": high, **more}


SPARSE = {
    "count": 3,
    "indices": {"bufferView": 1, "componentType": 5123},
    "values": {"bufferView": 0},
}
INDICES = struct.pack("<3H2x", 0, 1, 2)
SPOT = {"type": "spot", "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.5}}
GLTF: dict[str, tuple[dict[str, Any], str]] = {
    "sparse without a view": (
        gltf(
            buffers=[{"byteLength": 44, "uri": uri(CORNERS.tobytes() + INDICES)}],
            bufferViews=[
                {"buffer": 0, "byteLength": 36},
                {"buffer": 0, "byteOffset": 36, "byteLength": 6},
            ],
            accessors=[accessor(sparse=SPARSE)],
        ),
        "",
    ),
    "roughness a little above 1": (
        gltf(materials=[{"pbrMetallicRoughness": {"roughnessFactor": 1.0000001}}]),
        "roughnessFactor is cut",
    ),
    "equal cone angles": (
        gltf(
            extensionsUsed=["KHR_lights_punctual"],
            extensions={"KHR_lights_punctual": {"lights": [SPOT]}},
            nodes=[{"mesh": 0}, {"extensions": {"KHR_lights_punctual": {"light": 0}}}],
            scenes=[{"nodes": [0, 1]}],
        ),
        "",
    ),
    "texture without an image": (
        gltf(textures=[{}], materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]),
        "without an image",
    ),
    "data with a charset": (
        gltf(buffers=[{"byteLength": 36, "uri": uri(CORNERS.tobytes(), "application/gltf;charset=utf-8")}]),
        "",
    ),
}
REFUSED: dict[str, tuple[dict[str, Any], str]] = {
    "version 1": (gltf(asset={"version": "1.0"}), "is a glTF 1.0 file"),
    "damaged Draco": (
        gltf(
            extensionsUsed=["KHR_draco_mesh_compression"],
            meshes=[
                {
                    "primitives": [
                        {
                            "attributes": {"POSITION": 0},
                            "extensions": {
                                "KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}
                            },
                        }
                    ]
                }
            ],
        ),
        "Draco",
    ),
    "damaged meshopt": (
        gltf(
            extensionsUsed=["EXT_meshopt_compression"],
            bufferViews=[
                {
                    "buffer": 0,
                    "byteLength": 36,
                    "extensions": {
                        "EXT_meshopt_compression": {
                            "buffer": 0,
                            "byteLength": 36,
                            "byteStride": 12,
                            "count": 3,
                            "mode": "ATTRIBUTES",
                        }
                    },
                }
            ],
        ),
        "meshopt",
    ),
}


MEASURED = f"""
import os, resource, sys
resource.setrlimit(resource.RLIMIT_CPU, ({SECONDS}, {SECONDS}))
child = os.posix_spawn(sys.argv[1], sys.argv[1:], os.environ)
_, status, used = os.wait4(child, 0)
print(used.ru_maxrss)
sys.exit(os.waitstatus_to_exitcode(status) & 255)
"""
"""Runs a program and prints its memory in kilobytes, as Linux counts it. It is small itself: what the process
that starts a program holds is counted as the program's."""


def read(path: Path) -> tuple[int, list[str]]:
    """Trace a pixel of a scene in a process of its own; its exit status, and the lines that it says."""
    program = find_program("mb-trace")
    assert program is not None
    command = [program, "--threads", "1", "beauty", path, "--eye", "0", "0", "5", "--target", "0", "0", "0"]
    command += ["--size", "1x1", "--spp", "1", "-o", path.with_name("out.exr")]
    result = subprocess.run(
        [sys.executable, "-S", "-c", MEASURED, *map(str, command)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert int(result.stdout.split()[-1]) * 1024 < BYTES
    return result.returncode, result.stderr.splitlines()


def warnings_of(lines: list[str]) -> list[str]:
    """Of the file, without the one of its lights."""
    assert all(line.startswith("mb-trace: warning: ") for line in lines)
    return [line for line in lines if "no lights" not in line]


@pytest.mark.parametrize("name", OBJ)
def test_obj_and_mtl_files_as_others_write_them_are_read(tmp_path: Path, name: str) -> None:
    text, library, words = OBJ[name]
    if library is not None:
        (tmp_path / "m.mtl").write_text(library)
        text = "mtllib .\\m.mtl\n" + text
    (tmp_path / "model.obj").write_text(text)
    status, said = read(tmp_path / "model.obj")
    assert status == 0, said
    found = warnings_of(said)
    assert words in " ".join(found)
    assert bool(found) == bool(words)


@pytest.mark.parametrize("name", GLTF)
def test_gltf_files_as_others_write_them_are_read(tmp_path: Path, name: str) -> None:
    document, words = GLTF[name]
    (tmp_path / "model.gltf").write_text(json.dumps(document))
    status, said = read(tmp_path / "model.gltf")
    assert status == 0, said
    found = warnings_of(said)
    assert words in " ".join(found)
    assert bool(found) == bool(words)


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_read_is_one_line_that_names_file_and_reason(tmp_path: Path, name: str) -> None:
    document, words = REFUSED[name]
    path = tmp_path / "model.gltf"
    path.write_text(json.dumps(document))
    status, said = read(path)
    assert status == 3
    (line,) = said
    assert str(path) in line
    assert words in line

"""The page's lookups on a graphics card against the run-time model, and against the card's own filter.

The functions come out of the page's source (viewer/src/gl/shaders.ts) and run through EGL, on a graphics card
or on Mesa's software renderer. Every pixel looks a map up in a direction of its own, with differentials from
a sixteenth of a texel to half a face; the errors are PSNR in dB of values in [0, 1], against taps that are
placed in float64 and read by `EnvMap.sample`. The peer is the card's own `textureGrad` on a cube map of the
same texels, with as much anisotropy as there are taps. Times are of a frame of 1024² lookups.
"""

import importlib
import sys
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks._page import beyond, layers_of, reads_of_the_page
from benchmarks._report import Case, require, run
from mirrorbake.envmap import EnvMap

SIZE = 128
FRAME = 1024
RUNS = 5
# What the page promises of one tap and of several.
LEAST_DB = {1: 55.0, 4: 50.0}

VERTEX = """#version 300 es
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
"""
HEAD = """#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
precision highp samplerCube;
uniform sampler2D uD;
uniform sampler2D uDdx;
uniform sampler2D uDdy;
out vec4 oColour;
"""
OURS = """
uniform float uSize;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 d = texelFetch(uD, at, 0).xyz;
  Taps taps = tapsOf(d, texelFetch(uDdx, at, 0).xyz, texelFetch(uDdy, at, 0).xyz, uSize);
  vec3 sum = vec3(0.0);
  for (int tap = 0; tap < tapCount(taps); ++tap) {
    float weight;
    vec3 place = tapDirection(taps, d, tap, weight);
    sum += weight * readRadiance(place, taps.level, uSize, 0.0);
  }
  oColour = vec4(sum, 1.0);
}
"""
PEER = """
uniform samplerCube uCube;
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 d = texelFetch(uD, at, 0).xyz;
  oColour = textureGrad(uCube, d, texelFetch(uDdx, at, 0).xyz, texelFetch(uDdy, at, 0).xyz);
}
"""


def face_length(d: NDArray[np.float64], change: NDArray[np.float64]) -> NDArray[np.float64]:
    """Length of a differential on the face of the direction, in faces."""
    axis = np.abs(d).argmax(axis=-1)[..., None]
    major = np.take_along_axis(d, axis, -1)
    on_face = change - d * (np.take_along_axis(change, axis, -1) / major)
    np.put_along_axis(on_face, axis, 0.0, -1)
    length: NDArray[np.float64] = 0.5 * np.linalg.norm(on_face, axis=-1) / np.abs(major[..., 0])
    return length


def expected(
    envmap: EnvMap, d: NDArray[np.float64], ddx: NDArray[np.float64], ddy: NDArray[np.float64], most: int
) -> NDArray[np.float64]:
    """Lookups by the text of mirrorbake/envmap/reads.hpp, in float64."""
    x, y = SIZE * face_length(d, ddx), SIZE * face_length(d, ddy)
    longer = np.where((y > x)[..., None], ddy, ddx)
    major, minor = np.maximum(x, y), np.minimum(x, y)
    n = np.clip(major / np.maximum(minor, 1.0), 1.0, most)
    level = np.clip(np.log2(np.maximum(major / n, 1.0)), 0.0, np.log2(SIZE))
    pairs = np.where(n <= 1.25, 0, np.ceil(0.5 * n)).astype(int)
    step = np.where(pairs == 1, 0.5 * (n - 1.25) / 0.75, 1.0 / n)
    total = np.zeros((*d.shape[:-1], 3))
    single = envmap.sample(d, filter="trilinear", level=level)
    for pair in range(most // 2 if most > 1 else 0):
        weight = np.where(pair + 1 < pairs, 1.0, 0.5 * (n - 2.0 * (pairs - 1.0))) / n
        weight = np.where(pair < pairs, weight, 0.0)
        outermost = (pair + 1 == pairs) & (pair > 0)
        offset = np.where(outermost, 0.5 * (pair / n + 0.5), (pair + 0.5) * step)
        for side in (1.0, -1.0):
            place = d + (side * offset)[..., None] * longer
            total += weight[..., None] * envmap.sample(place, filter="trilinear", level=level)
    result: NDArray[np.float64] = np.where((pairs == 0)[..., None], single, total)
    return result


def decibels(seen: NDArray[np.floating], right: NDArray[np.float64]) -> float:
    return float(-10.0 * np.log10(np.mean((seen - right) ** 2)))


def footprints(random: np.random.Generator) -> list[NDArray[np.float32]]:
    """Directions with differentials of all sizes, elongations and turns."""
    d = random.normal(size=(FRAME, FRAME, 3))
    d /= np.linalg.norm(d, axis=-1, keepdims=True)
    u = np.cross(d, random.normal(size=d.shape))
    u /= np.linalg.norm(u, axis=-1, keepdims=True)
    v = np.cross(d, u)
    size = 2.0 ** random.uniform(-4.0, 6.0, (FRAME, FRAME, 1)) * (2.0 / SIZE)
    stretch = 2.0 ** random.uniform(0.0, 3.0, size.shape)
    return [part.astype(np.float32) for part in (d, size * u, size / stretch * v)]


def cases() -> Iterator[Case]:
    try:
        moderngl = importlib.import_module("moderngl")
        context = moderngl.create_standalone_context(backend="egl")
    except Exception as failure:  # moderngl raises whatever its backend does
        sys.exit(f"bench: skipped: there is no graphics card and no Mesa to be had through EGL ({failure})")
    print(f"bench: drawing on {context.info['GL_RENDERER']}", file=sys.stderr)
    random = np.random.default_rng(7)
    centres = (np.arange(SIZE) + 0.5) / SIZE * 2.0 - 1.0
    directions = np.stack([beyond(face, *np.meshgrid(centres, centres)) for face in range(6)])
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    waves = 0.5 + 0.3 * np.sin(directions @ np.array([[7.0, 3.0, 5.0], [2.0, 9.0, 4.0], [6.0, 1.0, 8.0]]))
    finest = np.clip(waves + random.uniform(-0.2, 0.2, waves.shape), 0.0, 1.0).astype(np.float32)
    envmap = EnvMap.from_array(finest, "cube").mips("box")
    levels = [EnvMap.from_array(envmap.level(k), "cube") for k in range(SIZE.bit_length())]

    d, ddx, ddy = footprints(random)
    inputs = [context.texture((FRAME, FRAME), 3, part.tobytes(), dtype="f4") for part in (d, ddx, ddy)]
    for texture in inputs:
        texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    layers = layers_of(levels)
    array = context.texture_array((layers.shape[2], layers.shape[1], 6), 3, layers.tobytes(), dtype="f4")
    array.filter = (moderngl.LINEAR, moderngl.LINEAR)
    array.repeat_x = array.repeat_y = False
    cube = context.texture_cube((SIZE, SIZE), 3, envmap.level(0).tobytes(), dtype="f4")
    cube.build_mipmaps()
    cube.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
    context.enable_direct(0x884F)  # GL_TEXTURE_CUBE_MAP_SEAMLESS
    target = context.framebuffer([context.texture((FRAME, FRAME), 4, dtype="f4")])
    target.use()

    def drawn(
        body: str, textures: dict[str, Any], values: dict[str, Any]
    ) -> tuple[NDArray[np.float32], float]:
        program = context.program(vertex_shader=VERTEX, fragment_shader=HEAD + body)
        for unit, (name, texture) in enumerate(textures.items()):
            if name in program:
                texture.use(unit)
                program[name] = unit
        for name, value in values.items():
            if name in program:
                program[name] = value
        triangle = context.vertex_array(program, [])
        triangle.render(moderngl.TRIANGLES, vertices=3)
        pixels = np.frombuffer(target.read(components=3, dtype="f4"), np.float32)
        context.finish()
        best = float("inf")
        for _ in range(RUNS):
            start = time.perf_counter()
            triangle.render(moderngl.TRIANGLES, vertices=3)
            context.finish()
            best = min(best, time.perf_counter() - start)
        return pixels.reshape(FRAME, FRAME, 3), 1e3 * best

    names = dict(zip(("uD", "uDdx", "uDdy"), inputs, strict=True))
    wide = [part.astype(np.float64) for part in (d, ddx, ddy)]
    for taps in (1, 4):
        right = expected(envmap, wide[0], wide[1], wide[2], taps)
        values = {
            "uSize": float(SIZE),
            "uMaxTaps": taps,
            "uLayer": (1 / layers.shape[2], 1 / layers.shape[1]),
        }
        ours, our_time = drawn(reads_of_the_page() + OURS, {**names, "uRadiance": array}, values)
        cube.anisotropy = float(taps)
        peer, peer_time = drawn(PEER, {**names, "uCube": cube}, {})
        error = decibels(ours, right)
        require(error >= LEAST_DB[taps], f"{taps} taps are {error:.1f} dB from the run-time model")
        yield Case(
            case=f"up to {taps} taps" if taps > 1 else "one tap",
            unit="ms a frame of 1024²",
            ours=our_time,
            peer=peer_time,
            peer_name="textureGrad",
            error_ours=error,
            error_peer=decibels(peer, right),
        )


if __name__ == "__main__":
    run(__doc__, cases)

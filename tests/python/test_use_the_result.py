"""The shaders and the three.js example of the guide "Use the result", in a headless browser."""

from __future__ import annotations

import base64
import functools
import http.server
import json
import math
import re
import shutil
import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from mirrorbake.bake.bake import bake
from mirrorbake.fresnel import conductor, dielectric, schlick
from mirrorbake.pem.export.glb import export_glb
from mirrorbake.pem.export.map_sets import run_time_of, sample_set, static_set
from mirrorbake.pem.export.maps import export_maps
from mirrorbake.pem.opened import open_pem
from mirrorbake.proxy import Proxy
from mirrorbake.scene.load import parse_config
from unwrapped import write_post_on_plate, write_sun
from web_tools import node_folder, page_after_running

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "web"
PAGE = ROOT / "docs" / "guide" / "use-the-result.md"
AXES = np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]], np.float32)
CENTRE, ORIGIN = (0.1, -0.5, 0.2), (0.2, 0.3, 0.1)

# Runs a function of the shader for every row of two textures of three floats, and leaves the answers, as the
# bytes of float32, in the page.
EVALUATOR = """<!doctype html><output></output><script>
const SIDE = 64;
try {
  const gl = document.createElement("canvas").getContext("webgl2");
  if (!gl.getExtension("EXT_color_buffer_float")) throw new Error("no float targets");
  const shader = (kind, text) => {
    const made = gl.createShader(kind);
    gl.shaderSource(made, "#version 300 es\\nprecision highp float;\\n" + text);
    gl.compileShader(made);
    if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
    return made;
  };
  const floats = (text) => new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  const target = () => {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return texture;
  };
  gl.viewport(0, 0, SIDE, SIDE);
  ["A", "B"].forEach((name, unit) => {
    gl.activeTexture(gl.TEXTURE0 + unit);
    target();
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB32F, SIDE, SIDE, 0, gl.RGB, gl.FLOAT, floats(INPUT[name]));
  });
  gl.activeTexture(gl.TEXTURE2);
  const result = target();
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, SIDE, SIDE, 0, gl.RGBA, gl.FLOAT, null);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, result, 0);
  const answers = INPUT.calls.map((call) => {
    const program = gl.createProgram();
    gl.attachShader(program, shader(gl.VERTEX_SHADER, `void main() {
      gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }`));
    gl.attachShader(program, shader(gl.FRAGMENT_SHADER, INPUT.source + `
      uniform sampler2D uA, uB;
      out vec4 answer;
      void main() {
        vec3 a = texelFetch(uA, ivec2(gl_FragCoord.xy), 0).xyz;
        vec3 b = texelFetch(uB, ivec2(gl_FragCoord.xy), 0).xyz;
        answer = vec4(${call}, 0.0);
      }`));
    gl.linkProgram(program);
    gl.useProgram(program);
    gl.uniform1i(gl.getUniformLocation(program, "uA"), 0);
    gl.uniform1i(gl.getUniformLocation(program, "uB"), 1);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const pixels = new Float32Array(4 * SIDE * SIDE);
    gl.readPixels(0, 0, SIDE, SIDE, gl.RGBA, gl.FLOAT, pixels);
    let bytes = "";
    for (const byte of new Uint8Array(pixels.buffer)) bytes += String.fromCharCode(byte);
    return btoa(bytes);
  });
  document.querySelector("output").textContent = JSON.stringify(answers);
} catch (error) {
  document.querySelector("output").textContent = "failed: " + error.message;
}
</script>"""


def answer_of(page: str) -> Any:
    found = re.search(r"<output[^>]*>(.*?)</output>", page, re.DOTALL)
    assert found, page[-2000:]
    assert found[1].startswith(("[", "{")), found[1]
    return json.loads(found[1])


def encoded(values: NDArray[np.float32]) -> str:
    return base64.b64encode(np.ascontiguousarray(values, np.float32).tobytes()).decode()


def evaluate_glsl(
    calls: list[str], a: NDArray[np.float32], b: NDArray[np.float32], folder: Path
) -> list[NDArray[np.float32]]:
    """Values (4096, 3) of expressions of `a` and `b`, both (4096, 3)."""
    source = (EXAMPLE / "lookups.glsl").read_text()
    data = {"A": encoded(a), "B": encoded(b), "calls": calls, "source": source}
    page = folder / "evaluate.html"
    page.write_text(EVALUATOR.replace("<script>", f"<script>const INPUT = {json.dumps(data)};", 1))
    answers = answer_of(page_after_running(page.as_uri()))
    decoded = [np.frombuffer(base64.b64decode(text), np.float32).reshape(-1, 4) for text in answers]
    return [values[:, :3] for values in decoded]


def glsl(values: Any) -> str:
    flat = np.asarray(values, np.float32).ravel()
    return f"{ {3: 'vec3', 9: 'mat3'}[len(flat)] }({', '.join(f'{float(v):.9g}' for v in flat)})"


def angle(a: NDArray[Any], b: NDArray[Any]) -> NDArray[np.float64]:
    a, b = (v.astype(np.float64) / np.linalg.norm(v, axis=1, keepdims=True) for v in (a, b))
    result: NDArray[np.float64] = np.linalg.norm(np.cross(a, b), axis=1) + (np.sum(a * b, axis=1) < 0)
    return result


def test_the_shaders_lookups_are_those_of_the_library(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    position = (np.array(ORIGIN) + rng.uniform(-0.2, 0.2, (4096, 3))).astype(np.float32)
    direction = rng.normal(size=(4096, 3)).astype(np.float32)
    # GLSL's matrices are written column by column.
    common = f"{glsl(CENTRE)}, {glsl(AXES.T)}"
    calls = [
        "lookupInfinite(a, b)",
        f"lookupBox(a, b, {common}, {glsl((2, 1.5, 3))}, {glsl(ORIGIN)})",
        f"lookupEllipsoid(a, b, {common}, {glsl((2, 1.5, 3))}, {glsl(ORIGIN)})",
        f"lookupHemisphere(a, b, {common}, 2.5, {glsl(ORIGIN)})",
        f"lookupPlane(a, b, {glsl(CENTRE)}, vec3(0.0, 1.0, 0.0), {glsl(ORIGIN)})",
    ]
    proxies = [
        Proxy.infinite(ORIGIN),
        Proxy.box(CENTRE, (2, 1.5, 3), ORIGIN, AXES),
        Proxy.ellipsoid(CENTRE, (2, 1.5, 3), ORIGIN, AXES),
        Proxy.hemisphere(CENTRE, 2.5, ORIGIN, AXES),
    ]
    found = evaluate_glsl(calls, position, direction, tmp_path)
    for call, proxy, values in zip(calls, proxies, found, strict=False):
        # Single precision, in shapes of some metres.
        assert angle(values, proxy.lookup(position, direction)).max() < 1e-5, call
    down = direction[:, 1] < 0
    t = (position[:, 1] - CENTRE[1]) / np.where(down, -direction[:, 1], 1.0)
    hit = position.astype(np.float64) + t[:, None] * direction - np.array(ORIGIN)
    expected = np.where(down[:, None], hit, direction)
    assert 1000 < down.sum() < 3000
    assert angle(found[4], expected).max() < 1e-5


def test_the_shaders_reflectances_are_those_of_the_library(tmp_path: Path) -> None:
    c = np.linspace(0.0, 1.0, 4096, dtype=np.float32)
    a = np.repeat(c[:, None], 3, axis=1)
    calls = [
        "fresnelSchlick(a.x, vec3(0.9, 0.5, 0.04))",
        "fresnelDielectric(a.x, vec3(1.5, 1.0001, 0.7))",
        "fresnelConductor(a.x, vec3(0.2, 1.1, 3.2), vec3(3.9, 6.8, 3.3))",
    ]
    found = evaluate_glsl(calls, a, a, tmp_path)
    x = c.astype(np.float64)
    expected = [
        np.stack([schlick(x, r0) for r0 in (0.9, 0.5, 0.04)], axis=1),
        np.stack([dielectric(x, n) for n in (1.5, 1.0001, 0.7)], axis=1),
        np.stack([conductor(x, n, k) for n, k in ((0.2, 3.9), (1.1, 6.8), (3.2, 3.3))], axis=1),
    ]
    # At the critical angle of n = 0.7 the curve is vertical: a rounding of c is 1e-3 of F there, 3e-5 beside.
    away = np.abs(x - math.sqrt(1.0 - 0.7**2)) > 1e-3
    for call, values, exact in zip(calls, found, expected, strict=True):
        assert np.abs(values - exact)[away].max() < 5e-5, call


def test_the_shaders_level_is_that_of_the_texels_across(tmp_path: Path) -> None:
    rng = np.random.default_rng(6)
    lookup = rng.normal(size=(4096, 3)).astype(np.float32)
    change = (rng.normal(size=(4096, 3)) * np.exp(rng.uniform(-7, 0, (4096, 1)))).astype(np.float32)
    size = 64
    (found,) = evaluate_glsl([f"vec3(levelOfDetail(a, b, 0.1 * b, {size}.0))"], lookup, change, tmp_path)
    d, step = lookup.astype(np.float64), change.astype(np.float64)
    axis = np.argmax(np.abs(d), axis=1)[:, None]
    major = np.take_along_axis(d, axis, axis=1)
    # Derivative of the face's coordinates d / major, and half of the size for a face from -1 to 1.
    moved = step / np.abs(major) - d * np.take_along_axis(step, axis, axis=1) / (major * np.abs(major))
    texels = 0.5 * size * np.linalg.norm(moved, axis=1)
    expected = np.clip(np.log2(np.maximum(texels, 1.0)), 0.0, 6.0)
    assert (expected > 1.0).mean() > 0.3
    np.testing.assert_allclose(found[:, 0], expected, atol=1e-4)


def test_the_guide_shows_the_file_that_the_example_uses() -> None:
    assert '--8<-- "examples/web/lookups.glsl"' in PAGE.read_text()


SMALL = {
    "reflector": {"object": "teapot", "subdivisions": 12, "parts": "split"},
    "views": {"count": 1, "size": [240, 180]},
    "maps": {"size": 32},
    "layers": {"local": True, "hull_split": True},
    "trace": {"samples": 4, "indirect": "none"},
    "auto": {"quality": "draft"},
}

# Draws one picture with a given camera into floats.
COMPARISON = """<!doctype html><output></output>
<script type="importmap">{"imports": {"three": "./node_modules/three/build/three.module.js",
  "three/addons/": "./node_modules/three/examples/jsm/"}}</script>
<script type="module">
const output = document.querySelector("output");
try {
  const THREE = await import("three");
  const { loadReflector } = await import("./reflector.js");
  const reflector = await loadReflector("maps", "reflector.glb", "sample-0000");
  const renderer = new THREE.WebGLRenderer();
  const [width, height] = VIEW.size;
  const camera = new THREE.PerspectiveCamera(VIEW.fov, width / height, 0.01, 100);
  camera.position.set(...VIEW.eye);
  camera.lookAt(...VIEW.target);
  const scene = new THREE.Scene();
  scene.add(reflector);
  const target = new THREE.WebGLRenderTarget(width, height, { type: THREE.FloatType });
  renderer.setRenderTarget(target);
  renderer.setClearAlpha(0);
  renderer.render(scene, camera);
  const pixels = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
  let bytes = "";
  for (const byte of new Uint8Array(pixels.buffer)) bytes += String.fromCharCode(byte);
  output.textContent = JSON.stringify([btoa(bytes)]);
} catch (error) {
  output.textContent = "failed: " + error.stack;
}
</script>"""


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Path, str]]:
    packages = node_folder("examples/web")
    folder = tmp_path_factory.mktemp("three") / "site"
    shutil.copytree(EXAMPLE, folder, ignore=shutil.ignore_patterns("node_modules", "maps", "*.glb"))
    (folder / "node_modules").symlink_to(packages / "node_modules")

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, format: str, *args: Any) -> None:
            pass

    handler = functools.partial(Quiet, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield folder, f"http://127.0.0.1:{server.server_address[1]}"
        server.shutdown()
        thread.join()


def plate_with_lightmap(folder: Path) -> dict[str, Any]:
    """A scene whose diffuse light has a shadow, which lies in a lightmap."""
    write_post_on_plate(folder / "plate.obj")
    write_sun(folder / "sky.exr")
    return {
        "reflector": {"mesh": str(folder / "plate.obj"), "parts": "joined"},
        "surroundings": {"panorama": str(folder / "sky.exr")},
        "material": {
            "albedo": [0.7, 0.6, 0.5],
            "ior": [1.5] * 3,
            "fresnel": "dielectric",
            "layers": "coated",
        },
        "layers": {"local": True, "diffuse": True, "lightmap": 64},
    }


@pytest.mark.parametrize("kind", ["display", "layers", "lightmap"])
def test_the_three_js_example_draws_what_the_library_draws(
    kind: str, served: tuple[Path, str], tmp_path: Path
) -> None:
    folder, address = served
    own: dict[str, Any] = {"infer": {"fit": "layers"}} if kind == "layers" else {}
    if kind == "lightmap":
        own = plate_with_lightmap(tmp_path)
    bake(parse_config({**SMALL, **own}, "small"), tmp_path / "pem")
    pem = open_pem(tmp_path / "pem")
    built, store = pem.stage.built, pem.store
    export_maps([static_set(store), sample_set(store, 0)], folder / "maps", run_time=run_time_of(store))
    export_glb(store, built, folder / "reflector.glb")
    point = pem.space.sample(0)
    cameras = built.cameras
    view = {"eye": cameras.eye(point), "target": cameras.centre, "fov": cameras.fov, "size": cameras.size}
    (folder / "comparison.html").write_text(
        COMPARISON.replace("<output>", f"<script>const VIEW = {json.dumps(view)};</script><output>", 1)
    )
    (text,) = answer_of(page_after_running(f"{address}/comparison.html"))
    width, height = cameras.size
    page = np.frombuffer(base64.b64decode(text), np.float32).reshape(height, width, 4)[::-1]

    places = pem.run_time.model.places
    camera = cameras.camera(point)
    samples = pem.stage.tracer.trace_visibility(camera, built.reflector, pem.stage.options, places)
    ours = pem.run_time.render("pem", point, samples)
    counts = np.bincount(np.asarray(samples.pixel), minlength=width * height).reshape(height, width)
    inside = counts == len(places)
    drawn = page[..., 3] > 0
    # A silhouette may go through the middle of a pixel.
    assert (drawn[inside]).mean() > 0.99
    assert drawn[counts == 0].mean() < 0.01
    assert inside.sum() > 3000
    shown, expected = (np.clip(image[inside & drawn], 0, 1) ** (1 / 2.2) for image in (page[..., :3], ours))
    # A pixel that shows one triangle has the same surface in both; the maps are half floats.
    triangle = np.asarray(samples.triangle).astype(np.int64)
    first, last = np.full(width * height, 1 << 40), np.full(width * height, -1)
    np.minimum.at(first, np.asarray(samples.pixel), triangle)
    np.maximum.at(last, np.asarray(samples.pixel), triangle)
    whole = (first == last).reshape(height, width)[inside & drawn]
    assert whole.sum() > 500
    assert -10.0 * math.log10(np.mean((shown[whole] - expected[whole]) ** 2)) > 45.0
    # At edges the example goes on with the triangle in the pixel's middle.
    assert -10.0 * math.log10(np.mean((shown - expected) ** 2)) > 25.0
    np.testing.assert_allclose(shown.mean(axis=0), expected.mean(axis=0), atol=5e-3)


def test_the_page_of_the_example_shows_its_reflector(served: tuple[Path, str], tmp_path: Path) -> None:
    folder, address = served
    if not (folder / "reflector.glb").is_file():
        pytest.skip("the test before made no files")
    page = page_after_running(f"{address}/index.html?set=sample-0000")
    assert "<canvas" in page
    assert "<output" not in page
    broken = page_after_running(f"{address}/index.html?set=sample-0007")
    assert "Cannot show the reflector: maps.json has no set sample-0007" in broken

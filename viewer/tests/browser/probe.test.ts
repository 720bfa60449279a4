import { spawn } from "node:child_process";
import { mkdtempSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Readable } from "node:stream";
import { expect, test } from "vitest";
import { assemblyOf, atlasSize, layerSize, levelCount, sourcePlace } from "../../src/atlas";
import { HEADER, reads } from "../../src/gl/shaders";
import { launch, open, serve } from "./support";

declare global {
  interface Window {
    drawMap: () => Promise<number[]>;
  }
}

const PYTHON = process.env.PYTHON ?? "../.venv/bin/python";

const VERTEX = `${HEADER}
void main() {
  gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
`;

// The page's own reads, for directions and differentials out of textures.
const FRAGMENT = `${HEADER}
uniform sampler2D uD;
uniform sampler2D uDdx;
uniform sampler2D uDdy;
uniform float uSize;
out vec4 oColour;
${reads("cube")}
void main() {
  ivec2 at = ivec2(gl_FragCoord.xy);
  vec3 d = texelFetch(uD, at, 0).xyz;
  if (dot(d, d) == 0.0) {
    oColour = vec4(0.0);
    return;
  }
  Taps taps = tapsOf(d, texelFetch(uDdx, at, 0).xyz, texelFetch(uDdy, at, 0).xyz, uSize);
  vec3 sum = vec3(0.0);
  for (int tap = 0; tap < tapCount(taps); ++tap) {
    float weight;
    vec3 place = tapDirection(taps, d, tap, weight);
    sum += weight * readRadiance(place, taps.level, uSize, 0.0);
  }
  oColour = vec4(sum, 1.0);
}
`;

/// Messages of a length and bytes, as tests/support/viewer_probe.py writes them.
async function* messages(stream: Readable): AsyncGenerator<Buffer> {
  let waiting: Buffer[] = [];
  let length = 0;
  for await (const chunk of stream) {
    waiting.push(chunk as Buffer);
    length += (chunk as Buffer).length;
    while (length >= 4) {
      const all = waiting.length === 1 ? waiting[0] : Buffer.concat(waiting, length);
      const end = 4 + all.readUInt32LE(0);
      waiting = [all];
      if (length < end) break;
      yield all.subarray(4, end);
      waiting = [all.subarray(end)];
      length -= end;
    }
  }
}

/// Layers of a cube map as the page keeps them, of floats, from the texels of all levels.
function layersOf(texels: Float32Array, size: number): Float32Array {
  const { width: columns, height: rows } = atlasSize(size, "cube");
  const atlas = new Float32Array(3 * columns * rows);
  let texel = 0;
  for (let level = 0; level < levelCount(size); ++level) {
    const n = size >> level;
    const from = sourcePlace(size, level, "cube");
    for (let face = 0; face < 6; ++face) {
      for (let row = 0; row < n; ++row) {
        const y = from.y + Math.floor(face / 3) * n + row;
        const to = 3 * (y * columns + from.x + (face % 3) * n);
        atlas.set(texels.subarray(3 * texel, 3 * (texel + n)), to);
        texel += n;
      }
    }
  }
  const { source, corners } = assemblyOf(size, "cube");
  const layers = new Float32Array(3 * source.length);
  for (let i = 0; i < source.length; ++i) {
    if (source[i] >= 0) layers.set(atlas.subarray(3 * source[i], 3 * source[i] + 3), 3 * i);
  }
  for (let i = 0; i < corners.length; i += 4) {
    for (let c = 0; c < 3; ++c) {
      const sum = [1, 2, 3].reduce((total, k) => total + layers[3 * corners[i + k] + c], 0);
      layers[3 * corners[i] + c] = sum / 3;
    }
  }
  return layers;
}

const bytesOf = (values: Float32Array) => Buffer.from(values.buffer, values.byteOffset, values.byteLength);
const floatsOf = (bytes: Buffer) => new Float32Array(Uint8Array.from(bytes).buffer);

interface Setup {
  vertex: string;
  fragment: string;
  image: number;
  map: number;
  layer: number[];
}

/// In the page: makes `drawMap`, which fetches layers and returns the picture, rows in the order of the rays' rows.
async function prepare({ vertex, fragment, image, map, layer }: Setup): Promise<void> {
  const canvas = document.createElement("canvas");
  const gl = canvas.getContext("webgl2");
  if (!gl) throw new Error("no WebGL2");
  for (const name of ["EXT_color_buffer_float", "OES_texture_float_linear"]) {
    if (!gl.getExtension(name)) throw new Error(`no ${name}`);
  }
  const program = gl.createProgram();
  for (const [type, text] of [
    [gl.VERTEX_SHADER, vertex],
    [gl.FRAGMENT_SHADER, fragment],
  ] as const) {
    const shader = gl.createShader(type);
    if (!shader) throw new Error("no shader");
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? "");
  gl.useProgram(program);
  const at = (name: string) => gl.getUniformLocation(program, name);
  const rays = new Float32Array(await (await fetch("rays")).arrayBuffer());
  const count = 3 * image * image;
  ["uD", "uDdx", "uDdy"].forEach((name, unit) => {
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(
      gl.TEXTURE_2D,
      0,
      gl.RGB32F,
      image,
      image,
      0,
      gl.RGB,
      gl.FLOAT,
      rays.subarray(unit * count, (unit + 1) * count),
    );
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.uniform1i(at(name), unit);
  });
  gl.activeTexture(gl.TEXTURE3);
  gl.bindTexture(gl.TEXTURE_2D_ARRAY, gl.createTexture());
  gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGB32F, layer[0], layer[1], 6);
  for (const [key, value] of [
    [gl.TEXTURE_MIN_FILTER, gl.LINEAR],
    [gl.TEXTURE_MAG_FILTER, gl.LINEAR],
    [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE],
    [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE],
  ]) {
    gl.texParameteri(gl.TEXTURE_2D_ARRAY, key, value);
  }
  gl.uniform1i(at("uRadiance"), 3);
  gl.uniform1i(at("uAlpha"), 3);
  gl.uniform2f(at("uLayer"), 1 / layer[0], 1 / layer[1]);
  gl.uniform1i(at("uMaxTaps"), 4);
  gl.uniform1f(at("uSize"), map);
  const target = gl.createRenderbuffer();
  gl.bindRenderbuffer(gl.RENDERBUFFER, target);
  gl.renderbufferStorage(gl.RENDERBUFFER, gl.RGBA32F, image, image);
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
  gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.RENDERBUFFER, target);
  gl.viewport(0, 0, image, image);
  gl.bindVertexArray(gl.createVertexArray());
  window.drawMap = async () => {
    const layers = new Float32Array(await (await fetch("layers")).arrayBuffer());
    gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, 0, layer[0], layer[1], 6, gl.RGB, gl.FLOAT, layers);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const pixels = new Float32Array(4 * image * image);
    gl.readPixels(0, 0, image, image, gl.RGBA, gl.FLOAT, pixels);
    if (gl.getError() !== gl.NO_ERROR) throw new Error("WebGL failed");
    return Array.from(pixels.filter((_, i) => i % 4 !== 3));
  };
}

interface Result {
  renderings: number;
  rows: number;
  unresolved: number;
  analyticRows: number;
  entries: number;
  worst: number;
}

test("the matrix probed from pictures of the page's shader is the analytic one", async () => {
  const probe = spawn(PYTHON, ["../tests/support/viewer_probe.py"], { stdio: ["pipe", "pipe", "inherit"] });
  const site = await serve(mkdtempSync(join(tmpdir(), "mirrorbake-probe-")));
  site.replaced.set("index.html", Buffer.from("<!doctype html><title>probe</title>"));
  const browser = await launch();
  const incoming = messages(probe.stdout);
  const receive = async () => {
    const next = await incoming.next();
    if (next.done) throw new Error("viewer_probe.py ended");
    return next.value;
  };
  try {
    const { image, map }: { image: number; map: number } = JSON.parse((await receive()).toString());
    site.replaced.set("rays", await receive());
    const { page, errors } = await open(browser, site.url, { until: () => true });
    const { width, height } = layerSize(map);
    await page.evaluate(prepare, { vertex: VERTEX, fragment: FRAGMENT, image, map, layer: [width, height] });
    let result: Result | undefined;
    while (!result) {
      const message = await receive();
      if (message.toString("latin1", 0, 10) === '{"result":') {
        result = JSON.parse(message.toString()).result;
        continue;
      }
      site.replaced.set("layers", bytesOf(layersOf(floatsOf(message), map)));
      const picture = Float32Array.from(await page.evaluate(() => window.drawMap()));
      const length = Buffer.alloc(4);
      length.writeUInt32LE(picture.byteLength);
      probe.stdin.write(Buffer.concat([length, bytesOf(picture)]));
    }
    console.log(JSON.stringify(result));
    expect(errors).toEqual([]);
    expect(result.renderings).toBeLessThanOrEqual(64);
    expect(result.rows + result.unresolved).toBe(result.analyticRows);
    expect(result.unresolved).toBeLessThanOrEqual(0.02 * result.analyticRows);
    // Bilinear weights have 8 bits at least.
    expect(result.worst).toBeLessThanOrEqual(1 / 256);
  } finally {
    probe.kill();
    await browser.close();
    site.server.close();
  }
});

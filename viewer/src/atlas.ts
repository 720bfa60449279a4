/// Maps as the page receives them and as it keeps them on the GPU.
///
/// A received atlas holds all levels of a map side by side (level_place in radiance_code.py). On the GPU each face is a
/// layer of a 2D array texture that holds that face on all levels, each level with a border of one texel: on a cube from the
/// neighbouring faces, so that bilinear reads are seamless by our own rule and not by that of a driver; on a paraboloid, whose
/// texels go on beyond the rim, the last one again.

import { PROJECTIONS, type Projection } from "./projection";

export interface RadianceCode {
  low: number;
  high: number;
  epsilon: number;
}

/// Radiance of the 256 codes.
export function radianceTable(code: RadianceCode): Float32Array {
  const table = new Float32Array(256);
  for (let c = 0; c < 256; ++c) {
    table[c] = Math.max(2 ** (code.low + (c * (code.high - code.low)) / 255) - code.epsilon, 0);
  }
  return table;
}

/// Three values ≥ 0 with 9 bits each and one exponent, as GL_UNSIGNED_INT_5_9_9_9_REV has them (OpenGL ES 3.0 §3.8.3.2).
export function packSharedExponent(r: number, g: number, b: number): number {
  const largest = Math.min(Math.max(r, g, b), 65408);
  if (!(largest > 0)) return 0;
  let exponent = Math.max(-16, Math.floor(Math.log2(largest))) + 16;
  let scale = 2 ** (24 - exponent);
  if (Math.round(largest * scale) > 511) {
    ++exponent;
    scale *= 0.5;
  }
  const mantissa = (v: number) => Math.min(Math.round(v * scale), 511);
  return ((exponent << 27) | (mantissa(b) << 18) | (mantissa(g) << 9) | mantissa(r)) >>> 0;
}

/// Inverse of packSharedExponent.
export function unpackSharedExponent(packed: number): [number, number, number] {
  const scale = 2 ** ((packed >>> 27) - 24);
  return [(packed & 511) * scale, ((packed >>> 9) & 511) * scale, ((packed >>> 18) & 511) * scale];
}

export function levelCount(size: number): number {
  return Math.log2(size) + 1;
}

/// Pixels of the received atlas.
export function atlasSize(size: number, projection: Projection): { width: number; height: number } {
  const { faces, across } = PROJECTIONS[projection];
  return { width: across * size, height: (faces / across) * (size + (size >> 1)) };
}

/// Top left texel of a level in the received atlas.
export function sourcePlace(size: number, level: number, projection: Projection): { x: number; y: number } {
  if (level === 0) return { x: 0, y: 0 };
  const { faces, across } = PROJECTIONS[projection];
  let x = 0;
  for (let finer = 1; finer < level; ++finer) x += across * (size >> finer);
  return { x, y: (faces / across) * size };
}

/// Size of a layer on the GPU.
export function layerSize(size: number): { width: number; height: number } {
  const half = size > 1 ? size / 2 + 2 : 0;
  return {
    width: size + 2 + half,
    height: Math.max(size + 2, size - 1 + 2 * (levelCount(size) - 1)),
  };
}

/// Top left texel, border included, of a level in a layer on the GPU: the finest one on the left, the others one below the
/// other to its right. The shader computes the same.
export function layerPlace(size: number, level: number): { x: number; y: number } {
  if (level === 0) return { x: 0, y: 0 };
  return { x: size + 2, y: size - 2 * (size >> level) + 2 * (level - 1) };
}

/// How a layer of a map of `size` is put together: where each texel of it comes from in the received atlas. `source` has the
/// place of every texel of all layers; `corners` names those that are the mean of three, as [to, a, b, c].
export interface Assembly {
  width: number;
  height: number;
  source: Int32Array;
  corners: Int32Array;
}

const assemblies = new Map<string, Assembly>();

export function assemblyOf(size: number, projection: Projection): Assembly {
  const key = `${projection} ${size}`;
  const known = assemblies.get(key);
  if (known) return known;
  const { width, height } = layerSize(size);
  const { faces, across, acrossEdge } = PROJECTIONS[projection];
  const source = new Int32Array(faces * width * height).fill(-1);
  const corners: number[] = [];
  const columns = across * size;
  for (let level = 0; level < levelCount(size); ++level) {
    const n = size >> level;
    const from = sourcePlace(size, level, projection);
    const to = layerPlace(size, level);
    const inAtlas = (texel: number) => {
      const face = Math.floor(texel / (n * n));
      const row = Math.floor(texel / n) % n;
      const column = texel % n;
      return (from.y + Math.floor(face / across) * n + row) * columns + from.x + (face % across) * n + column;
    };
    for (let face = 0; face < faces; ++face) {
      const at = (row: number, column: number) =>
        (face * height + to.y + 1 + row) * width + to.x + 1 + column;
      for (let row = -1; row <= n; ++row) {
        for (let column = -1; column <= n; ++column) {
          const outside = Number(row < 0 || row >= n) + Number(column < 0 || column >= n);
          const r = Math.min(Math.max(row, 0), n - 1);
          const c = Math.min(Math.max(column, 0), n - 1);
          if (!acrossEdge) {
            source[at(row, column)] = inAtlas((face * n + r) * n + c);
          } else if (outside === 2) {
            corners.push(at(row, column), at(r, c), at(row, c), at(r, column));
          } else {
            const texel = outside === 1 ? acrossEdge(n, face, row, column) : (face * n + row) * n + column;
            source[at(row, column)] = inAtlas(texel);
          }
        }
      }
    }
  }
  const assembly = { width, height, source, corners: Int32Array.from(corners) };
  assemblies.set(key, assembly);
  return assembly;
}

/// The layers of a radiance map, one a face, from the pixels (RGBA, 8 bit) of its atlas.
export function assembleRadiance(
  pixels: Uint8ClampedArray | Uint8Array,
  size: number,
  projection: Projection,
  table: Float32Array,
): Uint32Array {
  const { source, corners } = assemblyOf(size, projection);
  const layers = new Uint32Array(source.length);
  for (let i = 0; i < source.length; ++i) {
    const from = source[i];
    if (from < 0) continue;
    layers[i] = packSharedExponent(
      table[pixels[4 * from]],
      table[pixels[4 * from + 1]],
      table[pixels[4 * from + 2]],
    );
  }
  for (let i = 0; i < corners.length; i += 4) {
    const sum = [0, 0, 0];
    for (let k = 1; k < 4; ++k) {
      const value = unpackSharedExponent(layers[corners[i + k]]);
      for (let c = 0; c < 3; ++c) sum[c] += value[c] / 3;
    }
    layers[corners[i]] = packSharedExponent(sum[0], sum[1], sum[2]);
  }
  return layers;
}

/// The same of α.
export function assembleAlpha(
  pixels: Uint8ClampedArray | Uint8Array,
  size: number,
  projection: Projection,
): Uint8Array {
  const { source, corners } = assemblyOf(size, projection);
  const layers = new Uint8Array(source.length);
  for (let i = 0; i < source.length; ++i) {
    if (source[i] >= 0) layers[i] = pixels[4 * source[i]];
  }
  for (let i = 0; i < corners.length; i += 4) {
    layers[corners[i]] = Math.round(
      (layers[corners[i + 1]] + layers[corners[i + 2]] + layers[corners[i + 3]]) / 3,
    );
  }
  return layers;
}

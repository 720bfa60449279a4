import { describe, expect, test } from "vitest";
import {
  assembleAlpha,
  assembleRadiance,
  assemblyOf,
  atlasSize,
  layerPlace,
  layerSize,
  levelCount,
  packSharedExponent,
  radianceTable,
  sourcePlace,
  unpackSharedExponent,
} from "../../src/atlas";
import { texelAcrossEdge } from "../../src/projection";

describe("shared exponents", () => {
  test("are off by a 512th of the largest channel at most", () => {
    for (let i = 0; i < 20000; ++i) {
      const scale = 2 ** ((i % 30) - 14);
      const colour = [((i * 7) % 101) / 101, ((i * 13) % 103) / 103, ((i * 29) % 107) / 107].map(
        (c) => c * scale,
      );
      const largest = Math.max(...colour);
      const back = unpackSharedExponent(packSharedExponent(colour[0], colour[1], colour[2]));
      const worst = Math.max(...back.map((value, c) => Math.abs(value - colour[c])));
      expect(worst).toBeLessThanOrEqual(Math.max(largest / 512, 2 ** -25) * 1.0001);
    }
  });

  test("hold black, the largest value and what is beyond it", () => {
    expect(packSharedExponent(0, 0, 0)).toBe(0);
    expect(unpackSharedExponent(packSharedExponent(65408, 0, 0))[0]).toBe(65408);
    expect(unpackSharedExponent(packSharedExponent(1e9, 0, 0))[0]).toBe(65408);
  });
});

test("a radiance table begins with black, rises, and ends at the largest radiance", () => {
  const table = radianceTable({ low: -7, high: 4, epsilon: 2 ** -7 });
  expect(table[0]).toBe(0);
  expect(table[255]).toBeCloseTo(16 - 2 ** -7, 4);
  for (let c = 1; c < 256; ++c) expect(table[c]).toBeGreaterThan(table[c - 1]);
});

test("across an edge and back lies the texel that one came from", () => {
  const n = 4;
  for (let face = 0; face < 6; ++face) {
    for (let i = 0; i < n; ++i) {
      for (const [row, column] of [
        [-1, i],
        [n, i],
        [i, -1],
        [i, n],
      ]) {
        const inside =
          (face * n + Math.min(Math.max(row, 0), n - 1)) * n + Math.min(Math.max(column, 0), n - 1);
        const other = texelAcrossEdge(n, face, row, column);
        const otherFace = Math.floor(other / (n * n));
        expect(otherFace).not.toBe(face);
        const [r, c] = [Math.floor(other / n) % n, other % n];
        const back = [
          [r - 1, c],
          [r + 1, c],
          [r, c - 1],
          [r, c + 1],
        ]
          .filter(([y, x]) => (y < 0 || y >= n) !== (x < 0 || x >= n))
          .map(([y, x]) => texelAcrossEdge(n, otherFace, y, x));
        expect(back).toContain(inside);
      }
    }
  }
});

describe("a layer", () => {
  test("holds all levels apart from each other and within its size", () => {
    for (const size of [1, 2, 16, 64]) {
      const { width, height } = layerSize(size);
      const taken = new Set<number>();
      let texels = 0;
      for (let level = 0; level < levelCount(size); ++level) {
        const n = (size >> level) + 2;
        const { x, y } = layerPlace(size, level);
        expect(x + n).toBeLessThanOrEqual(width);
        expect(y + n).toBeLessThanOrEqual(height);
        texels += n * n;
        for (let i = 0; i < n * n; ++i) taken.add((y + Math.floor(i / n)) * width + x + (i % n));
      }
      expect(taken.size).toBe(texels);
    }
  });

  test("has each texel inside of its border, and the mean of three at corners", () => {
    const size = 4;
    const pixels = new Uint8Array(4 * 144);
    for (let i = 0; i < 144; ++i) pixels[4 * i] = i;
    const alpha = assembleAlpha(pixels, size, "cube");
    const { width, height } = assemblyOf(size, "cube");
    for (let level = 0; level < 3; ++level) {
      const n = size >> level;
      const from = sourcePlace(size, level, "cube");
      const to = layerPlace(size, level);
      for (let face = 0; face < 6; ++face) {
        const at = (row: number, column: number) =>
          alpha[(face * height + to.y + 1 + row) * width + to.x + 1 + column];
        for (let i = 0; i < n * n; ++i) {
          const [row, column] = [Math.floor(i / n), i % n];
          const place = (from.y + Math.floor(face / 3) * n + row) * 12 + from.x + (face % 3) * n + column;
          expect(at(row, column)).toBe(place);
        }
        expect(at(-1, -1)).toBe(Math.round((at(0, 0) + at(-1, 0) + at(0, -1)) / 3));
      }
    }
  });

  test("of a paraboloid has each texel, and around it the last ones again", () => {
    const size = 4;
    const { width: columns, height: rows } = atlasSize(size, "paraboloid");
    const pixels = new Uint8Array(4 * columns * rows);
    for (let i = 0; i < columns * rows; ++i) pixels[4 * i] = i;
    const alpha = assembleAlpha(pixels, size, "paraboloid");
    const { width, height, corners } = assemblyOf(size, "paraboloid");
    expect(alpha.length).toBe(2 * width * height);
    expect(corners.length).toBe(0);
    for (let level = 0; level < 3; ++level) {
      const n = size >> level;
      const from = sourcePlace(size, level, "paraboloid");
      const to = layerPlace(size, level);
      for (let face = 0; face < 2; ++face) {
        for (let row = -1; row <= n; ++row) {
          for (let column = -1; column <= n; ++column) {
            const inside = (i: number) => Math.min(Math.max(i, 0), n - 1);
            const place = (from.y + inside(row)) * columns + from.x + face * n + inside(column);
            const at = (face * height + to.y + 1 + row) * width + to.x + 1 + column;
            expect(alpha[at]).toBe(place);
          }
        }
      }
    }
  });

  test("of one colour is that colour everywhere, borders and corners included", () => {
    const table = radianceTable({ low: -7, high: 4, epsilon: 2 ** -7 });
    const layers = assembleRadiance(new Uint8Array(4 * 24 * 24).fill(128), 8, "cube", table);
    const { source, corners } = assemblyOf(8, "cube");
    const expected = packSharedExponent(table[128], table[128], table[128]);
    for (let i = 0; i < source.length; ++i) if (source[i] >= 0) expect(layers[i]).toBe(expected);
    for (let i = 0; i < corners.length; i += 4) expect(layers[corners[i]]).toBe(expected);
  });
});

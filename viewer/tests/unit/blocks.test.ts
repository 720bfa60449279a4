import { gzipSync } from "node:zlib";
import { expect, test } from "vitest";
import { decodeBlocks, keptPixels, replaceBlocks } from "../../src/blocks";
import { UserError } from "../../src/errors";

const MAPS = [
  { name: "a", size: 4, opaque: true },
  { name: "b", size: 8, opaque: true },
];

const bytesOf = (bytes: number[]) => new Uint8Array(gzipSync(Uint8Array.from(bytes))).buffer;

test("the blocks of every map are told apart: of 12² pixels 9, of 24² 36, each from a byte of its own", async () => {
  const [a, b] = await decodeBlocks("blocks", bytesOf([1, 2, 3, 4, 5, 6, 7]), MAPS, "cube");
  expect([...a]).toEqual([1, 2]);
  expect([...b]).toEqual([3, 4, 5, 6, 7]);
});

test("a file of blocks that is damaged is told by its name", async () => {
  for (const file of [bytesOf([1, 2, 3]), new ArrayBuffer(0), Uint8Array.from([1, 2, 3]).buffer]) {
    await expect(decodeBlocks("samples/0/blocks", file, MAPS, "cube")).rejects.toThrow(UserError);
    await expect(decodeBlocks("samples/0/blocks", file, MAPS, "cube")).rejects.toThrow("samples/0/blocks");
  }
});

test("pixels outside of an image's own blocks are those of the kept one", () => {
  const width = 10;
  const height = 6;
  const base = new Uint8ClampedArray(4 * width * height).fill(7);
  for (const channels of [1, 3]) {
    const pixels = new Uint8ClampedArray(4 * width * height).fill(200);
    // Three blocks a row: the second of the first row and the last of the second.
    replaceBlocks(pixels, width, height, Uint8Array.from([0b01000100]), keptPixels(base, channels), channels);
    for (let y = 0; y < height; ++y) {
      for (let x = 0; x < width; ++x) {
        const own = y < 4 ? x >= 4 && x < 8 : x >= 8;
        for (let c = 0; c < 4; ++c) {
          expect(pixels[4 * (y * width + x) + c]).toBe(own || c >= channels ? 200 : 7);
        }
      }
    }
  }
});

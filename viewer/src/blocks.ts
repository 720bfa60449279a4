/// Images of which only some blocks are a sample's own; the others are those of the static set (blocks.py).

import { atlasSize } from "./atlas";
import { UserError } from "./errors";
import type { MapEntry } from "./manifest";
import { inflate } from "./mesh";
import type { Projection } from "./projection";

/// Pixels along a side.
const BLOCK = 4;

function blockCounts(width: number, height: number): { across: number; down: number } {
  return { across: Math.ceil(width / BLOCK), down: Math.ceil(height / BLOCK) };
}

/// The blocks of each map of a sample, a bit each, rows from the top and the highest bit first.
export async function decodeBlocks(
  name: string,
  file: ArrayBuffer,
  maps: MapEntry[],
  projection: Projection,
): Promise<Uint8Array[]> {
  const counts = maps.map(({ size }) => {
    const { width, height } = atlasSize(size, projection);
    const { across, down } = blockCounts(width, height);
    return Math.ceil((across * down) / 8);
  });
  const bits = await inflate(file).catch(() => new Uint8Array(0));
  if (bits.length !== counts.reduce((sum, count) => sum + count, 0)) {
    throw new UserError("damaged", `The file ${name} is damaged: it has another length than it should.`);
  }
  let end = 0;
  return counts.map((count) => {
    end += count;
    return bits.slice(end - count, end);
  });
}

/// The first channels of RGBA pixels.
export function keptPixels(pixels: Uint8ClampedArray, channels: number): Uint8Array {
  const kept = new Uint8Array((pixels.length / 4) * channels);
  for (let i = 0; i < kept.length / channels; ++i) {
    for (let c = 0; c < channels; ++c) kept[channels * i + c] = pixels[4 * i + c];
  }
  return kept;
}

/// Puts pixels of `base` where an image has no blocks of its own.
export function replaceBlocks(
  pixels: Uint8ClampedArray,
  width: number,
  height: number,
  blocks: Uint8Array,
  base: Uint8Array,
  channels: number,
): void {
  const { across } = blockCounts(width, height);
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      const block = Math.floor(y / BLOCK) * across + Math.floor(x / BLOCK);
      if ((blocks[block >> 3] >> (7 - (block & 7))) & 1) continue;
      const at = y * width + x;
      for (let c = 0; c < channels; ++c) pixels[4 * at + c] = base[channels * at + c];
    }
  }
}

/// Decodes images away from the page's own thread, and expands their codes before anything is filtered.

import { assembleAlpha, assembleRadiance, atlasSize, packSharedExponent, radianceTable } from "./atlas";
import { keptPixels, replaceBlocks } from "./blocks";
import type { Decoded, DecodeRequest } from "./decoder";

const MOST_PIXELS = 1 << 26;

/// Images of the static set, without the channels that they do not use.
const kept = new Map<string, Uint8Array>();

async function pixelsOf(bytes: ArrayBuffer, type: string): Promise<ImageData> {
  const bitmap = await createImageBitmap(new Blob([bytes], { type }), {
    colorSpaceConversion: "none",
    premultiplyAlpha: "none",
  });
  if (bitmap.width * bitmap.height > MOST_PIXELS) {
    throw new Error(`is ${bitmap.width}×${bitmap.height} pixels`);
  }
  const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
  const context = canvas.getContext("2d", { willReadFrequently: true });
  if (!context) throw new Error("no 2D canvas");
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  return context.getImageData(0, 0, canvas.width, canvas.height);
}

async function decode(request: DecodeRequest): Promise<Decoded> {
  const image = await pixelsOf(request.bytes, request.type);
  const { width, height, data } = image;
  if (request.kind === "probe") {
    const colours = [];
    for (let x = 4; x < width; x += 8) {
      const at = 4 * (4 * width + x);
      colours.push([data[at], data[at + 1], data[at + 2]]);
    }
    return { width, height, colours };
  }
  if (request.kind === "still") {
    const table = radianceTable(request.code);
    const packed = new Uint32Array(width * height);
    for (let i = 0; i < packed.length; ++i) {
      packed[i] = packSharedExponent(table[data[4 * i]], table[data[4 * i + 1]], table[data[4 * i + 2]]);
    }
    return { width, height, packed };
  }
  if (request.kind === "texture") return { width, height, pixels: new Uint8Array(data.buffer) };
  const { size, projection } = request;
  const expected = atlasSize(size, projection);
  if (width !== expected.width || height !== expected.height) {
    throw new Error(`is ${width}×${height} pixels, not ${expected.width}×${expected.height}`);
  }
  const channels = request.kind === "alpha" ? 1 : 3;
  if (request.keep) kept.set(request.keep, keptPixels(data, channels));
  if (request.base && request.blocks) {
    const base = kept.get(request.base);
    if (!base) throw new Error(`needs ${request.base}, which is not there`);
    replaceBlocks(data, width, height, request.blocks, base, channels);
  }
  if (request.kind === "alpha") return { width, height, alpha: assembleAlpha(data, size, projection) };
  const packed = assembleRadiance(data, size, projection, radianceTable(request.code));
  return { width, height, packed };
}

self.onmessage = async (event: MessageEvent<DecodeRequest & { id: number }>) => {
  const { id } = event.data;
  try {
    const result = await decode(event.data);
    const owned = [result.packed?.buffer, result.alpha?.buffer, result.pixels?.buffer].filter(
      (b) => b !== undefined,
    );
    self.postMessage({ id, result }, { transfer: owned as Transferable[] });
  } catch (failure) {
    self.postMessage({ id, failure: failure instanceof Error ? failure.message : String(failure) });
  }
};

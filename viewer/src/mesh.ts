/// The mesh file (mesh_file.py): gzip over arrays whose bytes are sorted by significance.

import { UserError } from "./errors";
import type { Manifest, MeshArray } from "./manifest";

export interface Mesh {
  positions: Uint16Array;
  normals: Int16Array | null;
  uvs: Uint16Array | null;
  colors: Uint16Array | null;
  /// Of each vertex the direction of u on an octahedron and the sign of the bitangent, or zeros.
  tangents: Int16Array | null;
  /// Half floats: three for each vertex, or six with those of the back. Of a lightmap three for each texel of the fronts, then
  /// for each of the backs.
  irradiance: Uint16Array | null;
  indices: Uint32Array;
}

/// What gzip made smaller.
export async function inflate(bytes: ArrayBuffer): Promise<Uint8Array> {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const BYTES = { uint16: 2, int16: 2, float16: 2, int32: 4 };

/// An array whose components lie one after the other in planes of bytes, put back in order.
export function gather(payload: Uint8Array, array: MeshArray): ArrayBuffer {
  const { components, count, offset } = array;
  const size = BYTES[array.type];
  if (!size || !(count >= 0) || !(components >= 1) || offset + size * components * count > payload.length) {
    throw new UserError("damaged", "The mesh's file is damaged: an array reaches beyond its end.");
  }
  const result = new Uint8Array(size * components * count);
  for (let c = 0; c < components; ++c) {
    for (let b = 0; b < size; ++b) {
      let from = offset + (c * size + b) * count;
      for (let to = c * size + b; to < result.length; to += components * size) result[to] = payload[from++];
    }
  }
  return result.buffer;
}

/// Numbers from what each adds to the one before, modulo their range, in place.
function summed<T extends Uint16Array | Int16Array | Int32Array>(values: T, components: number): T {
  for (let i = components; i < values.length; ++i) values[i] += values[i - components];
  return values;
}

export async function decodeMesh(file: ArrayBuffer, mesh: Manifest["mesh"]): Promise<Mesh> {
  let payload: Uint8Array;
  try {
    payload = await inflate(file);
  } catch {
    throw new UserError("damaged", "The mesh's file is damaged: it does not decompress.");
  }
  if (payload.length !== mesh.bytes) {
    throw new UserError("damaged", "The mesh's file is damaged: it has another length than it should.");
  }
  const { positions, indices, normals, uvs, colors, tangents, irradiance } = mesh.arrays;
  const result = new Uint32Array(summed(new Int32Array(gather(payload, indices)), 1));
  if (result.some((index) => index >= positions.count)) {
    throw new UserError(
      "damaged",
      "The mesh's file is damaged: a triangle has a vertex that does not exist.",
    );
  }
  return {
    positions: summed(new Uint16Array(gather(payload, positions)), 3),
    normals: normals ? summed(new Int16Array(gather(payload, normals)), 2) : null,
    uvs: uvs ? summed(new Uint16Array(gather(payload, uvs)), 2) : null,
    colors: colors ? summed(new Uint16Array(gather(payload, colors)), 3) : null,
    tangents: tangents ? summed(new Int16Array(gather(payload, tangents)), 3) : null,
    irradiance: irradiance
      ? mesh.lightmap === null
        ? new Uint16Array(gather(payload, irradiance))
        : sidesApart(payload, irradiance, irradiance.count)
      : null,
    indices: result,
  };
}

/// Irradiance of three half floats for each vertex or texel of the fronts, filled up to `padded` of them, then of the backs.
function sidesApart(payload: Uint8Array, array: MeshArray, padded: number): Uint16Array {
  const { components, count, offset } = array;
  const values = new Uint16Array(components * padded);
  for (let side = 0; side < components / 3; ++side) {
    const own: MeshArray = { type: "float16", components: 3, count, offset: offset + 6 * side * count };
    values.set(new Uint16Array(gather(payload, own)), 3 * side * padded);
  }
  return values;
}

/// The irradiance of a sample, which is one like the mesh's `array`, with the sides apart.
export async function decodeIrradiance(
  name: string,
  file: ArrayBuffer,
  array: MeshArray,
  padded: number,
): Promise<Uint16Array> {
  const damaged = new UserError(
    "damaged",
    `The file ${name} is damaged: it has another length than it should.`,
  );
  let payload: Uint8Array;
  try {
    payload = await inflate(file);
  } catch {
    throw damaged;
  }
  if (payload.length !== 2 * array.components * array.count) throw damaged;
  return sidesApart(payload, { ...array, offset: 0 }, padded);
}

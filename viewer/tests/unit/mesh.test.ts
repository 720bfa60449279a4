import { gzipSync } from "node:zlib";
import { expect, test } from "vitest";
import type { Manifest, MeshArray } from "../../src/manifest";
import { decodeIrradiance, decodeMesh } from "../../src/mesh";

/// Component after component, and of each first all low bytes, as mesh_file.py writes them.
function planes(components: number[][]): number[] {
  return components.flatMap((values) => [...values.map((v) => v & 255), ...values.map((v) => v >> 8)]);
}

const compressed = (bytes: number[]) => Uint8Array.from(gzipSync(Uint8Array.from(bytes))).buffer;

/// Four texels of fronts and backs.
const TEXELS = [0x3c00, 0x4000, 0x4200, 0x4400];
const SIDES = [0, 1, 2, 3, 4, 5].map((component) => TEXELS.map((texel) => texel + component));
/// What the page has: three numbers a texel, the fronts and then the backs.
const fronts = TEXELS.flatMap((texel) => [texel, texel + 1, texel + 2]);
const backs = TEXELS.flatMap((texel) => [texel + 3, texel + 4, texel + 5]);

const irradiance: MeshArray = { type: "float16", components: 6, count: 4, offset: 0 };

test("a sample's irradiance has the fronts first and then the backs, each filled up", async () => {
  const file = compressed(planes(SIDES));
  expect([...(await decodeIrradiance("a", file, irradiance, 4))]).toEqual([...fronts, ...backs]);
  const zeros = [0, 0, 0];
  expect([...(await decodeIrradiance("a", file, irradiance, 5))]).toEqual([
    ...fronts,
    ...zeros,
    ...backs,
    ...zeros,
  ]);
});

test("a sample's irradiance of another length is refused", async () => {
  for (const bytes of [planes(SIDES).slice(1), [...planes(SIDES), 0], []]) {
    await expect(decodeIrradiance("samples/a", compressed(bytes), irradiance, 4)).rejects.toThrow(
      /samples\/a is damaged/,
    );
  }
  await expect(decodeIrradiance("samples/a", new ArrayBuffer(9), irradiance, 4)).rejects.toThrow(/damaged/);
});

/// A mesh of a triangle with irradiance of both sides.
function triangle(lightmap: number | null): { file: ArrayBuffer; mesh: Manifest["mesh"] } {
  const bytes = [...planes([0, 1, 2].map(() => [0, 9, 9])), ...Array(12).fill(0), ...planes(SIDES)];
  const mesh = {
    arrays: {
      positions: { type: "uint16", components: 3, count: 3, offset: 0 },
      indices: { type: "int32", components: 1, count: 3, offset: 18 },
      irradiance: { ...irradiance, offset: 30 },
    },
    lightmap,
    bytes: bytes.length,
  } as unknown as Manifest["mesh"];
  return { file: compressed(bytes), mesh };
}

test("texels of a lightmap are apart by sides, values of vertices are together", async () => {
  const map = triangle(2);
  expect([...((await decodeMesh(map.file, map.mesh)).irradiance ?? [])]).toEqual([...fronts, ...backs]);
  const vertices = triangle(null);
  expect([...((await decodeMesh(vertices.file, vertices.mesh)).irradiance ?? [])]).toEqual(
    TEXELS.flatMap((texel) => [0, 1, 2, 3, 4, 5].map((component) => texel + component)),
  );
});

test("a lightmap that reaches beyond the file is refused", async () => {
  const { file, mesh } = triangle(2);
  mesh.arrays.irradiance.count = 64;
  await expect(decodeMesh(file, mesh)).rejects.toThrow(/an array reaches beyond its end/);
});

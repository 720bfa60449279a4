import { expect, test } from "vitest";
import { UserError } from "../../src/errors";
import { irradianceChanges, type Manifest, parseManifest, shellNames } from "../../src/manifest";

const infinite = { shape: "infinite", origin: [0, 0, 0] };
const box = {
  shape: "box",
  origin: [0, 0, 0],
  centre: [0, 1, 0],
  axes: [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ],
  half_extent: [2, 1, 2],
};
const array = (components: number, count: number, offset: number) => ({
  type: "uint16",
  components,
  count,
  offset,
});

/// A manifest as web.py writes it, of two samples, three shells, a static set and a lightmap.
function sound() {
  return structuredClone(written());
}

function written() {
  const maps = (folder: string) => [
    { radiance: `${folder}/0`, alpha: `${folder}/0.alpha` },
    { radiance: `${folder}/1`, alpha: `${folder}/1.alpha` },
    { radiance: `${folder}/2`, alpha: null },
  ];
  return {
    format: "mirrorbake-web",
    version: 6,
    library: "0.1.0",
    title: "teapot",
    notes: [],
    runTime: { name: "Web", places: [[0.5, 0.5]], footprintScale: 0.5, filter: "anisotropic", maxTaps: 4 },
    axes: [{ name: "arc", values: [0, 1], low: 0, high: 1, period: null }],
    motion: null,
    camera: {
      kind: "arc",
      target: [0, 0, 0],
      radius: 1,
      height: 0.3,
      startDegrees: 0,
      degrees: 20,
      azimuths: [0, 20],
      elevations: [17, 17],
      verticalFovDegrees: 30,
      aspect: 1.5,
      pixels: 240,
    },
    materials: [
      {
        name: "shiny",
        specular: true,
        fresnel: "schlick",
        r0: [1, 1, 1],
        eta: [1, 1, 1],
        k: [0, 0, 0],
        coated: false,
        albedo: [0, 0, 0],
        albedoTexture: { texture: 0, matrix: [1, 0, 0, 0, 1, 0] },
        reflectanceTexture: null,
        normalTexture: null,
        normalScale: 1,
        colorsTintReflectance: false,
      },
    ],
    textures: [{ image: "textures/0", wrap: ["repeat", "clamp"], linear: false }],
    radiance: { low: -7, high: 3, epsilon: 0.01 },
    images: { suffix: ".avif", type: "image/avif", exact: false, fallback: false },
    probe: { file: "probe.avif", colours: [[0, 0, 0]] },
    poster: { file: "poster.avif", type: "image/avif" },
    mesh: {
      file: "mesh.bin.gz",
      bounds: { low: [0, 0, 0], high: [1, 1, 1] },
      uvBounds: { low: [0, 0], high: [1, 1] },
      arrays: {
        positions: array(3, 9, 0),
        indices: { ...array(1, 9, 54), type: "int32" },
        uvs: array(2, 9, 90),
        irradiance: { ...array(6, 64, 126), type: "float16" },
      },
      ranges: [{ part: 0, material: 0, start: 0, stacked: 1, count: 3 }],
      lightmap: 8,
      bytes: 894,
    },
    projection: "paraboloid",
    maps: [
      { name: "a", size: 8, opaque: false },
      { name: "b", size: 8, opaque: false },
      { name: "c", size: 8, opaque: true },
    ],
    parts: [
      {
        name: "body",
        shells: [
          { name: "local", map: 0, proxy: infinite, moves: true, onHull: false },
          { name: "ground", map: 1, proxy: box, moves: false, onHull: true },
          { name: "distant", map: 2, proxy: box, moves: false, onHull: true },
        ],
      },
      { name: "lid", shells: [{ name: "distant", map: 2, proxy: box, moves: false, onHull: true }] },
    ],
    static: { image: "static/capture", size: 8, proxy: box, maps: maps("static"), fadeDegrees: 4 },
    samples: [0, 1].map((k) => ({
      parameter: [k],
      maps: maps(`samples/0000${k}`),
      blocks: null,
      still: `samples/0000${k}/still`,
      irradiance: `samples/0000${k}/irradiance.bin.gz`,
    })),
    first: 1,
  };
}

const parse = (data: unknown) => parseManifest(JSON.stringify(data));

test("a manifest as it is written is taken, with the names of all shells once", () => {
  const manifest: Manifest = parse(sound());
  expect(shellNames(manifest)).toEqual(["local", "ground", "distant"]);
});

type Path = (string | number)[];

function placesOf(value: unknown, path: Path = []): Path[] {
  const here = path.length > 0 ? [path] : [];
  if (typeof value !== "object" || value === null) return here;
  return here.concat(
    Object.entries(value).flatMap(([key, inner]) =>
      placesOf(inner, [...path, Array.isArray(value) ? Number(key) : key]),
    ),
  );
}

// biome-ignore lint/suspicious/noExplicitAny: walks a value of any shape
function holderOf(data: any, path: Path): any {
  return path.slice(0, -1).reduce((holder, step) => holder[step], data);
}

const HOSTILE = [null, -1, 1e300, 2 ** 31, 0.5, "", "../../etc/passwd", "/etc/passwd", [], {}, [[]], true];

test("whatever one entry is replaced by, the answer is a sentence or a manifest, never another failure", {
  timeout: 60000,
}, () => {
  let refused = 0;
  let tried = 0;
  for (const path of placesOf(sound())) {
    for (const value of [...HOSTILE, undefined]) {
      const data = sound();
      holderOf(data, path)[path[path.length - 1]] = value;
      ++tried;
      try {
        parse(data);
      } catch (failure) {
        const what = `${path.join(".")} = ${JSON.stringify(value)}: ${failure}`;
        expect(failure, what).toBeInstanceOf(UserError);
        expect((failure as UserError).message, what).toMatch(/manifest\.json is damaged|version|dimensions/);
        ++refused;
      }
    }
  }
  expect(tried).toBeGreaterThan(2000);
  expect(refused).toBeGreaterThan(0.6 * tried);
});

const NAMES: Path[] = [
  ["samples", 0, "maps", 0, "radiance"],
  ["samples", 0, "maps", 0, "alpha"],
  ["samples", 1, "still"],
  ["samples", 1, "blocks"],
  ["samples", 0, "irradiance"],
  ["static", "image"],
  ["static", "maps", 1, "radiance"],
  ["textures", 0, "image"],
  ["mesh", "file"],
  ["probe", "file"],
  ["poster", "file"],
];

test("no name of a file leads out of the folder", () => {
  for (const path of NAMES) {
    for (const name of ["../x", "a/../../x", "/x", "https://evil.example/x", "a\\..\\x", "%2e%2e/x", "a b"]) {
      const data = sound();
      holderOf(data, path)[path[path.length - 1]] = name;
      expect(() => parse(data), `${path.join(".")} = ${name}`).toThrow(/damaged/);
    }
  }
});

test("sizes that no map can have are refused", () => {
  for (const size of [0, -8, 7, 1 << 20, 1e9, 0.5, "8", null]) {
    const data = sound();
    holderOf(data, ["maps", 0, "size"]).size = size;
    expect(() => parse(data)).toThrow(/the size of the map a/);
    const other = sound();
    holderOf(other, ["static", "size"]).size = size;
    expect(() => parse(other)).toThrow(/damaged/);
  }
});

test("a lightmap has a size, as many texels as that, and coordinates to be read at", () => {
  const refused = (change: (mesh: Manifest["mesh"]) => void, sentence: RegExp) => {
    const data = sound();
    change(data.mesh as unknown as Manifest["mesh"]);
    expect(() => parse(data)).toThrow(sentence);
  };
  expect(parse(sound()).mesh.lightmap).toBe(8);
  for (const size of [0, 7, -8, 8192, 0.5, "8", undefined]) {
    refused((mesh) => Object.assign(mesh, { lightmap: size }), /the size of the lightmap is/);
  }
  refused((mesh) => Object.assign(mesh, { lightmap: 16 }), /irradiance is not described/);
  refused((mesh) => Object.assign(mesh.arrays.irradiance, { count: 63 }), /irradiance is not described/);
  refused((mesh) => Object.assign(mesh.arrays.irradiance, { components: 4 }), /irradiance is not described/);
  refused((mesh) => Object.assign(mesh.arrays.irradiance, { type: "int16" }), /irradiance is not described/);
  refused((mesh) => delete mesh.arrays.irradiance, /a lightmap without texels/);
  refused((mesh) => delete mesh.arrays.uvs, /a lightmap and no texture coordinates/);
  refused((mesh) => delete mesh.uvBounds, /coordinates have no bounds/);
  // At the vertices there is one for each.
  refused((mesh) => Object.assign(mesh, { lightmap: null }), /irradiance is not described/);
});

test("the irradiance changes in all samples or in none", () => {
  const none = sound();
  for (const sample of none.samples) Object.assign(sample, { irradiance: null });
  expect(irradianceChanges(parse(none))).toBe(false);
  expect(irradianceChanges(parse(sound()))).toBe(true);
  const some = sound();
  Object.assign(some.samples[1], { irradiance: null });
  expect(() => parse(some)).toThrow(/an irradiance is missing/);
});

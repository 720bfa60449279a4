/// The manifest of a PEM on the web (docs/reference/web-format.md), checked: it may come from anywhere.

import type { RadianceCode } from "./atlas";
import { UserError } from "./errors";
import { isVector } from "./math";
import { PROJECTIONS, type Projection } from "./projection";
import { isProxy, type ProxyShape } from "./proxy";

export type Vec3 = [number, number, number];

/// A map that there is once for every sample, whichever shells read it.
export interface MapEntry {
  name: string;
  size: number;
  opaque: boolean;
}

export interface Shell {
  name: string;
  /// Number of the map that lies on it.
  map: number;
  proxy: ProxyShape;
  /// Whether the proxy moves with the object.
  moves: boolean;
  /// Whether triangles on the object's convex hull read it.
  onHull: boolean;
}

export interface TextureUse {
  texture: number;
  /// Rows of the 2×3 matrix from the mesh's coordinates to the image's.
  matrix: number[];
}

export interface Material {
  name: string;
  specular: boolean;
  fresnel: "constant" | "schlick" | "dielectric" | "conductor";
  r0: Vec3;
  eta: Vec3;
  k: Vec3;
  coated: boolean;
  albedo: Vec3;
  albedoTexture: TextureUse | null;
  reflectanceTexture: TextureUse | null;
  normalTexture: TextureUse | null;
  normalScale: number;
  colorsTintReflectance: boolean;
}

export interface TextureImage {
  image: string;
  wrap: ["repeat" | "clamp" | "mirror", "repeat" | "clamp" | "mirror"];
  /// Whether it holds numbers, not colours.
  linear: boolean;
}

/// Triangles of one part and one material, those first that carry all shells.
export interface Range {
  part: number;
  material: number;
  start: number;
  stacked: number;
  count: number;
}

export interface MapFiles {
  radiance: string;
  alpha: string | null;
}

export interface Sample {
  parameter: number[];
  maps: MapFiles[];
  /// File that says which blocks of its images are the sample's own; all others are the static set's. null: all are its own.
  blocks: string | null;
  still: string | null;
  /// File of the irradiance, as the mesh has it, if it changes from sample to sample.
  irradiance: string | null;
}

/// One dimension of the parameter space; samples are at the grid of all axes' values, the last axis running fastest.
export interface Axis {
  name: string;
  values: number[];
  low: number;
  high: number;
  period: number | null;
}

export interface MeshArray {
  type: "uint16" | "int16" | "int32" | "float16";
  components: number;
  count: number;
  offset: number;
}

export interface Manifest {
  title: string;
  library: string;
  notes: string[];
  runTime: {
    name: string;
    places: [number, number][];
    footprintScale: number;
    filter: "nearest" | "bilinear" | "trilinear" | "anisotropic";
    maxTaps: number;
  };
  axes: Axis[];
  motion: { to: Vec3; turn: number; pivot: Vec3 } | null;
  camera: {
    kind: "arc" | "dome" | "fixed";
    target: Vec3;
    radius: number;
    height: number;
    startDegrees: number;
    degrees: number;
    /// Of all cameras, the lowest and the highest.
    azimuths: [number, number];
    elevations: [number, number];
    verticalFovDegrees: number;
    aspect: number;
    pixels: number;
  };
  materials: Material[];
  textures: TextureImage[];
  radiance: RadianceCode;
  images: { suffix: string; type: string; exact: boolean; fallback: boolean };
  probe: { file: string; colours: number[][] };
  poster: { file: string; type: string };
  mesh: {
    file: string;
    bounds: { low: Vec3; high: Vec3 };
    uvBounds?: { low: [number, number]; high: [number, number] };
    arrays: { [name: string]: MeshArray };
    ranges: Range[];
    /// Texels along a side of the map on the texture coordinates that irradiance is; null: it is at the vertices.
    lightmap: number | null;
    bytes: number;
  };
  projection: Projection;
  maps: MapEntry[];
  parts: { name: string; shells: Shell[] }[];
  static: {
    image: string;
    size: number;
    proxy: ProxyShape;
    /// The static set, drawn far from the samples, and how many degrees beyond them it is half of what is drawn.
    maps: MapFiles[] | null;
    fadeDegrees: number | null;
  };
  samples: Sample[];
  first: number;
}

const VERSION = 6;

const LARGEST_MESH = 1 << 30;

function damaged(what: string): never {
  throw new UserError("damaged", `The file manifest.json is damaged: ${what}.`);
}

function isSize(n: unknown): n is number {
  return typeof n === "number" && n >= 1 && n <= 4096 && Number.isInteger(Math.log2(n));
}

function isName(name: unknown): name is string {
  return (
    typeof name === "string" &&
    /^[\w.\-/]+$/.test(name) &&
    !name.startsWith("/") &&
    !name.split("/").includes("..")
  );
}

function checkProxy(proxy: ProxyShape, where: string): void {
  if (!isProxy(proxy)) damaged(`the geometry of ${where} is not one that this page knows`);
}

function checkAxes(data: Manifest): void {
  const valid =
    Array.isArray(data.axes) &&
    data.axes.every(
      (axis) =>
        typeof axis.name === "string" &&
        Array.isArray(axis.values) &&
        axis.values.length >= 1 &&
        axis.values.every((v, i) => Number.isFinite(v) && (i === 0 || v > axis.values[i - 1])) &&
        Number.isFinite(axis.low) &&
        Number.isFinite(axis.high) &&
        (axis.period === null || axis.period > 0),
    );
  if (!valid) damaged("its axes are not rising numbers");
  if (data.axes.filter((axis) => axis.values.length > 1).length > 3) {
    throw new UserError(
      "version",
      "This PEM has more than three dimensions; this page blends at most three.",
    );
  }
  if (data.axes.reduce((n, axis) => n * axis.values.length, 1) !== data.samples.length) {
    damaged("it has another number of samples than its axes say");
  }
}

function checkMaterials(data: Manifest): void {
  const { materials, textures } = data;
  const fits = (use: TextureUse | null) =>
    use === null ||
    (isIndex(use?.texture, textures.length) &&
      Array.isArray(use.matrix) &&
      use.matrix.length === 6 &&
      use.matrix.every(Number.isFinite));
  const valid =
    Array.isArray(textures) &&
    textures.every((t) => isName(t.image) && Array.isArray(t.wrap) && t.wrap.length === 2) &&
    Array.isArray(materials) &&
    materials.length >= 1 &&
    materials.every(
      (m) =>
        [m.r0, m.eta, m.k, m.albedo].every(isVector) &&
        fits(m.albedoTexture) &&
        fits(m.reflectanceTexture) &&
        fits(m.normalTexture),
    );
  if (!valid) damaged("its materials are not described");
}

function isIndex(i: unknown, count: number): i is number {
  return Number.isInteger(i) && (i as number) >= 0 && (i as number) < count;
}

function checkMesh(data: Manifest): void {
  const { mesh, parts, materials } = data;
  if (!isName(mesh?.file) || !(mesh.bytes >= 0 && mesh.bytes <= LARGEST_MESH))
    damaged("the mesh is not described");
  for (const name of ["positions", "indices"]) {
    if (!mesh.arrays?.[name]) damaged(`the mesh has no ${name}`);
  }
  if (!isVector(mesh.bounds?.low) || !isVector(mesh.bounds?.high)) damaged("the mesh has no bounds");
  const triangles = Math.floor(mesh.arrays.indices.count / 3) + 1;
  const valid =
    Array.isArray(mesh.ranges) &&
    mesh.ranges.every(
      (range) =>
        isIndex(range.part, parts.length) &&
        isIndex(range.material, materials.length) &&
        isIndex(range.start, triangles) &&
        isIndex(range.start + range.count, triangles) &&
        isIndex(range.stacked, range.count + 1),
    );
  if (!valid) damaged("the mesh has other parts");
  checkIrradiance(data);
}

function checkIrradiance(data: Manifest): void {
  const { lightmap, arrays, uvBounds } = data.mesh;
  const { irradiance, positions, uvs } = arrays;
  const isPair = (pair: unknown) => Array.isArray(pair) && pair.length === 2 && pair.every(Number.isFinite);
  if (uvs && !(isPair(uvBounds?.low) && isPair(uvBounds?.high)))
    damaged("the mesh's texture coordinates have no bounds");
  if (lightmap !== null) {
    if (!isSize(lightmap)) damaged(`the size of the lightmap is ${lightmap}`);
    if (!irradiance) damaged("the mesh has a lightmap without texels");
    if (!uvs) damaged("the mesh has a lightmap and no texture coordinates");
  }
  const texels = lightmap === null ? positions.count : lightmap ** 2;
  const isWhole =
    irradiance?.type === "float16" &&
    irradiance.count === texels &&
    (irradiance.components === 3 || irradiance.components === 6);
  if (irradiance && !isWhole) damaged("the mesh's irradiance is not described");
  const count = data.samples.filter((sample) => sample.irradiance !== null).length;
  if (count !== 0 && !(irradiance && count === data.samples.length))
    damaged("an irradiance is missing that others have");
}

const MOST_PARTS = 65535;
const MOST_SHELLS = 64;

function checkMaps(data: Manifest): void {
  if (!Object.hasOwn(PROJECTIONS, data.projection))
    damaged(`this page knows no maps of the projection ${data.projection}`);
  if (!Array.isArray(data.maps) || data.maps.length < 1) damaged("it has no maps");
  for (const map of data.maps) {
    if (!isSize(map?.size)) damaged(`the size of the map ${map?.name} is ${map?.size}`);
    if (typeof map.opaque !== "boolean") damaged(`the map ${map.name} is not described`);
  }
  if (data.parts.length > MOST_PARTS) damaged(`it has ${data.parts.length} parts`);
  for (const part of data.parts) {
    const shells = part?.shells;
    if (!Array.isArray(shells) || shells.length < 1 || shells.length > MOST_SHELLS)
      damaged(`part ${part?.name} has no shells`);
    shells.forEach((shell, s) => {
      if (!isIndex(shell?.map, data.maps.length)) damaged(`shell ${shell?.name} has no map`);
      if (data.maps[shell.map].opaque !== (s === shells.length - 1))
        damaged(`shell ${shell.name} has a map that is not for its place`);
      checkProxy(shell.proxy, `shell ${shell.name}`);
    });
  }
}

function areMaps(files: unknown, maps: MapEntry[]): boolean {
  return (
    Array.isArray(files) &&
    files.length === maps.length &&
    files.every((f, m) => isName(f?.radiance) && (maps[m].opaque ? f.alpha === null : isName(f.alpha)))
  );
}

function checkCamera(data: Manifest): void {
  const { camera } = data;
  const isRange = (range: unknown) =>
    Array.isArray(range) && range.length === 2 && range.every(Number.isFinite) && range[0] <= range[1];
  const valid =
    isVector(camera?.target) &&
    [camera.radius, camera.height, camera.startDegrees, camera.degrees].every(Number.isFinite) &&
    camera.radius >= 0 &&
    isRange(camera.azimuths) &&
    isRange(camera.elevations) &&
    camera.verticalFovDegrees > 0 &&
    camera.verticalFovDegrees < 180 &&
    Number.isFinite(camera.aspect) &&
    camera.aspect > 0;
  if (!valid) damaged("it has no camera");
}

/// Whether the irradiance changes from sample to sample.
export function irradianceChanges(manifest: Manifest): boolean {
  return manifest.samples[0].irradiance !== null;
}

/// How many sides of the mesh have an irradiance of their own: 2 where light reaches the backs of its triangles.
export function litSides(manifest: Manifest): number {
  return (manifest.mesh.arrays.irradiance?.components ?? 3) / 3;
}

/// Names of the shells of all parts, each once: what can be switched on and off.
export function shellNames(manifest: Manifest): string[] {
  return [...new Set(manifest.parts.flatMap((part) => part.shells.map((shell) => shell.name)))];
}

const FILTERS = ["nearest", "bilinear", "trilinear", "anisotropic"];
const TYPES = ["uint16", "int16", "int32", "float16"];

function checkRunTime(data: Manifest): void {
  const { runTime, radiance } = data;
  const isPlace = (place: unknown) =>
    Array.isArray(place) && place.length === 2 && place.every(Number.isFinite);
  const reads =
    Array.isArray(runTime?.places) &&
    runTime.places.length >= 1 &&
    runTime.places.length <= 64 &&
    runTime.places.every(isPlace) &&
    runTime.footprintScale > 0 &&
    FILTERS.includes(runTime.filter) &&
    isIndex(runTime.maxTaps, 17);
  if (!reads) damaged("it has no run-time model");
  const coded =
    [radiance?.low, radiance?.high, radiance?.epsilon].every(Number.isFinite) &&
    radiance.high > radiance.low &&
    radiance.high < 128 &&
    radiance.epsilon > 0;
  if (!coded) damaged("the code of radiance is not described");
}

function checkFiles(data: Manifest): void {
  const { images, probe, poster, mesh, motion, notes, title } = data;
  const suffixes = /^\.(avif|webp)$/;
  if (!suffixes.test(images?.suffix) || typeof images.type !== "string")
    damaged("its images are not described");
  if (!isName(probe?.file) || !Array.isArray(probe.colours) || !probe.colours.every(isVector))
    damaged("the probe is not described");
  if (!isName(poster?.file) || typeof poster.type !== "string") damaged("the poster is not described");
  const arrays = Object.values(mesh.arrays).every(
    (array) =>
      TYPES.includes(array?.type) &&
      isIndex(array.components, 7) &&
      isIndex(array.count, LARGEST_MESH) &&
      isIndex(array.offset, LARGEST_MESH),
  );
  if (!arrays) damaged("the mesh is not described");
  const moves =
    motion === null || (isVector(motion?.to) && isVector(motion.pivot) && Number.isFinite(motion.turn));
  if (!moves) damaged("the object's motion is not described");
  if (!Array.isArray(notes) || typeof title !== "string") damaged("it has no title");
}

/// Parses and checks a manifest; throws UserError.
export function parseManifest(text: string): Manifest {
  try {
    return checkedManifest(text);
  } catch (failure) {
    // What is not there at all, or not of the kind that it should be.
    if (failure instanceof TypeError || failure instanceof RangeError)
      return damaged("something in it is missing");
    throw failure;
  }
}

function checkedManifest(text: string): Manifest {
  let data: Manifest & { format?: string; version?: number };
  try {
    data = JSON.parse(text);
  } catch {
    return damaged("it is not JSON");
  }
  if (data?.format !== "mirrorbake-web") damaged("it is not that of a PEM");
  if (data.version !== VERSION) {
    throw new UserError(
      "version",
      `These files are of version ${data.version} of the format; this page shows version ${VERSION}. Export them again.`,
    );
  }
  if (!Array.isArray(data.parts) || data.parts.length < 1) damaged("it has no parts");
  if (!Array.isArray(data.samples) || data.samples.length < 1) damaged("it has no samples");
  checkAxes(data);
  checkMaps(data);
  for (const sample of data.samples) {
    const fits =
      Array.isArray(sample.parameter) &&
      sample.parameter.length === data.axes.length &&
      sample.parameter.every(Number.isFinite) &&
      areMaps(sample.maps, data.maps) &&
      (sample.still === null || isName(sample.still)) &&
      (sample.blocks === null || (isName(sample.blocks) && data.static?.maps !== null)) &&
      (sample.irradiance === null || isName(sample.irradiance));
    if (!fits) damaged("a sample does not have all maps");
  }
  if (!isSize(data.static?.size) || !isName(data.static.image)) damaged("the static map is not described");
  checkProxy(data.static.proxy, "the static map");
  const { maps, fadeDegrees } = data.static;
  const fades = fadeDegrees === null || (maps !== null && Number.isFinite(fadeDegrees) && fadeDegrees > 0);
  if ((maps !== null && !areMaps(maps, data.maps)) || !fades) damaged("the static set is not described");
  checkMaterials(data);
  checkMesh(data);
  checkRunTime(data);
  checkFiles(data);
  checkCamera(data);
  if (!(data.first >= 0 && data.first < data.samples.length)) data.first = 0;
  return data;
}

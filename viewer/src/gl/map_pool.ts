import { layerSize } from "../atlas";
import { UserError } from "../errors";
import { litSides, type Manifest } from "../manifest";
import { PROJECTIONS } from "../projection";
import type { Counters } from "./program";
import { IRRADIANCE_ROW } from "./shaders";

export const IRRADIANCE_UNIT = 2;

/// Bytes of the maps of one sample on the GPU.
export function sampleBytes(manifest: Manifest): number {
  const { width, height } = layerSize(largestSize(manifest));
  const { maps, alphas } = mapCounts(manifest);
  const texels = PROJECTIONS[manifest.projection].faces * width * height;
  return texels * (4 * maps + alphas) + 6 * litSides(manifest) * irradianceTexels(manifest);
}

/// Texels of a side of a sample's irradiance: one for each vertex, whole rows of them; 0 where it does not change.
export function irradianceTexels(manifest: Manifest): number {
  if (manifest.samples[0].irradiance === null) return 0;
  return IRRADIANCE_ROW * Math.ceil(manifest.mesh.arrays.positions.count / IRRADIANCE_ROW);
}

export function largestSize(manifest: Manifest): number {
  return manifest.maps.reduce((size, map) => Math.max(size, map.size), manifest.static.size);
}

/// Maps of a sample, and those of them that have an α.
export function mapCounts(manifest: Manifest): { maps: number; alphas: number } {
  return { maps: manifest.maps.length, alphas: manifest.maps.filter((map) => !map.opaque).length };
}

/// The maps on the GPU: array textures of one size for the life of the page, in which samples take turns. Behind their slots
/// there is one that the static set keeps, if there is such a set, and the captured map.
export class MapPool {
  /// How many samples there is room for.
  readonly capacity: number;
  /// The slot of the static set.
  readonly setSlot: number;
  readonly bytes: number;
  readonly width: number;
  readonly height: number;
  private readonly radiance: WebGLTexture | null;
  private readonly alpha: WebGLTexture | null;
  private readonly irradiance: WebGLTexture | null = null;
  private readonly irradianceRows: number;
  private readonly sides: number;
  private readonly faces: number;
  private readonly slots: number;
  private readonly maps: number;
  private readonly alphas: number;

  /// At most `budget` bytes, but room for `least` samples.
  constructor(
    private readonly gl: WebGL2RenderingContext,
    manifest: Manifest,
    budget: number,
    least: number,
    private readonly counters: Counters,
  ) {
    const { width, height } = layerSize(largestSize(manifest));
    const { maps, alphas } = mapCounts(manifest);
    this.width = width;
    this.height = height;
    this.maps = maps;
    this.alphas = alphas;
    const layers = gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS) as number;
    const side = gl.getParameter(gl.MAX_TEXTURE_SIZE) as number;
    const faces = PROJECTIONS[manifest.projection].faces;
    const sets = manifest.static.maps === null ? 0 : 1;
    const room = Math.floor((layers / faces - 1) / maps) - sets;
    if (room < least || Math.max(width, height) > side) {
      throw new UserError(
        "texture",
        `This graphics card has no room for the maps: they need ${faces * ((least + sets) * maps + 1)} layers of ` +
          `${width}×${height} texels, it has ${layers} of ${side}×${side}.`,
      );
    }
    const affordable = Math.floor(budget / sampleBytes(manifest)) - sets;
    this.capacity = Math.min(Math.max(affordable, least), room, manifest.samples.length);
    this.setSlot = this.capacity;
    this.slots = this.capacity + sets;
    this.faces = faces;
    const radianceLayers = faces * (this.slots * maps + 1);
    const alphaLayers = Math.max(faces * this.slots * alphas, 1);
    this.irradianceRows = irradianceTexels(manifest) / IRRADIANCE_ROW;
    this.sides = litSides(manifest);
    const irradianceLayers = this.sides * this.capacity;
    this.bytes =
      width * height * (4 * radianceLayers + alphaLayers) +
      6 * IRRADIANCE_ROW * this.irradianceRows * irradianceLayers;
    this.radiance = this.texture(gl.RGB9_E5, width, height, radianceLayers, gl.LINEAR);
    this.alpha = this.texture(gl.R8, width, height, alphaLayers, gl.LINEAR);
    if (this.irradianceRows > 0) {
      this.irradiance = this.texture(
        gl.RGB16F,
        IRRADIANCE_ROW,
        this.irradianceRows,
        irradianceLayers,
        gl.NEAREST,
      );
    }
  }

  /// First layer of a map of the sample in a slot.
  radianceLayer(slot: number, map: number): number {
    return this.faces * (slot * this.maps + map);
  }

  /// The same of α; `map` counts the maps that have one.
  alphaLayer(slot: number, map: number): number {
    return this.faces * (slot * this.alphas + map);
  }

  /// First layer of the captured map.
  staticLayer(): number {
    return this.faces * this.slots * this.maps;
  }

  uploadRadiance(layer: number, width: number, height: number, texels: Uint32Array): void {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.radiance);
    gl.texSubImage3D(
      gl.TEXTURE_2D_ARRAY,
      0,
      0,
      0,
      layer,
      width,
      height,
      this.faces,
      gl.RGB,
      gl.UNSIGNED_INT_5_9_9_9_REV,
      texels,
    );
    ++this.counters.uploaded;
  }

  uploadAlpha(layer: number, width: number, height: number, texels: Uint8Array): void {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.alpha);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texSubImage3D(
      gl.TEXTURE_2D_ARRAY,
      0,
      0,
      0,
      layer,
      width,
      height,
      this.faces,
      gl.RED,
      gl.UNSIGNED_BYTE,
      texels,
    );
    ++this.counters.uploaded;
  }

  get hasIrradiance(): boolean {
    return this.irradiance !== null;
  }

  /// Half floats, three for every texel (irradianceTexels) of each side.
  uploadIrradiance(slot: number, values: Uint16Array): void {
    const { gl, irradianceRows, sides } = this;
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.irradiance);
    gl.texSubImage3D(
      gl.TEXTURE_2D_ARRAY,
      0,
      0,
      0,
      sides * slot,
      IRRADIANCE_ROW,
      irradianceRows,
      sides,
      gl.RGB,
      gl.HALF_FLOAT,
      values,
    );
    ++this.counters.uploaded;
  }

  /// Binds radiance to unit 0, α to unit 1 and irradiance to IRRADIANCE_UNIT.
  bind(): void {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + IRRADIANCE_UNIT);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.irradiance);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.alpha);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.radiance);
  }

  private texture(
    format: number,
    width: number,
    height: number,
    layers: number,
    filter: number,
  ): WebGLTexture | null {
    const { gl } = this;
    const handle = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, handle);
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, format, width, height, layers);
    gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MAG_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    ++this.counters.allocated;
    if (gl.getError() === gl.OUT_OF_MEMORY) {
      throw new UserError("texture", "There is not enough graphics memory for the maps.");
    }
    return handle;
  }
}

import { layerSize } from "../atlas";
import { UserError } from "../errors";
import type { Manifest } from "../manifest";
import { PROJECTIONS } from "../projection";
import { arrayTexture } from "./array_texture";
import { IrradianceMaps, irradianceBytes, irradianceRoom } from "./irradiance";
import type { Counters } from "./program";

/// Bytes of the maps of one sample on the GPU.
export function sampleBytes(manifest: Manifest): number {
  const { width, height } = layerSize(largestSize(manifest));
  const { maps, alphas } = mapCounts(manifest);
  const texels = PROJECTIONS[manifest.projection].faces * width * height;
  return texels * (4 * maps + alphas) + irradianceBytes(manifest).ofSample;
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
  readonly irradiance: IrradianceMaps;
  private readonly radiance: WebGLTexture | null;
  private readonly alpha: WebGLTexture | null;
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
    const room = Math.min(Math.floor((layers / faces - 1) / maps) - sets, irradianceRoom(gl, manifest));
    if (room < least || Math.max(width, height) > side) {
      throw new UserError(
        "texture",
        `This graphics card has no room for the maps: they need ${faces * ((least + sets) * maps + 1)} layers of ` +
          `${width}×${height} texels, it has ${layers} of ${side}×${side}.`,
      );
    }
    const left = budget - irradianceBytes(manifest).atRest;
    const affordable = Math.floor(left / sampleBytes(manifest)) - sets;
    this.capacity = Math.min(Math.max(affordable, least), room, manifest.samples.length);
    this.setSlot = this.capacity;
    this.slots = this.capacity + sets;
    this.faces = faces;
    const radianceLayers = faces * (this.slots * maps + 1);
    const alphaLayers = Math.max(faces * this.slots * alphas, 1);
    this.irradiance = new IrradianceMaps(gl, manifest, this.capacity, counters);
    this.bytes = width * height * (4 * radianceLayers + alphaLayers) + this.irradiance.bytes;
    this.radiance = arrayTexture(gl, counters, gl.RGB9_E5, width, height, radianceLayers, gl.LINEAR);
    this.alpha = arrayTexture(gl, counters, gl.R8, width, height, alphaLayers, gl.LINEAR);
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

  /// Binds radiance to unit 0, α to unit 1 and irradiance to its own.
  bind(): void {
    const { gl } = this;
    this.irradiance.bind();
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.alpha);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.radiance);
  }
}

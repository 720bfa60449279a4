/// The light that reaches the object's body, where it is not in attributes of the vertices: it changes from sample to sample,
/// or it is a map on the texture coordinates.

import { UserError } from "../errors";
import { irradianceChanges, litSides, type Manifest } from "../manifest";
import { arrayTexture } from "./array_texture";
import type { Counters } from "./program";

export const IRRADIANCE_UNIT = 2;

/// Vertices of a row of the texture.
export const IRRADIANCE_ROW = 1024;

/// Reads of a lightmap in a fragment shader; LIGHTMAP is of how many samples it is blended. It lies on the bounds of the
/// coordinates, whose v counts downwards, and so do the rows of the map.
export const LIGHTMAP_READS = `
uniform sampler2DArray uIrradiance;  // of a slot's sample one layer, or two: fronts and backs
uniform int uSides;
uniform float uSlot[LIGHTMAP];
uniform float uWeight[LIGHTMAP];
uniform vec2 uUvLow;
uniform vec2 uUvExtent;
vec3 irradianceAt(vec2 uv) {
  vec2 place = (uv - uUvLow) / uUvExtent;
  int side = gl_FrontFacing ? 0 : uSides - 1;
  vec3 sum = vec3(0.0);
  for (int i = 0; i < LIGHTMAP; ++i) {
    if (uWeight[i] <= 0.0) continue;
    sum += uWeight[i] * textureLod(uIrradiance, vec3(place, float(uSides * int(uSlot[i]) + side)), 0.0).rgb;
  }
  return max(sum, 0.0);
}
`;

/// Texels along the sides of a layer: those of the lightmap, or one for each vertex in whole rows.
export function irradianceSize(manifest: Manifest): { width: number; height: number } {
  const { lightmap, arrays } = manifest.mesh;
  if (lightmap !== null) return { width: lightmap, height: lightmap };
  return { width: IRRADIANCE_ROW, height: Math.ceil(arrays.positions.count / IRRADIANCE_ROW) };
}

/// Bytes of a slot on the GPU.
function slotBytes(manifest: Manifest): number {
  const { width, height } = irradianceSize(manifest);
  return 6 * width * height * litSides(manifest);
}

/// Bytes of a sample's irradiance on the GPU, and of that at rest.
export function irradianceBytes(manifest: Manifest): { ofSample: number; atRest: number } {
  const bytes = slotBytes(manifest);
  return {
    ofSample: irradianceChanges(manifest) ? bytes : 0,
    atRest: manifest.mesh.lightmap === null ? 0 : bytes,
  };
}

/// For how many samples a graphics card has room.
export function irradianceRoom(gl: WebGL2RenderingContext, manifest: Manifest): number {
  const { ofSample, atRest } = irradianceBytes(manifest);
  if (ofSample === 0 && atRest === 0) return Number.POSITIVE_INFINITY;
  const { width, height } = irradianceSize(manifest);
  const side = gl.getParameter(gl.MAX_TEXTURE_SIZE) as number;
  if (Math.max(width, height) > side) {
    throw new UserError(
      "texture",
      `This graphics card has no room for the body's light: it needs ${width}×${height} texels, there are ${side}×${side}.`,
    );
  }
  if (ofSample === 0) return Number.POSITIVE_INFINITY;
  const layers = gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS) as number;
  return Math.floor(layers / litSides(manifest)) - (atRest > 0 ? 1 : 0);
}

/// Irradiance on the GPU: slots in which samples take turns, and behind them one of the lightmap at rest.
export class IrradianceMaps {
  /// The slot of the lightmap at rest; null: there is no lightmap.
  readonly restSlot: number | null;
  readonly bytes: number;
  private readonly texture: WebGLTexture | null = null;
  private readonly size: { width: number; height: number };
  private readonly sides: number;

  constructor(
    private readonly gl: WebGL2RenderingContext,
    manifest: Manifest,
    samples: number,
    private readonly counters: Counters,
  ) {
    const isMap = manifest.mesh.lightmap !== null;
    const slots = (irradianceChanges(manifest) ? samples : 0) + (isMap ? 1 : 0);
    this.size = irradianceSize(manifest);
    this.sides = litSides(manifest);
    this.restSlot = isMap ? slots - 1 : null;
    this.bytes = slots * slotBytes(manifest);
    if (slots === 0) return;
    const { width, height } = this.size;
    const filter = isMap ? gl.LINEAR : gl.NEAREST;
    this.texture = arrayTexture(gl, counters, gl.RGB16F, width, height, this.sides * slots, filter);
  }

  /// Half floats, three for every texel (irradianceSize) of each side.
  upload(slot: number, values: Uint16Array): void {
    const { gl, sides } = this;
    const { width, height } = this.size;
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texSubImage3D(
      gl.TEXTURE_2D_ARRAY,
      0,
      0,
      0,
      sides * slot,
      width,
      height,
      sides,
      gl.RGB,
      gl.HALF_FLOAT,
      values,
    );
    ++this.counters.uploaded;
  }

  bind(): void {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + IRRADIANCE_UNIT);
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.texture);
  }
}

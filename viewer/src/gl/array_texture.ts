import { UserError } from "../errors";
import type { Counters } from "./program";

/// An array texture without levels, clamped at its edges.
export function arrayTexture(
  gl: WebGL2RenderingContext,
  counters: Counters,
  format: number,
  width: number,
  height: number,
  layers: number,
  filter: number,
): WebGLTexture | null {
  const handle = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D_ARRAY, handle);
  gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, format, width, height, layers);
  gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MIN_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_MAG_FILTER, filter);
  gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
  gl.texParameteri(gl.TEXTURE_2D_ARRAY, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  ++counters.allocated;
  if (gl.getError() === gl.OUT_OF_MEMORY) {
    throw new UserError("texture", "There is not enough graphics memory for the maps.");
  }
  return handle;
}

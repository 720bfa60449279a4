/// Drawing of whole images: a still, a share of another image, the display.

import { HEADER } from "./shaders";

/// A triangle over the whole target.
export const FULL_VERTEX = `${HEADER}
out vec2 vUv;
void main() {
  vUv = vec2(gl_VertexID == 1 ? 2.0 : 0.0, gl_VertexID == 2 ? 2.0 : 0.0);
  gl_Position = vec4(2.0 * vUv - 1.0, 1.0, 1.0);
}
`;
/// A ray-traced picture, fitted into the view.
export const STILL_FRAGMENT = `${HEADER}
in vec2 vUv;
out vec4 oColour;
uniform sampler2D uStill;
uniform vec2 uScale;  // size of the view in units of the picture
void main() {
  vec2 place = (vUv - 0.5) * uScale;
  oColour = abs(place.x) <= 0.5 && abs(place.y) <= 0.5
    ? vec4(textureLod(uStill, vec2(0.5 + place.x, 0.5 - place.y), 0.0).rgb, 1.0)
    : vec4(0.0);
}
`;

/// Adds a share of an image to another.
export const COPY_FRAGMENT = `${HEADER}
out vec4 oColour;
uniform sampler2D uImage;
uniform float uShare;
void main() {
  oColour = uShare * texelFetch(uImage, ivec2(gl_FragCoord.xy), 0);
}
`;

/// Exposure, tone mapping, sRGB.
export const DISPLAY_FRAGMENT = `${HEADER}
out vec4 oColour;
uniform sampler2D uImage;
uniform float uExposure;
uniform bool uNeutral;

// Khronos PBR Neutral Tone Mapper, specification 1.0, 2024.
vec3 neutral(vec3 colour) {
  const float start = 0.8 - 0.04;
  float lowest = min(colour.r, min(colour.g, colour.b));
  colour -= lowest < 0.08 ? lowest - 6.25 * lowest * lowest : 0.04;
  float peak = max(colour.r, max(colour.g, colour.b));
  if (peak < start) return colour;
  float d = 1.0 - start;
  float newPeak = 1.0 - d * d / (peak + d - start);
  colour *= newPeak / peak;
  float g = 1.0 - 1.0 / (0.15 * (peak - newPeak) + 1.0);
  return mix(colour, vec3(newPeak), g);
}

void main() {
  vec3 c = uExposure * texelFetch(uImage, ivec2(gl_FragCoord.xy), 0).rgb;
  c = clamp(uNeutral ? neutral(c) : c, 0.0, 1.0);
  c = mix(12.92 * c, 1.055 * pow(max(c, 1e-9), vec3(1.0 / 2.4)) - 0.055, greaterThan(c, vec3(0.0031308)));
  oColour = vec4(c, 1.0);
}
`;

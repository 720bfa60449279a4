/// The drawing itself. Every level and every tap of a lookup is placed here, by the formula of the run-time model
/// (mirrorbake/envmap/reads.hpp, mirrorbake/surface/lookup.hpp): drivers' own levels and anisotropy differ between cards.

import { PROJECTIONS, type Projection } from "../projection";
import { EXITS } from "../proxy";
import { IRRADIANCE_ROW, LIGHTMAP_READS } from "./irradiance";

export const HEADER = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
`;

export function meshVertex(nodes: number): string {
  return `${HEADER}
#define NODES ${nodes}
layout(location = 0) in vec3 aPosition;
layout(location = 1) in vec2 aNormal;
layout(location = 2) in vec3 aIrradiance;
layout(location = 3) in vec2 aUv;
layout(location = 4) in vec3 aColor;
layout(location = 5) in vec3 aBackIrradiance;
layout(location = 6) in vec3 aTangent;
uniform mat4 uClipFromWorld;
uniform vec2 uShift;  // of the image, in clip space
uniform vec3 uLow;
uniform vec3 uExtent;
uniform vec2 uUvLow;
uniform vec2 uUvExtent;
uniform vec2 uTurn;  // cosine and sine of the object's turn about the vertical through uPivot
uniform vec3 uPivot;
uniform vec3 uOffset;
uniform bool uIrradianceChanges;
uniform sampler2DArray uIrradiance;  // of a slot's sample one layer, or two: fronts and backs
uniform int uSides;
uniform float uSlot[NODES];
uniform float uWeight[NODES];
out vec3 vPosition;
out vec3 vNormal;
out vec3 vIrradiance;
out vec3 vBackIrradiance;
out vec2 vUv;
out vec3 vColor;
out vec4 vTangent;  // all 0: none

vec3 fromOctahedron(vec2 e) {
  vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
  if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x >= 0.0 ? 1.0 : -1.0, n.y >= 0.0 ? 1.0 : -1.0);
  return normalize(n);
}

vec3 turned(vec3 v) {
  return vec3(uTurn.x * v.x + uTurn.y * v.z, v.y, uTurn.x * v.z - uTurn.y * v.x);
}

void main() {
  vPosition = turned(uLow + aPosition * uExtent - uPivot) + uPivot + uOffset;
  vNormal = turned(fromOctahedron(aNormal));
  vUv = uUvLow + aUv * uUvExtent;
  vColor = aColor;
  vTangent = aTangent.z == 0.0 ? vec4(0.0) : vec4(turned(fromOctahedron(aTangent.xy)), sign(aTangent.z));
  vIrradiance = aIrradiance;
  vBackIrradiance = aBackIrradiance;
  if (uIrradianceChanges) {
    ivec2 texel = ivec2(gl_VertexID % ${IRRADIANCE_ROW}, gl_VertexID / ${IRRADIANCE_ROW});
    vIrradiance = vBackIrradiance = vec3(0.0);
    for (int i = 0; i < NODES; ++i) {
      int layer = uSides * int(uSlot[i]);
      vIrradiance += uWeight[i] * texelFetch(uIrradiance, ivec3(texel, layer), 0).rgb;
      vBackIrradiance += uWeight[i] * texelFetch(uIrradiance, ivec3(texel, layer + uSides - 1), 0).rgb;
    }
  }
  gl_Position = uClipFromWorld * vec4(vPosition, 1.0);
  gl_Position.xy += uShift * gl_Position.w;
}
`;
}

/// What reads of a map need: the samplers uRadiance and uAlpha, and uLayer: 1 / size of a layer in texels.
const MAPS = `
uniform sampler2DArray uRadiance;
uniform sampler2DArray uAlpha;
uniform vec2 uLayer;
uniform int uMaxTaps;

struct FacePoint {
  float face;
  vec2 st;
};
`;

const TAPS = `
// Where a level lies in a layer (layerPlace in atlas.ts), and a point of the face on it.
vec2 levelPoint(float size, float level, vec2 st) {
  float n = max(floor(size * exp2(-level) + 0.5), 1.0);
  vec2 corner = level < 0.5 ? vec2(0.0) : vec2(size + 2.0, size - 2.0 * n + 2.0 * (level - 1.0));
  return (corner + 1.0 + clamp(st, 0.0, 1.0) * n) * uLayer;
}

struct Taps {
  float level;
  int pairs;  // 0: one tap in the middle
  float step;
  float n;
  vec3 longer;
};

// TapPattern of mirrorbake/envmap/reads.hpp.
Taps tapsOf(vec3 d, vec3 ddx, vec3 ddy, float size) {
  float x = size * faceLength(d, ddx);
  float y = size * faceLength(d, ddy);
  float major = max(x, y);
  Taps taps = Taps(0.0, 0, 0.0, 1.0, y > x ? ddy : ddx);
  if (!(major > 1.0)) return taps;
  float n = clamp(major / max(min(x, y), 1.0), 1.0, float(uMaxTaps));
  taps.level = clamp(log2(major / n), 0.0, log2(size));
  taps.n = n;
  if (n <= 1.25) return taps;
  taps.pairs = int(ceil(0.5 * n));
  taps.step = taps.pairs == 1 ? 0.5 * (n - 1.25) / 0.75 : 1.0 / n;
  return taps;
}

int tapCount(Taps taps) {
  return max(2 * taps.pairs, 1);
}

// Direction of a tap, and its share of the lookup.
vec3 tapDirection(Taps taps, vec3 d, int tap, out float weight) {
  weight = 1.0;
  if (taps.pairs == 0) return d;
  int pair = tap >> 1;
  bool outermost = pair + 1 == taps.pairs;
  // The outermost of several pairs takes the middles of what the others leave of the differential.
  float offset = outermost && pair > 0 ? 0.5 * (float(pair) / taps.n + 0.5) : (float(pair) + 0.5) * taps.step;
  weight = (outermost ? 0.5 * taps.n - float(pair) : 1.0) / taps.n;
  return d + ((tap & 1) == 0 ? offset : -offset) * taps.longer;
}

vec3 readRadiance(vec3 d, float level, float size, float layer) {
  FacePoint p = facePoint(d);
  float finer = floor(level);
  float fraction = level - finer;
  vec3 value = textureLod(uRadiance, vec3(levelPoint(size, finer, p.st), layer + p.face), 0.0).rgb;
  if (fraction > 0.0) {
    vec3 coarser = textureLod(uRadiance, vec3(levelPoint(size, finer + 1.0, p.st), layer + p.face), 0.0).rgb;
    value = mix(value, coarser, fraction);
  }
  return value;
}

float readAlpha(vec3 d, float level, float size, float layer) {
  FacePoint p = facePoint(d);
  float finer = floor(level);
  float fraction = level - finer;
  float value = textureLod(uAlpha, vec3(levelPoint(size, finer, p.st), layer + p.face), 0.0).r;
  if (fraction > 0.0) {
    float coarser = textureLod(uAlpha, vec3(levelPoint(size, finer + 1.0, p.st), layer + p.face), 0.0).r;
    value = mix(value, coarser, fraction);
  }
  return value;
}
`;

export function reads(projection: Projection): string {
  return `${MAPS}${PROJECTIONS[projection].glsl}${TAPS}`;
}

/// `shells` of the part and the number of samples that are `mixed`, the static set among them, are constants of the program, and
/// so is of how many nodes a `lightmap` is blended: 0: there is none, and irradiance comes from the vertices.
export function meshFragment(
  shells: number,
  mixed: number,
  projection: Projection,
  lightmap: number,
): string {
  return `${HEADER}
#define SHELLS ${shells}
#define MIXED ${mixed}
#define LIGHTMAP ${lightmap}
in vec3 vPosition;
in vec3 vNormal;
#if LIGHTMAP == 0
in vec3 vIrradiance;
in vec3 vBackIrradiance;
#endif
in vec2 vUv;
in vec3 vColor;
in vec4 vTangent;
out vec4 oColour;
${reads(projection)}
uniform vec3 uEye;
uniform vec3 uForward;  // normal of the image plane
uniform vec3 uMiddle;   // from the eye to the middle of the image on the plane at distance 1
uniform vec3 uRight;    // one pixel to the right on that plane
uniform vec3 uDown;     // one pixel down
uniform vec2 uPixels;
uniform vec2 uPlace;    // of the lookup in its pixel, from the top left corner
uniform float uFootprint;
uniform bool uFlat;

// Proxies of the shells, front to back, and last that of the static map.
uniform int uShape[SHELLS + 1];
uniform vec3 uCentre[SHELLS + 1];
uniform mat3 uProxyFromWorld[SHELLS + 1];  // scaled, but for boxes
uniform vec3 uShapeSize[SHELLS + 1];
uniform vec3 uOrigin[SHELLS + 1];
uniform float uSize[SHELLS + 1];
uniform float uShellOn[SHELLS];  // 0: not drawn, or not on these triangles
uniform float uRadianceLayer[SHELLS * MIXED];
uniform float uAlphaLayer[SHELLS * MIXED];  // below 0: opaque
uniform float uMixture[MIXED];  // shares, which sum to 1
uniform float uStaticLayer;
uniform bool uCaptured;  // the captured map instead of the PEM

uniform int uFresnel;  // 0: constant, 1: Schlick, 2: dielectric, 3: conductor, 4: none, 5: no mirror
uniform vec3 uR0;
uniform vec3 uEta;
uniform vec3 uK;
uniform bool uCoated;
uniform float uDiffuseOn;
uniform vec3 uAlbedo;
uniform float uNormalScale;
uniform bool uColorsTint;
uniform bvec3 uTextured;  // albedo, reflectance, normal
uniform sampler2D uAlbedoTexture;
uniform sampler2D uReflectanceTexture;
uniform sampler2D uNormalTexture;
uniform mat3x2 uAlbedoFromUv;
uniform mat3x2 uReflectanceFromUv;
uniform mat3x2 uNormalFromUv;

${EXITS}
#if LIGHTMAP > 0
${LIGHTMAP_READS}
#endif
vec3 lookupDirection(int shell, vec3 p, vec3 d) {
  return leave(
    uShape[shell], p, d, uCentre[shell], uProxyFromWorld[shell], uShapeSize[shell], uOrigin[shell]
  );
}

vec3 fresnel(float cosine, vec3 r0) {
  float c = clamp(cosine, 0.0, 1.0);
  if (uFresnel == 0) return r0;
  if (uFresnel == 4) return vec3(1.0);
  if (uFresnel == 5) return vec3(0.0);
  float q = (1.0 - c) * (1.0 + c);
  if (uFresnel == 1) {
    float m = 1.0 - c;
    return min(r0 + (1.0 - r0) * (m * m * m * m * m), 1.0);
  }
  if (uFresnel == 2) {
    vec3 g2 = (uEta - 1.0) * (uEta + 1.0) + c * c;
    vec3 g = sqrt(max(g2, 0.0));
    vec3 s = g + c;
    vec3 r = (uEta - 1.0) * (uEta + 1.0) / max(s * s, 1e-20);
    vec3 sum = c * g + q;
    vec3 f = r * r * (c * c * g * g + q * q) / max(sum * sum, 1e-20);
    return mix(min(f, 1.0), vec3(1.0), lessThan(g2, vec3(0.0)));
  }
  vec3 t = uEta * uEta - uK * uK - q;
  vec3 nk = uEta * uK;
  vec3 m = sqrt(t * t + 4.0 * nk * nk);
  vec3 r2 = 0.5 * (m + abs(t));
  vec3 r = sqrt(max(r2, 1e-20));
  vec3 a = mix(r, nk / r, lessThan(t, vec3(0.0)));
  vec3 rs = (m + c * c - 2.0 * a * c) / (m + c * c + 2.0 * a * c);
  vec3 big = m * c * c + q * q;
  return min(rs * big / max(big + 2.0 * a * c * q, 1e-20), 1.0);
}

// Tracer's bend_normal: a normal that reflects the view into the surface is bent until it does not.
vec3 bend(vec3 view, vec3 n, vec3 g) {
  float c = dot(n, view);
  if (c < 0.0) n = normalize(n - c * view);
  vec3 r = 2.0 * dot(n, view) * n - view;
  float height = dot(r, g);
  float lowest = min(0.01, 0.9 * dot(view, g));
  if (height >= lowest) return n;
  vec3 middle = view + normalize(r + (lowest - height) * g);
  float size = length(middle);
  return size > 0.0 ? middle / size : g;
}

// A lookup stands for a part of the pixel, and so does what it reads of a texture.
vec3 readTexture(sampler2D image, mat3x2 imageFromUv, vec2 uv, vec2 ux, vec2 uy) {
  vec2 dx = uFootprint * (imageFromUv * vec3(ux, 0.0)), dy = uFootprint * (imageFromUv * vec3(uy, 0.0));
  return textureGrad(image, imageFromUv * vec3(uv, 1.0), dx, dy).rgb;
}

// Tracer's front_normal with the texture of mapped_normal (glTF 2.0 §3.9.3): v of the coordinates counts downwards, that of the
// texels upwards. \`front\` is the geometric normal of the triangle's front. All corners of a triangle with tangents have the same
// sign: between them it is ±1, and nearer to 0 where one has none.
vec3 frontNormal(vec3 interpolated, vec4 tangent, vec3 front, vec2 uv, vec3 px, vec3 py, vec2 ux, vec2 uy) {
  vec3 n = uFlat || dot(interpolated, front) <= 0.0 ? front : normalize(interpolated);
  if (!uTextured.z) return n;
  vec3 along = tangent.xyz;
  float side = sign(tangent.w);
  if (abs(tangent.w) < 0.999) {
    float determinant = ux.x * uy.y - uy.x * ux.y;
    if (determinant == 0.0) return n;
    float turn = sign(determinant);
    along = turn * (px * uy.y - py * ux.y);
    side = dot(cross(n, along), turn * (px * uy.x - py * ux.x)) < 0.0 ? -1.0 : 1.0;
  }
  vec3 t = along - dot(along, n) * n;
  float size = length(t);
  if (!(size > 0.0)) return n;
  t /= size;
  vec3 texel = 2.0 * readTexture(uNormalTexture, uNormalFromUv, uv, ux, uy) - 1.0;
  vec3 bent = uNormalScale * (texel.x * t + texel.y * side * cross(n, t)) + texel.z * n;
  return length(bent) > 1e-6 && dot(bent, front) > 0.0 ? normalize(bent) : n;
}

vec3 reflectedChange(vec3 change, vec3 d, vec3 n, vec3 dNormal) {
  vec3 r = change - 2.0 * (dot(d, n) * dNormal + (dot(change, n) + dot(d, dNormal)) * n);
  float size = length(r);
  return size <= 2.0 ? r : (size < 1e30 ? r * (2.0 / size) : vec3(0.0));
}

vec4 readShell(int shell, vec3 p, vec3 r, vec3 pdx, vec3 rdx, vec3 pdy, vec3 rdy) {
  vec3 d = lookupDirection(shell, p, r);
  vec3 ddx = lookupDirection(shell, p + pdx, r + rdx) - d;
  vec3 ddy = lookupDirection(shell, p + pdy, r + rdy) - d;
  float size = uSize[shell];
  Taps taps = tapsOf(d, ddx, ddy, size);
  int count = tapCount(taps);
  vec4 sum = vec4(0.0);
  for (int tap = 0; tap < count; ++tap) {
    float weight;
    vec3 place = tapDirection(taps, d, tap, weight);
    if (shell == SHELLS) {
      sum += weight * vec4(readRadiance(place, taps.level, size, uStaticLayer), 1.0);
      continue;
    }
    for (int node = 0; node < MIXED; ++node) {
      float share = weight * uMixture[node];
      if (share <= 0.0) continue;
      sum.rgb += share * readRadiance(place, taps.level, size, uRadianceLayer[node * SHELLS + shell]);
      float alpha = uAlphaLayer[node * SHELLS + shell];
      sum.a += share * (alpha < 0.0 ? 1.0 : readAlpha(place, taps.level, size, alpha));
    }
  }
  return sum;
}

void main() {
  vec3 px = dFdx(vPosition), py = dFdy(vPosition);
  vec3 nx = dFdx(vNormal), ny = dFdy(vNormal);
  vec4 tx = dFdx(vTangent), ty = dFdy(vTangent);
  vec2 ux = dFdx(vUv), uy = dFdy(vUv);
#if LIGHTMAP == 0
  vec3 reached = gl_FrontFacing ? vIrradiance : vBackIrradiance;
  vec3 ix = dFdx(reached), iy = dFdy(reached);
#endif
  float e11 = dot(px, px), e12 = dot(px, py), e22 = dot(py, py);
  float determinant = e11 * e22 - e12 * e12;
  vec3 g = cross(px, py);
  g = length(g) > 0.0 ? normalize(g) : normalize(uEye - vPosition);

  // Rasterisers put vertices on a grid of 1/16 to 1/256 of a pixel, and small triangles then show a point beside the one that
  // the pixel's ray meets. What is interpolated is linear in the triangle's plane: go on to where the ray meets that.
  vec2 pixel = vec2(gl_FragCoord.x, uPixels.y - gl_FragCoord.y) - 0.5 + uPlace - 0.5 * uPixels;
  vec3 ray = uMiddle + pixel.x * uRight + pixel.y * uDown;
  float facing = dot(ray, g);
  vec3 aside = facing != 0.0 ? ray * (dot(vPosition - uEye, g) / facing) - (vPosition - uEye) : vec3(0.0);
  vec2 pixels = vec2(0.0);
  if (determinant > 0.0) {
    float p1 = dot(aside, px), p2 = dot(aside, py);
    pixels = vec2(p1 * e22 - p2 * e12, p2 * e11 - p1 * e12) / determinant;
  }
  // Farther than any grid puts it: an edge-on triangle, of which nothing is known.
  if (!(max(abs(pixels.x), abs(pixels.y)) < 0.25)) pixels = vec2(0.0);
  vec3 position = vPosition + pixels.x * px + pixels.y * py;
  vec3 normal = vNormal + pixels.x * nx + pixels.y * ny;
  vec4 tangent = vTangent + pixels.x * tx + pixels.y * ty;
  vec2 uv = vUv + pixels.x * ux + pixels.y * uy;
#if LIGHTMAP == 0
  vec3 irradiance = max(reached + pixels.x * ix + pixels.y * iy, 0.0);
#else
  vec3 irradiance = irradianceAt(uv);
#endif

  vec3 toEye = uEye - position;
  float range = length(toEye);
  vec3 view = toEye / range;
  if (dot(g, view) < 0.0) g = -g;
  float side = gl_FrontFacing ? 1.0 : -1.0;
  float normalLength = max(length(normal), 1e-6);
  vec3 front = side * g;
  vec3 outside = frontNormal(normal, tangent, front, uv, px, py, ux, uy);
  vec3 n = bend(view, side * outside, g);
  vec3 d = -view;
  vec3 r = normalize(2.0 * dot(n, view) * n - view);

  // Ray differentials (Igehy, SIGGRAPH 1999), as the tracer's surface_differential has them. The normal is linear in the
  // plane of the triangle: two neighbours of any spacing give its change along any step, without a driver's rounding.
  float slope = 1.0 / dot(d, uForward);  // length of the ray to the image plane at distance 1
  float cosine = min(dot(d, g), -0.1);
  vec3 pd[2];
  vec3 rd[2];
  for (int i = 0; i < 2; ++i) {
    vec3 step = i == 0 ? uRight : uDown;
    vec3 change = (step - dot(step, d) * d) / slope;
    vec3 travel = range * change;
    vec3 p = travel - (dot(travel, g) / cosine) * d;
    p -= dot(p, g) * g;
    vec3 dNormal = vec3(0.0);
    if ((!uFlat || uTextured.z) && determinant > 0.0) {
      float p1 = dot(p, px), p2 = dot(p, py);
      float a = (p1 * e22 - p2 * e12) / determinant, b = (p2 * e11 - p1 * e12) / determinant;
      vec3 moved = normal + a * nx + b * ny;
      vec3 dn = uTextured.z
        ? frontNormal(moved, tangent + a * tx + b * ty, front, uv + a * ux + b * uy, px, py, ux, uy) - outside
        : (a * nx + b * ny) / normalLength;
      dNormal = side * (dn - dot(dn, n) * n);
    }
    pd[i] = uFootprint * p;
    rd[i] = uFootprint * reflectedChange(change, d, n, dNormal);
  }

  vec3 light = vec3(0.0);
  if (uCaptured) {
    light = readShell(SHELLS, position, r, pd[0], rd[0], pd[1], rd[1]).rgb;
  } else {
    float through = 1.0;
    for (int shell = 0; shell < SHELLS; ++shell) {
      if (uShellOn[shell] == 0.0) continue;
      vec4 layer = readShell(shell, position, r, pd[0], rd[0], pd[1], rd[1]);
      light += through * layer.rgb;
      through *= 1.0 - layer.a;
    }
  }
  vec3 r0 = uR0 * (uColorsTint ? vColor : vec3(1.0));
  if (uTextured.y) r0 *= readTexture(uReflectanceTexture, uReflectanceFromUv, uv, ux, uy);
  vec3 f = fresnel(dot(n, view), r0);
  vec3 albedo = uAlbedo * vColor;
  if (uTextured.x) albedo *= readTexture(uAlbedoTexture, uAlbedoFromUv, uv, ux, uy);
  vec3 body = uDiffuseOn * albedo * (irradiance * 0.3183098861837907) * (uCoated ? 1.0 - f : vec3(1.0));
  oColour = vec4(min(light * f + body, 65000.0), 1.0);
}
`;
}

/// Surroundings behind the object.
export function backgroundFragment(projection: Projection): string {
  return `${HEADER}
in vec2 vUv;
out vec4 oColour;
${reads(projection)}
uniform vec3 uMiddle;
uniform vec3 uRight;
uniform vec3 uDown;
uniform vec2 uPixels;
uniform vec2 uPlace;
uniform float uSize;
uniform float uStaticLayer;
uniform vec3 uEye;
uniform int uShape;
uniform vec3 uCentre;
uniform mat3 uProxyFromWorld;
uniform vec3 uShapeSize;
uniform vec3 uOrigin;
${EXITS}
uniform vec4 uPlain;  // a: 1: this colour instead of the surroundings
void main() {
  if (uPlain.a > 0.0) {
    oColour = vec4(uPlain.rgb, 0.0);
    return;
  }
  vec2 pixel = vec2(gl_FragCoord.x, uPixels.y - gl_FragCoord.y) - 0.5 + uPlace;
  vec3 d = uMiddle + (pixel.x - 0.5 * uPixels.x) * uRight + (pixel.y - 0.5 * uPixels.y) * uDown;
  vec3 h = leave(uShape, uEye, d, uCentre, uProxyFromWorld, uShapeSize, uOrigin);
  vec3 hx = leave(uShape, uEye, d + uRight, uCentre, uProxyFromWorld, uShapeSize, uOrigin);
  vec3 hy = leave(uShape, uEye, d + uDown, uCentre, uProxyFromWorld, uShapeSize, uOrigin);
  Taps taps = tapsOf(h, hx - h, hy - h, uSize);
  oColour = vec4(readRadiance(h, taps.level, uSize, uStaticLayer), 0.0);
}
`;
}

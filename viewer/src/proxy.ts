/// The shapes on which maps lie: what a manifest says of each, and where rays leave it.

import type { Vec3 } from "./manifest";
import { isVector } from "./math";

/// As `mirrorbake.proxy.proxy_to_attributes` describes it: with its extents, by name.
export interface ProxyShape {
  shape: string;
  origin: Vec3;
  centre?: Vec3;
  axes?: [Vec3, Vec3, Vec3];
  [extent: string]: unknown;
}

interface Shape {
  /// What tells its size besides centre and axes: three lengths along the axes, or one for all.
  extents: { [name: string]: "vector" | "number" };
  /// Lengths along the axes.
  size: (proxy: ProxyShape) => Vec3;
  /// Whether its own coordinates are in units of its size.
  scaled: boolean;
  /// GLSL: the ray parameter at which it is left (mirrorbake/proxy/lookup_formulas.hpp) by a ray from `q` along
  /// `e`, in its own coordinates, `size` being its lengths along the axes.
  exit: string;
}

/// All but the infinite one, which has no size. In shaders a shape is its place in this list, from 1.
export const SHAPES: { [name: string]: Shape } = {
  box: {
    extents: { half_extent: "vector" },
    size: (proxy) => proxy.half_extent as Vec3,
    scaled: false,
    exit: "boxExit(q, e, size)",
  },
  ellipsoid: {
    extents: { radii: "vector" },
    size: (proxy) => proxy.radii as Vec3,
    scaled: true,
    exit: "sphereExit(q, e)",
  },
  hemisphere: {
    extents: { radius: "number" },
    size: ({ radius }) => [radius, radius, radius] as Vec3,
    scaled: true,
    exit: "hemisphereExit(q, e)",
  },
};

const FORMULAS = `
float boxExit(vec3 p, vec3 d, vec3 extent) {
  float t = 1e37;
  for (int i = 0; i < 3; ++i) {
    float speed = abs(d[i]);
    float side = d[i] < 0.0 ? -extent[i] : extent[i];
    if (speed > 0.0) t = min(t, abs(side - p[i]) / speed);
  }
  return t < 1e36 ? t : 0.0;
}

float sphereExit(vec3 p, vec3 d) {
  float a = dot(d, d);
  float b = dot(p, d);
  float c = dot(p, p) - 1.0;
  float s = sqrt(max(b * b - a * c, 0.0));
  float t = b > 0.0 ? -c / (b + s) : (s - b) / a;
  return t > 0.0 ? t : 0.0;
}

float hemisphereExit(vec3 p, vec3 d) {
  float t = sphereExit(p, d);
  return d.y < 0.0 ? min(t, abs(p.y / d.y)) : t;
}
`;

/// Number of a shape in the shaders.
export function shapeNumber(proxy: ProxyShape): number {
  return 1 + Object.keys(SHAPES).indexOf(proxy.shape);
}

export function sizeOf(proxy: ProxyShape): Vec3 {
  return SHAPES[proxy.shape]?.size(proxy) ?? [1, 1, 1];
}

export function isScaled(proxy: ProxyShape): boolean {
  return SHAPES[proxy.shape]?.scaled ?? false;
}

/// Whether a description is that of a shape which this page knows.
export function isProxy(proxy: ProxyShape): boolean {
  if (!isVector(proxy?.origin)) return false;
  if (proxy.shape === "infinite") return true;
  if (!Object.hasOwn(SHAPES, proxy.shape)) return false;
  const number = (x: unknown) => typeof x === "number" && Number.isFinite(x) && x > 0;
  const vector = (v: unknown) => isVector(v) && v.every(number);
  return (
    isVector(proxy.centre) &&
    Array.isArray(proxy.axes) &&
    proxy.axes.every(isVector) &&
    Object.entries(SHAPES[proxy.shape].extents).every(([name, kind]) =>
      kind === "vector" ? vector(proxy[name]) : number(proxy[name]),
    )
  );
}

/// GLSL: `leave` says where a ray from `p` along `d` leaves a shape, as seen from the map's origin.
export const EXITS = `${FORMULAS}
vec3 leave(int shape, vec3 p, vec3 d, vec3 centre, mat3 proxyFromWorld, vec3 size, vec3 origin) {
  if (shape == 0) return d;
  vec3 q = proxyFromWorld * (p - centre);
  vec3 e = proxyFromWorld * d;
  float t = 0.0;
${Object.values(SHAPES)
  .map(({ exit }, i) => `  if (shape == ${i + 1}) t = ${exit};\n`)
  .join("")}  return p + t * d - origin;
}
`;

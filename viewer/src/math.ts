import type { Vec3 } from "./manifest";

export const add = (a: Vec3, b: Vec3): Vec3 => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const subtract = (a: Vec3, b: Vec3): Vec3 => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (s: number, a: Vec3): Vec3 => [s * a[0], s * a[1], s * a[2]];
export const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a: Vec3, b: Vec3): Vec3 => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
export const normalize = (a: Vec3): Vec3 => scale(1 / Math.hypot(...a), a);
export const clamp = (x: number, low: number, high: number): number => Math.min(Math.max(x, low), high);

/// A pinhole camera as the tracer has it: what a pixel's ray is, and where a point lands in clip space.
export interface View {
  eye: Vec3;
  forward: Vec3;
  /// One pixel to the right and down on the plane at distance 1.
  right: Vec3;
  down: Vec3;
  /// Column-major.
  clipFromWorld: Float32Array;
}

/// Writes into `view`, so that nothing is allocated while the camera moves.
export function placeCamera(
  view: View,
  eye: Vec3,
  target: Vec3,
  verticalFov: number,
  width: number,
  height: number,
  near: number,
  far: number,
): void {
  const forward = normalize(subtract(target, eye));
  const right = normalize(cross(forward, [0, 1, 0]));
  const up = cross(right, forward);
  const half = Math.tan(0.5 * verticalFov);
  const pixel = (2 * half) / height;
  view.eye = eye;
  view.forward = forward;
  view.right = scale(pixel, right);
  view.down = scale(-pixel, up);
  const x = height / (half * width);
  const y = 1 / half;
  const a = (near + far) / (near - far);
  const b = (2 * near * far) / (near - far);
  const m = view.clipFromWorld;
  for (let i = 0; i < 3; ++i) {
    m[4 * i] = x * right[i];
    m[4 * i + 1] = y * up[i];
    m[4 * i + 2] = -a * forward[i];
    m[4 * i + 3] = forward[i];
  }
  m[12] = -x * dot(right, eye);
  m[13] = -y * dot(up, eye);
  m[14] = a * dot(forward, eye) + b;
  m[15] = -dot(forward, eye);
}

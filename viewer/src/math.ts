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
export function isVector(v: unknown): v is Vec3 {
  return Array.isArray(v) && v.length === 3 && v.every(Number.isFinite);
}
export const normalize = (a: Vec3): Vec3 => scale(1 / Math.hypot(...a), a);
export const clamp = (x: number, low: number, high: number): number => Math.min(Math.max(x, low), high);

/// Where an eye is and how it looks: orthonormal axes.
export interface Pose {
  eye: Vec3;
  forward: Vec3;
  right: Vec3;
  up: Vec3;
}

/// The edges of an image on the plane at distance 1 of the eye, along the pose's `right` and `up`. Those of an eye of two, and of
/// a lens in a headset, are not the same on both sides.
export interface ImageWindow {
  left: number;
  right: number;
  bottom: number;
  top: number;
}

/// A pinhole camera as the tracer has it: what a pixel's ray is, and where a point lands in clip space.
export interface View {
  eye: Vec3;
  /// Normal of the image plane.
  forward: Vec3;
  /// From the eye to the middle of the image on the plane at distance 1.
  middle: Vec3;
  /// One pixel to the right and down on that plane.
  right: Vec3;
  down: Vec3;
  /// Column-major.
  clipFromWorld: Float32Array;
}

/// A pose at `eye` that looks at `target`, the world's Y upwards.
export function lookAt(eye: Vec3, target: Vec3): Pose {
  const forward = normalize(subtract(target, eye));
  const right = normalize(cross(forward, [0, 1, 0]));
  return { eye, forward, right, up: cross(right, forward) };
}

/// The window of an image with a vertical field of view in radians, moved sideways by a share of the distance.
export function windowOf(verticalFov: number, aspect: number, shift = 0): ImageWindow {
  const top = Math.tan(0.5 * verticalFov);
  return { left: shift - aspect * top, right: shift + aspect * top, bottom: -top, top };
}

/// The window of an OpenGL projection matrix (column-major).
export function windowOfProjection(m: Float32Array): ImageWindow {
  return {
    left: (m[8] - 1) / m[0],
    right: (m[8] + 1) / m[0],
    bottom: (m[9] - 1) / m[5],
    top: (m[9] + 1) / m[5],
  };
}

/// Writes into `view`, so that its matrix is not allocated anew while the camera moves.
export function placeCamera(
  view: View,
  pose: Pose,
  window: ImageWindow,
  width: number,
  height: number,
  near: number,
  far: number,
): void {
  const { eye, forward, right, up } = pose;
  const spanX = window.right - window.left;
  const spanY = window.top - window.bottom;
  const middleX = 0.5 * (window.left + window.right);
  const middleY = 0.5 * (window.bottom + window.top);
  view.eye = eye;
  view.forward = forward;
  view.middle = add(forward, add(scale(middleX, right), scale(middleY, up)));
  view.right = scale(spanX / width, right);
  view.down = scale(-spanY / height, up);
  const x = 2 / spanX;
  const y = 2 / spanY;
  const a = (near + far) / (near - far);
  const b = (2 * near * far) / (near - far);
  const m = view.clipFromWorld;
  for (let i = 0; i < 3; ++i) {
    m[4 * i] = x * (right[i] - middleX * forward[i]);
    m[4 * i + 1] = y * (up[i] - middleY * forward[i]);
    m[4 * i + 2] = -a * forward[i];
    m[4 * i + 3] = forward[i];
  }
  for (let row = 0; row < 4; ++row)
    m[12 + row] = -(m[row] * eye[0] + m[4 + row] * eye[1] + m[8 + row] * eye[2]);
  m[14] += b;
}

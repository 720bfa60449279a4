/// What a PEM becomes far from its samples: its static set (Cameras.degrees_outside of mirrorbake/scene/cameras.py, fade_weight
/// of mirrorbake/pem/run_time.py).

import type { Manifest, Vec3 } from "./manifest";
import { clamp, cross, dot, subtract } from "./math";

/// Radians by which the same direction may differ in float32.
const SAME_DIRECTION = 1e-5;

/// Degrees between an eye and where the cameras of the samples are, seen from what they look at; 0 among them.
export function degreesOutside(camera: Manifest["camera"], eye: Vec3): number {
  const a = subtract(eye, camera.target);
  const azimuth = (Math.atan2(a[0], a[2]) * 180) / Math.PI;
  const elevation = (Math.atan2(a[1], Math.hypot(a[0], a[2])) * 180) / Math.PI;
  const [low, high] = camera.azimuths;
  const middle = 0.5 * (low + high);
  const turn = azimuth - middle - 360 * Math.floor((azimuth - middle + 180) / 360);
  const nearest = middle + clamp(turn, low - middle, high - middle);
  const around = (nearest * Math.PI) / 180;
  const up = (clamp(elevation, camera.elevations[0], camera.elevations[1]) * Math.PI) / 180;
  const b: Vec3 = [Math.cos(up) * Math.sin(around), Math.sin(up), Math.cos(up) * Math.cos(around)];
  const angle = Math.atan2(Math.hypot(...cross(a, b)), dot(a, b));
  return angle > SAME_DIRECTION ? (angle * 180) / Math.PI : 0;
}

/// The share of the PEM so many degrees beyond its samples, if at `degrees` it is half.
export function fadeWeight(degrees: number, away: number): number {
  return 1 / (1 + (away / degrees) ** 2);
}

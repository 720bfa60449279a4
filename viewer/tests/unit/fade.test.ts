import { expect, test } from "vitest";
import { degreesOutside, fadeWeight } from "../../src/fade";
import type { Manifest, Vec3 } from "../../src/manifest";

const camera = {
  target: [1, 2, 3],
  azimuths: [350, 370],
  elevations: [10, 30],
} as unknown as Manifest["camera"];

function eye(azimuth: number, elevation: number, distance = 2): Vec3 {
  const [a, e] = [(azimuth * Math.PI) / 180, (elevation * Math.PI) / 180];
  return [
    1 + distance * Math.cos(e) * Math.sin(a),
    2 + distance * Math.sin(e),
    3 + distance * Math.cos(e) * Math.cos(a),
  ];
}

test("among the cameras nothing is outside, however far the eye is", () => {
  for (const [azimuth, elevation] of [
    [0, 20],
    [-10, 10],
    [10, 30],
    [365, 11],
  ]) {
    for (const distance of [0.1, 2, 50])
      expect(degreesOutside(camera, eye(azimuth, elevation, distance))).toBe(0);
  }
});

test("above and below the angle is that of the elevations", () => {
  expect(degreesOutside(camera, eye(3, 42))).toBeCloseTo(12, 6);
  expect(degreesOutside(camera, eye(3, -15))).toBeCloseTo(25, 6);
});

test("beside them it is the angle to the nearest azimuth, over the shorter way", () => {
  const level = { ...camera, elevations: [0, 0] } as Manifest["camera"];
  expect(degreesOutside(level, eye(30, 0))).toBeCloseTo(20, 6);
  expect(degreesOutside(level, eye(-175, 0))).toBeCloseTo(165, 6);
  expect(degreesOutside(level, eye(175, 0))).toBeCloseTo(165, 6);
});

test("half of a PEM is left at its degrees, all of it on the samples", () => {
  expect(fadeWeight(4, 0)).toBe(1);
  expect(fadeWeight(4, 4)).toBe(0.5);
  expect(fadeWeight(4, 12)).toBeCloseTo(0.1, 12);
});

import { describe, expect, test } from "vitest";
import { poseIn, roomAt } from "../../src/headset";
import type { Vec3 } from "../../src/manifest";
import {
  add,
  dot,
  lookAt,
  placeCamera,
  scale,
  subtract,
  type View,
  windowOf,
  windowOfProjection,
} from "../../src/math";

function emptyView(): View {
  return {
    eye: [0, 0, 0],
    forward: [0, 0, -1],
    middle: [0, 0, -1],
    right: [1, 0, 0],
    down: [0, -1, 0],
    clipFromWorld: new Float32Array(16),
  };
}

/// Where a point lands in an image, in pixels from the upper left corner, and its depth from -1 to 1.
function project(view: View, p: Vec3, width: number, height: number): Vec3 {
  const m = view.clipFromWorld;
  const clip = [0, 1, 2, 3].map((r) => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]);
  return [
    (0.5 + (0.5 * clip[0]) / clip[3]) * width,
    (0.5 - (0.5 * clip[1]) / clip[3]) * height,
    clip[2] / clip[3],
  ];
}

describe("a camera", () => {
  const pose = lookAt([1, 2, 3], [0.2, 0.1, -0.4]);
  const windows = {
    "in the middle": windowOf(0.6, 1.5),
    "moved sideways": windowOf(0.6, 1.5, 0.25),
    "of a headset's lens": { left: -1.1, right: 0.7, bottom: -0.9, top: 1.2 },
  };
  test.each(Object.entries(windows))("%s lands a pixel's ray on that pixel", (_, window) => {
    const [width, height] = [300, 200];
    const view = emptyView();
    placeCamera(view, pose, window, width, height, 0.5, 20);
    for (const [x, y] of [
      [0.5, 0.5],
      [150, 100],
      [299.5, 20.25],
    ]) {
      const ray = add(view.middle, add(scale(x - width / 2, view.right), scale(y - height / 2, view.down)));
      for (const depth of [0.5, 3, 20]) {
        const seen = project(view, add(view.eye, scale(depth, ray)), width, height);
        expect(seen[0]).toBeCloseTo(x, 2);
        expect(seen[1]).toBeCloseTo(y, 2);
        if (depth === 0.5) expect(seen[2]).toBeCloseTo(-1, 4);
        if (depth === 20) expect(seen[2]).toBeCloseTo(1, 4);
      }
    }
  });

  test("gives its window back from its projection", () => {
    const window = { left: -1.1, right: 0.7, bottom: -0.9, top: 1.2 };
    const view = emptyView();
    // An eye at the origin that looks along -Z: its matrix is the projection itself.
    placeCamera(view, lookAt([0, 0, 0], [0, 0, -1]), window, 100, 100, 0.1, 10);
    const back = windowOfProjection(view.clipFromWorld);
    for (const edge of ["left", "right", "bottom", "top"] as const)
      expect(back[edge]).toBeCloseTo(window[edge], 5);
  });
});

describe("a room in the scene", () => {
  const camera = lookAt([0.4, 0.5, 0.3], [0, 0.1, 0]);
  const distance = Math.hypot(...subtract([0.4, 0.5, 0.3], [0, 0.1, 0]));
  const room = roomAt(camera, distance);
  const identity = Float32Array.from([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);

  test("has the head where the camera was, upright, with the object ahead", () => {
    const head = poseIn(room, identity);
    expect(head.eye).toEqual(camera.eye);
    expect(head.up).toEqual([0, 1, 0]);
    expect(dot(head.forward, head.up)).toBeCloseTo(0, 6);
    expect(dot(head.forward, camera.right)).toBeCloseTo(0, 6);
    expect(dot(head.forward, camera.forward)).toBeGreaterThan(0);
    expect(dot(head.right, camera.right)).toBeCloseTo(1, 6);
  });

  test("is as large as its distances say: the object is 0.8 m away at first", () => {
    const moved = Float32Array.from(identity);
    moved.set([0.1, 0.2, -0.3], 12);
    const step = subtract(poseIn(room, moved).eye, camera.eye);
    expect(Math.hypot(...step)).toBeCloseTo((distance / 0.8) * Math.hypot(0.1, 0.2, 0.3), 6);
    expect(step[1]).toBeCloseTo((distance / 0.8) * 0.2, 6);
  });
});

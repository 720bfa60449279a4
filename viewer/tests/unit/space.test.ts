import { describe, expect, test } from "vitest";
import { SampleCache } from "../../src/cache";
import type { Axis } from "../../src/manifest";
import { type Blend, neighbours, nodeCount, place, wanted } from "../../src/space";

const arc: Axis = { name: "arc", values: [0, 0.5, 1], low: 0, high: 1, period: null };
const turn: Axis = { name: "azimuth", values: [0, 90, 180, 270], low: 0, high: 360, period: 360 };

function blendOf(axes: Axis[], point: number[], nearest = false): Blend {
  const nodes = nodeCount(axes);
  const blend = { indices: Array<number>(nodes).fill(0), weights: Array<number>(nodes).fill(0) };
  neighbours(axes, point, nearest, blend);
  return blend;
}

describe("a blend", () => {
  test("weighs the two samples of an arc by their distance", () => {
    expect(blendOf([arc], [0.625])).toEqual({ indices: [1, 2], weights: [0.75, 0.25] });
  });

  test("is the last sample alone beyond the ends", () => {
    expect(blendOf([arc], [7])).toEqual({ indices: [1, 2], weights: [0, 1] });
    expect(blendOf([arc], [-7])).toEqual({ indices: [0, 1], weights: [1, 0] });
  });

  test("closes where an axis has a period", () => {
    expect(place(turn, 315, false)).toEqual({ first: 3, second: 0, weight: 0.5 });
    expect(place(turn, -45, false)).toEqual({ first: 3, second: 0, weight: 0.5 });
  });

  test("of two axes has four samples in row-major order", () => {
    const { indices, weights } = blendOf([arc, turn], [0.25, 45]);
    expect([...indices].sort()).toEqual([0, 1, 4, 5]);
    expect(weights).toEqual([0.25, 0.25, 0.25, 0.25]);
  });

  test("without axes, or with one sample each, is that sample", () => {
    expect(blendOf([], [])).toEqual({ indices: [0], weights: [1] });
    expect(blendOf([{ ...arc, values: [0] }], [0.7])).toEqual({ indices: [0], weights: [1] });
  });

  test("of the nearest has a single weight", () => {
    expect(blendOf([arc], [0.7], true).weights).toEqual([1, 0]);
  });
});

const long: Axis = {
  name: "arc",
  values: Array.from({ length: 50 }, (_, i) => i),
  low: 0,
  high: 49,
  period: null,
};

test("samples are fetched from the neighbours on, the way the view moves", () => {
  const samples = long.values.map((v) => [v]);
  expect(wanted([long], samples, [3.4], [1], 4)).toEqual([3, 4, 5, 6]);
  expect(wanted([long], samples, [3.4], [-1], 4)).toEqual([3, 4, 2, 1]);
});

test("the cache keeps to its slots and leaves those that are drawn, over ten thousand random moves", async () => {
  const slots = new Set<number>();
  const taken: boolean[] = [];
  const cache: SampleCache = new SampleCache(
    [long],
    long.values.map((v) => [v]),
    5,
    async (_, slot) => {
      const { weights } = cache.blend;
      if (cache.share > 0) taken.push(cache.slotsOfBlend.some((s, k) => weights[k] > 0 && s === slot));
      slots.add(slot);
    },
    () => {},
    () => {},
  );
  let seed = 1;
  for (let i = 0; i < 10000; ++i) {
    seed = (seed * 48271) % 2147483647;
    cache.update([(seed / 2147483647) * 49], [i % 2 ? 1 : -1], false);
    if (i % 3 === 0) await Promise.resolve();
  }
  expect(slots.size).toBeLessThanOrEqual(5);
  expect(taken.length).toBeGreaterThan(100);
  expect(taken).not.toContain(true);
});

test("a sample that cannot be loaded is reported once, and its neighbour is drawn", async () => {
  const failed: number[] = [];
  const load = async (sample: number) => {
    if (sample === 1) throw new Error("damaged");
  };
  const cache = new SampleCache(
    [arc],
    [[0], [0.5], [1]],
    3,
    load,
    () => {},
    (sample) => failed.push(sample),
  );
  for (let i = 0; i < 20; ++i) {
    cache.update([0.5], [0], false);
    await Promise.resolve();
  }
  expect(failed).toEqual([1]);
  expect(cache.share).toBe(1);
});

/// Samples of a parameter space and the weights with which a point between them blends them
/// (mirrorbake/scene/parameters.py).

import type { Axis } from "./manifest";

export interface Blend {
  indices: number[];
  weights: number[];
}

/// How many samples a blend has at most: two along every axis that has more than one.
export function nodeCount(axes: Axis[]): number {
  return 2 ** axes.filter((axis) => axis.values.length > 1).length;
}

/// The nodes on both sides of a coordinate, and the weight of the second. Beyond the ends the last node alone.
export function place(
  axis: Axis,
  value: number,
  nearest: boolean,
): { first: number; second: number; weight: number } {
  const { values, period } = axis;
  const count = values.length;
  const x = period === null ? value : values[0] + ((((value - values[0]) % period) + period) % period);
  const last = period === null ? count - 1 : count;
  const knot = (i: number) => (i < count ? values[i] : values[0] + (period ?? 0));
  let second = 1;
  while (second < last && knot(second) <= x) ++second;
  second = Math.min(second, last);
  const first = Math.max(second - 1, 0);
  const span = knot(second) - knot(first);
  let weight = span > 0 ? Math.min(Math.max((x - knot(first)) / span, 0), 1) : 0;
  if (nearest) weight = Math.round(weight);
  return { first, second: second % count, weight };
}

/// The multilinear blend at a point, written into `blend`, whose arrays have nodeCount entries.
export function neighbours(axes: Axis[], point: number[], nearest: boolean, blend: Blend): void {
  blend.indices[0] = 0;
  blend.weights[0] = 1;
  let filled = 1;
  for (let a = 0; a < axes.length; ++a) {
    const count = axes[a].values.length;
    if (count === 1) continue;
    const { first, second, weight } = place(axes[a], point[a], nearest);
    for (let i = 0; i < filled; ++i) {
      blend.indices[filled + i] = blend.indices[i] * count + second;
      blend.weights[filled + i] = blend.weights[i] * weight;
      blend.indices[i] = blend.indices[i] * count + first;
      blend.weights[i] *= 1 - weight;
    }
    filled *= 2;
  }
}

/// Samples to fetch, the most urgent first: those next to the point, then on the way it moves, then the others.
/// `velocity` has a sign per axis.
export function wanted(
  axes: Axis[],
  samples: number[][],
  point: number[],
  velocity: number[],
  count: number,
): number[] {
  const urgency = samples.map((sample) => {
    let sum = 0;
    axes.forEach((axis, a) => {
      const { values, period } = axis;
      if (values.length === 1) return;
      const step = (axis.high - axis.low) / Math.max(period === null ? values.length - 1 : values.length, 1);
      let ahead = sample[a] - point[a];
      if (period !== null) ahead -= period * Math.round(ahead / period);
      const distance = Math.abs(ahead) / step;
      sum += (distance <= 1 ? distance : distance * (ahead * velocity[a] < 0 ? 2 : 1)) ** 2;
    });
    return sum;
  });
  return samples
    .map((_, i) => i)
    .sort((a, b) => urgency[a] - urgency[b])
    .slice(0, count);
}

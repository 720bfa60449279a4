/// Samples of a parameter and the weights with which a point between them blends them.

export interface Blend {
  indices: number[];
  weights: number[];
}

/// Samples on both sides of `value` and their weights, written into `blend`; `parameters` ascend. Beyond the ends the last
/// sample alone.
export function neighbours(parameters: number[], value: number, nearest: boolean, blend: Blend): void {
  const last = parameters.length - 1;
  let second = 1;
  while (second < last && parameters[second] < value) ++second;
  if (last === 0) second = 0;
  const first = Math.max(second - 1, 0);
  const span = parameters[second] - parameters[first];
  let weight = span > 0 ? Math.min(Math.max((value - parameters[first]) / span, 0), 1) : 0;
  if (nearest) weight = Math.round(weight);
  blend.indices[0] = first;
  blend.indices[1] = second;
  blend.weights[0] = 1 - weight;
  blend.weights[1] = weight;
}

/// Samples to fetch, the most urgent first: those that are blended, then on, the way the parameter moves, then back.
export function wanted(parameters: number[], value: number, speed: number, count: number): number[] {
  const last = parameters.length - 1;
  const span = last > 0 ? (parameters[last] - parameters[0]) / last : 1;
  const urgency = (i: number) => {
    const ahead = (parameters[i] - value) / span;
    const distance = Math.abs(ahead);
    return distance <= 1 ? distance : distance * (ahead * speed < 0 ? 2 : 1);
  };
  return parameters
    .map((_, i) => i)
    .sort((a, b) => urgency(a) - urgency(b))
    .slice(0, count);
}

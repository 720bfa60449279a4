/// Which samples are on the GPU, and which to fetch next.

import type { Axis } from "./manifest";
import { type Blend, neighbours, nodeCount, wanted } from "./space";

interface Slot {
  sample: number; // -1: empty
  ready: boolean;
}

/// Fetches and uploads one sample into a slot; rejects when it cannot.
export type Load = (sample: number, slot: number) => Promise<void>;

const AT_ONCE = 2;

export class SampleCache {
  private readonly slots: Slot[];
  private readonly failed = new Set<number>();
  private loading = 0;
  private generation = 0;
  /// What is drawn: slots and weights; `share` is 0 while nothing is there.
  readonly blend: Blend;
  readonly slotsOfBlend: number[];
  share = 0;
  private order: number[] = [];
  private orderKey = "";

  constructor(
    private readonly axes: Axis[],
    private readonly samples: number[][],
    capacity: number,
    private readonly load: Load,
    private readonly changed: () => void,
    private readonly fail: (sample: number, failure: unknown) => void,
  ) {
    const nodes = nodeCount(axes);
    this.blend = { indices: Array(nodes).fill(0), weights: Array(nodes).fill(0) };
    this.slotsOfBlend = Array(nodes).fill(0);
    this.slots = Array.from({ length: capacity }, () => ({ sample: -1, ready: false }));
  }

  /// Number of samples that are there, and the blend's own among them.
  get ready(): number {
    return this.slots.filter((s) => s.ready).length;
  }

  isReady(sample: number): boolean {
    return this.slots.some((s) => s.ready && s.sample === sample);
  }

  /// Sets what is drawn at a point and starts to fetch what is missing; `velocity` has a sign per axis.
  update(point: number[], velocity: number[], nearest: boolean): void {
    neighbours(this.axes, point, nearest, this.blend);
    let total = 0;
    for (let k = 0; k < this.slotsOfBlend.length; ++k) {
      const slot = this.slotOf(this.blend.indices[k]);
      this.slotsOfBlend[k] = Math.max(slot, 0);
      if (slot < 0) this.blend.weights[k] = 0;
      total += this.blend.weights[k];
    }
    if (total > 0) {
      for (let k = 0; k < this.slotsOfBlend.length; ++k) this.blend.weights[k] /= total;
      this.share = 1;
    } else {
      this.drawNearest(point);
    }
    this.fetch(point, velocity);
  }

  /// After a lost context: nothing is there any more.
  forget(): void {
    ++this.generation;
    this.loading = 0;
    for (const slot of this.slots) {
      slot.sample = -1;
      slot.ready = false;
    }
    this.share = 0;
  }

  private slotOf(sample: number): number {
    for (let i = 0; i < this.slots.length; ++i) {
      if (this.slots[i].ready && this.slots[i].sample === sample) return i;
    }
    return -1;
  }

  private drawNearest(point: number[]): void {
    let best = -1;
    let distance = Number.POSITIVE_INFINITY;
    for (let i = 0; i < this.slots.length; ++i) {
      if (!this.slots[i].ready) continue;
      const sample = this.samples[this.slots[i].sample];
      let d = 0;
      for (let a = 0; a < point.length; ++a) d += Math.abs(sample[a] - point[a]);
      if (d < distance) {
        best = i;
        distance = d;
      }
    }
    this.share = best >= 0 ? 1 : 0;
    this.slotsOfBlend.fill(Math.max(best, 0));
    this.blend.weights.fill(0);
    this.blend.weights[0] = 1;
  }

  private fetch(point: number[], velocity: number[]): void {
    if (this.loading >= AT_ONCE) return;
    const key = `${this.blend.indices.join()}/${velocity.join()}`;
    if (key !== this.orderKey) {
      this.orderKey = key;
      this.order = wanted(this.axes, this.samples, point, velocity, this.slots.length);
    }
    for (const sample of this.order) {
      if (this.loading >= AT_ONCE) return;
      if (this.failed.has(sample) || this.slots.some((s) => s.sample === sample)) continue;
      const slot = this.victim();
      if (slot < 0) return;
      this.start(sample, slot);
    }
  }

  /// A slot that nothing draws and whose sample is not wanted.
  private victim(): number {
    let best = -1;
    let rank = -1;
    for (let i = 0; i < this.slots.length; ++i) {
      const { sample, ready } = this.slots[i];
      if (sample < 0) return i;
      if (!ready || (this.share > 0 && this.slotsOfBlend.includes(i))) continue;
      const place = this.order.indexOf(sample);
      const unwanted = place < 0 ? Number.POSITIVE_INFINITY : place;
      if (place < 0 && unwanted > rank) {
        best = i;
        rank = unwanted;
      }
    }
    return best;
  }

  private start(sample: number, slot: number): void {
    const { generation } = this;
    this.slots[slot].sample = sample;
    this.slots[slot].ready = false;
    ++this.loading;
    this.load(sample, slot).then(
      () => {
        if (generation !== this.generation) return;
        this.slots[slot].ready = true;
        --this.loading;
        this.changed();
      },
      (failure) => {
        if (generation !== this.generation) return;
        this.slots[slot].sample = -1;
        --this.loading;
        this.failed.add(sample);
        this.fail(sample, failure);
        this.changed();
      },
    );
  }
}

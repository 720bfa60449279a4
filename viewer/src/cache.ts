/// Which samples are on the GPU, and which to fetch next.

import { type Blend, neighbours, wanted } from "./space";

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
  readonly blend: Blend = { indices: [0, 0], weights: [1, 0] };
  readonly slotsOfBlend = [0, 0];
  share = 0;
  private order: number[] = [];
  private orderKey = "";

  constructor(
    private readonly parameters: number[],
    capacity: number,
    private readonly load: Load,
    private readonly changed: () => void,
    private readonly fail: (sample: number, failure: unknown) => void,
  ) {
    this.slots = Array.from({ length: capacity }, () => ({ sample: -1, ready: false }));
  }

  /// Number of samples that are there, and the blend's own among them.
  get ready(): number {
    return this.slots.filter((s) => s.ready).length;
  }

  isReady(sample: number): boolean {
    return this.slots.some((s) => s.ready && s.sample === sample);
  }

  /// Sets what is drawn at `value` and starts to fetch what is missing. Allocates nothing while the value stays between the
  /// same two samples.
  update(value: number, speed: number, nearest: boolean): void {
    neighbours(this.parameters, value, nearest, this.blend);
    let total = 0;
    for (let k = 0; k < 2; ++k) {
      const slot = this.slotOf(this.blend.indices[k]);
      this.slotsOfBlend[k] = Math.max(slot, 0);
      if (slot < 0) this.blend.weights[k] = 0;
      total += this.blend.weights[k];
    }
    if (total > 0) {
      for (let k = 0; k < 2; ++k) this.blend.weights[k] /= total;
      this.share = 1;
    } else {
      this.drawNearest(value);
    }
    this.fetch(value, speed);
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

  private drawNearest(value: number): void {
    let best = -1;
    let distance = Number.POSITIVE_INFINITY;
    for (let i = 0; i < this.slots.length; ++i) {
      if (!this.slots[i].ready) continue;
      const d = Math.abs(this.parameters[this.slots[i].sample] - value);
      if (d < distance) {
        best = i;
        distance = d;
      }
    }
    this.share = best >= 0 ? 1 : 0;
    this.slotsOfBlend[0] = Math.max(best, 0);
    this.slotsOfBlend[1] = this.slotsOfBlend[0];
    this.blend.weights[0] = 1;
    this.blend.weights[1] = 0;
  }

  private fetch(value: number, speed: number): void {
    if (this.loading >= AT_ONCE) return;
    const key = `${this.blend.indices[0]}/${this.blend.indices[1]}/${Math.sign(speed)}`;
    if (key !== this.orderKey) {
      this.orderKey = key;
      this.order = wanted(this.parameters, value, speed, this.slots.length);
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

/// The page's side of the worker that decodes images.

import type { RadianceCode } from "./atlas";
import DecodeWorker from "./decode.worker?worker&inline";
import { UserError } from "./errors";
import type { Projection } from "./projection";

export type DecodeRequest = { bytes: ArrayBuffer; type: string } & (
  | { kind: "probe" }
  | { kind: "still"; code: RadianceCode }
  | ({ kind: "radiance"; size: number; projection: Projection; code: RadianceCode } & Parts)
  | ({ kind: "alpha"; size: number; projection: Projection } & Parts)
  | { kind: "texture" }
);

/// Of an image that is kept for others, or is made whole by one that was.
interface Parts {
  /// Under which the decoded image is kept.
  keep?: string;
  /// Name of a kept image, which all blocks come from that are not the image's own.
  base?: string;
  blocks?: Uint8Array;
}

export interface Decoded {
  width: number;
  height: number;
  packed?: Uint32Array;
  alpha?: Uint8Array;
  /// RGBA of a texture.
  pixels?: Uint8Array;
  colours?: number[][];
}

interface Waiting {
  name: string;
  resolve: (result: Decoded) => void;
  reject: (failure: UserError) => void;
}

export class Decoder {
  private readonly worker = new DecodeWorker();
  private readonly waiting = new Map<number, Waiting>();
  private last = 0;

  constructor() {
    this.worker.onmessage = (event: MessageEvent<{ id: number; result?: Decoded; failure?: string }>) => {
      const { id, result, failure } = event.data;
      const waiting = this.waiting.get(id);
      this.waiting.delete(id);
      if (!waiting) return;
      if (result) waiting.resolve(result);
      else waiting.reject(new UserError("damaged", `The file ${waiting.name} is damaged: ${failure}.`));
    };
  }

  /// Rejects with a UserError that names the file.
  decode(name: string, request: DecodeRequest): Promise<Decoded> {
    const id = ++this.last;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { name, resolve, reject });
      this.worker.postMessage({ id, ...request }, [request.bytes]);
    });
  }
}

/// Whether colours that came back are those that everybody else sees: rounding in a decoder is 2 steps at most, a wrong range,
/// matrix or colour space tens of them.
export function sameColours(seen: number[][], expected: number[][]): boolean {
  return (
    seen.length === expected.length &&
    seen.every((colour, i) => colour.every((value, c) => Math.abs(value - expected[i][c]) <= 4))
  );
}

/// Where the page's files come from: beside it on a server, or inside it.

import { UserError } from "./errors";

export interface Files {
  read(name: string): Promise<ArrayBuffer>;
}

/// Files beside the page.
export class ServedFiles implements Files {
  constructor(private readonly base: string) {}

  async read(name: string): Promise<ArrayBuffer> {
    let response: Response;
    try {
      response = await fetch(this.base + name);
    } catch {
      throw new UserError("missing", `The file ${name} could not be loaded: no connection to the server.`);
    }
    if (!response.ok) {
      throw new UserError(
        "missing",
        `The file ${name} could not be loaded: the server answered ${response.status}.`,
      );
    }
    return response.arrayBuffer();
  }
}

/// Files inside the page, each in a script that calls `mirrorbakeFile(name, base64)` once it has arrived, so that the page can
/// begin with the first ones while the others are still on their way.
export class EmbeddedFiles implements Files {
  private readonly arrived = new Map<string, string>();
  private readonly waiting = new Map<string, ((text: string) => void)[]>();

  constructor() {
    const global = window as unknown as {
      mirrorbakeFile: (name: string, text: string) => void;
      mirrorbakeArrived?: [string, string][];
    };
    const arrive = (name: string, text: string) => {
      this.arrived.set(name, text);
      for (const resolve of this.waiting.get(name) ?? []) resolve(text);
      this.waiting.delete(name);
    };
    for (const [name, text] of global.mirrorbakeArrived ?? []) arrive(name, text);
    global.mirrorbakeFile = arrive;
  }

  async read(name: string): Promise<ArrayBuffer> {
    const text = this.arrived.get(name) ?? (await this.wait(name));
    const bytes = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return bytes.buffer;
  }

  private wait(name: string): Promise<string> {
    return new Promise((resolve, reject) => {
      const lost = () => {
        if (!this.arrived.has(name)) {
          reject(new UserError("missing", `The file ${name} is missing: this page did not arrive whole.`));
        }
      };
      if (document.readyState === "loading")
        document.addEventListener("DOMContentLoaded", lost, { once: true });
      else lost();
      this.waiting.set(name, [...(this.waiting.get(name) ?? []), resolve]);
    });
  }
}

export function textOf(bytes: ArrayBuffer): string {
  return new TextDecoder().decode(bytes);
}

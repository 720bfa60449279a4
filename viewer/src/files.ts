/// Where the page's files come from: beside it on a server, or inside it.

import { UserError } from "./errors";
import { bytesOfText } from "./text";

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

/// A file inside the page: so many bytes, as `bytesOfText` reads them.
interface Arrived {
  count: number;
  text: string;
}

/// Files inside the page, each in a script that calls `mirrorbakeFile(name, count, text)` once it has arrived, so that the page
/// can begin with the first ones while the others are still on their way.
export class EmbeddedFiles implements Files {
  private readonly arrived = new Map<string, Arrived>();
  private readonly waiting = new Map<string, ((file: Arrived) => void)[]>();

  constructor() {
    const global = window as unknown as {
      mirrorbakeFile: (name: string, count: number, text: string) => void;
    };
    global.mirrorbakeFile = (name, count, text) => {
      const file = { count, text };
      this.arrived.set(name, file);
      for (const resolve of this.waiting.get(name) ?? []) resolve(file);
      this.waiting.delete(name);
    };
  }

  async read(name: string): Promise<ArrayBuffer> {
    const { count, text } = this.arrived.get(name) ?? (await this.wait(name));
    return bytesOfText(text, count).buffer;
  }

  private wait(name: string): Promise<Arrived> {
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

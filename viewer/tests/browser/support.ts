import { existsSync, readFileSync } from "node:fs";
import { createServer, type Server } from "node:http";
import { extname, join, normalize } from "node:path";
import { type Browser, type BrowserContext, chromium, type Page } from "playwright-core";
import type { App } from "../../src/app";

declare global {
  interface Window {
    mirrorbake: App;
  }
}

/// Where tests/support/viewer_cases.py has written its cases.
export const CASES = process.env.MIRRORBAKE_VIEWER_CASES ?? "../build/viewer-cases";

export const CHROMIUM = process.env.CHROMIUM ?? "/usr/bin/chromium";

export function launch(): Promise<Browser> {
  return chromium.launch({
    executablePath: CHROMIUM,
    args: [
      "--no-sandbox",
      "--disable-quic",
      "--no-first-run",
      "--disable-background-networking",
      "--disable-component-update",
      "--disable-sync",
      "--use-angle=swiftshader",
      "--enable-unsafe-swiftshader",
    ],
  });
}

const TYPES: { [suffix: string]: string } = {
  ".html": "text/html",
  ".js": "text/javascript",
  ".css": "text/css",
  ".json": "application/json",
  ".avif": "image/avif",
  ".webp": "image/webp",
};

export interface Site {
  url: string;
  server: Server;
  /// Names (beginnings) that are answered by these bytes, or by 404 for null.
  replaced: Map<string, Buffer | null>;
  /// Milliseconds before an answer to a name that contains the text.
  delays: Map<string, number>;
  requests: string[];
}

/// Serves a folder on a port of its own.
export async function serve(folder: string): Promise<Site> {
  const site: Partial<Site> = { replaced: new Map(), delays: new Map(), requests: [] };
  const server = createServer(async (request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url ?? "/", "http://x").pathname)).slice(1);
    const name = path === "" ? "index.html" : path;
    site.requests?.push(name);
    for (const [part, delay] of site.delays ?? []) {
      if (name.includes(part)) await new Promise((resolve) => setTimeout(resolve, delay));
    }
    const replaced = [...(site.replaced ?? [])].find(([start]) => name.startsWith(start));
    const file = join(folder, name);
    if (replaced ? replaced[1] === null : !existsSync(file)) {
      response.writeHead(404).end();
      return;
    }
    response.writeHead(200, { "content-type": TYPES[extname(name)] ?? "application/octet-stream" });
    response.end(replaced?.[1] ?? readFileSync(file));
  });
  await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
  const address = server.address();
  if (typeof address !== "object" || !address) throw new Error("no port");
  site.url = `http://127.0.0.1:${address.port}/`;
  site.server = server;
  return site as Site;
}

export interface Opened {
  page: Page;
  context: BrowserContext;
  errors: string[];
}

/// Opens a page and waits until all samples are there, or for as long as `until` says.
export async function open(
  browser: Browser,
  url: string,
  options: { width?: number; height?: number; touch?: boolean; until?: () => unknown } = {},
): Promise<Opened> {
  const context = await browser.newContext({
    viewport: { width: options.width ?? 320, height: options.height ?? 240 },
    hasTouch: options.touch ?? false,
  });
  const page = await context.newPage();
  const errors: string[] = [];
  page.on("pageerror", (error) => errors.push(error.message));
  await page.goto(url);
  await page.waitForFunction(options.until ?? (() => window.mirrorbake.scene?.cache.ready === 3), undefined, {
    timeout: 20000,
  });
  return { page, context, errors };
}

/// Waits until the page has drawn what it was last told to.
export async function settle(page: Page): Promise<void> {
  await page.waitForFunction(() => window.mirrorbake.isDrawn, undefined, { timeout: 60000 });
}

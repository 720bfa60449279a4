import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { CASES, launch, type Opened, open, type Site, serve, settle } from "./support";

let browser: Browser;
let site: Site;
beforeAll(async () => {
  browser = await launch();
  site = await serve(join(CASES, "box"));
});
afterAll(async () => {
  await browser.close();
  site.server.close();
});

const small = { width: 320, height: 420 };

function settings(page: Page) {
  return page.evaluate(() => ({ ...window.mirrorbake.settings }));
}

/// Takes the graphics context away for a moment.
function loseContext(page: Page) {
  return page.evaluate(async () => {
    const gl = window.mirrorbake.scene?.renderer.gl;
    const extension = gl?.getExtension("WEBGL_lose_context");
    extension?.loseContext();
    await new Promise((resolve) => setTimeout(resolve, 200));
    const restored = new Promise((resolve) => gl?.canvas.addEventListener("webglcontextrestored", resolve));
    extension?.restoreContext();
    await restored;
  });
}

describe("controls", () => {
  let opened: Opened;
  beforeAll(async () => {
    opened = await open(browser, site.url, { ...small, touch: true });
  });
  afterAll(async () => {
    expect(opened.errors).toEqual([]);
    await opened.context.close();
  });

  test("the mouse turns and zooms", async () => {
    const { page } = opened;
    const before = await settings(page);
    await page.mouse.move(160, 200);
    await page.mouse.down();
    await page.mouse.move(200, 220);
    await page.mouse.up();
    await page.mouse.wheel(0, 100);
    await settle(page);
    const after = await settings(page);
    expect(after.azimuth).toBeCloseTo(before.azimuth - 10, 3);
    expect(after.elevation).toBeCloseTo(before.elevation + 5, 3);
    expect(after.distance).toBeGreaterThan(before.distance);
  });

  test("a finger turns", async () => {
    const { page } = opened;
    const before = await settings(page);
    const client = await opened.context.newCDPSession(page);
    const touch = (type: string, x: number, y: number) =>
      client.send("Input.dispatchTouchEvent", {
        type: type as "touchStart",
        touchPoints: type === "touchEnd" ? [] : [{ x, y }],
      });
    await touch("touchStart", 100, 200);
    await touch("touchMove", 140, 200);
    await touch("touchEnd", 140, 200);
    await settle(page);
    expect((await settings(page)).azimuth).not.toBe(before.azimuth);
  });

  test("two fingers zoom, and a finger drags the divider", async () => {
    const { page } = opened;
    const client = await opened.context.newCDPSession(page);
    const touch = (type: "touchStart" | "touchMove" | "touchEnd", points: [number, number][]) =>
      client.send("Input.dispatchTouchEvent", {
        type,
        touchPoints: points.map(([x, y], id) => ({ x, y, id })),
      });
    const { distance } = await settings(page);
    await touch("touchStart", [
      [140, 200],
      [180, 200],
    ]);
    await touch("touchMove", [
      [110, 200],
      [210, 200],
    ]);
    await touch("touchEnd", []);
    expect((await settings(page)).distance).toBeLessThan(0.8 * distance);
    await page.evaluate(() => window.mirrorbake.change({ compare: "static", divider: 0.5 }));
    await settle(page);
    await touch("touchStart", [[0.5 * small.width, 210]]);
    await touch("touchMove", [[0.3 * small.width, 210]]);
    await touch("touchEnd", []);
    expect((await settings(page)).divider).toBeCloseTo(0.3, 1);
    await page.evaluate(() => window.mirrorbake.change({ compare: "off" }));
    await page.keyboard.press("Home");
    await settle(page);
  });

  test("keys turn, zoom, step, play and reset", async () => {
    const { page } = opened;
    await page.locator("canvas").focus();
    await page.keyboard.press("Home");
    const home = await settings(page);
    await page.keyboard.press("ArrowRight");
    await page.keyboard.press("ArrowUp");
    await page.keyboard.press("+");
    const turned = await settings(page);
    expect(turned.azimuth).toBeLessThan(home.azimuth);
    expect(turned.elevation).toBeLessThan(home.elevation);
    expect(turned.distance).toBeLessThan(home.distance);
    await page.keyboard.press("Home");
    expect((await settings(page)).azimuth).toBe(home.azimuth);
    await page.keyboard.press("]");
    expect((await settings(page)).azimuth).toBeGreaterThan(home.azimuth);
    await page.keyboard.press(" ");
    expect(await page.locator("#play").textContent()).toBe("Pause");
    await page.keyboard.press(" ");
    expect(await page.locator("#play").textContent()).toBe("Play");
    await page.keyboard.press("Home");
  });

  test("the slider follows the parameter and sets it", async () => {
    const { page } = opened;
    await page.locator("#axis-arc").fill("0.25");
    await settle(page);
    expect((await settings(page)).azimuth).toBeCloseTo(5, 1);
  });

  test("every setting can be chosen, and is in the link", async () => {
    const { page } = opened;
    await page.locator("#menu").click();
    for (const id of ["shell-0", "shell-1", "diffuse", "fresnel", "blended", "lookups", "stereo"]) {
      await page.locator(`#${id}`).click({ force: true });
    }
    await page.locator("#toneMapping").selectOption("none");
    await page.locator("#background").selectOption("plain");
    await page.locator("#theme").selectOption("dark");
    await page.locator("#exposure").fill("1.5");
    await page.waitForFunction(
      () => location.hash.includes("theme=dark") && location.hash.includes("ev=1.5"),
    );
    const link = new URLSearchParams(new URL(page.url()).hash.slice(1));
    expect(Object.fromEntries(link)).toMatchObject({
      shells: "00",
      diffuse: "0",
      fresnel: "0",
      nearest: "1",
      lookups: "1",
      stereo: "1",
      tone: "none",
      bg: "plain",
      theme: "dark",
      ev: "1.5",
    });
    for (const id of ["shell-0", "shell-1", "diffuse", "fresnel", "blended", "lookups", "stereo"]) {
      await page.locator(`#${id}`).click({ force: true });
    }
    await page.locator("#reset").click();
    expect((await settings(page)).exposure).toBe(0);
    const download = page.waitForEvent("download");
    await page.locator("#screenshot").click();
    expect((await download).suggestedFilename()).toBe("box.png");
    await page.locator("#menu").click();
    expect(await page.locator("#panel").isVisible()).toBe(false);
  }, 180000);

  test("every switch, choice and button works by a tap and by keys", async () => {
    const { page } = opened;
    // Chromium draws in software: tests do not wait for pictures here, only for what they are told.
    await page.locator("#menu").tap();
    expect(await page.locator("#panel").isVisible()).toBe(true);
    for (const id of ["shell-0", "shell-1", "diffuse", "fresnel", "blended", "lookups", "stereo"]) {
      const input = page.locator(`#${id}`);
      const before = await input.isChecked();
      await input.tap({ force: true });
      expect(await input.isChecked(), `${id} by a tap`).toBe(!before);
      await input.focus();
      await page.keyboard.press("Space");
      expect(await input.isChecked(), `${id} by a key`).toBe(before);
    }
    for (const id of ["toneMapping", "background", "theme"]) {
      const select = page.locator(`#${id}`);
      const before = await select.inputValue();
      const isFirst = await select.evaluate((node) => (node as HTMLSelectElement).selectedIndex === 0);
      await select.focus();
      await page.keyboard.press(isFirst ? "ArrowDown" : "ArrowUp");
      expect(await select.inputValue(), id).not.toBe(before);
      await select.selectOption(before);
    }
    await page.locator("#exposure").focus();
    await page.keyboard.press("ArrowRight");
    expect((await settings(page)).exposure).toBeCloseTo(0.1, 5);
    const { azimuth } = await settings(page);
    await page.locator("#axis-arc").focus();
    await page.keyboard.press("ArrowRight");
    expect((await settings(page)).azimuth).toBeGreaterThan(azimuth);
    await page.locator("#reset").focus();
    await page.keyboard.press("Enter");
    expect((await settings(page)).exposure).toBe(0);
    await page.locator("#menu").focus();
    await page.keyboard.press("Enter");
    expect(await page.locator("#panel").isVisible()).toBe(false);
    const play = page.locator("#play");
    await play.tap();
    expect(await play.textContent()).toBe("Pause");
    await play.focus();
    await page.keyboard.press("Enter");
    expect(await play.textContent()).toBe("Play");
    await settle(page);
  }, 180000);

  test("the divider compares with a static map, and moves by mouse and keys", async () => {
    const { page } = opened;
    await page.evaluate(() => window.mirrorbake.change({ compare: "static", divider: 0.5 }));
    await settle(page);
    const divider = page.locator(".divider");
    await divider.focus();
    await page.keyboard.press("ArrowLeft");
    expect((await settings(page)).divider).toBeCloseTo(0.48, 5);
    await settle(page);
    await page.mouse.move(0.48 * small.width, 210);
    await page.mouse.down();
    await page.mouse.move(0.75 * small.width, 210);
    await page.mouse.up();
    expect((await settings(page)).divider).toBeCloseTo(0.75, 1);
    await settle(page);
    expect(await divider.getAttribute("aria-valuenow")).toBe("75");
  });

  test("comparing with ray tracing snaps to samples and shows their pictures", async () => {
    const { page } = opened;
    await page.evaluate(() => window.mirrorbake.change({ compare: "raytraced", divider: 0, exposure: 0 }));
    await page.waitForTimeout(1000);
    await settle(page);
    const pixel = await page.evaluate(() => {
      const { scene, settings } = window.mirrorbake;
      if (!scene) return [];
      const pixels = scene.readLinear(settings, 32, 24);
      const middle = 4 * (12 * 32 + 16);
      return Array.from(pixels.slice(middle, middle + 3));
    });
    const sample = await page.evaluate(() =>
      window.mirrorbake.scene?.nearestSample(window.mirrorbake.settings),
    );
    // The pictures of the cases are grey: 0.2 and 0.2 more for each sample; the code's step is 4 %.
    for (const value of pixel) expect(value / (0.2 + 0.2 * (sample ?? 0))).toBeCloseTo(1, 1);
    await page.evaluate(() => window.mirrorbake.change({ compare: "off" }));
  });

  test("everything that can be operated has a name for screen readers", async () => {
    const { page } = opened;
    const nameless = await page.evaluate(() =>
      [...document.querySelectorAll("button, input, select, canvas, [role=slider]")]
        .filter((node) => {
          const label =
            node.getAttribute("aria-label") ?? node.closest("label")?.textContent ?? node.textContent;
          return !label?.trim();
        })
        .map((node) => node.outerHTML),
    );
    expect(nameless).toEqual([]);
  });

  test("nothing is allocated, uploaded or compiled while the view stays between the same samples", async () => {
    const { page } = opened;
    const counts = () =>
      page.evaluate(() => ({
        ...window.mirrorbake.scene?.renderer.counters,
        frames: window.mirrorbake.frames,
      }));
    await page.evaluate(() => window.mirrorbake.change({ azimuth: 2 }));
    await settle(page);
    const before = await counts();
    for (let i = 1; i <= 5; ++i) {
      await page.evaluate((a) => window.mirrorbake.change({ azimuth: a, elevation: 20 + a }), 2 + i);
      await settle(page);
    }
    const after = await counts();
    expect(after.frames).toBeGreaterThanOrEqual(before.frames + 5);
    expect({ ...after, frames: 0 }).toEqual({ ...before, frames: 0 });
  });

  test("another size of the window is drawn at its size", async () => {
    const { page } = opened;
    await page.setViewportSize({ width: 390, height: 300 });
    await page.waitForFunction(() => document.querySelector("canvas")?.width === 390);
    expect(await page.evaluate(() => document.documentElement.scrollWidth)).toBe(390);
    await page.setViewportSize(small);
  });

  test("a lost context comes back and draws the same", async () => {
    const { page } = opened;
    const picture = () =>
      page.evaluate(() => {
        const { scene, settings } = window.mirrorbake;
        return scene ? Array.from(scene.readLinear(settings, 40, 30)) : [];
      });
    const before = await picture();
    await loseContext(page);
    await page.waitForFunction(() => window.mirrorbake.scene?.cache.ready === 3, undefined, {
      timeout: 20000,
    });
    await settle(page);
    expect(await picture()).toEqual(before);
  });
});

describe("what is missing or damaged is said in a sentence", () => {
  const cases: [string, string, Buffer | null, RegExp][] = [
    ["a missing description", "manifest.json", null, /manifest\.json could not be loaded.*404/],
    ["a damaged description", "manifest.json", Buffer.from("{"), /manifest\.json is damaged/],
    ["a missing mesh", "mesh.bin.gz", null, /mesh\.bin\.gz could not be loaded/],
    ["a damaged mesh", "mesh.bin.gz", Buffer.from("no gzip"), /mesh's file is damaged/],
    ["a missing map", "samples/00001/0.webp", null, /samples\/00001\/0\.webp could not be loaded/],
    ["a damaged map", "samples/00001/0.webp", Buffer.from("no image"), /samples\/00001\/0\.webp is damaged/],
    [
      "an image that the browser cannot show",
      "probe.webp",
      Buffer.from("no image"),
      /does not show WebP images/,
    ],
  ];
  test.each(cases)("%s", async (_, name, bytes, sentence) => {
    const own = await serve(join(CASES, "infinite"));
    own.replaced.set(name, bytes);
    const { page, context } = await open(browser, own.url, {
      ...small,
      until: () => document.querySelector("[role=alert]:not([hidden])") !== null,
    });
    expect(await page.locator("[role=alert]").textContent()).toMatch(sentence);
    await context.close();
    own.server.close();
  });

  test("no WebGL 2", async () => {
    const context = await browser.newContext({ viewport: small });
    const page = await context.newPage();
    await page.addInitScript(() => {
      HTMLCanvasElement.prototype.getContext = () => null;
    });
    await page.goto(site.url);
    await page.locator("[role=alert]:not([hidden])").waitFor();
    expect(await page.locator("[role=alert]").textContent()).toMatch(/no WebGL 2/);
    await context.close();
  });
});

test("a browser that shows AVIF wrongly gets the exact images", async () => {
  const own = await serve(join(CASES, "avif"));
  own.replaced.set("probe.avif", Buffer.from("no image"));
  const { context, errors } = await open(browser, own.url, small);
  expect(own.requests.filter((name) => name.startsWith("samples/"))).toEqual([]);
  expect(own.requests.filter((name) => name.startsWith("exact/samples/")).length).toBeGreaterThan(0);
  expect(errors).toEqual([]);
  await context.close();
  own.server.close();
});

test("until the first sample is there the object is drawn from the static map", async () => {
  const own = await serve(join(CASES, "sphere"));
  own.delays.set("samples/", 3000);
  const { page, context } = await open(browser, own.url, {
    ...small,
    until: () => window.mirrorbake.frames > 0,
  });
  expect(await page.evaluate(() => window.mirrorbake.scene?.cache.share)).toBe(0);
  await page.waitForFunction(() => window.mirrorbake.scene?.cache.ready === 3, undefined, { timeout: 20000 });
  expect(await page.evaluate(() => window.mirrorbake.scene?.cache.share)).toBe(1);
  await context.close();
  own.server.close();
});

test("a lightmap is that at rest until a sample is there, and comes back after a lost context", async () => {
  const own = await serve(join(CASES, "lightmap-open-moving"));
  own.delays.set("samples/", 3000);
  const { page, context, errors } = await open(browser, own.url, {
    ...small,
    until: () => window.mirrorbake.frames > 0,
  });
  /// The light of the body alone, at the first sample, whose lightmap is that at rest.
  const body = () =>
    page.evaluate(() => {
      const { scene, settings } = window.mirrorbake;
      if (!scene) throw new Error("no scene");
      const s = { ...settings, ...scene.at(settings, scene.manifest.axes[0], 0) };
      scene.prepare(s, [0]);
      const [lit, dark] = [true, false].map((diffuse) => scene.readLinear({ ...s, diffuse }, 64, 48));
      return { share: scene.cache.share, light: Array.from(lit, (value, i) => value - dark[i]) };
    });
  const ready = () =>
    page.waitForFunction(() => window.mirrorbake.scene?.cache.ready === 3, undefined, { timeout: 20000 });
  const atRest = await body();
  expect(atRest.share).toBe(0);
  expect(Math.max(...atRest.light)).toBeGreaterThan(0.1);
  await ready();
  const ofSample = await body();
  expect(ofSample.share).toBe(1);
  // Half floats of what is reflected besides.
  for (let i = 0; i < atRest.light.length; ++i) expect(ofSample.light[i]).toBeCloseTo(atRest.light[i], 2);
  own.delays.clear();
  await loseContext(page);
  await ready();
  await settle(page);
  expect((await body()).light).toEqual(ofSample.light);
  expect(errors).toEqual([]);
  await context.close();
  own.server.close();
}, 120000);

test("a PEM shows the controls that it has a use for, and names its sliders where there are several", async () => {
  const own = await serve(join(CASES, "infinite"));
  const manifest = JSON.parse(readFileSync(join(CASES, "infinite", "manifest.json"), "utf8"));
  manifest.mesh.arrays.irradiance = undefined;
  manifest.axes.push({ name: "light", values: [0], low: 0, high: 1, period: null });
  for (const sample of manifest.samples) sample.parameter.push(0);
  own.replaced.set("manifest.json", Buffer.from(JSON.stringify(manifest)));
  const { page, context, errors } = await open(browser, own.url, small);
  for (const name of ["arc", "light"])
    expect(await page.locator("footer").getByText(name).isVisible()).toBe(true);
  await page.locator("#menu").click();
  expect(await page.getByLabel("Fresnel").count()).toBe(1);
  expect(await page.getByLabel("diffuse").count()).toBe(0);
  expect(errors).toEqual([]);
  await context.close();
  // One slider alone is told by what it does, and there the body is diffuse.
  const single = await open(browser, site.url, small);
  expect(await single.page.locator("footer").getByText("arc").isVisible()).toBe(false);
  await single.page.locator("#menu").click();
  expect(await single.page.getByLabel("diffuse").count()).toBe(1);
  await single.context.close();
  own.server.close();
});

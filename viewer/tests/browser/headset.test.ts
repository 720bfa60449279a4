import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { CASES, launch, type Site, serve, settle } from "./support";

// An emulated headset (iwer, Meta's Immersive Web Emulation Runtime): two eyes of different windows, side by side in the canvas.
interface EmulatedDevice {
  installRuntime(options: { forceInstall: boolean }): void;
  stereoEnabled: boolean;
  ipd: number;
  position: { set(x: number, y: number, z: number): void };
}
declare global {
  interface Window {
    IWER: { XRDevice: new (config: unknown) => EmulatedDevice; metaQuest3: unknown };
    device: EmulatedDevice;
  }
}

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

test("in a headset each eye is drawn from its own place, and the head moves through the samples", async () => {
  const context = await browser.newContext({ viewport: { width: 320, height: 420 } });
  const page = await context.newPage();
  const errors: string[] = [];
  page.on("pageerror", (error) => errors.push(error.message));
  await page.addInitScript({ path: join(import.meta.dirname, "../../node_modules/iwer/build/iwer.min.js") });
  await page.addInitScript(() => {
    window.device = new window.IWER.XRDevice(window.IWER.metaQuest3);
    window.device.stereoEnabled = true;
    window.device.installRuntime({ forceInstall: true });
  });
  await page.goto(site.url);
  await page.waitForFunction(() => window.mirrorbake.scene?.cache.ready === 3, undefined, { timeout: 20000 });
  await page.locator("#menu").click();
  // What the page draws for an eye, and from where.
  await page.evaluate(() => {
    const scene = window.mirrorbake.scene;
    if (!scene) throw new Error("no scene");
    const eyes: number[][] = [];
    Object.assign(window, { eyes });
    const drawEye = scene.drawEye.bind(scene);
    scene.drawEye = (s, pose, window, framebuffer, place) => {
      eyes.push([...pose.eye, window.left, window.right, place.x, place.width, s.azimuth, s.distance]);
      drawEye(s, pose, window, framebuffer, place);
    };
  });
  await page.locator("#headset").click();
  const eyesAfter = async (count: number) => {
    await page.waitForFunction((n) => (window as unknown as { eyes: number[][] }).eyes.length > n, count, {
      timeout: 60000,
    });
    return page.evaluate(() => (window as unknown as { eyes: number[][] }).eyes.slice(-2));
  };
  const first = await eyesAfter(3);
  const [left, right] = first[0][5] < first[1][5] ? first : [first[1], first[0]];
  const apart = Math.hypot(left[0] - right[0], left[1] - right[1], left[2] - right[2]);
  const { ipd, distance } = await page.evaluate(() => ({
    ipd: window.device.ipd,
    distance: window.mirrorbake.settings.distance,
  }));
  expect(apart).toBeCloseTo((ipd * distance) / 0.8, 4);
  expect(right[5]).toBeGreaterThanOrEqual(left[5] + left[6]);
  expect(left[3]).toBeLessThan(0);
  expect(left[4]).toBeGreaterThan(0);
  // A step to the right turns about the object.
  await page.evaluate(() => window.device.position.set(0.3, 1.6, 0));
  const count = await page.evaluate(() => (window as unknown as { eyes: number[][] }).eyes.length);
  const moved = await eyesAfter(count + 3);
  expect(moved[0][7]).toBeGreaterThan(left[7] + 5);
  expect(await page.locator("#headset").textContent()).toBe("Leave the headset");
  await page.evaluate(() => document.getElementById("headset")?.click());
  await page.waitForFunction(() => document.getElementById("headset")?.textContent === "Headset");
  // The page draws by itself again.
  const frames = await page.evaluate(() => window.mirrorbake.frames);
  await page.evaluate(() => window.mirrorbake.change({ azimuth: 3 }));
  await settle(page);
  expect(await page.evaluate(() => window.mirrorbake.frames)).toBeGreaterThan(frames);
  expect(errors).toEqual([]);
  await context.close();
}, 180000);

test("without a headset there is no button for one", async () => {
  const context = await browser.newContext({ viewport: { width: 320, height: 420 } });
  const page = await context.newPage();
  await page.goto(site.url);
  await page.waitForFunction(() => window.mirrorbake.scene?.cache.ready === 3, undefined, { timeout: 20000 });
  await page.locator("#menu").click();
  expect(await page.locator("#headset").isVisible()).toBe(false);
  await context.close();
});

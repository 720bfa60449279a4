import { readFileSync } from "node:fs";
import { join } from "node:path";
import type { Browser } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { CASES, launch, open, type Site, serve } from "./support";

// What is left: vertices on a grid of 1/16 pixel in the software rasteriser, so that samples near an edge see another surface;
// 8 bits of the filter's weights; 9-bit shared exponents; half-float sums.
const LEAST_DB = 45;
const TRIMMED_DB = 32;

interface Reference {
  width: number;
  height: number;
  distance: number;
  /// `web`: dB of the C++ renderer's picture to this one, if this one is ray traced.
  pictures: { file: string; parameter: number; elevation: number; web?: number }[];
}

function srgb(linear: number): number {
  const c = Math.min(Math.max(linear, 0), 1);
  return c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055;
}

/// PSNR on display values over the pixels that the object covers by half at least. `seen` has its rows from the bottom.
function psnr(seen: Float32Array, expected: Float32Array, width: number, height: number): number {
  let sum = 0;
  let count = 0;
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      const e = 4 * (y * width + x);
      const s = 4 * ((height - 1 - y) * width + x);
      if (expected[e + 3] < 0.5) continue;
      for (let c = 0; c < 3; ++c) {
        sum += (srgb(seen[s + c] / seen[s + 3]) - srgb(expected[e + c] / expected[e + 3])) ** 2;
        ++count;
      }
    }
  }
  return 10 * Math.log10(count / sum);
}

let browser: Browser;
beforeAll(async () => {
  browser = await launch();
});
afterAll(async () => {
  await browser.close();
});

function referenceOf(name: string): Reference {
  return JSON.parse(readFileSync(join(CASES, name, "reference.json"), "utf8"));
}

async function compare(name: string): Promise<number[]> {
  const site: Site = await serve(join(CASES, name));
  const { page, context, errors } = await open(browser, site.url, {
    // What the page itself draws is not looked at: let it be little.
    width: 64,
    height: 48,
    until: () => {
      const { scene } = window.mirrorbake;
      return scene?.cache.ready === 3 && scene.isComplete;
    },
  });
  const reference = referenceOf(name);
  const { width, height, distance } = reference;
  const figures = [];
  for (const picture of reference.pictures) {
    const pixels = await page.evaluate(
      ([w, h, d, t, elevation]) => {
        const { scene, settings } = window.mirrorbake;
        if (!scene) throw new Error("no scene");
        const s = {
          ...settings,
          ...scene.at(settings, scene.manifest.axes[0], t),
          elevation,
          distance: d,
          background: "plain" as const,
        };
        scene.prepare(s, [0]);
        return Array.from(scene.readLinear(s, w, h));
      },
      [width, height, distance, picture.parameter, picture.elevation],
    );
    const bytes = readFileSync(join(CASES, name, picture.file));
    const expected = new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
    // A plain background of alpha 0 is added; the object's own light is what is left without it.
    const seen = Float32Array.from(pixels);
    for (let i = 0; i < seen.length; i += 4) {
      for (let c = 0; c < 3; ++c) seen[i + c] -= 0.18 * (1 - seen[i + 3]);
    }
    figures.push(psnr(seen, expected, width, height));
  }
  expect(errors).toEqual([]);
  await context.close();
  site.server.close();
  return figures;
}

const PROXIES = ["infinite", "box", "rotated-box", "ellipsoid", "sphere", "hemisphere"];

describe("the page's pixels against the C++ renderer", () => {
  for (const name of [...PROXIES, ...PROXIES.map((proxy) => `${proxy}-paraboloid`)]) {
    test(`are the same on the proxy ${name}`, async () => {
      const figures = await compare(name);
      console.log(name, figures.map((f) => f.toFixed(1)).join(" "), "dB");
      for (const figure of figures) expect(figure).toBeGreaterThan(LEAST_DB);
    });
  }

  test("are the same with three shells, one of which is read on the hull, and a map that parts share", async () => {
    const figures = await compare("shells");
    console.log("shells", figures.map((f) => f.toFixed(1)).join(" "), "dB");
    for (const figure of figures) expect(figure).toBeGreaterThan(LEAST_DB);
  });

  test("are the same on triangles smaller than a pixel, where a rasteriser moves vertices by parts of one", async () => {
    const figures = await compare("small-triangles");
    console.log("small-triangles", figures.map((f) => f.toFixed(1)).join(" "), "dB");
    for (const figure of figures) expect(figure).toBeGreaterThan(LEAST_DB);
  });

  test("are the same where a PEM fades to its static set", async () => {
    const figures = await compare("fading");
    console.log("fading", figures.map((f) => f.toFixed(1)).join(" "), "dB");
    expect(figures.length).toBe(3);
    for (const figure of figures) expect(figure).toBeGreaterThan(LEAST_DB);
  });

  // The page filters textures by levels, the tracer reads the finest one; textures have 8 bits on the way.
  test("are the same with textures, bent normals and coloured vertices", async () => {
    const figures = await compare("textured");
    console.log("textured", figures.map((f) => f.toFixed(1)).join(" "), "dB");
    for (const figure of figures) expect(figure).toBeGreaterThan(LEAST_DB);
  });

  for (const name of ["open", "open-moving"]) {
    test(`are the same inside of a bowl whose back has light of its own, in the case ${name}`, async () => {
      const figures = await compare(name);
      console.log(name, figures.map((f) => f.toFixed(1)).join(" "), "dB");
      for (const figure of figures) expect(figure).toBeGreaterThan(LEAST_DB);
    });
  }

  test("are the same where the object, its shell and its diffuse light move", async () => {
    const figures = await compare("moving");
    console.log("moving", figures.map((f) => f.toFixed(1)).join(" "), "dB");
    for (const figure of figures) expect(figure).toBeGreaterThan(LEAST_DB);
  });

  for (const name of ["lightmap", "lightmap-open-moving"]) {
    test(`are the same with a map of the body's light, in the case ${name}`, async () => {
      const figures = await compare(name);
      console.log(name, figures.map((f) => f.toFixed(1)).join(" "), "dB");
      for (const figure of figures) expect(figure).toBeGreaterThan(LEAST_DB);
    });
  }

  test("are put together of a sample's own blocks and the static set's", async () => {
    const figures = await compare("trimmed");
    console.log("trimmed", figures.map((f) => f.toFixed(1)).join(" "), "dB");
    // Noise in AVIF, at quality 36 in the static set; blocks of the other origin would leave less than 20.
    for (const figure of figures) expect(figure).toBeGreaterThan(TRIMMED_DB);
  });

  test("lose what AVIF loses and no more", async () => {
    const figures = await compare("avif");
    console.log("avif", figures.map((f) => f.toFixed(1)).join(" "), "dB");
    // Noise on every texel is the worst that an image codec can be given.
    for (const figure of figures) expect(figure).toBeGreaterThan(LEAST_DB);
  });
});

describe("the page's pixels against ray tracing", () => {
  // What the specification allows: the rasteriser's grid at silhouettes, and what the image codec loses.
  for (const name of ["traced-exact", "traced-avif", "traced-lightmap"]) {
    test(`are at most 0.3 dB below the C++ renderer's in the case ${name}`, async () => {
      const figures = await compare(name);
      const { pictures } = referenceOf(name);
      expect(figures.length).toBe(2);
      figures.forEach((figure, k) => {
        const { web } = pictures[k];
        console.log(name, figure.toFixed(2), "dB, in C++", web?.toFixed(2));
        // A picture that is nowhere near would be as far for both.
        expect(web).toBeGreaterThan(25);
        expect(figure).toBeGreaterThan((web ?? 0) - 0.3);
      });
    });
  }
});

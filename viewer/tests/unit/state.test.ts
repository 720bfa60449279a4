import { expect, test } from "vitest";
import { sameColours } from "../../src/decoder";
import { parseManifest } from "../../src/manifest";
import { fromLink, type Settings, toLink } from "../../src/state";

const home: Settings = {
  azimuth: 22,
  elevation: 20,
  distance: 0.9,
  place: { light: 0 },
  compare: "off",
  divider: 0.5,
  blended: true,
  lookups: 4,
  diffuse: true,
  fresnel: true,
  shells: [true, true],
  background: "surroundings",
  exposure: 0,
  toneMapping: "neutral",
  stereo: false,
  theme: "auto",
};

test("a link keeps the view and every setting", () => {
  const changed: Settings = {
    azimuth: -123.4567,
    elevation: 31,
    distance: 1.25,
    place: { light: 0.25 },
    compare: "static",
    divider: 0.25,
    blended: false,
    lookups: 1,
    diffuse: false,
    fresnel: false,
    shells: [true, false],
    background: "plain",
    exposure: 1.5,
    toneMapping: "none",
    stereo: true,
    theme: "dark",
  };
  expect(fromLink(`#${toLink(changed)}`, home)).toEqual(changed);
});

test("a link without sense changes nothing", () => {
  expect(fromLink("#az=x&d=NaN&compare=moon&shells=&ev=Infinity&theme=pink", home)).toEqual(home);
});

test.each(["{", "{}", "null", '{"format":"mirrorbake-web","version":6}'])(
  "the manifest %s is refused with a sentence",
  (text) => {
    expect(() => parseManifest(text)).toThrow(/manifest\.json is damaged/);
  },
);

test("a manifest of another version is refused and says so", () => {
  expect(() => parseManifest('{"format":"mirrorbake-web","version":1}')).toThrow(/version 1/);
});

test("the probe allows rounding and nothing more", () => {
  expect(sameColours([[10, 20, 30]], [[12, 19, 30]])).toBe(true);
  expect(sameColours([[26, 33, 42]], [[12, 19, 30]])).toBe(false);
  expect(sameColours([], [[12, 19, 30]])).toBe(false);
});

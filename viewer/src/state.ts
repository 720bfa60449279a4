/// What the person has chosen; all of it is in a link.

import { clamp } from "./math";

export type Compare = "off" | "static" | "raytraced";

export interface Settings {
  /// Degrees about the vertical from +Z towards +X, and above the horizon; metres.
  azimuth: number;
  elevation: number;
  distance: number;
  /// Coordinates on the axes that do not move the camera, by name.
  place: { [axis: string]: number };
  compare: Compare;
  /// Where the divider is, 0 left to 1 right.
  divider: number;
  blended: boolean;
  lookups: 1 | 4;
  diffuse: boolean;
  fresnel: boolean;
  shells: boolean[];
  background: "surroundings" | "plain";
  /// Powers of two.
  exposure: number;
  toneMapping: "neutral" | "none";
  stereo: boolean;
  theme: "auto" | "light" | "dark";
}

const NUMBERS = { az: "azimuth", el: "elevation", d: "distance", div: "divider", ev: "exposure" } as const;

/// The text behind # of a link to this view.
export function toLink(s: Settings): string {
  const link = new URLSearchParams();
  for (const [key, name] of Object.entries(NUMBERS)) link.set(key, String(Number(s[name].toFixed(4))));
  for (const [axis, value] of Object.entries(s.place))
    link.set(`at-${axis}`, String(Number(value.toFixed(4))));
  if (s.compare !== "off") link.set("compare", s.compare);
  if (!s.blended) link.set("nearest", "1");
  if (s.lookups !== 4) link.set("lookups", String(s.lookups));
  if (!s.diffuse) link.set("diffuse", "0");
  if (!s.fresnel) link.set("fresnel", "0");
  if (s.shells.includes(false)) link.set("shells", s.shells.map(Number).join(""));
  if (s.background !== "surroundings") link.set("bg", s.background);
  if (s.toneMapping !== "neutral") link.set("tone", s.toneMapping);
  if (s.stereo) link.set("stereo", "1");
  if (s.theme !== "auto") link.set("theme", s.theme);
  return link.toString();
}

/// Takes over what a link says; what it does not say or says wrongly stays.
export function fromLink(text: string, s: Settings): Settings {
  const link = new URLSearchParams(text.replace(/^#/, ""));
  const result = { ...s, shells: [...s.shells], place: { ...s.place } };
  for (const [key, name] of Object.entries(NUMBERS)) {
    const value = Number.parseFloat(link.get(key) ?? "");
    if (Number.isFinite(value)) result[name] = value;
  }
  for (const axis of Object.keys(result.place)) {
    const value = Number.parseFloat(link.get(`at-${axis}`) ?? "");
    if (Number.isFinite(value)) result.place[axis] = value;
  }
  result.elevation = clamp(result.elevation, -89, 89);
  result.divider = clamp(result.divider, 0, 1);
  result.exposure = clamp(result.exposure, -6, 6);
  const compare = link.get("compare");
  if (compare === "static" || compare === "raytraced") result.compare = compare;
  if (link.get("nearest") === "1") result.blended = false;
  if (link.get("lookups") === "1") result.lookups = 1;
  if (link.get("diffuse") === "0") result.diffuse = false;
  if (link.get("fresnel") === "0") result.fresnel = false;
  [...(link.get("shells") ?? "")].forEach((on, i) => {
    if (i < result.shells.length) result.shells[i] = on !== "0";
  });
  if (link.get("bg") === "plain") result.background = "plain";
  if (link.get("tone") === "none") result.toneMapping = "none";
  if (link.get("stereo") === "1") result.stereo = true;
  const theme = link.get("theme");
  if (theme === "light" || theme === "dark") result.theme = theme;
  return result;
}

/// The page's elements: made once, wired to the settings.

import { type Axis, type Manifest, shellNames } from "./manifest";
import type { Settings } from "./state";

type Change = Partial<Settings>;

const AXES: { [name: string]: string } = {
  arc: "View along the arc",
  azimuth: "Azimuth of the view, degrees",
  elevation: "Elevation of the view, degrees",
  motion: "Motion of the object",
  light: "Turn of the light",
};

export interface Actions {
  change(change: Change): void;
  coordinate(axis: number, value: number): void;
  play(): void;
  fullscreen(): void;
  headset(): void;
  screenshot(): void;
  copyLink(): void;
  reset(): void;
}

function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  attributes: { [name: string]: string } = {},
  children: (Node | string)[] = [],
): HTMLElementTagNameMap[K] {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

function button(id: string, label: string, press: () => void): HTMLButtonElement {
  const node = element("button", { type: "button", id }, [label]);
  node.addEventListener("click", press);
  return node;
}

export class Controls {
  readonly root: HTMLElement;
  readonly canvas = element("canvas", {
    tabindex: "0",
    role: "img",
    "aria-label": "The object. Drag or use the arrow keys to turn it, plus and minus to zoom.",
  });
  readonly poster = element("img", { class: "poster", alt: "" });
  readonly divider = element("div", {
    class: "divider",
    tabindex: "0",
    role: "slider",
    "aria-label": "Divider between the PEM and what it is compared with",
    "aria-valuemin": "0",
    "aria-valuemax": "100",
  });
  /// One for every axis that has more than one sample.
  readonly sliders: { axis: number; input: HTMLInputElement }[] = [];
  private readonly footer: HTMLElement;
  readonly playButton: HTMLButtonElement;
  private readonly headsetButton: HTMLButtonElement;
  readonly fps = element("output", { id: "frame-time", "aria-label": "Frame time" });
  private readonly status = element("div", { class: "status", role: "status", "aria-live": "polite" });
  private readonly bar = element("progress", { max: "1", value: "0", "aria-label": "Loading" });
  private readonly alert = element("div", { class: "alert", role: "alert", hidden: "" });
  private readonly title = element("h1", {}, ["mirrorbake"]);
  private readonly panel = element("section", { class: "panel", id: "panel", "aria-label": "Settings" });
  private readonly labels = element("div", { class: "labels", "aria-hidden": "true", hidden: "" });
  private readonly inputs = new Map<string, (s: Settings) => void>();

  constructor(private readonly actions: Actions) {
    this.playButton = button("play", "Play", () => actions.play());
    this.headsetButton = button("headset", "Headset", () => actions.headset());
    this.headsetButton.hidden = true;
    const menu = button("menu", "Settings", () => this.togglePanel());
    menu.setAttribute("aria-controls", "panel");
    menu.setAttribute("aria-expanded", "false");
    this.panel.hidden = true;
    this.footer = element("footer", {}, [this.playButton]);
    this.footer.hidden = true;
    this.root = element("main", { class: "viewer" }, [
      this.canvas,
      this.poster,
      this.labels,
      this.divider,
      element("header", {}, [this.title, this.fps, menu]),
      this.panel,
      this.footer,
      element("div", { class: "messages" }, [this.bar, this.status]),
      this.alert,
    ]);
    this.divider.hidden = true;
  }

  /// The settings that a PEM has.
  fill(manifest: Manifest): void {
    this.title.textContent = manifest.title;
    document.title = `${manifest.title} – mirrorbake`;
    manifest.axes.forEach((axis, number) => {
      if (axis.high > axis.low) this.addSlider(axis, number);
    });
    this.footer.hidden = this.sliders.length === 0;
    const hasStills = manifest.samples.some((sample) => sample.still !== null);
    const shells = shellNames(manifest);
    const compares: [string, string][] = [
      ["off", "nothing"],
      ["static", "a static environment map"],
    ];
    if (hasStills) compares.push(["raytraced", "ray tracing, at the samples"]);
    this.panel.append(
      this.choice("compare", "Compare with", compares),
      this.range("exposure", "Exposure", -6, 6, 0.1, (v) => `${v > 0 ? "+" : ""}${v.toFixed(1)} EV`),
      this.choice("toneMapping", "Tone mapping", [
        ["neutral", "Khronos PBR Neutral"],
        ["none", "none"],
      ]),
      this.choice("background", "Background", [
        ["surroundings", "captured surroundings"],
        ["plain", "plain grey"],
      ]),
      element("fieldset", {}, [
        element("legend", {}, ["Layers"]),
        ...shells.map((name, i) =>
          this.check(
            `shell-${i}`,
            `reflection: ${name}`,
            (s) => s.shells[i] !== false,
            (on, s) => {
              const next = shells.map((_, k) => (k === i ? on : s.shells[k] !== false));
              return { shells: next };
            },
          ),
        ),
        ...(manifest.mesh.arrays.irradiance
          ? [
              this.check(
                "diffuse",
                "diffuse",
                (s) => s.diffuse,
                (on) => ({ diffuse: on }),
              ),
            ]
          : []),
        this.check(
          "fresnel",
          "Fresnel",
          (s) => s.fresnel,
          (on) => ({ fresnel: on }),
        ),
      ]),
      element("fieldset", {}, [
        element("legend", {}, ["Drawing"]),
        this.check(
          "blended",
          "blend between samples",
          (s) => s.blended,
          (on) => ({ blended: on }),
        ),
        this.check(
          "lookups",
          "four lookups per pixel",
          (s) => s.lookups === 4,
          (on) => ({ lookups: on ? 4 : 1 }),
        ),
        this.check(
          "stereo",
          "stereo, side by side",
          (s) => s.stereo,
          (on) => ({ stereo: on }),
        ),
      ]),
      this.choice("theme", "Appearance", [
        ["auto", "as the system"],
        ["light", "light"],
        ["dark", "dark"],
      ]),
      element("div", { class: "buttons" }, [
        button("fullscreen", "Full screen", () => this.actions.fullscreen()),
        this.headsetButton,
        button("screenshot", "Screenshot", () => this.actions.screenshot()),
        button("link", "Copy link", () => this.actions.copyLink()),
        button("reset", "Reset view", () => this.actions.reset()),
      ]),
      element("p", { class: "notes" }, [
        ...manifest.notes.map((n) => `Not shown here: ${n}. `),
        `mirrorbake ${manifest.library}`,
      ]),
    );
  }

  private addSlider(axis: Axis, number: number): void {
    const label = AXES[axis.name] ?? axis.name;
    const { low, high } = axis;
    const input = element("input", {
      type: "range",
      id: `axis-${axis.name}`,
      min: String(low),
      max: String(high),
      step: String((high - low) / 1000),
      "aria-label": label,
      title: label,
    });
    input.addEventListener("input", () => this.actions.coordinate(number, input.valueAsNumber));
    this.sliders.push({ axis: number, input });
    this.footer.append(element("label", { class: "axis" }, [element("span", {}, [axis.name]), input]));
  }

  show(s: Settings, point: number[], width: number): void {
    for (const update of this.inputs.values()) update(s);
    for (const { axis, input } of this.sliders) input.valueAsNumber = point[axis];
    const comparing = s.compare !== "off";
    this.divider.hidden = !comparing;
    this.labels.hidden = !comparing;
    if (comparing) {
      this.divider.style.left = `${(s.divider * width).toFixed(1)}px`;
      this.divider.setAttribute("aria-valuenow", String(Math.round(100 * s.divider)));
      const text = s.compare === "static" ? "static map" : "ray traced";
      if (this.labels.dataset.text !== text) {
        this.labels.dataset.text = text;
        this.labels.replaceChildren(element("span", {}, ["PEM"]), element("span", {}, [text]));
      }
      this.labels.style.setProperty("--divider", `${(100 * s.divider).toFixed(2)}%`);
    }
    document.documentElement.dataset.theme = s.theme;
  }

  progress(text: string, share: number): void {
    this.status.textContent = text;
    this.bar.value = share;
    const done = share >= 1;
    this.bar.hidden = done;
    this.status.parentElement?.classList.toggle("done", done);
  }

  say(text: string): void {
    this.status.textContent = text;
    this.status.parentElement?.classList.remove("done");
    window.setTimeout(() => {
      if (this.status.textContent === text) this.status.parentElement?.classList.add("done");
    }, 3000);
  }

  warn(text: string): void {
    this.alert.hidden = text === "";
    this.alert.textContent = text;
  }

  showHeadset(there: boolean): void {
    this.headsetButton.hidden = !there;
  }

  wearsHeadset(on: boolean): void {
    this.headsetButton.textContent = on ? "Leave the headset" : "Headset";
  }

  togglePanel(): void {
    this.panel.hidden = !this.panel.hidden;
    document.getElementById("menu")?.setAttribute("aria-expanded", String(!this.panel.hidden));
  }

  private check(
    id: string,
    label: string,
    read: (s: Settings) => boolean,
    write: (on: boolean, s: Settings) => Change,
  ): HTMLElement {
    const input = element("input", { type: "checkbox", id });
    let current: Settings | null = null;
    input.addEventListener("change", () => {
      if (current) this.actions.change(write(input.checked, current));
    });
    this.inputs.set(id, (s) => {
      current = s;
      input.checked = read(s);
    });
    return element("label", { class: "check" }, [input, label]);
  }

  private choice(
    id: "compare" | "toneMapping" | "background" | "theme",
    label: string,
    options: [string, string][],
  ): HTMLElement {
    const select = element(
      "select",
      { id },
      options.map(([value, text]) => element("option", { value }, [text])),
    );
    select.addEventListener("change", () => this.actions.change({ [id]: select.value } as Change));
    this.inputs.set(id, (s) => {
      select.value = s[id];
    });
    return element("label", { class: "row" }, [label, select]);
  }

  private range(
    id: "exposure",
    label: string,
    min: number,
    max: number,
    step: number,
    text: (value: number) => string,
  ): HTMLElement {
    const input = element("input", {
      type: "range",
      id,
      min: String(min),
      max: String(max),
      step: String(step),
    });
    const shown = element("output", { for: id });
    input.addEventListener("input", () => this.actions.change({ [id]: input.valueAsNumber }));
    this.inputs.set(id, (s) => {
      input.valueAsNumber = s[id];
      shown.textContent = text(s[id]);
    });
    return element("label", { class: "row" }, [label, input, shown]);
  }
}

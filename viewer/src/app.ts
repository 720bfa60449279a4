/// The viewer: settings, gestures and frames.

import { Controls } from "./controls";
import { UserError } from "./errors";
import type { Files } from "./files";
import { listen } from "./gestures";
import { clamp } from "./math";
import { Scene } from "./scene";
import { fromLink, type Settings, toLink } from "./state";

const DEGREES_PER_PIXEL = 0.25;
/// Of the arc, per second, when playing; there and back.
const PLAY_SPEED = 0.25;

export class App {
  readonly controls: Controls;
  scene: Scene | null = null;
  settings!: Settings;
  private home!: Settings;
  private playing = false;
  private direction = 1;
  private speed = 0;
  private dirty = true;
  private lastFrame = 0;
  private meanFrame = 0;
  private lost = false;
  private linkTimer = 0;
  frames = 0;

  constructor(
    place: HTMLElement,
    private readonly files: Files,
  ) {
    this.controls = new Controls({
      change: (change) => this.change(change),
      parameter: (value) => this.turnTo(value),
      play: () => this.play(),
      fullscreen: () => this.fullscreen(),
      screenshot: () => void this.screenshot(),
      copyLink: () => void this.copyLink(),
      reset: () => this.reset(),
    });
    place.append(this.controls.root);
  }

  async start(): Promise<void> {
    const { controls } = this;
    try {
      const scene = await Scene.load(
        () => this.makeContext(),
        this.files,
        {
          changed: () => this.redraw(),
          progress: (text, share) => controls.progress(text, share),
          failed: (failure) => this.warn(failure),
        },
        (url) => {
          controls.poster.src = url;
        },
      );
      this.begin(scene);
    } catch (failure) {
      this.warn(failure);
      controls.progress("", 1);
    }
  }

  private begin(scene: Scene): void {
    const { controls } = this;
    const { camera, samples, first, parts } = scene.manifest;
    controls.fill(scene.manifest);
    const shells = Math.max(...parts.map((part) => part.shells.length));
    this.home = {
      azimuth: scene.azimuthOf(samples[first].parameter[0]),
      elevation: (Math.atan2(camera.height, camera.radius) * 180) / Math.PI,
      distance: Math.hypot(camera.radius, camera.height),
      compare: "off",
      divider: 0.5,
      blended: true,
      lookups: 4,
      diffuse: true,
      fresnel: true,
      shells: Array<boolean>(shells).fill(true),
      background: "surroundings",
      exposure: 0,
      toneMapping: "neutral",
      stereo: false,
      theme: "auto",
    };
    this.settings = fromLink(location.hash, this.home);
    this.scene = scene;
    listen(controls.canvas, controls.divider, {
      turn: (dx, dy) => this.turn(dx, dy),
      zoom: (factor) => this.change({ distance: this.settings.distance * factor }),
      divide: (share) => this.change({ divider: share }),
      dividerShare: () => this.settings.divider,
      play: () => this.play(),
      reset: () => this.reset(),
      step: (count) => this.turnTo(scene.parameterOf(this.settings.azimuth) + 0.05 * count),
    });
    window.addEventListener("hashchange", () => {
      this.settings = fromLink(location.hash, this.settings);
      this.redraw();
    });
    new ResizeObserver(() => this.redraw()).observe(controls.canvas);
    controls.canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.lost = true;
      controls.say("The graphics card was taken away for a moment.");
    });
    controls.canvas.addEventListener("webglcontextrestored", () => {
      this.lost = false;
      scene.restore().then(
        () => this.redraw(),
        (failure) => this.warn(failure),
      );
    });
    requestAnimationFrame((now) => this.tick(now));
  }

  private makeContext(): WebGL2RenderingContext {
    const gl = this.controls.canvas.getContext("webgl2", {
      alpha: false,
      antialias: false,
      depth: false,
      powerPreference: "high-performance",
    });
    if (!gl) {
      throw new UserError(
        "webgl",
        "This browser has no WebGL 2, or it is switched off. A current Chrome, Edge, Firefox or Safari has it.",
      );
    }
    return gl;
  }

  redraw(): void {
    this.dirty = true;
  }

  change(change: Partial<Settings>): void {
    if (!this.scene) return;
    Object.assign(this.settings, change);
    const s = this.settings;
    const { home } = this;
    s.elevation = clamp(s.elevation, -89, 89);
    s.distance = clamp(s.distance, 0.35 * home.distance, 4 * home.distance);
    s.divider = clamp(s.divider, 0, 1);
    s.exposure = clamp(s.exposure, -6, 6);
    // Ray tracing was done from the arc alone.
    if (s.compare === "raytraced") {
      s.elevation = home.elevation;
      s.distance = home.distance;
      s.azimuth = this.scene.azimuthOf(this.scene.manifest.samples[this.scene.nearestSample(s)].parameter[0]);
    }
    this.redraw();
    window.clearTimeout(this.linkTimer);
    this.linkTimer = window.setTimeout(() => this.keepLink(), 300);
  }

  private keepLink(): void {
    try {
      history.replaceState(null, "", `#${toLink(this.settings)}`);
    } catch {
      // A page from disk may not change its address in every browser; the button still copies the link.
    }
  }

  private turn(dx: number, dy: number): void {
    const { azimuth, elevation, compare } = this.settings;
    this.speed = -Math.sign(dx);
    if (compare === "raytraced") {
      this.stepSamples(-dx);
      return;
    }
    this.change({
      azimuth: azimuth - dx * DEGREES_PER_PIXEL,
      elevation: elevation + dy * DEGREES_PER_PIXEL,
    });
  }

  private pulled = 0;

  /// From sample to sample: half a step's way of the hand turns to the next.
  private stepSamples(pixels: number): void {
    const { scene } = this;
    if (!scene) return;
    this.pulled += pixels;
    const steps = Math.trunc(this.pulled / 24);
    if (steps === 0) return;
    this.pulled -= 24 * steps;
    const { samples } = scene.manifest;
    const next = clamp(scene.nearestSample(this.settings) + steps, 0, samples.length - 1);
    this.change({ azimuth: scene.azimuthOf(samples[next].parameter[0]) });
  }

  private turnTo(parameter: number): void {
    const { scene } = this;
    if (!scene) return;
    const before = scene.parameterOf(this.settings.azimuth);
    this.speed = Math.sign(parameter - before);
    this.change({ azimuth: scene.azimuthOf(clamp(parameter, 0, 1)) });
  }

  private play(): void {
    this.playing = !this.playing;
    this.controls.playButton.textContent = this.playing ? "Pause" : "Play";
    this.redraw();
  }

  private reset(): void {
    const { azimuth, elevation, distance } = this.home;
    this.change({ azimuth, elevation, distance, exposure: 0 });
  }

  private fullscreen(): void {
    if (document.fullscreenElement) void document.exitFullscreen();
    else void this.controls.root.requestFullscreen?.();
  }

  private async screenshot(): Promise<void> {
    this.paint();
    const blob = await new Promise<Blob | null>((resolve) =>
      this.controls.canvas.toBlob(resolve, "image/png"),
    );
    if (!blob) return;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `${this.scene?.manifest.title ?? "mirrorbake"}.png`;
    link.click();
    window.setTimeout(() => URL.revokeObjectURL(link.href), 1000);
    this.controls.say("The picture is saved.");
  }

  private async copyLink(): Promise<void> {
    const link = `${location.href.split("#")[0]}#${toLink(this.settings)}`;
    try {
      await navigator.clipboard.writeText(link);
      this.controls.say("The link to this view is copied.");
    } catch {
      this.controls.say(`The link to this view: ${link}`);
    }
  }

  private tick(now: number): void {
    requestAnimationFrame((next) => this.tick(next));
    const { scene } = this;
    if (!scene || this.lost) return;
    const elapsed = now - this.lastFrame;
    this.lastFrame = now;
    if (this.playing) this.advance(scene, elapsed / 1000);
    if (!this.dirty) {
      this.meanFrame = 0;
      return;
    }
    this.dirty = false;
    scene.prepare(this.settings, this.speed);
    this.paint();
    if (this.playing && elapsed < 1000) {
      this.meanFrame = this.meanFrame === 0 ? elapsed : 0.9 * this.meanFrame + 0.1 * elapsed;
      this.controls.fps.textContent = `${this.meanFrame.toFixed(1)} ms`;
    }
    this.controls.show(
      this.settings,
      scene.parameterOf(this.settings.azimuth),
      this.controls.canvas.clientWidth,
    );
    this.showProgress(scene);
  }

  private advance(scene: Scene, seconds: number): void {
    let t = clamp(scene.parameterOf(this.settings.azimuth), 0, 1);
    t += this.direction * PLAY_SPEED * Math.min(seconds, 0.1);
    if (t >= 1 || t <= 0) this.direction = t >= 1 ? -1 : 1;
    this.speed = this.direction;
    this.settings.azimuth = scene.azimuthOf(clamp(t, 0, 1));
    if (this.settings.compare === "raytraced") this.settings.compare = "off";
    this.redraw();
  }

  private showProgress(scene: Scene): void {
    const { ready } = scene.cache;
    const wanted = Math.min(scene.manifest.samples.length, scene.renderer.pool.capacity);
    if (scene.cache.share === 0) this.controls.progress("Loading the reflections", 0.5);
    else if (ready < wanted) this.controls.progress("", 0.5 + (0.5 * ready) / wanted);
    else this.controls.progress("", 1);
  }

  private paint(): void {
    const { scene, controls } = this;
    if (!scene || this.lost) return;
    const { canvas } = controls;
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const width = Math.max(Math.round(canvas.clientWidth * ratio), 1);
    const height = Math.max(Math.round(canvas.clientHeight * ratio), 1);
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    scene.draw(this.settings, width, height);
    ++this.frames;
    if (!controls.poster.hidden) controls.poster.hidden = true;
  }

  private warn(failure: unknown): void {
    const known = failure instanceof UserError;
    if (!known) console.error(failure);
    this.controls.warn(
      known ? failure.message : "Something went wrong in this page; the browser's console has the details.",
    );
  }
}

/// The viewer: settings, gestures and frames.

import { Controls } from "./controls";
import { UserError } from "./errors";
import type { Files } from "./files";
import { listen } from "./gestures";
import { enterHeadset, hasHeadset } from "./headset";
import { shellNames } from "./manifest";
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
  private velocity: number[] = [];
  private dirty = true;
  private lastFrame = 0;
  private meanFrame = 0;
  /// Set when the graphics card is done with the last frame.
  private fence: { gl: WebGL2RenderingContext; sync: WebGLSync; began: number } | null = null;
  private lost = false;
  private headset: XRSession | null = null;
  private linkTimer = 0;
  frames = 0;

  constructor(
    place: HTMLElement,
    private readonly files: Files,
  ) {
    this.controls = new Controls({
      change: (change) => this.change(change),
      coordinate: (axis, value) => this.moveTo(axis, value),
      play: () => this.play(),
      fullscreen: () => this.fullscreen(),
      headset: () => void this.putOnHeadset(),
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
    const { axes, camera, samples, first } = scene.manifest;
    controls.fill(scene.manifest);
    this.velocity = axes.map(() => 0);
    this.home = {
      azimuth: 0.5 * (camera.azimuths[0] + camera.azimuths[1]),
      elevation: 0.5 * (camera.elevations[0] + camera.elevations[1]),
      place: {},
      distance: Math.hypot(camera.radius, camera.height),
      compare: "off",
      divider: 0.5,
      blended: true,
      lookups: 4,
      diffuse: true,
      fresnel: true,
      shells: shellNames(scene.manifest).map(() => true),
      background: "surroundings",
      exposure: 0,
      toneMapping: "neutral",
      stereo: false,
      theme: "auto",
    };
    axes.forEach((axis, a) => {
      Object.assign(this.home, scene.at(this.home, axis, samples[first].parameter[a]));
    });
    this.settings = fromLink(location.hash, this.home);
    this.scene = scene;
    listen(controls.canvas, controls.divider, {
      turn: (dx, dy) => this.turn(dx, dy),
      zoom: (factor) => this.change({ distance: this.settings.distance * factor }),
      divide: (share) => this.change({ divider: share }),
      dividerShare: () => this.settings.divider,
      play: () => this.play(),
      reset: () => this.reset(),
      step: (count) => {
        if (axes.length === 0) return;
        const { low, high } = axes[0];
        this.moveTo(0, scene.coordinate(this.settings, axes[0]) + 0.05 * count * (high - low));
      },
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
    void hasHeadset().then((there) => controls.showHeadset(there));
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
    if (s.compare === "raytraced") this.snap(this.scene.nearestSample(s));
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

  /// Ray tracing was done at the samples alone.
  private snap(sample: number): void {
    const { scene, settings, home } = this;
    if (!scene) return;
    settings.elevation = home.elevation;
    settings.azimuth = home.azimuth;
    settings.distance = home.distance;
    const { axes, samples } = scene.manifest;
    axes.forEach((axis, a) => {
      Object.assign(settings, scene.at(settings, axis, samples[sample].parameter[a]));
    });
  }

  private turn(dx: number, dy: number): void {
    const { scene, settings } = this;
    if (!scene) return;
    const { axes, camera } = scene.manifest;
    const alongArc = Math.sign(camera.degrees) || 1;
    axes.forEach((axis, a) => {
      if (axis.name === "arc") this.velocity[a] = -Math.sign(dx) * alongArc;
      if (axis.name === "azimuth") this.velocity[a] = -Math.sign(dx);
      if (axis.name === "elevation") this.velocity[a] = Math.sign(dy);
    });
    if (settings.compare === "raytraced") {
      this.stepSamples(-dx);
      return;
    }
    this.change({
      azimuth: settings.azimuth - dx * DEGREES_PER_PIXEL,
      elevation: settings.elevation + dy * DEGREES_PER_PIXEL,
    });
  }

  private pulled = 0;

  /// From sample to sample: so many pixels of the hand's way turn to the next.
  private stepSamples(pixels: number): void {
    const { scene } = this;
    if (!scene) return;
    this.pulled += pixels;
    const steps = Math.trunc(this.pulled / 24);
    if (steps === 0) return;
    this.pulled -= 24 * steps;
    const { samples } = scene.manifest;
    this.snap(clamp(scene.nearestSample(this.settings) + steps, 0, samples.length - 1));
    this.change({});
  }

  private moveTo(a: number, value: number): void {
    const { scene } = this;
    if (!scene) return;
    const axis = scene.manifest.axes[a];
    this.velocity[a] = Math.sign(value - scene.coordinate(this.settings, axis));
    this.change(scene.at(this.settings, axis, clamp(value, axis.low, axis.high)));
  }

  private play(): void {
    this.playing = !this.playing;
    this.controls.playButton.textContent = this.playing ? "Pause" : "Play";
    this.redraw();
  }

  private reset(): void {
    const { azimuth, elevation, distance, place } = this.home;
    this.change({ azimuth, elevation, distance, place: { ...place }, exposure: 0 });
  }

  private fullscreen(): void {
    if (document.fullscreenElement) void document.exitFullscreen();
    else void this.controls.root.requestFullscreen?.();
  }

  /// On and off: the same button.
  private async putOnHeadset(): Promise<void> {
    const { scene, controls } = this;
    if (this.headset) {
      await this.headset.end();
      return;
    }
    if (!scene) return;
    try {
      this.headset = await enterHeadset(scene, this.settings, {
        drawn: () => ++this.frames,
        ended: () => {
          this.headset = null;
          controls.wearsHeadset(false);
          this.redraw();
        },
        failed: (failure) => this.warn(failure),
      });
      controls.wearsHeadset(true);
    } catch (failure) {
      this.warn(failure);
    }
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
    if (!scene || this.lost || this.headset) return;
    // Browsers take frames faster than slow graphics cards draw them: wait, or the picture lags behind the hand.
    if (!this.isFrameDone(now)) return;
    const elapsed = now - this.lastFrame;
    this.lastFrame = now;
    if (this.playing) this.advance(scene, elapsed / 1000);
    if (!this.dirty) {
      this.meanFrame = 0;
      return;
    }
    this.dirty = false;
    scene.prepare(this.settings, this.velocity);
    this.paint();
    const { gl } = scene.renderer;
    const sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    if (sync) this.fence = { gl, sync, began: now };
    gl.flush();
    this.controls.show(this.settings, scene.point(this.settings), this.controls.canvas.clientWidth);
    this.showProgress(scene);
  }

  /// Whether the last frame is drawn; then its time counts, while playing.
  private isFrameDone(now: number): boolean {
    if (!this.fence) return true;
    const { gl, sync, began } = this.fence;
    if (!gl.isContextLost() && gl.getSyncParameter(sync, gl.SYNC_STATUS) === gl.UNSIGNALED) return false;
    gl.deleteSync(sync);
    this.fence = null;
    if (this.playing) {
      const took = now - began;
      this.meanFrame = this.meanFrame === 0 ? took : 0.9 * this.meanFrame + 0.1 * took;
      this.controls.fps.textContent = `${this.meanFrame.toFixed(1)} ms`;
    }
    return true;
  }

  /// Whether what is seen is what was last asked for.
  get isDrawn(): boolean {
    return !this.dirty && this.fence === null;
  }

  private advance(scene: Scene, seconds: number): void {
    const axis = scene.manifest.axes[0];
    if (!axis) return;
    const span = axis.high - axis.low;
    const before = clamp(scene.coordinate(this.settings, axis), axis.low, axis.high);
    const value = before + this.direction * PLAY_SPEED * span * Math.min(seconds, 0.1);
    if (axis.period === null && (value >= axis.high || value <= axis.low)) {
      this.direction = value >= axis.high ? -1 : 1;
    }
    this.velocity[0] = this.direction;
    if (this.settings.compare === "raytraced") this.settings.compare = "off";
    const next = axis.period === null ? clamp(value, axis.low, axis.high) : value;
    Object.assign(this.settings, scene.at(this.settings, axis, next));
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

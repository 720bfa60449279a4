/// Everything that is loaded, and one picture of it: the viewer without its controls.

import { decodeBlocks } from "./blocks";
import { SampleCache } from "./cache";
import { type Decoded, type DecodeRequest, Decoder, sameColours } from "./decoder";
import { UserError } from "./errors";
import { degreesOutside, fadeWeight } from "./fade";
import { type Files, textOf } from "./files";
import { irradianceSize } from "./gl/irradiance";
import { type FrameState, Renderer } from "./gl/renderer";
import { type Axis, type Manifest, type MapFiles, parseManifest, type Vec3 } from "./manifest";
import {
  add,
  type ImageWindow,
  lookAt,
  type Pose,
  placeCamera,
  scale,
  subtract,
  type View,
  windowOf,
} from "./math";
import { decodeIrradiance, decodeMesh, type Mesh } from "./mesh";
import { type Blend, neighbours, nodeCount } from "./space";
import type { Settings } from "./state";

export const BUDGET_BYTES = 96e6;

/// Distance of the eyes in stereo as a share of the distance to the object; the comfortable thirtieth of stereo photography.
const EYES_APART = 1 / 30;

export interface Events {
  /// Something new can be drawn.
  changed(): void;
  progress(text: string, share: number): void;
  failed(failure: unknown): void;
}

export class Scene {
  readonly decoder = new Decoder();
  renderer: Renderer;
  cache: SampleCache;
  private exact: boolean;
  private stillShown = -1;
  private stillWanted = -1;
  private readonly frame: FrameState;
  private hasStatic = false;
  private hasSet = false;
  /// Settles when the static set is there, of which samples without all blocks of their own take the others.
  private set: Promise<void> = Promise.resolve();
  private readonly here: number[];
  private readonly nearest: Blend;

  private constructor(
    private gl: WebGL2RenderingContext,
    readonly manifest: Manifest,
    private readonly mesh: Mesh,
    private readonly files: Files,
    private readonly events: Events,
    exact: boolean,
    private readonly budget: number,
  ) {
    this.exact = exact;
    this.renderer = new Renderer(gl, manifest, mesh, budget);
    this.cache = this.makeCache();
    this.here = manifest.axes.map((axis) => axis.low);
    const nodes = nodeCount(manifest.axes);
    this.nearest = { indices: Array(nodes).fill(0), weights: Array(nodes).fill(0) };
    const { runTime } = manifest;
    this.frame = {
      width: 1,
      height: 1,
      view: {
        eye: [0, 0, 1],
        forward: [0, 0, -1],
        middle: [0, 0, -1],
        right: [1, 0, 0],
        down: [0, -1, 0],
        clipFromWorld: new Float32Array(16),
      },
      places: runTime.places,
      footprint: runTime.footprintScale,
      maxTaps: runTime.filter === "anisotropic" ? runTime.maxTaps : 1,
      left: "pem",
      right: "pem",
      divider: 0,
      slots: this.cache.slotsOfBlend,
      weights: this.cache.blend.weights,
      turn: 0,
      offset: [0, 0, 0],
      hasSamples: false,
      hasSet: false,
      fade: 1,
      shellsOn: [],
      fresnelOn: true,
      diffuseOn: true,
      background: "surroundings",
      plain: [0.18, 0.18, 0.18],
      exposure: 1,
      neutral: true,
      stillScale: [1, 1],
    };
  }

  static async load(
    makeContext: () => WebGL2RenderingContext,
    files: Files,
    events: Events,
    onPoster: (url: string) => void,
    budget = BUDGET_BYTES,
  ): Promise<Scene> {
    events.progress("Loading the description", 0.02);
    const manifest = parseManifest(textOf(await files.read("manifest.json")));
    const poster = await files.read(manifest.poster.file);
    onPoster(URL.createObjectURL(new Blob([poster], { type: manifest.poster.type })));
    const gl = makeContext();
    const decoder = new Decoder();
    const exact = await chooseFormat(manifest, files, decoder);
    events.progress("Loading the shape", 0.1);
    const mesh = await decodeMesh(await files.read(manifest.mesh.file), manifest.mesh);
    const scene = new Scene(gl, manifest, mesh, files, events, exact, budget);
    await scene.loadStatic();
    return scene;
  }

  /// After a lost context came back.
  async restore(): Promise<void> {
    this.renderer = new Renderer(this.gl, this.manifest, this.mesh, this.budget);
    this.cache.forget();
    this.stillShown = -1;
    this.hasStatic = false;
    this.hasSet = false;
    await this.loadStatic();
  }

  /// Vertical field of view in radians: the views', or more in an image that is narrower than they are.
  fieldOfView(aspect: number): number {
    const { verticalFovDegrees, aspect: own } = this.manifest.camera;
    const half = Math.tan((verticalFovDegrees * Math.PI) / 360);
    return 2 * Math.atan(half * Math.max(1, own / aspect));
  }

  eye(s: Settings): Vec3 {
    const azimuth = (s.azimuth * Math.PI) / 180;
    const elevation = (s.elevation * Math.PI) / 180;
    const [x, y, z] = this.manifest.camera.target;
    const flat = s.distance * Math.cos(elevation);
    return [x + flat * Math.sin(azimuth), y + s.distance * Math.sin(elevation), z + flat * Math.cos(azimuth)];
  }

  /// Coordinate of an axis that settings stand for; it may lie beyond the axis where the camera does.
  coordinate(s: Settings, axis: Axis): number {
    const { startDegrees, degrees } = this.manifest.camera;
    if (axis.name === "elevation") return s.elevation;
    if (axis.name === "azimuth") return near(s.azimuth, 0.5 * (axis.low + axis.high));
    if (axis.name === "arc") {
      if (degrees === 0) return 0;
      const middle = startDegrees + 0.5 * degrees;
      return (near(s.azimuth, middle) - startDegrees) / degrees;
    }
    return s.place[axis.name] ?? axis.low;
  }

  /// What has to change in the settings for an axis to have a coordinate.
  at(s: Settings, axis: Axis, value: number): Partial<Settings> {
    const { startDegrees, degrees } = this.manifest.camera;
    if (axis.name === "elevation") return { elevation: value };
    if (axis.name === "azimuth") return { azimuth: value };
    if (axis.name === "arc") return { azimuth: startDegrees + value * degrees };
    return { place: { ...s.place, [axis.name]: value } };
  }

  point(s: Settings): number[] {
    const { axes } = this.manifest;
    for (let a = 0; a < axes.length; ++a) this.here[a] = this.coordinate(s, axes[a]);
    return this.here;
  }

  /// Sets what is drawn and starts to fetch what is missing for it. `velocity` has a sign per axis.
  prepare(s: Settings, velocity: number[]): void {
    this.cache.update(this.point(s), velocity, !s.blended);
    if (s.compare === "raytraced") this.wantStill(this.nearestSample(s));
  }

  nearestSample(s: Settings): number {
    const { axes } = this.manifest;
    neighbours(axes, this.point(s), true, this.nearest);
    return this.nearest.indices[this.nearest.weights.indexOf(Math.max(...this.nearest.weights))];
  }

  draw(s: Settings, width: number, height: number): void {
    if (!s.stereo) {
      this.renderer.draw(this.frameOf(s, width, height, this.pose(s), this.window(width / height)));
      return;
    }
    // Two eyes that look the same way, through windows that meet where the object is: what lies there has no parallax.
    const half = Math.floor(width / 2);
    const middle = this.pose(s);
    for (const side of [-0.5, 0.5]) {
      const eye = add(middle.eye, scale(side * EYES_APART * s.distance, middle.right));
      const window = this.window(half / height, -side * EYES_APART);
      const frame = this.frameOf(s, half, height, { ...middle, eye }, window);
      this.renderer.draw(frame, null, side < 0 ? 0 : half);
    }
  }

  /// One eye's image, of a headset for example, into a part of a framebuffer.
  drawEye(
    s: Settings,
    pose: Pose,
    window: ImageWindow,
    framebuffer: WebGLFramebuffer | null,
    place: { x: number; y: number; width: number; height: number },
  ): void {
    const frame = this.frameOf(s, place.width, place.height, pose, window);
    this.renderer.draw(frame, framebuffer, place.x, place.y);
  }

  /// Scene-linear light, and the object's coverage in alpha, from the lower left corner.
  readLinear(s: Settings, width: number, height: number): Float32Array {
    return this.renderer.readLinear(
      this.frameOf(s, width, height, this.pose(s), this.window(width / height)),
    );
  }

  /// Sets the camera of settings to where an eye is.
  stand(s: Settings, eye: Vec3): void {
    const [x, y, z] = subtract(eye, this.manifest.camera.target);
    s.azimuth = (Math.atan2(x, z) * 180) / Math.PI;
    s.elevation = (Math.atan2(y, Math.hypot(x, z)) * 180) / Math.PI;
    s.distance = Math.hypot(x, y, z);
  }

  pose(s: Settings): Pose {
    return lookAt(this.eye(s), this.manifest.camera.target);
  }

  private window(aspect: number, shift = 0): ImageWindow {
    return windowOf(this.fieldOfView(aspect), aspect, shift);
  }

  private frameOf(s: Settings, width: number, height: number, pose: Pose, window: ImageWindow): FrameState {
    const { frame } = this;
    const { camera, runTime, mesh } = this.manifest;
    const { low, high } = mesh.bounds;
    const radius = Math.hypot(...subtract(high, low)) + Math.hypot(...(this.manifest.motion?.to ?? [0]));
    const distance = Math.hypot(...subtract(pose.eye, camera.target));
    const near = Math.max(distance - 2 * radius, 0.01 * s.distance);
    placeCamera(frame.view as View, pose, window, width, height, near, distance + 2 * radius);
    frame.width = width;
    frame.height = height;
    frame.places = s.lookups === 1 ? CENTRE : runTime.places.length === 4 ? runTime.places : GRID;
    const lookups = Math.max(runTime.places.length, 1);
    frame.footprint = (runTime.footprintScale * Math.sqrt(lookups)) / Math.sqrt(frame.places.length);
    frame.left = "pem";
    const still = this.stillShown >= 0 && this.stillShown === this.stillWanted;
    frame.right = s.compare === "static" ? "static" : s.compare === "raytraced" && still ? "still" : "pem";
    frame.divider = s.compare === "off" ? width : s.divider * width;
    const { motion } = this.manifest;
    if (motion) {
      const t = s.place.motion ?? 0;
      frame.turn = (t * motion.turn * Math.PI) / 180;
      for (let i = 0; i < 3; ++i) frame.offset[i] = t * motion.to[i];
    }
    frame.hasSamples = this.cache.share > 0;
    frame.hasSet = this.hasSet;
    frame.fade = this.fade(pose.eye);
    frame.shellsOn = s.shells;
    frame.fresnelOn = s.fresnel;
    frame.diffuseOn = s.diffuse;
    frame.background = this.hasStatic ? s.background : "plain";
    frame.exposure = 2 ** s.exposure;
    frame.neutral = s.toneMapping === "neutral";
    const growth = window.top / Math.tan((camera.verticalFovDegrees * Math.PI) / 360);
    frame.stillScale[0] = (growth * width) / height / camera.aspect;
    frame.stillScale[1] = growth;
    return frame;
  }

  /// Whether all is there that does not belong to a sample.
  get isComplete(): boolean {
    return this.hasStatic && (this.hasSet || this.manifest.static.maps === null);
  }

  /// The share that the samples keep from the static set in the view of an eye.
  fade(eye: Vec3): number {
    const degrees = this.manifest.static.fadeDegrees;
    return degrees === null ? 1 : fadeWeight(degrees, degreesOutside(this.manifest.camera, eye));
  }

  private makeCache(): SampleCache {
    return new SampleCache(
      this.manifest.axes,
      this.manifest.samples.map((sample) => sample.parameter),
      this.renderer.pool.capacity,
      (sample, slot) => this.loadSample(sample, slot),
      () => this.events.changed(),
      (_, failure) => this.events.failed(failure),
    );
  }

  private image(name: string): { file: string; type: string } {
    if (this.exact && this.manifest.images.fallback)
      return { file: `exact/${name}.webp`, type: "image/webp" };
    return { file: name + this.manifest.images.suffix, type: this.manifest.images.type };
  }

  private async loadStatic(): Promise<void> {
    const { image, size } = this.manifest.static;
    const { renderer } = this;
    const { radiance: code, projection } = this.manifest;
    this.events.progress("Loading the surroundings", 0.3);
    const { packed } = await this.decoded(image, (bytes, type) => ({
      kind: "radiance",
      bytes,
      type,
      size,
      projection,
      code,
    }));
    if (packed && renderer === this.renderer) renderer.uploadStatic(packed);
    await Promise.all(
      this.manifest.textures.map((texture, number) => this.loadTexture(texture.image, number)),
    );
    this.hasStatic = true;
    this.events.changed();
    const { maps } = this.manifest.static;
    if (maps === null) return;
    // Not waited for: the captured map and the samples do for a while.
    this.set = this.loadMaps(maps, renderer.pool.setSlot, null);
    this.set.then(
      () => {
        if (renderer !== this.renderer) return;
        this.hasSet = true;
        this.events.changed();
      },
      (failure) => this.events.failed(failure),
    );
  }

  private async loadTexture(name: string, number: number): Promise<void> {
    const { renderer } = this;
    const { width, height, pixels } = await this.decoded(name, (bytes, type) => ({
      kind: "texture",
      bytes,
      type,
    }));
    if (pixels && renderer === this.renderer) renderer.uploadTexture(number, width, height, pixels);
  }

  private async loadIrradiance(file: string, slot: number): Promise<void> {
    const { renderer, manifest } = this;
    const bytes = await this.files.read(file);
    const { width, height } = irradianceSize(manifest);
    const values = await decodeIrradiance(file, bytes, manifest.mesh.arrays.irradiance, width * height);
    if (renderer === this.renderer) renderer.pool.irradiance.upload(slot, values);
  }

  private async loadSample(sample: number, slot: number): Promise<void> {
    const { maps, irradiance, blocks } = this.manifest.samples[sample];
    await Promise.all([
      this.loadMaps(maps, slot, blocks),
      irradiance === null ? undefined : this.loadIrradiance(irradiance, slot),
    ]);
  }

  /// The maps of a sample, or of the static set, into a slot.
  private async loadMaps(maps: MapFiles[], slot: number, blocksFile: string | null): Promise<void> {
    const { renderer } = this;
    const { radiance: code, projection } = this.manifest;
    const isSet = slot === renderer.pool.setSlot;
    const own = blocksFile === null ? null : await this.ownBlocks(blocksFile);
    const parts = (number: number, channels: string) => {
      const name = `${channels} ${number}`;
      if (isSet) return { keep: name };
      return own === null ? {} : { base: name, blocks: own[number] };
    };
    await Promise.all(
      maps.map(async (map, number) => {
        const { size } = this.manifest.maps[number];
        const [light, cover] = await Promise.all([
          this.decoded(map.radiance, (bytes, type) => ({
            kind: "radiance",
            bytes,
            type,
            size,
            projection,
            code,
            ...parts(number, "radiance"),
          })),
          map.alpha === null
            ? undefined
            : this.decoded(map.alpha, (bytes, type) => ({
                kind: "alpha",
                bytes,
                type,
                size,
                projection,
                ...parts(number, "alpha"),
              })),
        ]);
        if (renderer !== this.renderer || !light.packed) return;
        renderer.uploadMap(slot, number, light.packed, cover?.alpha);
      }),
    );
  }

  /// Which blocks of its maps are a sample's own, once those of the static set are there.
  private async ownBlocks(name: string): Promise<Uint8Array[]> {
    const { maps, projection } = this.manifest;
    const [blocks] = await Promise.all([
      this.files.read(name).then((bytes) => decodeBlocks(name, bytes, maps, projection)),
      this.set,
    ]);
    return blocks;
  }

  private async decoded(
    name: string,
    request: (bytes: ArrayBuffer, type: string) => DecodeRequest,
  ): Promise<Decoded> {
    const { file, type } = this.image(name);
    return this.decoder.decode(file, request(await this.files.read(file), type));
  }

  private wantStill(sample: number): void {
    const name = this.manifest.samples[sample].still;
    if (name === null || sample === this.stillWanted) return;
    this.stillWanted = sample;
    const { renderer } = this;
    const code = this.manifest.radiance;
    this.decoded(name, (bytes, type) => ({ kind: "still", bytes, type, code })).then(
      ({ width, height, packed }) => {
        if (sample !== this.stillWanted || renderer !== this.renderer || !packed) return;
        renderer.uploadStill(width, height, packed);
        this.stillShown = sample;
        this.events.changed();
      },
      (failure) => this.events.failed(failure),
    );
  }
}

/// The angle in degrees, turned by whole turns, that is nearest to another one.
function near(angle: number, middle: number): number {
  return angle - 360 * Math.round((angle - middle) / 360);
}

const CENTRE: [number, number][] = [[0.5, 0.5]];

/// The rotated grid.
const GRID: [number, number][] = [
  [0.375, 0.125],
  [0.875, 0.375],
  [0.125, 0.625],
  [0.625, 0.875],
];

/// Whether the exact images are needed because this browser shows the others wrongly.
async function chooseFormat(manifest: Manifest, files: Files, decoder: Decoder): Promise<boolean> {
  const { images, probe } = manifest;
  try {
    const bytes = await files.read(probe.file);
    const { colours } = await decoder.decode(probe.file, { kind: "probe", bytes, type: images.type });
    if (colours && sameColours(colours, probe.colours)) return false;
  } catch (failure) {
    if (failure instanceof UserError && failure.kind === "missing") throw failure;
  }
  if (images.fallback) return true;
  const kind = images.type === "image/avif" ? "AVIF" : "WebP";
  throw new UserError(
    "codec",
    `This browser does not show ${kind} images as they are. A newer browser does; or export the PEM with --exact.`,
  );
}

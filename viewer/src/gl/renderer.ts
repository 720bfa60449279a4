/// Draws one frame. All that depends on the frame comes in by a FrameState; what lives longer is here.

import { layerSize } from "../atlas";
import { UserError } from "../errors";
import { irradianceChanges, litSides, type Manifest, type Range, shellNames } from "../manifest";
import type { View } from "../math";
import type { Mesh } from "../mesh";
import { nodeCount } from "../space";
import * as images from "./image_shaders";
import { IRRADIANCE_UNIT } from "./irradiance";
import { MapPool } from "./map_pool";
import { type Counters, Program } from "./program";
import { type Motion, Proxies } from "./proxies";
import * as shaders from "./shaders";
import { Surfaces } from "./surfaces";
import { Targets } from "./targets";

export type Content = "pem" | "static" | "still";

export interface FrameState {
  width: number;
  height: number;
  view: View;
  /// Where in a pixel the lookups lie; one of them is antialiased at edges by the hardware.
  places: [number, number][];
  footprint: number;
  maxTaps: number;
  /// What is drawn left of the divider and right of it; `divider` in pixels from the left.
  left: Content;
  right: Content;
  divider: number;
  /// Slots of the blended samples in the pool, and their weights.
  slots: number[];
  weights: number[];
  /// Turn of the object in radians, and how far it has moved.
  turn: number;
  offset: [number, number, number];
  /// Whether a sample is there.
  hasSamples: boolean;
  /// Whether the static set is there, and the share that the samples keep from it in this view.
  hasSet: boolean;
  fade: number;
  /// By the names of shells.
  shellsOn: boolean[];
  fresnelOn: boolean;
  diffuseOn: boolean;
  background: "surroundings" | "plain";
  plain: [number, number, number];
  exposure: number;
  neutral: boolean;
  stillScale: [number, number];
}

const ORIGIN: [number, number, number] = [0, 0, 0];

interface PartUniforms {
  /// Of the shells, front to back, and last of the static map.
  proxies: Proxies;
  size: Float32Array;
  /// Numbers of the shells' names.
  names: number[];
  shellOn: Float32Array;
  shellOnHull: Float32Array;
  radianceLayer: Float32Array;
  alphaLayer: Float32Array;
}

export class Renderer {
  readonly counters: Counters = { compiled: 0, allocated: 0, uploaded: 0 };
  readonly pool: MapPool;
  private readonly targets: Targets;
  private readonly meshPrograms = new Map<number, Program>();
  private readonly background: Program;
  private readonly still: Program;
  private readonly copy: Program;
  private readonly display: Program;
  private readonly vertices: WebGLVertexArrayObject | null;
  private readonly empty: WebGLVertexArrayObject | null;
  private readonly parts: PartUniforms[];
  private readonly staticProxy: Proxies;
  private readonly surfaces: Surfaces;
  private readonly motion: Motion;
  private readonly nodes: number;
  private readonly weights: Float32Array;
  private readonly slots: Float32Array;
  /// Of the blended samples and last, if there is one, of the static set.
  private readonly mixture: Float32Array;
  /// Number of a map among those that have an α; -1: it has none.
  private readonly alphaOf: number[];
  private readonly flat: boolean;
  /// Of the lightmap at rest; null: irradiance is at the vertices.
  private readonly restSlot: number | null;
  private stillTexture: WebGLTexture | null = null;

  constructor(
    readonly gl: WebGL2RenderingContext,
    private readonly manifest: Manifest,
    mesh: Mesh,
    budget: number,
  ) {
    if (!gl.getExtension("EXT_color_buffer_float") && !gl.getExtension("EXT_color_buffer_half_float")) {
      throw new UserError(
        "texture",
        "This graphics card cannot draw into half-float images, which the page needs.",
      );
    }
    this.nodes = nodeCount(manifest.axes);
    this.weights = new Float32Array(this.nodes);
    this.slots = new Float32Array(this.nodes);
    this.mixture = new Float32Array(this.nodes + (manifest.static.maps === null ? 0 : 1));
    let alphas = 0;
    this.alphaOf = manifest.maps.map((map) => (map.opaque ? -1 : alphas++));
    this.motion = { cosine: 1, sine: 0, pivot: manifest.motion?.pivot ?? ORIGIN, offset: ORIGIN };
    this.pool = new MapPool(gl, manifest, budget, this.nodes, this.counters);
    this.restSlot = this.pool.irradiance.restSlot;
    this.targets = new Targets(gl, this.counters);
    for (const part of manifest.parts) this.meshProgram(part.shells.length);
    this.background = new Program(
      gl,
      images.FULL_VERTEX,
      shaders.backgroundFragment(manifest.projection),
      this.counters,
    );
    this.still = new Program(gl, images.FULL_VERTEX, images.STILL_FRAGMENT, this.counters);
    this.copy = new Program(gl, images.FULL_VERTEX, images.COPY_FRAGMENT, this.counters);
    this.display = new Program(gl, images.FULL_VERTEX, images.DISPLAY_FRAGMENT, this.counters);
    this.empty = gl.createVertexArray();
    this.vertices = this.uploadMesh(mesh);
    if (this.restSlot !== null && mesh.irradiance)
      this.pool.irradiance.upload(this.restSlot, mesh.irradiance);
    this.flat = mesh.normals === null;
    this.surfaces = new Surfaces(gl, manifest, this.counters);
    this.staticProxy = new Proxies([manifest.static.proxy], [false]);
    const names = shellNames(manifest);
    const mixed = this.mixture.length;
    this.parts = manifest.parts.map(({ shells }) => ({
      proxies: new Proxies(
        [...shells.map((s) => s.proxy), manifest.static.proxy],
        [...shells.map((s) => s.moves), false],
      ),
      size: Float32Array.from([...shells.map((s) => manifest.maps[s.map].size), manifest.static.size]),
      names: shells.map((s) => names.indexOf(s.name)),
      shellOn: new Float32Array(shells.length),
      shellOnHull: new Float32Array(shells.length),
      radianceLayer: new Float32Array(shells.length * mixed),
      alphaLayer: new Float32Array(shells.length * mixed),
    }));
  }

  private meshProgram(shells: number): Program {
    let program = this.meshPrograms.get(shells);
    if (!program) {
      program = new Program(
        this.gl,
        shaders.meshVertex(this.nodes),
        shaders.meshFragment(
          shells,
          this.mixture.length,
          this.manifest.projection,
          this.restSlot === null ? 0 : this.nodes,
        ),
        this.counters,
      );
      this.meshPrograms.set(shells, program);
    }
    return program;
  }

  private uploadMesh(mesh: Mesh): WebGLVertexArrayObject | null {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const attribute = (
      place: number,
      data: BufferSource,
      count: number,
      type: number,
      normalised: boolean,
      stride = 0,
    ) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, count, type, normalised, stride, 0);
      ++this.counters.allocated;
    };
    attribute(0, mesh.positions as BufferSource, 3, gl.UNSIGNED_SHORT, true);
    if (mesh.normals) attribute(1, mesh.normals as BufferSource, 2, gl.SHORT, true);
    if (mesh.irradiance && this.restSlot === null) {
      const sides = litSides(this.manifest);
      attribute(2, mesh.irradiance as BufferSource, 3, gl.HALF_FLOAT, false, 6 * sides);
      // The same buffer again: what the backs have of their own, or the fronts' where there is nothing.
      gl.enableVertexAttribArray(5);
      gl.vertexAttribPointer(5, 3, gl.HALF_FLOAT, false, 6 * sides, 6 * (sides - 1));
    }
    if (mesh.uvs) attribute(3, mesh.uvs as BufferSource, 2, gl.UNSIGNED_SHORT, true);
    if (mesh.colors) attribute(4, mesh.colors as BufferSource, 3, gl.UNSIGNED_SHORT, true);
    else gl.vertexAttrib3f(4, 1, 1, 1);
    if (mesh.tangents) attribute(6, mesh.tangents as BufferSource, 3, gl.SHORT, true, 6);
    else gl.vertexAttrib3f(6, 0, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.indices as BufferSource, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return array;
  }

  uploadStatic(texels: Uint32Array): void {
    const { width, height } = layerSize(this.manifest.static.size);
    this.pool.uploadRadiance(this.pool.staticLayer(), width, height, texels);
  }

  /// One map of the sample in a slot, or of the static set. `alpha` for maps that have one.
  uploadMap(slot: number, map: number, texels: Uint32Array, alpha: Uint8Array | undefined): void {
    const { pool } = this;
    const { width, height } = layerSize(this.manifest.maps[map].size);
    pool.uploadRadiance(pool.radianceLayer(slot, map), width, height, texels);
    if (alpha) pool.uploadAlpha(pool.alphaLayer(slot, this.alphaOf[map]), width, height, alpha);
  }

  /// Pixels RGBA of a texture of the materials.
  uploadTexture(number: number, width: number, height: number, pixels: Uint8Array): void {
    this.surfaces.upload(number, width, height, pixels);
  }

  uploadStill(width: number, height: number, texels: Uint32Array): void {
    const { gl } = this;
    if (this.stillTexture) gl.deleteTexture(this.stillTexture);
    this.stillTexture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.stillTexture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGB9_E5, width, height);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RGB, gl.UNSIGNED_INT_5_9_9_9_REV, texels);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
    ++this.counters.uploaded;
  }

  /// Draws into a framebuffer, or the canvas where it is null; (x, y) is the image's lower left corner there.
  draw(frame: FrameState, framebuffer: WebGLFramebuffer | null = null, x = 0, y = 0): void {
    const { gl } = this;
    this.drawLinear(frame);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    gl.enable(gl.SCISSOR_TEST);
    gl.viewport(x, y, frame.width, frame.height);
    gl.scissor(x, y, frame.width, frame.height);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.targets.sumTexture);
    this.display.use();
    gl.uniform1i(this.display.at("uImage"), 0);
    gl.uniform1f(this.display.at("uExposure"), frame.exposure);
    gl.uniform1i(this.display.at("uNeutral"), frame.neutral ? 1 : 0);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  /// Scene-linear light and, in alpha, the object's coverage; RGBA from the lower left corner.
  readLinear(frame: FrameState): Float32Array {
    this.drawLinear(frame);
    const pixels = new Float32Array(4 * frame.width * frame.height);
    this.targets.bindSum();
    this.gl.readPixels(0, 0, frame.width, frame.height, this.gl.RGBA, this.gl.FLOAT, pixels);
    return pixels;
  }

  private drawLinear(frame: FrameState): void {
    const { gl, targets } = this;
    const { width, height, places } = frame;
    targets.resize(width, height, places.length > 1 ? 1 : 4);
    gl.viewport(0, 0, width, height);
    gl.disable(gl.CULL_FACE);
    if (places.length > 1) {
      targets.bindSum();
      gl.disable(gl.SCISSOR_TEST);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT);
    }
    for (const place of places) {
      targets.bindPass();
      gl.disable(gl.SCISSOR_TEST);
      gl.clearColor(0, 0, 0, 0);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.SCISSOR_TEST);
      const divider = Math.min(Math.max(Math.round(frame.divider), 0), width);
      if (divider > 0) {
        gl.scissor(0, 0, divider, height);
        this.drawContent(frame, frame.left, place);
      }
      if (divider < width) {
        gl.scissor(divider, 0, width - divider, height);
        this.drawContent(frame, frame.right, place);
      }
      if (places.length > 1) this.accumulate(1 / places.length);
    }
    if (places.length === 1) {
      gl.disable(gl.SCISSOR_TEST);
      targets.resolve();
    }
  }

  private accumulate(share: number): void {
    const { gl } = this;
    this.targets.bindSum();
    gl.disable(gl.SCISSOR_TEST);
    gl.disable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.targets.passTexture);
    this.copy.use();
    gl.uniform1i(this.copy.at("uImage"), 0);
    gl.uniform1f(this.copy.at("uShare"), share);
    gl.bindVertexArray(this.empty);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.disable(gl.BLEND);
  }

  private drawContent(frame: FrameState, content: Content, place: [number, number]): void {
    const { gl } = this;
    gl.disable(gl.DEPTH_TEST);
    gl.bindVertexArray(this.empty);
    if (content === "still" && this.stillTexture) {
      gl.activeTexture(gl.TEXTURE0);
      gl.bindTexture(gl.TEXTURE_2D, this.stillTexture);
      this.still.use();
      gl.uniform1i(this.still.at("uStill"), 0);
      gl.uniform2f(this.still.at("uScale"), frame.stillScale[0], frame.stillScale[1]);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      return;
    }
    this.pool.bind();
    this.drawBackground(frame, place);
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    gl.bindVertexArray(this.vertices);
    this.move(frame);
    this.mix(frame);
    for (const range of this.manifest.mesh.ranges) this.drawRange(frame, content, place, range);
  }

  private drawBackground(frame: FrameState, place: [number, number]): void {
    const { gl, background, pool } = this;
    const { view } = frame;
    background.use();
    gl.uniform1i(background.at("uRadiance"), 0);
    gl.uniform1i(background.at("uAlpha"), 1);
    gl.uniform2f(background.at("uLayer"), 1 / pool.width, 1 / pool.height);
    gl.uniform1i(background.at("uMaxTaps"), 1);
    gl.uniform3fv(background.at("uMiddle"), view.middle);
    gl.uniform3fv(background.at("uRight"), view.right);
    gl.uniform3fv(background.at("uDown"), view.down);
    gl.uniform2f(background.at("uPixels"), frame.width, frame.height);
    gl.uniform2f(background.at("uPlace"), place[0], place[1]);
    gl.uniform1f(background.at("uSize"), this.manifest.static.size);
    gl.uniform1f(background.at("uStaticLayer"), pool.staticLayer());
    gl.uniform3fv(background.at("uEye"), view.eye);
    this.staticProxy.set(gl, background);
    const [r, g, b] = frame.plain;
    gl.uniform4f(background.at("uPlain"), r, g, b, frame.background === "plain" ? 1 : 0);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  }

  private move(frame: FrameState): void {
    if (!this.manifest.motion) return;
    this.motion.cosine = Math.cos(frame.turn);
    this.motion.sine = Math.sin(frame.turn);
    this.motion.offset = frame.offset;
    for (const part of this.parts) part.proxies.move(this.motion);
  }

  /// Whether irradiance is that of the blended samples, not that at rest.
  private isLitBySamples(frame: FrameState): boolean {
    return irradianceChanges(this.manifest) && frame.hasSamples;
  }

  /// The shares of the blended samples and of the static set.
  private mix(frame: FrameState): void {
    const fade = frame.hasSet ? (frame.hasSamples ? frame.fade : 0) : 1;
    for (let n = 0; n < this.nodes; ++n) {
      this.weights[n] = frame.weights[n];
      this.slots[n] = frame.slots[n];
      this.mixture[n] = fade * frame.weights[n];
    }
    if (this.mixture.length > this.nodes) this.mixture[this.nodes] = 1 - fade;
    const { restSlot } = this;
    if (restSlot === null || this.isLitBySamples(frame)) return;
    this.weights.fill(0);
    this.weights[0] = 1;
    this.slots.fill(restSlot);
  }

  private drawRange(frame: FrameState, content: Content, place: [number, number], range: Range): void {
    const { gl, manifest, pool } = this;
    const { view } = frame;
    const part = this.parts[range.part];
    const { shells } = manifest.parts[range.part];
    if (range.count === 0) return;
    const program = this.meshProgram(shells.length);
    program.use();
    gl.uniform1i(program.at("uRadiance"), 0);
    gl.uniform1i(program.at("uAlpha"), 1);
    gl.uniform2f(program.at("uLayer"), 1 / pool.width, 1 / pool.height);
    gl.uniform1i(program.at("uMaxTaps"), frame.maxTaps);
    gl.uniformMatrix4fv(program.at("uClipFromWorld"), false, view.clipFromWorld);
    gl.uniform2f(
      program.at("uShift"),
      ((0.5 - place[0]) * 2) / frame.width,
      ((place[1] - 0.5) * 2) / frame.height,
    );
    const { low, high } = manifest.mesh.bounds;
    gl.uniform3fv(program.at("uLow"), low);
    gl.uniform3f(program.at("uExtent"), high[0] - low[0], high[1] - low[1], high[2] - low[2]);
    const uv = manifest.mesh.uvBounds;
    if (uv) {
      gl.uniform2fv(program.at("uUvLow"), uv.low);
      gl.uniform2f(program.at("uUvExtent"), uv.high[0] - uv.low[0], uv.high[1] - uv.low[1]);
    }
    gl.uniform2f(program.at("uTurn"), Math.cos(frame.turn), Math.sin(frame.turn));
    gl.uniform3fv(program.at("uPivot"), this.motion.pivot);
    gl.uniform3fv(program.at("uOffset"), frame.offset);
    gl.uniform3fv(program.at("uEye"), view.eye);
    gl.uniform3fv(program.at("uForward"), view.forward);
    gl.uniform3fv(program.at("uMiddle"), view.middle);
    gl.uniform2f(program.at("uPixels"), frame.width, frame.height);
    gl.uniform2f(program.at("uPlace"), place[0], place[1]);
    gl.uniform3fv(program.at("uRight"), view.right);
    gl.uniform3fv(program.at("uDown"), view.down);
    gl.uniform1f(program.at("uFootprint"), frame.footprint);
    gl.uniform1i(program.at("uFlat"), this.flat ? 1 : 0);
    part.proxies.set(gl, program);
    gl.uniform1fv(program.at("uSize"), part.size);
    for (let s = 0; s < shells.length; ++s) {
      const { map, onHull } = shells[s];
      part.shellOn[s] = frame.shellsOn[part.names[s]] === false ? 0 : 1;
      part.shellOnHull[s] = onHull ? part.shellOn[s] : 0;
      for (let n = 0; n < this.mixture.length; ++n) {
        const at = n * shells.length + s;
        const slot = n < this.nodes ? frame.slots[n] : pool.setSlot;
        part.radianceLayer[at] = pool.radianceLayer(slot, map);
        part.alphaLayer[at] = this.alphaOf[map] < 0 ? -1 : pool.alphaLayer(slot, this.alphaOf[map]);
      }
    }
    const hasMaps = frame.hasSamples || frame.hasSet;
    gl.uniform1fv(program.at("uRadianceLayer"), part.radianceLayer);
    gl.uniform1fv(program.at("uAlphaLayer"), part.alphaLayer);
    gl.uniform1fv(program.at("uWeight"), this.weights);
    gl.uniform1fv(program.at("uMixture"), this.mixture);
    gl.uniform1f(program.at("uStaticLayer"), pool.staticLayer());
    gl.uniform1i(program.at("uCaptured"), content === "pem" && hasMaps ? 0 : 1);
    gl.uniform1i(program.at("uIrradiance"), IRRADIANCE_UNIT);
    gl.uniform1i(program.at("uSides"), litSides(manifest));
    const changes = this.restSlot === null && this.isLitBySamples(frame);
    gl.uniform1i(program.at("uIrradianceChanges"), changes ? 1 : 0);
    gl.uniform1fv(program.at("uSlot"), this.slots);
    this.surfaces.set(program, range.material, frame.fresnelOn, frame.diffuseOn);
    // Triangles that carry all shells, then those on the hull.
    const shellOn = program.at("uShellOn");
    gl.uniform1fv(shellOn, part.shellOn);
    if (range.stacked > 0) {
      gl.drawElements(gl.TRIANGLES, 3 * range.stacked, gl.UNSIGNED_INT, 12 * range.start);
    }
    gl.uniform1fv(shellOn, part.shellOnHull);
    if (range.count > range.stacked) {
      gl.drawElements(
        gl.TRIANGLES,
        3 * (range.count - range.stacked),
        gl.UNSIGNED_INT,
        12 * (range.start + range.stacked),
      );
    }
  }
}

import type { Vec3 } from "../manifest";
import { isScaled, type ProxyShape, shapeNumber, sizeOf } from "../proxy";
import type { Program } from "./program";

/// Where the object has moved to: turned about the vertical through `pivot`, then moved by `offset`.
export interface Motion {
  cosine: number;
  sine: number;
  pivot: Vec3;
  offset: Vec3;
}

/// Proxies as the shaders want them, those that move with the object where it is.
export class Proxies {
  private readonly shape: Int32Array;
  private readonly centre: Float32Array;
  private readonly proxyFromWorld: Float32Array;
  private readonly size: Float32Array;
  private readonly origin: Float32Array;

  /// `moves` says which proxies move.
  constructor(
    private readonly proxies: ProxyShape[],
    private readonly moves: boolean[],
  ) {
    const count = proxies.length;
    this.shape = Int32Array.from(proxies, shapeNumber);
    this.centre = new Float32Array(3 * count);
    this.proxyFromWorld = new Float32Array(9 * count);
    this.size = new Float32Array(3 * count);
    this.origin = new Float32Array(3 * count);
    proxies.forEach((proxy, i) => {
      this.size.set(sizeOf(proxy), 3 * i);
      this.place(i, STILL);
    });
  }

  move(motion: Motion): void {
    for (let i = 0; i < this.proxies.length; ++i) if (this.moves[i]) this.place(i, motion);
  }

  set(gl: WebGL2RenderingContext, program: Program): void {
    gl.uniform1iv(program.at("uShape"), this.shape);
    gl.uniform3fv(program.at("uCentre"), this.centre);
    gl.uniformMatrix3fv(program.at("uProxyFromWorld"), false, this.proxyFromWorld);
    gl.uniform3fv(program.at("uShapeSize"), this.size);
    gl.uniform3fv(program.at("uOrigin"), this.origin);
  }

  private place(i: number, { cosine, sine, pivot, offset }: Motion): void {
    const proxy = this.proxies[i];
    const point = (to: Float32Array, from: Vec3) => {
      const x = from[0] - pivot[0];
      const z = from[2] - pivot[2];
      to[3 * i] = cosine * x + sine * z + pivot[0] + offset[0];
      to[3 * i + 1] = from[1] + offset[1];
      to[3 * i + 2] = cosine * z - sine * x + pivot[2] + offset[2];
    };
    point(this.origin, proxy.origin);
    point(this.centre, proxy.centre ?? ORIGIN);
    const unit = isScaled(proxy) ? sizeOf(proxy) : ONES;
    const axes = proxy.axes ?? AXES;
    for (let row = 0; row < 3; ++row) {
      const [x, y, z] = axes[row];
      const at = 9 * i + row;
      this.proxyFromWorld[at] = (cosine * x + sine * z) / unit[row];
      this.proxyFromWorld[at + 3] = y / unit[row];
      this.proxyFromWorld[at + 6] = (cosine * z - sine * x) / unit[row];
    }
  }
}

const ORIGIN: Vec3 = [0, 0, 0];
const ONES: Vec3 = [1, 1, 1];
const AXES: [Vec3, Vec3, Vec3] = [
  [1, 0, 0],
  [0, 1, 0],
  [0, 0, 1],
];
const STILL: Motion = { cosine: 1, sine: 0, pivot: ORIGIN, offset: ORIGIN };

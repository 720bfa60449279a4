import { UserError } from "../errors";

/// Work that must not happen while the view stays between the same samples.
export interface Counters {
  compiled: number;
  allocated: number;
  uploaded: number;
}

/// A linked program and its uniforms.
export class Program {
  private readonly handle: WebGLProgram;
  private readonly places = new Map<string, WebGLUniformLocation>();

  constructor(
    private readonly gl: WebGL2RenderingContext,
    vertex: string,
    fragment: string,
    counters: Counters,
  ) {
    const handle = gl.createProgram();
    if (!handle) throw new UserError("webgl", "The graphics context was lost.");
    for (const [kind, source] of [
      [gl.VERTEX_SHADER, vertex],
      [gl.FRAGMENT_SHADER, fragment],
    ] as const) {
      const shader = gl.createShader(kind);
      if (!shader) throw new UserError("webgl", "The graphics context was lost.");
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(handle, shader);
      gl.deleteShader(shader);
    }
    gl.linkProgram(handle);
    ++counters.compiled;
    if (!gl.getProgramParameter(handle, gl.LINK_STATUS) && !gl.isContextLost()) {
      const logs = (gl.getAttachedShaders(handle) ?? []).map((s) => gl.getShaderInfoLog(s));
      throw new UserError(
        "webgl",
        `This graphics driver does not take the page's shaders: ${[...logs, gl.getProgramInfoLog(handle)].join(" ").slice(0, 300)}`,
      );
    }
    const count = gl.getProgramParameter(handle, gl.ACTIVE_UNIFORMS) as number;
    for (let i = 0; i < count; ++i) {
      const name = gl.getActiveUniform(handle, i)?.name.replace("[0]", "") ?? "";
      const place = gl.getUniformLocation(handle, name);
      if (place) this.places.set(name, place);
    }
    this.handle = handle;
  }

  use(): void {
    this.gl.useProgram(this.handle);
  }

  /// Of the uniform, or null for one that the program does not use, which WebGL ignores.
  at(name: string): WebGLUniformLocation | null {
    return this.places.get(name) ?? null;
  }
}

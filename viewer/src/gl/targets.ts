import { UserError } from "../errors";
import type { Counters } from "./program";

/// The images that a frame is made in: `pass` takes one lookup per pixel, `sum` their mean; with one lookup per pixel `pass` has
/// four samples a pixel for its edges.
export class Targets {
  width = 0;
  height = 0;
  private samples = 0;
  private passFramebuffer: WebGLFramebuffer | null = null;
  private sumFramebuffer: WebGLFramebuffer | null = null;
  private owned: (() => void)[] = [];
  passTexture: WebGLTexture | null = null;
  sumTexture: WebGLTexture | null = null;

  constructor(
    private readonly gl: WebGL2RenderingContext,
    private readonly counters: Counters,
  ) {}

  /// Makes the images of this size, if they are of another one.
  resize(width: number, height: number, samples: number): void {
    if (width === this.width && height === this.height && samples === this.samples) return;
    this.release();
    const { gl } = this;
    this.width = width;
    this.height = height;
    this.samples = samples;
    const most = gl.getParameter(gl.MAX_SAMPLES) as number;
    const count = Math.min(samples, most);
    this.passFramebuffer = this.framebuffer();
    if (count > 1) {
      this.renderbuffer(gl.RGBA16F, gl.COLOR_ATTACHMENT0, count);
      this.passTexture = null;
    } else {
      this.passTexture = this.texture();
    }
    this.renderbuffer(gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT, count);
    this.check();
    this.sumFramebuffer = this.framebuffer();
    this.sumTexture = this.texture();
    this.check();
    ++this.counters.allocated;
  }

  bindPass(): void {
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, this.passFramebuffer);
  }

  bindSum(): void {
    this.gl.bindFramebuffer(this.gl.FRAMEBUFFER, this.sumFramebuffer);
  }

  /// The mean of the samples of `pass` becomes `sum`.
  resolve(): void {
    const { gl, width, height } = this;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.passFramebuffer);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, this.sumFramebuffer);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, gl.COLOR_BUFFER_BIT, gl.NEAREST);
  }

  release(): void {
    for (const release of this.owned) release();
    this.owned = [];
    this.width = 0;
  }

  private framebuffer(): WebGLFramebuffer | null {
    const { gl } = this;
    const handle = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, handle);
    this.owned.push(() => gl.deleteFramebuffer(handle));
    return handle;
  }

  private texture(): WebGLTexture | null {
    const { gl, width, height } = this;
    const handle = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, handle);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA16F, width, height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, handle, 0);
    this.owned.push(() => gl.deleteTexture(handle));
    return handle;
  }

  private renderbuffer(format: number, attachment: number, samples: number): void {
    const { gl, width, height } = this;
    const handle = gl.createRenderbuffer();
    gl.bindRenderbuffer(gl.RENDERBUFFER, handle);
    if (samples > 1) gl.renderbufferStorageMultisample(gl.RENDERBUFFER, samples, format, width, height);
    else gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, attachment, gl.RENDERBUFFER, handle);
    this.owned.push(() => gl.deleteRenderbuffer(handle));
  }

  private check(): void {
    const { gl } = this;
    const status = gl.checkFramebufferStatus(gl.FRAMEBUFFER);
    if (status !== gl.FRAMEBUFFER_COMPLETE && !gl.isContextLost()) {
      throw new UserError(
        "texture",
        "This graphics card cannot draw into half-float images, which the page needs.",
      );
    }
  }
}

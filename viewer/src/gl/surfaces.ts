import type { Manifest, Material, TextureUse } from "../manifest";
import type { Counters, Program } from "./program";

const FRESNEL = { constant: 0, schlick: 1, dielectric: 2, conductor: 3 };
const ALL = 4;
const NO_MIRROR = 5;
const FIRST_UNIT = 3;

/// The materials and their textures.
export class Surfaces {
  private readonly textures: (WebGLTexture | null)[];
  private readonly materials: MaterialUniforms[];

  constructor(
    private readonly gl: WebGL2RenderingContext,
    private readonly manifest: Manifest,
    private readonly counters: Counters,
  ) {
    this.textures = manifest.textures.map(() => null);
    this.materials = manifest.materials.map(uniformsOf);
  }

  /// Pixels RGBA, row 0 on top.
  upload(number: number, width: number, height: number, pixels: Uint8Array): void {
    const { gl } = this;
    const { wrap, linear } = this.manifest.textures[number];
    const handle = gl.createTexture();
    gl.activeTexture(gl.TEXTURE0 + FIRST_UNIT);
    gl.bindTexture(gl.TEXTURE_2D, handle);
    const levels = Math.floor(Math.log2(Math.max(width, height))) + 1;
    gl.texStorage2D(gl.TEXTURE_2D, levels, linear ? gl.RGBA8 : gl.SRGB8_ALPHA8, width, height);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    gl.generateMipmap(gl.TEXTURE_2D);
    const wraps = { repeat: gl.REPEAT, clamp: gl.CLAMP_TO_EDGE, mirror: gl.MIRRORED_REPEAT };
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, wraps[wrap[0]] ?? gl.REPEAT);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, wraps[wrap[1]] ?? gl.REPEAT);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    const anisotropy = gl.getExtension("EXT_texture_filter_anisotropic");
    if (anisotropy) gl.texParameteri(gl.TEXTURE_2D, anisotropy.TEXTURE_MAX_ANISOTROPY_EXT, 8);
    this.textures[number] = handle;
    ++this.counters.allocated;
    ++this.counters.uploaded;
  }

  set(program: Program, number: number, fresnelOn: boolean, diffuseOn: boolean): void {
    const { gl } = this;
    const material = this.materials[number];
    gl.uniform1i(program.at("uFresnel"), !material.specular ? NO_MIRROR : fresnelOn ? material.fresnel : ALL);
    gl.uniform3fv(program.at("uR0"), material.r0);
    gl.uniform3fv(program.at("uEta"), material.eta);
    gl.uniform3fv(program.at("uK"), material.k);
    gl.uniform1i(program.at("uCoated"), material.coated ? 1 : 0);
    gl.uniform1f(program.at("uDiffuseOn"), diffuseOn ? 1 : 0);
    gl.uniform3fv(program.at("uAlbedo"), material.albedo);
    gl.uniform1f(program.at("uNormalScale"), material.normalScale);
    gl.uniform1i(program.at("uColorsTint"), material.tint ? 1 : 0);
    for (let t = 0; t < 3; ++t) {
      const use = material.textures[t];
      const there = use !== null && this.textures[use.number] !== null;
      this.textured[t] = there ? 1 : 0;
      gl.uniform1i(program.at(SAMPLERS[t]), FIRST_UNIT + t);
      if (!there) continue;
      gl.activeTexture(gl.TEXTURE0 + FIRST_UNIT + t);
      gl.bindTexture(gl.TEXTURE_2D, this.textures[use.number]);
      gl.uniformMatrix3x2fv(program.at(MATRICES[t]), false, use.matrix);
    }
    gl.uniform3iv(program.at("uTextured"), this.textured);
  }

  private readonly textured = new Int32Array(3);
}

const SAMPLERS = ["uAlbedoTexture", "uReflectanceTexture", "uNormalTexture"];
const MATRICES = ["uAlbedoFromUv", "uReflectanceFromUv", "uNormalFromUv"];

interface MaterialUniforms {
  specular: boolean;
  fresnel: number;
  coated: boolean;
  tint: boolean;
  r0: Float32Array;
  eta: Float32Array;
  k: Float32Array;
  albedo: Float32Array;
  normalScale: number;
  textures: ({ number: number; matrix: Float32Array } | null)[];
}

function uniformsOf(material: Material): MaterialUniforms {
  const texture = (use: TextureUse | null) => {
    if (!use) return null;
    const [a, b, c, d, e, f] = use.matrix;
    return { number: use.texture, matrix: Float32Array.of(a, d, b, e, c, f) };
  };
  return {
    specular: material.specular,
    fresnel: FRESNEL[material.fresnel] ?? FRESNEL.constant,
    coated: material.coated,
    tint: material.colorsTintReflectance,
    r0: Float32Array.from(material.r0),
    eta: Float32Array.from(material.eta),
    k: Float32Array.from(material.k),
    albedo: Float32Array.from(material.albedo),
    normalScale: material.normalScale,
    textures: [material.albedoTexture, material.reflectanceTexture, material.normalTexture].map(texture),
  };
}

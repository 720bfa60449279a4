// Draws an exported PEM in three.js: the maps of one set on the mesh of the GLB.
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { read as readKtx2 } from "three/addons/libs/ktx-parse.module.js";

const EXTENSION = "EXT_mirrorbake_pem";
const SHAPES = { infinite: 0, box: 1, ellipsoid: 2, hemisphere: 3 };

// Loads what `mirrorbake export` wrote. `base` is the folder of maps.json, `name` a set in it ("static", "sample-0000").
export async function loadReflector(base, glb, name) {
  const description = await (await fetch(`${base}/maps.json`)).json();
  if (description.convention !== "threejs") throw new Error("the maps are not those of --convention threejs");
  const set = description.sets.find((candidate) => candidate.name === name);
  if (!set) throw new Error(`maps.json has no set ${name}`);
  const texts = ["lookups.glsl", "surface.glsl"].map(async (file) =>
    (await fetch(new URL(file, import.meta.url))).text(),
  );
  const functions = (await Promise.all(texts)).join("\n");
  const gltf = await new GLTFLoader().loadAsync(glb);
  const lightmap = await loadLightmap(gltf.parser);
  const textures = new Map();
  const meshes = [];
  gltf.scene.traverse((object) => object.isMesh && meshes.push(object));
  for (const mesh of meshes) {
    const { part, stackIndices } = mesh.userData.gltfExtensions[EXTENSION];
    const surface = mesh.material.userData.gltfExtensions[EXTENSION];
    const shells = set.parts[part].shells;
    for (const shell of shells) {
      if (!textures.has(shell.files[0])) textures.set(shell.files[0], await loadCube(`${base}/${shell.files[0]}`));
    }
    const { _irradiance, _irradiance_back } = mesh.geometry.attributes;
    const diffuse = { front: _irradiance !== undefined, back: _irradiance_back !== undefined, lightmap };
    const { side } = mesh.material;
    const material = (stack) =>
      shellMaterial(stack, textures, surface, description.runTime, functions, diffuse, side);
    // What lies on the convex hull cannot reflect the object itself.
    mesh.geometry.addGroup(0, stackIndices, 0);
    mesh.geometry.addGroup(stackIndices, mesh.geometry.index.count - stackIndices, 1);
    mesh.material = [material(shells), material(shells.filter((shell) => !shell.off_hull))];
  }
  return gltf.scene;
}

// The irradiance of fronts and backs where it is a map on the texture coordinates, and the corners of that; null: it is at
// the vertices.
async function loadLightmap(parser) {
  const described = parser.json.extensions[EXTENSION].lightmap;
  if (!described) return null;
  const { size, low, high, front, back } = described;
  const load = async (accessor) => {
    const { array } = await parser.getDependency("accessor", accessor);
    const data = new Uint16Array(4 * size * size);
    for (let i = 0; i < array.length; ++i) data[4 * Math.floor(i / 3) + (i % 3)] = THREE.DataUtils.toHalfFloat(array[i]);
    const texture = new THREE.DataTexture(data, size, size, THREE.RGBAFormat, THREE.HalfFloatType);
    texture.magFilter = texture.minFilter = THREE.LinearFilter;
    texture.needsUpdate = true;
    return texture;
  };
  const [frontLight, backLight] = await Promise.all([load(front), load(back ?? front)]);
  const [uvLow, uvHigh] = [low, high].map((corner) => new THREE.Vector2(...corner));
  return { frontLight, backLight, uvLow, uvHigh };
}

// A cube map of half floats with its own levels. three.js' KTX2Loader reads compressed cubes only.
async function loadCube(url) {
  const response = await fetch(url);
  if (!response.ok) throw new Error(`${url}: ${response.status}`);
  const file = readKtx2(new Uint8Array(await response.arrayBuffer()));
  const levels = file.levels.map(({ levelData }, index) => {
    const size = Math.max(1, file.pixelWidth >> index);
    const halves = new Uint16Array(levelData.slice().buffer);
    return Array.from({ length: 6 }, (_, face) => {
      const count = size * size * 4;
      const data = halves.subarray(face * count, (face + 1) * count);
      return new THREE.DataTexture(data, size, size, THREE.RGBAFormat, THREE.HalfFloatType);
    });
  });
  const texture = new THREE.CubeTexture(levels[0]);
  texture.mipmaps = levels.slice(1).map((image) => ({ image }));
  texture.format = THREE.RGBAFormat;
  texture.type = THREE.HalfFloatType;
  texture.colorSpace = THREE.NoColorSpace;
  texture.generateMipmaps = false; // the levels were inferred
  texture.magFilter = THREE.LinearFilter;
  texture.minFilter = THREE.LinearMipmapLinearFilter;
  texture.needsUpdate = true;
  return texture;
}

function shellMaterial(shells, textures, surface, runTime, functions, diffuse, side) {
  const uniforms = {};
  const maxTaps = runTime.filter === "anisotropic" ? runTime.maxTaps : 1;
  const { places, footprintScale } = runTime;
  const declarations = [];
  const reads = [];
  shells.forEach(({ proxy, files, size, channels }, i) => {
    const shape = SHAPES[proxy.shape];
    uniforms[`map${i}`] = { value: textures.get(files[0]) };
    uniforms[`origin${i}`] = { value: new THREE.Vector3(...proxy.origin) };
    uniforms[`centre${i}`] = { value: new THREE.Vector3(...(proxy.centre ?? [0, 0, 0])) };
    uniforms[`axes${i}`] = { value: new THREE.Matrix3().set(...(proxy.axes ?? [1, 0, 0, 0, 1, 0, 0, 0, 1]).flat()) };
    const extent = proxy.half_extent ?? proxy.radii ?? Array(3).fill(proxy.radius ?? 1);
    uniforms[`extent${i}`] = { value: new THREE.Vector3(...extent) };
    declarations.push(`
uniform samplerCube map${i};
uniform vec3 origin${i}, centre${i}, extent${i};
uniform mat3 axes${i};
vec3 lookup${i}(vec3 p, vec3 d) {
  ${
    [
      "return lookupInfinite(p, d);",
      `return lookupBox(p, d, centre${i}, axes${i}, extent${i}, origin${i});`,
      `return lookupEllipsoid(p, d, centre${i}, axes${i}, extent${i}, origin${i});`,
      `return lookupHemisphere(p, d, centre${i}, axes${i}, extent${i}.x, origin${i});`,
    ][shape]
  }
}`);
    // Files of the convention threejs are read with -x, as by the shaders of three.js.
    reads.push(`
      vec3 at${i} = lookup${i}(s.p, s.r);
      vec3 dx${i} = lookup${i}(s.p + s.px, s.r + s.rx) - at${i}, dy${i} = lookup${i}(s.p + s.py, s.r + s.ry) - at${i};
      Taps taps${i} = tapsOf(at${i}, dx${i}, dy${i}, ${size}.0, ${maxTaps}.0);
      vec4 value${i} = vec4(0.0);
      for (int tap = 0; tap < tapCount(taps${i}); ++tap) {
        float share;
        vec3 d = tapDirection(taps${i}, at${i}, tap, share);
        value${i} += share * textureLod(map${i}, vec3(-d.x, d.yz), taps${i}.level);
      }
      ${channels === 4 ? "" : `value${i}.a = 1.0;`}
      addShell(value${i}, light, transmittance);`);
  });
  const { lightmap } = diffuse;
  if (lightmap) {
    for (const [name, value] of Object.entries(lightmap)) uniforms[name] = { value };
    declarations.push("uniform sampler2D frontLight, backLight;\nuniform vec2 uvLow, uvHigh;");
  }
  const irradiance = lightmap
    ? "(gl_FrontFacing ? textureLod(frontLight, at_, 0.0) : textureLod(backLight, at_, 0.0)).rgb"
    : "(gl_FrontFacing ? irradiance_ : back_)";
  const { fresnel } = surface;
  const reflectance = {
    constant: () => "vec3(" + fresnel.r0 + ")",
    schlick: () => `fresnelSchlick(c, vec3(${fresnel.r0}))`,
    dielectric: () => `fresnelDielectric(c, vec3(${fresnel.ior}))`,
    conductor: () => `fresnelConductor(c, vec3(${fresnel.eta}), vec3(${fresnel.k}))`,
  }[fresnel.model]();
  return new THREE.ShaderMaterial({
    uniforms,
    side,
    vertexShader: `
      ${diffuse.front ? "in vec3 _irradiance;" : "const vec3 _irradiance = vec3(0.0);"}
      ${diffuse.back ? "in vec3 _irradiance_back;" : ""}
      out vec3 position_, normal_, irradiance_, back_;
      out vec2 uv_;
      void main() {
        position_ = (modelMatrix * vec4(position, 1.0)).xyz;
        normal_ = mat3(modelMatrix) * normal;
        uv_ = uv;
        irradiance_ = _irradiance;
        back_ = ${diffuse.back ? "_irradiance_back" : "_irradiance"};
        gl_Position = projectionMatrix * viewMatrix * vec4(position_, 1.0);
      }`,
    fragmentShader: `
      in vec3 position_, normal_, irradiance_, back_;
      in vec2 uv_;
      ${functions}
      ${declarations.join("\n")}
      void main() {
        vec3 normal = gl_FrontFacing ? normal_ : -normal_;
        ${lightmap ? "vec2 at_ = (uv_ - uvLow) / (uvHigh - uvLow);" : ""}
        vec3 forward = -vec3(viewMatrix[0].z, viewMatrix[1].z, viewMatrix[2].z);
        const vec2 places[${places.length}] = vec2[](${places.map(([x, y]) => `vec2(${x.toFixed(6)}, ${y.toFixed(6)})`)});
        vec3 total = vec3(0.0);
        // The maps were inferred for just these lookups.
        for (int i = 0; i < ${places.length}; ++i) {
          Reflection s = reflectionAt(position_, normal, cameraPosition, forward, places[i], ${footprintScale.toFixed(6)});
          float c = dot(s.n, s.v);
          vec3 light = vec3(0.0);
          float transmittance = 1.0;
          ${reads.join("\n")}
          vec3 f = ${reflectance};
          vec3 body = ${irradiance} * vec3(${surface.albedo}) * ${1 / Math.PI};
          total += f * light + ${surface.layers === "coated" ? "(1.0 - f) * body" : "body"};
        }
        gl_FragColor = vec4(total / ${places.length}.0, 1.0);
        #include <colorspace_fragment>
      }`,
  });
}

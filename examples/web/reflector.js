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
  const lookups = await (await fetch(new URL("lookups.glsl", import.meta.url))).text();
  const gltf = await new GLTFLoader().loadAsync(glb);
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
    const diffuse = mesh.geometry.attributes._irradiance !== undefined;
    const material = (stack) => shellMaterial(stack, textures, surface, description.footprintScale, lookups, diffuse);
    // What lies on the convex hull cannot reflect the object itself.
    mesh.geometry.addGroup(0, stackIndices, 0);
    mesh.geometry.addGroup(stackIndices, mesh.geometry.index.count - stackIndices, 1);
    mesh.material = [material(shells), material(shells.filter((shell) => !shell.off_hull))];
  }
  return gltf.scene;
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

function shellMaterial(shells, textures, surface, footprintScale, lookups, diffuse) {
  const uniforms = { footprintScale: { value: footprintScale } };
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
      vec3 at${i} = lookup${i}(p, r);
      vec3 dx${i} = lookup${i}(p + sx, rx) - at${i}, dy${i} = lookup${i}(p + sy, ry) - at${i};
      vec4 value${i} = textureLod(map${i}, vec3(-at${i}.x, at${i}.yz), levelOfDetail(at${i}, dx${i}, dy${i}, ${size}.0));
      ${channels === 4 ? "" : `value${i}.a = 1.0;`}
      addShell(value${i}, light, transmittance);`);
  });
  const { fresnel } = surface;
  const reflectance = {
    constant: () => "vec3(" + fresnel.r0 + ")",
    schlick: () => `fresnelSchlick(c, vec3(${fresnel.r0}))`,
    dielectric: () => `fresnelDielectric(c, vec3(${fresnel.ior}))`,
    conductor: () => `fresnelConductor(c, vec3(${fresnel.eta}), vec3(${fresnel.k}))`,
  }[fresnel.model]();
  return new THREE.ShaderMaterial({
    uniforms,
    vertexShader: `
      ${diffuse ? "in vec3 _irradiance;" : "const vec3 _irradiance = vec3(0.0);"}
      out vec3 position_, normal_, irradiance_;
      void main() {
        position_ = (modelMatrix * vec4(position, 1.0)).xyz;
        normal_ = mat3(modelMatrix) * normal;
        irradiance_ = _irradiance;
        gl_Position = projectionMatrix * viewMatrix * vec4(position_, 1.0);
      }`,
    fragmentShader: `
      in vec3 position_, normal_, irradiance_;
      uniform float footprintScale;
      ${lookups}
      ${declarations.join("\n")}
      void main() {
        vec3 position = position_, normal = normal_;
        vec3 px = dFdx(position), py = dFdy(position), nx = dFdx(normal), ny = dFdy(normal);
        // The maps are inferred for lookups of so small a footprint that together they fill the pixel.
        int side = int(1.0 / footprintScale + 0.5);
        vec3 total = vec3(0.0);
        for (int i = 0; i < side * side; ++i) {
          vec2 at = (vec2(i % side, i / side) + 0.5) / float(side) - 0.5;
          vec3 p = position + at.x * px + at.y * py;
          vec3 n = normalize(normal + at.x * nx + at.y * ny);
          vec3 v = normalize(cameraPosition - p);
          vec3 r = reflect(-v, n);
          // Reflections at the other sides of the lookup's footprint.
          vec3 sx = footprintScale * px, sy = footprintScale * py;
          vec3 rx = reflect(normalize(p + sx - cameraPosition), normalize(n + footprintScale * nx));
          vec3 ry = reflect(normalize(p + sy - cameraPosition), normalize(n + footprintScale * ny));
          float c = dot(n, v);
          vec3 light = vec3(0.0);
          float transmittance = 1.0;
          ${reads.join("\n")}
          vec3 f = ${reflectance};
          vec3 body = irradiance_ * vec3(${surface.albedo}) * ${1 / Math.PI};
          total += f * light + ${surface.layers === "coated" ? "(1.0 - f) * body" : "body"};
        }
        gl_FragColor = vec4(total / float(side * side), 1.0);
        #include <colorspace_fragment>
      }`,
  });
}

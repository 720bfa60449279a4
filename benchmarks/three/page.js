// In the browser: three.js' PMREM of a panorama, and its values in given directions.
import * as THREE from "three";

const floats = async (name) => new Float32Array(await (await fetch(name)).arrayBuffer());

function texture(data, width, height) {
  const map = new THREE.DataTexture(data, width, height, THREE.RGBAFormat, THREE.FloatType);
  map.needsUpdate = true;
  return map;
}

// For every level asked for: its roughness and RGBA values of all directions. The time is that of the second of two
// runs, which compiles nothing.
async function filter({ width, height, count, levels }) {
  const renderer = new THREE.WebGLRenderer();
  const panorama = texture(await floats("panorama"), width, height);
  panorama.mapping = THREE.EquirectangularReflectionMapping;
  panorama.minFilter = panorama.magFilter = THREE.LinearFilter;
  const generator = new THREE.PMREMGenerator(renderer);
  const pixel = new Uint16Array(4);
  const run = () => {
    const start = performance.now();
    const made = generator.fromEquirectangular(panorama);
    renderer.readRenderTargetPixels(made, 0, 0, 1, 1, pixel, 0); // waits for the work
    return { made, milliseconds: performance.now() - start };
  };
  run().made.dispose();
  const { made, milliseconds } = run();
  const last = made.texture.mipmaps.length - 1;

  const scene = new THREE.Scene();
  const material = new THREE.ShaderMaterial({
    uniforms: {
      map: { value: made.texture },
      directions: { value: texture(await floats("directions"), count, 1) },
      level: { value: 0 },
    },
    vertexShader: "void main() { gl_Position = vec4(position.xy, 0.0, 1.0); }",
    fragmentShader: `
      uniform samplerCube map;
      uniform sampler2D directions;
      uniform float level;
      void main() {
        vec3 d = texelFetch(directions, ivec2(gl_FragCoord.x, 0), 0).xyz;
        gl_FragColor = textureLod(map, d, level);
      }`,
    depthTest: false,
  });
  scene.add(new THREE.Mesh(new THREE.PlaneGeometry(2, 2), material));
  const target = new THREE.WebGLRenderTarget(count, 1, { type: THREE.FloatType, depthBuffer: false });
  const found = [];
  for (const level of levels) {
    material.uniforms.level.value = level;
    renderer.setRenderTarget(target);
    renderer.render(scene, new THREE.Camera());
    const values = new Float32Array(4 * count);
    renderer.readRenderTargetPixels(target, 0, 0, count, 1, values);
    found.push({ roughness: THREE.PMREMGenerator.lodToRoughness(level, last), values: [...values] });
  }
  return { milliseconds, size: made.width, levels: last + 1, found };
}

window.filter = filter;

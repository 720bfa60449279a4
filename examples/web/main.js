import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { loadReflector } from "./reflector.js";

const message = document.querySelector("output");
try {
  const renderer = new THREE.WebGLRenderer({ antialias: true });
  renderer.debug.onShaderError = (gl, program, vertex, fragment) => {
    message.textContent = `Cannot show the reflector: ${gl.getShaderInfoLog(fragment)}`;
    document.body.append(message);
  };
  renderer.setPixelRatio(devicePixelRatio);
  document.body.append(renderer.domElement);
  const set = new URLSearchParams(location.search).get("set") ?? "static";
  const reflector = await loadReflector("maps", "reflector.glb", set);
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0x30343a);
  scene.add(reflector);

  const sphere = new THREE.Box3().setFromObject(reflector).getBoundingSphere(new THREE.Sphere());
  const camera = new THREE.PerspectiveCamera(30, 1, sphere.radius / 10, sphere.radius * 100);
  camera.position.copy(sphere.center).add(new THREE.Vector3(0, 0.36, 1).setLength(4 * sphere.radius));
  const controls = new OrbitControls(camera, renderer.domElement);
  controls.target.copy(sphere.center);

  const draw = () => renderer.render(scene, camera);
  const resize = () => {
    renderer.setSize(innerWidth, innerHeight);
    camera.aspect = innerWidth / innerHeight;
    camera.updateProjectionMatrix();
    draw();
  };
  controls.addEventListener("change", draw);
  addEventListener("resize", resize);
  controls.update();
  message.remove();
  resize();
} catch (error) {
  message.textContent = `Cannot show the reflector: ${error.message}`;
  throw error;
}

// In the browser: draws a garment with three.js and the package's plugin into a float target.
import {
  DirectionalLight, FloatType, PerspectiveCamera, Scene, Vector3, WebGLRenderTarget, WebGLRenderer,
} from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { SelvedgeFabric } from 'selvedge/three/index.js';

const renderer = new WebGLRenderer({ preserveDrawingBuffer: true });
renderer.setClearColor(0, 0);

/** { scene, materials } of a garment, its fabrics loaded or found broken. */
export async function load(file) {
  const loader = new GLTFLoader();
  loader.register((parser) => new SelvedgeFabric(parser));
  const { scene } = await loader.loadAsync(file);
  const materials = new Set();
  scene.traverse(({ material }) => material?.isFabricMaterial && materials.add(material));
  for (const { fabric } of materials) await fabric?.settled;
  return { scene, materials: [...materials] };
}

/** A camera as `selvedge-view render` places it. */
function camera_of({ look_at, distance, fov, azimuth, elevation, width, height }) {
  const camera = new PerspectiveCamera(fov, width / height, distance / 100, 10 * distance);
  const [a, e] = [azimuth, elevation].map((degrees) => degrees * Math.PI / 180);
  const target = new Vector3(...look_at);
  camera.position.set(Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e)).multiplyScalar(distance).add(target);
  camera.lookAt(target);
  return camera;
}

/** Radiance * opacity and opacity of a view, row by row from the top, as base64 of floats. */
export async function drawn(file, view, lights, how = {}) {
  const { scene: garment, materials } = await load(file);
  for (const material of materials) Object.assign(material, how);
  const scene = new Scene();
  scene.add(garment);
  for (const [x, y, z, intensity] of lights) {
    const light = new DirectionalLight(0xffffff, intensity);
    light.position.set(x, y, z);
    scene.add(light);
  }
  const { width, height } = view;
  const target = new WebGLRenderTarget(width, height, { type: FloatType });
  renderer.setRenderTarget(target);
  const begin = performance.now();
  renderer.clear();
  renderer.render(scene, camera_of(view));
  const pixels = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
  const ms = performance.now() - begin;
  const turned = new Float32Array(pixels.length);
  for (let y = 0; y < height; ++y) turned.set(pixels.subarray(4 * width * (height - 1 - y), 4 * width * (height - y)), 4 * width * y);
  const bytes = new Uint8Array(turned.buffer);
  let text = '';
  for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
  return { pixels: btoa(text), ms, states: materials.map(({ fabric, shows }) => [fabric?.state, shows, fabric?.issue?.code]) };
}

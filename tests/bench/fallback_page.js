// In the browser: draws a garment as three.js does without the package's plugin, into float targets.
import {
  DirectionalLight, FloatType, PerspectiveCamera, Scene, Vector3, WebGLRenderTarget, WebGLRenderer,
} from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

const renderer = new WebGLRenderer();
renderer.setClearColor(0, 0);

/** A camera as `selvedge-view render` places it. */
function camera_of({ look_at, distance, fov, azimuth, elevation, width, height }) {
  const camera = new PerspectiveCamera(fov, width / height, distance / 100, 10 * distance);
  const [a, e] = [azimuth, elevation].map((degrees) => degrees * Math.PI / 180);
  const target = new Vector3(...look_at);
  camera.position.set(Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e))
    .multiplyScalar(distance).add(target);
  camera.lookAt(target);
  return camera;
}

/** Of each light alone: radiance * opacity and opacity, row by row from the top, as base64 of floats. */
export async function drawn(file, view, lights) {
  const { width, height } = view, row = 4 * width;
  const light = new DirectionalLight(0xffffff, 1), scene = new Scene();
  scene.add(light, (await new GLTFLoader().loadAsync(file)).scene);
  const target = new WebGLRenderTarget(width, height, { type: FloatType });
  renderer.setRenderTarget(target);
  return lights.map((direction) => {
    light.position.set(...direction);
    renderer.clear();
    renderer.render(scene, camera_of(view));
    const pixels = new Float32Array(row * height), turned = new Float32Array(row * height);
    renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
    for (let y = 0; y < height; ++y) turned.set(pixels.subarray(row * (height - 1 - y), row * (height - y)), row * y);
    const bytes = new Uint8Array(turned.buffer);
    let text = '';
    for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
    return btoa(text);
  });
}

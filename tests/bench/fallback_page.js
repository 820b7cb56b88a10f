// In the browser: draws a garment as three.js does without the package's plugin, into float targets.
import { DirectionalLight, FloatType, Scene, WebGLRenderTarget, WebGLRenderer } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { base64, camera_of, read_rows } from '/test/picture_page.js';

const renderer = new WebGLRenderer();
renderer.setClearColor(0, 0);

/** Radiance * opacity and opacity by each light alone, row by row from the top, as base64 of floats. */
export async function drawn(file, view, lights) {
  const { width, height } = view;
  const light = new DirectionalLight(0xffffff, 1), scene = new Scene();
  scene.add(light, (await new GLTFLoader().loadAsync(file)).scene);
  const target = new WebGLRenderTarget(width, height, { type: FloatType });
  renderer.setRenderTarget(target);
  return lights.map((direction) => {
    light.position.set(...direction);
    renderer.clear();
    renderer.render(scene, camera_of(view));
    return base64(read_rows(renderer, target));
  });
}

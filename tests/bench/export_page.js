// In the browser: draws an export as three.js does, into float targets.
import { DirectionalLight, FloatType, Scene, WebGLRenderTarget, WebGLRenderer } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import { base64, camera_of, read_rows } from '/test/picture_page.js';

const renderer = new WebGLRenderer();
renderer.setClearColor(0, 0);

/** Under one light: radiance * opacity and opacity, row by row from the top, as base64 of floats, of each view. */
export async function drawn(file, views, light_direction) {
  const light = new DirectionalLight(0xffffff, 1), scene = new Scene();
  light.position.set(...light_direction);
  scene.add(light, (await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).loadAsync(file)).scene);
  return views.map((view) => {
    const target = new WebGLRenderTarget(view.width, view.height, { type: FloatType, samples: 4 });
    renderer.setRenderTarget(target);
    renderer.clear();
    renderer.render(scene, camera_of(view));
    const picture = base64(read_rows(renderer, target));
    target.dispose();
    return picture;
  });
}

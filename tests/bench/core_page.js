// In the browser: draws a scene with three.js alone into a float target, lit by an equirectangular picture.
import { EquirectangularReflectionMapping, FloatType, Scene, ShaderChunk, WebGLRenderTarget, WebGLRenderer } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { HDRLoader } from 'three/addons/loaders/HDRLoader.js';
import { base64, camera_of, read_rows } from '/test/picture_page.js';

const renderer = new WebGLRenderer();
renderer.setClearColor(0, 0);

/** three.js's least roughness, and what it adds where normals change from pixel to pixel. */
const OF_PIXELS = /material\.roughness = max\( roughnessFactor, [\d.]+ \);\s*material\.roughness \+= geometryRoughness;/;
const WHOLE = ShaderChunk.lights_physical_fragment, PLAIN = WHOLE.replace(OF_PIXELS, 'material.roughness = roughnessFactor;');
if (PLAIN === WHOLE) throw new Error('three.js has another shader');

/** Radiance and opacity of a view, row by row from the top, as base64 of floats: as it is, and with the roughness of glTF. */
export async function drawn(file, view, environment) {
  const picture = await new HDRLoader().loadAsync(environment);
  picture.mapping = EquirectangularReflectionMapping;
  const pictures = [];
  for (const text of [WHOLE, PLAIN]) {
    ShaderChunk.lights_physical_fragment = text;
    const scene = new Scene();
    scene.add((await new GLTFLoader().loadAsync(file)).scene);
    // For a program of its own.
    scene.traverse(({ material }) => material && Object.assign(material, { customProgramCacheKey: () => text }));
    scene.environment = picture;
    // three.js has the picture's middle column along x.
    scene.environmentRotation.y = Math.PI / 2;
    const target = new WebGLRenderTarget(view.width, view.height, { type: FloatType });
    renderer.setRenderTarget(target);
    renderer.clear();
    renderer.render(scene, camera_of(view));
    pictures.push(base64(read_rows(renderer, target)));
  }
  return pictures;
}

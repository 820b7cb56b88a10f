// In the browser: draws a garment with three.js and the package's plugin into a float target.
import { DataUtils, DirectionalLight, EquirectangularReflectionMapping, FloatType, REVISION, Scene } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import * as way from 'way';
import { base64, camera_of, rows_of } from '/test/picture_page.js';

const { RenderTarget, SelvedgeFabric, Surroundings, cell_images, read, renderer_of, use_worker } = way;
const renderer = await renderer_of();
renderer.shadowMap.enabled = false;

const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
loader.register((parser) => new SelvedgeFabric(parser));
const loaded = new Map();

/** { scene, materials } of a garment, its fabrics loaded or found broken. */
async function load(file) {
  const { scene } = await loader.loadAsync(file);
  const materials = new Set();
  scene.traverse(({ material }) => material?.isFabricMaterial && materials.add(material));
  for (const { fabric } of materials) await fabric?.settled;
  return { scene, materials: [...materials] };
}

/** The picture of an equirectangular texture of three.js, for Surroundings. */
function picture_of({ image: { data, width, height } }) {
  const radiance = new Float32Array(3 * width * height);
  // HDRLoader's first row is the highest.
  for (let i = 0; i < width * height; ++i)
    for (let c = 0; c < 3; ++c) radiance[3 * i + c] = DataUtils.fromHalfFloat(data[4 * i + c]);
  return { width, height, radiance };
}

/** Lights a scene by { file, turn, strength, shades } as `selvedge-view render` does; `shades`: it hides light from itself. */
async function surround(scene, garment, { file, turn, strength, shades }) {
  if (!loaded.has(file)) {
    const name = Number.parseInt(REVISION, 10) < 180 ? 'RGBELoader' : 'HDRLoader';
    const { [name]: Loader } = await import(`three/addons/loaders/${name}.js`);
    loaded.set(file, await new Loader().loadAsync(file));
  }
  renderer.shadowMap.enabled = shades;
  if (shades) {
    const surroundings = new Surroundings(scene, picture_of(loaded.get(file)));
    surroundings.stand(garment);
    await surroundings.shade(renderer, garment);
    return surroundings.set({ turn, strength });
  }
  scene.environment = loaded.get(file);
  scene.environment.mapping = EquirectangularReflectionMapping;
  scene.environmentIntensity = strength;
  scene.environmentRotation.y = Math.PI / 2 + turn * Math.PI / 180;
}

function light_of([x, y, z, intensity]) {
  const light = new DirectionalLight(0xffffff, intensity);
  light.position.set(x, y, z);
  return light;
}

/** Draws frames until all materials show what they can, and their images are at rest. */
async function settle(scene, camera, materials) {
  const is_ready = ({ shows, fabric, is_of_use }) => shows === 'fabric' || !is_of_use || fabric?.state !== 'ready', target = renderer.getRenderTarget();
  for (const end = performance.now() + 60000; performance.now() < end;) {
    renderer.render(scene, camera);
    // Else the graphics fall behind.
    if (target) await read(renderer, target);
    if (materials.every(is_ready) && cell_images.at_rest()) return;
    await new Promise((go_on) => setTimeout(go_on, 20));
  }
}

/**
 * Radiance * opacity and opacity of a view, the mean of `frames`, row by row from the top, as base64 of floats; the ms of one,
 * after so many seconds until all was at rest. `environment`: null, or surround()'s; `tint`: another one.
 */
export async function drawn(file, view, lights, environment, { frames = 1, tint } = {}) {
  if (!loaded.has(file)) loaded.set(file, await load(file));
  const { scene: garment, materials } = loaded.get(file);
  const scene = new Scene();
  scene.add(garment);
  const parts = materials.map(({ parts }) => parts);
  for (const material of tint ? materials : []) material.set_tint(tint);
  if (lights.length > 0) scene.add(...lights.map(light_of));
  const { width, height } = view;
  const target = new RenderTarget(width, height, { type: FloatType });
  renderer.setRenderTarget(target);
  if (environment) await surround(scene, garment, environment);
  const asked = performance.now();
  await settle(scene, camera_of(view), materials);
  const begin = performance.now(), pixels = new Float32Array(4 * width * height);
  for (let i = 0; i < frames; ++i) {
    renderer.render(scene, camera_of(view));
    rows_of(await read(renderer, target), target).forEach((x, k) => { pixels[k] += x / frames; });
  }
  const ms = (performance.now() - begin) / frames;
  materials.forEach((material, i) => { material.parts = parts[i]; });
  target.dispose();
  return { pixels: base64(pixels), ms, rest: (begin - asked) / 1000, shows: materials.map(({ shows }) => shows) };
}

/**
 * Pictures as `drawn` has them of a garment's first material: the first one in its fabric and the one at rest; then of its other side,
 * which has no images, and at rest.
 */
export async function coming(file, view, lights) {
  const { scene: garment, materials: [material] } = await load(file), scene = new Scene(), pictures = [];
  const target = new RenderTarget(view.width, view.height, { type: FloatType });
  scene.add(garment, ...lights.map(light_of));
  garment.traverse((object) => { object.visible = !object.isMesh || object.material === material; });
  renderer.setRenderTarget(target);
  const draw = async (view) => {
    renderer.render(scene, camera_of(view));
    pictures.push(base64(rows_of(await read(renderer, target), target)));
  };
  let first = null;
  const draw_first = () => {
    if (material.shows === 'fabric') first ??= draw(view);
  };
  cell_images.addEventListener('change', draw_first);
  await settle(scene, camera_of(view), [material]);
  cell_images.removeEventListener('change', draw_first);
  await first;
  await draw(view);
  const behind = { ...view, azimuth: view.azimuth + 180 };
  await draw(behind);
  await settle(scene, camera_of(behind), [material]);
  await draw(behind);
  target.dispose();
  return pictures;
}

/**
 * Draws a garment once: { refused }, the message of three.js's loader, or { states }, per material with a fabric [what it
 * shows, code of the fabric's issue, where it was read]. way: 'worker', 'missing worker' (its file is missing), 'no worker', 'no WebAssembly' or 'dying worker'.
 */
export async function fate(file, way = 'worker') {
  if (way === 'no worker') delete globalThis.Worker;
  if (way === 'missing worker') use_worker(() => new Worker('/nowhere.js'));
  if (way === 'no WebAssembly') use_worker(() => new Worker('/nowhere.js'), new ArrayBuffer(8));
  if (way === 'dying worker') {
    const text = 'postMessage({kind: "ready"}); onmessage = ({data}) => { if (data.kind === "fabric") throw new Error("dead"); };';
    use_worker(() => new Worker(URL.createObjectURL(new Blob([text]))));
  }
  const begin = performance.now();
  let garment;
  try {
    garment = await load(file);
  } catch (error) {
    return { refused: String(error), ms: performance.now() - begin };
  }
  const scene = new Scene();
  scene.add(garment.scene, new DirectionalLight());
  renderer.setRenderTarget(null);
  renderer.setSize(16, 16);
  const view = { look_at: [0, 0, 0], distance: 3, fov: 30, azimuth: 0, elevation: 0, width: 16, height: 16 };
  await settle(scene, camera_of(view), garment.materials);
  const states = garment.materials.map(({ shows, fabric }) => [shows, fabric?.issue?.code ?? '', fabric?.read_in]);
  return { states, ms: performance.now() - begin };
}

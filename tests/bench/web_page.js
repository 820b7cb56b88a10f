// In the browser: frames of a garment for web.mjs, drawn in a way of tests/web.
import {
  Bone, CustomBlending, Float32BufferAttribute, FloatType, NormalBlending, OneFactor, PerspectiveCamera, Scene, Skeleton, SkinnedMesh, Uint16BufferAttribute, Vector3,
} from 'three';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { RenderTarget, SelvedgeFabric, Surroundings, cell_images, read, renderer_of } from 'way';

const MIDDLE = new Vector3(0, 0.05, 0);
const renderer = await renderer_of(), scene = new Scene(), materials = new Set(), camera = new PerspectiveCamera(30, 1, 0.001, 20);
const elbow = new Bone();
let mm = 5, azimuth = 0, distance = 1, target, shows_fabric = true, changes = 0, seen = 0, wake = null;
cell_images.addEventListener('change', () => {
  ++changes;
  wake?.();
});

export function resize(width, height) {
  target?.dispose();
  target = new RenderTarget(width, height, { type: FloatType });
  renderer.setRenderTarget(target);
  camera.aspect = width / height;
  camera.updateProjectionMatrix();
}
/** Draws a frame, and waits until it is drawn. */
async function frame() {
  const a = azimuth * Math.PI / 180;
  camera.position.set(Math.sin(a), 0, Math.cos(a)).multiplyScalar(distance).add(MIDDLE);
  camera.lookAt(MIDDLE);
  seen = changes;
  renderer.render(scene, camera);
  if (renderer.isWebGLRenderer) return renderer.readRenderTargetPixels(target, 0, 0, 1, 1, new Float32Array(4));
  return renderer.readRenderTargetPixelsAsync(target, 0, 0, 1, 1);
}

/** A room with two bright windows. */
function room() {
  const width = 64, height = 32, radiance = new Float32Array(3 * width * height);
  for (let i = 0; i < width * height; ++i) {
    const x = i % width / width, y = Math.floor(i / width) / height;
    const window = Math.abs(y - 0.3) < 0.12 && (Math.abs(x - 0.35) < 0.05 || Math.abs(x - 0.7) < 0.03);
    radiance.fill(window ? 12 : 0.25, 3 * i, 3 * i + 3);
  }
  return { width, height, radiance };
}

/** Loads a garment, and draws it until it is in its fabrics. */
export async function open(file, width, height) {
  resize(width, height);
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  loader.register((parser) => new SelvedgeFabric(parser));
  const { scene: garment } = await loader.loadAsync(file), surroundings = new Surroundings(scene, room());
  garment.traverse(({ material }) => material?.isFabricMaterial && materials.add(material));
  scene.add(garment);
  surroundings.stand(garment);
  scene.traverse(({ shadow }) => shadow && Object.assign(shadow, { autoUpdate: false, needsUpdate: true }));
  for (await frame(); !shown(); await frame()) await change();
}
const shown = () => [...materials].every(({ shows }) => shows === (shows_fabric ? 'fabric' : 'fallback'));
const is_at_rest = () => shown() && (!shows_fabric || cell_images.at_rest());
/** Waits for a change that the last frame and the last wait have not seen. */
async function change() {
  while (changes === seen) await new Promise((end) => { wake = end; });
  seen = changes;
}
/** Draws what is seen now at rest. */
export async function rest() {
  for (await frame(); !is_at_rest(); await frame()) while (!is_at_rest()) await change();
}

/** Makes the meshes skins of two bones, of which draw() turns the one at the right; the number of vertices. */
export function skin() {
  // Loops of three.js's nodes wait for a picture in frames of the browser, which are no work of the drawn one.
  globalThis.requestAnimationFrame = (call) => setTimeout(() => call(performance.now()), 100);
  const meshes = [], trunk = new Bone();
  scene.traverse((mesh) => mesh.isMesh && meshes.push(mesh));
  scene.add(trunk.add(elbow));
  scene.updateMatrixWorld(true);
  const skeleton = new Skeleton([trunk, elbow]);
  for (const mesh of meshes) {
    const { position } = mesh.geometry.attributes, weights = [], bones = [];
    for (let i = 0; i < position.count; ++i) {
      const weight = Math.min(Math.max(0.5 + position.getX(i) / 0.2, 0), 1);
      weights.push(1 - weight, weight, 0, 0);
      bones.push(0, 1, 0, 0);
    }
    const geometry = mesh.geometry.clone();
    geometry.setAttribute('skinIndex', new Uint16BufferAttribute(bones, 4));
    geometry.setAttribute('skinWeight', new Float32BufferAttribute(weights, 4));
    const skinned = new SkinnedMesh(geometry, mesh.material);
    Object.assign(skinned, { castShadow: true, receiveShadow: true });
    mesh.parent.add(skinned);
    mesh.removeFromParent();
    mesh.geometry.dispose();
    skinned.bind(skeleton);
  }
  return meshes.reduce((sum, { geometry: { attributes: { position } } }) => sum + position.count, 0);
}

/** Waits until a view of so many pixels a repeat is at rest, in the fabric or in the fallback. */
export async function prepare(pixels, is_fabric) {
  for (const material of materials) {
    await material.fabric.settled;
    [mm] = material.fabric.mm_per_repeat;
    material.shows_fabric = is_fabric;
  }
  // Half a chest before the middle.
  azimuth = 0;
  distance = 0.12 + target.height * mm / 1000 / (2 * Math.tan(Math.PI / 12) * pixels);
  shows_fabric = is_fabric;
  await rest();
}

/** dB of the last frame that moved to the same view at rest, as displayed. */
export async function moving_decibels() {
  const picture = async () => {
    await frame();
    return (await read(renderer, target)).map((x) => Math.min(Math.max(x, 0), 1) ** (1 / 2.2));
  };
  const moving = await picture();
  await rest();
  const errors = (await picture()).reduce((sum, x, i) => sum + (i % 4 < 3 ? (x - moving[i]) ** 2 : 0), 0);
  return -10 * Math.log10(errors / (3 * target.width * target.height));
}

/** Fragments of a pixel of cloth that its material shades, in a WebGLRenderer: each adds one to the picture. */
export async function overdraw() {
  for (const material of materials) {
    const of = Object.getPrototypeOf(material), onBeforeCompile = (shader, ...rest) => {
      of.onBeforeCompile.call(material, shader, ...rest);
      shader.fragmentShader = shader.fragmentShader.replace(/}\s*$/, 'gl_FragColor = vec4(1.0); }');
    };
    Object.assign(material, { onBeforeCompile, customProgramCacheKey: () => `${of.customProgramCacheKey.call(material)} counted`, blending: CustomBlending, blendSrc: OneFactor, blendDst: OneFactor, needsUpdate: true });
  }
  await frame();
  const counts = (await read(renderer, target)).filter((x, i) => i % 4 === 0 && x > 0);
  for (const material of materials) {
    delete material.onBeforeCompile;
    delete material.customProgramCacheKey;
    Object.assign(material, { blending: NormalBlending, needsUpdate: true });
  }
  return counts.reduce((sum, x) => sum + x, 0) / counts.length;
}

/** Draws frames of an orbit by so many degrees each. */
export async function draw(count, degrees) {
  for (let i = 0; i < count; ++i) {
    azimuth += degrees;
    elbow.rotation.z = azimuth * Math.PI / 180;
    await frame();
    await new Promise((end) => setTimeout(end));
  }
}

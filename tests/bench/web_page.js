// In the browser: frames of a garment for web.mjs.
import {
  Bone, Float32BufferAttribute, PerspectiveCamera, Scene, Skeleton, SkinnedMesh, Uint16BufferAttribute, Vector3, WebGLRenderer,
} from 'three';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { SelvedgeFabric, Surroundings, cell_images } from 'selvedge/three/index.js';

const WIDTH = 960, HEIGHT = 540, MIDDLE = new Vector3(0, 0.05, 0);
const renderer = new WebGLRenderer(), scene = new Scene(), materials = new Set(), gl = renderer.getContext();
const camera = new PerspectiveCamera(30, WIDTH / HEIGHT, 0.001, 20);
const elbow = new Bone();
let mm = 5, azimuth = 0, distance = 1;

function frame() {
  const a = azimuth * Math.PI / 180;
  camera.position.set(Math.sin(a), 0, Math.cos(a)).multiplyScalar(distance).add(MIDDLE);
  camera.lookAt(MIDDLE);
  renderer.render(scene, camera);
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
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

export async function open(file) {
  renderer.setSize(WIDTH, HEIGHT);
  renderer.shadowMap.enabled = true;
  const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder);
  loader.register((parser) => new SelvedgeFabric(parser));
  const { scene: garment } = await loader.loadAsync(file);
  garment.traverse(({ material }) => material?.isFabricMaterial && materials.add(material));
  for (const { fabric } of materials) {
    await fabric.settled;
    [mm] = fabric.mm_per_repeat;
  }
  scene.add(garment);
  const surroundings = new Surroundings(scene, room());
  surroundings.stand(garment);
  renderer.shadowMap.autoUpdate = false;
  renderer.shadowMap.needsUpdate = true;
}

/** Makes the meshes skins of two bones, of which draw() turns the one at the right. */
export function skin() {
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
}

/** Waits until the view is at rest. */
async function rest(shows_fabric) {
  frame();
  const shown = () => [...materials].every(({ shows }) => shows === (shows_fabric ? 'fabric' : 'fallback'));
  while (!shown() || (shows_fabric && !cell_images.at_rest())) await new Promise((end) => setTimeout(end, 50));
  for (let i = 0; i < 2; ++i) frame();
}
/** Waits until a view of so many pixels a repeat is at rest, in the fabric or in the fallback. */
export async function prepare(pixels, shows_fabric) {
  azimuth = 0;
  // Half a chest before the middle.
  distance = 0.12 + HEIGHT * mm / 1000 / (2 * Math.tan(Math.PI / 12) * pixels);
  for (const material of materials) material.shows_fabric = shows_fabric;
  await rest(shows_fabric);
}

/** dB of the last frame that moved to the same view at rest, as displayed. */
export async function moving_decibels() {
  const picture = () => {
    frame();
    const bytes = new Uint8Array(4 * WIDTH * HEIGHT);
    gl.readPixels(0, 0, WIDTH, HEIGHT, gl.RGBA, gl.UNSIGNED_BYTE, bytes);
    return bytes;
  };
  const moving = picture();
  await rest(true);
  const errors = picture().reduce((sum, byte, i) => sum + ((byte - moving[i]) / 255) ** 2, 0);
  return -10 * Math.log10(errors / (3 * WIDTH * HEIGHT));
}

/** Draws frames of an orbit by so many degrees each. */
export async function draw(count, degrees) {
  for (let i = 0; i < count; ++i) {
    azimuth += degrees;
    elbow.rotation.z = azimuth * Math.PI / 180;
    frame();
    await new Promise((end) => setTimeout(end));
  }
}

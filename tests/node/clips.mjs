// Clips beside three.js's AnimationMixer: the corners of all triangles at 20 times of each clip, to 10^-5 of the size.
//
//   node clips.mjs BIN WORK [GARMENT...]   the programs, a folder, and files beside the one that is made here
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';

const [bin, work, ...others] = process.argv.slice(2);
const TIMES = 20;
const BOUND = 1e-5;
globalThis.self = globalThis;
globalThis.ProgressEvent = class extends Event {};
mkdirSync(work, { recursive: true });

const list = (n, f) => Array.from({ length: n }, (_, i) => f(i));

/** A strip of cloth of two joints and ten morph targets that hangs on a moving node: every interpolation, sparse and
 * quantised keys. With `eight` each vertex follows eight joints by JOINTS_1. */
function garment(eight) {
  const bytes = [];
  const json = { asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0, 1] }], bufferViews: [], accessors: [] };
  let length = 0;
  let seed = 1;
  const random = () => ((seed = (seed * 48271) % 2147483647) / 2147483647) * 2 - 1;
  const add = (type, array, more = {}) => {
    const data = Buffer.from(array.buffer);
    const pad = (4 - (data.length % 4)) % 4;
    bytes.push(data, Buffer.alloc(pad));
    json.bufferViews.push({ buffer: 0, byteOffset: length, byteLength: data.length });
    length += data.length + pad;
    const componentType = { Int8Array: 5120, Uint8Array: 5121, Int16Array: 5122, Uint16Array: 5123, Float32Array: 5126 }[array.constructor.name];
    const count = array.length / { SCALAR: 1, VEC3: 3, VEC4: 4, MAT4: 16 }[type];
    return json.accessors.push({ bufferView: json.bufferViews.length - 1, componentType, count, type, ...more }) - 1;
  };
  const vertices = 12;
  const joints = eight ? 8 : 2;
  const weights = list(vertices, () => list(eight ? 8 : 2, () => random() + 1.5));
  const of = (row, set) => list(4, (k) => row[4 * set + k] ?? 0);
  const shares = weights.map((row) => row.map((w) => w / row.reduce((a, b) => a + b)));
  const attributes = {
    POSITION: add('VEC3', new Float32Array(list(3 * vertices, random)), { min: [-1, -1, -1], max: [1, 1, 1] }),
    NORMAL: add('VEC3', new Float32Array(list(3 * vertices, (i) => (i % 3 === 2 ? 1 : 0)))),
    JOINTS_0: add('VEC4', new Uint8Array(weights.flatMap(() => [0, 1, eight ? 2 : 0, eight ? 3 : 0]))),
    WEIGHTS_0: add('VEC4', new Float32Array(shares.flatMap((row) => of(row, 0)))),
  };
  if (eight) {
    attributes.JOINTS_1 = add('VEC4', new Uint16Array(weights.flatMap(() => [4, 5, 6, 7])));
    attributes.WEIGHTS_1 = add('VEC4', new Float32Array(shares.flatMap((row) => of(row, 1))));
  }
  const targets = list(10, () => ({ POSITION: add('VEC3', new Float32Array(list(3 * vertices, () => 0.2 * random())), { min: [-1, -1, -1], max: [1, 1, 1] }) }));
  json.meshes = [{ primitives: [{ attributes, targets, indices: add('SCALAR', new Uint16Array(list(vertices, (i) => i))) }] }];
  json.nodes = [{ mesh: 0, skin: 0 }, { children: [2] }, ...list(joints, (j) => ({ children: j + 1 < joints ? [j + 3] : undefined, translation: [0, 0.5, 0] }))];
  json.skins = [{ joints: list(joints, (j) => j + 2) }];
  const times = add('SCALAR', new Float32Array([0.1, 0.5, 0.6, 1.7]), { min: [0.1], max: [1.7] });
  const keys = (n) => new Float32Array(list(4 * n, random));
  const rotations = new Int16Array(list(4, () => new THREE.Quaternion(random(), random(), random(), random()).normalize().toArray()).flat().map((x) => Math.round(x * 32767)));
  const sparse = add('VEC3', keys(3));
  const at = add('SCALAR', new Uint16Array([1, 3]));
  const values = add('VEC3', new Float32Array(list(6, random)));
  json.accessors[sparse].sparse = { count: 2, indices: { bufferView: json.accessors[at].bufferView, componentType: 5123 }, values: { bufferView: json.accessors[values].bufferView } };
  const channels = [
    [1, 'translation', 'LINEAR', sparse],
    [1, 'scale', 'STEP', add('VEC3', new Float32Array(list(12, () => 1 + 0.3 * random())))],
    [2, 'rotation', 'LINEAR', add('VEC4', rotations, { normalized: true })],
    [3, 'rotation', 'CUBICSPLINE', add('VEC4', new Float32Array(list(48, random)))],
    [3, 'translation', 'CUBICSPLINE', add('VEC3', new Float32Array(list(36, random)))],
    [0, 'weights', eight ? 'LINEAR' : 'CUBICSPLINE', add('SCALAR', keys(eight ? 10 : 30))],
  ];
  json.animations = [{
    samplers: channels.map(([, , interpolation, output]) => ({ input: times, interpolation, output })),
    channels: channels.map(([node, path], sampler) => ({ sampler, target: { node, path } })),
  }];
  json.buffers = [{ byteLength: length, uri: `data:;base64,${Buffer.concat(bytes).toString('base64')}` }];
  const file = join(work, eight ? 'eight.gltf' : 'strip.gltf');
  writeFileSync(file, JSON.stringify(json));
  return file;
}

async function load(file) {
  const bytes = readFileSync(file);
  const loader = new GLTFLoader();
  const about = (url) => (url.startsWith('data:') ? url : `data:;base64,${readFileSync(join(file, '..', decodeURIComponent(url))).toString('base64')}`);
  loader.manager.setURLModifier(about);
  loader.register(() => ({ name: 'no pictures', loadTexture: async () => new THREE.Texture() }));
  return loader.parseAsync(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
}

/** The place of a vertex of eight joints: three.js reads the first four. */
function follow_eight(mesh, i, place) {
  const four = (name) => list(4, (k) => mesh.geometry.getAttribute(name).getComponent(i, k));
  THREE.Mesh.prototype.getVertexPosition.call(mesh, i, place);
  const joints = [...four('skinIndex'), ...four('joints_1')];
  const later = four('weights_1'); // three.js makes the sum of the first four 1
  const weights = [...four('skinWeight').map((w) => w * (1 - later.reduce((a, b) => a + b))), ...later];
  const sum = new THREE.Vector3();
  const moved = new THREE.Vector3();
  joints.forEach((joint, k) => {
    const bone = new THREE.Matrix4().multiplyMatrices(mesh.skeleton.bones[joint].matrixWorld, mesh.skeleton.boneInverses[joint]);
    sum.addScaledVector(moved.copy(place).applyMatrix4(bone), weights[k]);
  });
  return place.copy(sum);
}

function corners_of(scene) {
  const corners = [];
  const place = new THREE.Vector3();
  scene.updateMatrixWorld(true);
  scene.traverse((mesh) => {
    if (!mesh.isMesh) return;
    if (mesh.isSkinnedMesh) mesh.skeleton.update();
    const index = mesh.geometry.index;
    for (let k = 0; k < (index?.count ?? mesh.geometry.getAttribute('position').count); ++k) {
      const i = index?.getX(k) ?? k;
      if (mesh.geometry.getAttribute('joints_1')) follow_eight(mesh, i, place);
      else mesh.getVertexPosition(i, place).applyMatrix4(mesh.matrixWorld);
      corners.push(place.x, place.y, place.z);
    }
  });
  return corners;
}

let worst = 0;
for (const file of [garment(false), garment(true), ...others]) {
  const gltf = await load(file);
  for (const [number, clip] of gltf.animations.entries()) {
    const mixer = new THREE.AnimationMixer(gltf.scene);
    mixer.clipAction(clip).play();
    const times = Array.from({ length: TIMES }, (_, i) => (clip.duration * (i + 0.37)) / TIMES);
    const ours = execFileSync(join(bin, 'pose-garment'), [file, String(number), ...times.map(String)], { maxBuffer: 1 << 30 });
    const numbers = new Float64Array(ours.buffer.slice(ours.byteOffset, ours.byteOffset + ours.length));
    let at = 0;
    let error = 0;
    for (const time of times) {
      mixer.setTime(time);
      const theirs = corners_of(gltf.scene);
      if (numbers[at] !== theirs.length) throw new Error(`${file}: ${numbers[at]} numbers, three.js has ${theirs.length}`);
      const size = Math.hypot(...[0, 1, 2].map((c) => {
        const along = theirs.filter((_, i) => i % 3 === c);
        return along.reduce((a, b) => Math.max(a, b)) - along.reduce((a, b) => Math.min(a, b));
      }));
      theirs.forEach((x, i) => { error = Math.max(error, Math.abs(x - numbers[at + 1 + i]) / size); });
      at += theirs.length + 1;
    }
    mixer.stopAllAction();
    console.log(`${file.split('/').at(-1)} "${clip.name}": ${error.toExponential(2)}`);
    worst = Math.max(worst, error);
  }
}
if (!(worst <= BOUND)) throw new Error(`${worst} of the size is more than ${BOUND}`);

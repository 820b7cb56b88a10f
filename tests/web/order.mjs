// Images of what lies in the middle of the picture come first: of one mesh, patch by patch, and of several. Triangles are drawn from
// far to near where they have holes, from near to far where they have none.
//
//   node order.mjs PACKAGE_FOLDER KIT_FOLDER
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { Bone, BoxGeometry, Float32BufferAttribute, Mesh, PerspectiveCamera, Skeleton, SkinnedMesh, Uint16BufferAttribute } from '../node/node_modules/three/build/three.module.js';
import { with_three } from './with_three.mjs';

const [package_folder, kit] = process.argv.slice(2).map((path) => resolve(path));
const { CellModule } = await import(join(package_folder, 'cells.js')), { CellWorker } = await import(join(package_folder, 'cell_worker.js'));
const { open_fabric } = await import(join(package_folder, 'reader/index.js'));
const wasm = readFileSync(join(package_folder, 'cells.wasm')), fabric_file = new Uint8Array(readFileSync(join(kit, 'valid/yarns-flat.exr')));

/** A sheet of so many repeats that lies at z = 0 around (x, 0), m. */
const QUADS = 16, REPEATS = 48;
function sheet(x, side) {
  const at = (i) => i / QUADS, vertices = [], corners = [];
  for (let j = 0; j <= QUADS; ++j)
    for (let i = 0; i <= QUADS; ++i) vertices.push(x + side * (at(i) - 0.5), side * (0.5 - at(j)), 0, 0, 0, 1, REPEATS * at(i), REPEATS * at(j));
  for (let j = 0; j < QUADS; ++j) {
    for (let i = 0; i < QUADS; ++i) {
      const first = j * (QUADS + 1) + i, [right, below, last] = [first + 1, first + QUADS + 1, first + QUADS + 2];
      corners.push(first, below, right, right, below, last);
    }
  }
  return { vertices: Float32Array.from(vertices), corners: Uint32Array.from(corners) };
}
/** From 1 m before (0.03, -0.02): a window of 0.6 m. */
const MIDDLE = [0.03, -0.02], HALF = 0.3, CAMERA = [0, ...MIDDLE, 1, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, HALF, HALF, 0.1, 10, 900, 900];
const LIGHTS = [[0, 0.3, 0.5, 0.8, 2, 2, 2, 0, 0, 0]];

const module = new CellModule(new WebAssembly.Module(wasm)), SIDE = 0.4;
module.set_memory(2 ** 26);
const { number, charts } = module.add_garment(module.add_fabric(await open_fabric(fabric_file)), ...Object.values(sheet(0, SIDE)));
const begin = (remade) => module.begin_frame(number, [...CAMERA, 2, remade, -1, 0, ...Array(36).fill(0)], LIGHTS);
for (let left = begin(0); left > 0;) left = module.make_images(number, 4);
const [, u, v, per_repeat, columns] = charts.subarray(6 * (QUADS + 2));
const mean = (values) => values.reduce((sum, x) => sum + x, 0) / values.length, repeat = SIDE / REPEATS;
let table = module.table(number).entries, smallest = Infinity, changes = [];
for (let left = begin(1); left > 0;) {
  left = module.make_images(number, 1);
  const now = module.table(number).entries, changed = [...now.keys()].filter((i) => now[i] !== table[i]);
  table = now;
  if (changed.length === 0) continue;
  const [column, row] = [(i) => i % columns, (i) => Math.floor(i / columns)].map((of) => mean(changed.map(of)) + 0.5);
  const off = Math.hypot(repeat * (column / per_repeat + u) - SIDE / 2 - MIDDLE[0], SIDE / 2 - repeat * (row / per_repeat + v) - MIDDLE[1]);
  smallest = Math.min(smallest, changed.length);
  changes.push({ off, size: changed.length });
}
// Now and then several larger ones change with one, as what lies within them shows.
changes = changes.filter(({ size }) => size === smallest);
assert.ok(changes.length > 500, `${changes.length} changes`);
changes.reduce((last, { off }, i) => {
  assert.ok(off > last - 1e-4, `change ${i} of ${changes.length}: ${off} m from the middle after ${last}`);
  return Math.max(last, off);
}, 0);

// A sheet in the middle rests before another one, which came first, has a finer image.
const messages = [], answers = new Map();
let wake = null;
const worker = new CellWorker((message) => {
  messages.push(message);
  if (message.id) answers.set(message.id, message);
  wake?.();
});
const until = async (holds) => { while (!holds()) await new Promise((go_on) => { wake = go_on; }); };
worker.receive({ kind: 'start', wasm, memory: 2 ** 26 });
worker.receive({ kind: 'fabric', id: 'fabric', source: fabric_file.buffer });
await until(() => answers.has('fabric'));
const sheets = { beside: sheet(0.22, 0.1), middle: sheet(0.03, 0.2) }, numbers = {};
for (const [id, mesh] of Object.entries(sheets)) {
  worker.receive({ kind: 'garment', id, fabric: answers.get('fabric').result.number, ...mesh, moves: null });
  await until(() => answers.has(id));
  numbers[id] = answers.get(id).number;
}
for (const garment of Object.values(numbers)) worker.receive({ kind: 'view', garment, camera: CAMERA, level: -1, around: null, lights: LIGHTS, serial: 1 });
const of = (garment) => messages.filter((message) => message.kind === 'images' && message.garment === garment);
const rests = (garment) => of(garment).some(({ at_rest }) => at_rest);
await until(() => Object.values(numbers).every(rests));
const fine = of(numbers.beside).findIndex(({ missing, at_rest }) => missing === 0 && !at_rest), first = of(numbers.beside)[fine];
const changed = of(numbers.beside).find(({ entries }) => entries.some((entry, i) => entry !== first.entries[i]));
assert.ok(messages.indexOf(of(numbers.middle).find(({ at_rest }) => at_rest)) < messages.indexOf(changed), 'the middle comes later');
console.log(`${changes.length} patches of a sheet, ${messages.length} messages of two`);

const { draw_once, sort_triangles } = await with_three(join(package_folder, 'three/order.js'));
const shape = new BoxGeometry(1, 1, 1, 16, 16, 16);
shape.clearGroups();
const skin = new SkinnedMesh(shape.clone()), viewer = new PerspectiveCamera(), corners = shape.index.array;
const { position } = shape.attributes, bone = new Bone();
skin.geometry.setAttribute('skinIndex', new Uint16BufferAttribute(Array(4 * position.count).fill(0), 4));
skin.geometry.setAttribute('skinWeight', new Float32BufferAttribute(Array.from({ length: position.count }, () => [1, 0, 0, 0]).flat(), 4));
skin.add(bone);
skin.bind(new Skeleton([bone]));
/** The triangles that are drawn; null: as they are. */
function drawn(mesh, transparent) {
  mesh.updateMatrixWorld();
  mesh.skeleton?.update();
  viewer.position.set(0, 0, 3);
  viewer.updateMatrixWorld();
  if (!sort_triangles(mesh, mesh.geometry, viewer, { transparent })) return null;
  const { index } = mesh.geometry;
  draw_once(mesh, mesh.geometry, Infinity);
  const sorted = mesh.geometry.index;
  mesh.onAfterRender();
  assert.equal(mesh.geometry.index, index);
  return sorted;
}
/** By how much triangles lie out of order, of a cube of 1: the triangles of a cluster stay together. */
function disorder(mesh, { array }, transparent) {
  const depths = Array.from({ length: array.length / 3 }, (_, t) => [0, 1, 2].reduce((sum, k) => sum + mesh.getVertexPosition(array[3 * t + k], viewer.position.clone()).applyMatrix4(mesh.matrixWorld).z / 3, 0) * (transparent ? 1 : -1));
  let far = -Infinity;
  return depths.reduce((worst, depth) => Math.max(worst, (far = Math.max(far, depth)) - depth), 0);
}
for (const transparent of [true, false]) {
  for (const mesh of [new Mesh(shape.clone()), skin]) {
    const { geometry } = mesh, first = drawn(mesh, transparent), { version } = first, turned = (angle) => (mesh.isSkinnedMesh ? bone : mesh).rotation.set(0, angle, 0);
    assert.ok(disorder(mesh, first, transparent) < 0.5);
    assert.deepEqual(first.array.slice().sort(), corners.slice().sort());
    turned(0.3);
    assert.equal(drawn(mesh, transparent), first);
    assert.equal(first.version, version + (transparent ? 1 : 0));
    turned(Math.PI);
    assert.ok(disorder(mesh, drawn(mesh, transparent), transparent) < 0.5);
    assert.equal(first.version, version + (transparent ? 2 : 1));
    // Other triangles, in another list and in the same one.
    geometry.setIndex([...corners.slice(0, 60)]);
    assert.equal(drawn(mesh, transparent).count, 60);
    geometry.index.array.set(corners.slice(60, 120));
    geometry.index.needsUpdate = true;
    assert.deepEqual(drawn(mesh, transparent).array.slice().sort(), Uint16Array.from(corners.slice(60, 120)).sort());
    geometry.setDrawRange(3, Infinity);
    assert.equal(drawn(mesh, transparent), null);
    Object.assign(geometry.setIndex([...corners]), { drawRange: { start: 0, count: Infinity } });
    turned(0);
  }
}

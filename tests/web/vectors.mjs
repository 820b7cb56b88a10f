// The conformance kit's queries of one light, answered by the WebAssembly module: each within the kit's own tolerance. Then
// the noise that shaders read, beside the reference's.
//
//   node vectors.mjs PACKAGE_FOLDER KIT_FOLDER
import assert from 'node:assert/strict';
import { readFileSync, readdirSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { hash, noise } from '../../spec/conformance/reference/swells.mjs';
import { with_three } from './with_three.mjs';

const [package_folder, kit] = process.argv.slice(2).map((path) => resolve(path));
const { CellModule } = await import(join(package_folder, 'cells.js'));
const { open_fabric } = await import(join(package_folder, 'reader/index.js'));
const cells = new CellModule(new WebAssembly.Module(readFileSync(join(package_folder, 'cells.wasm'))));

/** How far a number is from the expected one, in units of its tolerance. */
const distance = (given, expected, allowed) => given === expected ? 0 : Math.abs(given - expected) / allowed;

let count = 0, worst = 0;
for (const name of readdirSync(join(kit, 'vectors')).sort()) {
  const { file, queries } = JSON.parse(readFileSync(join(kit, 'vectors', name), 'utf8'));
  const fabric = cells.add_fabric(await open_fabric(new Uint8Array(readFileSync(join(kit, file)))));
  for (const query of queries.filter(({ error, op }) => !error && !op)) {
    const { rgb, alpha, tolerance } = query, given = cells.query(fabric, query);
    const errors = rgb.map((x, c) => distance(given[c], x, tolerance.relative * Math.abs(x) + tolerance.absolute));
    const error = Math.max(distance(given[3], alpha, tolerance.alpha), ...errors);
    assert.ok(error <= 1, `${name}: ${error} of the tolerance; ${JSON.stringify(query)}`);
    worst = Math.max(worst, error);
    ++count;
  }
}
assert.ok(count > 3000, `${count} queries`);
console.log(`${count} queries, worst error ${worst.toFixed(3)} of its tolerance`);

const { noise_of } = await with_three(join(package_folder, 'three/noise.js'));
const between = (p, a, b) => {
  const q = p * p * (3 - 2 * p);
  return ((1 - q) * a + q * b) / Math.hypot(1 - q, q);
};
/** Noise of a lattice at a row and a length. */
function lattice_noise(key, at) {
  const [row, length] = at.map(Math.floor), of_row = (i) => hash(key + i | 0);
  return between(at[0] - row, ...[row, row + 1].map((i) => noise(at[1] - length, hash(of_row(i) + length | 0), hash(of_row(i) + length + 1 | 0), 0)));
}
/** What shader.js reads there, of single rows and of areas. */
function read({ texture: { image: { data, width, height, depth } }, places, layers }, k, uv) {
  const { x, y, z, w } = places[k], at = [uv[1] * x + z, uv[0] * y + w], whole = at.map(Math.floor), part = at.map((a, i) => a - whole[i]);
  const next = part.map((p) => p * p * (3 - 2 * p)), gain = next.reduce((product, q) => product / Math.hypot(1 - q, q), 1), [first, last] = layers[k];
  const layer = Math.min(Math.max(Math.floor((whole[0] + 0.5) / (height - 1)) + first, first), last);
  const i = whole[0] + next[0] - (layer - first) * (height - 1), j = whole[1] + next[1], within = (a, size) => Math.min(Math.max(a, 0), size - 1);
  assert.ok(layer < depth);
  return [0, 1].map((c) => {
    const texel = (row, column) => data[2 * ((layer * height + within(row, height)) * width + within(column, width)) + c] / 255 - 0.5, [a, b] = [i, j].map(Math.floor);
    const along = [a, a + 1].map((row) => (1 - j + b) * texel(row, b) + (j - b) * texel(row, b + 1));
    return ((1 - i + a) * along[0] + (i - a) * along[1]) * (c === 0 ? gain * 3.4505963 : 6.9011926);
  });
}
// Where coordinates begin and end, and the layers that a lattice takes; beyond the last one noise stays as it is there.
for (const [begin, end, layers] of [[[0, 0], [3, 3], 1], [[-7, -60], [20, 90], 6], [[0, -9], [1, 1e5], 64]]) {
  const rows = 40, lengths = 1.5, run = [rows, 0, 0], numbers = [0.3, 0.1, lengths], none = Array(3).fill(0), keys = [5, 2 ** 32 - 3, 0, 0, 7, 0];
  const made = noise_of({ keys, runs: [...run, ...none, ...run, ...none], numbers: [...numbers, ...none, 0, ...numbers.slice(1), ...Array(7).fill(0)] }, [begin, end]);
  assert.equal(made.texture.image.depth, 2 * layers);
  const last_row = Math.floor(begin[1] * rows + 0.3) - 1 + 1023 * layers;
  let squares = 0;
  for (let i = 0; i < 1000; ++i) {
    const uv = begin.map((from, c) => from + (end[c] - from) * (i * [0.618, 0.4142][c] % 1)), [row, length] = [uv[1] * rows + 0.3, uv[0] * lengths];
    const at = [Math.min(row, last_row), length], [single, areas] = read(made, 0, uv);
    if (row > last_row && row < last_row + 1) continue;
    assert.ok(Math.abs(single - lattice_noise(keys[0], at)) < 1e-6 || row > last_row, `${uv}: ${single}, not ${lattice_noise(keys[0], at)}`);
    squares += (areas - lattice_noise(keys[1], [at[0] / 8, length / 4])) ** 2;
    assert.ok(Math.abs(read(made, 2, uv)[0] - lattice_noise(keys[4], [at[0] - 0.3, length])) < 1e-6 || row > last_row);
  }
  console.log(`noise of ${layers} layers: areas are ${Math.sqrt(squares / 1000).toFixed(3)} off`);
  assert.ok(squares < 1000 * 0.1 ** 2);
}

// The noise of a fabric's variation (spec/brdf.md): bytes of its lattices as layers of a texture, of single rows in red and of areas in
// green, as far as garments reach. Between them the texture's filter mixes.
import {DataArrayTexture, LinearFilter, RGFormat, Vector2, Vector4} from 'three';

/** Bounds of WebGL 2 on a layer, whose last row is the next one's first, and on layers of a lattice; beyond, noise stays as it is there. */
const MAX_ROWS = 1024, MAX_LENGTHS = 2048, MAX_LAYERS = 64;
/** Texels of all lattices, of which coordinates far away would want more. */
const MAX_TEXELS = 2 ** 24;
/** The run of each lattice (variation() of cells.js), the coordinate along it, the key of its rows, and the key of areas. */
const LATTICES = [[0, 0, 0, 1], [1, 1, 2, 3], [2, 0, 4], [3, 1, 5]];
/** Weights of areas at the rows and at the lengths of one, which there are 8 and 4 of: of its own noise and of the next one's. */
const WEIGHTS = [8, 4].map((size) => Array.from({length: size}, (_, i) => {
  const part = i / size, next = part * part * (3 - 2 * part), length = Math.hypot(1 - next, next);
  return [(1 - next) / length, next / length];
}));

function hash(x) {
  x = Math.imul(x ^ x >>> 16, 0x7feb352d);
  x = Math.imul(x ^ x >>> 15, 0x846ca68b);
  return x ^ x >>> 16;
}
/** The noise of areas at a row and a length, as a byte of half its size. */
function area_at(key, row, length) {
  const across = WEIGHTS[0][row & 7], along = WEIGHTS[1][length & 3];
  let sum = 0;
  for (let i = 0; i < 2; ++i)
    for (let j = 0; j < 2; ++j) sum += across[i] * along[j] * ((hash(hash(key + (row >> 3) + i) + (length >> 2) + j) & 255) - 127.5);
  return Math.round(127.5 + sum / 2);
}

function texture_of(data, width, height) {
  const texture = new DataArrayTexture(data, width, height, data.length / 2 / width / height);
  return Object.assign(texture, {format: RGFormat, minFilter: LinearFilter, magFilter: LinearFilter, needsUpdate: true});
}
const none = texture_of(new Uint8Array(2), 1, 1);
/** Frees the texture, unless all fabrics without variation share it. */
export const free_noise = (noise) => noise && noise.texture !== none && noise.texture.dispose();

/**
 * Of a variation (variation() of cells.js) between two places: the texture, each lattice's { rows and lengths of a repeat, where they
 * begin }, and its first and last layers.
 */
export function noise_of({keys, runs, numbers}, [least, most]) {
  const lattices = LATTICES.map(([run, along, key, areas]) => {
    const axes = [[1 - along, runs[3 * run], numbers[3 * run]], [along, numbers[3 * run + 2], 0]];
    // Rows leave their places by a tenth of a row.
    const first = axes.map(([axis, scale, offset]) => Math.floor(least[axis] * scale + offset) - 1);
    const count = axes.map(([axis, scale, offset], i) => Math.floor(most[axis] * scale + offset) + 2 - first[i]);
    return {key: keys[key], areas: keys[areas], varies: numbers[3 * run + 1] > 0, first, count, place: axes.map(([, scale]) => scale).concat(axes.map(([, , offset], i) => offset - first[i]))};
  });
  const there = lattices.filter(({varies}) => varies), max = (i, bound) => Math.min(Math.max(1, ...there.map(({count}) => count[i])), bound);
  const height = max(0, MAX_ROWS - 1), width = max(1, MAX_LENGTHS - 1) + 1, size = width * (height + 1);
  let layers = 0;
  for (const lattice of there) {
    const first = layers;
    layers += Math.max(1, Math.min(Math.ceil(lattice.count[0] / height), MAX_LAYERS, Math.floor(MAX_TEXELS / size / there.length)));
    lattice.layers = [first, layers - 1];
  }
  const data = new Uint8Array(2 * size * layers);
  for (const {key, areas, first: [row, length], count, layers: [begin, end]} of there) {
    for (let i = 0, at = 2 * begin * size; at < 2 * (end + 1) * size; ++i, at += 2 * width) {
      // A layer begins with the last row of the one before.
      const number = row + i - Math.floor(i / (height + 1)), bits = hash(key + number);
      for (let j = 0; j <= Math.min(count[1], width - 1); ++j) {
        data[at + 2 * j] = hash(bits + length + j);
        if (areas !== undefined) data[at + 2 * j + 1] = area_at(areas, number, length + j);
      }
    }
  }
  const texture = there.length > 0 ? texture_of(data, width, height + 1) : none;
  return {texture, places: lattices.map(({place}) => new Vector4(...place)), layers: lattices.map(({layers = [0, 0]}) => new Vector2(...layers))};
}

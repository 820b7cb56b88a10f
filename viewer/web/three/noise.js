// The noise of a fabric's variation (spec/brdf.md): bytes of its lattices as layers of a texture, as far as garments reach. Between
// them the texture's filter mixes.
import {DataArrayTexture, LinearFilter, RedFormat, Vector4} from 'three';

/** Bounds of WebGL 2 on a layer, whose last row is the next one's first, and on layers of a lattice; beyond, noise stays as it is there. */
const MAX_ROWS = 1024, MAX_LENGTHS = 2048, MAX_LAYERS = 42;
/** Bytes of all lattices, of which coordinates far away would want more. */
const MAX_BYTES = 2 ** 25;
/** The run of each lattice (variation_of() of cells.js), the coordinate along it, and the rows and lengths of an area. */
const LATTICES = [[0, 0, 1, 1], [0, 0, 8, 4], [1, 1, 1, 1], [1, 1, 8, 4], [2, 0, 1, 1], [3, 1, 1, 1]];

function hash(x) {
  x = Math.imul(x ^ x >>> 16, 0x7feb352d);
  x = Math.imul(x ^ x >>> 15, 0x846ca68b);
  return x ^ x >>> 16;
}

function texture_of(data, width, height) {
  const texture = new DataArrayTexture(data, width, height, data.length / width / height);
  return Object.assign(texture, {format: RedFormat, minFilter: LinearFilter, magFilter: LinearFilter, needsUpdate: true});
}
const none = texture_of(new Uint8Array(1), 1, 1);
/** Frees the texture, unless all fabrics without variation share it. */
export const free_noise = (noise) => noise && noise.texture !== none && noise.texture.dispose();

/**
 * Of a variation (variation() of cells.js) between two places: the texture, each lattice's { rows and lengths of a repeat, where they
 * begin }, and its first layer.
 */
export function noise_of({keys, runs, numbers}, [least, most]) {
  const lattices = LATTICES.map(([run, along, rows, lengths], k) => {
    const axes = [[1 - along, runs[3 * run] / rows, numbers[3 * run] / rows], [along, numbers[3 * run + 2] / lengths, 0]];
    // Rows leave their places by a tenth of a row.
    const first = axes.map(([axis, scale, offset]) => Math.floor(least[axis] * scale + offset) - 1);
    const count = axes.map(([axis, scale, offset], i) => Math.floor(most[axis] * scale + offset) + 2 - first[i]);
    return {key: keys[k], varies: numbers[3 * run + 1] > 0, first, count, place: axes.map(([, scale]) => scale).concat(axes.map(([, , offset], i) => offset - first[i]))};
  });
  const there = lattices.filter(({varies}) => varies), max = (i, bound) => Math.min(Math.max(1, ...there.map(({count}) => count[i])), bound);
  const height = max(0, MAX_ROWS - 1), width = max(1, MAX_LENGTHS - 1) + 1, size = width * (height + 1);
  let layers = 0;
  for (const lattice of there) {
    lattice.layer = layers;
    layers += Math.max(1, Math.min(Math.ceil(lattice.count[0] / height), MAX_LAYERS, Math.floor(MAX_BYTES / size / there.length)));
  }
  const data = new Uint8Array(size * layers);
  for (const [k, {key, first: [row, length], count, layer}] of there.entries()) {
    const end = there[k + 1]?.layer ?? layers;
    for (let i = 0; i < (end - layer) * (height + 1); ++i) {
      // A layer begins with the last row of the one before.
      const bits = hash(key + row + i - Math.floor(i / (height + 1)));
      for (let j = 0; j <= Math.min(count[1], width - 1); ++j) data[layer * size + i * width + j] = hash(bits + length + j);
    }
  }
  const texture = there.length > 0 ? texture_of(data, width, height + 1) : none;
  return {texture, places: lattices.map(({place}) => new Vector4(...place)), layers: lattices.map(({layer = 0}) => layer)};
}

// From a short description of a fixture to the bytes of its file.
import {pack_values, write_exr} from '../reference/exr_write.mjs';
import {add_side, fabric_parts, fabric_text, seal} from '../reference/fabric_write.mjs';
import {LAYERS, SPREAD, used_count} from '../reference/reader.mjs';
import {random, unit} from './random.mjs';

const PRECISION = {
  lobes: 'float',
  frame: 'half',
  table: 'half',
  opacity: 'half',
  light: 'half',
  products: 'half',
  bases: 'half',
  yarns: 'float',
  indirect: 'half',
  map: 'float'
};
/** An orthonormal frame around a normal, the tangent being the x axis made perpendicular. */
export function frame_of(normal) {
  const n = unit(normal);
  const along = n[0];
  return {n, t: unit([1 - along * n[0], -along * n[1], -along * n[2]])};
}

/** An ordinary value of a channel at a texel. */
function ordinary(name, level, channel, t) {
  const r = random(`${name} ${level} ${channel} ${t}`);
  const between = (a, b) => a + (b - a) * r();
  if (channel.startsWith('lobes.diffuse')) return between(0.02, 0.3);
  if (/^lobes\.\d+\.c[xy]/.test(channel)) return between(-1, -0.3) * (r() < 0.2 ? -1 : 1);
  if (/^lobes\.\d+\.cz/.test(channel)) return between(0.4, 1);
  if (/^lobes\.\d+\.n/.test(channel)) return between(0.5, 12);
  if (channel.startsWith('table')) return between(0.2, 2);
  if (channel.startsWith('opacity')) return r() < 0.3 ? 1 : r() < 0.2 ? 0 : r();
  if (channel.startsWith('light')) return between(0.05, 0.5);
  if (channel.startsWith('products')) return between(-0.3, 1);
  if (channel.startsWith('bases')) return between(-0.2, 0.8);
  if (channel.startsWith('indirect')) return between(-0.02, 0.04);
  const tilt = random(`${name} ${level} frame ${t}`);
  const {n, t: tangent} = frame_of([tilt() - 0.5, tilt() - 0.5, 0.3 + tilt()]);
  return {nx: n[0], ny: n[1], nz: n[2], tx: tangent[0], ty: tangent[1], tz: tangent[2]}[channel.slice(6)];
}

/** The values of `frame` channels from a function (level, texel) -> { n, t }; for `value` of a fixture. */
export const framed = (frame) => (level, channel, t) => {
  const {n, t: tangent} = frame(level, t);
  return {nx: n[0], ny: n[1], nz: n[2], tx: tangent[0], ty: tangent[1], tz: tangent[2]}[channel.slice(6)];
};

/**
 * The fabric of a fixture:
 *   name, about  what it is for
 *   texels, levels, grid [columns, rows], K     default 3 x 2, all, 2 x 2, 1
 *   light_grid [columns, rows], functions [views, lights]     default 1 x 3, [1, 2]
 *   pairs        (level) => [[a, b], ...]; default (0, 0) and (1, 1)
 *   yarns        the members of the layer `yarns`: { curves, nodes, stations, fields }
 *   map          members of the layer `map`: { size }
 *   sides        { back: fixture, ... }: the other sides, in this form
 *   layers       { name: { levels, precision } }, or names only; default: all levels, the usual precision
 *   value        { layer: (level, channel, texel) => number }; undefined: an ordinary value
 *   mmPerRepeat, referenceHeight, thickness, radianceScale, provenance
 */
export function fabric_of(fixture) {
  const {name, texels = [3, 2], grid = [2, 2], K = 1, value = {}} = fixture;
  const {light_grid = [1, 3], functions = [1, 2]} = fixture;
  const {
    pairs = () => [[0, 0], [1, 1]],
    referenceHeight = 0.5,
    thickness = 0.75,
    mmPerRepeat = [2.5, 1.25],
    radianceScale,
    provenance = {software: 'conformance kit'}
  } = fixture;
  const chain = Math.floor(Math.log2(Math.max(...texels))) + 1;
  const levels = fixture.levels ?? chain;
  const wanted = Array.isArray(fixture.layers) ?
    Object.fromEntries(fixture.layers.map((layer) => [layer, {}])) :
    fixture.layers ?? {};
  const layers = {};
  const fabric = {
    texels,
    levels,
    layers,
    provenance,
    mmPerRepeat,
    referenceHeight,
    thickness,
    ...(radianceScale === undefined ? {} : {radianceScale}),
    views: {columns: grid[0], rows: grid[1]},
    lights: {columns: light_grid[0], rows: light_grid[1]},
  };
  for (const layer of LAYERS.filter((l) => wanted[l])) {
    const listed = wanted[layer].levels ?? Array.from({length: SPREAD.includes(layer) ? 1 : levels}, (_, k) => k);
    const own = {
      lobes: {lobes: K},
      products: {pairs: listed.map(pairs)},
      bases: {functions: {views: functions[0], lights: functions[1]}},
      yarns: {...structuredClone(fixture.yarns), optional: true},
      indirect: {optional: true},
      map: fixture.map,
    };
    const number = (level, channel, t) => t < used_count(layer, fabric, level, channel) ?
      value[layer]?.(level, channel, t) ?? ordinary(name, level, channel, t) :
      0;
    layers[layer] = {
      levels: listed,
      precision: wanted[layer].precision ?? PRECISION[layer],
      ...own[layer],
      values: (level, channel, {width, height}) =>
        Float64Array.from({length: width * height}, (_, t) => number(level, channel, t)),
    };
  }
  return fabric;
}

/**
 * The bytes of a fixture's file. Besides what fabric_of takes:
 *   before   changes the list of parts; digests follow
 *   text     changes the attribute text, an object
 *   string   writes the text; default: JSON.stringify
 *   after    changes the parts after all digests
 *   order, gap  of the chunks, as in write_exr
 *   deflate  packs chunks of ZIP instead of the generator's own
 *   bytes    changes the bytes of the file
 */
export function file_of(fixture) {
  const fabric = fabric_of(fixture);
  const parts = fabric_parts(fabric);
  fixture.before?.(parts, fabric);
  const text = fabric_text(fabric, parts);
  for (const [side, own] of Object.entries(fixture.sides ?? {})) {
    const {sides: _, text: __, value: ___, ...shared} = fixture;
    const other = add_side(fabric_of({...shared, ...own, name: `${fixture.name} ${side}`}), side);
    parts.push(...other.parts);
    (text.sides ??= {})[side] = other.text;
  }
  fixture.text?.(text);
  seal(parts, fixture.string ? fixture.string(text) : JSON.stringify(text));
  fixture.after?.(parts);
  const bytes = write_exr({parts, order: fixture.order, gap: fixture.gap}, fixture.deflate);
  return fixture.bytes?.(bytes) ?? bytes;
}

export const part_of = (parts, name) => parts.find((part) => part.name === name);

/** Stores every second channel of the data parts in the other precision. */
export function mix_precisions(parts, fabric) {
  for (const part of parts.slice(1)) {
    const {levels, values: of} = fabric.layers[part.name];
    part.channels.forEach((channel, i) => {
      if (i % 2 === 0) return;
      channel.type = channel.type === 'half' ? 'float' : 'half';
      part.levels.forEach(({width, height, values}, k) => {
        const numbers = levels.includes(k) ? of(k, channel.name, {width, height}) : Array(width * height).fill(0);
        values.set(channel.name, pack_values(numbers, channel.type));
      });
    });
  }
}

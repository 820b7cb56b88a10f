// Packs a fabric into the words that the shaders read: the twin of format/fabric/gpu_words.cpp.
import {word_layout} from './glsl.js';
import {
  ANGLES, COLOURS, LAYERS, LIGHTS, PARAMETERS, base_count, direction_name, grid_size, hash, level_size, pairs_at,
  read_layer, yarns_of
} from './reader/index.js';
import {cells_of} from './yarn_cells.js';

/** The places of words by their names in word_layout.glsl, which C++ and GLSL include. */
export const AT = Object.fromEntries(
  [...word_layout.matchAll(/const uint (\w+) = (\d+)u;/g)].map(([, name, place]) => [name, Number(place)]));

/** Words that grow; numbers are single precision. */
class Words {
  constructor() {
    this.words = new Uint32Array(4096);
    this.floats = new Float32Array(this.words.buffer);
    this.length = 0;
  }
  /** Appends `count` words of value 0 and returns the place of the first. */
  room(count) {
    const place = this.length;
    this.length += count;
    if (this.length > this.words.length) {
      const grown = new Uint32Array(Math.max(this.length, 2 * this.words.length));
      grown.set(this.words);
      this.words = grown;
      this.floats = new Float32Array(grown.buffer);
    }
    return place;
  }
  set_numbers(at, ...values) {
    this.floats.set(values, at);
  }
  /** Appends numbers and returns their place. */
  numbers(values) {
    const place = this.room(values.length);
    this.floats.set(values, place);
    return place;
  }
}

/** The values of channels by texel: [texel][channel]. */
function interleaved(channels) {
  const count = channels.length, texels = channels[0]?.length ?? 0, values = new Float32Array(count * texels);
  channels.forEach((channel, c) => {
    for (let t = 0, at = c; t < texels; ++t, at += count) values[at] = channel[t];
  });
  return values;
}

const to_half = (() => {
  const number = new Float32Array(1), bits = new Uint32Array(number.buffer);
  /** The bits of the half that is x, or -1 if no half is. */
  return (x) => {
    number[0] = x;
    const sign = bits[0] >>> 16 & 0x8000, exponent = (bits[0] >>> 23 & 255) - 112, fraction = bits[0] & 0x7FFFFF;
    if ((bits[0] & 0x7FFFFFFF) === 0) return sign;
    if (exponent > 30 || exponent < -10) return -1;
    const [whole, shift] = exponent > 0 ? [exponent << 23 | fraction, 13] : [0x800000 | fraction, 14 - exponent];
    return whole & ((1 << shift) - 1) ? -1 : sign | whole >>> shift;
  };
})();

/** Appends a table, two values a word where halves hold all of them, and sets the words of its place and of that. */
function set_table(words, at, channels) {
  if (channels.length === 0) return;
  const values = interleaved(channels), halves = new Uint16Array(values.length + (values.length & 1));
  for (let i = 0; i < values.length; ++i) {
    const half = to_half(values[i]);
    if (half < 0) {
      const place = words.numbers(values);
      words.words[at] = place;
      return;
    }
    halves[i] = half;
  }
  const place = words.room(halves.length / 2);
  words.words.set(new Uint32Array(halves.buffer), place);
  words.words[at] = place;
  words.words[at + 1] = 1;
}

const colours_of = (values, name) => COLOURS.map((colour) => values.get(`${name}.${colour}`));
const directions_of = (values, layer, grid) =>
  Array.from({length: grid_size(grid)}, (_, k) => colours_of(values, direction_name(layer, k))).flat();

/** The channels of lobes in the order [channel](rho, then Cx, Cy, Cz, n of each lobe). */
function lobe_channels(values, count) {
  return COLOURS.flatMap(
    (colour) => [values.get(`lobes.diffuse.${colour}`), ...Array.from({length: count}, (_, j) => PARAMETERS.map(
      (parameter) => values.get(`lobes.${j}.${parameter}.${colour}`))).flat()]);
}

/** `seen`: the side that is seen, whose opacity counts. */
function add_level(words, fabric, seen, k) {
  const {texels, views, lights, layers} = fabric;
  const level = words.room(AT.level_words);
  const set = (name, value) => {
    words.words[level + AT[name]] = value;
  };
  const read = (layer) => read_layer(fabric, layer, k);
  set('level_width', level_size(texels[0], k));
  set('level_height', level_size(texels[1], k));
  const lobes = read('lobes'), frame = read('frame'), table = read('table'), opacity = read_layer(seen, 'opacity', k);
  const light = read('light'), products = read('products');
  if (lobes) {
    set('level_lobe_count', layers.lobes.lobes);
    set('level_lobes', words.numbers(interleaved(lobe_channels(lobes, layers.lobes.lobes))));
  }
  if (frame) {
    const channels = ['nx', 'ny', 'nz', 'tx', 'ty', 'tz'].map((name) => frame.get(`frame.${name}`));
    set('level_frames', words.numbers(interleaved(channels)));
  }
  if (table) set_table(words, level + AT.level_view_table, directions_of(table, 'table', views));
  if (opacity) {
    const channels = Array.from({length: grid_size(views)}, (_, d) => opacity.get(direction_name('opacity', d)));
    set_table(words, level + AT.level_opacity, channels);
  }
  if (light) set_table(words, level + AT.level_light_table, directions_of(light, 'light', lights));
  if (products) {
    const pairs = pairs_at(fabric, k);
    set('level_products', pairs.length);
    const place = words.room(2 * pairs.length);
    words.words.set(pairs.flat(), place);
    set('level_pairs', place);
    set('level_coefficients', words.numbers(interleaved(pairs.map((_, m) => products.get(`products.${m}`)))));
  }
  return level;
}

/** The numbers of the bases: [of the views, of the lights]. */
function base_numbers(fabric) {
  const values = read_layer(fabric, 'bases', 0), {of_views, all} = base_count(fabric);
  const [w, h] = fabric.texels;
  const numbers = new Float32Array(values.size * w * h);
  for (let i = 0; i < values.size; ++i) numbers.set(values.get(`bases.${i}`), i * w * h);
  return [numbers.subarray(0, of_views), numbers.subarray(of_views, all)];
}

function add_segment(words, {start, round, length, radius, squeeze, tangents, across, out, stations, rows, reach, rank}, index) {
  const at = words.room(AT.segment_words);
  const set = (name, ...values) => words.set_numbers(at + AT[name], ...values);
  set('segment_axis', ...round.map((x) => x / length));
  set('segment_length', length);
  set('segment_start', ...start);
  set('segment_radius', radius);
  set('segment_squeeze', squeeze[0], squeeze[1]);
  set('segment_tangents', ...tangents.flat());
  set('segment_across', ...across.flat());
  set('segment_out', ...out.flat());
  set('segment_station', stations[0]);
  set('segment_stations', stations[1] - stations[0]);
  words.words[at + AT.segment_curve] = index;
  words.words.set(rows, at + AT.segment_rows);
  set('segment_reach', reach);
  set('segment_rank', rank);
}

/**
 * Yarn from above, and turned over (format/fabric/yarn_values.cpp), as yarns_of() gives it; `through` being the light from
 * below, where that is known.
 */
function yarns_of_sides(fabric, through) {
  const yarns = read_layer(fabric, 'yarns', 0), indirect = read_layer(fabric, 'indirect', 0);
  const above = yarns_of(fabric, {yarns, indirect}), turned = yarns_of(fabric, {yarns, indirect}, true);
  const below = through?.layers.indirect && yarns_of(fabric, {yarns, indirect: read_layer(through, 'indirect', 0)}).light;
  const odd = turned.curves.flatMap(({stations, sideways}) => Array(stations).fill(sideways ? 2 : 1));
  const mirrored = (light) => (station, j, k, c) =>
    (j === 4 || j === odd[station] ? -1 : 1) * light(station, j, k, c);
  return [{...above, through: below},
          {...turned, ...below ? {light: mirrored(below), through: mirrored(above.light)} : {}}];
}

function set_strands({words, floats}, at, {strands: {count, pieces, shift, seed, irregularity, swells}, tangent}) {
  const strands = Math.abs(count), upright = Math.abs(tangent[2]) >= 0.9;
  words[at + AT.curve_strands] = strands;
  if (strands > 0) {
    words[at + AT.curve_strand_shift] = (shift % strands + strands) % strands;
    floats[at + AT.curve_lays] = shift / strands;
  }
  words[at + AT.curve_pieces] = pieces;
  words[at + AT.curve_seed] = hash(seed);
  floats.set(count >= 0 ? [1, 1] : upright ? [1, -1] : [-1, 1], at + AT.curve_strand_sense);
  floats[at + AT.curve_irregularity] = irregularity;
  words[at + AT.curve_swells] = swells;
}

function add_yarns(words, yarns) {
  const {period, curves, segments, stations, light, through, top, bottom} = yarns;
  const {columns, rows, size, cells} = cells_of(yarns);
  const yarn = words.room(AT.yarn_words);
  const set = (name, value) => {
    words.words[yarn + AT[name]] = value;
  };
  words.set_numbers(yarn + AT.yarn_period, ...period);
  words.set_numbers(yarn + AT.yarn_low, bottom);
  words.set_numbers(yarn + AT.yarn_high, top);
  words.set_numbers(yarn + AT.yarn_cell_size, ...size);
  set('yarn_columns', columns);
  set('yarn_rows', rows);
  const grid = words.room(AT.cell_words * cells.length);
  set('yarn_cells', grid);
  cells.forEach(({low, high, references}, i) => {
    const cell = grid + AT.cell_words * i, place = words.room(AT.reference_words * references.length);
    references.forEach(({start, segment}, r) => {
      const at = place + AT.reference_words * r;
      words.set_numbers(at + AT.reference_start, ...start);
      words.words[at + AT.reference_segment] = segment;
    });
    words.words[cell + AT.cell_first] = place;
    words.words[cell + AT.cell_count] = references.length;
    words.set_numbers(cell + AT.cell_low, low);
    words.set_numbers(cell + AT.cell_high, high);
  });
  set('yarn_segments', words.length);
  const index = new Map(curves.map((curve, i) => [curve, i]));
  for (const segment of segments) add_segment(words, segment, index.get(segment.curve));
  set('yarn_curves', words.length);
  for (const curve of curves) {
    const at = words.room(AT.curve_words);
    words.words[at + AT.curve_first_station] = curve.first_station;
    words.words[at + AT.curve_stations] = curve.stations;
    words.set_numbers(at + AT.curve_albedo, ...curve.albedo);
    words.set_numbers(at + AT.curve_gloss, curve.gloss);
    words.set_numbers(at + AT.curve_roughness, curve.roughness);
    words.set_numbers(at + AT.curve_slope, curve.slope);
    words.set_numbers(at + AT.curve_groove, ...curve.plies.groove);
    set_strands(words, at, curve);
  }
  for (const [name, of] of [['yarn_light', light], ['yarn_through', through]]) {
    if (!of) continue;
    let at = words.room(3 * ANGLES * LIGHTS * stations);
    set(name, at);
    for (let station = 0; station < stations; ++station)
      for (let j = 0; j < ANGLES; ++j)
        for (let k = 0; k < LIGHTS; ++k)
          for (let c = 0; c < 3; ++c) words.floats[at++] = of(station, j, k, c);
  }
  return {place: yarn, thickest: curves.reduce((most, {ply_radius}) => Math.max(most, ply_radius), 0)};
}

/** Width of the largest pixel that shows the yarn, in texels of level 0 (spec/brdf.md, "The viewer"). */
function largest_yarn_pixel({mmPerRepeat, texels: [w, h], levels}, thickest) {
  const limit = 1.3 * thickest / Math.sqrt(mmPerRepeat[0] / w * (mmPerRepeat[1] / h));
  let size = 0.84;
  for (let k = 1; k < levels && 2 * size <= limit; ++k) size *= 2;
  return size;
}

/** Appends a side of a fabric, with the opacity of the side that is `seen`, and yarn or null, and returns its place. */
function add_fabric(words, fabric, seen, yarns) {
  const {levels, views, lights, layers, radianceScale = 1} = fabric;
  const place = words.room(AT.fabric_level_places + levels);
  const set = (name, value) => {
    words.words[place + AT[name]] = value;
  };
  set('fabric_level_count', levels);
  set('fabric_view_columns', views?.columns ?? 0);
  set('fabric_view_rows', views?.rows ?? 0);
  set('fabric_light_columns', lights?.columns ?? 0);
  set('fabric_light_rows', lights?.rows ?? 0);
  words.set_numbers(place + AT.fabric_radiance_scale, radianceScale);
  words.set_numbers(place + AT.fabric_reference_height, fabric.referenceHeight);
  if (layers.products) {
    const [of_views, of_lights] = base_numbers(fabric);
    set('fabric_view_basis', words.numbers(of_views));
    set('fabric_light_basis', words.numbers(of_lights));
  }
  if (yarns) {
    const {place: at, thickest} = add_yarns(words, yarns);
    set('fabric_yarns', at);
    words.set_numbers(place + AT.fabric_largest_yarn_pixel, largest_yarn_pixel(fabric, thickest));
  }
  for (let k = 0; k < levels; ++k) {
    const level = add_level(words, fabric, seen, k);
    words.words[place + AT.fabric_level_places + k] = level;
  }
  return place;
}

/**
 * { words, yarn } of a fabric of open_fabric: the words of all its sides in the layout of word_layout.glsl, and whether it
 * has yarn. Throws an Issue where a layer is broken.
 */
export function pack_fabric(fabric) {
  const {back, through, 'back.through': back_through} = fabric.sides;
  const yarn = Boolean(fabric.layers.yarns);
  const words = new Words();
  words.words[words.room(1)] = 1;
  const [above, turned] = yarn ? yarns_of_sides(fabric, through) : [null, null];
  const add = (side, seen, yarns, of, name) => {
    const place = add_fabric(words, side, seen, yarns);
    if (name) words.words[of + AT[name]] = place;
    return place;
  };
  const front = add(fabric, fabric, above);
  if (through) add(through, fabric, null, front, 'fabric_through');
  const behind = back && add(back, back, turned, front, 'fabric_turned');
  // Light that comes through the front goes for the back where its opacity is of the same views.
  const same = back && back.views.columns === fabric.views.columns && back.views.rows === fabric.views.rows;
  const other = back_through ?? (same ? through : null);
  if (back && other) add(other, back, null, behind, 'fabric_through');
  return {words: words.words.slice(0, words.length), yarn};
}

// The layers of a fabric (spec/fabric.md): which channels their parts have, and how a level's numbers are
// found in them.
import {level_size} from './exr.mjs';
import {indirect_count, yarn_count, yarns_of} from './yarns.mjs';

export const LAYERS = [
  'lobes', 'frame', 'table', 'opacity', 'light', 'products', 'bases', 'yarns', 'indirect'
];
/** Those of level 0 alone, with numbers that belong to no texel but are spread over the texels. */
export const SPREAD = ['bases', 'yarns', 'indirect'];
const COLOURS = ['red', 'green', 'blue'];
const PARAMETERS = ['cx', 'cy', 'cz', 'n'];

const each = (n, make) => Array.from({length: n}, (_, i) => make(i));
const direction_name = (layer, k, suffix = '') => `${layer}.${String(k).padStart(4, '0')}${suffix}`;
export const grid_size = (grid) => grid ? grid.columns * grid.rows : 0;

/**
 * How many numbers the bases are: { of_views, all }, from the members of the text; those of the views come
 * first.
 */
export function base_count({views, lights, layers: {bases}}) {
  const of_views = bases.functions.views * grid_size(views);
  return {of_views, all: of_views + 3 * bases.functions.lights * grid_size(lights)};
}

/** How many numbers a spread layer has. */
function spread_count(layer, text) {
  if (layer === 'bases') return base_count(text).all;
  return (layer === 'yarns' ? yarn_count : indirect_count)(text.layers.yarns);
}

/** Whether a layer's part has a number of channels that depends on the grid of views, or of lights. */
export const needs_views = (layer) => ['table', 'opacity', 'bases'].includes(layer);
export const needs_lights = (layer) => ['light', 'bases'].includes(layer);

/**
 * How many channels a layer needs, where that is not a matter of its names alone. `text` has the members
 * texels, views, lights and layers of the attribute text.
 */
export function channel_count(layer, text) {
  const {layers} = text;
  switch (layer) {
    case 'lobes':
      return 3 * (1 + 4 * layers.lobes.lobes);
    case 'frame':
      return 6;
    case 'table':
      return 3 * grid_size(text.views);
    case 'opacity':
      return grid_size(text.views);
    case 'light':
      return 3 * grid_size(text.lights);
    case 'products':
      return Math.max(...layers.products.pairs.map((pairs) => pairs.length));
    default:
      return Math.ceil(spread_count(layer, text) / (text.texels[0] * text.texels[1]));
  }
}

/** The names of these channels. */
export function layer_channels(layer, text) {
  const count = channel_count(layer, text);
  switch (layer) {
    case 'lobes':
      return [
        'lobes.diffuse', ...each(text.layers.lobes.lobes, (j) => PARAMETERS.map((p) => `lobes.${j}.${p}`))
      ].flat()
        .flatMap((name) => COLOURS.map((c) => `${name}.${c}`));
    case 'frame':
      return ['nx', 'ny', 'nz', 'tx', 'ty', 'tz'].map((name) => `frame.${name}`);
    case 'table':
    case 'light':
      return each(count / 3, (k) => COLOURS.map((c) => direction_name(layer, k, `.${c}`))).flat();
    case 'opacity':
      return each(count, (k) => direction_name('opacity', k));
    default:
      return each(count, (i) => `${layer}.${i}`);
  }
}

/**
 * Whether number `t` of a channel means something: the last channel of a spread layer may have more than
 * it needs, and a level's products may be fewer than those of another.
 */
export function is_used(layer, text, level, channel, t) {
  if (SPREAD.includes(layer)) {
    const [w, h] = text.texels;
    return Number(channel.split('.')[1]) * w * h + t < spread_count(layer, text);
  }
  if (layer !== 'products') return true;
  const {levels, pairs} = text.layers.products;
  return Number(channel.split('.')[1]) < pairs[levels.indexOf(level)].length;
}

/**
 * A level as brdf.mjs wants it, from the numbers of its layers, Maps from channels to arrays, null where
 * absent; those of `bases` are level 0's. `text` has the members of the attribute text.
 */
export function make_level(text, level, numbers) {
  const {texels, views, lights, layers, radianceScale = 1} = text;
  const {lobes, frame, table, opacity, light, products, bases, yarns, indirect} = numbers;
  const of = (values, ...names) => names.map((name) => values.get(name));
  const rgb = (values, name) => of(values, ...COLOURS.map((c) => `${name}.${c}`));
  const colours = (values, layer, grid) => {
    const lists = each(grid_size(grid), (k) => rgb(values, direction_name(layer, k)));
    return (t, k) => lists[k].map((x) => x[t]);
  };
  const result = {
    width: level_size(texels[0], level),
    height: level_size(texels[1], level),
    scale: Math.fround(radianceScale),
    views,
    lights,
    lobes: null,
    frame: null,
    table: table ? colours(table, 'table', views) : null,
    opacity: null,
    light: light ? colours(light, 'light', lights) : null,
    products: null,
    yarns: level === 0 && yarns && indirect ? yarns_of(text, {yarns, indirect}) : null,
  };
  if (lobes) {
    const rho = rgb(lobes, 'lobes.diffuse');
    const lists = each(
      layers.lobes.lobes,
      (j) => Object.fromEntries(PARAMETERS.map((p) => [p, rgb(lobes, `lobes.${j}.${p}`)])));
    result.lobes = (t) => COLOURS.map(
      (_, c) => ({
        rho: rho[c][t],
        lobes: lists.map(({cx, cy, cz, n}) => ({cx: cx[c][t], cy: cy[c][t], cz: cz[c][t], n: n[c][t]})),
      }));
  }
  if (frame) {
    const normal = of(frame, 'frame.nx', 'frame.ny', 'frame.nz'),
          tangent = of(frame, 'frame.tx', 'frame.ty', 'frame.tz');
    result.frame = (t) => ({normal: normal.map((x) => x[t]), tangent: tangent.map((x) => x[t])});
  }
  if (opacity) {
    const lists = each(grid_size(views), (k) => opacity.get(direction_name('opacity', k)));
    result.opacity = (t, k) => lists[k][t];
  }
  if (products) {
    const texels_of_0 = texels[0] * texels[1], {of_views} = base_count(text);
    const base = (i) => bases.get(`bases.${Math.floor(i / texels_of_0)}`)[i % texels_of_0];
    const V = grid_size(views), L = grid_size(lights);
    const pairs = layers.products.pairs[layers.products.levels.indexOf(level)];
    result.products = {
      pairs,
      coefficient: (t, m) => products.get(`products.${m}`)[t],
      phi: (a, k) => a === 0 ? 1 : base((a - 1) * V + k),
      psi: (b, k) => COLOURS.map((_, c) => base(of_views + 3 * (b * L + k) + c)),
    };
  }
  return result;
}

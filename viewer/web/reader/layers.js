// The layers of a fabric (spec/fabric.md): which channels their parts have, and how many numbers of them mean something.

export const LAYERS = ['lobes', 'frame', 'table', 'opacity', 'light', 'products', 'bases', 'yarns', 'indirect', 'map'];
/** Those of level 0 alone, with numbers that belong to no texel but are spread over the texels. */
export const SPREAD = ['bases', 'yarns', 'indirect', 'map'];
export const COLOURS = ['red', 'green', 'blue'];
export const PARAMETERS = ['cx', 'cy', 'cz', 'n'];

/** The level whose texels a level shows: of another side that leaves it out, a coarser one. */
export const level_of_texels = ({shown}, layer, level) => shown && !SPREAD.includes(layer) ? shown[level] : level;

/** The pairs of the products at a level. */
export const pairs_at = (fabric, level) => {
  const {levels, pairs} = fabric.layers.products;
  return pairs[levels.indexOf(level_of_texels(fabric, 'products', level))];
};

const each = (n, make) => Array.from({length: n}, (_, i) => make(i));
export const direction_name = (layer, k, suffix = '') => `${layer}.${String(k).padStart(4, '0')}${suffix}`;
export const grid_size = (grid) => grid ? grid.columns * grid.rows : 0;

/** How many numbers the bases are: { of_views, all }, from the members of the text; numbers of views come first. */
export function base_count({views, lights, layers: {bases}}) {
  const of_views = bases.functions.views * grid_size(views);
  return {of_views, all: of_views + 3 * bases.functions.lights * grid_size(lights)};
}

/** Functions of the angle, and of the light, that indirect light has coefficients of. */
export const ANGLES = 5, LIGHTS = 9;
/** Coefficients of a station, which its moments follow: all numbers of a station in older files. */
export const TRANSFER_VALUES = 3 * ANGLES * LIGHTS;

/**
 * How many numbers a spread layer has; of yarns the fields of all curves one after the other, then x, y and z of nodes;
 * of packed ones then functions, whose factors are the light.
 */
function spread_count(layer, text) {
  if (layer === 'bases') return base_count(text).all;
  if (layer === 'map') return text.layers.yarns.curves + text.layers.map.size[0] * text.layers.map.size[1];
  const {curves, nodes, fields, stations, valuesPerStation = TRANSFER_VALUES, packed} = text.layers.yarns;
  if (layer === 'yarns') return fields * curves + 3 * nodes + (packed?.functions ?? 0) * valuesPerStation;
  return (packed?.functions ?? valuesPerStation) * stations;
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
    case 'lobes': return 3 * (1 + 4 * layers.lobes.lobes);
    case 'frame': return 6;
    case 'table': return 3 * grid_size(text.views);
    case 'opacity': return grid_size(text.views);
    case 'light': return 3 * grid_size(text.lights);
    case 'products': return Math.max(...layers.products.pairs.map((pairs) => pairs.length));
    default: return Math.ceil(spread_count(layer, text) / (text.texels[0] * text.texels[1]));
  }
}

/** The names of these channels. */
export function layer_channels(layer, text) {
  const count = channel_count(layer, text);
  switch (layer) {
    case 'lobes': {
      const names = ['diffuse', ...each(text.layers.lobes.lobes, (j) => PARAMETERS.map((p) => `${j}.${p}`)).flat()];
      return COLOURS.flatMap((c) => names.map((name) => `lobes.${name}.${c}`));
    }
    case 'frame': return ['nx', 'ny', 'nz', 'tx', 'ty', 'tz'].map((name) => `frame.${name}`);
    case 'table':
    case 'light': return each(count / 3, (k) => COLOURS.map((c) => direction_name(layer, k, `.${c}`))).flat();
    case 'opacity': return each(count, (k) => direction_name('opacity', k));
    default: return each(count, (i) => `${layer}.${i}`);
  }
}

/**
 * How many numbers of a channel mean something: the last channel of a spread layer may have more than it needs, and
 * a level may have fewer products than another.
 */
export function used_count(layer, text, level, channel) {
  if (SPREAD.includes(layer)) {
    const [w, h] = text.texels;
    return Math.max(0, spread_count(layer, text) - Number(channel.split('.')[1]) * w * h);
  }
  if (layer !== 'products') return Infinity;
  const {levels, pairs} = text.layers.products;
  return Number(channel.split('.')[1]) < pairs[levels.indexOf(level)].length ? Infinity : 0;
}

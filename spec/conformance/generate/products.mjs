// The valid fabrics with light tables and products of shared functions, in the form of fabrics.mjs.
import {LARGEST} from '../reference/brdf.mjs';
import {pack_values} from '../reference/exr_write.mjs';
import {ask, by_colour} from './extremes.mjs';
import {mix_precisions, part_of} from './make.mjs';
import {unit} from './random.mjs';

const UP = [0, 0, 1];
const OBLIQUE = unit([0.3, 0.4, 0.8]);
const PRODUCTS = ['products', 'bases'];

const lights = [
  {name: 'light', about: 'a light table alone: f = l_z S(l)', layers: ['light'], light_grid: [2, 2]},
  {name: 'light-1x1', about: 'a light table of one light', layers: ['light'], light_grid: [1, 1]},
  {name: 'light-8x8', about: 'a light table of 64 lights', layers: ['light'], light_grid: [8, 8], texels: [2, 1]},
  {
    name: 'light-float',
    about: 'a light table in single precision, odd numbers of texels',
    layers: {light: {precision: 'float'}}, texels: [5, 3], light_grid: [3, 2],
  },
  {name: 'light-lobes', about: 'lobes, with their cosine, times a light table', layers: ['lobes', 'frame', 'light']},
  {
    name: 'light-table',
    about: 'a view table times a light table, over grids of different sizes',
    layers: ['table', 'light'], grid: [2, 2], light_grid: [3, 5],
  },
  {
    name: 'light-table-opacity',
    about: 'a view table of the views that are not holes, times a light table',
    layers: ['lobes', 'table', 'opacity', 'light'],
  },
  {
    name: 'light-levels',
    about: 'a light table on some levels; S = 1 on the others',
    texels: [4, 4], layers: {lobes: {}, table: {levels: [0, 1]}, light: {levels: [1, 2]}},
  },
  {
    name: 'lights-of-no-layer',
    about: 'lights that no layer is laid out over: a reader does not look at them',
    layers: ['lobes'], brief: true,
    text: (text) => {
      text.lights = {layout: 'spiral'};
    },
  },
];

/** Numbers of some channels of a part, written over what is there. */
const written = (layer, level, name, first, ...numbers) => (parts) => {
  const part = part_of(parts, layer), {type} = part.channels.find((channel) => channel.name === name);
  pack_values(numbers, type).copy(part.levels[level].values.get(name), first * (type === 'half' ? 2 : 4));
};

const products = [
  {
    name: 'products-one',
    about: 'one function of the light, the same from all views',
    layers: PRODUCTS, functions: [0, 1],
    pairs: () => [[0, 0]],
  },
  {
    name: 'products-several',
    about: 'several functions of the view and the light; a pair may stand twice, a function be in no pair',
    layers: PRODUCTS, functions: [3, 2],
    pairs: () => [[0, 0], [3, 1], [1, 0], [3, 1], [0, 1]],
    light_grid: [2, 3],
  },
  {
    name: 'products-many',
    about:
      'twelve products: channels in another order than their numbers; bases over many channels',
    layers: PRODUCTS, texels: [2, 1], grid: [3, 4], light_grid: [4, 4], functions: [3, 3],
    pairs: () => Array.from({length: 12}, (_, m) => [Math.floor(m / 3), m % 3]),
  },
  {
    name: 'products-1x1',
    about: 'one texel: every number of the bases has a channel of its own',
    layers: PRODUCTS, texels: [1, 1],
  },
  {name: 'products-table', about: 'products beside a view table', layers: ['table', ...PRODUCTS]},
  {name: 'products-light', about: 'products beside a light table', layers: ['light', ...PRODUCTS]},
  {
    name: 'products-table-light-opacity',
    about: 'products beside T S; the opacity weights T and not the functions of the view',
    layers: ['table', 'opacity', 'light', ...PRODUCTS], functions: [2, 2],
    pairs: () => [[1, 0], [2, 1], [0, 1]],
  },
  {name: 'products-lobes', about: 'lobes in frames times products', layers: ['lobes', 'frame', ...PRODUCTS]},
  {
    name: 'products-levels',
    about: 'products on some levels, with other and fewer pairs on the coarser; tables on the others',
    texels: [8, 4],
    layers: {
      lobes: {levels: [0, 1]},
      table: {levels: [0]},
      light: {levels: [3]},
      products: {levels: [1, 2, 3]},
      bases: {}
    },
    functions: [1, 2],
    pairs: (level) => [[[0, 0], [1, 1], [1, 0]], [[1, 1]], [[0, 1], [0, 0]]][level - 1],
  },
  {
    name: 'products-float',
    about: 'coefficients and functions in single precision',
    layers: {products: {precision: 'float'}, bases: {precision: 'float'}},
  },
  {
    name: 'products-unused-numbers',
    about:
      'numbers behind the bases, and products that a level does not have: no reader uses them',
    layers: PRODUCTS,
    pairs: (level) => level === 0 ? [[0, 0], [1, 1]] : [[1, 0]],
    functions: [1, 2], light_grid: [1, 2],
    before: (parts) => {
      written('bases', 0, 'bases.2', 4, 7, -7)(parts);
      written('products', 1, 'products.1', 0, 7)(parts);
    },
  },
  {name: 'bases-alone', about: 'functions that no product uses', layers: ['lobes', 'bases']},
];

const more = [
  {
    name: 'products-all-layers',
    about: 'every layer of texels at once',
    layers: ['lobes', 'frame', 'table', 'opacity', 'light', ...PRODUCTS], functions: [2, 2],
    pairs: () => [[0, 0], [2, 1], [1, 0]],
  },
  {
    name: 'products-precision-mixed',
    about: 'every second channel of the parts in the other precision',
    texels: [2, 2], layers: ['light', ...PRODUCTS],
    before: mix_precisions,
  },
];

/** Values of bases by number: of_view(a, view) for a from 1, of_light(b, light, colour 0 to 2). */
const of_bases = ({texels: [w, h], grid, light_grid, functions: [P]}, of_view, of_light) =>
  (level, channel, t) => {
    const V = grid[0] * grid[1], L = light_grid[0] * light_grid[1];
    const i = Number(channel.split('.')[1]) * w * h + t;
    if (i < P * V) return of_view(1 + Math.floor(i / V), i % V);
    const n = Math.floor((i - P * V) / 3);
    return of_light(Math.floor(n / L), n % L, (i - P * V) % 3);
  };

const SMALL = {texels: [4, 1], levels: 1, grid: [1, 1], light_grid: [1, 1], functions: [1, 2]};
const extremes = [
  {
    ...SMALL,
    name: 'extreme-products',
    about: 'sums that are negative, cancel, or go beyond the largest number',
    layers: {table: {precision: 'float'}, products: {precision: 'float'}, bases: {precision: 'float'}},
    pairs: () => [[0, 0], [1, 1]],
    value: {
      table: () => 1,
      products: (level, channel, t) => channel.endsWith('.0') ? [-2, 1, 3e38, 0][t] : [0, -4, -3e38, -1][t],
      bases: of_bases(SMALL, () => -0.5, (b, light, c) => b ? [1, -1, 0][c] : [1, 0.25, 0][c]),
    },
    queries: [
      ask([0, 0], OBLIQUE, UP, 'a negative sum counts as 0; one that is not; T alone'),
      ask([1, 0], OBLIQUE, UP, 'a product of two negative numbers adds, one of a negative number takes away'),
      ask([2, 0], OBLIQUE, UP, 'beyond the largest number, below 0, and T alone'),
      ask([3, 0], OBLIQUE, UP, 'a coefficient of 0'),
    ],
  },
  {
    ...SMALL,
    name: 'extreme-products-overflow',
    about: 'overflows of one sign, and what lobes make of them',
    layers:
      {lobes: {}, light: {precision: 'float'}, products: {precision: 'float'}, bases: {precision: 'float'}},
    K: 0,
    pairs: () => [[0, 0], [0, 1]],
    value: {
      lobes: by_colour(4, 0.25, 0),
      light: (level, channel, t) => [0, LARGEST, 1, 1e38][t],
      products: (level, channel, t) => [LARGEST, LARGEST, -LARGEST, 1e30][t],
      bases: of_bases(SMALL, () => 1, (b) => b ? 1 : 2),
    },
    queries: [
      ask([0, 0], UP, UP, 'F is held before g: the largest number, a quarter of it, and 0'),
      ask([1, 0], UP, UP, 'S and the products are the largest number'),
      ask([2, 0], UP, UP, 'minus three times the largest number: F = 0'),
      ask([3, 0], OBLIQUE, UP, 'large, but nothing overflows'),
    ],
  },
  {
    ...SMALL,
    name: 'extreme-light',
    about: 'S of 0, subnormal, and the largest number, beside T',
    layers: {table: {precision: 'float'}, light: {precision: 'float'}},
    value: {table: by_colour(4, 0.25, 0), light: (level, channel, t) => [0, 1e-40, LARGEST, 2 ** -24][t]},
    queries: [0, 1, 2, 3].map(
      (t) => ask([t, 0], OBLIQUE, UP, `S of ${['0', '10^-40', 'the largest number', '2^-24'][t]}`)),
  },
];

export const lights_and_products = [...lights, ...products, ...more, ...extremes];

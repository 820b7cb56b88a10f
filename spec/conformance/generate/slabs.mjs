// The valid fabrics with light tables, products of shared functions, and heights; in the form of
// fabrics.mjs.
import {LARGEST} from '../reference/brdf.mjs';
import {pack_values} from '../reference/exr_write.mjs';
import {ask} from './extremes.mjs';
import {part_of} from './make.mjs';
import {random, unit} from './random.mjs';

const UP = [0, 0, 1];
const OBLIQUE = unit([0.3, 0.4, 0.8]);
const PRODUCTS = ['products', 'bases'];

const lights = [
  {
    name: 'light',
    about: 'a light table alone: f = S(l), without a cosine',
    layers: ['light'],
    light_grid: [2, 2]
  },
  {name: 'light-1x1', about: 'a light table of one light', layers: ['light'], light_grid: [1, 1]},
  {
    name: 'light-8x8',
    about: 'a light table of 64 lights',
    layers: ['light'],
    light_grid: [8, 8],
    texels: [2, 1]
  },
  {
    name: 'light-float',
    about: 'a light table in single precision, odd numbers of texels',
    layers: {light: {precision: 'float'}},
    texels: [5, 3],
    light_grid: [3, 2],
  },
  {
    name: 'light-lobes',
    about: 'lobes, with their cosine, times a light table',
    layers: ['lobes', 'frame', 'light']
  },
  {
    name: 'light-table',
    about: 'a view table times a light table, over grids of different sizes',
    layers: ['table', 'light'],
    grid: [2, 2],
    light_grid: [3, 5],
  },
  {
    name: 'light-table-opacity',
    about: 'a view table of the views that are not holes, times a light table',
    layers: ['lobes', 'table', 'opacity', 'light'],
  },
  {
    name: 'light-levels',
    about: 'a light table on some levels; S = 1 on the others',
    texels: [4, 4],
    layers: {lobes: {}, table: {levels: [0, 1]}, light: {levels: [1, 2]}},
  },
  {
    name: 'lights-of-no-layer',
    about: 'lights that no layer is laid out over: a reader does not look at them',
    layers: ['lobes'],
    brief: true,
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
    layers: PRODUCTS,
    functions: [0, 1],
    pairs: () => [[0, 0]],
  },
  {
    name: 'products-several',
    about: 'several functions of the view and the light; a pair may stand twice, a function be in no pair',
    layers: PRODUCTS,
    functions: [3, 2],
    pairs: () => [[0, 0], [3, 1], [1, 0], [3, 1], [0, 1]],
    light_grid: [2, 3],
  },
  {
    name: 'products-many',
    about:
      'twelve products: channels in the order of bytes are not those of numbers; bases over many channels',
    layers: PRODUCTS,
    texels: [2, 1],
    grid: [3, 4],
    light_grid: [4, 4],
    functions: [3, 3],
    pairs: () => Array.from({length: 12}, (_, m) => [Math.floor(m / 3), m % 3]),
  },
  {
    name: 'products-1x1',
    about: 'one texel: every number of the bases has a channel of its own',
    layers: PRODUCTS,
    texels: [1, 1],
  },
  {
    name: 'products-table',
    about: 'products beside a view table',
    layers: ['table', ...PRODUCTS],
  },
  {
    name: 'products-light',
    about: 'products beside a light table',
    layers: ['light', ...PRODUCTS],
  },
  {
    name: 'products-table-light-opacity',
    about: 'products beside T S; the opacity weights T and not the functions of the view',
    layers: ['table', 'opacity', 'light', ...PRODUCTS],
    functions: [2, 2],
    pairs: () => [[1, 0], [2, 1], [0, 1]],
  },
  {
    name: 'products-lobes',
    about: 'lobes in frames times products',
    layers: ['lobes', 'frame', ...PRODUCTS],
  },
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
      'numbers beyond those of the bases, and of products that a level does not have: no reader uses them',
    layers: PRODUCTS,
    pairs: (level) => level === 0 ? [[0, 0], [1, 1]] : [[1, 0]],
    functions: [1, 2],
    light_grid: [1, 2],
    before: (parts) => {
      written('bases', 0, 'bases.2', 4, 7, -7)(parts);
      written('products', 1, 'products.1', 0, 7)(parts);
    },
  },
  {
    name: 'bases-alone',
    about: 'functions that no product uses',
    layers: ['lobes', 'bases'],
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

const SMALL = {
  texels: [4, 1],
  levels: 1,
  grid: [1, 1],
  light_grid: [1, 1],
  functions: [1, 2],
};
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
      lobes: (level, channel) => channel.endsWith('red') ? 4 :
        channel.endsWith('green')                        ? 0.25 :
                                                           0,
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
    value: {
      table: (level, channel) => channel.endsWith('red') ? 4 :
        channel.endsWith('green')                        ? 0.25 :
                                                           0,
      light: (level, channel, t) => [0, 1e-40, LARGEST, 2 ** -24][t],
    },
    queries: [0, 1, 2, 3].map(
      (t) => ask([t, 0], OBLIQUE, UP, `S of ${['0', '10^-40', 'the largest number', '2^-24'][t]}`)),
  },
];

const LOBES = ['lobes', 'heights'];
const shapes = [
  [1, 1, 1],
  [2, 1, 1],
  [2, 2, 1],
  [1, 3, 1],
  [1, 1, 2],
  [2, 1, 2],
  [2, 2, 3],
  [1, 2, 8],
].map((cells) => ({
        name: `heights-${cells[0]}x${cells[1]}${cells[2] > 1 ? `-slabs-${cells[2]}` : ''}`,
        about: `${cells[0]} x ${cells[1]} cells of ${cells[2]} slabs`,
        cells,
        layers: cells[2] > 1 ? [...LOBES, ...PRODUCTS] : LOBES,
      }));

const sizes = [[1, 1, 1, 1], [1, 1, 3, 2], [5, 3, 1, 1], [7, 4, 2, 2], [33, 2, 2, 1], [1, 1, 16, 16]].map(
  ([w, h, columns, rows]) => ({
    name: `heights-size-${w}x${h}-of-${columns}x${rows}`,
    about: `${w} x ${h} texels of ${columns} x ${rows} cells`,
    texels: [w, h],
    levels: w > 8 ? 2 : undefined,
    cells: [columns, rows, 1],
    layers: columns > 8 ? ['heights', ...PRODUCTS] : LOBES,
    functions: [0, 1],
    pairs: () => [[0, 0]],
  }));

/** Ends of an entry: top(level, entry, texel) and bottom, as values of heights. */
const ends = (top, bottom) => (level, channel, t) => {
  const [, entry, end] = channel.split('.');
  return (end === 'top' ? top : bottom)(level, Number(entry), t);
};
const drawn = (name) => (level, entry, t) => random(`${name} ${level} ${entry} ${t}`)();

const heights = [
  {
    name: 'heights-holes',
    about: 'half of the cells without yarn: rays go through, or meet what lies lower farther on',
    texels: [4, 3],
    cells: [2, 2, 1],
    layers: LOBES,
    value: {
      heights: ends(
        (level, e, t) => drawn('hole')(level, e, t) < 0.5 ? 0 : 0.25 + 0.5 * drawn('top')(level, e, t),
        (level, e, t) => drawn('hole')(level, e, t) < 0.5 ? drawn('none')(level, e, t) : 0.2)
    },
  },
  {
    name: 'heights-no-yarn',
    about: 'heights without any yarn: nothing is met, alpha = 0',
    layers: LOBES,
    cells: [2, 1, 1],
    value: {heights: ends((level, e) => e ? 0.25 : 0.5, () => 0.5)},
  },
  {
    name: 'heights-no-yarn-at-a-level',
    about: 'yarn at level 1, none at level 0; the levels blend by alpha',
    layers: LOBES,
    texels: [2, 2],
    value: {heights: ends((level) => level ? 0.5 : 0.25, () => 0.25)},
    queries: [{
      level: 0.25,
      uv: [0.3, 0.3],
      light: OBLIQUE,
      view: UP,
      why: 'alpha = 0 at the finer level: f is that of the coarser'
    }],
  },
  {
    name: 'heights-opacity',
    about: 'the opacity of what is met, of each ray its own; a texel is their mean by alpha',
    cells: [2, 2, 1],
    layers: ['lobes', 'opacity', 'heights'],
  },
  {
    name: 'heights-table-light',
    about: 'tables of the texel that is met, not of that which is asked for',
    cells: [2, 1, 1],
    layers: ['table', 'light', 'heights'],
  },
  {
    name: 'heights-all-layers',
    about: 'every layer at once',
    cells: [2, 1, 2],
    layers: ['lobes', 'frame', 'table', 'opacity', 'light', 'heights', ...PRODUCTS],
    functions: [2, 2],
    pairs: () => [[0, 0], [2, 1], [1, 0]],
  },
  {
    name: 'heights-levels',
    about: 'heights at levels 0 and 2; at the others a texel is a place on the plane, with the one entry 0',
    texels: [8, 4],
    cells: [2, 1, 2],
    layers: {lobes: {}, opacity: {}, heights: {levels: [0, 2]}, products: {levels: [0, 1, 2]}, bases: {}},
    pairs: (level) => level === 1 ? [[1, 0]] : [[0, 0], [1, 1]],
  },
  {
    name: 'heights-other-levels',
    about: 'products at level 0, heights at level 1: the part has the channels of all entries',
    texels: [2, 2],
    cells: [2, 1, 1],
    layers: {light: {}, heights: {levels: [1]}, products: {levels: [0]}, bases: {}},
  },
  {
    name: 'heights-float',
    about: 'heights in single precision',
    cells: [2, 2, 1],
    layers: {lobes: {}, heights: {precision: 'float'}},
  },
  {
    name: 'heights-precision-mixed',
    about: 'every second channel of the parts in the other precision',
    texels: [2, 2],
    cells: [2, 1, 1],
    layers: ['light', 'heights', ...PRODUCTS],
    before: (parts, fabric) => {
      for (const part of parts.slice(1)) {
        part.channels.forEach((channel, i) => {
          if (i % 2 === 0) return;
          channel.type = 'float';
          part.levels.forEach(({width, height, values}, k) => {
            const {levels, values: of} = fabric.layers[part.name];
            const numbers =
              levels.includes(k) ? of(k, channel.name, {width, height}) : Array(width * height).fill(0);
            values.set(channel.name, pack_values(numbers, 'float'));
          });
        });
      }
    },
  },
  {
    name: 'heights-slabs-alike',
    about: 'slabs of the same ends: the lower number counts; and of overlapping ones the higher',
    texels: [4, 1],
    cells: [1, 1, 3],
    layers: ['heights', ...PRODUCTS],
    value: {
      heights: ends(
        (level, e, t) => [[0.5, 0.5, 0.5], [0.25, 0.75, 0.75], [0.5, 0.5, 0.75], [0.5, 0.25, 0]][t % 4][e],
        (level, e, t) => [[0.25, 0.25, 0], [0, 0.5, 0.25], [0, 0, 0], [0.75, 0, 0.5]][t % 4][e])
    },
  },
  {
    name: 'heights-slabs-overlapping',
    about:
      'a ray that comes from the side into two slabs that overlap is at one height in both: the lower number',
    texels: [4, 1],
    levels: 1,
    cells: [1, 1, 2],
    layers: ['heights', ...PRODUCTS],
    value:
      {heights: ends(
         (level, e, t) => t % 2 === 0 ? 0.125 :
           e                          ? 0.75 :
                                        0.625,
         () => 0)},
    queries: [
      ask([0, 0], OBLIQUE, unit([-1, 0, 0.25]), 'from the side, below both tops'),
      ask([2, 0], OBLIQUE, unit([1, 0, 0.25]), 'from the other side, below both tops'),
      ask([1, 0], OBLIQUE, UP, 'from above: the higher one'),
    ],
  },
  {
    name: 'heights-below-the-plane',
    about: 'a plane far above the yarn, repeats of other sides than the texels',
    referenceHeight: 3,
    mmPerRepeat: [1.5, 4],
    cells: [2, 1, 1],
    layers: LOBES,
  },
  {
    name: 'heights-above-the-plane',
    about: 'a plane below the yarn and below 0',
    referenceHeight: -1.25,
    mmPerRepeat: [4, 0.75],
    cells: [1, 2, 1],
    layers: LOBES,
  },
  {
    name: 'heights-small-repeat',
    about: 'a repeat much smaller than the yarn is high: rays pass through many of them',
    mmPerRepeat: [0.0625, 0.03125],
    cells: [2, 2, 1],
    layers: LOBES,
    value: {
      heights: ends(
        (level, e, t) => drawn('small')(level, e, t) < 0.8 ? 0.1 * drawn('low')(level, e, t) : 0.9,
        (level, e, t) => drawn('small')(level, e, t) < 0.8 ? 0 : 0.85)
    },
  },
  {
    name: 'heights-most-cells',
    about: 'rays that have visited 16,384 cells meet nothing; steeper ones meet the yarn far below',
    texels: [1, 2],
    levels: 1,
    mmPerRepeat: [0.0009765625, 1],
    referenceHeight: 0.5,
    layers: LOBES,
    value: {heights: ends((level, e, t) => t ? 1 : 0.0625, (level, e, t) => t ? 0.9375 : 0)},
    queries: [
      ask([0, 0], OBLIQUE, unit([1, 0, 0.01]), 'more than 16,384 cells: nothing is met'),
      ask([0, 0], OBLIQUE, unit([1, 0, 0.0625]), '15,360 cells and less: the yarn of its own row is met'),
      ask([0, 0], OBLIQUE, unit([-1, 0, 0.055]), 'more than 16,384 cells in the other direction'),
      ask([0, 1], OBLIQUE, unit([1, 0, 0.01]), 'the yarn of the other row is met at once'),
    ],
  },
  {
    name: 'extreme-heights',
    about: 'the largest halves, negative ones, and neighbours that differ by as much as they can',
    texels: [4, 2],
    levels: 1,
    mmPerRepeat: [1000, 2000],
    layers: LOBES,
    value: {
      heights: ends(
        (level, e, t) => [65504, -65503.5, 0, 1, -60000, 2 ** -24, 30000, 65504][t],
        (level, e, t) => [65472, -65504, -1, 65504, -60032, 0, 0, -65504][t])
    },
  },
];

export const slabs = [...lights, ...products, ...extremes, ...shapes, ...sizes, ...heights];

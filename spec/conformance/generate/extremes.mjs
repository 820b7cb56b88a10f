// Valid fabrics with extreme values, and what they are asked; fabrics.mjs has the others.
import {LARGEST} from '../reference/brdf.mjs';
import {frame_of, framed} from './make.mjs';
import {unit} from './random.mjs';

const UP = [0, 0, 1];
const OBLIQUE = unit([0.3, 0.4, 0.8]);
const BACK = unit([-0.3, -0.4, 0.8]);

/**
 * Values of lobe channels by texel: lobe(t) gives { rho, cx, cy, cz, n }, the same for all colours and
 * lobes.
 */
export const by_texel = (lobe) => (level, channel, t) => {
  const values = lobe(t, Number(channel.split('.')[1]));
  return channel.startsWith('lobes.diffuse') ? values.rho : values[channel.split('.')[2]];
};

/** Values of channels by their colour. */
export const by_colour = (red, green, blue) => (level, channel) =>
  channel.endsWith('red') ? red : channel.endsWith('green') ? green : blue;

/** A query of level 0. */
export const ask = (texel, light, view, why) => ({level: 0, texel, light, view, why});

export const extremes = [
  {
    name: 'extreme-rho',
    about: 'rho of 0, subnormal, huge and the largest number',
    texels: [5, 1], levels: 1, K: 0, layers: ['lobes', 'table'],
    value: {lobes: by_texel((t) => ({rho: [0, 1e-40, 1e30, LARGEST, 3e38][t]})), table: by_colour(4, 0.25, 0)},
    queries: [
      ask([0, 0], OBLIQUE, UP, 'rho = 0 without lobes: f = 0'),
      ask([1, 0], OBLIQUE, UP, 'a subnormal rho: may count as 0'),
      ask([2, 0], OBLIQUE, UP, 'a huge rho that fits'),
      ask(
        [3, 0], UP, UP,
        'rho is the largest number: T = 4 overflows and is held; T = 0.25 is a quarter of it; T = 0 gives 0'),
      ask([4, 0], UP, UP, 'f overflows after the multiplication by T and is held'),
    ],
  },
  {
    name: 'extreme-exponents',
    about: 'exponents 0, 0.001, 1, 200 and 5,000 with bases below, at and above 1',
    texels: [5, 3], levels: 1, layers: ['lobes'],
    value: {
      lobes: by_texel((t) => ({
        rho: 0.125, cx: 0, cy: 0, cz: [0.75, 1, 1.015625][Math.floor(t / 5)], n: [0, 0.0010000000474974513, 1, 200, 5000][t % 5],
      })),
    },
    queries: [0, 1, 2].flatMap((j) => [0, 1, 2, 3, 4].flatMap((i) => {
      const what = `n = ${[0, 0.001, 1, 200, 5000][i]}, cz = ${[0.75, 1, 1.015625][j]}`;
      return [
        ask([i, j], UP, UP, `${what}: the base is exact`),
        ask([i, j], unit([0.0625, 0, 1]), UP, `${what}: a base beside it`)
      ];
    })),
  },
  {
    name: 'extreme-coefficients',
    about: 'coefficients 0, negative and huge',
    texels: [6, 1], levels: 1, K: 2, layers: ['lobes'],
    value: {
      lobes: by_texel((t, j) => ({
        rho: 0.25, cx: [0, -1, 1, 0, -1000, 1e-20][t], cy: [0, -1, 1, 0, -1000, 1e-20][t],
        cz: [0, -1, 0.5, -0.5, j ? 1000 : -1000, 1e-20][t], n: [0, 3, 2, 0, 2, 0.5][t],
      })),
    },
    queries: [
      ask([0, 0], OBLIQUE, BACK, 'C = 0: the base is 0 and the lobe adds 0, although n = 0'),
      ask([0, 0], UP, UP, 'C = 0 along the normal: the lobe adds 0'),
      ask([1, 0], OBLIQUE, OBLIQUE, 'all coefficients negative: the base is negative'),
      ask([1, 0], OBLIQUE, BACK, 'all coefficients negative, mirrored directions'),
      ask([2, 0], OBLIQUE, BACK, 'the base is positive although cx and cy pull it down'),
      ask(
        [2, 0], unit([0.7, 0.1, 0.2]), unit([-0.7, 0.1, 0.2]),
        'the base is negative although cz is positive'),
      ask([3, 0], UP, UP, 'a negative base with n = 0: the lobe adds 0'),
      ask([4, 0], OBLIQUE, BACK, 'huge coefficients of both signs'),
      ask([5, 0], OBLIQUE, OBLIQUE, 'tiny coefficients under a square root'),
    ],
  },
  {
    name: 'extreme-overflow',
    about: 'powers beyond the largest number are held there, before T and after it',
    texels: [3, 1], levels: 1, layers: ['lobes', 'table', 'opacity'], grid: [2, 1],
    value: {
      lobes: by_texel((t) => ({rho: 1, cx: 0, cy: 0, cz: [100, 100, 10][t], n: [200, 5000, 30][t]})),
      table: by_colour(0.5, 2, 0),
      opacity: () => 1,
    },
    queries: [
      ask([0, 0], UP, UP, 'g is held before T: half of the largest number, the largest number, and 0'),
      ask([1, 0], OBLIQUE, UP, 'the same, still farther beyond'),
      ask([2, 0], UP, UP, 'large, but nothing overflows'),
      ask([0, 0], unit([0, 0, -1]), UP, 'light from below: 0, not NaN'),
      {level: 0.5, uv: [0.1, 0.5], light: UP, view: UP, why: 'a level beyond the last: held values stay'},
    ],
  },
  {
    name: 'extreme-overflow-levels',
    about: 'held values in both blended levels',
    texels: [2, 1], layers: ['lobes'],
    value: {lobes: by_texel(() => ({rho: 1, cx: 0, cy: 0, cz: 100, n: 200}))},
    queries: [{
      level: 0.5,
      uv: [0.25, 0.5],
      light: UP,
      view: UP,
      why: 'half of the largest number twice, alpha = 1: the largest number'
    }],
  },
  {
    name: 'extreme-alpha-0',
    about: 'alpha 0 at all views, at some, and nearly',
    texels: [4, 1], layers: ['lobes', 'table', 'opacity'],
    value: {
      opacity: (level, channel, t) => {
        const k = Number(channel.slice(8));
        if (level === 1) return t === 0 ? 0 : [1, 0, 0.5, 0][k];
        if (level === 2) return 0.5;
        return [0, [1, 0, 0, 0][k], [0, 0.5, 0.5, 0][k], 2 ** -24][t];
      },
    },
    queries: [
      ask([0, 0], OBLIQUE, UP, 'alpha = 0 at all views: with a table f = 0'),
      ask([1, 0], OBLIQUE, UP, 'the three views with alpha = 0 have no effect: T of view 0'),
      ask([1, 0], OBLIQUE, unit([0.5, 0.5, 0.2]), 'only views with alpha = 0: f = 0'),
      ask([2, 0], OBLIQUE, UP, 'T is the mean of views 1 and 2'),
      ask([3, 0], OBLIQUE, UP, 'alpha of the smallest half: T is not disturbed'),
      {level: 0.5, uv: [0.1, 0.5], light: OBLIQUE, view: UP, why: 'alpha = 0 in both levels: f = 0'},
      {
        level: 1.5,
        uv: [0.1, 0.5],
        light: OBLIQUE,
        view: UP,
        why: 'alpha = 0 at the finer level: f of the coarser'
      },
      {level: 1, uv: [0.1, 0.5], light: OBLIQUE, view: UP, why: 'a whole level counts alone'},
    ],
  },
  {
    name: 'extreme-alpha-0-no-table',
    about: 'alpha 0 without a table: f of the lobes',
    texels: [2, 1], layers: ['lobes', 'opacity'],
    value: {opacity: (level) => level === 0 ? 0 : 1},
    queries: [
      ask([0, 0], OBLIQUE, UP, 'alpha = 0 without a table: f is not 0'),
      {level: 0, uv: [0.1, 0.5], light: OBLIQUE, view: UP, why: 'a whole level by uv: f is not 0 although alpha is'},
      {level: 0.5, uv: [0.1, 0.5], light: OBLIQUE, view: UP, why: 'f of level 1, which alone can be seen'},
    ],
  },
  {
    name: 'extreme-frames',
    about: 'normals tilted to the horizon and below it, tangents that are not the usual ones',
    texels: [4, 1], levels: 1, layers: {lobes: {}, frame: {precision: 'float'}},
    value: {
      frame: framed(
        (level, t) =>
          [frame_of([0.96, 0, 0.28]),
           frame_of([0.6, 0.6, -0.3]),
           {n: [0, 0, 1], t: [0, -1, 0]},
           {n: [0, 0, -1], t: [1, 0, 0]},
][t]),
    },
    queries: [
      ask([0, 0], unit([-0.6, 0, 0.5]), UP, 'light above the cloth, below the texel\'s horizon'),
      ask(
        [0, 0], unit([0.6, 0.1, 0.5]), unit([-0.6, 0.1, 0.5]),
        'view below the texel\'s horizon: the formula as it stands'),
      ask([1, 0], unit([0.6, 0.6, 0.2]), unit([0.6, 0.5, 0.2]), 'a normal that points into the cloth'),
      ask([1, 0], UP, UP, 'a normal that points into the cloth, light from above: 0'),
      ask([2, 0], OBLIQUE, BACK, 'the tangent is -y, the binormal x'),
      ask([3, 0], OBLIQUE, BACK, 'the normal is straight down: 0'),
    ],
  },
  {
    name: 'frame-not-quite-unit',
    about: 'frames 0.4 % from unit and perpendicular count as stored',
    texels: [2, 1], levels: 1, layers: {lobes: {}, frame: {precision: 'float'}},
    value: {
      frame: framed(
        (level, t) =>
          t ? {n: [0, 0, 1.00390625], t: [0.99609375, 0, 0]} : {n: [0.00390625, 0, 1], t: [1, 0, 0]})
    },
  },
  {
    name: 'scale-small',
    about: 'radiance of about 1e-8 in half precision, by a scale of the file',
    texels: [4, 2], K: 2, radianceScale: 2 ** -27,
    layers: {lobes: {precision: 'half'}, frame: {}, table: {}, opacity: {}},
  },
  {
    name: 'scale-large',
    about: 'a scale of 1e8, not a power of two: rho of 0, 1, the largest half, and too large',
    texels: [4, 1], levels: 1, K: 0, radianceScale: 123456789, layers: ['lobes', 'table'],
    value: {lobes: by_texel((t) => ({rho: [0, 1, 65504, 1e33][t]})), table: by_colour(1, 0.25, 0)},
    queries: [
      ask([0, 0], OBLIQUE, UP, 'rho = 0: f = 0'),
      ask([1, 0], OBLIQUE, UP, 'the scale itself'),
      ask([2, 0], OBLIQUE, UP, 'a large product'),
      ask([3, 0], UP, UP, 'the product with the scale overflows and is held; T = 0 gives 0'),
    ],
  },
  {
    name: 'scale-of-products',
    about: 'the scale multiplies what products give, once',
    texels: [2, 2], levels: 2, radianceScale: 0.001, layers: {products: {}, bases: {levels: [0]}},
  },
  {
    name: 'extreme-halves',
    about: 'the smallest, the largest and subnormal halves',
    texels: [3, 1], levels: 1, layers: {lobes: {precision: 'half'}, table: {}, opacity: {}},
    value: {
      lobes: by_texel((t) => ({
        rho: [2 ** -24, 65504, 2 ** -15][t], cx: 0, cy: 0, cz: [1, 2 ** -14, 0.5][t], n: [65504, 1, 2 ** -20][t],
      })),
      table: (level, channel, t) => [2 ** -24, 65504, 2 ** -16][t],
      opacity: (level, channel, t) => [2 ** -24, 1, 1 - 2 ** -11][t],
    },
    queries: [
      ask([0, 0], UP, UP, 'n = 65,504 with a base of exactly 1'),
      ask([1, 0], UP, UP, 'the largest half twice'),
      ask([2, 0], OBLIQUE, UP, 'subnormal halves'),
    ],
  },
];

// The valid fabrics with yarn itself; in the form of fabrics.mjs.

const LAYERS = ['lobes', 'yarns', 'indirect'];
const STRAIGHT = {
  stations: 1, turns: [1, 0], radius: 0.25, albedo: [0.75, 0.5, 0.25], gloss: 0, roughness: 0.5, slope: 0,
  nodes: [[0.25, -0.5, 0.5], [1.5, -0.5, 0.5]],
};

/** Members of curves that have no plies, strands, flattening and hairs: the fields from 11 on. */
const LATER = {
  plies: {count: 1, divisions: 1, shift: 0, phase: 0, groove: [0, 0, 0]},
  strands: {count: 0, pieces: 2, shift: 0, seed: 0, irregularity: 0, swells: 1},
  section: {flattening: 1},
  hairs: {count: 0, length: 0, loops: 0, radius: 0, kept: 1},
  squashed: {is: 0},
  colours: {contrast: Math.fround(0.12), change: 0},
  light: {sides: 0, lustre: 0, marl: 0},
};

/**
 * Layer members and values of curves, in the order of spec/fabric.md: with 36 fields, with 37 where a curve has the member
 * `unknown`, or with the first `fields` alone; `valuesPerStation`, undefined: no such member. With `packed` nodes are
 * rounded to its step, and functions and factors are simple numbers.
 */
export function of_curves(curves, {texels: [w, h] = [3, 2], fields = Infinity, valuesPerStation = 145, packed} = {}) {
  const steps = (list, step, straight) => {
    const whole = list.map((v) => v.map((x) => Math.round(x / step)));
    return whole.map((v, i) => v.map((x, axis) => x - (i > 0 ? whole[i - 1][axis] : 0) -
      (straight && i > 1 ? whole[i - 1][axis] - whole[i - 2][axis] : 0)));
  };
  const stored = packed ? steps : (list) => list;
  const nodes = curves.flatMap((curve) => [...stored(curve.nodes, packed?.step, true), ...stored(curve.squeezes ?? [], 1 / 64, false)]);
  const rows = curves.map((curve) => {
    const {nodes: own, stations, turns, radius, albedo, gloss, roughness, slope} = curve;
    const later = Object.entries(LATER).flatMap(([name, plain]) => Object.values({...plain, ...curve[name], ...(name === 'squashed' && curve.squeezes ? {is: 1} : {})}).flat());
    const further = 'unknown' in curve ? [curve.unknown] : [];
    return [own.length, stations, ...turns, radius, ...albedo, gloss, roughness, slope, ...later, ...further].slice(0, fields);
  });
  const by_column = (table) => table[0].flatMap((_, i) => table.map((row) => row[i]));
  const functions = Array.from({length: (packed?.functions ?? 0) * valuesPerStation}, (_, i) => 2 ** -10 * (1 + i * 7 % 11) / (1 + i / 99));
  const numbers = [...by_column(rows), ...by_column(nodes), ...functions], number = (channel, t) => Number(channel.split('.')[1]) * w * h + t;
  return {
    texels: [w, h], layers: LAYERS,
    yarns: {
      curves: curves.length,
      nodes: nodes.length,
      stations: curves.reduce((sum, {stations}) => sum + stations, 0),
      ...packed && {packed},
      fields: rows[0].length,
      valuesPerStation,
    },
    value: {
      yarns: (level, channel, t) => numbers[number(channel, t)],
      ...packed && {indirect: (level, channel, t) => number(channel, t) * 5 % 9 - 3},
    },
  };
}

/** Yarn along x, and along y, over and under each other; segments of different lengths. */
const weft = {
  ...STRAIGHT,
  stations: 3, radius: 0.2, gloss: 0.5, roughness: 0.25, slope: 0.5,
  nodes: [[0, -0.3, 0.75], [0.4, -0.32, 0.7], [0.6, -0.3, 0.55], [1.25, -0.28, 0.3], [2.2, -0.3, 0.6]],
};
const warp = {
  ...STRAIGHT,
  stations: 2, turns: [0, -1], albedo: [0.125, 0.5, 1], gloss: 0.25, roughness: 0.0625, slope: -0.25,
  nodes: [[0.5, -0.3, 0.3], [0.55, -0.8, 0.7], [0.5, -1.2, 0.5]],
};
/** Flat, with a corner at each of its four nodes. */
const ring = {
  ...STRAIGHT,
  stations: 4, turns: [0, 0], radius: 0.125, gloss: 1, roughness: 1,
  nodes: [[1.5, -0.7, 0.8], [2, -0.7, 0.8], [2, -1.1, 0.8], [1.5, -1.1, 0.7]],
};
/** Upright: the first tangent is near the z axis. */
const loop = {
  ...STRAIGHT,
  stations: 1, turns: [0, 0], gloss: 0.5, roughness: 0.005, slope: 1, radius: 0.1,
  nodes: [[0.2, -0.5, 0.3], [0.2, -0.5, 0.7], [0.6, -0.4, 1], [1, -0.4, 0.6], [0.6, -0.5, 0.2], [0.3, -0.55, 0.1]],
};

/** Plies that meet themselves as others, and that turn the other way. */
const three = {...weft, plies: {count: 3, divisions: 6, shift: 4, phase: 0.5, groove: [-0.5, 0.25, 0.125]}};
const two = {...warp, radius: 0.25, plies: {count: 2, divisions: 5, shift: -3, phase: -2.5, groove: [0.5, 0.5, 1]}};
const five = {...loop, plies: {count: 5, divisions: 3, shift: -7, phase: 3, groove: [-1, -0.25, 0]}};

/** Yarn of every kind: three that cross, and one upright. */
export const crossing = {...of_curves([weft, warp, ring, loop]), thickness: 1.125};
export const plied = {...of_curves([three, ring, five]), thickness: 1.125};

const hairs = {count: 40, length: 0.3, loops: 0.25, radius: 0.04, kept: 0.75};
const uneven = {irregularity: 0.125, swells: 4, seed: 99};

const strands = {count: 15, pieces: 6, shift: 22, seed: 4711, irregularity: 0.125, swells: 3};
export const crossing_strands = {
  ...of_curves([weft, warp, ring, loop].map((curve) => ({...curve, strands}))),
  thickness: crossing.thickness,
};

export const crossing_hairs = {
  ...of_curves([
    {...weft, hairs, strands: uneven},
    {...loop, hairs, strands: uneven},
    {...three, hairs, strands, light: {sides: 1, marl: 0.5}},
    {...five, hairs: {...hairs, loops: 0.75}, strands: {...strands, ...uneven}},
  ]),
  thickness: crossing.thickness,
};

/** Sections that lie, stand and lean; the third node has the squeeze of the second the other way. */
const lean = [[0.1, 0.5, 0.25], [0, 0.75, -0.25], [0, -0.625, 0.25], [0, 0, 0], [-0.125, 0, 0.75]];
export const squashed = {
  ...of_curves([
    {...weft, squeezes: lean, strands: {count: 20, pieces: 5, shift: -27, seed: 4711}, hairs},
    {...three, squeezes: lean, hairs, strands: uneven, light: {sides: 1}},
    {...warp, squeezes: lean.slice(0, 3)},
  ]),
  thickness: crossing.thickness,
};

export const packed = {...of_curves([three, warp], {packed: {functions: 3, step: 1 / 64}}), thickness: 1.125};

export const yarns = [
  {name: 'yarns-straight', about: 'a straight yarn without gloss, with one station', ...of_curves([STRAIGHT])},
  {
    name: 'yarns-crossing',
    about: 'yarns that cross and a ring: gloss, fibres at an angle, segments of different lengths',
    ...of_curves([weft, warp, ring]),
  },
  {
    name: 'yarns-upright',
    about: 'a loop that begins upright, with less roughness than counts; one texel, so every number has a channel',
    ...of_curves([loop], {texels: [1, 1]}),
  },
  {
    name: 'yarns-strands',
    about: 'strands of fibres that shift, one piece to a segment and many, changes of colour, and lustre',
    ...of_curves([
      {...weft, strands: {count: 20, pieces: 5, shift: -27, seed: 4711, irregularity: 0.25, swells: 3}, colours: {change: 0.5}},
      {...warp, strands: {count: 7, pieces: 300, shift: 14, seed: 2 ** 24 - 1, irregularity: 0.0625, swells: 1}, colours: {contrast: 0.375, change: 0.25}, light: {lustre: 0.75}},
      {...ring, strands: {irregularity: 0.125, swells: 40}},
    ]),
  },
  {
    name: 'yarns-hairs',
    about: 'hairs on a yarn and on plies: most with a free end, loops, and none that is thinned; bends and slopes',
    ...of_curves([
      {...weft, hairs, strands: {count: 20, pieces: 5, shift: -27, seed: 4711, irregularity: 0.25, swells: 3}},
      {...two, hairs: {...hairs, count: 90, loops: 1, kept: 1}, light: {lustre: 0.5, marl: 0.75}},
      {...loop, hairs: {...hairs, loops: 0, length: 0.5}},
    ]),
  },
  {
    name: 'yarns-uneven',
    about: 'thick and thin places of a yarn, and of plies, which also lie further out there',
    ...of_curves([
      {...weft, strands: {irregularity: Math.fround(0.3), swells: 3, seed: 5}},
      {...two, strands: {...uneven, count: 12, pieces: 9}},
      {...ring, strands: uneven},
    ]),
  },
  {
    name: 'yarns-thick',
    about: 'yarn thicker than the repeat, which goes round twice; light in single precision',
    ...of_curves([{...weft, radius: 1.5, stations: 2, turns: [-2, 1], nodes: [[0, 0, 1.5], [-1.5, 0.75, 1.75]]}]),
    mmPerRepeat: [1.5, 1],
    layers: {table: {}, opacity: {}, yarns: {}, indirect: {precision: 'float'}},
  },
  {
    name: 'yarns-plies',
    about: 'yarns of three and of two plies beside a round one; plies that go on as others, and in both senses',
    ...of_curves([three, two, ring]),
  },
  {
    name: 'yarns-plies-upright',
    about: 'five plies about an axis that begins upright; light in single precision',
    ...of_curves([five]),
    layers: {table: {}, opacity: {}, yarns: {}, indirect: {precision: 'float'}},
  },
  {
    name: 'yarns-flat',
    about: 'flat yarns that cross, a ring, a loop that is less flat where it stands steeply; strands, hairs, thick places',
    ...of_curves([
      {...weft, section: {flattening: 0.625}, strands: {count: 20, pieces: 5, shift: -27, seed: 4711}},
      {...warp, section: {flattening: 0.3125}},
      {...ring, section: {flattening: 0.5}, hairs, strands: uneven},
      {...loop, section: {flattening: 0.375}, hairs: {...hairs, loops: 0.75}},
    ]),
  },
  {
    name: 'yarns-flat-plies',
    about: 'plies about flat axes, of which one has hairs, beside a round yarn; light in single precision',
    ...of_curves([{...three, section: {flattening: 0.5}, hairs, strands: uneven}, {...five, section: {flattening: 0.75}}, warp]),
    layers: {table: {}, opacity: {}, yarns: {}, indirect: {precision: 'float'}},
  },
  {
    name: 'yarns-squashed',
    about: 'squashed yarn, with and without plies, strands and hairs',
    ...squashed,
  },
  {
    name: 'yarns-more-fields',
    about: 'version 4.9, and a field of curves that a reader does not know',
    ...of_curves([{...three, hairs, unknown: 7}, {...two, unknown: 7}], {valuesPerStation: 150}),
    text: (text) => {
      text.version = [4, 9];
    },
  },
  {
    name: 'yarns-fewer-fields',
    about: 'curves without the fields from 18 on: no strands, no hairs, a round section',
    ...of_curves([three, two], {fields: 18, valuesPerStation: undefined}),
  },
  {name: 'yarns-packed', about: 'version 5.0: packed curves with and without plies, light of three functions', ...packed},
  {
    name: 'yarns-packed-squashed',
    about: 'packed squeezes, of which one curve has none; one function, fewer values of a station; factors in single precision',
    ...of_curves([{...weft, squeezes: lean}, ring, {...warp, squeezes: lean.slice(0, 3)}], {valuesPerStation: 140, packed: {functions: 1, step: 0.01}}),
    thickness: crossing.thickness,
    layers: {table: {}, opacity: {}, yarns: {}, indirect: {precision: 'float'}},
  },
  {
    name: 'yarns-partial',
    about: 'yarn beside products, of no other layer than these',
    ...of_curves([weft, warp]),
    layers: ['products', 'bases', 'yarns', 'indirect'], referenceHeight: 0.25,
  },
];

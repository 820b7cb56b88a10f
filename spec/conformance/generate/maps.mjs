// The valid fabrics whose map arranges the stitches of their yarn; in the form of fabrics.mjs.
import {of_curves} from './yarns.mjs';

/** Stitches of 1 mm, 3 x 2 of them in the yarn's own repeat. */
const STITCHES = [[0, 1, 2], [3, 4, 5]];
const YARN = {stations: 6, radius: 0.1875, gloss: 0.25, roughness: 0.25, slope: 0.25};

/**
 * Nodes of a line of stitches, level and straight where it crosses their borders: per stitch the way across, which may hang over
 * the line, and up of two others.
 */
const nodes_of = (stitches, line, along_v) => stitches.flatMap(([across, up, later, later_up], i) =>
  [[0, 0, 0], [0.125, 0, 0], [0.375, across, up], [0.625, later, later_up], [0.875, 0, 0]].map(([s, y, z]) =>
    along_v ? [line + 0.5 + y, -i - s, 0.5 + z] : [i + s, y - line - 0.5, 0.5 + z]));

const rows = [
  [[0.125, 0.25, -0.75, 0.125], [0, -0.25, 0.125, 0.25], [-0.125, 0, -0.125, 0.25]],
  [[0, 0.25, 0, 0.25], [0.75, 0, 0, -0.25], [-0.125, -0.125, 0.625, 0.125]],
].map((stitches, row) => ({
  ...YARN, turns: [1, 0], albedo: [[0.75, 0.5, 0.25], [0.125, 0.25, 0.75]][row], nodes: nodes_of(stitches, row, false),
}));
const hairs = {count: 30, length: 0.25, loops: 0.25, radius: 0.03125, kept: 0.75};

/** Over and under, of two rows and three columns. */
const UP = [0, 0.25, 0, 0.25], DOWN = [0, -0.25, 0, -0.25], OVER = [[UP, DOWN, UP], [DOWN, UP, UP]];
const weave = [
  ...OVER.map((stitches, row) => ({...YARN, turns: [1, 0], albedo: [0.75, 0.25, 0.25 * row], nodes: nodes_of(stitches, row, false)})),
  ...[0, 1, 2].map((column) => ({
    ...YARN, stations: 4, turns: [0, -1], albedo: [0.25, 0.25 * column, 0.5],
    nodes: nodes_of(OVER.map((stitches) => stitches[column] === UP ? DOWN : UP), column, true),
  })),
];

/** A cloth of `map`, rows of numbers of stitches, of curves in these lines. */
export function of_map(curves, lines, map, options) {
  const of = of_curves(curves, options), size = [map[0].length, map.length], numbers = [...lines, ...map.flat()], [w, h] = of.texels;
  return {
    ...of,
    levels: 1, layers: ['opacity', 'products', 'bases', 'yarns', 'indirect', 'map'], map: {size}, mmPerRepeat: size, thickness: 1,
    value: {...of.value, map: (level, channel, t) => numbers[Number(channel.split('.')[1]) * w * h + t]},
  };
}

export const mapped = of_map(rows, [0, 1], STITCHES);
export const maps = [
  {
    ...of_map(
      [{...rows[0], hairs, colours: {change: 0.25}}, rows[1]], [0, 1],
      [[0, 4, 2, 3, 1, 5], [5, 5, 0, 1, 4, 4], [3, 2, 2, 2, 0, 1], [1, 0, 5, 3, 3, 2], [4, 1, 3, 0, 2, 5]]),
    name: 'yarns-map',
    about: 'version 5.1: 6 x 5 stitches of 3 x 2; hairs, and rows that differ; levels whose texels do not halve',
  },
  {
    ...of_map(
      weave, [0, 1, 0, 1, 2], [[0, 1, 2, 5], [3, 4, 4, 0], [2, 2, 1, 3]],
      {packed: {functions: 2, step: 1 / 64}}),
    name: 'yarns-map-weave',
    about: 'a weave of 4 x 3 crossings of 3 x 2, packed, in another order, and from behind',
    sides: {
      'back': {layers: ['opacity', 'products', 'bases']},
      'through': {layers: ['products', 'bases', 'yarns', 'indirect']},
    },
  },
];

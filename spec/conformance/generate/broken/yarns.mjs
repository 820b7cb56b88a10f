// Faults in the layers of yarn.
import {pack_values} from '../../reference/exr_write.mjs';
import {part_of} from '../make.mjs';
import {mapped} from '../maps.mjs';
import {of_curves, packed} from '../yarns.mjs';
import {all, ask, base, broken, lobe, members_of, others, set} from './common.mjs';

const curve = {
  stations: 1, turns: [1, 0], radius: 0.25, albedo: [0.75, 0.5, 0.25], gloss: 0.25, roughness: 0.5, slope: 0,
  nodes: [[0.25, -0.5, 0.5], [1.5, -0.5, 0.5]],
};
const CURVES = 2, FIELDS = 36, NODES = 4, SQUEEZES = 2;
const NEXT = [[0.25, -1, 0.5], [1.25, -1, 0.75]];
/** A fixture of two curves, curve 1 with further members. */
const two_curves = (more = {}) => {
  const of = of_curves([curve, {...curve, nodes: NEXT, ...more}]);
  return {...base, ...of, value: {...of.value, lobes: lobe({rho: 0.1})}};
};
const sound = two_curves();

const YARNS = '/layers/yarns', INDIRECT = '/layers/indirect';
const without = (layer) => all(set(`/layers/${layer}`, undefined), set(`/digests/${layer}`, undefined));
const members = members_of(sound, [
  ['yarns-without-indirect', YARNS, without('indirect')],
  ['indirect-without-yarns', INDIRECT, without('yarns')],
  ...['curves', 'nodes', 'stations', 'fields'].flatMap((name) => [
    [`yarns-${name}-missing`, `${YARNS}/${name}`, undefined],
    [`yarns-${name}-none`, `${YARNS}/${name}`, 0],
    [`yarns-${name}-too-many`, `${YARNS}/${name}`, 2 ** 20 + 1],
  ]),
  ['yarns-fields-too-few', `${YARNS}/fields`, 10],
  ['yarns-values-per-station-too-few', `${YARNS}/valuesPerStation`, 134],
  ['yarns-values-per-station-too-many', `${YARNS}/valuesPerStation`, 257],
  ['yarns-one-node', `${YARNS}/nodes`, 1],
  ['yarns-of-level-1-alone', `${YARNS}/levels`, [1]],
  ['indirect-of-level-1-alone', `${INDIRECT}/levels`, [1]],
]);

const channels = [
  ['more-nodes-than-channels', '400 nodes, channels for 4', `yarns.${Math.ceil((FIELDS * CURVES + 3 * NODES) / 6)}`, `${YARNS}/nodes`, 400],
  ['more-stations-than-channels', '3 stations, channels for 2', 'indirect.49', `${YARNS}/stations`, 3],
].map(([what, about, place, pointer, n]) => broken('FABRIC_CHANNEL', what, about, place, {text: set(pointer, n), ...others}, sound));

/** Writes a number of a spread layer; the digests follow. */
const written = (layer, i, number) => (parts, {texels: [w, h]}) => {
  const part = part_of(parts, layer), name = `${layer}.${Math.floor(i / (w * h))}`;
  const {type} = part.channels.find((channel) => channel.name === name);
  pack_values([number], type).copy(part.levels[0].values.get(name), i % (w * h) * (type === 'half' ? 2 : 4));
};
const of_node = (n, axis) => FIELDS * CURVES + axis * NODES + n;
/** A field of curve 1. */
const field = (f) => CURVES * f + 1;
const place_of = (layer, i) => `${layer}/level 0/${layer}.${Math.floor(i / 6)}`;

const not_finite = [
  ['node-nan', 'yarns', of_node(2, 1), NaN],
  ['radius-infinite', 'yarns', field(4), Infinity],
  ['indirect-nan', 'indirect', 7, NaN],
].map(([what, layer, i, number]) => broken(
  'FABRIC_NOT_FINITE', what, `a number of ${layer} is ${number}`, place_of(layer, i), {before: written(layer, i, number)}, sound));

const malformed = (from, what, about, place, ...changes) => broken(
  'FABRIC_MALFORMED', `yarn-${what}`, about, place,
  {before: (...of) => changes.forEach(([i, number]) => written('yarns', i, number)(...of)), evaluate: ask(0)}, from);
const plied = two_curves({plies: {count: 2, divisions: 4}}), stranded = two_curves({strands: {count: 9}});
const hairy = two_curves({hairs: {count: 3, length: 0.25, radius: 0.01}}), flat = two_curves({section: {flattening: 0.5}});
const squashed = two_curves({squeezes: [[0, 0.5, 0], [0, 0.5, 0]]});
/** Another value of a field of curve 1: [fixture, what, about, field, number]. */
const fields = [
  [sound, 'nodes-too-many', 'a curve has more nodes than there are', 0, 3],
  [sound, 'one-node', 'a curve of one node', 0, 1],
  [sound, 'nodes-fraction', 'a curve of 2.5 nodes', 0, 2.5],
  [sound, 'stations-none', 'a curve without stations', 1, 0],
  [sound, 'turns-fraction', 'half a turn', 2, 0.5],
  [sound, 'turns-too-many', '65 turns', 3, -65],
  [sound, 'radius-0', 'a radius of 0', 4, 0],
  [sound, 'radius-too-large', 'a radius of more than two repeats', 4, 2.625],
  [sound, 'albedo-above-1', 'a fibre that reflects more than it receives', 6, 1.5],
  [sound, 'gloss-negative', 'a negative gloss', 8, -0.25],
  [sound, 'roughness-0', 'a roughness of 0', 9, 0],
  [plied, 'plies-none', 'a yarn of no plies', 11, 0],
  [plied, 'plies-too-many', 'a yarn of nine plies', 11, 9],
  [plied, 'plies-fraction', 'a yarn of 2.5 plies', 11, 2.5],
  [plied, 'divisions-none', 'segments in no parts', 12, 0],
  [plied, 'divisions-too-many', 'segments in 65 parts', 12, 65],
  [plied, 'shift-fraction', 'plies that shift by half a ply', 13, 0.5],
  [plied, 'shift-too-many', 'plies that shift by 4097 plies', 13, -4097],
  [plied, 'phase-of-a-turn', 'a phase above pi', 14, 6.25],
  [plied, 'groove-too-deep', 'a groove above 4', 16, 4.5],
  [stranded, 'strands-too-many', 'a yarn of 1025 strands', 18, -1025],
  [stranded, 'strands-fraction', 'a yarn of 2.5 strands', 18, 2.5],
  [stranded, 'one-piece', 'strands of one piece', 19, 1],
  [stranded, 'pieces-too-many', 'strands of 32769 pieces', 19, 32769],
  [stranded, 'strands-shift-fraction', 'strands that shift by half a strand', 20, 0.5],
  [stranded, 'strands-shift-too-many', 'strands that shift by 32769 strands', 20, 32769],
  [stranded, 'seed-negative', 'a negative seed', 21, -1],
  [stranded, 'seed-too-large', 'a seed of 25 bits', 21, 2 ** 24],
  [stranded, 'irregularity-too-large', 'a yarn that changes its colour by half', 22, 0.5],
  [stranded, 'change-too-large', 'rows that differ too much', 32, 0.75],
  [plied, 'marl-too-large', 'plies darker than black', 35, 1],
  [sound, 'lustre-too-large', 'a fibre that is a mirror', 34, 1],
  [plied, 'sides-half', 'light of half a side', 33, 0.5],
  [stranded, 'contrast-too-large', 'strands whose colours differ by half', 31, 0.5],
  [stranded, 'swells-none', 'no swell', 23, 0],
  [flat, 'flattening-too-small', 'a yarn four times as wide as thick', 24, 0.25],
  [flat, 'flattening-above-1', 'a yarn that is thicker than wide', 24, 1.5],
  [squashed, 'squashed-half', 'yarn that is half squashed', 30, 0.5],
  [hairy, 'hairs-too-many', '100,001 hairs', 25, 100001],
  [hairy, 'hairs-fraction', 'half a hair', 25, 0.5],
  [hairy, 'hairs-negative-length', 'hairs of a negative length', 26, -0.25],
  [hairy, 'hairs-without-length', 'hairs without length', 26, 0],
  [hairy, 'loops-too-many', 'more loops than hairs', 27, 1.5],
  [hairy, 'hairs-without-radius', 'hairs without a radius', 28, 0],
  [hairy, 'hairs-kept-too-much', 'hairs that stop more than the light on them', 29, 1.25],
].map(([from, what, about, f, number]) => malformed(from, what, about, 'yarns/curve 1', [field(f), number]));

/** A ring so narrow that a ply in its middle stands still for one phase. */
const ring = {turns: [0, 0], radius: 0.5, nodes: [[1.25, -1, 0.5], [1, -0.75, 0.5], [0.75, -1, 0.5], [1, -1.25, 0.5]]};
const others_of_yarn = [
  malformed(sound, 'stations-too-many', 'the curves have more stations than the layer', 'yarns/light', [field(1), 2]),
  malformed(sound, 'node-far-away', 'a node more than 64 repeats away', 'yarns/node 2', [of_node(2, 0), 161]),
  malformed(
    squashed, 'squeeze-too-large', 'a section that is squeezed to a tenth', 'yarns/curve 1', [of_node(5, 2) + 2 * SQUEEZES, 0.875]),
  malformed(
    sound, 'node-too-high', 'a node more than 64 of the longer repeat high', 'yarns/node 3', [of_node(3, 2), 161]),
  malformed(sound, 'segment-without-length', 'two nodes at one place', 'yarns/node 0', [of_node(1, 0), 0.25]),
  malformed(
    sound, 'last-segment-without-length', 'the last node is where the curve begins again', 'yarns/node 3', [of_node(3, 0), 2.75],
    [of_node(3, 2), 0.5]),
  malformed(
    two_curves({...ring, plies: {count: 2}}), 'ply-at-one-place', 'all nodes of a ply are at one place', 'yarns/curve 1',
    [field(14), -1.5707963705062866]),
  malformed(
    hairy, 'hairs-too-dense', 'hairs that cover the cell more than 1024 times', 'yarns/curve 1', [field(25), 100000],
    [field(26), 2.5]),
  malformed(
    two_curves({nodes: [...NEXT, [2, -1, 0.5]]}), 'nodes-too-few', 'the curves have fewer nodes than the layer', 'yarns/nodes',
    [field(0), 2]),
];

const packing = [['functions', 0], ['functions', 257], ['step', 0], ['step', 'fine']].map(([name, value]) => broken(
  'FABRIC_MEMBER', `packed-${name}-${value}`, `packed yarn whose ${name} is ${value}`, `${YARNS}/packed`,
  {text: set(`${YARNS}/packed/${name}`, value), ...others}, {...base, ...packed, value: {...packed.value, lobes: lobe({rho: 0.1})}}));

/** A map of 3 x 2 stitches of the same number, and numbers of the layer `map`: of two curves, then of stitches. */
const MAP = '/layers/map', in_map = (i, number) => ({before: written('map', i, number)});
const of_maps = [
  ...members_of(mapped, [
    ['map-without-products', MAP, without('products')],
    ['map-without-yarns', MAP, all(without('yarns'), without('indirect'))],
    ['map-without-size', `${MAP}/size`, undefined],
    ['map-of-no-stitches', `${MAP}/size`, [0, 2]],
    ['map-of-2-to-31-stitches', `${MAP}/size`, [2 ** 15, 2 ** 16]],
    ['map-of-level-1', `${MAP}/levels`, [1]],
  ]),
  ...['lobes', 'frame', 'table', 'light'].map((layer) => broken(
    'FABRIC_MEMBER', `map-beside-${layer}`, `a map and the layer ${layer}`, `/layers/${layer}`, others, {...mapped, layers: [...mapped.layers, layer]})),
  broken('FABRIC_CHANNEL', 'map-larger-than-its-part', 'a map of more stitches than its part has', 'map/map.4', {text: set(`${MAP}/size`, [5, 5]), ...others}, mapped),
  broken('FABRIC_NOT_FINITE', 'map-nan', 'a map with a NaN', 'map/level 0/map.0', in_map(2, NaN), mapped),
  ...[
    ['stitch-missing', 'a map that shows stitch 6 of 6', 4, 6], ['stitch-negative', 'a map that shows stitch -1', 4, -1],
    ['stitch-fraction', 'a map that shows half a stitch', 4, 0.5], ['line-missing', 'a curve in row 2 of 2', 1, 2],
    ['line-fraction', 'a curve in half a row', 0, 0.5],
  ].map(([what, about, i, number]) => broken('FABRIC_MALFORMED', `map-${what}`, about, 'yarns/map', in_map(i, number), mapped)),
];

export const broken_yarns = [...members, ...channels, ...not_finite, ...fields, ...others_of_yarn, ...packing, ...of_maps];

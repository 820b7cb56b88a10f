// What is broken in the layers of yarn.
import {pack_values} from '../../reference/exr_write.mjs';
import {part_of} from '../make.mjs';
import {of_curves} from '../yarns.mjs';
import {all, ask, base, broken, lobe, others, set} from './common.mjs';

const curve = {
  stations: 1,
  turns: [1, 0],
  radius: 0.25,
  albedo: [0.75, 0.5, 0.25],
  gloss: 0.25,
  roughness: 0.5,
  slope: 0,
  nodes: [[0.25, -0.5, 0.5], [1.5, -0.5, 0.5]],
};
const CURVES = 2, FIELDS = 11, NODES = 4;
const curves = of_curves([curve, {...curve, nodes: [[0.25, -1, 0.5], [1.25, -1, 0.75]]}]);
const sound = {...base, ...curves, value: {...curves.value, lobes: lobe({rho: 0.1})}};

const YARNS = '/layers/yarns', INDIRECT = '/layers/indirect';
const member = (what, pointer, value, place = pointer) => broken(
  'FABRIC_MEMBER', what, `${pointer}: ${what.replaceAll('-', ' ')}`, place,
  {text: typeof value === 'function' ? value : set(pointer, value), ...others}, sound);
const without = (layer) => all(set(`/layers/${layer}`, undefined), set(`/digests/${layer}`, undefined));
const members = [
  member('yarns-without-indirect', YARNS, without('indirect')),
  member('indirect-without-yarns', INDIRECT, without('yarns')),
  ...['curves', 'nodes', 'stations'].flatMap((name) => [
    member(`yarns-${name}-missing`, `${YARNS}/${name}`, undefined),
    member(`yarns-${name}-none`, `${YARNS}/${name}`, 0),
    member(`yarns-${name}-too-many`, `${YARNS}/${name}`, 2 ** 20 + 1),
  ]),
  member('yarns-fields-too-few', `${YARNS}/fields`, 10),
  member('yarns-fields-too-many', `${YARNS}/fields`, 65),
  member('yarns-one-node', `${YARNS}/nodes`, 1),
  member('yarns-of-level-1-alone', `${YARNS}/levels`, [1]),
  member('indirect-of-level-1-alone', `${INDIRECT}/levels`, [1]),
];

const channels = [
  broken('FABRIC_CHANNEL', 'more-nodes-than-channels', '40 nodes, channels for 4', 'yarns.7', {
    text: set(`${YARNS}/nodes`, 40),
    ...others,
  }, sound),
  broken('FABRIC_CHANNEL', 'more-stations-than-channels', '3 stations, channels for 2', 'indirect.45', {
    text: set(`${YARNS}/stations`, 3),
    ...others,
  }, sound),
];

/** Writes a number of a spread layer; the digests follow. */
const written = (layer, i, number) => (parts, {texels: [w, h]}) => {
  const part = part_of(parts, layer), name = `${layer}.${Math.floor(i / (w * h))}`;
  const {type} = part.channels.find((channel) => channel.name === name);
  pack_values([number], type).copy(part.levels[0].values.get(name), i % (w * h) * (type === 'half' ? 2 : 4));
};
const of_node = (n, axis) => FIELDS * CURVES + axis * NODES + n;
const not_finite = (what, layer, i, number, place) => broken(
  'FABRIC_NOT_FINITE', what, `a number of ${layer} is ${number}`, place,
  {before: written(layer, i, number)}, sound);
const malformed = (what, about, place, ...changes) => broken(
  'FABRIC_MALFORMED', `yarn-${what}`, about, place,
  {before: (...of) => changes.forEach(([i, number]) => written('yarns', i, number)(...of)), evaluate: ask(0)}, sound);
/** A field of curve 1. */
const field = (f) => CURVES * f + 1;

const values = [
  not_finite('node-nan', 'yarns', of_node(2, 1), NaN, 'yarns/level 0/yarns.4'),
  not_finite('radius-infinite', 'yarns', field(4), Infinity, 'yarns/level 0/yarns.1'),
  not_finite('indirect-nan', 'indirect', 7, NaN, 'indirect/level 0/indirect.1'),
  malformed('nodes-too-many', 'a curve has more nodes than there are', 'yarns/curve 1', [field(0), 3]),
  malformed('one-node', 'a curve of one node', 'yarns/curve 1', [field(0), 1]),
  malformed('nodes-fraction', 'a curve of 2.5 nodes', 'yarns/curve 1', [field(0), 2.5]),
  malformed('stations-none', 'a curve without stations', 'yarns/curve 1', [field(1), 0]),
  malformed('stations-too-many', 'the curves have more stations than there are', 'yarns/light', [field(1), 2]),
  malformed('turns-fraction', 'half a turn', 'yarns/curve 1', [field(2), 0.5]),
  malformed('turns-too-many', '65 turns', 'yarns/curve 1', [field(3), -65]),
  malformed('radius-0', 'a radius of 0', 'yarns/curve 1', [field(4), 0]),
  malformed('radius-too-large', 'a radius of more than two repeats', 'yarns/curve 1', [field(4), 2.625]),
  malformed('albedo-above-1', 'a fibre that reflects more than it gets', 'yarns/curve 1', [field(6), 1.5]),
  malformed('gloss-negative', 'a negative gloss', 'yarns/curve 1', [field(8), -0.25]),
  malformed('roughness-0', 'a roughness of 0', 'yarns/curve 1', [field(9), 0]),
  malformed('node-far-away', 'a node more than 64 repeats away', 'yarns/node 2', [of_node(2, 0), 161]),
  malformed('node-too-high', 'a node more than 64 of the longer repeat high', 'yarns/node 3', [of_node(3, 2), 161]),
  malformed('segment-without-length', 'two nodes at one place', 'yarns/node 0', [of_node(1, 0), 0.25]),
  malformed('last-segment-without-length', 'the last node is where the curve begins again', 'yarns/node 3',
            [of_node(3, 0), 2.75], [of_node(3, 2), 0.5]),
];

/** Two plies on curve 1: [what, about, field, number]. */
const plied = of_curves([curve, {...curve, plies: {count: 2, divisions: 4}, nodes: [[0.25, -1, 0.5], [1.25, -1, 0.75]]}]);
const plies = [
  ['plies-none', 'a yarn of no plies', 11, 0],
  ['plies-too-many', 'a yarn of nine plies', 11, 9],
  ['plies-fraction', 'a yarn of 2.5 plies', 11, 2.5],
  ['divisions-none', 'segments in no parts', 12, 0],
  ['divisions-too-many', 'segments in 65 parts', 12, 65],
  ['shift-fraction', 'plies that shift by half a ply', 13, 0.5],
  ['shift-too-many', 'plies that shift by 4097 plies', 13, -4097],
  ['phase-of-a-turn', 'a phase above pi', 14, 6.25],
  ['groove-too-deep', 'a groove above 4', 16, 4.5],
].map(([what, about, f, number]) => broken('FABRIC_MALFORMED', `yarn-${what}`, about, 'yarns/curve 1', {
  before: written('yarns', field(f) + (f < FIELDS ? 0 : 3 * NODES), number),
  evaluate: ask(0),
}, {...sound, ...plied, value: {...plied.value, lobes: lobe({rho: 0.1})}}));

/** A ring so narrow that a ply in its middle stands still; the phase decides which. */
const ring = {...curve, turns: [0, 0], radius: 0.5, nodes: [[1.25, -1, 0.5], [1, -0.75, 0.5], [0.75, -1, 0.5], [1, -1.25, 0.5]]};
const narrow = of_curves([curve, {...ring, plies: {count: 2}}]);
const still = broken(
  'FABRIC_MALFORMED', 'yarn-ply-at-one-place', 'all nodes of a ply are at one place', 'yarns/curve 1',
  {before: written('yarns', field(14) + 3 * 6, -1.5707963705062866)},
  {...sound, ...narrow, value: {...narrow.value, lobes: sound.value.lobes}});
/** Strands on curve 1, likewise. */
const stranded = of_curves([curve, {...curve, strands: {count: 9}, nodes: [[0.25, -1, 0.5], [1.25, -1, 0.75]]}]);
const strands = [
  ['strands-too-many', 'a yarn of 1025 strands', 18, -1025],
  ['strands-fraction', 'a yarn of 2.5 strands', 18, 2.5],
  ['one-piece', 'strands of one piece', 19, 1],
  ['pieces-too-many', 'strands of 32769 pieces', 19, 32769],
  ['strands-shift-fraction', 'strands that shift by half a strand', 20, 0.5],
  ['strands-shift-too-many', 'strands that shift by 32769 strands', 20, 32769],
  ['seed-negative', 'a negative seed', 21, -1],
  ['seed-too-large', 'a seed of 25 bits', 21, 2 ** 24],
  ['irregularity-too-large', 'a yarn that changes its colour by half', 22, 0.5],
  ['swells-none', 'no swell', 23, 0],
].map(([what, about, f, number]) => broken('FABRIC_MALFORMED', `yarn-${what}`, about, 'yarns/curve 1', {
  before: written('yarns', field(f) + 3 * NODES, number),
  evaluate: ask(0),
}, {...sound, ...stranded, value: {...stranded.value, lobes: lobe({rho: 0.1})}}));

/** Hairs on curve 1, likewise. */
const hairy = of_curves([
  curve,
  {...curve, hairs: {count: 3, length: 0.25, radius: 0.01}, nodes: [[0.25, -1, 0.5], [1.25, -1, 0.75]]},
]);
const hairs = [
  ['hairs-too-many', '100,001 hairs', 25, 100001],
  ['hairs-fraction', 'half a hair', 25, 0.5],
  ['hairs-negative-length', 'hairs of a negative length', 26, -0.25],
  ['hairs-without-length', 'hairs without length', 26, 0],
  ['loops-too-many', 'more loops than hairs', 27, 1.5],
  ['hairs-without-radius', 'hairs without a radius', 28, 0],
  ['hairs-kept-too-much', 'hairs that stop more than the light on them', 29, 1.25],
].map(([what, about, f, number]) => broken('FABRIC_MALFORMED', `yarn-${what}`, about, 'yarns/curve 1', {
  before: written('yarns', field(f) + 3 * NODES, number),
  evaluate: ask(0),
}, {...sound, ...hairy, value: {...hairy.value, lobes: lobe({rho: 0.1})}}));
/** Flat yarn on curve 1, likewise. */
const flat = of_curves([curve, {...curve, section: {flattening: 0.5}, nodes: [[0.25, -1, 0.5], [1.25, -1, 0.75]]}]);
const sections = [
  ['flattening-too-small', 'a yarn four times as wide as thick', 24, 0.25],
  ['flattening-above-1', 'a yarn that is thicker than wide', 24, 1.5],
].map(([what, about, f, number]) => broken('FABRIC_MALFORMED', `yarn-${what}`, about, 'yarns/curve 1', {
  before: written('yarns', field(f) + 3 * NODES, number),
  evaluate: ask(0),
}, {...sound, ...flat, value: {...flat.value, lobes: lobe({rho: 0.1})}}));

/** A node more than the curves have, which there are values for. */
const one_more = of_curves([curve, {...curve, nodes: [...curve.nodes, [2, -1, 0.5]]}]);
const counts = broken(
  'FABRIC_MALFORMED', 'yarn-nodes-too-few', 'the curves have fewer nodes than there are', 'yarns/nodes',
  {before: written('yarns', field(0), 2)},
  {...sound, ...one_more, value: {...one_more.value, lobes: sound.value.lobes}});

export const broken_yarns = [...members, ...channels, ...values, ...plies, still, ...strands, ...sections, ...hairs, counts];

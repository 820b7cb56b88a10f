// Faults of light tables, products and their bases, and of other sides than the front.
import {pack_values} from '../../reference/exr_write.mjs';
import {part_of} from '../make.mjs';
import {all, ask, base, broken, drop_channel, everywhere, lobe, members_of, others, set} from './common.mjs';

/** Without a fault. */
const sound = {
  ...base,
  layers: ['lobes', 'light', 'products', 'bases'], light_grid: [1, 2], functions: [1, 2],
  value: {lobes: lobe({rho: 0.1}), light: everywhere(0.5), products: everywhere(0.25), bases: everywhere(0.25)},
};
const PAIRS = '/layers/products/pairs', FUNCTIONS = '/layers/bases/functions';
const missing = undefined;

const members = members_of(sound, [
  ['pairs-missing', PAIRS, missing],
  ['pairs-object', PAIRS, {}],
  ['pairs-of-too-few-levels', PAIRS, [[[0, 0], [1, 1]]]],
  ['pairs-of-too-many-levels', PAIRS, [[[0, 0], [1, 1]], [[0, 0]], [[0, 0]]]],
  ['pairs-of-a-level-number', PAIRS, [[[0, 0], [1, 1]], 0]],
  ['pairs-of-a-level-empty', PAIRS, [[[0, 0], [1, 1]], []]],
  ['pairs-of-a-level-too-many', PAIRS, [Array(257).fill([0, 0]), [[0, 0]]]],
  ['pair-number', PAIRS, [[0, [1, 1]], [[0, 0], [1, 1]]]],
  ['pair-of-one-number', PAIRS, [[[0], [1, 1]], [[0, 0], [1, 1]]]],
  ['pair-of-three-numbers', PAIRS, [[[0, 0, 0], [1, 1]], [[0, 0], [1, 1]]]],
  ['pair-fraction', PAIRS, [[[0, 0.5], [1, 1]], [[0, 0], [1, 1]]]],
  ['pair-negative', PAIRS, [[[0, -1], [1, 1]], [[0, 0], [1, 1]]]],
  ['pair-of-no-function-of-the-view', PAIRS, [[[0, 0], [2, 1]], [[0, 0], [1, 1]]]],
  ['pair-of-no-function-of-the-light', PAIRS, [[[0, 0], [1, 1]], [[0, 0], [1, 2]]]],
  ['products-without-bases', '/layers/products', all(set('/layers/bases', missing), set('/digests/bases', missing))],
  [
    'bases-of-level-1-too', '/layers/bases/levels',
    all(set('/layers/bases/levels', [0, 1]), (text) => text.digests.bases.push(text.digests.bases[0]))
  ],
  ['bases-of-level-1-alone', '/layers/bases/levels', [1]],
  ['functions-missing', FUNCTIONS, missing],
  ['functions-array', FUNCTIONS, [1, 2]],
  ['functions-of-the-view-missing', `${FUNCTIONS}/views`, missing],
  ['functions-of-the-view-negative', `${FUNCTIONS}/views`, -1],
  ['functions-of-the-view-too-many', `${FUNCTIONS}/views`, 257],
  ['functions-of-the-light-missing', `${FUNCTIONS}/lights`, missing],
  ['functions-of-the-light-none', `${FUNCTIONS}/lights`, 0],
  ['functions-of-the-light-too-many', `${FUNCTIONS}/lights`, 257],
  ['functions-of-the-light-fraction', `${FUNCTIONS}/lights`, 1.5],
  ['lights-missing', '/lights', missing],
  ['lights-missing-of-bases-alone', '/lights', missing, {...others, layers: ['lobes', 'bases']}],
  ['lights-array', '/lights', [1, 2]],
  ['lights-layout-missing', '/lights/layout', missing],
  ['lights-columns-missing', '/lights/columns', missing],
  ['lights-columns-none', '/lights/columns', 0],
  ['lights-rows-fraction', '/lights/rows', 2.5],
  ['lights-too-many', '/lights', {layout: 'equal-area', columns: 65, rows: 64}],
]).map((fixture) => ({...fixture, issues: fixture.issues.map(({code, place}) => ({code, place: place.replace(/(functions)\/.*/, '$1')}))}));

const channels = [
  ...['light.0001.green', 'products.1', 'products.0', 'bases.2'].map(
    (name) => broken(
      'FABRIC_CHANNEL', `missing-${name.replaceAll('.', '-')}`, `the channel ${name} is missing`, name,
      {before: drop_channel(name)}, sound)),
  ...[
    ['more-lights-than-channels', '1 x 3 lights, channels for two', 'light.0002', set('/lights/rows', 3)],
    [
      'more-products-than-channels', 'a third product, channels for two', 'products.2',
      (text) => text.layers.products.pairs[1].push([0, 1])
    ],
    [
      'more-functions-than-channels', '4 functions of the light, channels for 2', 'bases.3',
      set(`${FUNCTIONS}/lights`, 4)
    ],
  ].map(([what, about, place, text]) => broken('FABRIC_CHANNEL', what, about, place, {text, ...others}, sound)),
  broken('FABRIC_CHANNEL', 'millions-of-channels', 'functions that need four million channels', 'bases', {
    texels: [1, 1],
    text: all(
      set(FUNCTIONS, {views: 256, lights: 256}),
      ...['/views', '/lights'].map((grid) => set(grid, {layout: 'equal-area', columns: 64, rows: 64}))),
    ...others,
  }, {...sound, layers: ['lobes', 'products', 'bases']}),
];

/** One number of a channel, at texel (1, 0) of level 0 or (0, 0) of level 1; the digests follow. */
const not_finite = ([what, channel, number, level = 0]) => {
  const layer = channel.split('.')[0];
  return broken(
    'FABRIC_NOT_FINITE', what, `${channel} is ${number} at a texel`, `${layer}/level ${level}/${channel}`, {
      before: (parts) => pack_values([number], 'half')
                           .copy(part_of(parts, layer).levels[level].values.get(channel), level === 0 ? 2 : 0),
      evaluate: ask(level),
    },
    sound);
};
const values = [
  ['light-negative', 'light.0001.red', -0.25],
  ['light-nan', 'light.0000.blue', NaN],
  ['light-infinite', 'light.0001.green', Infinity],
  ['light-negative-at-a-coarse-level', 'light.0000.red', -0.25, 1],
  ['product-nan', 'products.1', NaN],
  ['product-infinite', 'products.0', Infinity],
  ['base-nan', 'bases.0', NaN],
  ['base-infinite', 'bases.1', -Infinity],
].map(not_finite);

const digests = ['light', 'products', 'bases'].map((layer) => broken(
  'FABRIC_DIGEST', `pixels-of-${layer}`, `a number of ${layer} was changed after the digest was made`, `${layer}/level 0`, {
    after: (parts) => {
      const part = part_of(parts, layer);
      part.levels[0].values.get(part.channels[0].name).writeUInt16LE(0x3000, 0);
    },
  },
  sound));

// Other sides than the front.
const RHO = {lobes: lobe({rho: 0.1}), opacity: everywhere(1)};
const side = (layers = ['lobes'], more = {}) => ({layers, K: 0, grid: [2, 1], value: RHO, ...more});
const dim = {value: {lobes: lobe({rho: 0.05})}};
const of_sides = {
  ...base,
  value: RHO,
  sides: {'back': side(['lobes', 'opacity']), 'through': side(['lobes'], dim), 'back.through': side(['lobes'], dim)},
};
const at = (place) => ({...others, issues: [{code: 'FABRIC_MEMBER', place}]});
const sides = [
  ...members_of(of_sides, [
    ['sides-null', '/sides', null],
    ['side-of-a-number', '/sides/back', 3],
    ...['layers', 'digests', 'views', 'provenance'].map((name) => [`side-without-${name}`, `/sides/back/${name}`, missing]),
    ['side-scale-zero', '/sides/through/radianceScale', 0],
    ['opacity-of-light-through', '/sides/through/layers/opacity', (text) => {
      text.sides.through.layers.opacity = text.layers.opacity;
      text.sides.through.digests.opacity = text.digests.opacity;
    }],
    ['yarns-of-the-back', '/sides/back/layers/yarns', {levels: [0], curves: 1, nodes: 2, stations: 1, fields: 30}],
    [
      'light-through-no-yarn', '/sides/through/layers/indirect',
      all(set('/sides/through/layers/indirect', {levels: [0]}), set('/sides/through/digests/indirect', ['0'.repeat(32)]))
    ],
    ['other-views-of-light-through', '/sides/through/views/columns', 1, at('/sides/through')],
    ['light-through-a-back-that-is-not-there', '/sides/back', missing, at('/sides/back.through')],
    [
      'side-that-skips-a-level', '/sides/through',
      all(set('/sides/through/layers/lobes/levels', [0]), (text) => text.sides.through.digests.lobes.pop())
    ],
    [
      'side-of-opacity-alone', '/sides/back',
      all(set('/sides/back/layers/lobes/levels', [1]), (text) => text.sides.back.digests.lobes.shift())
    ],
  ]),
  broken('FABRIC_PART', 'side-without-its-part', 'a layer of a side without its part', 'back.table', {
    text: all(
      set('/sides/back/layers/table', {levels: [0, 1]}),
      set('/sides/back/digests/table', ['0'.repeat(32), '0'.repeat(32)])),
    ...others,
  }, of_sides),
  broken('FABRIC_UNSUPPORTED', 'layer-of-a-side', 'an unknown layer', '/sides/back/layers/depth', {
    text: set('/sides/back/layers/depth', {levels: [0]}),
    ...others,
  }, of_sides),
  broken('FABRIC_DIGEST', 'pixels-of-a-side', 'a digest of other pixels', 'back.lobes/level 1', {
    text: set('/sides/back/digests/lobes/1', '0'.repeat(32)),
    evaluate: {...ask(1), behind: true},
  }, of_sides),
  broken('FABRIC_NOT_FINITE', 'value-of-a-side', 'rho = -1 at the back', 'back.lobes/level', {
    sides: {...of_sides.sides, back: side(['lobes', 'opacity'], {value: {...RHO, lobes: lobe({rho: -1})}})},
    evaluate: {...ask(0), behind: true},
  }, of_sides),
];

export const broken_products = [...members, ...channels, ...values, ...digests, ...sides];

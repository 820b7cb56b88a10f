// What is broken in light tables, products and their bases; and what is legal but unwise there.
import {pack_values} from '../../reference/exr_write.mjs';
import {part_of} from '../make.mjs';
import {all, ask, base, broken, everywhere, lobe, others, set} from './common.mjs';

/** Sound in all else: every layer that this is about, and no reason for a warning. */
const sound = {
  ...base,
  layers: ['lobes', 'light', 'products', 'bases'],
  light_grid: [1, 2],
  functions: [1, 2],
  value: {
    lobes: lobe({rho: 0.1}),
    light: everywhere(0.5),
    products: everywhere(0.25),
    bases: everywhere(0.25),
  },
};

const PAIRS = '/layers/products/pairs', FUNCTIONS = '/layers/bases/functions';
const member = (what, pointer, value, extra) => broken(
  'FABRIC_MEMBER', what, `${pointer}: ${what.replaceAll('-', ' ')}`, pointer, {
    text: typeof value === 'function' ? value : set(pointer, value),
    ...others,
    ...extra,
  },
  sound);
const missing = undefined;
/** The integer `from` of the text, written as `to`. */
const written = (what, pointer, from, to) => member(what, pointer, () => {}, {
  string: (text) => JSON.stringify(text).replace(from, to),
});

const members = [
  member('pairs-missing', PAIRS, missing),
  member('pairs-object', PAIRS, {}),
  member('pairs-of-too-few-levels', PAIRS, [[[0, 0], [1, 1]]]),
  member('pairs-of-too-many-levels', PAIRS, [[[0, 0], [1, 1]], [[0, 0]], [[0, 0]]]),
  member('pairs-of-a-level-number', PAIRS, [[[0, 0], [1, 1]], 0]),
  member('pairs-of-a-level-empty', PAIRS, [[[0, 0], [1, 1]], []]),
  member('pairs-of-a-level-too-many', PAIRS, [Array(257).fill([0, 0]), [[0, 0]]]),
  member('pair-number', PAIRS, [[0, [1, 1]], [[0, 0], [1, 1]]]),
  member('pair-of-one-number', PAIRS, [[[0], [1, 1]], [[0, 0], [1, 1]]]),
  member('pair-of-three-numbers', PAIRS, [[[0, 0, 0], [1, 1]], [[0, 0], [1, 1]]]),
  member('pair-fraction', PAIRS, [[[0, 0.5], [1, 1]], [[0, 0], [1, 1]]]),
  member('pair-negative', PAIRS, [[[0, -1], [1, 1]], [[0, 0], [1, 1]]]),
  member('pair-of-no-function-of-the-view', PAIRS, [[[0, 0], [2, 1]], [[0, 0], [1, 1]]]),
  member('pair-of-no-function-of-the-light', PAIRS, [[[0, 0], [1, 1]], [[0, 0], [1, 2]]]),
  written('pair-with-a-fraction', PAIRS, '[[0,0],[1,1]]', '[[0,0],[1,1.0]]'),
  member('products-without-bases', '/layers/products', all(set('/layers/bases', missing), set('/digests/bases', missing))),
  member('bases-of-level-1-too', '/layers/bases/levels', all(set('/layers/bases/levels', [0, 1]), (text) => {
    text.digests.bases.push(text.digests.bases[0]);
  })),
  member('bases-of-level-1-alone', '/layers/bases/levels', [1]),
  member('functions-missing', FUNCTIONS, missing),
  member('functions-array', FUNCTIONS, [1, 2]),
  member('functions-of-the-view-missing', FUNCTIONS, set(`${FUNCTIONS}/views`, missing)),
  member('functions-of-the-view-negative', FUNCTIONS, set(`${FUNCTIONS}/views`, -1)),
  member('functions-of-the-view-too-many', FUNCTIONS, set(`${FUNCTIONS}/views`, 257)),
  member('functions-of-the-light-missing', FUNCTIONS, set(`${FUNCTIONS}/lights`, missing)),
  member('functions-of-the-light-none', FUNCTIONS, set(`${FUNCTIONS}/lights`, 0)),
  member('functions-of-the-light-too-many', FUNCTIONS, set(`${FUNCTIONS}/lights`, 257)),
  member('functions-of-the-light-fraction', FUNCTIONS, set(`${FUNCTIONS}/lights`, 1.5)),
  member('lights-missing', '/lights', missing),
  member('lights-missing-of-bases-alone', '/lights', missing, {layers: ['lobes', 'bases']}),
  member('lights-array', '/lights', [1, 2]),
  member('lights-layout-missing', '/lights/layout', missing),
  member('lights-columns-missing', '/lights/columns', missing),
  member('lights-columns-none', '/lights/columns', 0),
  member('lights-rows-fraction', '/lights/rows', 2.5),
  member('lights-too-many', '/lights', {layout: 'equal-area', columns: 65, rows: 64}),
  broken('FABRIC_UNSUPPORTED', 'light-layout', 'a layout of lights that is not known', '/lights/layout', {
    text: set('/lights/layout', 'octahedral'),
    ...others,
  }, sound),
];

const drop_channel = (name) => (parts) => {
  const part = part_of(parts, name.split('.')[0]);
  part.channels = part.channels.filter((channel) => channel.name !== name);
  part.levels.forEach(({values}) => values.delete(name));
};
const channels = [
  ...['light.0001.green', 'products.1', 'products.0', 'bases.2'].map(
    (name) => broken(
      'FABRIC_CHANNEL', `missing-${name.replaceAll('.', '-')}`, `the channel ${name} is missing`, name,
      {before: drop_channel(name)}, sound)),
  broken(
    'FABRIC_CHANNEL', 'more-lights-than-channels', '1 x 3 lights, channels for two', 'light.0002', {
      text: set('/lights/rows', 3),
      ...others,
    },
    sound),
  broken(
    'FABRIC_CHANNEL', 'more-products-than-channels', 'a third product, channels for two', 'products.2', {
      text: (text) => text.layers.products.pairs[1].push([0, 1]),
      ...others,
    },
    sound),
  broken(
    'FABRIC_CHANNEL', 'more-functions-than-channels', '4 functions of the light, channels for 2', 'bases.3', {
      text: set(`${FUNCTIONS}/lights`, 4),
      ...others,
    },
    sound),
  broken(
    'FABRIC_CHANNEL', 'millions-of-channels', 'functions that need four million channels', 'bases', {
      texels: [1, 1],
      text: all(
        set(FUNCTIONS, {views: 256, lights: 256}),
        set('/views', {layout: 'equal-area', columns: 64, rows: 64}),
        set('/lights', {layout: 'equal-area', columns: 64, rows: 64})),
      ...others,
    },
    {...sound, layers: ['lobes', 'products', 'bases']}),
];

/** One number of a channel, at texel (1, 0) of level 0 or (0, 0) of level 1; the digests follow. */
const not_finite = (what, channel, number, level = 0) => {
  const layer = channel.split('.')[0];
  return broken(
    'FABRIC_NOT_FINITE', what, `${channel} is ${number} at a texel`, `${layer}/level ${level}/${channel}`, {
      before: (parts) =>
        pack_values([number], 'half')
          .copy(part_of(parts, layer).levels[level].values.get(channel), level === 0 ? 2 : 0),
      evaluate: ask(level),
    },
    sound);
};
const values = [
  not_finite('light-negative', 'light.0001.red', -0.25),
  not_finite('light-nan', 'light.0000.blue', NaN),
  not_finite('light-infinite', 'light.0001.green', Infinity),
  not_finite('light-negative-at-a-coarse-level', 'light.0000.red', -0.25, 1),
  not_finite('product-nan', 'products.1', NaN),
  not_finite('product-infinite', 'products.0', Infinity),
  not_finite('base-nan', 'bases.0', NaN),
  not_finite('base-infinite', 'bases.1', -Infinity),
];

const digests = ['light', 'products', 'bases'].map(
  (layer) => broken(
    'FABRIC_DIGEST', `pixels-of-${layer}`, `a number of ${layer} is not the one of the digest`, layer, {
      after: (parts) => {
        const part = part_of(parts, layer);
        part.levels[0].values.get(part.channels[0].name).writeUInt16LE(0x3000, 0);
      },
      issues: [{code: 'FABRIC_DIGEST', place: `${layer}/level 0`}],
    },
    sound));

export const broken_products = [...members, ...channels, ...values, ...digests];

const warning = (code, what, about, place, changes) =>
  ({...sound, name: `${code}-${what}`, about, issues: [{code, place}], ...changes});

export const unwise_products = [
  warning('FABRIC_LEVELS', 'light', 'a light table at level 0 only', '/layers/light', {
    layers: {lobes: {}, light: {levels: [0]}},
  }),
  warning(
    'FABRIC_LEVELS', 'light-beside-products', 'level 1 has products, level 2 neither these nor a light table',
    '/layers/light', {
      texels: [4, 4],
      layers: {lobes: {}, light: {levels: [0]}, products: {levels: [1]}, bases: {}},
    }),
  warning('FABRIC_ENERGY', 'light-table', 'S = 2: more than three times the light comes back', 'level 0', {
    layers: ['light'],
    value: {light: everywhere(2)},
  }),
  warning('FABRIC_ENERGY', 'products', 'products of shared functions that add up to 1', 'level 0', {
    layers: ['products', 'bases'],
    value: {products: everywhere(1), bases: everywhere(0.5)},
  }),
  warning('FABRIC_ADVICE', 'unknown-member-of-lights', 'a member that is not known', '/lights/colour', {
    text: set('/lights/colour', 'grey'),
  }),
  warning(
    'FABRIC_ADVICE', 'unknown-channel-of-products', 'products that no level lists', 'products/products.2', {
      texels: [1, 1],
      pairs: () => [[0, 0], [1, 1], [0, 1]],
      text: (text) => text.layers.products.pairs[0].pop(),
    }),
  warning(
    'FABRIC_ADVICE', 'unlisted-light-not-zero', 'a light table at a level that is not listed', 'light/level 1',
    {
      text: all(set('/layers/light/levels', [0]), (text) => text.digests.light.pop()),
    }),
];

// What is broken in other sides than the front, and what is unwise.
import {all, ask, base, broken, everywhere, lobe, others, set} from './common.mjs';

const RHO = {lobes: lobe({rho: 0.1}), opacity: everywhere(1)};
const side = (layers = ['lobes'], more = {}) => ({layers, K: 0, grid: [2, 1], value: RHO, ...more});
const sound = {
  ...base,
  value: RHO,
  sides: {
    'back': side(['lobes', 'opacity']),
    'through': side(['lobes'], {value: {lobes: lobe({rho: 0.05})}}),
    'back.through': side(['lobes'], {value: {lobes: lobe({rho: 0.05})}}),
  },
};

const member = (what, pointer, value, place = pointer, more = others) => broken(
  'FABRIC_MEMBER', what, `${pointer}: ${what.replaceAll('-', ' ')}`, place,
  {text: typeof value === 'function' ? value : set(pointer, value), ...more}, sound);
const copied = (from, to, kind) => (text) => {
  to(text).layers[kind] = from(text).layers[kind];
  to(text).digests[kind] = from(text).digests[kind];
};

export const broken_sides = [
  member('sides-null', '/sides', null),
  member('side-of-a-number', '/sides/back', 3),
  ...['layers', 'digests', 'views', 'provenance'].map(
    (name) => member(`side-without-${name}`, `/sides/back/${name}`, undefined)),
  member('side-scale-zero', '/sides/through/radianceScale', 0),
  member(
    'opacity-of-light-through', '/sides/through/layers/opacity',
    copied((text) => text, (text) => text.sides.through, 'opacity')),
  member(
    'yarns-of-the-back', '/sides/back/layers/yarns',
    set('/sides/back/layers/yarns', {levels: [0], precision: 'float', curves: 1, nodes: 2, stations: 1})),
  member(
    'light-through-no-yarn', '/sides/through/layers/indirect',
    all(
      set('/sides/through/layers/indirect', {levels: [0], precision: 'half'}),
      set('/sides/through/digests/indirect', ['0'.repeat(32)]))),
  member('other-views-of-light-through', '/sides/through/views/columns', 1, '/sides/through'),
  member('light-through-a-back-that-is-not-there', '/sides/back', undefined, '/sides/back.through'),
  member(
    'side-that-skips-a-level', '/sides/through',
    all(
      set('/sides/through/layers/lobes/levels', [0]),
      (text) => {
        text.sides.through.digests.lobes.pop();
      })),
  member(
    'side-of-opacity-alone', '/sides/back',
    all(
      set('/sides/back/layers/lobes/levels', [1]),
      (text) => {
        text.sides.back.digests.lobes.shift();
      })),
  broken('FABRIC_PART', 'side-without-its-part', 'a part of another name', 'back.lobes', {
    text: (text) => {
      text.sides.back.layers.table = {levels: [0, 1], precision: 'half'};
      text.sides.back.digests.table = ['0'.repeat(32), '0'.repeat(32)];
    },
    issues: [{code: 'FABRIC_PART', place: 'back.table'}],
    ...others,
  }, sound),
  broken('FABRIC_UNSUPPORTED', 'layer-of-a-side', 'a layer that is not known', '/sides/back/layers/depth', {
    text: set('/sides/back/layers/depth', {levels: [0], precision: 'half'}),
    ...others,
  }, sound),
  broken('FABRIC_DIGEST', 'pixels-of-a-side', 'a digest of other pixels', 'back.lobes/level 1', {
    text: (text) => {
      text.sides.back.digests.lobes[1] = '0'.repeat(32);
    },
    evaluate: {...ask(1), behind: true},
  }, sound),
  broken('FABRIC_NOT_FINITE', 'value-of-a-side', 'rho = -1 at the back', 'back.lobes/level', {
    sides: {...sound.sides, back: side(['lobes', 'opacity'], {value: {...RHO, lobes: lobe({rho: -1})}})},
    evaluate: {...ask(0), behind: true},
  }, sound),
];

const warning = (code, what, about, place, changes) =>
  ({...sound, name: `${code}-${what}`, about, issues: [{code, place}], ...changes});

export const unwise_sides = [
  warning('FABRIC_ENERGY', 'both-sides', '0.6 of the light comes back, and 0.6 goes through', 'level 0', {
    value: {...RHO, lobes: lobe({rho: 0.2})},
    sides: {...sound.sides, 'back.through': side(['lobes'], {value: {lobes: lobe({rho: 0.2})}})},
  }),
  warning('FABRIC_ADVICE', 'unknown-side', 'a side that is not known', '/sides/left', {
    text: set('/sides/left', {}),
  }),
  warning('FABRIC_LEVELS', 'opacity-of-the-back', 'an opacity at one level only', '/sides/back/layers/opacity/levels', {
    sides: {...sound.sides, back: side({lobes: {}, opacity: {levels: [0]}})},
  }),
];

// Fabric files that are legal but unwise.
import {attribute} from '../../reference/exr_write.mjs';
import {all, base, everywhere, lobe, opacity_on_0, set, unknown_part} from './common.mjs';

const warning = (code, what, about, place, changes) =>
  ({...base, name: `${code}-${what}`, about, issues: [{code, place}], ...changes});
const mirror = (name, replacement) => warning(
  'FABRIC_ADVICE', `mirror-${name}`, `the mirror selvedge.${name} differs from the text`, `selvedge.${name}`,
  {
    after: ([first]) => {
      first.attributes[`selvedge.${name}`] = replacement;
    },
  });

export const unwise_fabrics = [
  warning('FABRIC_PEAK', 'exponent-in-half', 'an exponent of 500 in half precision', 'lobes', {
    layers: {lobes: {precision: 'half'}},
    K: 1,
    value: {lobes: lobe({rho: 0.125, z: 0.9375, n: 500})},
  }),
  warning('FABRIC_PEAK', 'beyond-half', 'a peak of 265,000, brought down by the table', 'lobes', {
    layers: ['lobes', 'table'],
    K: 1,
    value: {lobes: lobe({rho: 0.125, z: 1.0025, n: 5000}), table: everywhere(2 ** -12)},
  }),
  warning('FABRIC_ENERGY', 'rho', 'rho = 2: more than six times the light comes back', 'level 0', {
    value: {lobes: lobe({rho: 2}), opacity: everywhere(1)},
  }),
  warning('FABRIC_LEVELS', 'chain', 'two of four levels', '/levels', {texels: [8, 4], levels: 2}),
  warning('FABRIC_LEVELS', 'layer', 'opacity at level 0 only', '/layers/opacity', opacity_on_0),
  warning('FABRIC_ADVICE', 'unlisted-level-not-zero', 'a level that is not listed, but not zero', '', {
    texels: [4, 4],
    levels: 3,
    layers: ['lobes'],
    issues: [{code: 'FABRIC_ADVICE', place: 'lobes/level 2'}, {code: 'FABRIC_LEVELS', place: '/levels'}],
    text: all(set('/levels', 2), set('/layers/lobes/levels', [0, 1]), (text) => text.digests.lobes.pop()),
  }),
  warning('FABRIC_ADVICE', 'unknown-member', 'a member that is not known', '/layers/opacity/colour', {
    text: set('/layers/opacity/colour', 'grey'),
  }),
  warning('FABRIC_ADVICE', 'unknown-part-of-scan-lines', 'a part that is not known, of scan lines', 'seams', {
    before: (parts) => parts.push({...unknown_part('seams', 'seams.depth', 1), tile: null, mipmap: false}),
  }),
  mirror('version', attribute.string('1.1')),
  mirror('model', attribute.string('constant')),
  mirror('mmPerRepeat', attribute.v2f(1, 1)),
  mirror('referenceHeight', attribute.float(2)),
];

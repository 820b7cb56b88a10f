// Fabric files that are legal but unwise.
import {attribute} from '../../reference/exr_write.mjs';
import {part_of} from '../make.mjs';
import {add_channel, all, base, everywhere, lobe, opacity_on_0, set, unknown_part} from './common.mjs';

const warning = (code, what, about, place, changes) =>
  ({...base, name: `${code}-${what}`, about, issues: [{code, place}], ...changes});
const mirror = (name, replacement) => warning(
  'FABRIC_ADVICE', `mirror-${name}`, `the mirror selvedge.${name} differs from the text`, `selvedge.${name}`,
  {
    after: ([first]) => {
      first.attributes[`selvedge.${name}`] = replacement;
    },
  });

const advice = (what, about, place, changes) => warning('FABRIC_ADVICE', what, about, place, changes);
const member = (what, pointer, value) =>
  advice(what, `${pointer}: ${what.replaceAll('-', ' ')}`, pointer, {text: set(pointer, value)});
const of_preview = (change) => ({before: ([preview]) => change(preview)});

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
  warning(
    'FABRIC_ENERGY', 'one-texel', 'rho = 0.5 at one texel: half as much again as it receives', 'level 0', {
      value: {
        lobes: (level, channel, t) => channel.startsWith('lobes.diffuse') && level + t === 0 ? 0.5 : 0.1,
        opacity: everywhere(1)
      },
    }),
  warning(
    'FABRIC_ENERGY', 'oblique-light',
    'more light comes back than falls on it from 60 degrees, not from above', 'level', {
      K: 1,
      value: {lobes: lobe({rho: 0.2, xy: -1.2, z: 0.3, n: 2}), opacity: everywhere(1)},
    }),
  warning('FABRIC_ENERGY', 'no-lobes', 'no lobes: f = l_z, and pi times the light comes back', 'level', {
    layers: ['opacity'],
    value: {opacity: everywhere(1)},
  }),
  warning('FABRIC_LEVELS', 'chain', 'two of four levels', '/levels', {texels: [8, 4], levels: 2}),
  warning('FABRIC_LEVELS', 'part', 'level 2 of 13 x 9 texels and coarser ones', '/whole', {
    texels: [3, 2],
    whole: {texels: [13, 9], level: 2, levels: 4},
  }),
  warning('FABRIC_LEVELS', 'part-of-unknown-levels', 'the same, and nothing said of coarser levels', '/whole', {
    texels: [3, 2],
    whole: {texels: [13, 9], level: 2},
  }),
  warning('FABRIC_LEVELS', 'part-without-coarser-levels', 'level 0 of 8 x 4 texels and no other', '/whole', {
    texels: [8, 4],
    levels: 1,
    whole: {texels: [8, 4], level: 0, levels: 4},
  }),
  warning('FABRIC_LEVELS', 'part-from-the-middle', 'levels 1 and 2 of 5', '/whole', {
    texels: [8, 4],
    levels: 2,
    whole: {texels: [16, 9], level: 1, levels: 5},
  }),
  warning('FABRIC_LEVELS', 'part-of-a-chain-that-stops', 'the coarser of two levels, a whole that stops', '/whole', {
    texels: [8, 4],
    levels: 1,
    whole: {texels: [16, 9], level: 1, levels: 2},
    issues: [{code: 'FABRIC_LEVELS', place: '/levels'}, {code: 'FABRIC_LEVELS', place: '/whole'}],
  }),
  warning('FABRIC_LEVELS', 'layer', 'opacity at level 0 only', '/layers/opacity', opacity_on_0),
  advice('unlisted-level-not-zero', 'a level that is not listed, but not zero', '', {
    texels: [4, 4],
    levels: 3,
    layers: ['lobes'],
    issues: [{code: 'FABRIC_ADVICE', place: 'lobes/level 2'}, {code: 'FABRIC_LEVELS', place: '/levels'}],
    text: all(set('/levels', 2), set('/layers/lobes/levels', [0, 1]), (text) => text.digests.lobes.pop()),
  }),
  advice('unknown-member', 'a member that is not known', '/layers/opacity/colour', {
    text: set('/layers/opacity/colour', 'grey'),
  }),
  member('unknown-member-of-the-text', '/colour', 'grey'),
  member('unknown-member-of-views', '/views/colour', 'grey'),
  member('digests-of-no-layer', '/digests/seams', ['0'.repeat(32)]),
  member('unknown-layer-that-is-optional', '/layers/back.lobes', {levels: [0], optional: true}),
  member('minor-version', '/version', [3, 4]),
  member('model-missing', '/model', undefined),
  member('model-number', '/model', 1),
  member('layer-precision-missing', '/layers/opacity/precision', undefined),
  member('layer-precision-unknown', '/layers/opacity/precision', 'double'),
  member('layer-precision-of-other-channels', '/layers/opacity/precision', 'float'),
  advice('unknown-channel', 'a channel that is not known in a part that is', 'opacity/opacity.mean', {
    before: (parts) => add_channel('opacity.mean')(part_of(parts, 'opacity')),
  }),
  advice('wrapmodes-missing', 'a part without wrapmodes', 'opacity', {
    before: (parts) => {
      part_of(parts, 'opacity').attributes.wrapmodes = null;
    },
  }),
  advice('wrapmodes-other', 'a part that does not repeat', 'opacity', {
    before: (parts) => {
      part_of(parts, 'opacity').attributes.wrapmodes = attribute.string('black,black');
    },
  }),
  advice('preview-not-first', 'a preview that viewers do not find: it is the last part', 'lobes', {
    before: (parts) => parts.push(parts.shift()),
  }),
  advice('preview-tiled', 'a preview in tiles', 'preview', of_preview((part) => {
           part.tile = {width: 32, height: 32};
         })),
  // Its chunk is stored as it is.
  advice('preview-lossy', 'a preview in lossy compression', 'preview', of_preview((part) => {
           part.compression = 'pxr24';
         })),
  advice('preview-without-alpha', 'a preview without the channel A', 'preview/A', of_preview((part) => {
           part.channels.shift();
         })),
  advice('mirror-missing', 'no mirror selvedge.model', 'selvedge.model', {
    after: ([first]) => {
      first.attributes['selvedge.model'] = null;
    },
  }),
  advice('unknown-part-of-scan-lines', 'a part that is not known, of scan lines', 'seams', {
    before: (parts) => parts.push({...unknown_part('seams', 'seams.depth', 1), tile: null, mipmap: false}),
  }),
  mirror('version', attribute.string('1.1')),
  mirror('model', attribute.string('constant')),
  mirror('mmPerRepeat', attribute.v2f(1, 1)),
  mirror('referenceHeight', attribute.float(2)),
];

// Attribute texts with a member that is missing, of the wrong type or out of range.
import {all, broken, others, set} from './common.mjs';

/**
 * A member that is `value`, or missing where that is undefined; `value` may be a change of the text instead.
 */
const member = (what, pointer, value, extra = others) =>
  broken('FABRIC_MEMBER', what, `${pointer}: ${what.replaceAll('-', ' ')}`, pointer, {
    text: typeof value === 'function' ? value : set(pointer, value),
    ...extra,
  });
const missing = undefined;
const alone = {};  // no other error follows
const code_of = (pointer, code, more) => ({...others, issues: [{code, place: pointer}], ...more});
/** The numbers of a text, written otherwise. */
const written = (what, pointer, from, to) => broken(
  'FABRIC_MEMBER', what, `${pointer}: an integer written as ${to}`, pointer,
  {string: (text) => JSON.stringify(text).replace(from, to), ...others});
const digest = (layer) => code_of(layer, ['FABRIC_MEMBER', 'FABRIC_DIGEST']);

const OPACITY = '/layers/opacity', LEVELS = `${OPACITY}/levels`, LOBES = '/layers/lobes/lobes';
const DIGESTS = '/digests/opacity';

export const broken_members = [
  ...
    ['version', 'texels', 'levels', 'mmPerRepeat', 'referenceHeight', 'thickness', 'views', 'layers',
     'digests', 'provenance']
      .map((name) => member(`${name}-missing`, `/${name}`, missing)),
  member('version-text', '/version', '3.0', alone),
  member('version-of-one-number', '/version', [3], alone),
  member('version-fraction', '/version', [3, 0.5], alone),
  member('version-minor-negative', '/version', [3, -1], alone),
  written('version-with-a-fraction', '/version', '"version":[3,0]', '"version":[3,0.0]'),
  written('version-beyond-32-bits', '/version', '"version":[3,0]', '"version":[3,2147483648]'),
  member('texels-of-one-number', '/texels', [3]),
  member('texels-none', '/texels', [0, 2]),
  member('texels-too-many', '/texels', [4097, 2]),
  member('texels-fraction', '/texels', [2.5, 2]),
  written('texels-with-a-fraction', '/texels', '"texels":[3,2]', '"texels":[3.0,2]'),
  written('texels-with-an-exponent', '/texels', '"texels":[3,2]', '"texels":[3,2e0]'),
  member('levels-none', '/levels', 0),
  member('levels-beyond-the-chain', '/levels', 3, alone),
  member('levels-text', '/levels', '2'),
  member('levels-fraction', '/levels', 1.5),
  written('levels-with-a-fraction', '/levels', '"levels":2,"mm', '"levels":2.0,"mm'),
  member('mm-zero', '/mmPerRepeat', [0, 1], alone),
  member('mm-negative', '/mmPerRepeat', [1, -1], alone),
  member('mm-text', '/mmPerRepeat', ['1', '1'], alone),
  member('mm-of-three-numbers', '/mmPerRepeat', [1, 1, 1], alone),
  member('mm-beyond-single-precision', '/mmPerRepeat', [1e39, 1], alone),
  member('reference-height-null', '/referenceHeight', null, alone),
  member('reference-height-text', '/referenceHeight', '0.5', alone),
  member('thickness-negative', '/thickness', -0.25, alone),
  member('thickness-text', '/thickness', '0.75', alone),
  member('thickness-beyond-single-precision', '/thickness', 1e39, alone),
  member('radiance-scale-zero', '/radianceScale', 0, alone),
  member('radiance-scale-negative', '/radianceScale', -1, alone),
  member('radiance-scale-below-single-precision', '/radianceScale', 1e-46, alone),
  member('radiance-scale-beyond-single-precision', '/radianceScale', 1e39, alone),
  member('radiance-scale-text', '/radianceScale', '1', alone),
  member('radiance-scale-null', '/radianceScale', null, alone),
  member('whole-number', '/whole', 1, alone),
  member('whole-level-missing', '/whole', {texels: [6, 4]}, {issues: [{code: 'FABRIC_MEMBER', place: '/whole/level'}]}),
  member('whole-level-0', '/whole', {texels: [3, 2], level: 0}, {issues: [{code: 'FABRIC_MEMBER', place: '/whole/level'}]}),
  member(
    'whole-level-beyond-its-chain', '/whole', {texels: [6, 4], level: 3},
    {issues: [{code: 'FABRIC_MEMBER', place: '/whole/level'}]}),
  member(
    'whole-level-0-of-all-levels', '/whole', {texels: [3, 2], level: 0, levels: 2},
    {issues: [{code: 'FABRIC_MEMBER', place: '/whole/level'}]}),
  member(
    'whole-levels-fewer-than-the-file-goes-to', '/whole', {texels: [6, 4], level: 1, levels: 2},
    {issues: [{code: 'FABRIC_MEMBER', place: '/whole/levels'}]}),
  member(
    'whole-levels-more-than-the-chain', '/whole', {texels: [6, 4], level: 1, levels: 4},
    {issues: [{code: 'FABRIC_MEMBER', place: '/whole/levels'}]}),
  member(
    'whole-levels-text', '/whole', {texels: [6, 4], level: 1, levels: '3'},
    {issues: [{code: 'FABRIC_MEMBER', place: '/whole/levels'}]}),
  member('whole-texels-missing', '/whole', {level: 1}, {issues: [{code: 'FABRIC_MEMBER', place: '/whole/texels'}]}),
  member('whole-of-another-size', '/whole', {texels: [8, 4], level: 1}, alone),
  member(
    'whole-too-large', '/whole', {texels: [6144, 4096], level: 11},
    {issues: [{code: 'FABRIC_MEMBER', place: '/whole/texels'}]}),
  member('views-array', '/views', [2, 1]),
  member('views-layout-missing', '/views/layout', missing),
  member('views-layout-number', '/views/layout', 1),
  written('views-columns-with-a-fraction', '/views/columns', '"columns":2', '"columns":2.0'),
  member('views-columns-missing', '/views/columns', missing),
  member('views-columns-none', '/views/columns', 0),
  member('views-rows-fraction', '/views/rows', 2.5),
  member('views-rows-missing', '/views/rows', missing),
  member('views-too-many', '/views', {layout: 'equal-area', columns: 65, rows: 64}),
  member('layers-array', '/layers', []),
  member('layer-not-an-object', '/layers/opacity', [0, 1]),
  member('layer-levels-missing', LEVELS, missing),
  member('layer-levels-empty', LEVELS, all(set(LEVELS, []), set(DIGESTS, []))),
  member(
    'layer-levels-falling', LEVELS,
    (text) => {
      text.layers.opacity.levels.reverse();
      text.digests.opacity.reverse();
    }),
  member('layer-levels-twice', LEVELS, [0, 0]),
  member('layer-levels-beyond', LEVELS, [0, 2]),
  member(
    'layer-levels-beyond-the-fabric', LEVELS,
    all(
      set('/levels', 1), set('/layers/lobes/levels', [0]),
      (text) => {
        text.digests.lobes.pop();
      })),
  member('layer-levels-negative', LEVELS, [-1, 0]),
  member('layer-levels-fraction', LEVELS, [0, 0.5]),
  member('layer-levels-number', LEVELS, 0),
  written(
    'layer-levels-with-an-exponent', LEVELS, '"opacity":{"levels":[0,1]', '"opacity":{"levels":[0e0,1]'),
  member('layer-optional-number', `${OPACITY}/optional`, 1),
  member('layer-optional-text', `${OPACITY}/optional`, 'true'),
  member('lobes-missing', LOBES, missing),
  member('lobes-negative', LOBES, -1),
  member('lobes-too-many', LOBES, 17),
  member('lobes-fraction', LOBES, 0.5),
  written('lobes-with-a-fraction', LOBES, '"lobes":0', '"lobes":0.0'),
  member(
    'digests-array', '/digests',
    (text) => {
      text.digests = Object.values(text.digests);
    }),
  member('digests-of-a-layer-missing', DIGESTS, missing),
  member('digests-of-a-layer-text', DIGESTS, '0'.repeat(32)),
  member(
    'digests-too-few', DIGESTS,
    (text) => {
      text.digests.opacity.pop();
    }),
  member(
    'digests-too-many', DIGESTS,
    (text) => {
      text.digests.opacity.push(text.digests.opacity[0]);
    }),
  member(
    'digest-number', DIGESTS,
    (text) => {
      text.digests.opacity[0] = 12;
    }),
  member(
    'digest-too-short', DIGESTS,
    (text) => {
      text.digests.opacity[0] = 'abc';
    },
    digest('opacity')),
  member(
    'digest-upper-case', '/digests/lobes',
    (text) => {
      text.digests.lobes[0] = text.digests.lobes[0].toUpperCase();
    },
    digest('lobes')),
  member('provenance-text', '/provenance', 'unknown', alone),
  broken('FABRIC_UNSUPPORTED', 'view-layout', 'a layout of views that is not known', '/views/layout', {
    text: set('/views/layout', 'octahedral'),
    ...others,
  }),
  broken('FABRIC_UNSUPPORTED', 'layer', 'a layer that is not known', '/layers/back.lobes', {
    text: set('/layers/back.lobes', {levels: [0]}),
  }),
  broken(
    'FABRIC_UNSUPPORTED', 'layer-not-optional', 'a layer that is not known, marked as not optional',
    '/layers/back.lobes', {
      text: set('/layers/back.lobes', {levels: [0], optional: false}),
    }),
  broken(
    'FABRIC_UNSUPPORTED', 'layer-optional-number', 'a layer that is not known, its optional a 1',
    '/layers/back.lobes', {
      text: set('/layers/back.lobes', {levels: [0], optional: 1}),
    }),
];

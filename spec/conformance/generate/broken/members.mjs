// Attribute texts that are not JSON as fabric.md wants it, and members that are missing, of a wrong type or out of range.
import {attribute} from '../../reference/exr_write.mjs';
import {all, alone, base, broken, find_attribute, members_of, others, set, with_bytes} from './common.mjs';

const text_attribute = (what, about, value) => broken('FABRIC_MALFORMED', what, about, '', {
  after: ([first]) => { first.attributes['selvedge.fabric'] = value; },
  ...others,
});
const replaced = (from, to) => (text) => JSON.stringify(text).replace(from, to);
const PROVENANCE = '"provenance":{';
/** Brackets of the text itself, of the provenance, and of a list of lists. */
const nested = (depth) =>
  replaced(PROVENANCE, `${PROVENANCE}"deep":${'['.repeat(depth - 2)}${']'.repeat(depth - 2)},`);

const texts = [
  text_attribute('no-text', 'no attribute text', null),
  text_attribute('text-of-another-type', 'the attribute text has the type int', attribute.int(1)),
  text_attribute('text-not-json', 'the attribute text is not JSON', attribute.string('{"version":[4,0],')),
  text_attribute('text-not-an-object', 'the attribute text is an array', attribute.string('[4, 0]')),
  broken('FABRIC_MALFORMED', 'text-in-another-part', 'the attribute text is in part 1', '', {
    after: ([first, second]) => {
      second.attributes['selvedge.fabric'] = first.attributes['selvedge.fabric'];
      first.attributes['selvedge.fabric'] = null;
    },
  }),
  broken('FABRIC_MALFORMED', 'text-not-utf-8', 'the attribute text has a byte that UTF-8 does not have', '', {
    bytes: (b) => with_bytes(b, b.indexOf('conformance', find_attribute(b, 0, 'selvedge.fabric').at), 0xFF),
    ...others,
  }),
  ...[
    ['member-twice', 'a duplicate member', replaced('{', '{"levels":2,')],
    [
      'member-twice-in-the-provenance', 'a duplicate member in the provenance',
      replaced(PROVENANCE, `${PROVENANCE}"a":{"b":1,"b":1},`)
    ],
    [
      'member-twice-once-escaped', 'a duplicate member, one with an escaped letter', replaced('{', '{"l\\u0065vels":2,')
    ],
    [
      'half-a-surrogate-pair', 'a string that escapes half a surrogate pair',
      replaced(PROVENANCE, `${PROVENANCE}"yarn":"\\ud83e",`)
    ],
    ['byte-order-mark', 'a byte order mark before the text', (text) => `\uFEFF${JSON.stringify(text)}`],
    ['text-nested-65-deep', 'brackets that nest 65 deep', nested(65)],
    ['text-and-more', 'a second object behind the text', (text) => `${JSON.stringify(text)}{}`],
    ['number-nan', 'NaN, which JSON does not have', replaced('"thickness":0.75', '"thickness":NaN')],
  ].map(([what, about, string]) => broken('FABRIC_MALFORMED', what, about, '', {string, ...others})),
  ...[[0, 9], [1, 0], [2, 0], [3, 0], [3, 1], [3, 3], [6, 0], [-1, 0]].map(
    (version) => broken('FABRIC_VERSION', `version-${version.join('-')}`, `version ${version.join('.')}`, '/version', {
      text: set('/version', version),
      ...others,
      ...(version[0] < 0 ? {issues: [{code: ['FABRIC_VERSION', 'FABRIC_MEMBER'], place: '/version'}]} : {}),
    })),
];

const OPACITY = '/layers/opacity', LEVELS = `${OPACITY}/levels`, LOBES = '/layers/lobes/lobes';
const DIGESTS = '/digests/opacity';
const missing = undefined;
/** A digest in the form of another string; a checker may compare it before it looks at its form. */
const digest = (what, layer, change) => [what, `/digests/${layer}`, (text) => {
  text.digests[layer][0] = change(text.digests[layer][0]);
}, {...others, issues: [{code: ['FABRIC_MEMBER', 'FABRIC_DIGEST'], place: layer}]}];

const members = members_of(base, [
  ...['version', 'texels', 'levels', 'mmPerRepeat', 'referenceHeight', 'thickness', 'views', 'layers', 'digests', 'provenance']
    .map((name) => [`${name}-missing`, `/${name}`, missing]),
  ['version-text', '/version', '4.0', alone],
  ['version-of-one-number', '/version', [4], alone],
  ['version-fraction', '/version', [4, 0.5], alone],
  ['version-minor-negative', '/version', [4, -1], alone],
  ['texels-of-one-number', '/texels', [3]],
  ['texels-none', '/texels', [0, 2]],
  ['texels-too-many', '/texels', [4097, 2]],
  ['texels-fraction', '/texels', [2.5, 2]],
  ['levels-none', '/levels', 0],
  ['levels-beyond-the-chain', '/levels', 3, alone],
  ['levels-text', '/levels', '2'],
  ['levels-fraction', '/levels', 1.5],
  ['mm-zero', '/mmPerRepeat', [0, 1], alone],
  ['mm-negative', '/mmPerRepeat', [1, -1], alone],
  ['mm-text', '/mmPerRepeat', ['1', '1'], alone],
  ['mm-of-three-numbers', '/mmPerRepeat', [1, 1, 1], alone],
  ['mm-beyond-single-precision', '/mmPerRepeat', [1e39, 1], alone],
  ['reference-height-null', '/referenceHeight', null, alone],
  ['reference-height-text', '/referenceHeight', '0.5', alone],
  ['thickness-negative', '/thickness', -0.25, alone],
  ['thickness-text', '/thickness', '0.75', alone],
  ['thickness-beyond-single-precision', '/thickness', 1e39, alone],
  ...Object.entries({zero: 0, negative: -1, 'below-single-precision': 1e-46, 'beyond-single-precision': 1e39, text: '1', null: null})
    .map(([what, value]) => [`radiance-scale-${what}`, '/radianceScale', value, alone]),
  // Members that version 4.0 reserves.
  ...['variation', 'recipe', 'accuracy', 'sheet', 'fallback'].map((name) => [`${name}-array`, `/${name}`, [], alone]),
  ['colourways-object', '/colourways', {}, alone],
  ['colourways-of-texts', '/colourways', ['red'], {issues: [{code: 'FABRIC_MEMBER', place: '/colourways/0'}]}],
  ['views-array', '/views', [2, 1]],
  ['views-layout-missing', '/views/layout', missing],
  ['views-layout-number', '/views/layout', 1],
  ['views-columns-missing', '/views/columns', missing],
  ['views-columns-none', '/views/columns', 0],
  ['views-rows-fraction', '/views/rows', 2.5],
  ['views-rows-missing', '/views/rows', missing],
  ['views-too-many', '/views', {layout: 'equal-area', columns: 65, rows: 64}],
  ['layers-array', '/layers', []],
  ['layer-not-an-object', '/layers/opacity', [0, 1]],
  ['layer-levels-missing', LEVELS, missing],
  ['layer-levels-empty', LEVELS, all(set(LEVELS, []), set(DIGESTS, []))],
  ['layer-levels-falling', LEVELS, [1, 0]],
  ['layer-levels-twice', LEVELS, [0, 0]],
  ['layer-levels-beyond', LEVELS, [0, 2]],
  [
    'layer-levels-beyond-the-fabric', LEVELS,
    all(set('/levels', 1), set('/layers/lobes/levels', [0]), (text) => text.digests.lobes.pop())
  ],
  ['layer-levels-negative', LEVELS, [-1, 0]],
  ['layer-levels-fraction', LEVELS, [0, 0.5]],
  ['layer-levels-number', LEVELS, 0],
  ['layer-optional-number', `${OPACITY}/optional`, 1],
  ['layer-optional-text', `${OPACITY}/optional`, 'true'],
  ['lobes-missing', LOBES, missing],
  ['lobes-negative', LOBES, -1],
  ['lobes-too-many', LOBES, 17],
  ['lobes-fraction', LOBES, 0.5],
  ['digests-array', '/digests', (text) => Object.assign(text, {digests: Object.values(text.digests)})],
  ['digests-of-a-layer-missing', DIGESTS, missing],
  ['digests-of-a-layer-text', DIGESTS, '0'.repeat(32)],
  ['digests-too-few', DIGESTS, (text) => text.digests.opacity.pop()],
  ['digests-too-many', DIGESTS, (text) => text.digests.opacity.push(text.digests.opacity[0])],
  ['digest-number', DIGESTS, set(`${DIGESTS}/0`, 12)],
  digest('digest-too-short', 'opacity', () => 'abc'),
  digest('digest-upper-case', 'lobes', (text) => text.toUpperCase()),
  ['provenance-text', '/provenance', 'unknown', alone],
]);

const unknown = [
  ['view-layout', 'an unknown layout of views', '/views/layout', 'octahedral'],
  ['layer', 'an unknown layer', '/layers/back.lobes', {levels: [0]}],
  [
    'layer-not-optional', 'an unknown layer, marked as not optional', '/layers/back.lobes',
    {levels: [0], optional: false}
  ],
  ['layer-optional-number', 'an unknown layer whose `optional` is 1', '/layers/back.lobes', {levels: [0], optional: 1}],
  ['reserved-layer-not-optional', 'a reserved layer that is not optional', '/layers/squash', {levels: [0]}],
].map(([what, about, pointer, value]) => broken('FABRIC_UNSUPPORTED', what, about, pointer, {text: set(pointer, value), ...others}));

export const broken_members = [...texts, ...members, ...unknown];

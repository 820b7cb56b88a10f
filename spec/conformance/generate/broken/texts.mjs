// Attribute texts that are no JSON object, or not as the page wants JSON.
import {attribute} from '../../reference/exr_write.mjs';
import {broken, find_attribute, others, set, with_bytes} from './common.mjs';

const text_attribute = (what, about, value, more) => broken('FABRIC_MALFORMED', what, about, '', {
  after: ([first]) => {
    first.attributes['selvedge.fabric'] = value;
  },
  ...others,
  ...more,
});

/** A text that JSON.stringify does not write. */
const written = (what, about, string) => broken('FABRIC_MALFORMED', what, about, '', {string, ...others});
const replaced = (from, to) => (text) => JSON.stringify(text).replace(from, to);
const PROVENANCE = '"provenance":{';
/** Brackets of the text itself, of the provenance, and of a list of lists. */
const nested = (depth) =>
  replaced(PROVENANCE, `${PROVENANCE}"deep":${'['.repeat(depth - 2)}${']'.repeat(depth - 2)},`);

const texts = [
  text_attribute('no-text', 'no attribute text', null),
  text_attribute('text-of-another-type', 'the attribute text has the type int', attribute.int(1)),
  text_attribute('text-not-json', 'the attribute text is not JSON', attribute.string('{"version":[3,0],')),
  text_attribute('text-not-an-object', 'the attribute text is an array', attribute.string('[1, 0]')),
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
  written('member-twice', 'a member that stands twice', replaced('{', '{"levels":2,')),
  written(
    'member-twice-in-the-provenance', 'a member that stands twice where anything may stand',
    replaced(PROVENANCE, `${PROVENANCE}"a":{"b":1,"b":1},`)),
  written(
    'member-twice-once-escaped', 'a member that stands twice, once with an escaped letter',
    replaced('{', '{"l\\u0065vels":2,')),
  written(
    'half-a-surrogate-pair', 'a string that escapes half a surrogate pair',
    replaced(PROVENANCE, `${PROVENANCE}"yarn":"\\ud83e",`)),
  written('byte-order-mark', 'a byte order mark before the text', (text) => `\uFEFF${JSON.stringify(text)}`),
  written('text-nested-65-deep', 'brackets that nest 65 deep', nested(65)),
  written('text-and-more', 'a second object behind the text', (text) => `${JSON.stringify(text)}{}`),
  written('number-nan', 'NaN, which JSON does not have', replaced('"thickness":0.75', '"thickness":NaN')),
  ...[[1, 0], [2, 0], [4, 0], [0, 9], [-1, 0]].map(
    (version) => broken('FABRIC_VERSION', `major-${version[0]}`, `version ${version.join('.')}`, '', {
      text: set('/version', version),
      ...others,
      ...(version[0] < 0 ? {issues: [{code: ['FABRIC_VERSION', 'FABRIC_MEMBER'], place: '/version'}]} : {}),
    })),
];

export const broken_texts = texts;

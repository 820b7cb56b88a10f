// Fabric files that break one rule each, and files that are legal but unwise:
// { name: 'CODE-what', about, issues, others, evaluate, file } besides what make.mjs takes.
//
//   issues    what a checker must find: { code or [codes of which one fits], place }
//   others    'none' or 'allowed': whether errors beside these may be reported
//   evaluate  the query that a reader must refuse; null where a reader may not notice
import { read_headers } from '../reference/exr.mjs';
import { attribute, pack_values } from '../reference/exr_write.mjs';
import { framed, part_of } from './make.mjs';

const UP = [0, 0, 1];
const ask = (level) => ({ level, texel: [0, 0], light: UP, view: UP });
const everywhere = (value) => () => value;

/** The file that the rules are broken in: sound in all else, and no reason for a warning. */
const base = { layers: ['lobes', 'opacity'], K: 0, grid: [2, 1], value: { lobes: (level, channel) => /\.n\./.test(channel) ? 2 : channel.includes('diffuse') ? 0.1 : channel.includes('cz') ? 0.5 : -0.25 } };
const all_layers = { ...base, K: 1, layers: ['lobes', 'frame', 'table', 'opacity'] };

const broken = (code, what, about, place, changes, from = base) => ({
  ...from, name: `${[code].flat()[0]}-${what}`, about, issues: [{ code, place }], others: 'none', evaluate: ask(0), ...changes,
});

/** Where the value of an attribute of a part begins, and its size. */
function find_attribute(bytes, part, name) {
  const { attributes } = read_headers(bytes).parts[part];
  const { value } = attributes.get(name);
  return { at: value.byteOffset - bytes.byteOffset, size: value.length };
}
const chunk_at = (bytes, part, level = 0) => {
  const { chunks } = read_headers(bytes).parts[part];
  return chunks.find((chunk) => chunk.level === level).offset;
};
const changed = (bytes, at, ...values) => { const copy = Buffer.from(bytes); copy.set(values, at); return copy; };
const i32_changed = (bytes, at, value) => { const copy = Buffer.from(bytes); copy.writeInt32LE(value, at); return copy; };

/** All parts share their display window; a part of another size has another data window only. */
const display = () => ({ displayWindow: attribute.box2i(0, 0, 2, 1) });

// A chunk of a tiled part: the part's number, four coordinates, the size, the data.
const TILE_SIZE = 20, TILE_DATA = 24;

const exr = [
  broken('EXR_MALFORMED', 'not-exr', 'a text file', '', { bytes: () => Buffer.from('This is not a picture.\n'), others: 'allowed' }),
  broken(['EXR_MALFORMED', 'FILE_DAMAGED'], 'empty', 'no byte at all', '', { bytes: () => Buffer.alloc(0), others: 'allowed' }),
  broken(['EXR_MALFORMED', 'FILE_DAMAGED'], 'header-cut', 'the file ends within the header', '', { bytes: (b) => b.subarray(0, 700) }),
  broken(['EXR_MALFORMED', 'FILE_DAMAGED'], 'attribute-longer-than-file', 'the size of an attribute is 2^31 - 1', '', {
    bytes: (b) => i32_changed(b, find_attribute(b, 0, 'wrapmodes').at - 4, 0x7FFFFFFF),
  }),
  broken('EXR_MALFORMED', 'attribute-of-negative-size', 'the size of an attribute is -1', '', {
    bytes: (b) => i32_changed(b, find_attribute(b, 0, 'wrapmodes').at - 4, -1),
  }),
  broken('EXR_MALFORMED', 'pixel-type', 'a channel of pixel type 7', '', {
    bytes: (b) => i32_changed(b, find_attribute(b, 0, 'channels').at + 2, 7),
  }),
  broken('EXR_MALFORMED', 'no-channels', 'a part without the attribute channels', '', {
    after: (parts) => { part_of(parts, 'opacity').attributes.channels = null; },
  }),
  broken('EXR_MALFORMED', 'no-data-window', 'a part without a data window', '', {
    after: (parts) => { part_of(parts, 'opacity').attributes.dataWindow = null; },
  }),
  broken('EXR_MALFORMED', 'data-window-inverted', 'a data window that ends before it begins', '', {
    after: (parts) => { part_of(parts, 'opacity').attributes.dataWindow = attribute.box2i(0, 0, -5, 1); },
  }),
  broken('EXR_MALFORMED', 'tiles-of-no-size', 'tiles of 0 x 0', '', {
    after: (parts) => { part_of(parts, 'opacity').attributes.tiles = ['tiledesc', Buffer.from([0, 0, 0, 0, 0, 0, 0, 0, 1])]; },
  }),
  broken(['EXR_MALFORMED', 'FILE_DAMAGED'], 'chunk-count', 'chunkCount is not the number of chunks', '', {
    after: (parts) => { part_of(parts, 'opacity').attributes.chunkCount = attribute.int(1000000); },
  }),
  broken('EXR_MALFORMED', 'same-part-twice', 'two parts of the same name', '', {
    before: (parts) => parts.push({ ...part_of(parts, 'opacity'), attributes: {} }), others: 'allowed',
  }),
  broken(['EXR_UNSUPPORTED', 'FABRIC_CHANNEL'], 'integers', 'a channel of integers', 'opacity', {
    bytes: (b) => i32_changed(b, find_attribute(b, 2, 'channels').at + 'opacity.0000\0'.length, 0), others: 'allowed',
  }),
  broken(['EXR_UNSUPPORTED', 'EXR_MALFORMED'], 'sub-sampled', 'a channel with every second pixel only', '', {
    bytes: (b) => i32_changed(b, find_attribute(b, 2, 'channels').at + 'opacity.0000\0'.length + 8, 2), others: 'allowed',
  }),
  broken(['EXR_UNSUPPORTED', 'EXR_MALFORMED'], 'deep', 'a part of deep tiles', '', {
    after: (parts) => { part_of(parts, 'opacity').attributes.type = attribute.string('deeptile'); },
    bytes: (b) => changed(b, 5, b[5] | 8), others: 'allowed',
  }),
  broken(['EXR_UNSUPPORTED', 'FABRIC_PART', 'EXR_MALFORMED'], 'rip-map', 'a part with rip maps', '', {
    bytes: (b) => changed(b, find_attribute(b, 2, 'tiles').at + 8, 2), others: 'allowed',
  }),
  broken(['EXR_UNSUPPORTED', 'FABRIC_PART', 'EXR_MALFORMED'], 'levels-rounded-up', 'levels whose sides are rounded up', '', {
    bytes: (b) => changed(b, find_attribute(b, 2, 'tiles').at + 8, 0x11), others: 'allowed',
  }),
  broken('FILE_DAMAGED', 'chunk-table-cut', 'the file ends within the tables of chunks', '', {
    bytes: (b) => b.subarray(0, chunk_at(b, 0) - 12), issues: [{ code: ['FILE_DAMAGED', 'EXR_MALFORMED'], place: '' }],
  }),
  broken('FILE_DAMAGED', 'last-chunk-cut', 'the last byte is missing', 'opacity', { bytes: (b) => b.subarray(0, -1), evaluate: ask(1) }),
  broken('FILE_DAMAGED', 'data-cut', 'the file ends after the first data part', 'opacity', { bytes: (b) => b.subarray(0, chunk_at(b, 2)) }),
  broken('FILE_DAMAGED', 'preview-chunk', 'a chunk of the preview cannot be decoded', 'preview', {
    bytes: (b) => i32_changed(b, chunk_at(b, 0) + 8, 3), evaluate: null,
  }),
  broken('FILE_DAMAGED', 'unlisted-level', 'a chunk of a level that is not listed cannot be decoded', 'opacity', {
    layers: { lobes: {}, opacity: { levels: [0] } }, bytes: (b) => i32_changed(b, chunk_at(b, 2, 1) + TILE_SIZE, 1), evaluate: null,
  }),
  broken('FILE_DAMAGED', 'chunk-beyond-the-end', 'a chunk table points beyond the file', 'opacity', {
    bytes: (b) => {
      const copy = Buffer.from(b);
      const entry = copy.indexOf(Buffer.from(new BigUint64Array([BigInt(chunk_at(b, 2))]).buffer));
      copy.writeBigUInt64LE(BigInt(b.length) + 1000n, entry);
      return copy;
    },
  }),
  broken('FILE_DAMAGED', 'chunk-of-another-part', 'a chunk says that it belongs to another part', 'opacity', {
    bytes: (b) => i32_changed(b, chunk_at(b, 2), 1),
  }),
  broken('FILE_DAMAGED', 'chunk-of-another-level', 'a tile says that it belongs to another level', 'opacity', {
    bytes: (b) => i32_changed(b, chunk_at(b, 2) + 12, 1),
  }),
  broken('FILE_DAMAGED', 'chunk-of-negative-size', 'a chunk of the size -1', 'opacity', {
    bytes: (b) => i32_changed(b, chunk_at(b, 2) + TILE_SIZE, -1),
  }),
  broken('FILE_DAMAGED', 'zip-stream', 'a compressed chunk is not a zlib stream', 'lobes', {
    bytes: (b) => changed(b, chunk_at(b, 1) + TILE_DATA, 0xFF, 0xFF, 0xFF, 0xFF),
  }),
  broken('FILE_DAMAGED', 'rle-too-short', 'a run-length coded chunk gives too few bytes', 'lobes', {
    before: (parts) => { part_of(parts, 'lobes').compression = 'rle'; },
    bytes: (b) => i32_changed(b, chunk_at(b, 1) + TILE_SIZE, b.readInt32LE(chunk_at(b, 1) + TILE_SIZE) - 2),
  }),
  broken('FILE_TOO_LARGE', 'pixels', 'a data window of 65,536 x 32,768 pixels', '', {
    after: (parts) => {
      const part = part_of(parts, 'opacity');
      Object.assign(part.attributes, display(), { dataWindow: attribute.box2i(0, 0, 65535, 32767) });
      part.tile = { width: 65536, height: 32768 };
      part.levels = Array.from({ length: 17 }, () => ({ width: 1, height: 1, values: new Map(part.channels.map(({ name }) => [name, Buffer.alloc(2)])) }));
    }, others: 'allowed',
  }),
  broken('FILE_TOO_LARGE', 'parts', '65 parts', '', {
    before: (parts) => {
      for (let i = parts.length; i < 65; ++i) {
        const name = `x${i}`;
        parts.push({ name, compression: 'none', tile: null, attributes: {}, channels: [{ name: `${name}.q`, type: 'half' }],
          levels: [{ width: 3, height: 2, values: new Map([[`${name}.q`, Buffer.alloc(12)]]) }] });
      }
    },
  }),
  broken(['FILE_TOO_LARGE', 'FILE_DAMAGED'], 'level-of-so-small-a-file', '4,096 x 4,096 texels in a file of a few kilobytes', '', {
    text: (text) => { text.texels = [4096, 4096]; },
    after: (parts) => parts.forEach((part) => {
      part.attributes.dataWindow = part.attributes.displayWindow = attribute.box2i(0, 0, 4095, 4095);
      if (part.tile) part.tile = { width: 4096, height: 4096 };
      part.levels = Array.from({ length: part.tile ? 13 : 256 }, () => ({ width: 1, height: 1, values: new Map(part.channels.map(({ name }) => [name, Buffer.alloc(4)])) }));
      part.attributes.chunkCount = attribute.int(part.levels.length);
    }), others: 'allowed',
  }),
];

const malformed = [
  broken('FABRIC_MALFORMED', 'no-text', 'no attribute text', '', { after: (parts) => { parts[0].attributes['selvedge.fabric'] = null; } }),
  broken('FABRIC_MALFORMED', 'text-in-another-part', 'the attribute text is in part 1', '', {
    after: ([first, second]) => {
      second.attributes['selvedge.fabric'] = first.attributes['selvedge.fabric'];
      first.attributes['selvedge.fabric'] = null;
    },
  }),
  broken('FABRIC_MALFORMED', 'text-of-another-type', 'the attribute text has the type int', '', {
    after: ([first]) => { first.attributes['selvedge.fabric'] = attribute.int(1); },
  }),
  broken('FABRIC_MALFORMED', 'text-not-json', 'the attribute text is not JSON', '', {
    after: ([first]) => { first.attributes['selvedge.fabric'] = attribute.string('{"version":[1,0],'); }, others: 'allowed',
  }),
  broken('FABRIC_MALFORMED', 'text-not-an-object', 'the attribute text is an array', '', {
    after: ([first]) => { first.attributes['selvedge.fabric'] = attribute.string('[1, 0]'); }, others: 'allowed',
  }),
  broken('FABRIC_MALFORMED', 'text-not-utf-8', 'the attribute text has a byte that UTF-8 does not have', '', {
    bytes: (b) => { const { at } = find_attribute(b, 0, 'selvedge.fabric'); return changed(b, b.indexOf('conformance', at), 0xFF); }, others: 'allowed',
  }),
  ...[[2, 0], [0, 9], [-1, 0]].map((version) => broken('FABRIC_VERSION', `major-${version[0]}`, `version ${version.join('.')}`, '', {
    text: (text) => { text.version = version; }, others: 'allowed',
    ...(version[0] < 0 ? { issues: [{ code: ['FABRIC_VERSION', 'FABRIC_MEMBER'], place: '/version' }] } : {}),
  })),
];

/** A member of the text that is wrong: what, its pointer, how. */
const member = (what, pointer, change, extra = {}) =>
  broken('FABRIC_MEMBER', what, `${pointer}: ${what.replaceAll('-', ' ')}`, pointer, { text: change, ...extra });
const others = { others: 'allowed' };
/** Of a member that readers do not use, the pages do not say whether it is an error. */
const for_people = (pointer) => ({ ...unread, issues: [{ code: ['FABRIC_MEMBER', 'FABRIC_ADVICE'], place: pointer }] });
const unread = { evaluate: null };                      // a reader may not notice

const members = [
  ...['version', 'texels', 'levels', 'mmPerRepeat', 'referenceHeight', 'thickness', 'views', 'layers', 'digests', 'provenance', 'model'].map((name) =>
    member(`${name}-missing`, `/${name}`, (text) => { delete text[name]; }, { ...others, ...(name === 'model' ? for_people('/model') : {}) })),
  member('version-text', '/version', (text) => { text.version = '1.0'; }),
  member('version-of-one-number', '/version', (text) => { text.version = [1]; }),
  member('version-fraction', '/version', (text) => { text.version = [1, 0.5]; }),
  member('model-number', '/model', (text) => { text.model = 1; }, for_people('/model')),
  member('texels-of-one-number', '/texels', (text) => { text.texels = [3]; }, others),
  member('texels-none', '/texels', (text) => { text.texels = [0, 2]; }, others),
  member('texels-too-many', '/texels', (text) => { text.texels = [4097, 2]; }, others),
  member('texels-fraction', '/texels', (text) => { text.texels = [2.5, 2]; }, others),
  member('levels-none', '/levels', (text) => { text.levels = 0; }, others),
  member('levels-beyond-the-chain', '/levels', (text) => { text.levels = 3; }),
  member('levels-text', '/levels', (text) => { text.levels = '2'; }, others),
  member('levels-fraction', '/levels', (text) => { text.levels = 1.5; }, others),
  member('mm-zero', '/mmPerRepeat', (text) => { text.mmPerRepeat = [0, 1]; }),
  member('mm-negative', '/mmPerRepeat', (text) => { text.mmPerRepeat = [1, -1]; }),
  member('mm-text', '/mmPerRepeat', (text) => { text.mmPerRepeat = ['1', '1']; }),
  member('mm-of-three-numbers', '/mmPerRepeat', (text) => { text.mmPerRepeat = [1, 1, 1]; }),
  member('mm-beyond-single-precision', '/mmPerRepeat', (text) => { text.mmPerRepeat = [1e39, 1]; }),
  member('reference-height-null', '/referenceHeight', (text) => { text.referenceHeight = null; }),
  member('reference-height-text', '/referenceHeight', (text) => { text.referenceHeight = '0.5'; }),
  member('thickness-negative', '/thickness', (text) => { text.thickness = -0.25; }),
  member('views-array', '/views', (text) => { text.views = [2, 2]; }, others),
  member('views-layout-missing', '/views/layout', (text) => { delete text.views.layout; }, others),
  member('views-columns-none', '/views/columns', (text) => { text.views.columns = 0; }, others),
  member('views-rows-fraction', '/views/rows', (text) => { text.views.rows = 2.5; }, others),
  member('views-rows-missing', '/views/rows', (text) => { delete text.views.rows; }, others),
  member('views-too-many', '/views', (text) => { text.views = { layout: 'equal-area', columns: 65, rows: 64 }; }, others),
  member('layers-array', '/layers', (text) => { text.layers = []; }, others),
  member('layer-not-an-object', '/layers/opacity', (text) => { text.layers.opacity = [0, 1]; }, others),
  member('layer-levels-missing', '/layers/opacity/levels', (text) => { delete text.layers.opacity.levels; }, others),
  member('layer-levels-empty', '/layers/opacity/levels', (text) => { text.layers.opacity.levels = []; text.digests.opacity = []; }, others),
  member('layer-levels-falling', '/layers/opacity/levels', (text) => { text.layers.opacity.levels.reverse(); text.digests.opacity.reverse(); }, others),
  member('layer-levels-twice', '/layers/opacity/levels', (text) => { text.layers.opacity.levels = [0, 0]; }, others),
  member('layer-levels-beyond', '/layers/opacity/levels', (text) => { text.layers.opacity.levels = [0, 2]; }, others),
  member('layer-levels-beyond-the-fabric', '/layers/opacity/levels', (text) => { text.levels = 1; text.layers.lobes.levels = [0]; text.digests.lobes.pop(); }, others),
  member('layer-levels-negative', '/layers/opacity/levels', (text) => { text.layers.opacity.levels = [-1, 0]; }, others),
  member('layer-levels-fraction', '/layers/opacity/levels', (text) => { text.layers.opacity.levels = [0, 0.5]; }, others),
  member('layer-levels-number', '/layers/opacity/levels', (text) => { text.layers.opacity.levels = 0; }, others),
  member('layer-precision-missing', '/layers/opacity/precision', (text) => { delete text.layers.opacity.precision; }, for_people('/layers/opacity/precision')),
  member('layer-precision-unknown', '/layers/opacity/precision', (text) => { text.layers.opacity.precision = 'double'; }, for_people('/layers/opacity/precision')),
  member('lobes-missing', '/layers/lobes/lobes', (text) => { delete text.layers.lobes.lobes; }, others),
  member('lobes-negative', '/layers/lobes/lobes', (text) => { text.layers.lobes.lobes = -1; }, others),
  member('lobes-too-many', '/layers/lobes/lobes', (text) => { text.layers.lobes.lobes = 17; }, others),
  member('lobes-fraction', '/layers/lobes/lobes', (text) => { text.layers.lobes.lobes = 0.5; }, others),
  member('digests-array', '/digests', (text) => { text.digests = Object.values(text.digests); }, others),
  member('digests-of-a-layer-missing', '/digests/opacity', (text) => { delete text.digests.opacity; }, others),
  member('digests-too-few', '/digests/opacity', (text) => { text.digests.opacity.pop(); }, others),
  member('digests-too-many', '/digests/opacity', (text) => { text.digests.opacity.push(text.digests.opacity[0]); }, others),
  member('digest-number', '/digests/opacity', (text) => { text.digests.opacity[0] = 12; }, others),
  member('digest-too-short', '/digests/opacity', (text) => { text.digests.opacity[0] = 'abc'; }, {
    ...others, issues: [{ code: ['FABRIC_MEMBER', 'FABRIC_DIGEST'], place: 'opacity' }],
  }),
  member('digest-upper-case', '/digests/lobes', (text) => { text.digests.lobes[0] = text.digests.lobes[0].toUpperCase(); }, {
    ...others, issues: [{ code: ['FABRIC_MEMBER', 'FABRIC_DIGEST'], place: 'lobes' }],
  }),
  member('provenance-text', '/provenance', (text) => { text.provenance = 'unknown'; }),
  broken('FABRIC_UNSUPPORTED', 'view-layout', 'a layout of views that is not known', '/views/layout', {
    text: (text) => { text.views.layout = 'octahedral'; }, others: 'allowed',
  }),
  broken('FABRIC_UNSUPPORTED', 'layer', 'a layer that is not known', '/layers/heights', { text: (text) => { text.layers.heights = { levels: [0] }; } }),
  broken('FABRIC_UNSUPPORTED', 'layer-not-optional', 'a layer that is not known, marked as not optional', '/layers/heights', {
    text: (text) => { text.layers.heights = { levels: [0], optional: false }; },
  }),
];

/** A part that a reader does not know, laid out as data parts are. */
const unknown_part = (name, channel) => ({
  name, compression: 'none', tile: { width: 32, height: 32 }, mipmap: true, attributes: {}, channels: [{ name: channel, type: 'half' }],
  levels: [[3, 2], [1, 1]].map(([width, height]) => ({ width, height, values: new Map([[channel, Buffer.alloc(2 * width * height)]]) })),
});

const data_part = (name, change, extra) => ({ before: (parts) => change(part_of(parts, name)), ...extra });

const parts = [
  broken('FABRIC_PART', 'missing', 'a layer is listed but its part is not there', 'opacity', {
    text: (text) => { text.layers.frame = { levels: [0], precision: 'half' }; text.digests.frame = ['0'.repeat(32)]; },
    issues: [{ code: 'FABRIC_PART', place: 'frame' }],
  }),
  broken('FABRIC_PART', 'preview-missing', 'no preview', 'preview', { before: (list) => list.shift(), ...unread }),
  broken('FABRIC_PART', 'scan-lines', 'a data part of scan lines', 'opacity',
    data_part('opacity', (part) => { part.tile = null; part.levels.length = 1; }, { layers: { lobes: {}, opacity: { levels: [0] } } })),
  broken('FABRIC_PART', 'one-level', 'a tiled data part without mip levels', 'opacity',
    data_part('opacity', (part) => { part.mipmap = false; part.levels.length = 1; }, { layers: { lobes: {}, opacity: { levels: [0] } } })),
  broken('FABRIC_PART', 'lines-decreasing', 'a data part with decreasing lines', 'opacity',
    data_part('opacity', (part) => { part.attributes.lineOrder = ['lineOrder', Buffer.from([1])]; })),
  broken('FABRIC_PART', 'lines-random', 'a data part with lines in random order', 'opacity',
    data_part('opacity', (part) => { part.attributes.lineOrder = ['lineOrder', Buffer.from([2])]; })),
  broken('FABRIC_PART', 'texels-of-the-text', 'the text has more texels than the parts', '', {
    text: (text) => { text.texels = [4, 2]; text.levels = 2; }, others: 'allowed',
  }),
  broken('FABRIC_PART', 'preview-of-another-size', 'the preview is larger than the data', 'preview', {
    before: (list) => {
      const { attributes, channels, levels } = part_of(list, 'preview');
      Object.assign(attributes, display());
      levels[0] = { width: 4, height: 4, values: new Map(channels.map(({ name }) => [name, Buffer.alloc(32)])) };
    },
    others: 'allowed', ...unread,
  }),
  broken('FABRIC_PART', 'part-of-another-size', 'a data part is smaller than the others', 'opacity',
    data_part('opacity', (part) => {
      Object.assign(part.attributes, display());
      part.levels = [{ width: 2, height: 2 }, { width: 1, height: 1 }].map((size) => ({
        ...size, values: new Map(part.channels.map(({ name, type }) => [name, pack_values(Array(size.width * size.height).fill(1), type)])),
      }));
    }, { others: 'allowed' })),
  broken('FABRIC_PART', 'unknown-part-of-another-size', 'a part that is not known has another data window', 'seams', {
    before: (list) => list.push({
      name: 'seams', compression: 'none', tile: null, attributes: display(), channels: [{ name: 'seams.depth', type: 'half' }],
      levels: [{ width: 5, height: 5, values: new Map([['seams.depth', Buffer.alloc(50)]]) }],
    }), others: 'allowed', ...unread,
  }),
  broken('FABRIC_PART', 'display-window', 'display windows that are not the data windows', '', {
    before: (list) => list.forEach((part) => { part.attributes.displayWindow = attribute.box2i(0, 0, 7, 7); }), others: 'allowed',
  }),
  broken(['FABRIC_PART', 'EXR_UNSUPPORTED'], 'window-not-at-the-origin', 'data and display windows that begin at (1, 1)', '', {
    before: (list) => list.forEach((part) => {
      part.attributes.displayWindow = part.attributes.dataWindow = attribute.box2i(1, 1, 3, 2);
    }), others: 'allowed',
  }),
  ...[['lobes', 'lobes.0.n.green'], ['lobes', 'lobes.diffuse.red'], ['frame', 'frame.ty'], ['table', 'table.0001.blue'], ['opacity', 'opacity.0001']].map(([name, channel]) =>
    broken('FABRIC_CHANNEL', `missing-${channel.replaceAll('.', '-')}`, `the channel ${channel} is missing`, channel,
      data_part(name, (part) => {
        part.channels = part.channels.filter((c) => c.name !== channel);
        part.levels.forEach(({ values }) => values.delete(channel));
      }), all_layers)),
  broken('FABRIC_CHANNEL', 'more-lobes-than-channels', 'K = 1, channels for rho alone', 'lobes.0', { text: (text) => { text.layers.lobes.lobes = 1; }, others: 'allowed' }),
  broken('FABRIC_CHANNEL', 'more-views-than-channels', '2 x 2 views, channels for two', 'opacity.0002', { text: (text) => { text.views.rows = 2; }, others: 'allowed' }),
  ...['R', 'G', 'B', 'A', 'Y'].map((letter) => broken('FABRIC_CHANNEL', `named-${letter}`, `a data channel whose name ends in ${letter}`, `opacity.${letter}`,
    data_part('opacity', ({ channels, levels }) => {
      channels.push({ name: `opacity.${letter}`, type: 'half' });
      levels.forEach(({ width, height, values }) => values.set(`opacity.${letter}`, Buffer.alloc(2 * width * height)));
    }, unread))),
  broken('FABRIC_CHANNEL', 'name-in-two-parts', 'a channel name in two parts', 'opacity.0000', {
    before: (list) => list.push(unknown_part('seams', 'opacity.0000')),
    ...unread,
  }),
  // The chunks are too small to shrink, so they are stored as they are: their pixels are right, the codec is not.
  ...['pxr24', 'b44', 'b44a', 'dwaa', 'dwab'].map((compression) =>
    broken('FABRIC_LOSSY', compression, `lobes with compression ${compression.toUpperCase()}`, 'lobes',
      data_part('lobes', (part) => { part.compression = compression; }))),
];

/** A value of one channel at one texel. */
const value = (layer, channel, number, level = 0) => ({
  value: { ...base.value, [layer]: (k, c, t) => k === level && c === channel && t === 1 ? number : base.value[layer]?.(k, c, t) },
  evaluate: { ...ask(level), texel: [level === 0 ? 1 : 0, 0] },
});
const not_finite = (what, layer, channel, number) =>
  broken('FABRIC_NOT_FINITE', what, `${channel} is ${number} at a texel`, `${layer} level 0`, value(layer, channel, number), all_layers);
const bad_frame = (what, about, frame) => broken('FABRIC_NOT_FINITE', what, about, 'frame level 0', {
  value: { ...base.value, frame: (k, c, t) => k === 0 && t === 1 ? framed(() => frame)(k, c, t) : framed(() => ({ n: [0, 0, 1], t: [1, 0, 0] }))(k, c, t) },
  evaluate: { ...ask(0), texel: [1, 0] },
}, all_layers);

const values = [
  not_finite('rho-nan', 'lobes', 'lobes.diffuse.red', NaN),
  not_finite('rho-infinite', 'lobes', 'lobes.diffuse.green', Infinity),
  not_finite('rho-negative', 'lobes', 'lobes.diffuse.blue', -0.125),
  not_finite('exponent-nan', 'lobes', 'lobes.0.n.red', NaN),
  not_finite('exponent-negative', 'lobes', 'lobes.0.n.green', -1),
  not_finite('exponent-infinite', 'lobes', 'lobes.0.n.blue', Infinity),
  not_finite('coefficient-nan', 'lobes', 'lobes.0.cx.red', NaN),
  not_finite('coefficient-infinite', 'lobes', 'lobes.0.cz.green', -Infinity),
  not_finite('table-negative', 'table', 'table.0001.red', -0.5),
  not_finite('table-nan', 'table', 'table.0000.blue', NaN),
  not_finite('table-infinite', 'table', 'table.0001.green', Infinity),
  not_finite('opacity-above-1', 'opacity', 'opacity.0001', 1.5),
  not_finite('opacity-negative', 'opacity', 'opacity.0001', -0.125),
  not_finite('opacity-nan', 'opacity', 'opacity.0000', NaN),
  bad_frame('frame-zero', 'a normal of length 0', { n: [0, 0, 0], t: [1, 0, 0] }),
  bad_frame('frame-not-unit', 'a tangent of length 0.5', { n: [0, 0, 1], t: [0.5, 0, 0] }),
  bad_frame('frame-not-perpendicular', 'a tangent at 60 degrees to the normal', { n: [0, 0, 1], t: [0.75 ** 0.5, 0, 0.5] }),
  bad_frame('frame-nan', 'a normal of NaN', { n: [NaN, 0, 1], t: [1, 0, 0] }),
  broken('FABRIC_NOT_FINITE', 'at-a-coarse-level', 'a negative opacity at level 1', 'opacity level 1', {
    value: { ...base.value, opacity: (k) => k === 1 ? -1 : undefined }, evaluate: ask(1),
  }),
];

const digests = [
  ...[0, 1].map((level) => broken('FABRIC_DIGEST', `pixels-of-level-${level}`, `a value of level ${level} is not the one that the digest was made of`, `opacity level ${level}`, {
    after: (list) => {
      const { values: stored } = part_of(list, 'opacity').levels[level];
      stored.set('opacity.0001', pack_values(Array(stored.get('opacity.0001').length / 2).fill(0.625), 'half'));
    },
    evaluate: ask(level),
  })),
  broken('FABRIC_DIGEST', 'levels-swapped', 'the digests of two levels are swapped', 'lobes level 0', {
    text: (text) => { text.digests.lobes.reverse(); },
    issues: [{ code: 'FABRIC_DIGEST', place: 'lobes level 0' }, { code: 'FABRIC_DIGEST', place: 'lobes level 1' }],
  }),
  broken('FABRIC_DIGEST', 'negative-zero', 'one 0 is stored as -0: equal numbers, other bytes', 'opacity level 0', {
    value: { ...base.value, opacity: everywhere(0) },
    after: (list) => { part_of(list, 'opacity').levels[0].values.get('opacity.0000').writeUInt16LE(0x8000, 0); },
  }),
  broken('FABRIC_DIGEST', 'text-changed', 'one byte of the attribute text was changed', 'selvedge.digest', {
    bytes: (b) => changed(b, b.indexOf('conformance kit', find_attribute(b, 0, 'selvedge.fabric').at), 0x43),
  }),
  broken('FABRIC_DIGEST', 'header-digest-missing', 'no attribute selvedge.digest', 'selvedge.digest', {
    after: ([first]) => { first.attributes['selvedge.digest'] = null; },
    issues: [{ code: ['FABRIC_DIGEST', 'FABRIC_MALFORMED'], place: '' }],
  }),
  broken('FABRIC_DIGEST', 'channel-renamed', 'an unknown channel was renamed after the digest was made', 'selvedge.digest', {
    before: (list) => {
      const { channels, levels } = part_of(list, 'opacity');
      channels.push({ name: 'opacity.mean', type: 'half' });
      levels.forEach(({ width, height, values: stored }) => stored.set('opacity.mean', Buffer.alloc(2 * width * height)));
    },
    bytes: (b) => changed(b, b.indexOf('opacity.mean\0') + 11, 0x74),
  }),
  broken('FABRIC_DIGEST', 'part-renamed', 'an unknown part was renamed after the digest was made', 'selvedge.digest', {
    before: (list) => list.push(unknown_part('seams', 'seams.depth')),
    after: (list) => { part_of(list, 'seams').name = 'sewed'; },
  }),
  broken('FABRIC_DIGEST', 'part-order', 'two parts changed their places after the digest was made', 'selvedge.digest', { after: (list) => list.push(list.splice(1, 1)[0]) }),
];

export const invalid = [...exr, ...malformed, ...members, ...parts, ...values, ...digests];

const warning = (code, what, about, place, changes) => ({ ...base, name: `${code}-${what}`, about, issues: [{ code, place }], ...changes });
const mirror = (name, replacement) => warning('FABRIC_ADVICE', `mirror-${name}`, `the mirror selvedge.${name} differs from the text`, `selvedge.${name}`, {
  after: ([first]) => { first.attributes[`selvedge.${name}`] = replacement; },
});
const lobe = (rho, c, n) => (level, channel) => /\.n\./.test(channel) ? n : channel.includes('diffuse') ? rho : channel.includes('cz') ? c : 0;

export const warnings = [
  warning('FABRIC_PEAK', 'exponent-in-half', 'an exponent of 500 in half precision', 'lobes', {
    layers: { lobes: { precision: 'half' } }, K: 1, value: { lobes: lobe(0.125, 0.9375, 500) },
  }),
  warning('FABRIC_PEAK', 'beyond-half', 'a peak of 265,000, brought down by the table', 'lobes', {
    layers: ['lobes', 'table'], K: 1, value: { lobes: lobe(0.125, 1.0025, 5000), table: everywhere(2 ** -12) },
  }),
  warning('FABRIC_ENERGY', 'rho', 'rho = 2: more than six times the light comes back', 'level 0', { value: { lobes: lobe(2, 0.5, 2), opacity: everywhere(1) } }),
  warning('FABRIC_LEVELS', 'chain', 'two of four levels', '/levels', { texels: [8, 4], levels: 2 }),
  warning('FABRIC_LEVELS', 'layer', 'opacity at level 0 only', '/layers/opacity', { layers: { lobes: {}, opacity: { levels: [0] } } }),
  warning('FABRIC_ADVICE', 'unlisted-level-not-zero', 'a level beyond those of the fabric that is not zero', 'lobes level 2', {
    texels: [4, 4], levels: 3, layers: ['lobes'],
    issues: [{ code: 'FABRIC_ADVICE', place: 'lobes level 2' }, { code: 'FABRIC_LEVELS', place: '/levels' }],
    text: (text) => { text.levels = 2; text.layers.lobes.levels.pop(); text.digests.lobes.pop(); },
  }),
  warning('FABRIC_ADVICE', 'unknown-member', 'a member that is not known', '/layers/opacity/colour', { text: (text) => { text.layers.opacity.colour = 'grey'; } }),
  mirror('version', attribute.string('1.1')),
  mirror('model', attribute.string('constant')),
  mirror('mmPerRepeat', attribute.v2f(1, 1)),
  mirror('referenceHeight', attribute.float(2)),
];

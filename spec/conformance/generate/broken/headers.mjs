// Broken OpenEXR headers, features of OpenEXR that fabrics cannot have, and files beyond the limits of fabric.md.
import {attribute} from '../../reference/exr_write.mjs';
import {part_of} from '../make.mjs';
import {
  MALFORMED_OR_DAMAGED, TILE_SIZE, add_channel, base, broken, chunk_at, everywhere, find_attribute, others, renamed,
  set, unknown_part, with_bytes, with_i32, zeros
} from './common.mjs';

const UNSUPPORTED_OR_MALFORMED = ['EXR_UNSUPPORTED', 'EXR_MALFORMED'];
const header = (code, what, about, bytes, more) => broken(code, what, about, '', {bytes, ...more});
/** Another value of an attribute of the part `opacity`; null: it is missing. */
const opacity_attribute = (code, what, about, name, value, more) => broken(code, what, about, '', {
  after: (parts) => { part_of(parts, 'opacity').attributes[name] = value; },
  ...more
});
const malformed = (what, about, changes) => broken('EXR_MALFORMED', what, about, '', changes);
/** An integer `past` bytes behind the name of the first channel of `opacity`. */
const in_channel = (past, value) => (b) =>
  with_i32(b, find_attribute(b, 2, 'channels').at + 'opacity.0000\0'.length + past, value);
const flags = (change) => (b) => with_bytes(b, 5, change(b[5]));
const short_names = flags((byte) => byte & ~4);
const on_opacity = (change) => ({before: (parts) => change(part_of(parts, 'opacity'))});

const files = [
  broken('FILE_MISSING', 'no-file', 'a file that is not there', '', {file: 'fabric.exr', files: {}}),
  broken('FILE_UNREADABLE', 'folder', 'a folder instead of a file', '', {
    file: 'fabric.exr',
    files: {'fabric.exr/README': Buffer.from('A folder.\n')},
  }),
  header('EXR_MALFORMED', 'not-exr', 'a text file', () => Buffer.from('This is not a picture.\n'), others),
  header(MALFORMED_OR_DAMAGED, 'empty', 'no byte at all', () => Buffer.alloc(0), others),
  header(MALFORMED_OR_DAMAGED, 'header-cut', 'the file ends within the header', (b) => b.subarray(0, 700)),
  ...[
    ['version-3', 'version 3 of OpenEXR', (b) => with_bytes(b, 4, 3)],
    ['unknown-flag', 'an unknown flag', flags((byte) => byte | 0x20)],
    ['flag-deep', 'the flag for deep data', flags((byte) => byte | 8)],
    ['flag-tiles', 'the flag for a tiled file of one part', flags((byte) => byte | 2)],
    ['single-part', 'no flag for several parts', flags((byte) => byte & ~0x10)],
  ].map(([what, about, bytes]) => header('EXR_UNSUPPORTED', what, about, bytes)),
];

const REQUIRED = ['channels', 'compression', 'dataWindow', 'lineOrder', 'name', 'type', 'chunkCount', 'tiles'];
const named = (name) => on_opacity((part) => {
  part.attributes[name] = ['string', Buffer.alloc(0)];
});
const size_of_wrapmodes = (size) => (b) => with_i32(b, find_attribute(b, 0, 'wrapmodes').at - 4, size);
const attributes = [
  header(
    MALFORMED_OR_DAMAGED, 'attribute-longer-than-file', 'the size of an attribute is 2^31 - 1',
    size_of_wrapmodes(0x7FFFFFFF)),
  header('EXR_MALFORMED', 'attribute-of-negative-size', 'the size of an attribute is -1', size_of_wrapmodes(-1)),
  ...REQUIRED.map(
    (name) => opacity_attribute('EXR_MALFORMED', `missing-${name}`, `a part without the attribute ${name}`, name, null)),
  opacity_attribute('EXR_MALFORMED', 'attribute-of-another-type', 'lineOrder as an int', 'lineOrder', attribute.int(0)),
  opacity_attribute(
    'EXR_MALFORMED', 'attribute-of-another-size', 'a data window of eight bytes', 'dataWindow', ['box2i', Buffer.alloc(8)]),
  malformed('attribute-twice', 'a duplicate attribute', {
    ...on_opacity((part) => { part.attributes.seam1 = part.attributes.seam2 = attribute.int(1); }),
    bytes: renamed('seam2\0', 'seam1\0'),
  }),
  ...[
    ['attribute-name-with-a-control-character', 'a line feed in the name of an attribute', named('seam\n')],
    ['attribute-name-not-utf-8', 'the byte FF in the name of an attribute', named('seam\xFF')],
    [
      'attribute-name-of-32-bytes', 'a name of 32 bytes without the flag for long names',
      {...named('s'.repeat(32)), bytes: short_names}
    ],
    ['attribute-name-of-256-bytes', 'a name of 256 bytes', named('s'.repeat(256))],
  ].map((row) => malformed(...row)),
];

const part_named = (name) => ({before: (parts) => parts.push({...unknown_part('seams', 'seams.depth'), name})});
const byte_of = (type, value) => [type, Buffer.from([value])];
const COMPRESSIONS = {rle: 1, zips: 2, piz: 4, pxr24: 5, b44: 6, b44a: 7, dwaa: 8, dwab: 9, unknown: 10};
const LINE_ORDERS = {decreasing: 1, random: 2, unknown: 3};
const parts = [
  malformed('same-part-twice', 'two parts of the same name', {
    before: (list) => list.push({...part_of(list, 'opacity'), attributes: {}}),
    ...others,
  }),
  malformed('part-without-a-name', 'a part whose name is empty', part_named('')),
  malformed('part-name-with-a-control-character', 'an escape in the name of a part', part_named('sea\x1Bms')),
  opacity_attribute(
    'EXR_MALFORMED', 'data-window-inverted', 'a data window that ends before it begins', 'dataWindow',
    attribute.box2i(0, 0, -5, 1)),
  opacity_attribute(
    'EXR_UNSUPPORTED', 'data-window-not-at-the-origin', 'a data window that begins at (1, 1)', 'dataWindow',
    attribute.box2i(1, 1, 3, 2)),
  ...Object.entries(LINE_ORDERS).map(([what, order]) => opacity_attribute(
    'EXR_UNSUPPORTED', `line-order-${what}`, `line order ${order}`, 'lineOrder', byte_of('lineOrder', order))),
  ...Object.entries(COMPRESSIONS).map(([what, number]) => opacity_attribute(
    'EXR_UNSUPPORTED', `compression-${what}`, `compression ${number}`, 'compression', byte_of('compression', number))),
  opacity_attribute(
    MALFORMED_OR_DAMAGED, 'chunk-count', 'chunkCount is not the number of chunks', 'chunkCount', attribute.int(1000000)),
  ...['volume', 'deeptile'].map((type) => opacity_attribute(
    UNSUPPORTED_OR_MALFORMED, `part-of-type-${type}`, `a part of type ${type}`, 'type', attribute.string(type), others)),
];

const tile_mode = (mode) => (b) => with_bytes(b, find_attribute(b, 2, 'tiles').at + 8, mode);
const tiles = [
  opacity_attribute(
    'EXR_MALFORMED', 'tiles-of-no-size', 'tiles of 0 x 0', 'tiles', ['tiledesc', Buffer.from([0, 0, 0, 0, 0, 0, 0, 0, 1])]),
  ...[
    ['one-level', 'tiles of one level', 0], ['rip-map', 'rip maps', 2], ['tile-mode-unknown', 'tiles of mode 3', 3],
    ['levels-rounded-up', 'levels whose sides are rounded up', 0x11]
  ].map(([what, about, mode]) => header('EXR_UNSUPPORTED', what, about, tile_mode(mode), others)),
];

const channel_named = (name) => on_opacity(add_channel(name));
const channels = [
  header(UNSUPPORTED_OR_MALFORMED, 'pixel-type', 'a channel of pixel type 7', in_channel(0, 7)),
  header('EXR_UNSUPPORTED', 'integers', 'a channel of integers', in_channel(0, 0), others),
  header(UNSUPPORTED_OR_MALFORMED, 'sub-sampled', 'a channel with every second pixel only', in_channel(8, 2), others),
  header(UNSUPPORTED_OR_MALFORMED, 'sampling-of-0', 'a channel whose sampling is 0', in_channel(8, 0)),
  opacity_attribute(
    'EXR_MALFORMED', 'no-channels', 'an empty list of channels', 'channels', ['chlist', Buffer.from([0])]),
  opacity_attribute(
    'EXR_MALFORMED', 'channels-without-end', 'a list of channels without its final zero', 'channels',
    ['chlist', Buffer.from('opacity.0000')]),
  ...[
    [
      'channels-and-more', 'bytes behind the end of the list of channels',
      {bytes: (b) => with_bytes(b, find_attribute(b, 2, 'channels').at + 'opacity.0000\0'.length + 16, 0)}
    ],
    [
      'channels-out-of-order', 'channels that are not in the byte order of their names',
      {bytes: renamed('opacity.0000\0', 'opacity.0002\0')}
    ],
    ['channel-twice', 'a duplicate channel', {bytes: renamed('opacity.0001\0', 'opacity.0000\0')}],
    ['channel-name-with-a-control-character', 'a bell in the name of a channel', channel_named('opacity.x\x07')],
    ['channel-name-not-utf-8', 'the byte FF in the name of a channel', channel_named('opacity.x\xFF')],
    [
      'channel-name-of-32-bytes', 'a name of 32 bytes without the flag for long names',
      {...channel_named('opacity.'.padEnd(32, 'x')), bytes: short_names}
    ],
  ].map((row) => malformed(...row)),
];

/** Other sizes of a part in its header; the chunks hold next to nothing. */
function pretend([width, height], count, part) {
  part.attributes.dataWindow = part.attributes.displayWindow = attribute.box2i(0, 0, width - 1, height - 1);
  if (part.tile) part.tile = {width, height};
  part.levels = Array.from({length: count}, () => zeros(part.channels, 1, 1));
}
const short_name = (i) => i.toString(36);
/** An unknown part of `count` channels. */
function part_of_channels(count) {
  const {channels: [channel], ...part} = unknown_part('seams', 'seams.depth', 0);
  const names = Array.from({length: count}, (_, i) => short_name(i)).sort((a, b) => Buffer.compare(Buffer.from(a), Buffer.from(b)));
  const all = names.map((name) => ({...channel, name}));
  return {...part, channels: all, levels: [zeros(all, 3, 2), zeros(all, 1, 1)]};
}
const too_large = (what, about, changes) => broken('FILE_TOO_LARGE', what, about, '', changes);
const TOO_LARGE_OR_DAMAGED = ['FILE_TOO_LARGE', 'FILE_DAMAGED'];
/** Fixtures whose limit only a large file exceeds are `large`: they are stored packed. */
const limits = [
  too_large('pixels', 'a data window of 65,536 x 32,768 pixels', {
    after: (list) => pretend([65536, 32768], 17, part_of(list, 'opacity')),
    ...others,
  }),
  too_large('parts', '65 parts', {
    before: (list) => {
      for (let i = list.length; i < 65; ++i) list.push(unknown_part(`x${i}`, `x${i}.q`));
    },
  }),
  too_large('attributes', '4,097 attributes in a part', on_opacity((part) => {
    // OpenEXR's own attributes and wrapmodes are 13.
    for (let i = 13; i < 4097; ++i) part.attributes[short_name(i)] = ['x', Buffer.alloc(0)];
  })),
  too_large(
    'channels', '32,769 channels in a part', {large: true, before: (list) => list.push(part_of_channels(32769))}),
  too_large('header', 'an unknown attribute of 2^24 bytes', {
    large: true,
    ...on_opacity((part) => { part.attributes.seam = ['blob', Buffer.alloc(2 ** 24)]; }),
  }),
  broken(TOO_LARGE_OR_DAMAGED, 'chunk-from-one-byte', '32,768 bytes of floats from a chunk of one byte', '', {
    texels: [64, 64],
    value: {...base.value, opacity: everywhere(1)},
    bytes: (b) => with_i32(b, chunk_at(b, 2) + TILE_SIZE, 1),
  }),
  broken(TOO_LARGE_OR_DAMAGED, 'level-of-so-small-a-file', '4,096 x 4,096 texels in a file of a few kilobytes', '', {
    text: set('/texels', [4096, 4096]),
    // 13 tiles, or 256 blocks of 16 lines.
    after: (list) => list.forEach((part) => pretend([4096, 4096], part.tile ? 13 : 256, part)),
    ...others,
  }),
];

export const broken_headers = [...files, ...attributes, ...parts, ...tiles, ...channels, ...limits];

// Broken OpenEXR headers, and valid ones of files that are not read.
import {attribute} from '../../reference/exr_write.mjs';
import {part_of} from '../make.mjs';
import {
  MALFORMED_OR_DAMAGED,
  add_channel,
  broken,
  find_attribute,
  others,
  renamed,
  unknown_part,
  with_bytes,
  with_i32,
} from './common.mjs';

const UNSUPPORTED_OR_MALFORMED = ['EXR_UNSUPPORTED', 'EXR_MALFORMED'];
const UNSUPPORTED_OR_PART = ['EXR_UNSUPPORTED', 'FABRIC_PART', 'EXR_MALFORMED'];

const header = (code, what, about, bytes, more) => broken(code, what, about, '', {bytes, ...more});
/** An attribute of the part `opacity` that is another, or missing. */
const opacity_attribute = (code, what, about, name, value, more) => broken(code, what, about, '', {
  after: (parts) => {
    part_of(parts, 'opacity').attributes[name] = value;
  },
  ...more
});
/** An attribute of all parts. */
const every_attribute = (code, what, about, name, value) => broken(code, what, about, '', {
  after: (parts) => parts.forEach(({attributes}) => {
    attributes[name] = value;
  }),
});
const malformed = (what, about, changes) => broken('EXR_MALFORMED', what, about, '', changes);
/**
 * An integer `past` bytes behind the beginning of the list of channels of `opacity`, whose first name is 12
 * long.
 */
const in_channel = (past, value) => (b) =>
  with_i32(b, find_attribute(b, 2, 'channels').at + 'opacity.0000\0'.length + past, value);
const flags = (change) => (b) => with_bytes(b, 5, change(b[5]));
const short_names = flags((byte) => byte & ~4);
const on_opacity = (change) => (parts) => change(part_of(parts, 'opacity'));

const files = [
  broken('FILE_MISSING', 'no-file', 'a file that is not there', '', {file: 'fabric.exr', files: {}}),
  broken('FILE_UNREADABLE', 'folder', 'a folder instead of a file', '', {
    file: 'fabric.exr',
    files: {'fabric.exr/README': Buffer.from('A folder.\n')},
  }),
  header('EXR_MALFORMED', 'not-exr', 'a text file', () => Buffer.from('This is not a picture.\n'), others),
  header(MALFORMED_OR_DAMAGED, 'empty', 'no byte at all', () => Buffer.alloc(0), others),
  header(MALFORMED_OR_DAMAGED, 'header-cut', 'the file ends within the header', (b) => b.subarray(0, 700)),
  header('EXR_UNSUPPORTED', 'version-3', 'version 3 of OpenEXR', (b) => with_bytes(b, 4, 3)),
  header('EXR_UNSUPPORTED', 'unknown-flag', 'a flag that is not known', flags((byte) => byte | 0x20)),
  header('EXR_UNSUPPORTED', 'flag-deep', 'the flag for deep data', flags((byte) => byte | 8)),
  header(
    UNSUPPORTED_OR_MALFORMED, 'flag-tiles-of-several-parts',
    'the flag for a tiled file of one part in one of several', flags((byte) => byte | 2)),
  malformed('type-is-not-the-flag', 'a file in the plain form whose type is not what its flags say', {
    layers: [],
    plain: true,
    after: ([first]) => {
      first.attributes.type = attribute.string('tiledimage');
    }
  }),
];

const REQUIRED = [
  'channels', 'compression', 'dataWindow', 'displayWindow', 'lineOrder', 'pixelAspectRatio',
  'screenWindowCenter', 'screenWindowWidth', 'name', 'type', 'chunkCount', 'tiles'
];
const named = (name) => ({
  before: on_opacity((part) => {
    part.attributes[name] = ['string', Buffer.alloc(0)];
  })
});

const attributes = [
  header(
    MALFORMED_OR_DAMAGED, 'attribute-longer-than-file', 'the size of an attribute is 2^31 - 1',
    (b) => with_i32(b, find_attribute(b, 0, 'wrapmodes').at - 4, 0x7FFFFFFF)),
  header(
    'EXR_MALFORMED', 'attribute-of-negative-size', 'the size of an attribute is -1',
    (b) => with_i32(b, find_attribute(b, 0, 'wrapmodes').at - 4, -1)),
  ...REQUIRED.map(
    (name) => opacity_attribute(
      'EXR_MALFORMED', `missing-${name}`, `a part without the attribute ${name}`, name, null)),
  opacity_attribute(
    'EXR_MALFORMED', 'attribute-of-another-type', 'lineOrder as an int', 'lineOrder', attribute.int(0)),
  opacity_attribute(
    'EXR_MALFORMED', 'attribute-of-another-size', 'a float of eight bytes, in an attribute that is not known',
    'seam', ['float', Buffer.alloc(8)]),
  malformed('attribute-twice', 'an attribute that is there twice', {
    before: on_opacity((part) => {
      part.attributes.seam1 = part.attributes.seam2 = attribute.int(1);
    }),
    bytes: renamed('seam2\0', 'seam1\0'),
  }),
  malformed(
    'attribute-name-with-a-control-character', 'a line feed in the name of an attribute', named('seam\n')),
  malformed('attribute-name-not-utf-8', 'the byte FF in the name of an attribute', named('seam\xFF')),
  malformed(
    'attribute-name-of-32-bytes', 'a name of 32 bytes without the flag for long names',
    {...named('s'.repeat(32)), bytes: short_names}),
  malformed('attribute-name-of-256-bytes', 'a name of 256 bytes', named('s'.repeat(256))),
  malformed('type-name-with-a-control-character', 'a tabulator in the name of a type', {
    before: on_opacity((part) => {
      part.attributes.seam = ['a\tb', Buffer.alloc(0)];
    })
  }),
];

const part_named = (name) =>
  ({before: (parts) => parts.push({...unknown_part('seams', 'seams.depth'), name})});

const parts = [
  malformed('same-part-twice', 'two parts of the same name', {
    before: (list) => list.push({...part_of(list, 'opacity'), attributes: {}}),
    ...others,
  }),
  malformed('part-without-a-name', 'a part whose name is empty', part_named('')),
  malformed('part-name-with-a-control-character', 'an escape in the name of a part', part_named('sea\x1Bms')),
  opacity_attribute(
    'EXR_MALFORMED', 'display-windows-differ', 'a part with another display window', 'displayWindow',
    attribute.box2i(0, 0, 3, 1)),
  opacity_attribute(
    'EXR_MALFORMED', 'pixel-aspect-ratios-differ', 'a part with another pixelAspectRatio', 'pixelAspectRatio',
    attribute.float(2)),
  every_attribute(
    'EXR_MALFORMED', 'pixel-aspect-ratio-of-0', 'a pixelAspectRatio of 0', 'pixelAspectRatio',
    attribute.float(0)),
  every_attribute(
    'EXR_MALFORMED', 'screen-window-width-nan', 'a screenWindowWidth of NaN', 'screenWindowWidth',
    attribute.float(NaN)),
  opacity_attribute(
    'EXR_MALFORMED', 'data-window-inverted', 'a data window that ends before it begins', 'dataWindow',
    attribute.box2i(0, 0, -5, 1)),
  every_attribute(
    'EXR_MALFORMED', 'display-window-out-of-range', 'a display window up to 2^30', 'displayWindow',
    attribute.box2i(0, 0, 2 ** 30, 1)),
  opacity_attribute(
    'EXR_MALFORMED', 'line-order-unknown', 'line order 3', 'lineOrder', ['lineOrder', Buffer.from([3])]),
  malformed('scan-lines-in-random-order', 'random line order, which is for tiles, of scan lines', {
    after: ([first]) => {
      first.attributes.lineOrder = ['lineOrder', Buffer.from([2])];
    }
  }),
  opacity_attribute(
    'EXR_UNSUPPORTED', 'compression-unknown', 'compression 10', 'compression',
    ['compression', Buffer.from([10])]),
  opacity_attribute(
    MALFORMED_OR_DAMAGED, 'chunk-count', 'chunkCount is not the number of chunks', 'chunkCount',
    attribute.int(1000000)),
  opacity_attribute(
    UNSUPPORTED_OR_MALFORMED, 'part-of-another-type', 'a part of type volume', 'type',
    attribute.string('volume')),
  opacity_attribute(
    UNSUPPORTED_OR_MALFORMED, 'deep', 'a part of deep tiles', 'type', attribute.string('deeptile'),
    {bytes: flags((byte) => byte | 8), ...others}),
];

const tiles = [
  opacity_attribute(
    'EXR_MALFORMED', 'tiles-of-no-size', 'tiles of 0 x 0', 'tiles',
    ['tiledesc', Buffer.from([0, 0, 0, 0, 0, 0, 0, 0, 1])]),
  header(
    'EXR_MALFORMED', 'tile-mode-unknown', 'tiles of mode 3',
    (b) => with_bytes(b, find_attribute(b, 2, 'tiles').at + 8, 3)),
  header(
    UNSUPPORTED_OR_PART, 'rip-map', 'a part with rip maps',
    (b) => with_bytes(b, find_attribute(b, 2, 'tiles').at + 8, 2), others),
  header(
    UNSUPPORTED_OR_PART, 'levels-rounded-up', 'levels whose sides are rounded up',
    (b) => with_bytes(b, find_attribute(b, 2, 'tiles').at + 8, 0x11), others),
];

const channel_named = (name) => ({before: on_opacity(add_channel(name))});

const channels = [
  header('EXR_MALFORMED', 'pixel-type', 'a channel of pixel type 7', in_channel(0, 7)),
  header(
    ['EXR_UNSUPPORTED', 'FABRIC_CHANNEL'], 'integers', 'a channel of integers', in_channel(0, 0), others),
  header(
    UNSUPPORTED_OR_MALFORMED, 'sub-sampled', 'a channel with every second pixel only', in_channel(8, 2),
    others),
  header(
    ['EXR_MALFORMED', 'EXR_UNSUPPORTED'], 'sampling-of-0', 'a channel whose sampling is 0', in_channel(8, 0)),
  opacity_attribute(
    'EXR_MALFORMED', 'no-channels', 'an empty list of channels', 'channels', ['chlist', Buffer.from([0])]),
  opacity_attribute(
    'EXR_MALFORMED', 'channels-without-end', 'a list of channels that no zero ends', 'channels',
    ['chlist', Buffer.from('opacity.0000')]),
  malformed(
    'channels-and-more', 'bytes behind the end of the list of channels',
    {bytes: (b) => with_bytes(b, find_attribute(b, 2, 'channels').at + 'opacity.0000\0'.length + 16, 0)}),
  malformed('channels-out-of-order', 'channels that are not in the byte order of their names', {
    bytes: renamed('opacity.0000\0', 'opacity.0002\0'),
  }),
  malformed(
    'channel-twice', 'a channel that is there twice', {bytes: renamed('opacity.0001\0', 'opacity.0000\0')}),
  malformed(
    'channel-name-with-a-control-character', 'a bell in the name of a channel',
    channel_named('opacity.x\x07')),
  malformed('channel-name-not-utf-8', 'the byte FF in the name of a channel', channel_named('opacity.x\xFF')),
  malformed(
    'channel-name-of-32-bytes', 'a name of 32 bytes without the flag for long names',
    {...channel_named('opacity.'.padEnd(32, 'x')), bytes: short_names}),
];

export const broken_headers = [...files, ...attributes, ...parts, ...tiles, ...channels];

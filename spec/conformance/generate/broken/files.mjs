// Broken OpenEXR files, and files whose attribute text cannot be read.
import {attribute} from '../../reference/exr_write.mjs';
import {part_of} from '../make.mjs';
import {
  TILE_DATA,
  TILE_LEVEL,
  TILE_SIZE,
  ask,
  broken,
  chunk_at,
  find_attribute,
  opacity_on_0,
  others,
  set,
  unread,
  with_bytes,
  with_i32,
  zeros,
} from './common.mjs';

const MALFORMED_OR_DAMAGED = ['EXR_MALFORMED', 'FILE_DAMAGED'];
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
/**
 * An integer `past` bytes behind the beginning of the list of channels of `opacity`, whose first name is 12
 * long.
 */
const in_channel = (past, value) => (b) =>
  with_i32(b, find_attribute(b, 2, 'channels').at + 'opacity.0000\0'.length + past, value);

const headers = [
  header('EXR_MALFORMED', 'not-exr', 'a text file', () => Buffer.from('This is not a picture.\n'), others),
  header(MALFORMED_OR_DAMAGED, 'empty', 'no byte at all', () => Buffer.alloc(0), others),
  header(MALFORMED_OR_DAMAGED, 'header-cut', 'the file ends within the header', (b) => b.subarray(0, 700)),
  header(
    MALFORMED_OR_DAMAGED, 'attribute-longer-than-file', 'the size of an attribute is 2^31 - 1',
    (b) => with_i32(b, find_attribute(b, 0, 'wrapmodes').at - 4, 0x7FFFFFFF)),
  header(
    'EXR_MALFORMED', 'attribute-of-negative-size', 'the size of an attribute is -1',
    (b) => with_i32(b, find_attribute(b, 0, 'wrapmodes').at - 4, -1)),
  header('EXR_MALFORMED', 'pixel-type', 'a channel of pixel type 7', in_channel(0, 7)),
  opacity_attribute(
    'EXR_MALFORMED', 'no-channels', 'a part without the attribute channels', 'channels', null),
  opacity_attribute('EXR_MALFORMED', 'no-data-window', 'a part without a data window', 'dataWindow', null),
  opacity_attribute(
    'EXR_MALFORMED', 'data-window-inverted', 'a data window that ends before it begins', 'dataWindow',
    attribute.box2i(0, 0, -5, 1)),
  opacity_attribute(
    'EXR_MALFORMED', 'tiles-of-no-size', 'tiles of 0 x 0', 'tiles',
    ['tiledesc', Buffer.from([0, 0, 0, 0, 0, 0, 0, 0, 1])]),
  opacity_attribute(
    MALFORMED_OR_DAMAGED, 'chunk-count', 'chunkCount is not the number of chunks', 'chunkCount',
    attribute.int(1000000)),
  broken('EXR_MALFORMED', 'same-part-twice', 'two parts of the same name', '', {
    before: (parts) => parts.push({...part_of(parts, 'opacity'), attributes: {}}),
    ...others,
  }),
  header(
    ['EXR_UNSUPPORTED', 'FABRIC_CHANNEL'], 'integers', 'a channel of integers', in_channel(0, 0), others),
  header(
    UNSUPPORTED_OR_MALFORMED, 'sub-sampled', 'a channel with every second pixel only', in_channel(8, 2),
    others),
  opacity_attribute(
    UNSUPPORTED_OR_MALFORMED, 'deep', 'a part of deep tiles', 'type', attribute.string('deeptile'), {
      bytes: (b) => with_bytes(b, 5, b[5] | 8),
      ...others,
    }),
  header(
    UNSUPPORTED_OR_PART, 'rip-map', 'a part with rip maps',
    (b) => with_bytes(b, find_attribute(b, 2, 'tiles').at + 8, 2), others),
  header(
    UNSUPPORTED_OR_PART, 'levels-rounded-up', 'levels whose sides are rounded up',
    (b) => with_bytes(b, find_attribute(b, 2, 'tiles').at + 8, 0x11), others),
];

const damaged = (what, about, place, bytes, more) =>
  broken('FILE_DAMAGED', what, about, place, {bytes, ...more});

const chunks = [
  damaged(
    'chunk-table-cut', 'the file ends within the tables of chunks', '',
    (b) => b.subarray(0, chunk_at(b, 0) - 12), {
      issues: [{code: MALFORMED_OR_DAMAGED, place: ''}],
    }),
  damaged(
    'last-chunk-cut', 'the last byte is missing', 'opacity', (b) => b.subarray(0, -1), {evaluate: ask(1)}),
  damaged(
    'data-cut', 'the file ends after the first data part', 'opacity', (b) => b.subarray(0, chunk_at(b, 2))),
  damaged(
    'preview-chunk', 'a chunk of the preview cannot be decoded', 'preview',
    (b) => with_i32(b, chunk_at(b, 0) + 8, 3), unread),
  damaged(
    'unlisted-level', 'a chunk of a level that is not listed cannot be decoded', 'opacity',
    (b) => with_i32(b, chunk_at(b, 2, 1) + TILE_SIZE, 1), {...opacity_on_0, ...unread}),
  damaged(
    'chunk-beyond-the-end', 'a chunk table points beyond the file', 'opacity',
    (b) => {
      const copy = Buffer.from(b), offset = Buffer.alloc(8);
      offset.writeBigUInt64LE(BigInt(chunk_at(b, 2)));
      copy.writeBigUInt64LE(BigInt(b.length) + 1000n, copy.indexOf(offset));
      return copy;
    }),
  damaged(
    'chunk-of-another-part', 'a chunk says that it belongs to another part', 'opacity',
    (b) => with_i32(b, chunk_at(b, 2), 1)),
  damaged(
    'chunk-of-another-level', 'a tile says that it belongs to another level', 'opacity',
    (b) => with_i32(b, chunk_at(b, 2) + TILE_LEVEL, 1)),
  damaged(
    'chunk-of-negative-size', 'a chunk of the size -1', 'opacity',
    (b) => with_i32(b, chunk_at(b, 2) + TILE_SIZE, -1)),
  damaged(
    'zip-stream', 'a compressed chunk is not a zlib stream', 'lobes',
    (b) => with_bytes(b, chunk_at(b, 1) + TILE_DATA, 0xFF, 0xFF, 0xFF, 0xFF)),
  damaged(
    'rle-too-short', 'a run-length coded chunk gives too few bytes', 'lobes',
    (b) => {
      const at = chunk_at(b, 1) + TILE_SIZE;
      return with_i32(b, at, b.readInt32LE(at) - 2);
    },
    {
      before: (parts) => {
        part_of(parts, 'lobes').compression = 'rle';
      }
    }),
];

/** Gives a part other sizes in its header; the chunks hold next to nothing. */
function pretend([width, height], count, part) {
  part.attributes.dataWindow = attribute.box2i(0, 0, width - 1, height - 1);
  if (part.tile) part.tile = {width, height};
  part.levels = Array.from({length: count}, () => zeros(part.channels, 1, 1));
}

const too_large = [
  broken('FILE_TOO_LARGE', 'pixels', 'a data window of 65,536 x 32,768 pixels', '', {
    after: (parts) => {
      const part = part_of(parts, 'opacity');
      pretend([65536, 32768], 17, part);
      part.attributes.displayWindow = attribute.box2i(0, 0, 2, 1);
    },
    ...others,
  }),
  broken('FILE_TOO_LARGE', 'parts', '65 parts', '', {
    before: (parts) => {
      for (let i = parts.length; i < 65; ++i) {
        const channels = [{name: `x${i}.q`, type: 'half'}];
        parts.push({
          name: `x${i}`,
          compression: 'none',
          tile: null,
          attributes: {},
          channels,
          levels: [zeros(channels, 3, 2)]
        });
      }
    },
  }),
  broken(
    ['FILE_TOO_LARGE', 'FILE_DAMAGED'], 'level-of-so-small-a-file',
    '4,096 x 4,096 texels in a file of a few kilobytes', '', {
      text: set('/texels', [4096, 4096]),
      after: (parts) => parts.forEach((part) => {
        // 13 tiles, or 256 blocks of 16 lines.
        pretend([4096, 4096], part.tile ? 13 : 256, part);
        part.attributes.displayWindow = part.attributes.dataWindow;
      }),
      ...others,
    }),
];

const text_attribute = (what, about, value, more) => broken('FABRIC_MALFORMED', what, about, '', {
  after: ([first]) => {
    first.attributes['selvedge.fabric'] = value;
  },
  ...others,
  ...more,
});

const texts = [
  text_attribute('no-text', 'no attribute text', null),
  text_attribute('text-of-another-type', 'the attribute text has the type int', attribute.int(1)),
  text_attribute('text-not-json', 'the attribute text is not JSON', attribute.string('{"version":[1,0],')),
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
  ...[[2, 0], [0, 9], [-1, 0]].map(
    (version) => broken('FABRIC_VERSION', `major-${version[0]}`, `version ${version.join('.')}`, '', {
      text: set('/version', version),
      ...others,
      ...(version[0] < 0 ? {issues: [{code: ['FABRIC_VERSION', 'FABRIC_MEMBER'], place: '/version'}]} : {}),
    })),
];

export const broken_files = [...headers, ...chunks, ...too_large, ...texts];

// Files beyond the limits that fabric.md states. Where a limit can only be broken by a large file, `large`
// says that it is kept packed.
import {LINES_PER_CHUNK} from '../../reference/reader.mjs';
import {attribute} from '../../reference/exr_write.mjs';
import {deflate} from '../deflate.mjs';
import {part_of} from '../make.mjs';
import {
  TILE_SIZE,
  base,
  broken,
  chunk_at,
  everywhere,
  others,
  set,
  unknown_part,
  unread,
  with_i32,
  zeros
} from './common.mjs';

const too_large = (what, about, changes) => broken('FILE_TOO_LARGE', what, about, '', changes);
const on_opacity = (change) => (parts) => change(part_of(parts, 'opacity'));

/** Gives a part other sizes in its header; the chunks hold next to nothing. */
function pretend([width, height], count, part) {
  part.attributes.dataWindow = attribute.box2i(0, 0, width - 1, height - 1);
  if (part.tile) part.tile = {width, height};
  part.levels = Array.from({length: count}, () => zeros(part.channels, 1, 1));
}

const short_name = (i) => i.toString(36);
const name_order = (a, b) => Buffer.compare(Buffer.from(a), Buffer.from(b));

/** A part of `count` channels that a reader does not know, of the fabric's two levels. */
function part_of_channels(count) {
  const {channels: [channel], ...part} = unknown_part('seams', 'seams.depth', 0);
  const channels =
    Array.from({length: count}, (_, i) => short_name(i)).sort(name_order).map((name) => ({...channel, name}));
  return {...part, channels, levels: [zeros(channels, 3, 2), zeros(channels, 1, 1)]};
}

/** The deflated bytes of a chunk of so many zeros; its filter makes all but the first of them 128. */
const packed_zeros = (count) => deflate(Buffer.alloc(count, 128).fill(0, 0, 1));

/** Zeros of 4,096 x 4,096 pixels, packed as they may be. */
function zeros_of_4096(channels) {
  const size = 4096;
  const packed = packed_zeros(size * LINES_PER_CHUNK.zip * channels.length * 2);
  return {channels, compression: 'zip', levels: [{width: size, height: size}], data: () => packed};
}

/** A fabric of no layer, and a part of 65 channels: 2^32 + 2^26 bytes as floats. */
function too_many_floats(parts) {
  const channels =
    Array.from({length: 65}, (_, i) => ({name: `seams.${String(i).padStart(2, '0')}`, type: 'half'}));
  const [preview] = parts;
  parts.push({...preview, name: 'seams', attributes: {...preview.attributes}, ...zeros_of_4096(channels)});
  Object.assign(preview, zeros_of_4096(preview.channels));
}

export const beyond_limits = [
  too_large('pixels', 'a data window of 65,536 x 32,768 pixels', {
    after: (parts) => {
      const part = part_of(parts, 'opacity');
      pretend([65536, 32768], 17, part);
      part.attributes.displayWindow = attribute.box2i(0, 0, 2, 1);
    },
    ...others,
  }),
  too_large('parts', '65 parts', {
    before: (parts) => {
      for (let i = parts.length; i < 65; ++i) parts.push(unknown_part(`x${i}`, `x${i}.q`));
    },
  }),
  too_large('attributes', '4,097 attributes in a part', {
    before: on_opacity((part) => {
      // Those that OpenEXR asks for, chunkCount, name, type, tiles and wrapmodes: 13.
      for (let i = 13; i < 4097; ++i) part.attributes[short_name(i)] = ['x', Buffer.alloc(0)];
    }),
  }),
  too_large('channels', '32,769 channels in a part', {
    large: true,
    before: (parts) => parts.push(part_of_channels(32769)),
  }),
  too_large('header', 'headers of 2^24 bytes and some more, for the sake of an attribute that is not known', {
    large: true,
    before: on_opacity((part) => {
      part.attributes.seam = ['blob', Buffer.alloc(2 ** 24)];
    }),
  }),
  too_large('decoded-level', 'a level of 2^32 + 2^26 bytes as floats, in a part that is not known', {
    large: true,
    layers: [],
    texels: [1, 1],
    before: too_many_floats,
    text: set('/texels', [4096, 4096]),
    ...unread,
  }),
  broken(
    ['FILE_TOO_LARGE', 'FILE_DAMAGED'], 'chunk-from-one-byte',
    '32,768 bytes of floats from a chunk of one byte', '', {
      texels: [64, 64],
      value: {...base.value, opacity: everywhere(1)},
      bytes: (b) => with_i32(b, chunk_at(b, 2) + TILE_SIZE, 1),
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

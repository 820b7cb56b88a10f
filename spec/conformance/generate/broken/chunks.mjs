// Chunks that are not where they should be, or cannot be decoded.
import {part_of} from '../make.mjs';
import {deflate} from '../deflate.mjs';
import {
  MALFORMED_OR_DAMAGED,
  TILE_DATA,
  TILE_LEVEL,
  TILE_SIZE,
  ask,
  base,
  broken,
  chunk_at,
  everywhere,
  opacity_on_0,
  unread,
  with_bytes,
  with_i32,
} from './common.mjs';

const damaged = (what, about, place, bytes, more) =>
  broken('FILE_DAMAGED', what, about, place, {bytes, ...more});
const packed_as = (name, compression) => ({
  before: (parts) => {
    part_of(parts, name).compression = compression;
  }
});

/** The offset of the first chunk of `opacity` in the table is another. */
const offset_of_opacity = (change) => (b) => {
  const copy = Buffer.from(b), offset = Buffer.alloc(8);
  offset.writeBigUInt64LE(BigInt(chunk_at(b, 2)));
  copy.writeBigUInt64LE(BigInt(change(b)), copy.indexOf(offset));
  return copy;
};

/** The last chunk of the file, that of level 1 of `opacity`, once more within the pixels of the preview. */
function share_bytes(b) {
  const last = chunk_at(b, 2, 1), pixels = chunk_at(b, 0) + 12;
  const copy = Buffer.from(b), offset = Buffer.alloc(8);
  b.copy(copy, pixels, last);
  offset.writeBigUInt64LE(BigInt(last));
  copy.writeBigUInt64LE(BigInt(pixels), copy.indexOf(offset));
  return copy;
}

const places = [
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
    'chunk-never-written', 'an offset of 0: the writer did not come to its end', 'opacity',
    offset_of_opacity(() => 0)),
  damaged(
    'chunk-within-the-header', 'an offset that leads into the header', 'opacity',
    offset_of_opacity(() => 100)),
  damaged(
    'chunk-beyond-the-end', 'an offset beyond the file', 'opacity',
    offset_of_opacity((b) => b.length + 1000)),
  damaged(
    'chunk-of-another-part', 'a chunk says that it belongs to another part', 'opacity',
    (b) => with_i32(b, chunk_at(b, 2), 1)),
  damaged(
    'chunk-of-another-row', 'a chunk says that it begins with another row', 'preview',
    (b) => with_i32(b, chunk_at(b, 0) + 4, 1)),
  damaged(
    'chunk-of-another-tile', 'a chunk says that it is another tile', 'opacity',
    (b) => with_i32(b, chunk_at(b, 2) + 4, 1)),
  damaged(
    'chunk-of-another-level', 'a tile says that it belongs to another level', 'opacity',
    (b) => with_i32(b, chunk_at(b, 2) + TILE_LEVEL, 1)),
  damaged(
    'chunks-that-share-bytes', 'a chunk within the pixels of another', '', share_bytes,
    packed_as('preview', 'none')),
];

const sizes = [
  damaged(
    'chunk-of-negative-size', 'a chunk of the size -1', 'opacity',
    (b) => with_i32(b, chunk_at(b, 2) + TILE_SIZE, -1)),
  damaged(
    'chunk-of-no-bytes', 'a chunk of the size 0', 'opacity',
    (b) => with_i32(b, chunk_at(b, 2) + TILE_SIZE, 0)),
  damaged(
    'chunk-longer-than-its-pixels', 'six packed bytes for four of pixels', 'opacity',
    (b) => Buffer.concat([with_i32(b, chunk_at(b, 2, 1) + TILE_SIZE, 6), Buffer.alloc(2)]),
    {evaluate: ask(1)}),
  damaged(
    'chunk-shorter-than-its-pixels', 'without compression, a chunk with a byte less than its pixels',
    'opacity', (b) => with_i32(b, chunk_at(b, 2) + TILE_SIZE, 23), packed_as('opacity', 'none')),
];

// Only level 0 of `lobes` has so many bytes: 3 channels of 3 x 2 floats.
const LOBES = 72;
const zip_of_lobes = (change) => ({deflate: (data) => data.length === LOBES ? change(data) : deflate(data)});
// Values that run-length codes and PIZ can pack.
const lobes_in_runs = {
  value: {lobes: everywhere(0.125)},
  ...packed_as('lobes', 'rle')
};
const opacity_of_16 = {
  texels: [16, 16],
  value: {...base.value, opacity: (level, channel, t) => t % 3 / 4},
  ...packed_as('opacity', 'piz')
};

/** Of the PIZ stream of level 0 of `opacity`: where its 20 bytes of header begin. */
function piz_header(b) {
  const at = chunk_at(b, 2) + TILE_DATA;
  return at + 4 + Math.max(0, b.readUInt16LE(at + 2) - b.readUInt16LE(at) + 1) + 4;
}

const codecs = [
  damaged(
    'preview-chunk', 'a chunk of the preview cannot be decoded', 'preview',
    (b) => with_i32(b, chunk_at(b, 0) + 8, 3), unread),
  damaged(
    'unlisted-level', 'a chunk of a level that is not listed cannot be decoded', 'opacity',
    (b) => with_i32(b, chunk_at(b, 2, 1) + TILE_SIZE, 1), {...opacity_on_0, ...unread}),
  damaged(
    'zip-stream', 'a compressed chunk is not a zlib stream', 'lobes',
    (b) => with_bytes(b, chunk_at(b, 1) + TILE_DATA, 0xFF, 0xFF, 0xFF, 0xFF)),
  damaged('zip-checksum', 'a zlib stream with a wrong checksum', 'lobes', undefined, zip_of_lobes((data) => {
            const packed = deflate(data);
            packed[packed.length - 1] ^= 1;
            return packed;
          })),
  damaged(
    'zip-too-short', 'a zlib stream that gives a byte too few', 'lobes', undefined,
    zip_of_lobes((data) => deflate(data.subarray(1)))),
  damaged(
    'zip-too-long', 'a zlib stream that gives a byte too many', 'lobes', undefined,
    zip_of_lobes((data) => deflate(Buffer.concat([data, Buffer.alloc(1)])))),
  damaged(
    'rle-too-short', 'a run-length coded chunk gives too few bytes', 'lobes',
    (b) => {
      const at = chunk_at(b, 1) + TILE_SIZE;
      return with_i32(b, at, b.readInt32LE(at) - 2);
    },
    lobes_in_runs),
  damaged(
    'rle-too-long', 'a run-length coded chunk gives too many bytes', 'lobes',
    (b) => with_bytes(b, chunk_at(b, 1) + TILE_DATA, 127), lobes_in_runs),
  damaged(
    'piz-cut', 'a PIZ chunk that ends before its stream does', 'opacity',
    (b) => {
      const at = chunk_at(b, 2) + TILE_SIZE;
      return with_i32(b, at, b.readInt32LE(at) - 8);
    },
    opacity_of_16),
  // Common decoders make up what is missing; then the pixels are not those of the digest.
  damaged(
    'piz-too-short', 'a PIZ stream with fewer bits than it has codes', 'opacity',
    (b) => with_i32(b, piz_header(b) + 12, b.readInt32LE(piz_header(b) + 12) - 16),
    {...opacity_of_16, issues: [{code: ['FILE_DAMAGED', 'FABRIC_DIGEST'], place: 'opacity'}]}),
  damaged(
    'piz-symbols', 'a PIZ stream of symbols beyond 16 bits', 'opacity',
    (b) => with_i32(b, piz_header(b) + 4, 1 << 20), opacity_of_16),
];

export const broken_chunks = [...places, ...sizes, ...codecs];

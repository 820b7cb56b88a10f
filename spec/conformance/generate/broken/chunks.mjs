// Chunks with wrong offsets or sizes, or that cannot be decoded.
import {deflateSync} from 'node:zlib';
import {part_of} from '../make.mjs';
import {
  MALFORMED_OR_DAMAGED, TILE_DATA, TILE_LEVEL, TILE_SIZE, ask, broken, chunk_at, with_bytes, with_i32
} from './common.mjs';

const damaged = (what, about, place, bytes, more) => broken('FILE_DAMAGED', what, about, place, {bytes, ...more});
const uncompressed = (name) => ({
  before: (parts) => { part_of(parts, name).compression = 'none'; }
});

/** Another offset of the first chunk of `opacity` in the table. */
const offset_of_opacity = (change) => (b) => {
  const copy = Buffer.from(b), offset = Buffer.alloc(8);
  offset.writeBigUInt64LE(BigInt(chunk_at(b, 2)));
  copy.writeBigUInt64LE(BigInt(change(b)), copy.indexOf(offset));
  return copy;
};

/** The last chunk of the file, level 1 of `opacity`, is copied into the pixels of the preview. */
function overlap(b) {
  const last = chunk_at(b, 2, 1), pixels = chunk_at(b, 0) + 12;
  const copy = Buffer.from(b), offset = Buffer.alloc(8);
  b.copy(copy, pixels, last);
  offset.writeBigUInt64LE(BigInt(last));
  copy.writeBigUInt64LE(BigInt(pixels), copy.indexOf(offset));
  return copy;
}

const places = [
  damaged('chunk-table-cut', 'the file ends within the tables of chunks', '', (b) => b.subarray(0, chunk_at(b, 0) - 12), {
    issues: [{code: MALFORMED_OR_DAMAGED, place: ''}],
  }),
  damaged('last-chunk-cut', 'the last byte is missing', 'opacity', (b) => b.subarray(0, -1), {evaluate: ask(1)}),
  ...[
    ['data-cut', 'the file ends after the first data part', 'opacity', (b) => b.subarray(0, chunk_at(b, 2))],
    ['chunk-never-written', 'an offset of 0', 'opacity', offset_of_opacity(() => 0)],
    ['chunk-within-the-header', 'an offset into the header', 'opacity', offset_of_opacity(() => 100)],
    ['chunk-beyond-the-end', 'an offset beyond the file', 'opacity', offset_of_opacity((b) => b.length + 1000)],
    [
      'chunk-of-another-part', 'a chunk with the number of another part', 'opacity',
      (b) => with_i32(b, chunk_at(b, 2), 1)
    ],
    ['chunk-of-another-row', 'a chunk with another row', 'preview', (b) => with_i32(b, chunk_at(b, 0) + 4, 1)],
    ['chunk-of-another-tile', 'a chunk of another tile', 'opacity', (b) => with_i32(b, chunk_at(b, 2) + 4, 1)],
    [
      'chunk-of-another-level', 'a tile of another level', 'opacity', (b) => with_i32(b, chunk_at(b, 2) + TILE_LEVEL, 1)
    ],
    ['chunks-that-fraction-bytes', 'a chunk within the pixels of another', '', overlap, uncompressed('preview')],
  ].map((row) => damaged(...row)),
];

const opacity_size = (size) => (b) => with_i32(b, chunk_at(b, 2) + TILE_SIZE, size);
const sizes = [
  ['chunk-of-negative-size', 'a chunk of size -1', 'opacity', opacity_size(-1)],
  ['chunk-of-no-bytes', 'a chunk of size 0', 'opacity', opacity_size(0)],
  [
    'chunk-longer-than-its-pixels', 'six packed bytes for four bytes of pixels', 'opacity',
    (b) => Buffer.concat([with_i32(b, chunk_at(b, 2, 1) + TILE_SIZE, 6), Buffer.alloc(2)]), {evaluate: ask(1)}
  ],
  [
    'chunk-shorter-than-its-pixels', 'without compression, a chunk with a byte less than its pixels', 'opacity',
    opacity_size(23), uncompressed('opacity')
  ],
].map((row) => damaged(...row));

// Only level 0 of `lobes` has so many bytes: 3 channels of 3 x 2 floats.
const LOBES = 72;
const zip_of_lobes = (change) => ({deflate: (data) => data.length === LOBES ? change(data) : deflateSync(data)});
const codecs = [
  damaged(
    'zip-stream', 'a compressed chunk is not a zlib stream', 'lobes',
    (b) => with_bytes(b, chunk_at(b, 1) + TILE_DATA, 0xFF, 0xFF, 0xFF, 0xFF)),
  damaged('zip-checksum', 'a zlib stream with a wrong checksum', 'lobes', undefined, zip_of_lobes((data) => {
    const packed = deflateSync(data);
    packed[packed.length - 1] ^= 1;
    return packed;
  })),
  damaged(
    'zip-cut', 'a zlib stream without its last bytes', 'lobes', undefined,
    zip_of_lobes((data) => deflateSync(data).subarray(0, -6))),
  damaged(
    'zip-too-short', 'a zlib stream of a byte too few', 'lobes', undefined,
    zip_of_lobes((data) => deflateSync(data.subarray(1)))),
  damaged(
    'zip-too-long', 'a zlib stream of a byte too many', 'lobes', undefined,
    zip_of_lobes((data) => deflateSync(Buffer.concat([data, Buffer.alloc(1)])))),
];

export const broken_chunks = [...places, ...sizes, ...codecs];

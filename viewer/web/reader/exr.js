// Reads the subset of OpenEXR 2 that fabrics are stored in (spec/fabric.md, "The OpenEXR file"): files of several parts,
// each scanline or tiled with mip levels, half or float, uncompressed or ZIP. The structure of the whole file is checked
// before any chunk is unpacked.
import {int_at, latin1, latin1_bytes, utf8, view_of} from './bytes.js';
import {Issue, throw_issue} from './issue.js';

/** Compressions by their numbers in the file, and the lines in their chunks. */
export const COMPRESSIONS = {none: 0, zip: 3};
export const LINES_PER_CHUNK = {none: 1, zip: 16};
export const PIXEL_TYPES = ['uint', 'half', 'float'];
export const BYTES = {half: 2, float: 4};
export const LIMITS = {
  parts: 64,
  channels: 32768,
  attributes: 4096,
  header_bytes: 2 ** 24,
  pixels: 2 ** 30,
  level_bytes: 2 ** 32,  // as floats
  expansion: 2200,       // of a chunk, as floats
};
const MULTIPART = 0x1000, LONG_NAMES = 0x400, MIPMAP_ROUND_DOWN = 1;

/** Attributes that are read: their types, and the sizes of values that have one. */
const ATTRIBUTES = {
  name: ['string'], type: ['string'], channels: ['chlist'], compression: ['compression', 1], dataWindow: ['box2i', 16],
  lineOrder: ['lineOrder', 1], chunkCount: ['int', 4], tiles: ['tiledesc', 9],
};

/** Size of level `k` of a side of `n` texels. */
export const level_size = (n, k) => Math.max(1, Math.floor(n / 2 ** k));

/** Number of levels down to 1 x 1. */
export const chain_length = (w, h) => Math.floor(Math.log2(Math.max(w, h))) + 1;

const malformed = (place, message) => throw_issue('EXR_MALFORMED', place, message);
const unsupported = (place, message) => throw_issue('EXR_UNSUPPORTED', place, message);
const too_large = (place, message) => throw_issue('FILE_TOO_LARGE', place, message);

/** Whether the bytes of a name (a latin1 string) are UTF-8 without control characters. */
function is_printable(name) {
  try {
    return !/[\0-\x1F\x7F]/.test(utf8(latin1_bytes(name)));
  } catch { return false; }
}

/** A cursor over the headers, which stays within the bytes and the limit of headers. */
class Cursor {
  constructor(bytes, longest_name) {
    this.bytes = bytes;
    this.at = 0;
    this.longest_name = longest_name;
  }
  take(n) {
    if (n < 0 || this.at + n > this.bytes.length) malformed('', 'the header is cut short');
    if (this.at + n > LIMITS.header_bytes) too_large('', `more than ${LIMITS.header_bytes} bytes of headers`);
    return this.bytes.subarray(this.at, this.at += n);
  }
  i32 = () => int_at(this.take(4), 0);
  name() {
    const end = this.bytes.indexOf(0, this.at);
    if (end < 0) malformed('', 'a name without end');
    if (end - this.at > this.longest_name) malformed('', `a name is longer than ${this.longest_name} bytes`);
    const name = latin1(this.take(end - this.at));
    if (!is_printable(name)) malformed('', 'a name is not printable UTF-8');
    this.take(1);
    return name;
  }
}

function parse_channels(bytes, longest_name, place) {
  const cursor = new Cursor(bytes, longest_name), channels = [];
  for (let name; (name = cursor.name()) !== '';) {
    const type = PIXEL_TYPES[cursor.i32()];
    cursor.take(4);
    const samplings = [cursor.i32(), cursor.i32()];
    if (!BYTES[type]) unsupported(place, `channel ${name} is neither half nor float`);
    if (samplings.some((n) => n !== 1)) unsupported(place, `channel ${name} is sub-sampled`);
    if (channels.length > 0 && channels.at(-1).name >= name) malformed(place, `channel ${name} is a duplicate or not in order`);
    if (channels.length === LIMITS.channels) too_large(place, `more than ${LIMITS.channels} channels`);
    channels.push({name, type});
  }
  if (cursor.at !== bytes.length) malformed(place, 'bytes follow the list of channels');
  if (channels.length === 0) malformed(place, 'the part has no channels');
  return channels;
}

/** The attributes of a header, a Map from names to { type, value }. */
function parse_attributes(cursor, place) {
  const attributes = new Map();
  for (let name; (name = cursor.name()) !== '';) {
    const type = cursor.name(), value = cursor.take(cursor.i32());
    if (attributes.has(name)) malformed(place, `duplicate attribute ${name}`);
    const [wanted = type, size = value.length] = ATTRIBUTES[name] ?? [];
    if (type !== wanted || value.length !== size) malformed(place, `attribute ${name} of type ${type} has ${value.length} bytes`);
    if (attributes.size === LIMITS.attributes) too_large(place, `more than ${LIMITS.attributes} attributes`);
    attributes.set(name, {type, value});
  }
  return attributes;
}

/** The chunks of a part in the order of the table, each with the numbers at its beginning. */
function chunks_of(levels, tile, compression, most, place) {
  const chunks = [];
  levels.forEach((size, level) => {
    const step_x = tile ? tile.width : size.width, step_y = tile ? tile.height : LINES_PER_CHUNK[compression];
    if (Math.ceil(size.width / step_x) * Math.ceil(size.height / step_y) > most - chunks.length)
      throw_issue('FILE_DAMAGED', place, 'more chunks than the file can hold');
    for (let y = 0; y < size.height; y += step_y) {
      for (let x = 0; x < size.width; x += step_x) {
        const width = Math.min(step_x, size.width - x), height = Math.min(step_y, size.height - y);
        chunks.push({level, x, y, width, height, head: tile ? [x / step_x, y / step_y, level, level] : [y]});
      }
    }
  });
  return chunks;
}

function parse_header(cursor, index) {
  const attributes = parse_attributes(cursor, `part ${index}`);
  let place = `part ${index}`;
  const need = (attribute) => attributes.get(attribute)?.value ?? malformed(place, `the attribute ${attribute} is missing`);
  const name = latin1(need('name'));
  if (!is_printable(name) || name === '') malformed(place, 'the part has no printable name');
  place = name;
  const kind = latin1(need('type'));
  if (kind !== 'scanlineimage' && kind !== 'tiledimage') unsupported(place, `parts of type ${kind} are not read`);
  const [left, top, right, bottom] = [0, 4, 8, 12].map((at) => int_at(need('dataWindow'), at));
  const width = right - left + 1, height = bottom - top + 1;
  if (width < 1 || height < 1) malformed(place, 'the data window is empty');
  if (width * height > LIMITS.pixels) too_large(place, `${width} x ${height} pixels`);
  if (left !== 0 || top !== 0) unsupported(place, 'the data window does not begin at (0, 0)');
  const number = need('compression')[0], compression = Object.keys(COMPRESSIONS).find((c) => COMPRESSIONS[c] === number);
  if (!compression) unsupported(place, `compression ${number} is not read, only none (0) and ZIP (3)`);
  if (need('lineOrder')[0] !== 0) unsupported(place, 'the line order is not increasing');
  let tile = null, levels = [{width, height}];
  if (kind === 'tiledimage') {
    const tiles = need('tiles');
    tile = {width: int_at(tiles, 0), height: int_at(tiles, 4)};
    if (tile.width < 1 || tile.height < 1) malformed(place, 'the tiles are empty');
    if (tiles[8] !== MIPMAP_ROUND_DOWN) unsupported(place, 'the tiles are not of mip levels rounded down');
    levels = Array.from(
      {length: chain_length(width, height)}, (_, k) => ({width: level_size(width, k), height: level_size(height, k)}));
  }
  const channels = parse_channels(need('channels'), cursor.longest_name, place);
  const chunks = chunks_of(levels, tile, compression, cursor.bytes.length / 8, place);
  if (int_at(need('chunkCount'), 0) !== chunks.length) malformed(place, 'chunkCount is not the number of chunks');
  return {name, index, attributes, channels, compression, tile, levels, chunks};
}

/** Finds the packed bytes of all chunks, which begin at `first` or after it. */
function place_chunks(bytes, first, parts) {
  const used = [], view = view_of(bytes);
  for (const part of parts) {
    const pixel = part.channels.reduce((sum, {type}) => sum + BYTES[type], 0);
    for (const chunk of part.chunks) {
      const damaged = (wrong, message) => {
        if (wrong) throw_issue('FILE_DAMAGED', `${part.name}/level ${chunk.level}`, message);
      };
      const head = [part.index, ...chunk.head], begin = chunk.offset + 4 * head.length + 4;
      damaged(chunk.offset < first || begin > bytes.length, 'the offset of a chunk is out of range');
      damaged(head.some((x, i) => view.getInt32(chunk.offset + 4 * i, true) !== x), 'the offset leads to another chunk');
      const size = view.getInt32(begin - 4, true), pixels = chunk.width * chunk.height;
      damaged(size < 1 || begin + size > bytes.length, 'a chunk is empty or cut short');
      damaged(size > pixel * pixels, 'a chunk is longer than its pixels');
      damaged(part.compression === 'none' && size !== pixel * pixels, 'a chunk is not as long as its pixels');
      if (4 * part.channels.length * pixels > LIMITS.expansion * size) too_large(part.name, `${pixels} pixels from ${size} bytes`);
      chunk.packed = bytes.subarray(begin, begin + size);
      used.push([chunk.offset, begin + size]);
    }
  }
  used.sort((a, b) => a[0] - b[0]);
  if (used.some(([begin], i) => i > 0 && begin < used[i - 1][1])) throw_issue('FILE_DAMAGED', '', 'two chunks fraction bytes');
}

/** { parts }: the headers and chunks of a file (a Uint8Array), the structure of the whole file checked. */
export function read_headers(bytes) {
  if (bytes.length < 8 || int_at(bytes, 0) !== 20000630) malformed('', 'not an OpenEXR file');
  const version = int_at(bytes, 4);
  if ((version & ~LONG_NAMES) !== (2 | MULTIPART)) unsupported('', 'not a file of several parts, of version 2 and without deep data');
  const cursor = new Cursor(bytes, version & LONG_NAMES ? 255 : 31), parts = [];
  cursor.at = 8;
  do {
    if (parts.length === LIMITS.parts) too_large('', `more than ${LIMITS.parts} parts`);
    const part = parse_header(cursor, parts.length);
    if (parts.some(({name}) => name === part.name)) malformed(part.name, 'duplicate name of a part');
    parts.push(part);
  } while (bytes[cursor.at] !== 0);
  cursor.take(1);
  let {at} = cursor;
  const view = view_of(bytes);
  for (const part of parts) {
    if (at + 8 * part.chunks.length > bytes.length)
      throw_issue('FILE_DAMAGED', part.name, 'the table of chunks is cut short');
    for (const chunk of part.chunks) chunk.offset = Number(view.getBigUint64((at += 8) - 8, true));
  }
  place_chunks(bytes, at, parts);
  return {parts};
}

/** The `size` bytes of a zlib stream; null if it is damaged or of another size. */
async function inflate(packed, size) {
  const reader = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate')).getReader();
  const out = new Uint8Array(size);
  try {
    for (let at = 0;;) {
      const {done, value} = await reader.read();
      if (done) return at === size ? out : null;
      if (at + value.length > size) {
        await reader.cancel();
        return null;
      }
      out.set(value, at);
      at += value.length;
    }
  } catch { return null; }
}

/** Undoes the filter of ZIP: differences between bytes, even bytes before odd ones. */
function undo_filter(data) {
  for (let i = 1; i < data.length; ++i) data[i] = data[i] + data[i - 1] - 128;
  const out = new Uint8Array(data.length), half = (data.length + 1) >> 1;
  for (let i = 0; i < data.length; ++i) out[i] = data[(i & 1 ? half : 0) + (i >> 1)];
  return out;
}

const floats_of = ({channels, levels}, level) => channels.length * levels[level].width * levels[level].height;

/** Unpacks the chunks of some levels of a part for read_level(): `data`, the pixels row by row, or null of damaged ones. */
export async function unpack(part, levels) {
  const pixel = part.channels.reduce((sum, {type}) => sum + BYTES[type], 0);
  for (const chunk of part.chunks) {
    if (!levels.includes(chunk.level) || 4 * floats_of(part, chunk.level) > LIMITS.level_bytes) continue;
    const {packed} = chunk, size = pixel * chunk.width * chunk.height;
    // Chunks that deflate would not shrink are stored as they are.
    const filtered = packed.length === size ? null : await inflate(packed, size);
    chunk.data = packed.length === size ? packed : filtered && undo_filter(filtered);
  }
}

/**
 * One unpacked level of one part: a Map from channel names, in the order of the header, to { type, bytes }, the values row
 * by row from the top, little-endian, without padding.
 */
export function read_level(part, level) {
  const {width, height} = part.levels[level], place = `${part.name}/level ${level}`;
  if (4 * floats_of(part, level) > LIMITS.level_bytes) too_large(place, 'the decoded level is too large');
  const channels = new Map(part.channels.map(({name, type}) => [name, {type, bytes: new Uint8Array(width * height * BYTES[type])}]));
  for (const chunk of part.chunks) {
    if (chunk.level !== level) continue;
    if (!chunk.data) throw new Issue('FILE_DAMAGED', place, 'a chunk cannot be decoded');
    let at = 0;
    for (let y = chunk.y; y < chunk.y + chunk.height; ++y) {
      for (const {type, bytes} of channels.values()) {
        const size = chunk.width * BYTES[type];
        bytes.set(chunk.data.subarray(at, at += size), (y * width + chunk.x) * BYTES[type]);
      }
    }
  }
  return channels;
}

/** The value of the 16 bits of an IEEE half. */
function half_to_number(bits) {
  const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, fraction = bits & 1023;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return sign * (exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : 2 ** -24 * fraction);
}

let halves;

/** The values of a channel of read_level, a Float32Array. Typed arrays are little-endian, like the file. */
export function channel_values({type, bytes}) {
  const {buffer, byteOffset, length} = bytes.byteOffset % BYTES[type] === 0 ? bytes : Uint8Array.from(bytes);
  if (type === 'float') return new Float32Array(buffer, byteOffset, length / 4);
  halves ??= Float32Array.from({length: 65536}, (_, half) => half_to_number(half));
  const bits = new Uint16Array(buffer, byteOffset, length / 2), values = new Float32Array(bits.length);
  for (let i = 0; i < bits.length; ++i) values[i] = halves[bits[i]];
  return values;
}

// Reads OpenEXR 2 files as far as fabrics need it: scanline and tiled parts, one level or mip levels rounded
// down, half and float channels, lossless compression. The structure of the whole file is checked first; then
// one level of one part is decoded at a time (exr_level.js).
import {float_at, int_at, latin1, latin1_bytes, utf8, view_of} from './bytes.js';
import {Issue} from './issue.js';

export const COMPRESSIONS = ['none', 'rle', 'zips', 'zip', 'piz', 'pxr24', 'b44', 'b44a', 'dwaa', 'dwab'];
export const LINES_PER_CHUNK = {
  none: 1,
  rle: 1,
  zips: 1,
  zip: 16,
  piz: 32,
  pxr24: 16,
  b44: 32,
  b44a: 32,
  dwaa: 32,
  dwab: 256
};
export const PIXEL_TYPES = ['uint', 'half', 'float'];
const LINE_ORDERS = ['increasing', 'decreasing', 'random'];
export const BYTES = {
  uint: 4,
  half: 2,
  float: 4
};
export const LIMITS = {
  parts: 64,
  channels: 32768,
  attributes: 4096,
  header_bytes: 2 ** 24,
  pixels: 2 ** 30,
  level_bytes: 2 ** 32,  // as floats
  expansion: 2200,       // of a chunk, as floats
};
export const LOSSY = ['pxr24', 'b44', 'b44a', 'dwaa', 'dwab'];

const MULTIPART = 0x1000, LONG_NAMES = 0x400, TILED = 0x200;
const WINDOW_LIMIT = Math.floor((2 ** 31 - 1) / 2);

/** The sizes of attributes whose type has one. */
const TYPE_SIZES = {
  box2f: 16,
  box2i: 16,
  chromaticities: 32,
  compression: 1,
  double: 8,
  envmap: 1,
  float: 4,
  int: 4,
  keycode: 28,
  lineOrder: 1,
  m33d: 72,
  m33f: 36,
  m44d: 128,
  m44f: 64,
  rational: 8,
  tiledesc: 9,
  timecode: 8,
  v2d: 16,
  v2f: 8,
  v2i: 8,
  v3d: 24,
  v3f: 12,
  v3i: 12
};
const STANDARD_TYPES = {
  channels: 'chlist',
  compression: 'compression',
  dataWindow: 'box2i',
  displayWindow: 'box2i',
  lineOrder: 'lineOrder',
  pixelAspectRatio: 'float',
  screenWindowCenter: 'v2f',
  screenWindowWidth: 'float',
  name: 'string',
  type: 'string',
  chunkCount: 'int',
  tiles: 'tiledesc'
};

/** Size of level `k` of a side of `n` texels. */
export const level_size = (n, k) => Math.max(1, Math.floor(n / 2 ** k));

/** Number of levels down to 1 x 1. */
export const chain_length = (w, h) => Math.floor(Math.log2(Math.max(w, h))) + 1;

/** Whether the bytes of a name (a latin1 string) are UTF-8 without control characters. */
function is_printable(name) {
  try {
    return !/[\0-\x1F\x7F]/.test(utf8(latin1_bytes(name)));
  } catch { return false; }
}

/** A cursor over bytes that it never leaves; over a file it reads no more than the headers may have. */
class Cursor {
  constructor(bytes, longest_name) {
    this.bytes = bytes;
    this.at = 0;
    this.longest_name = longest_name;
  }
  take(n) {
    if (n < 0 || this.at + n > this.bytes.length)
      throw new Issue('EXR_MALFORMED', '', 'the header is cut short');
    if (this.at + n > LIMITS.header_bytes)
      throw new Issue('FILE_TOO_LARGE', '', `more than ${LIMITS.header_bytes} bytes of headers`);
    return this.bytes.subarray(this.at, this.at += n);
  }
  i32() {
    return int_at(this.take(4), 0);
  }
  name() {
    const end = this.bytes.indexOf(0, this.at);
    if (end < 0) throw new Issue('EXR_MALFORMED', '', 'a name is not ended');
    if (end - this.at > this.longest_name)
      throw new Issue('EXR_MALFORMED', '', `a name is longer than ${this.longest_name} bytes`);
    const name = latin1(this.take(end - this.at));
    if (!is_printable(name)) throw new Issue('EXR_MALFORMED', '', 'a name is not printable UTF-8');
    this.take(1);
    return name;
  }
}

function parse_channels(bytes, longest_name, place) {
  const cursor = new Cursor(bytes, longest_name);
  const channels = [];
  for (let name; (name = cursor.name()) !== '';) {
    const type = PIXEL_TYPES[cursor.i32()];
    cursor.take(4);
    const sampling = [cursor.i32(), cursor.i32()];
    if (!type) throw new Issue('EXR_MALFORMED', place, `channel ${name} has an unknown pixel type`);
    if (type === 'uint') throw new Issue('EXR_UNSUPPORTED', place, `channel ${name} holds integers`);
    if (sampling[0] !== 1 || sampling[1] !== 1)
      throw new Issue('EXR_UNSUPPORTED', place, `channel ${name} is sub-sampled`);
    if (channels.length > 0 && channels.at(-1).name >= name)
      throw new Issue('EXR_MALFORMED', place, `channels are not sorted, or ${name} is there twice`);
    if (channels.length === LIMITS.channels)
      throw new Issue('FILE_TOO_LARGE', place, `more than ${LIMITS.channels} channels`);
    channels.push({name, type});
  }
  if (cursor.at !== bytes.length)
    throw new Issue('EXR_MALFORMED', place, 'bytes follow the list of channels');
  if (channels.length === 0) throw new Issue('EXR_MALFORMED', place, 'the part has no channels');
  return channels;
}

/** The attributes of a header, a Map from names to { type, value }. */
function parse_attributes(cursor, place) {
  const wrong = (message) => {
    throw new Issue('EXR_MALFORMED', place, message);
  };
  const attributes = new Map();
  for (let name; (name = cursor.name()) !== '';) {
    const type = cursor.name();
    const value = cursor.take(cursor.i32());
    if (attributes.has(name)) wrong(`attribute ${name} is there twice`);
    if (value.length !== (TYPE_SIZES[type] ?? value.length))
      wrong(`attribute ${name} of type ${type} has ${value.length} bytes`);
    if (type !== (STANDARD_TYPES[name] ?? type)) wrong(`attribute ${name} is of type ${type}`);
    if (attributes.size === LIMITS.attributes)
      throw new Issue('FILE_TOO_LARGE', place, `more than ${LIMITS.attributes} attributes`);
    attributes.set(name, {type, value});
  }
  return attributes;
}

/** The chunks of a part in the order of the table, each with the numbers that stand at its beginning. */
function chunks_of(levels, tile, compression, most, place) {
  const chunks = [];
  levels.forEach((size, level) => {
    const step_x = tile ? tile.width : size.width, step_y = tile ? tile.height : LINES_PER_CHUNK[compression];
    if (Math.ceil(size.width / step_x) * Math.ceil(size.height / step_y) > most - chunks.length) {
      throw new Issue('FILE_DAMAGED', place, 'more chunks than the file can hold');
    }
    for (let y = 0; y < size.height; y += step_y) {
      for (let x = 0; x < size.width; x += step_x) {
        const width = Math.min(step_x, size.width - x), height = Math.min(step_y, size.height - y);
        const head = tile ? [x / step_x, y / step_y, level, level] : [y];
        chunks.push({level, x, y, width, height, head});
      }
    }
  });
  return chunks;
}

function parse_tiles(value, {width, height}, place) {
  const tile = {width: int_at(value, 0), height: int_at(value, 4), mode: value[8] & 15};
  const rounding = value[8] >> 4;
  if (tile.width < 1 || tile.height < 1) throw new Issue('EXR_MALFORMED', place, 'the tiles are empty');
  if (tile.mode > 2 || rounding > 1) throw new Issue('EXR_MALFORMED', place, 'unknown mode of tiles');
  if (tile.mode === 2 || (tile.mode === 1 && rounding === 1))
    throw new Issue('EXR_UNSUPPORTED', place, 'rip maps, and levels rounded up, are not read');
  const count = tile.mode === 1 ? chain_length(width, height) : 1;
  const levels =
    Array.from({length: count}, (_, k) => ({width: level_size(width, k), height: level_size(height, k)}));
  return {tile, levels};
}

function parse_header(cursor, index, version) {
  const multipart = (version & MULTIPART) !== 0;
  const attributes = parse_attributes(cursor, `part ${index}`);
  const string = (name) => attributes.has(name) ? latin1(attributes.get(name).value) : undefined;
  const name = string('name') ?? '';
  const place = name || `part ${index}`;
  const wrong = (message) => {
    throw new Issue('EXR_MALFORMED', place, message);
  };
  const unsupported = (message) => {
    throw new Issue('EXR_UNSUPPORTED', place, message);
  };
  const need = (attribute) =>
    attributes.get(attribute)?.value ?? wrong(`the attribute ${attribute} is missing`);
  const window = (attribute) => {
    const v = need(attribute), corners = [0, 4, 8, 12].map((at) => int_at(v, at));
    if (corners.some((x) => Math.abs(x) > WINDOW_LIMIT)) wrong(`${attribute} is out of range`);
    if (corners[0] > corners[2] || corners[1] > corners[3]) wrong(`${attribute} is empty`);
    return corners;
  };
  if (multipart) ['name', 'type'].forEach(need);
  if (!is_printable(name) || (multipart && name === '')) wrong('the part has no printable name');
  const kind = string('type') ?? (version & TILED ? 'tiledimage' : 'scanlineimage');
  if (kind !== 'scanlineimage' && kind !== 'tiledimage') unsupported(`parts of type ${kind} are not read`);
  if (!multipart && (kind === 'tiledimage') !== ((version & TILED) !== 0)) wrong('type and flags differ');
  const dataWindow = window('dataWindow'), displayWindow = window('displayWindow');
  const pixelAspectRatio = float_at(need('pixelAspectRatio'), 0);
  if (!(pixelAspectRatio >= Math.fround(1e-6) && pixelAspectRatio <= 1e6))
    wrong('pixelAspectRatio is out of range');
  need('screenWindowCenter');
  const screen = float_at(need('screenWindowWidth'), 0);
  if (!(screen >= 0 && screen < Infinity)) wrong('screenWindowWidth is out of range');
  const compression = COMPRESSIONS[need('compression')[0]] ?? unsupported('an unknown compression');
  const lineOrder = LINE_ORDERS[need('lineOrder')[0]] ?? wrong('an unknown line order');
  if (lineOrder === 'random' && kind === 'scanlineimage') wrong('scan lines in random order');
  const [x0, y0, x1, y1] = dataWindow;
  const width = x1 - x0 + 1, height = y1 - y0 + 1;
  if (width * height > LIMITS.pixels) throw new Issue('FILE_TOO_LARGE', place, `${width} x ${height} pixels`);
  if (x0 !== 0 || y0 !== 0) unsupported('the data window does not begin at (0, 0)');
  const {tile, levels} = kind === 'tiledimage' ? parse_tiles(need('tiles'), {width, height}, place) :
                                                 {tile: null, levels: [{width, height}]};
  const channels = parse_channels(need('channels'), cursor.longest_name, place);
  const chunks = chunks_of(levels, tile, compression, cursor.bytes.length / 8, place);
  if (multipart) need('chunkCount');
  if (attributes.has('chunkCount') && int_at(need('chunkCount'), 0) !== chunks.length)
    wrong('chunkCount is not the number of chunks');
  return {
    name,
    index,
    kind,
    attributes,
    channels,
    compression,
    lineOrder,
    dataWindow,
    displayWindow,
    pixelAspectRatio,
    tile,
    levels,
    chunks
  };
}

/** What all parts share, and what differs between any two of them. */
function check_together(parts) {
  for (const part of parts) {
    for (const name of ['displayWindow', 'pixelAspectRatio']) {
      if (String(part[name]) !== String(parts[0][name]))
        throw new Issue('EXR_MALFORMED', part.name, `${name} is not that of the first part`);
    }
    if (parts.find(({name}) => name === part.name) !== part)
      throw new Issue('EXR_MALFORMED', part.name, 'two parts have the same name');
  }
}

/** Finds the packed bytes of the chunks, none of them decoded. */
function place_chunks({bytes, first, multipart, parts}) {
  const used = [], view = view_of(bytes);
  for (const part of parts) {
    const pixel = part.channels.reduce((sum, {type}) => sum + BYTES[type], 0);
    for (const chunk of part.chunks) {
      const damaged = (wrong, message) => {
        if (wrong) throw new Issue('FILE_DAMAGED', `${part.name}/level ${chunk.level}`, message);
      };
      const head = multipart ? [part.index, ...chunk.head] : chunk.head;
      const begin = chunk.offset + 4 * head.length + 4;
      damaged(chunk.offset < first || begin > bytes.length, 'a chunk lies outside of the chunks');
      damaged(
        head.some((x, i) => view.getInt32(chunk.offset + 4 * i, true) !== x),
        'another chunk stands where one should');
      const size = view.getInt32(begin - 4, true);
      damaged(size < 1 || begin + size > bytes.length, 'a chunk is empty or cut short');
      const pixels = chunk.width * chunk.height;
      if (!LOSSY.includes(part.compression)) {
        damaged(size > pixel * pixels, 'a chunk is longer than its pixels');
        damaged(
          part.compression === 'none' && size !== pixel * pixels, 'a chunk is not as long as its pixels');
        if (4 * part.channels.length * pixels > LIMITS.expansion * size)
          throw new Issue('FILE_TOO_LARGE', part.name, `${pixels} pixels from ${size} bytes`);
      }
      chunk.packed = bytes.subarray(begin, begin + size);
      used.push([chunk.offset, begin + size]);
    }
  }
  used.sort((a, b) => a[0] - b[0]);
  if (used.some(([begin], i) => i > 0 && begin < used[i - 1][1]))
    throw new Issue('FILE_DAMAGED', '', 'two chunks share bytes');
}

/** Headers and chunks of a file (a Uint8Array), the structure of all of it checked. */
export function read_headers(bytes) {
  if (bytes.length < 8 || int_at(bytes, 0) !== 20000630)
    throw new Issue('EXR_MALFORMED', '', 'not an OpenEXR file');
  const version = int_at(bytes, 4);
  if ((version & 0xFF) !== 2 || version & ~(0xFF | MULTIPART | LONG_NAMES | TILED))
    throw new Issue('EXR_UNSUPPORTED', '', 'another version, deep data or an unknown kind of OpenEXR file');
  const multipart = (version & MULTIPART) !== 0;
  if (multipart && version & TILED)
    throw new Issue('EXR_MALFORMED', '', 'several parts, and the flag for tiles of one');
  const cursor = new Cursor(bytes, version & LONG_NAMES ? 255 : 31);
  cursor.at = 8;
  const parts = [];
  do {
    if (parts.length === LIMITS.parts)
      throw new Issue('FILE_TOO_LARGE', '', `more than ${LIMITS.parts} parts`);
    parts.push(parse_header(cursor, parts.length, version));
  } while (multipart && bytes[cursor.at] !== 0);
  if (multipart) cursor.take(1);
  check_together(parts);
  let {at} = cursor;
  const view = view_of(bytes);
  for (const part of parts) {
    if (at + 8 * part.chunks.length > bytes.length)
      throw new Issue('FILE_DAMAGED', part.name, 'the table of chunks is cut short');
    for (const chunk of part.chunks) chunk.offset = Number(view.getBigUint64((at += 8) - 8, true));
  }
  const file = {bytes, first: at, multipart, parts};
  place_chunks(file);
  return file;
}

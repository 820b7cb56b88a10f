// Reads OpenEXR 2 files as far as fabrics need it: scanline and tiled parts, one level or mip levels rounded
// down, half and float channels, compression NONE, RLE, ZIPS and ZIP. One level of one part is decoded at a
// time.
import {inflateSync} from 'node:zlib';
import {Issue} from './issue.mjs';

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
export const BYTES = {
  uint: 4,
  half: 2,
  float: 4
};
export const LIMITS = {
  parts: 64,
  channels: 32768,
  pixels: 2 ** 30,
  levelBytes: 2 ** 32,
  levelBytesPerFileByte: 2200
};

const MULTIPART = 0x1000, DEEP = 0x800, LONG_NAMES = 0x400, TILED = 0x200;

/** Size of level `k` of a side of `n` texels. */
export const level_size = (n, k) => Math.max(1, Math.floor(n / 2 ** k));

/** Number of levels down to 1 x 1. */
export const chain_length = (w, h) => Math.floor(Math.log2(Math.max(w, h))) + 1;

/** A cursor over the header that never leaves the file. */
class Cursor {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }
  take(n) {
    if (n < 0 || this.at + n > this.bytes.length)
      throw new Issue('EXR_MALFORMED', '', 'the header is cut short');
    return this.bytes.subarray(this.at, this.at += n);
  }
  u8() {
    return this.take(1)[0];
  }
  i32() {
    return this.take(4).readInt32LE(0);
  }
  text() {
    const end = this.bytes.indexOf(0, this.at);
    if (end < 0) throw new Issue('EXR_MALFORMED', '', 'a name is not ended');
    if (end - this.at > 255) throw new Issue('EXR_MALFORMED', '', 'a name is longer than 255 bytes');
    const name = this.take(end - this.at).toString('latin1');
    ++this.at;
    return name;
  }
}

function parse_channels(bytes, place) {
  const cursor = new Cursor(bytes);
  const channels = [];
  for (let name; (name = cursor.text()) !== '';) {
    const type = PIXEL_TYPES[cursor.i32()];
    cursor.take(4);
    const sampling = [cursor.i32(), cursor.i32()];
    if (!type) throw new Issue('EXR_MALFORMED', place, `channel ${name} has an unknown pixel type`);
    if (type === 'uint') throw new Issue('EXR_UNSUPPORTED', place, `channel ${name} holds integers`);
    if (sampling[0] !== 1 || sampling[1] !== 1)
      throw new Issue('EXR_UNSUPPORTED', place, `channel ${name} is sub-sampled`);
    channels.push({name, type});
  }
  if (cursor.at !== bytes.length)
    throw new Issue('EXR_MALFORMED', place, 'bytes follow the list of channels');
  for (let i = 1; i < channels.length; ++i) {
    if (
      Buffer.compare(Buffer.from(channels[i - 1].name, 'latin1'), Buffer.from(channels[i].name, 'latin1')) >=
      0) {
      throw new Issue(
        'EXR_MALFORMED', place, `channels are not sorted, or ${channels[i].name} is there twice`);
    }
  }
  return channels;
}

function parse_header(cursor, index, version) {
  const attributes = new Map();
  for (let name; (name = cursor.text()) !== '';) {
    const type = cursor.text();
    const value = cursor.take(cursor.i32());
    if (attributes.has(name))
      throw new Issue('EXR_MALFORMED', `part ${index}`, `attribute ${name} is there twice`);
    attributes.set(name, {type, value});
  }
  const string = (name) => attributes.get(name)?.value.toString('latin1');
  const place = string('name') ?? `part ${index}`;
  const need = (name, type, size) => {
    const attribute = attributes.get(name);
    if (attribute?.type !== type || (size !== undefined && attribute.value.length !== size)) {
      throw new Issue('EXR_MALFORMED', place, `the attribute ${name} is missing or malformed`);
    }
    return attribute.value;
  };
  const window = (name) => {
    const v = need(name, 'box2i', 16);
    return [0, 4, 8, 12].map((at) => v.readInt32LE(at));
  };
  const multipart = (version & MULTIPART) !== 0;
  if (multipart) ['name', 'type'].forEach((name) => need(name, 'string'));
  const kind = multipart ? string('type') : version & TILED ? 'tiledimage' : 'scanlineimage';
  if (kind !== 'scanlineimage' && kind !== 'tiledimage') {
    throw new Issue(
      kind.startsWith('deep') ? 'EXR_UNSUPPORTED' : 'EXR_MALFORMED', place,
      `parts of type ${kind} are not read`);
  }
  const dataWindow = window('dataWindow'), displayWindow = window('displayWindow');
  need('pixelAspectRatio', 'float', 4);
  need('screenWindowCenter', 'v2f', 8);
  need('screenWindowWidth', 'float', 4);
  const channels = parse_channels(need('channels', 'chlist'), place);
  const compression = COMPRESSIONS[need('compression', 'compression', 1)[0]];
  const lineOrder = ['increasing', 'decreasing', 'random'][need('lineOrder', 'lineOrder', 1)[0]];
  if (!compression || !lineOrder)
    throw new Issue('EXR_MALFORMED', place, 'unknown compression or line order');
  const [x0, y0, x1, y1] = dataWindow;
  const width = x1 - x0 + 1, height = y1 - y0 + 1;
  if (width < 1 || height < 1) throw new Issue('EXR_MALFORMED', place, 'the data window is empty');
  if (width * height > LIMITS.pixels) throw new Issue('FILE_TOO_LARGE', place, `${width} x ${height} pixels`);
  if (channels.length > LIMITS.channels)
    throw new Issue('FILE_TOO_LARGE', place, `${channels.length} channels`);

  let tile = null, levels = [{width, height}];
  if (kind === 'tiledimage') {
    const v = need('tiles', 'tiledesc', 9);
    tile = {width: v.readUInt32LE(0), height: v.readUInt32LE(4), mode: v[8] & 15, rounding: v[8] >> 4};
    if (tile.width < 1 || tile.height < 1) throw new Issue('EXR_MALFORMED', place, 'the tiles are empty');
    if (tile.mode > 2 || tile.rounding > 1) throw new Issue('EXR_MALFORMED', place, 'unknown mode of tiles');
    if (tile.mode === 2 || (tile.mode === 1 && tile.rounding === 1)) {
      throw new Issue('EXR_UNSUPPORTED', place, 'rip maps, and levels rounded up, are not read');
    }
    if (tile.mode === 1) {
      levels = Array.from(
        {length: chain_length(width, height)},
        (_, k) => ({width: level_size(width, k), height: level_size(height, k)}));
    }
  }
  const chunks = [];
  levels.forEach((size, level) => {
    const step_x = tile ? tile.width : size.width, step_y = tile ? tile.height : LINES_PER_CHUNK[compression];
    if (Math.ceil(size.width / step_x) * Math.ceil(size.height / step_y) * 8 > cursor.bytes.length) {
      throw new Issue('FILE_DAMAGED', place, 'more chunks than the file can hold');
    }
    for (let y = 0; y < size.height; y += step_y) {
      for (let x = 0; x < size.width; x += step_x) {
        chunks.push(
          {level, x, y, width: Math.min(step_x, size.width - x), height: Math.min(step_y, size.height - y)});
      }
    }
  });
  if (multipart && need('chunkCount', 'int', 4).readInt32LE(0) !== chunks.length) {
    throw new Issue('EXR_MALFORMED', place, 'chunkCount is not the number of chunks');
  }
  return {
    name: string('name') ?? '',
    index,
    kind,
    attributes,
    channels,
    compression,
    lineOrder,
    dataWindow,
    displayWindow,
    tile,
    levels,
    chunks
  };
}

/** Headers and chunk tables of a file (a Buffer): { bytes, multipart, parts }. */
export function read_headers(bytes) {
  const cursor = new Cursor(bytes);
  if (bytes.length < 8 || cursor.i32() !== 20000630)
    throw new Issue('EXR_MALFORMED', '', 'not an OpenEXR file');
  const version = cursor.i32();
  if ((version & 0xFF) !== 2) throw new Issue('EXR_MALFORMED', '', `OpenEXR version ${version & 0xFF}`);
  if (version & DEEP || version & ~(0xFF | MULTIPART | DEEP | LONG_NAMES | TILED)) {
    throw new Issue('EXR_UNSUPPORTED', '', 'deep data or an unknown kind of OpenEXR file');
  }
  const multipart = (version & MULTIPART) !== 0;
  const parts = [];
  do {
    if (parts.length === LIMITS.parts)
      throw new Issue('FILE_TOO_LARGE', '', `more than ${LIMITS.parts} parts`);
    parts.push(parse_header(cursor, parts.length, version));
  } while (multipart && (cursor.at >= bytes.length || bytes[cursor.at] !== 0));
  if (multipart) cursor.u8();
  if (new Set(parts.map((part) => part.name)).size !== parts.length) {
    throw new Issue('EXR_MALFORMED', '', 'two parts have the same name');
  }
  for (const part of parts) {
    if (cursor.at + 8 * part.chunks.length > bytes.length) {
      throw new Issue('FILE_DAMAGED', part.name, 'the table of chunks is cut short');
    }
    for (const chunk of part.chunks) chunk.offset = Number(cursor.take(8).readBigUInt64LE(0));
  }
  return {bytes, multipart, parts};
}

function unpack_rle(packed, size) {
  const out = Buffer.alloc(size);
  let at = 0;
  for (let i = 0; i < packed.length;) {
    const count = packed.readInt8(i++);
    const n = count < 0 ? -count : count + 1;
    if (at + n > size || i + (count < 0 ? n : 1) > packed.length) return null;
    if (count < 0)
      packed.copy(out, at, i, i += n);
    else
      out.fill(packed[i++], at, at + n);
    at += n;
  }
  return at === size ? out : null;
}

/** Undoes the predictor and the split into even and odd bytes that ZIP and RLE share. */
function undo_filter(data) {
  for (let i = 1; i < data.length; ++i) data[i] = data[i] + data[i - 1] - 128;
  const out = Buffer.alloc(data.length);
  const half = (data.length + 1) >> 1;
  for (let i = 0; i < data.length; ++i) out[i] = data[(i & 1 ? half : 0) + (i >> 1)];
  return out;
}

function unpack(packed, size, compression) {
  if (packed.length === size) return packed;  // what does not shrink is stored as it is, whatever the codec
  if (packed.length > size) return null;
  if (compression === 'rle') {
    const data = unpack_rle(packed, size);
    return data && undo_filter(data);
  }
  if (compression === 'zip' || compression === 'zips') {
    try {
      const data = inflateSync(packed, {maxOutputLength: size});
      return data.length === size ? undo_filter(data) : null;
    } catch { return null; }
  }
  return null;
}

function read_chunk(file, part, chunk, place) {
  const {bytes, multipart} = file;
  const damaged = (message) => new Issue('FILE_DAMAGED', place, message);
  const head = (multipart ? 4 : 0) + (part.tile ? 20 : 8);
  let at = chunk.offset;
  if (at + head > bytes.length) throw damaged('a chunk lies beyond the end of the file');
  const next = () => bytes.readInt32LE((at += 4) - 4);
  if (multipart && next() !== part.index) throw damaged('a chunk belongs to another part');
  const where =
    part.tile ? [chunk.x / part.tile.width, chunk.y / part.tile.height, chunk.level, chunk.level] : [chunk.y];
  for (const expected of where)
    if (next() !== expected) throw damaged('a chunk has the wrong coordinates');
  const size = next();
  if (size < 0 || at + size > bytes.length) throw damaged('a chunk is cut short');
  const pixel = part.channels.reduce((sum, channel) => sum + BYTES[channel.type], 0);
  const data = unpack(bytes.subarray(at, at + size), pixel * chunk.width * chunk.height, part.compression);
  if (!data) throw damaged('a chunk cannot be decoded');
  return data;
}

/**
 * One level of one part: a Map from channel names, in the order of the header, to { type, bytes }, where
 * `bytes` are the values row by row from the top, little-endian, without padding.
 */
export function read_level(file, part, level) {
  const {width, height} = part.levels[level];
  const place = part.levels.length > 1 ? `${part.name}/level ${level}` : part.name;
  if (!['none', 'rle', 'zips', 'zip'].includes(part.compression)) {
    throw new Issue('EXR_UNSUPPORTED', place, `compression ${part.compression} is not read`);
  }
  const floats = 4 * part.channels.length * width * height;
  if (floats > LIMITS.levelBytes || floats > LIMITS.levelBytesPerFileByte * file.bytes.length) {
    throw new Issue(
      'FILE_TOO_LARGE', place, 'the decoded level is too large, or too large for so small a file');
  }
  const channels = new Map(
    part.channels.map(({name, type}) => [name, {type, bytes: Buffer.alloc(width * height * BYTES[type])}]));
  for (const chunk of part.chunks) {
    if (chunk.level !== level) continue;
    const data = read_chunk(file, part, chunk, place);
    let at = 0;
    for (let y = chunk.y; y < chunk.y + chunk.height; ++y) {
      for (const {type, bytes} of channels.values()) {
        const row = chunk.width * BYTES[type];
        data.copy(bytes, (y * width + chunk.x) * BYTES[type], at, at += row);
      }
    }
  }
  return channels;
}

/** The value of the 16 bits of an IEEE half. */
export function half_to_number(bits) {
  const sign = bits & 0x8000 ? -1 : 1, exponent = (bits >> 10) & 31, fraction = bits & 1023;
  if (exponent === 31) return fraction ? NaN : sign * Infinity;
  return sign * (exponent ? 2 ** (exponent - 15) * (1 + fraction / 1024) : 2 ** -24 * fraction);
}

/** The values of a channel of read_level, exact in double precision. */
export function channel_values({type, bytes}) {
  return Float64Array.from(
    {length: bytes.length / BYTES[type]},
    (_, i) => type === 'half' ? half_to_number(bytes.readUInt16LE(2 * i)) : bytes.readFloatLE(4 * i));
}

// Writes OpenEXR 2 files of the subset that fabrics are stored in.
import {deflateSync} from 'node:zlib';
import {BYTES, COMPRESSIONS, LINES_PER_CHUNK, PIXEL_TYPES} from './reader.mjs';

const text = (s) => Buffer.from(s + '\0', 'latin1');
const i32 = (...values) => {
  const b = Buffer.alloc(4 * values.length);
  values.forEach((v, i) => b.writeInt32LE(v, 4 * i));
  return b;
};
const f32 = (...values) => {
  const b = Buffer.alloc(4 * values.length);
  values.forEach((v, i) => b.writeFloatLE(v, 4 * i));
  return b;
};

/** Attribute values: [type, bytes]. */
export const attribute = {
  string: (s) => ['string', Buffer.from(s, 'utf8')],
  float: (x) => ['float', f32(x)],
  int: (x) => ['int', i32(x)],
  v2f: (x, y) => ['v2f', f32(x, y)],
  box2i: (...corners) => ['box2i', i32(...corners)],
};

/** The bits of the half nearest to `x`, ties to even; infinite beyond 65,519. */
export function number_to_half(x) {
  const sign = x < 0 || Object.is(x, -0) ? 0x8000 : 0, size = Math.abs(x);
  if (Number.isNaN(x)) return 0x7E00;
  if (size >= 65520) return sign | 0x7C00;
  const exponent = size < 2 ** -14 ? -14 : Math.floor(Math.log2(size));
  const steps = size / 2 ** (exponent - 10);  // exact; 1,024 to 2,047, or less for a subnormal half
  let whole = Math.floor(steps);
  if (steps - whole > 0.5 || (steps - whole === 0.5 && whole % 2 === 1)) ++whole;
  return sign | (whole < 1024 ? whole : whole + (exponent + 14) * 1024);
}

/** Numbers as the bytes of a channel. */
export function pack_values(values, type) {
  const bytes = Buffer.alloc(values.length * BYTES[type]);
  values.forEach(
    (x, i) => type === 'half' ? bytes.writeUInt16LE(number_to_half(x), 2 * i) : bytes.writeFloatLE(x, 4 * i));
  return bytes;
}

function do_filter(data) {
  const half = (data.length + 1) >> 1;
  const out = Buffer.alloc(data.length);
  for (let i = 0; i < data.length; ++i) out[(i & 1 ? half : 0) + (i >> 1)] = data[i];
  for (let i = data.length - 1; i > 0; --i) out[i] = out[i] - out[i - 1] + 128;
  return out;
}

function pack(data, compression, deflate) {
  const packed = compression === 'zip' ? deflate(do_filter(data)) : data;
  return packed.length < data.length ? packed : data;
}

/** The chunks of a part: { head, data } with the coordinates before the data. */
function part_chunks(part, deflate) {
  const {tile, channels, compression} = part;
  const chunks = [];
  part.levels.forEach(({width, height, values}, level) => {
    const step_x = tile ? tile.width : width, step_y = tile ? tile.height : LINES_PER_CHUNK[compression];
    for (let y = 0; y < height; y += step_y) {
      for (let x = 0; x < width; x += step_x) {
        const head = tile ? i32(x / step_x, y / step_y, level, level) : i32(y);
        if (part.data) {
          chunks.push({head, data: part.data()});
          continue;
        }
        const rows = [];
        for (let row = y; row < Math.min(y + step_y, height); ++row) {
          for (const {name, type} of channels) {
            const first = row * width + x, end = row * width + Math.min(x + step_x, width);
            rows.push(values.get(name).subarray(first * BYTES[type], end * BYTES[type]));
          }
        }
        chunks.push({head, data: pack(Buffer.concat(rows), compression, deflate)});
      }
    }
  });
  return chunks;
}

function channel_list(channels) {
  const entries =
    channels.map(({name, type}) => Buffer.concat([text(name), i32(PIXEL_TYPES.indexOf(type), 0, 1, 1)]));
  return ['chlist', Buffer.concat([...entries, Buffer.from([0])])];
}

function part_attributes(part, chunk_count) {
  const {width, height} = part.levels[0], {tile} = part;
  const window = attribute.box2i(0, 0, width - 1, height - 1);
  const attributes = {
    name: attribute.string(part.name),
    type: attribute.string(tile ? 'tiledimage' : 'scanlineimage'),
    chunkCount: attribute.int(chunk_count),
    channels: channel_list(part.channels),
    compression: ['compression', Buffer.from([COMPRESSIONS[part.compression]])],
    dataWindow: window,
    displayWindow: window,
    lineOrder: ['lineOrder', Buffer.from([0])],
    pixelAspectRatio: attribute.float(1),
    screenWindowCenter: attribute.v2f(0, 0),
    screenWindowWidth: attribute.float(1),
    ...(tile ? {tiles: ['tiledesc', Buffer.concat([i32(tile.width, tile.height), Buffer.from([1])])]} : {}),
    ...part.attributes,
  };
  return Object.entries(attributes).filter(([, value]) => value !== null);
}

/**
 * The bytes of a file.
 *
 *   parts      { name, channels, compression, levels, tile, attributes }
 *     channels   [{ name, type }] in byte order of their names; type 'half' or 'float'
 *     levels     [{ width, height, values }]; values: a Map from channel names to bytes (pack_values)
 *     tile       { width, height }, or null for scan lines; the levels of tiles are mip levels
 *     data       () => the packed bytes of each chunk, instead of the values
 *     attributes { name: [type, bytes] }, added to those that OpenEXR asks for; null removes one
 *   order      the order of the chunks in the file: takes and gives a list of { part, ... }; default: the tables' order
 *   gap        bytes of no meaning before, between and behind the chunks
 */
export function write_exr({parts, order = (chunks) => chunks, gap = 0}, deflate = deflateSync) {
  const chunks = parts.map((part) => part_chunks(part, deflate));
  const long = parts.some(
    (part) => [...part.channels.map((c) => c.name), ...Object.keys(part.attributes ?? {})].some((n) => n.length > 31));
  const head = [i32(20000630, 0x1002 | (long ? 0x400 : 0))];
  parts.forEach((part, i) => {
    for (const [name, [type, value]] of part_attributes(part, chunks[i].length))
      head.push(text(name), text(type), i32(value.length), value);
    head.push(Buffer.from([0]));
  });
  head.push(Buffer.from([0]));

  const all = chunks.flatMap((list, part) => list.map((chunk) => ({part, ...chunk})));
  const tables = Buffer.alloc(8 * all.length), space = Buffer.alloc(gap, 0xFF), body = [space];
  let at = head.reduce((sum, b) => sum + b.length, 0) + tables.length + gap;
  const entries = new Map(all.map((chunk, i) => [chunk, i]));
  for (const chunk of order(all)) {
    tables.writeBigUInt64LE(BigInt(at), 8 * entries.get(chunk));
    const bytes = Buffer.concat([i32(chunk.part), chunk.head, i32(chunk.data.length), chunk.data, space]);
    body.push(bytes);
    at += bytes.length;
  }
  return Buffer.concat([...head, tables, ...body]);
}

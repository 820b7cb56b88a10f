// Decodes the pixels of OpenEXR files whose structure exr.js has checked.
import {BYTES, LIMITS, LOSSY} from './exr.js';
import {Issue} from './issue.js';
import {unpack} from './unpack.js';

/**
 * One level of one part: a Map from channel names, in the order of the header, to { type, bytes }, where
 * `bytes` are the values row by row from the top, little-endian, without padding.
 */
export function read_level(part, level) {
  const {width, height} = part.levels[level];
  const place = part.levels.length > 1 ? `${part.name}/level ${level}` : part.name;
  if (LOSSY.includes(part.compression)) {
    throw new Issue('EXR_UNSUPPORTED', place, `compression ${part.compression} is not read`);
  }
  if (4 * part.channels.length * width * height > LIMITS.level_bytes)
    throw new Issue('FILE_TOO_LARGE', place, 'the decoded level is too large');
  const channels = new Map(part.channels.map(
    ({name, type}) => [name, {type, bytes: new Uint8Array(width * height * BYTES[type])}]));
  const rows = [...channels.values()].map(({type, bytes}) => ({size: BYTES[type], bytes}));
  const sizes = rows.map(({size}) => size);
  for (const chunk of part.chunks) {
    if (chunk.level !== level) continue;
    const data = unpack(chunk.packed, sizes, chunk.width, chunk.height, part.compression);
    if (!data) throw new Issue('FILE_DAMAGED', place, 'a chunk cannot be decoded');
    let at = 0;
    for (let y = chunk.y; y < chunk.y + chunk.height; ++y) {
      for (const {size, bytes} of rows) {
        let to = (y * width + chunk.x) * size;
        for (const end = at + chunk.width * size; at < end;) bytes[to++] = data[at++];
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

/** The values of a channel of read_level, a Float32Array. Typed arrays are little-endian, as the file is. */
export function channel_values({type, bytes}) {
  const aligned = bytes.byteOffset % BYTES[type] === 0 ? bytes : Uint8Array.from(bytes);
  const {buffer, byteOffset, length} = aligned;
  if (type === 'float') return new Float32Array(buffer, byteOffset, length / 4);
  if (!halves) {
    halves = new Float32Array(65536);
    for (let half = 0; half < 65536; ++half) halves[half] = half_to_number(half);
  }
  const bits = new Uint16Array(buffer, byteOffset, length / 2), values = new Float32Array(bits.length);
  for (let i = 0; i < bits.length; ++i) values[i] = halves[bits[i]];
  return values;
}

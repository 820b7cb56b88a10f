// Inflates zlib streams (RFC 1950, RFC 1951), at once and into a known size: what streams of the platform cannot do.

/** Base values and further bits of the symbols for lengths, from 257, and for distances. */
const further_bits = (count, first, each) =>
  Uint8Array.from({length: count}, (_, i) => Math.max(0, Math.floor((i - first) / each)));
const bases_of = (bits, first) => {
  const bases = new Uint16Array(bits.length);
  for (let i = 0, sum = first; i < bits.length; sum += 1 << bits[i++]) bases[i] = sum;
  return bases;
};
const LENGTH_BITS = further_bits(29, 4, 4), DISTANCE_BITS = further_bits(30, 2, 2);
const LENGTHS = bases_of(LENGTH_BITS, 3), DISTANCES = bases_of(DISTANCE_BITS, 1);
LENGTH_BITS[28] = 0;
LENGTHS[28] = 258;
const ORDER = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
const LONGEST = 15;

/**
 * The symbol, times 16 plus the length of its code, of every possible next `bits` bits; 0 where there is no code.
 * null for lengths that are no code, or an incomplete one of more than one symbol.
 */
function table_of(lengths) {
  const counts = new Uint16Array(LONGEST + 1);
  for (const length of lengths) ++counts[length];
  counts[0] = 0;
  let bits = LONGEST, left = 1, used = 0;
  while (bits > 1 && counts[bits] === 0) --bits;
  const next = new Uint16Array(LONGEST + 2);
  for (let length = 1; length <= LONGEST; ++length) {
    left = 2 * left - counts[length];
    used += counts[length];
    next[length + 1] = (next[length] + counts[length]) << 1;
    if (left < 0) return null;
  }
  if (left > 0 && !(used === 0 || (used === 1 && counts[1] === 1))) return null;
  const table = new Uint16Array(1 << bits);
  for (let symbol = 0; symbol < lengths.length; ++symbol) {
    const length = lengths[symbol];
    if (length === 0) continue;
    let code = next[length]++, turned = 0;
    for (let i = 0; i < length; ++i, code >>= 1) turned = turned << 1 | (code & 1);
    for (let at = turned; at < table.length; at += 1 << length) table[at] = symbol << 4 | length;
  }
  return {table, mask: table.length - 1};
}

let fixed;
function fixed_tables() {
  const lengths = Uint8Array.from({length: 288}, (_, i) => i < 144 ? 8 : i < 256 ? 9 : i < 280 ? 7 : 8);
  return fixed ??= [table_of(lengths), table_of(new Uint8Array(32).fill(5))];
}

class Inflater {
  constructor(bytes, out) {
    this.bytes = bytes;
    this.out = out;
    this.at = 2;
    this.done = 0;
    this.held = 0;   // bits that are read and not taken yet, the next one lowest
    this.count = 0;  // of them
  }
  /** The next n <= 16 bits; beyond the end they are 0, and is_over() tells. */
  bits(n) {
    while (this.count < n) {
      this.held |= (this.bytes[this.at++] ?? 0) << this.count;
      this.count += 8;
    }
    const value = this.held & ((1 << n) - 1);
    this.held >>>= n;
    this.count -= n;
    return value;
  }
  is_over() {
    return this.at - (this.count >> 3) > this.bytes.length;
  }
  /** The next symbol of a code, -1 where there is none. */
  symbol({table, mask}) {
    while (this.count < LONGEST) {
      this.held |= (this.bytes[this.at++] ?? 0) << this.count;
      this.count += 8;
    }
    const found = table[this.held & mask], length = found & 15;
    this.held >>>= length;
    this.count -= length;
    return length === 0 ? -1 : found >> 4;
  }
  stored() {
    this.at -= this.count >> 3;
    this.held = this.count = 0;
    const {bytes, out, at, done} = this;
    const size = bytes[at] | bytes[at + 1] << 8;
    if (!(size === (~(bytes[at + 2] | bytes[at + 3] << 8) & 0xFFFF))) return false;
    this.at += 4 + size;
    if (this.at > bytes.length || done + size > out.length) return false;
    out.set(bytes.subarray(at + 4, at + 4 + size), done);
    this.done += size;
    return true;
  }
  /** The tables of a block that brings its own; null where they are none. */
  own_tables() {
    const literals = this.bits(5) + 257, distances = this.bits(5) + 1, count = this.bits(4) + 4;
    if (literals > 286 || distances > 30) return null;
    const first = new Uint8Array(19);
    for (let i = 0; i < count; ++i) first[ORDER[i]] = this.bits(3);
    const code = table_of(first);
    if (!code) return null;
    const lengths = new Uint8Array(literals + distances);
    for (let i = 0; i < lengths.length;) {
      const symbol = this.symbol(code);
      if (symbol < 0 || (symbol === 16 && i === 0) || this.is_over()) return null;
      if (symbol < 16) {
        lengths[i++] = symbol;
        continue;
      }
      const times = symbol === 16 ? 3 + this.bits(2) : symbol === 17 ? 3 + this.bits(3) : 11 + this.bits(7);
      if (i + times > lengths.length) return null;
      lengths.fill(symbol === 16 ? lengths[i - 1] : 0, i, i += times);
    }
    const tables = [table_of(lengths.subarray(0, literals)), table_of(lengths.subarray(literals))];
    return lengths[256] > 0 && tables[0] && tables[1] ? tables : null;
  }
  block([of_literals, of_distances]) {
    const {out} = this;
    for (;;) {
      const symbol = this.symbol(of_literals);
      if (symbol < 0 || this.is_over()) return false;
      if (symbol < 256) {
        if (this.done === out.length) return false;
        out[this.done++] = symbol;
        continue;
      }
      if (symbol === 256) return true;
      if (symbol > 285) return false;
      const size = LENGTHS[symbol - 257] + this.bits(LENGTH_BITS[symbol - 257]);
      const far = this.symbol(of_distances);
      if (far < 0 || far > 29) return false;
      let from = this.done - DISTANCES[far] - this.bits(DISTANCE_BITS[far]);
      const end = this.done + size;
      if (from < 0 || end > out.length) return false;
      let to = this.done;
      while (to < end) out[to++] = out[from++];
      this.done = end;
    }
  }
}

function adler_32(bytes) {
  let a = 1, b = 0;
  for (let at = 0; at < bytes.length;) {
    for (const end = Math.min(at + 3800, bytes.length); at < end; ++at) {
      a += bytes[at];
      b += a;
    }
    a %= 65521;
    b %= 65521;
  }
  return b * 65536 + a;
}

/** The `size` bytes that a zlib stream holds; null where it is damaged or holds more or fewer. */
export function inflate(bytes, size) {
  const head = bytes[0] << 8 | bytes[1];
  if (bytes.length < 6 || head % 31 !== 0 || (bytes[0] & 15) !== 8 || bytes[0] >> 4 > 7 || (bytes[1] & 32) !== 0)
    return null;
  const out = new Uint8Array(size), inflater = new Inflater(bytes, out);
  for (let last = 0; last === 0;) {
    last = inflater.bits(1);
    const kind = inflater.bits(2);
    if (kind === 0) {
      if (!inflater.stored()) return null;
      continue;
    }
    const tables = kind === 1 ? fixed_tables() : kind === 2 ? inflater.own_tables() : null;
    if (!tables || !inflater.block(tables)) return null;
  }
  const end = inflater.at - (inflater.count >> 3);
  if (inflater.done !== size || end + 4 > bytes.length) return null;
  const sum = ((bytes[end] << 24 | bytes[end + 1] << 16 | bytes[end + 2] << 8 | bytes[end + 3]) >>> 0);
  return sum === adler_32(out) ? out : null;
}

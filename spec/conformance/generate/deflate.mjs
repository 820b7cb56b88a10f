// A small zlib encoder, fixed codes only. The packers of zlib differ between its versions and forks; this one
// gives the same bytes everywhere, so that the fixtures can be compared byte by byte.

const LENGTH_BASE = [], LENGTH_BITS = [], DISTANCE_BASE = [], DISTANCE_BITS = [];
for (let code = 0, base = 3; code < 28; ++code) {
  LENGTH_BITS[code] = code < 8 ? 0 : (code >> 2) - 1;
  LENGTH_BASE[code] = base;
  base += 1 << LENGTH_BITS[code];
}
LENGTH_BASE[28] = 258;
LENGTH_BITS[28] = 0;
for (let code = 0, base = 1; code < 30; ++code) {
  DISTANCE_BITS[code] = code < 4 ? 0 : (code >> 1) - 1;
  DISTANCE_BASE[code] = base;
  base += 1 << DISTANCE_BITS[code];
}
const code_of = (bases, value) => {
  let code = bases.length - 1;
  while (bases[code] > value) --code;
  return code;
};

class Bits {
  constructor() {
    this.bytes = [];
    this.held = 0;
    this.count = 0;
  }
  put(value, n) {
    this.held |= value << this.count;
    for (this.count += n; this.count >= 8; this.count -= 8) {
      this.bytes.push(this.held & 255);
      this.held >>>= 8;
    }
  }
  // Huffman codes go in from their highest bit.
  put_code(value, n) {
    for (let i = n - 1; i >= 0; --i) this.put((value >> i) & 1, 1);
  }
  put_symbol(s) {
    if (s < 144)
      this.put_code(0x30 + s, 8);
    else if (s < 256)
      this.put_code(0x190 + s - 144, 9);
    else if (s < 280)
      this.put_code(s - 256, 7);
    else
      this.put_code(0xC0 + s - 280, 8);
  }
}

function match_length(data, from, at) {
  let n = 0;
  while (n < 258 && at + n < data.length && data[from + n] === data[at + n]) ++n;
  return n;
}

/** The zlib stream of a Buffer. */
export function deflate(data) {
  const bits = new Bits();
  bits.put(1, 1);          // the last block,
  bits.put(1, 2);          // with fixed codes
  const seen = new Map();  // three bytes -> where they stood last
  for (let at = 0; at < data.length;) {
    const key = data[at] << 16 | data[at + 1] << 8 | data[at + 2];
    const from = at + 2 < data.length ? seen.get(key) : undefined;
    const n = from !== undefined && at - from <= 32768 ? match_length(data, from, at) : 0;
    if (n >= 3) {
      const length = code_of(LENGTH_BASE, n), distance = code_of(DISTANCE_BASE, at - from);
      bits.put_symbol(257 + length);
      bits.put(n - LENGTH_BASE[length], LENGTH_BITS[length]);
      bits.put_code(distance, 5);
      bits.put(at - from - DISTANCE_BASE[distance], DISTANCE_BITS[distance]);
    } else {
      bits.put_symbol(data[at]);
    }
    for (const end = at + Math.max(n, 1); at < end; ++at) {
      if (at + 2 < data.length) seen.set(data[at] << 16 | data[at + 1] << 8 | data[at + 2], at);
    }
  }
  bits.put_symbol(256);
  bits.put(0, (8 - bits.count) % 8);
  let a = 1, b = 0;
  for (const byte of data) {
    a = (a + byte) % 65521;
    b = (b + a) % 65521;
  }
  return Buffer.from([0x78, 0x01, ...bits.bytes, b >> 8, b & 255, a >> 8, a & 255]);
}

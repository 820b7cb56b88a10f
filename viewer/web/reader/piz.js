// Unpacks the codec PIZ of OpenEXR: a table of the 16-bit words that occur, Haar wavelets, Huffman codes with runs.
//
// The words of a chunk are kept plane by plane: all words of the first channel, then of the next; a float is
// two words.
import {view_of} from './bytes.js';

export const WORDS = 65536;
const LONGEST_CODE = 52;  // of a number in double precision; longer ones take more words than a chunk has
export const LONG_RUN = 63, LONG_RUN_LEAST = 6;
const SHORT_RUN = 59;

/** The planes of a chunk: where the words of one channel begin, how many a pixel has. */
export function planes_of(words_per_pixel, width, height) {
  let first = 0;
  return words_per_pixel.map((words) => {
    const plane = {first, words};
    first += words * width * height;
    return plane;
  });
}

/** Calls visit(word within the planes, word within the rows of pixels) for every word. */
export function each_word(planes, width, height, visit) {
  let at = 0;
  for (let y = 0; y < height; ++y) {
    for (const {first, words} of planes) {
      for (let i = 0; i < words * width; ++i) visit(first + y * words * width + i, at++);
    }
  }
}

/** Two words from their mean and difference, and back: exact for 14 bits, or modulo 2^16. */
const short = (x) => x << 16 >> 16;
const STEPS = {
  small: {
    join: (l, h) => {
      const difference = short(h), a = short(l) + (difference & 1) + (difference >> 1);
      return [a & 0xFFFF, (a - difference) & 0xFFFF];
    },
    split: (a, b) => [((short(a) + short(b)) >> 1) & 0xFFFF, (short(a) - short(b)) & 0xFFFF],
  },
  large: {
    join: (mean, difference) => {
      const b = (mean - (difference >> 1)) & 0xFFFF;
      return [(difference + b - 0x8000) & 0xFFFF, b];
    },
    split: (a, b) => {
      const moved = (a + 0x8000) & 0xFFFF, difference = moved - b, mean = (moved + b) >> 1;
      return [difference < 0 ? (mean + 0x8000) & 0xFFFF : mean, difference & 0xFFFF];
    },
  }
};

/** The steps of the wavelet: from squares of 2 up to those of the shorter side. */
function* sides(width, height) {
  for (let p = 1; 2 * p <= Math.min(width, height); p *= 2) yield p;
}

/**
 * One step over the words at `first`, `stride` words apart: pairs that are `p` apart, along x and y. What has
 * no partner at the right or lower edge is paired along the edge only.
 */
function wavelet_step(data, first, stride, width, height, p, pair, inverse) {
  const at = (x, y) => first + (y * width + x) * stride;
  const apply = (i, j) => {
    [data[i], data[j]] = pair(data[i], data[j]);
  };
  let y = 0;
  for (; y + 2 * p <= height; y += 2 * p) {
    let x = 0;
    for (; x + 2 * p <= width; x += 2 * p) {
      const [a, b, c, d] = [at(x, y), at(x + p, y), at(x, y + p), at(x + p, y + p)];
      for (const [i, j] of inverse ? [[a, c], [b, d], [a, b], [c, d]] : [[a, b], [c, d], [a, c], [b, d]])
        apply(i, j);
    }
    if (width & p) apply(at(x, y), at(x, y + p));
  }
  if (height & p) {
    for (let x = 0; x + 2 * p <= width; x += 2 * p) apply(at(x, y), at(x + p, y));
  }
}

export function wavelets(data, planes, width, height, largest, inverse) {
  const {join, split} = largest < 1 << 14 ? STEPS.small : STEPS.large;
  const steps = [...sides(width, height)];
  if (inverse) steps.reverse();
  for (const {first, words} of planes) {
    for (let word = 0; word < words; ++word) {
      for (const p of steps)
        wavelet_step(data, first + word, words, width, height, p, inverse ? join : split, inverse);
    }
  }
}

/**
 * The codes of lengths, a Map from symbols to lengths: the first code of a length, and its symbols in order.
 */
export function canonical_codes(lengths) {
  const by_length = Array.from({length: LONGEST_CODE + 1}, () => ({first: 0, symbols: []}));
  for (const symbol of [...lengths.keys()].sort((a, b) => a - b))
    by_length[lengths.get(symbol)].symbols.push(symbol);
  let code = 0;
  for (let length = LONGEST_CODE; length > 0; --length) {
    by_length[length].first = code;
    code = Math.floor((code + by_length[length].symbols.length) / 2);
  }
  return by_length;
}

class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;  // in bits
  }
  bit() {
    if (this.at >= 8 * this.bytes.length) throw new RangeError('no more bits');
    const byte = this.bytes[this.at >> 3];
    return byte >> (7 - (this.at++ & 7)) & 1;
  }
  bits(n) {
    let value = 0;
    while (n-- > 0) value = 2 * value + this.bit();
    return value;
  }
}

/** `count` words of a Huffman stream; a RangeError where it is damaged. */
function decode_words(stream, count) {
  const damaged = (wrong) => {
    if (wrong) throw new RangeError('a damaged stream of codes');
  };
  damaged(stream.length < 20);
  const [least, most, , bit_count] = [0, 4, 8, 12].map((at) => view_of(stream).getUint32(at, true));
  damaged(least > most || most > WORDS);
  const table = new Reader(stream.subarray(20));
  const lengths = new Map();
  for (let symbol = least; symbol <= most;) {
    const length = table.bits(6);
    if (length >= SHORT_RUN) {
      symbol += length === LONG_RUN ? table.bits(8) + LONG_RUN_LEAST : length - SHORT_RUN + 2;
      damaged(symbol > most + 1);
    } else {
      damaged(length > LONGEST_CODE);
      if (length > 0) lengths.set(symbol, length);
      ++symbol;
    }
  }
  const codes = canonical_codes(lengths);
  const packed = stream.subarray(20 + Math.ceil(table.at / 8));
  damaged(bit_count > 8 * packed.length);
  const data = new Reader(packed);
  const words = new Uint16Array(count);
  let done = 0;
  while (data.at < bit_count) {
    let code = 0, length = 0, symbol;
    while (symbol === undefined) {
      damaged(++length > LONGEST_CODE);
      code = 2 * code + data.bit();
      const {first, symbols} = codes[length];
      if (code >= first) symbol = symbols[code - first];
    }
    if (symbol === most) {  // a run of the word before
      const end = done + data.bits(8);
      damaged(done === 0 || end > count);
      words.fill(words[done - 1], done, end);
      done = end;
    } else {
      damaged(done === count);
      words[done++] = symbol;
    }
  }
  damaged(data.at !== bit_count || done !== count);
  return words;
}

/** The bytes of a chunk, rows of pixels; null where it is damaged. words_per_pixel: of each channel. */
export function unpack_piz(packed, words_per_pixel, width, height) {
  const planes = planes_of(words_per_pixel, width, height);
  const count = words_per_pixel.reduce((sum, words) => sum + words, 0) * width * height;
  try {
    const view = view_of(packed), least = view.getUint16(0, true), most = view.getUint16(2, true);
    if (most >= WORDS / 8) return null;
    const occurs = new Uint8Array(WORDS / 8);
    let at = 4;
    if (least <= most) occurs.set(packed.subarray(at, at += most - least + 1), least);
    const words = [];
    for (let word = 0; word < WORDS; ++word) {
      if (word === 0 || occurs[word >> 3] >> (word & 7) & 1) words.push(word);
    }
    const size = view.getInt32(at, true);
    at += 4;
    if (size < 0 || at + size > packed.length) return null;
    const data = decode_words(packed.subarray(at, at + size), count);
    wavelets(data, planes, width, height, words.length - 1, true);
    const unpacked = new Uint16Array(count);
    each_word(planes, width, height, (from, to) => {
      unpacked[to] = words[data[from]] ?? 0;
    });
    return new Uint8Array(unpacked.buffer);
  } catch (error) {
    if (error instanceof RangeError) return null;
    throw error;
  }
}

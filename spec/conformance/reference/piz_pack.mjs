// Packs by the codec PIZ of OpenEXR, as simply as it may; piz.js of the reader unpacks.
import {LONG_RUN, LONG_RUN_LEAST, WORDS, canonical_codes, each_word, planes_of, wavelets} from './reader.mjs';

/** Lengths of Huffman codes, a Map from symbols, for how often they occur. */
function code_lengths(counts) {
  let trees = [...counts].map(([symbol, count]) => ({count, symbols: [symbol]}));
  const lengths = new Map([...counts.keys()].map((symbol) => [symbol, 0]));
  while (trees.length > 1) {
    trees.sort((a, b) => a.count - b.count || a.symbols[0] - b.symbols[0]);
    const [a, b, ...rest] = trees;
    const symbols = [...a.symbols, ...b.symbols];
    for (const symbol of symbols) lengths.set(symbol, lengths.get(symbol) + 1);
    trees = [...rest, {count: a.count + b.count, symbols}];
  }
  return lengths;
}

class Writer {
  constructor() {
    this.bytes = [];
    this.count = 0;
  }
  put(value, n) {
    for (let i = n - 1; i >= 0; --i) {
      if (this.count % 8 === 0) this.bytes.push(0);
      this.bytes[this.bytes.length - 1] |= Math.floor(value / 2 ** i) % 2 << (7 - this.count % 8);
      ++this.count;
    }
  }
}

function encode_words(words) {
  const counts = new Map();
  for (const word of words) counts.set(word, (counts.get(word) ?? 0) + 1);
  const symbols = [...counts.keys()].sort((a, b) => a - b);
  const least = symbols[0], run = symbols.at(-1) + 1;
  counts.set(run, 1);
  const lengths = code_lengths(counts);
  const codes = new Map();
  canonical_codes(lengths).forEach(({first, symbols: list}, length) => list.forEach((symbol, i) => {
    codes.set(symbol, [first + i, length]);
  }));
  const table = new Writer();
  for (let symbol = least; symbol <= run; ++symbol) {
    let absent = 0;
    while (absent < 255 + LONG_RUN_LEAST && !lengths.has(symbol + absent)) ++absent;
    if (absent >= LONG_RUN_LEAST) {
      table.put(LONG_RUN, 6);
      table.put(absent - LONG_RUN_LEAST, 8);
      symbol += absent - 1;
    } else {
      table.put(lengths.get(symbol) ?? 0, 6);
    }
  }
  const data = new Writer();
  for (let i = 0; i < words.length;) {
    let again = 0;
    while (again < 255 && words[i + again + 1] === words[i]) ++again;
    data.put(...codes.get(words[i]));
    if (again > 8) {
      data.put(...codes.get(run));
      data.put(again, 8);
      i += again;
    }
    ++i;
  }
  const head = Buffer.alloc(20);
  [least, run, table.bytes.length, data.count, 0].forEach((value, i) => head.writeUInt32LE(value, 4 * i));
  return Buffer.concat([head, Buffer.from(table.bytes), Buffer.from(data.bytes)]);
}

/** The packed chunk of rows of pixels. */
export function pack_piz(bytes, words_per_pixel, width, height) {
  const planes = planes_of(words_per_pixel, width, height);
  const data = new Uint16Array(bytes.length / 2);
  each_word(planes, width, height, (to, from) => {
    data[to] = bytes.readUInt16LE(2 * from);
  });
  const occurs = Buffer.alloc(WORDS / 8);
  for (const word of data) occurs[word >> 3] |= 1 << (word & 7);
  occurs[0] &= 0xFE;  // 0 is there in any case
  const numbers = new Map([[0, 0]]);
  for (let word = 1; word < WORDS; ++word) {
    if (occurs[word >> 3] >> (word & 7) & 1) numbers.set(word, numbers.size);
  }
  data.forEach((word, i) => {
    data[i] = numbers.get(word);
  });
  const used = [...occurs.keys()].filter((i) => occurs[i] !== 0);
  const [least, most] = used.length > 0 ? [used[0], used.at(-1)] : [WORDS / 8 - 1, 0];
  wavelets(data, planes, width, height, numbers.size - 1, false);
  const stream = encode_words(data);
  const head = Buffer.alloc(4), size = Buffer.alloc(4);
  head.writeUInt16LE(least, 0);
  head.writeUInt16LE(most, 2);
  size.writeInt32LE(stream.length, 0);
  return Buffer.concat(
    [head, least <= most ? occurs.subarray(least, most + 1) : head.subarray(4), size, stream]);
}

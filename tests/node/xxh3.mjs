// The digest of the conformance kit's reference against xxHash itself, for every length that takes a way of
// its own.
//
//   node xxh3.mjs
//
// Exit 77 (skipped): hash-wasm is not installed (npm ci).
import assert from 'node:assert/strict';
import { xxh3_128 } from '../../spec/conformance/reference/reader.mjs';

const wasm = await import('hash-wasm').catch(() => {
  console.log('skipped: npm ci in tests/node installs hash-wasm');
  process.exit(77);
});
const hasher = await wasm.createXXHash128(0, 0);
const bytes = Buffer.from(Array.from({ length: 4200 }, (_, i) => (i * i * 31 + i * 7) >> 3 & 255));
for (let n = 0; n <= bytes.length; ++n) {
  const data = bytes.subarray(0, n);
  assert.equal(xxh3_128(data), hasher.init().update(data).digest(), `${n} bytes`);
}
console.log(`${bytes.length + 1} lengths agree`);

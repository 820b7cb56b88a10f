// XXH3-128 of xxHash 0.8 with seed 0 and the default secret, in the canonical order: 32 hexadecimal digits.
//
// Written after the public description of the algorithm. Short data with BigInt; of long data the stripes, which are
// nearly all of the work, in halves of 32 bits.
import {view_of} from './bytes.js';

const SECRET_DIGITS =
  'b8fe6c3923a44bbe7c01812cf721ad1cded46de9839097db7240a4a4b7b3671f' +
    'cb79e64eccc0e578825ad07dccff7221b8084674f743248ee03590e6813a264c' +
    '3c2852bb91c300cb88d0658b1b532ea371644897a20df94e3819ef46a9deacd8' +
    'a8fa763fe39c343ff9dcbbc7c70b4f1d8a51e04bcdb45931c89f7ec9d9787364' +
    'eac5ac8334d3ebc3c581a0fffa1363eb170ddd51b7f0da49d316552629d4689e' +
    '2b16be587d47a1fc8ff8b8d17ad031ce45cb3a8f95160428afd7fbcabb4b407e';
const SECRET = new DataView(
  Uint8Array.from({length: SECRET_DIGITS.length / 2}, (_, i) => parseInt(SECRET_DIGITS.slice(2 * i, 2 * i + 2), 16)).buffer);
const P32_1 = 0x9E3779B1n, P32_2 = 0x85EBCA77n, P32_3 = 0xC2B2AE3Dn;
const P64_1 = 0x9E3779B185EBCA87n, P64_2 = 0xC2B2AE3D27D4EB4Fn, P64_3 = 0x165667B19E3779F9n;
const P64_4 = 0x85EBCA77C2B2AE63n, P64_5 = 0x27D4EB2F165667C5n;
const MIX_1 = 0x165667919E3779F9n, MIX_2 = 0x9FB21C651E98DF25n;

const u64 = (x) => BigInt.asUintN(64, x);
const secret = (at) => SECRET.getBigUint64(at, true);
const fold = (a, b) => u64(a * b) ^ (a * b >> 64n);

function avalanche(x) {
  x ^= x >> 37n;
  x = u64(x * MIX_1);
  return x ^ (x >> 32n);
}

function avalanche_64(x) {
  x ^= x >> 33n;
  x = u64(x * P64_2);
  x ^= x >> 29n;
  x = u64(x * P64_3);
  return x ^ (x >> 32n);
}

function swap(x, bytes) {
  let swapped = 0n;
  for (let i = 0; i < bytes; ++i, x >>= 8n) swapped = (swapped << 8n) | (x & 0xFFn);
  return swapped;
}

function up_to_3(data) {
  const n = data.length, low = (data[0] << 16 | data[n >> 1] << 24 | data[n - 1] | n << 8) >>> 0;
  const turned = Number(swap(BigInt(low), 4)), high = (turned << 13 | turned >>> 19) >>> 0;
  const key = (at) => BigInt((SECRET.getUint32(at, true) ^ SECRET.getUint32(at + 4, true)) >>> 0);
  return [avalanche_64(BigInt(low) ^ key(0)), avalanche_64(BigInt(high) ^ key(8))];
}

function up_to_8(data) {
  const n = data.length, view = view_of(data);
  const word = BigInt(view.getUint32(0, true)) | BigInt(view.getUint32(n - 4, true)) << 32n;
  const m = (word ^ secret(16) ^ secret(24)) * (P64_1 + BigInt(n << 2));
  let low = u64(m);
  const high = u64((m >> 64n) + (low << 1n));
  low ^= high >> 3n;
  low = u64((low ^ (low >> 35n)) * MIX_2);
  return [low ^ (low >> 28n), avalanche(high)];
}

function up_to_16(data) {
  const n = data.length, first = view_of(data).getBigUint64(0, true);
  let last = view_of(data).getBigUint64(n - 8, true);
  const m = (first ^ last ^ secret(32) ^ secret(40)) * P64_1;
  let low = u64(u64(m) + (BigInt(n - 1) << 54n));
  last ^= secret(48) ^ secret(56);
  const high = u64((m >> 64n) + last + (last & 0xFFFFFFFFn) * (P32_2 - 1n));
  low ^= swap(high, 8);
  const h = low * P64_2;
  return [avalanche(u64(h)), avalanche(u64((h >> 64n) + high * P64_2))];
}

function up_to_240(data) {
  const n = data.length, view = view_of(data), word = (at) => view.getBigUint64(at, true);
  const mix_16 = (at, key) => fold(word(at) ^ secret(key), word(at + 8) ^ secret(key + 8));
  let low = u64(BigInt(n) * P64_1), high = 0n;
  const mix_32 = (first, second, key) => {
    low = u64(low + mix_16(first, key)) ^ u64(word(second) + word(second + 8));
    high = u64(high + mix_16(second, key + 16)) ^ u64(word(first) + word(first + 8));
  };
  if (n <= 128) {
    for (let i = (n - 1) >> 5; i >= 0; --i) mix_32(16 * i, n - 16 * (i + 1), 32 * i);
  } else {
    for (let i = 0; i < 128; i += 32) mix_32(i, i + 16, i);
    low = avalanche(low);
    high = avalanche(high);
    for (let i = 128; i + 32 <= n; i += 32) mix_32(i, i + 16, i - 128 + 3);
    mix_32(n - 16, n - 32, 136 - 17 - 16);
  }
  const end = u64(low * P64_1 + high * P64_4 + BigInt(n) * P64_2);
  return [avalanche(u64(low + high)), u64(-avalanche(end))];
}

/** The upper 32 bits of a product of two numbers of 32 bits; the lower are Math.imul's. */
function upper_half(a, b) {
  const low = b & 0xFFFF, high = b >>> 16;
  return (a * high + Math.floor(a * low / 65536)) / 65536 >>> 0;
}

const SECRET_WORDS = Uint32Array.from({length: SECRET.byteLength / 4}, (_, i) => SECRET.getUint32(4 * i, true));
const PRIME = Number(P32_1);

function any_length(data) {
  const n = data.length, view = view_of(data);
  // The lower and the upper halves of 8 sums of 64 bits.
  const starts = [P32_3, P64_1, P64_2, P64_3, P64_4, P32_2, P64_5, P32_1];
  const lows = Uint32Array.from(starts, (x) => Number(x & 0xFFFFFFFFn));
  const highs = Uint32Array.from(starts, (x) => Number(x >> 32n));
  const add = (i, low, high) => {
    const sum = lows[i] + low;
    lows[i] = sum;
    highs[i] += high + (sum > 0xFFFFFFFF ? 1 : 0);
  };
  // key_low, key_high: of the secret for word i.
  const add_word = (at, i, key_low, key_high) => {
    const low = view.getUint32(at + 8 * i, true), high = view.getUint32(at + 8 * i + 4, true);
    const a = (low ^ key_low) >>> 0, b = (high ^ key_high) >>> 0;
    add(i ^ 1, low, high);
    add(i, Math.imul(a, b) >>> 0, upper_half(a, b));
  };
  for (let at = 0, stripe = 0; at + 64 < n; at += 64) {
    for (let i = 0; i < 8; ++i) add_word(at, i, SECRET_WORDS[2 * (stripe + i)], SECRET_WORDS[2 * (stripe + i) + 1]);
    if (++stripe < 16) continue;
    stripe = 0;
    // The end of a block of 16 stripes, unless the data ends here: then only the last stripe follows.
    if (at + 64 >= n) continue;
    for (let i = 0; i < 8; ++i) {
      const low = (lows[i] ^ highs[i] >>> 15 ^ SECRET_WORDS[32 + 2 * i]) >>> 0, high = highs[i] ^ SECRET_WORDS[33 + 2 * i];
      lows[i] = Math.imul(low, PRIME);
      highs[i] = upper_half(low, PRIME) + (Math.imul(high, PRIME) >>> 0);
    }
  }
  for (let i = 0; i < 8; ++i) {
    const key = 192 - 64 - 7 + 8 * i;
    add_word(n - 64, i, SECRET.getUint32(key, true), SECRET.getUint32(key + 4, true));
  }
  const sums = Array.from(lows, (low, i) => BigInt(highs[i]) << 32n | BigInt(low));
  const merge = (key, start) => {
    let sum = start;
    for (let i = 0; i < 4; ++i)
      sum += fold(sums[2 * i] ^ secret(key + 16 * i), sums[2 * i + 1] ^ secret(key + 16 * i + 8));
    return avalanche(u64(sum));
  };
  return [merge(11, u64(BigInt(n) * P64_1)), merge(192 - 64 - 11, u64(~(BigInt(n) * P64_2)))];
}

/** The digest of a Uint8Array as 32 lower-case hexadecimal digits: the high 64 bits, then the low 64 bits. */
export function xxh3_128(data) {
  const n = data.length;
  const [low, high] = n === 0 ?
    [avalanche_64(secret(64) ^ secret(72)), avalanche_64(secret(80) ^ secret(88))] :
    n <= 3   ? up_to_3(data) :
    n <= 8   ? up_to_8(data) :
    n <= 16  ? up_to_16(data) :
    n <= 240 ? up_to_240(data) :
               any_length(data);
  return high.toString(16).padStart(16, '0') + low.toString(16).padStart(16, '0');
}

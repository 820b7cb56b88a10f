// Unpacks the chunks of OpenEXR files: NONE, RLE, ZIPS, ZIP and PIZ.
import {inflate} from './inflate.js';
import {unpack_piz} from './piz.js';

function unpack_rle(packed, size) {
  const out = new Uint8Array(size);
  let at = 0;
  for (let i = 0; i < packed.length;) {
    const count = packed[i++] << 24 >> 24;
    const n = count < 0 ? -count : count + 1;
    if (at + n > size || i + (count < 0 ? n : 1) > packed.length) return null;
    if (count < 0)
      out.set(packed.subarray(i, i += n), at);
    else
      out.fill(packed[i++], at, at + n);
    at += n;
  }
  return at === size ? out : null;
}

/** Undoes the predictor and the split into even and odd bytes that ZIP and RLE share. */
function undo_filter(data) {
  for (let i = 1; i < data.length; ++i) data[i] = data[i] + data[i - 1] - 128;
  const out = new Uint8Array(data.length);
  const half = (data.length + 1) >> 1;
  for (let i = 0, at = 0; at < half; ++at, i += 2) out[i] = data[at];
  for (let i = 1, at = half; i < data.length; ++at, i += 2) out[i] = data[at];
  return out;
}

/**
 * The bytes of a chunk of width x height pixels, row by row and channel by channel; null where it is damaged.
 * bytes_per_pixel: of each channel.
 */
export function unpack(packed, bytes_per_pixel, width, height, compression) {
  const size = bytes_per_pixel.reduce((sum, bytes) => sum + bytes, 0) * width * height;
  if (packed.length === size) return packed;  // what does not shrink is stored as it is, whatever the codec
  if (compression === 'piz')
    return unpack_piz(packed, bytes_per_pixel.map((bytes) => bytes / 2), width, height);
  if (compression === 'rle') {
    const data = unpack_rle(packed, size);
    return data && undo_filter(data);
  }
  if (compression === 'zip' || compression === 'zips') {
    const data = inflate(packed, size);
    return data && undo_filter(data);
  }
  return null;
}

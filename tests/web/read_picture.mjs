// Pictures of `selvedge-view render` as OpenEXR files.
import { readFileSync } from 'node:fs';
import { FloatType } from '../node/node_modules/three/build/three.module.js';
import { EXRLoader } from '../node/node_modules/three/examples/jsm/loaders/EXRLoader.js';

/** Red, green, blue and alpha pixel by pixel, row by row from the top. */
export function read_picture(file) {
  const { data, width, height } = new EXRLoader().setDataType(FloatType).parse(new Uint8Array(readFileSync(file)).buffer);
  const pixels = new Float32Array(4 * width * height);
  // EXRLoader's first row is the lowest.
  for (let y = 0; y < height; ++y) pixels.set(data.subarray(4 * width * (height - 1 - y), 4 * width * (height - y)), 4 * width * y);
  return pixels;
}

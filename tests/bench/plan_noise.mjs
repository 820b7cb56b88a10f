// Whether frames with a fabric for a plan differ from those with the full one by more than their noise: a row of the
// last table of docs/plan.md.
//
//   node tests/bench/plan_noise.mjs WHAT -- FULL.exr... -- PART.exr...
//
// Frames of one view with fabrics of different seeds, in pairs: FULL i is held against PART i. Values are those of the
// PNG before they are rounded: pi times the radiance over a background of 0.18, in sRGB, times 255. The variance of the
// noise of each kind is that between its seeds, the mean over blocks of 8 x 8 pixels and the three channels; sigma of a
// difference is the root of the sum of both.
import {readFileSync} from 'node:fs';
import {channel_values, read_headers, read_level} from '../../spec/conformance/reference/exr.mjs';

const ALLOWED = 1;  // 1/255
const SIGMAS = 4;
const BLOCK = 8;
const EXPOSURE = Math.PI, BACKGROUND = 0.18;

const to_display = (v) => {
  const x = Math.min(Math.max(v, 0), 1);
  return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
};

function read_frame(path) {
  const [part] = read_headers(readFileSync(path)).parts;
  const channels = read_level(part, 0);
  const [, , x, y] = part.dataWindow;
  const [alpha, ...colours] = ['A', 'R', 'G', 'B'].map((name) => channel_values(channels.get(name)));
  const shown = (values) =>
    Float32Array.from(values, (v, i) => to_display(EXPOSURE * v + BACKGROUND * (1 - alpha[i])));
  return {width: x + 1, height: y + 1, alpha, channels: colours.map(shown)};
}

/** The variance between frames, a mean for each block. */
function variances(frames) {
  const [{width, height}] = frames;
  const columns = Math.ceil(width / BLOCK);
  const sums = new Float64Array(columns * Math.ceil(height / BLOCK)), counts = new Float64Array(sums.length);
  for (let c = 0; c < 3; ++c) {
    for (let i = 0; i < width * height; ++i) {
      const values = frames.map((frame) => frame.channels[c][i]);
      const mean = values.reduce((a, b) => a + b) / values.length;
      const block = Math.floor(Math.floor(i / width) / BLOCK) * columns + Math.floor((i % width) / BLOCK);
      // The background has no noise.
      if (frames.every(({alpha}) => alpha[i] === 0)) continue;
      sums[block] += values.reduce((sum, v) => sum + (v - mean) ** 2, 0) / (values.length - 1);
      ++counts[block];
    }
  }
  return (i) => {
    const block = Math.floor(Math.floor(i / width) / BLOCK) * columns + Math.floor((i % width) / BLOCK);
    return counts[block] > 0 ? sums[block] / counts[block] : 0;
  };
}

const lists = [];
for (const word of process.argv.slice(3)) word === '--' ? lists.push([]) : lists.at(-1).push(word);
const [full, part] = lists.map((paths) => paths.map(read_frame));
const of_full = variances(full), of_part = variances(part);
let pixels = 0, beyond = 0, beyond_noise = 0, largest = 0, noise = 0, max_sigmas = 0;
for (let n = 0; n < full.length; ++n) {
  for (let i = 0; i < full[n].width * full[n].height; ++i) {
    if (full[n].alpha[i] === 0 && part[n].alpha[i] === 0) continue;
    const differences = full[n].channels.map((channel, c) => Math.abs(channel[i] - part[n].channels[c][i]));
    const difference = Math.max(...differences), sigma = Math.sqrt(of_full(i) + of_part(i));
    ++pixels;
    noise += sigma * sigma;
    largest = Math.max(largest, difference);
    if (difference > ALLOWED) {
      ++beyond;
      max_sigmas = Math.max(max_sigmas, (difference - ALLOWED) / sigma);
    }
    if (difference > ALLOWED + SIGMAS * sigma) ++beyond_noise;
  }
}
const mean = (frames, c, i) => frames.reduce((sum, frame) => sum + frame.channels[c][i], 0) / frames.length;
let of_means = 0;
for (let c = 0; c < 3; ++c) {
  for (let i = 0; i < full[0].width * full[0].height; ++i)
    of_means = Math.max(of_means, Math.abs(mean(full, c, i) - mean(part, c, i)));
}
const row = [
  process.argv[2], pixels, Math.sqrt(noise / pixels).toFixed(3), largest.toFixed(2), beyond, max_sigmas.toFixed(1),
  beyond_noise, of_means.toFixed(2)
];
console.log(`| ${row.join(' | ')} |`);

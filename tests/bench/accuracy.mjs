// Accuracy of pictures that `render` estimates, beside the truth: random views, lights and sizes of scenes and fabrics, by a seed.
//
//   node tests/bench/accuracy.mjs VIEWER COUNT SEED [--seconds] FILE.glb|FILE.exr...
//
// The truth has 8 x 8 rays a pixel. Rows: the accuracy asked for, rays along a side, estimated and true dB, CPU seconds, and seconds
// by the least fixed --supersample that has it. Then quantiles. With --seconds: the time asked for, rays along a side and pixels
// along a ray, estimated and true dB, clock after loading by that time, and dB less the dB that the best fixed --supersample (1 to 6) has in that time.
import {spawnSync} from 'node:child_process';
import {mkdtempSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {read_picture} from '../web/read_picture.mjs';

const timed = process.argv.includes('--seconds');
const [viewer, count, seed, ...files] = process.argv.slice(2).filter((word) => word !== '--seconds'), folder = mkdtempSync(join(tmpdir(), 'accuracy-'));
let state = Number(seed);
const random = () => (state = (state * 1103515245 + 12345) % 2147483648) / 2147483648, pick = (list) => list[Math.floor(random() * list.length)];
const encoded = (x) => (x = Math.min(Math.max(x, 0), 1)) <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;

/** Display values, and the report with CPU seconds. */
function draw(scene, options) {
  const file = join(folder, 'picture.exr');
  const run = spawnSync('/usr/bin/time', ['-f', '%U %S', viewer, 'render', ...scene, ...options, '-o', file, '--json', ...(timed ? [] : ['--threads', '1'])], {encoding: 'utf8'});
  if (run.status !== 0) throw Error(run.stderr);
  const pixels = read_picture(file), values = [];
  for (let i = 0; i < pixels.length; i += 4)
    for (let c = 0; c < 3; ++c) values.push(encoded(pixels[i + c] * Math.PI + 0.18 * (1 - pixels[i + 3])));
  const seconds = run.stderr.trim().split('\n').at(-1).split(' ').reduce((sum, word) => sum + Number(word), 0);
  const report = JSON.parse(run.stdout), {total, read, write} = report.seconds;
  return {...report, values, seconds: timed ? total - read - write : seconds};
}
const decibels = (a, b) => -10 * Math.log10(Math.max(1e-12, a.reduce((sum, x, i) => sum + (x - b[i]) ** 2, 0) / a.length));

const errors = [], asked = {}, ratios = [], late = {}, lost = {};
for (let k = 0; k < count; ++k) {
  const file = pick(files), width = pick([120, 200, 320]), height = Math.round(0.8 * width), scene = [file, '--size', `${width}x${height}`];
  if (file.endsWith('.exr')) {
    scene.push('--place', pick(['near', 'middle', 'far', 'grazing']));
  } else {
    scene.push('--azimuth', Math.round(random() * 360), '--elevation', Math.round(random() * 75 - 15), '--zoom', (1.2 * 14 ** random()).toFixed(2));
    if (random() < 0.5) scene.push('--light', [random() * 2 - 1, random(), random() + 0.3, 1].map((x) => x.toFixed(2)).join(','));
  }
  const truth = draw(scene, ['--supersample', 8, '--image-memory', 4000]);
  const fixed = [1, 2, 3, 4, 6].map((n) => draw(scene, ['--supersample', n])).map((one) => ({...one, true: decibels(one.values, truth.values)}));
  console.log(`${k} ${scene.slice(1).join(' ')} ${file.split('/').at(-1)}: ${fixed.map((one) => `${one.supersample}: ${one.true.toFixed(1)} dB ${one.seconds.toFixed(1)} s`).join(', ')}`);
  for (const time of timed ? [0.5, 1, 3] : []) {
    const one = draw(scene, ['--seconds', time]), best = fixed.filter((other) => other.seconds <= time).map((other) => other.true);
    const truly = decibels(one.values, truth.values), less = truly - Math.max(...best);
    (late[time] ??= []).push(one.seconds / time);
    if (one.accuracy !== null && one.supersample < 8) errors.push(one.accuracy - truly);
    if (best.length > 0 && one.supersample < 8) (lost[time] ??= []).push(less);
    console.log(`  --seconds ${time}: ${one.supersample} ${one.magnified} ${(one.seconds / time).toFixed(2)}, ${one.accuracy?.toFixed(1)} estimated, ${truly.toFixed(1)} true, ${less.toFixed(1)}`);
  }
  for (const accuracy of timed ? [] : [28, 32, 36, 40]) {
    const one = draw(scene, ['--accuracy', accuracy]), truly = decibels(one.values, truth.values);
    const best = fixed.find((other) => other.true >= accuracy)?.seconds;
    errors.push(one.accuracy - truly);
    (asked[accuracy] ??= []).push(truly - accuracy);
    if (best) ratios.push(one.seconds / best);
    console.log(`  --accuracy ${accuracy}: ${one.supersample}, ${one.accuracy.toFixed(1)} estimated, ${truly.toFixed(1)} true, ${one.seconds.toFixed(1)} s, best ${best?.toFixed(1)}`);
  }
}
const at = (list, part) => list.toSorted((a, b) => a - b)[Math.floor(part * (list.length - 1))]?.toFixed(2);
for (const time of Object.keys(late))
  console.log(`--seconds ${time}: clock by time, median ${at(late[time], 0.5)}, 95 % ${at(late[time], 0.95)}; dB less the best fixed, median ${at(lost[time] ?? [], 0.5)}, 10 % ${at(lost[time] ?? [], 0.1)}`);
console.log(`estimated less true: 5 % ${at(errors, 0.05)}, median ${at(errors, 0.5)}, 95 % ${at(errors, 0.95)}; absolute 90 % ${at(errors.map(Math.abs), 0.9)}, 99 % ${at(errors.map(Math.abs), 0.99)}`);
for (const [accuracy, list] of Object.entries(asked)) console.log(`--accuracy ${accuracy}: true less asked, 5 % ${at(list, 0.05)}, median ${at(list, 0.5)}`);
if (!timed) console.log(`seconds beside the best fixed: median ${at(ratios, 0.5)}, 90 % ${at(ratios, 0.9)}`);

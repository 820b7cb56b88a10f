// A fabric that selvedge makes, read by the conformance kit's reference: all digests, all values, and what
// both say at random.
//
//   node made_fabric.mjs PROGRAMS_FOLDER OUTPUT_FOLDER
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import { bounded_texel, bounded_uv } from '../../spec/conformance/generate/bounds.mjs';
import { random, random_direction } from '../../spec/conformance/generate/random.mjs';
import { check_fabric } from '../../spec/conformance/reference/check.mjs';
import { read_fabric_level } from '../../spec/conformance/reference/level.mjs';
import { open_fabric } from '../../spec/conformance/reference/reader.mjs';

const [programs, folder] = process.argv.slice(2);
const selvedge = join(programs, 'selvedge');
mkdirSync(folder, { recursive: true });
const file = join(folder, 'made.fabric.exr');
const options = '--quality paper --texels 12x8 --views 16 --lights 16 --threads 1 --quiet'.split(' ');
execFileSync(selvedge, ['make', 'plain-knit', '--set', 'yarn=tube', ...options, '-o', file]);

const bytes = readFileSync(file);
assert.deepEqual((await check_fabric(bytes)).filter(({ severity }) => severity === 'error'), []);
const fabric = await open_fabric(bytes);
assert.deepEqual(Object.keys(fabric.layers).sort(), ['frame', 'lobes', 'opacity', 'table']);
const levels = Array.from({ length: fabric.levels }, (_, k) => read_fabric_level(fabric, k));
const level = (k) => levels[k];

const next = random('made fabric');
const queries = Array.from({ length: 500 }, (_, n) => {
  const light = random_direction(next), view = random_direction(next);
  const uv = [4 * next() - 2, 4 * next() - 2];
  if (n % 2 === 0) return { level: next() * (fabric.levels - 1), uv, light, view };
  const k = n % fabric.levels, { width, height } = level(k);
  return { level: k, texel: [Math.floor(next() * width), Math.floor(next() * height)], light, view };
});
const input = queries.map((query) => JSON.stringify({ op: 'evaluate', file, ...query })).join('\n') + '\n';
const lines = execFileSync(join(programs, 'answer_queries'), [], { input, encoding: 'utf8' }).trim().split('\n');
assert.equal(lines.length, queries.length);
const answers = lines.map((line) => JSON.parse(line));
let worst = 0, lit = 0;
queries.forEach((query, i) => {
  const { texel, uv, light, view } = query;
  const expected = texel ? bounded_texel(level(query.level), texel, light, view) :
    bounded_uv(level, fabric.levels, query.level, uv, light, view);
  // The number in the answer is rounded once more.
  const near = (given, { value, error }) => {
    const off = Math.abs(given - value), bound = error + 2 ** -23 * Math.abs(value);
    if (error < 0.01) worst = Math.max(worst, bound > 0 ? off / bound : off);
    assert.ok(off <= bound, `${JSON.stringify(query)}: ${given} instead of ${value} within ${bound}`);
  };
  expected.rgb.forEach((value, c) => near(answers[i].rgb[c], value));
  near(answers[i].alpha, expected.alpha);
  if (answers[i].rgb[0] > 0) ++lit;
});
assert.ok(lit > 200, `${lit} queries see light`);
console.log(`${queries.length} queries, ${lit} of them lit; worst error ${worst.toFixed(3)} of its bound`);

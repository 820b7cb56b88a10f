// The WebAssembly module makes the fabrics of `selvedge make`; refusals are a line, and leave nothing behind.
//
//   node make.mjs PROGRAMS_FOLDER OUTPUT_FOLDER MODULE
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { deflateSync } from 'node:zlib';
import { FabricMaker } from '../../apps/npm/make.mjs';

const [programs, folder, file] = process.argv.slice(2), module = new WebAssembly.Module(readFileSync(file));
mkdirSync(folder, { recursive: true });
const run = (program, ...words) => execFileSync(join(programs, program), words, { encoding: 'utf8' });
let hears = {};
const maker = new FabricMaker(module, {
  deflate: (bytes, level) => deflateSync(bytes, { level }),
  progress: (stage) => hears.progress?.(stage),
  describe: (stitch) => hears.describe?.(stitch)
});
const make = (recipe, progress, describe) => {
  hears = { progress, describe };
  return maker.make(recipe);
};

for (const [recipe, line] of [
  [{ stitch: 'nothing' }, /^nothing: no such file and no such built-in stitch .*STITCH_UNKNOWN\]$/],
  [{ stitch: 'rib', set: { radius_mm: 3 } }, /^rib: --set radius_mm: the yarns are too thick .*OPTION_OUT_OF_RANGE\]$/],
  [{ stitch: 'rib', colour: 1 }, /^rib: colour: there is no such member of a recipe \[OPTION_OUT_OF_RANGE\]$/],
  [{ stitch: 'bad.txt', text: 'name: bad\n1: k2 q' }, /^bad.txt: line 2: there is no stitch "q" .*STITCH_INVALID\]$/],
  [{ stitch: 'bad.json', text: '{"yarns": 3' }, /^bad.json: line 1, column 12: parse error .*JSON_MALFORMED\]$/]
]) assert.throws(() => make(recipe), { message: line });
assert.throws(() => make({ stitch: 'rib' }, () => { throw new Error('cancelled'); }), { message: 'cancelled' });

// A text's parameters are told before it is drawn.
const told = [], bad = { stitch: 'two.txt', text: 'yarn A: hairiness=3\nyarn B: yarn=silk\n1: k [B]', set: { radius_mm: 9 } };
assert.throws(() => make(bad, undefined, (stitch) => told.push(stitch)));
const [{ stitch, parameters }] = told, named = (name) => parameters.find((parameter) => parameter.name === name);
assert.equal(stitch, 'two.txt');
assert.deepEqual([named('hairiness').value, named('hairiness').byKind, named('wale_mm').byKind, named('second_yarn').value], [[3], true, undefined, [3]]);

const moss = new URL('../../samples/charts/moss.txt', import.meta.url).pathname;
for (const [stitch, input, more, ...words] of [
  ['plain-knit', 'plain-knit', {}],
  ['plain-knit', 'plain-knit', { set: { yarn: 'cotton', colour: '#aa3322' } }, '--set', 'yarn=cotton', '--set', 'colour=#aa3322'],
  ['twill', 'twill', {}],
  ['moss.txt', moss, { text: readFileSync(moss, 'utf8') }]
]) {
  const begin = process.cpuUsage(), stages = new Set(), path = join(folder, stitch);
  writeFileSync(`${path}.module.exr`, make({ stitch, ...more }, (stage) => stages.add(stage)).bytes);
  const seconds = process.cpuUsage(begin).user / 1e6;
  run('selvedge', 'make', input, ...words, '-o', `${path}.native.exr`, '--quiet');
  run('selvedge', 'check', `${path}.module.exr`);
  assert.deepEqual([...stages], ['relax', 'bake', 'fit']);
  const [ours, theirs] = ['module', 'native'].map((name) => JSON.parse(run('selvedge', 'info', `${path}.${name}.exr`, '--json')).content.recipe);
  assert.deepEqual(ours, { stitch, ...more });
  assert.deepEqual(theirs, ours);
  for (const place of ['near', 'middle', 'far']) {
    const picture = (name) => [`${path}.${name}.exr`, '--place', place, '--size', '320x256', '--supersample', '2', '-o', `${path}.${name}.png`];
    for (const name of ['module', 'native']) run('selvedge-view', 'render', ...picture(name), '--quiet');
    const { psnr } = JSON.parse(run('compare-pictures', `${path}.module.png`, `${path}.native.png`, '--json'));
    console.log(`${stitch} ${place}: ${psnr ?? 'the same'}; ${seconds} s`);
    assert.ok(psnr === null || psnr >= 40, `${stitch} ${place}: ${psnr} dB`);
  }
}

// Pages make cloth by the verb, a preview of it first, with yarns that came to rest before: the same fabric.
//
//   node make.mjs PROGRAMS_FOLDER OUTPUT_FOLDER MODULE
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { deflateSync, inflateSync } from 'node:zlib';
import { memory_host, run_module } from '../../apps/npm/host.js';
import { read_picture } from './read_picture.mjs';

const [programs, folder, file] = process.argv.slice(2), module = new WebAssembly.Module(readFileSync(file));
mkdirSync(folder, { recursive: true });
const charts = new URL('../../samples/charts/', import.meta.url).pathname;
/** A fabric of a stitch or a chart's text, of `last`, and the stages that it takes where the host remembers `shapes`. */
function make(stitch, text, shapes = new Map(), entry = 'run', last = undefined) {
  const files = new Map(text === undefined ? [] : [[stitch, Buffer.from(text)]]), said = { out: '', err: '' }, stages = new Set();
  const host = { ...memory_host(files, said, (stage) => stages.add(stage)), recall: (key) => shapes.get(key), keep: (key, shape) => shapes.set(key, shape) };
  if (last) files.set('last.exr', last);
  const words = ['make', stitch, '-o', 'made.exr', '--json', ...(last ? ['--recolour', 'last.exr'] : [])];
  const status = run_module(module, words, host, { inflate: inflateSync, deflate: (bytes, level) => deflateSync(bytes, { level }) }, entry);
  return { status, bytes: files.get('made.exr'), stages: [...stages], ...said };
}
function check(name, bytes) {
  writeFileSync(join(folder, name), bytes);
  execFileSync(join(programs, 'selvedge'), ['check', join(folder, name), '--quiet']);
}
/** The radiance of a fabric in the middle distance, in sums of red, green and blue. */
function brightness(name, bytes) {
  check(`${name}.exr`, bytes);
  const picture = join(folder, `${name}.picture.exr`);
  execFileSync(join(programs, 'selvedge-view'), ['render', join(folder, `${name}.exr`), '--place', 'middle', '--size', '120x96', '-o', picture, '--quiet']);
  return read_picture(picture).reduce((sums, value, i) => (sums[i % 4] += value, sums), [0, 0, 0, 0]).slice(0, 3);
}
for (const name of ['twill', 'moss.txt']) {
  const text = name.endsWith('.txt') ? readFileSync(join(charts, name), 'utf8') : undefined, shapes = new Map();
  const [whole, preview, again] = [make(name, text), make(name, text, shapes, 'preview'), make(name, text, shapes)];
  check(`${name}.preview.exr`, preview.bytes);
  assert.deepEqual([whole, preview, again].map(({ status, stages }) => [status, ...stages]), [[0, 'relax', 'bake', 'fit'], [0, 'relax', 'bake'], [0, 'bake', 'fit']]);
  assert.equal(shapes.size, 1);
  assert.ok(Buffer.from(again.bytes).equals(whole.bytes));
}
// Much yarn is relaxed roughly for a preview alone.
const aran = readFileSync(join(charts, 'aran.txt'), 'utf8'), shapes = new Map();
check('aran.preview.exr', make('aran.txt', aran, shapes, 'preview').bytes);
assert.deepEqual(make('aran.txt', aran, shapes, 'preview').stages, ['bake']);
// The preview of a large chart is an edit of the last one of its gauge, the whole is not; of knit and purl it has a map.
const colourwork = (row, albedo = '#c8b090') => `yarn A:\nyarn B: albedo=${albedo}\n3: ktbl k13 [${row}]\n${[1, 2, 4, 5, 6, 7, 8].map((number) => `${number}: ktbl k13 [A14]\n`).join('')}`;
const mapped = make('map.txt', `yarn A:\nyarn B:\n${[...Array(12).keys()].map((row) => `${row + 1}: k12 [A${row % 4 + 1} B${row % 3 + 3} A${8 - row % 4 - row % 3}]\n`).join('')}`, undefined, 'preview');
check('map.preview.exr', mapped.bytes);
assert.ok(Buffer.from(mapped.bytes).includes('map'));
const edits = new Map(), [first, edited, whole] = [['A6 B A7', 'run'], ['A6 B2 A6', 'preview'], ['A6 B2 A6', 'run']].map(([row, entry]) => make('edit.txt', colourwork(row), edits, entry));
assert.deepEqual([first, edited, whole].map(({ status, stages }) => [status, stages[0]]), [[0, 'relax'], [0, 'bake'], [0, 'relax']]);
check('edited.preview.exr', edited.bytes);
// From the last one come wholes of nearly the same yarn, and of the same in other colours: as bright as the exact ones.
const coloured = colourwork('A6 B A7', '#305090'), dyed = make('edit.txt', coloured, edits), exact = { edit: whole, recolour: dyed, tint: dyed };
for (const [entry, text] of [['edit', colourwork('A6 B2 A6')], ['recolour', coloured], ['tint', coloured]]) {
  const made = make('edit.txt', text, new Map(edits), entry, first.bytes);
  assert.equal(made.status, 0, entry);
  const [bright, truth] = [brightness(`last.${entry}`, made.bytes), brightness(`exact.${entry}`, exact[entry].bytes)];
  for (const c of [0, 1, 2]) assert.ok(Math.abs(bright[c] / truth[c] - 1) < 0.03, `${entry}: ${bright} beside ${truth}`);
}
for (const entry of ['preview', 'run']) {
  const { status, bytes, out } = make('bad.txt', '1: k2 q', undefined, entry);
  assert.deepEqual([status, bytes], [1, undefined]);
  if (entry === 'run') assert.deepEqual([JSON.parse(out).error.place, JSON.parse(out).error.code], ['line 1', 'STITCH_INVALID']);
}

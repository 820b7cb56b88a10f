// CPU seconds of what the page of `design` makes after an edit of a chart that it has made, in WebAssembly, and how near that comes
// to the exact fabric: mean radiance beside it, and dB of display values, near, in the middle and far.
//
//   node edits.mjs PROGRAMS_FOLDER MODULE CHART 'BEFORE=>AFTER'...
//
// An edit replaces the first BEFORE of the text by AFTER, in the middle of '=>'.
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { deflateSync, inflateSync } from 'node:zlib';
import { memory_host, run_module } from '../../apps/npm/host.js';
import { read_picture } from '../web/read_picture.mjs';

const [programs, file, chart, ...edits] = process.argv.slice(2), module = new WebAssembly.Module(readFileSync(file)), shapes = new Map();
const folder = mkdtempSync(join(tmpdir(), 'edits-')), name = basename(chart), text = readFileSync(chart, 'utf8');
/** The fabric of a text, and CPU seconds; from the fabric of `last` as the page has it. */
function make(text, entry, shapes, last) {
  const files = new Map([[name, Buffer.from(text)]]), said = { out: '', err: '' }, begin = process.cpuUsage();
  if (last) files.set('last.exr', last);
  const host = { ...memory_host(files, said), recall: (key) => shapes.get(key), keep: (key, shape) => shapes.set(key, shape) };
  const codecs = { inflate: (bytes) => inflateSync(bytes), deflate: (bytes, level) => deflateSync(bytes, { level: ['preview', 'tint', 'recolour'].includes(entry) ? 0 : level }) };
  const status = run_module(module, ['make', name, ...(last ? ['--recolour', 'last.exr'] : []), '-o', 'made.exr', '--json'], host, codecs, entry);
  const { user, system } = process.cpuUsage(begin), bytes = files.get('made.exr');
  if (status !== 0) throw Error(said.out + said.err);
  return { seconds: (user + system) / 1e6, bytes };
}
const encoded = (x) => (x = Math.min(Math.max(x, 0), 1)) <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;
function picture(bytes, label, place) {
  const fabric = join(folder, `${label}.exr`), drawn = join(folder, `${label}.${place}.exr`);
  writeFileSync(fabric, bytes);
  execFileSync(join(programs, 'selvedge-view'), ['render', fabric, '--place', place, '--size', '240x192', '-o', drawn, '--quiet']);
  return read_picture(drawn).filter((_, i) => i % 4 < 3);
}
function beside(bytes, exact, label) {
  return ['near', 'middle', 'far'].map((place) => {
    const [a, b] = [[bytes, label], [exact, 'exact']].map(([fabric, name]) => picture(fabric, name, place));
    const sum = (list) => list.reduce((all, x) => all + x, 0), error = sum(a.map((x, i) => (encoded(x * Math.PI) - encoded(b[i] * Math.PI)) ** 2)) / a.length;
    return `${place} ${(sum(a) / sum(b)).toFixed(3)} ${(-10 * Math.log10(Math.max(error, 1e-9))).toFixed(1)} dB`;
  }).join(', ');
}
const first = make(text, 'run', shapes);
console.log(`${name}: made in ${first.seconds.toFixed(1)} s, ${first.bytes.length} bytes`);
for (const edit of edits) {
  const edited = text.replace(...edit.split('=>')), exact = make(edited, 'run', new Map());
  console.log(`${edit}: made in ${exact.seconds.toFixed(1)} s`);
  const kept = new Map(shapes);
  for (const entry of ['preview', 'tint', 'recolour', 'edit']) {
    try {
      const { seconds, bytes } = make(edited, entry, kept, first.bytes);
      console.log(`  ${entry}: ${seconds.toFixed(1)} s, ${bytes.length} bytes; ${beside(bytes, exact.bytes, entry)}`);
    } catch ({ message }) { console.log(`  ${entry}: ${message.slice(0, 200)}`); }
  }
}

// Writes how the yarns of the built-in stitches, and of charts and drafts, come to rest: each shape after its key and length.
//
//   node shapes.mjs SELVEDGE.wasm OUTPUT FILE...
import {readFileSync, writeFileSync} from 'node:fs';
import {basename} from 'node:path';
import {memory_host, run_module} from '../npm/host.js';

const [file, output, ...texts] = process.argv.slice(2), module = new WebAssembly.Module(readFileSync(file)), parts = [];
const keep = (key, bytes) => parts.push(key, Uint32Array.of(bytes.length), bytes);
function run(argv, files = []) {
  const said = {out: '', err: ''};
  if (run_module(module, [...argv, '--json'], {...memory_host(new Map(files), said), keep}, {})) throw new Error(said.out + said.err);
  return JSON.parse(said.out);
}
// The shape of lace is as large as Draco's decoder, and comes to rest in a second.
for (const {name} of run(['stitch', '--list']).stitches) if (name !== 'lace') run(['stitch', name, '-o', 'drawn.json']);
for (const text of texts) run(['stitch', basename(text), '-o', 'drawn.json'], [[basename(text), readFileSync(text)]]);
writeFileSync(output, Buffer.concat(parts.map((part) => Buffer.from(part.buffer ?? part))));

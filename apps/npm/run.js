// The program of this package, one instance for each run.
import { codecs } from './codecs.js';
import { DracoDecoder } from './draco.js';
import { run_module } from './host.js';

const is_file = import.meta.url.startsWith('file:');
const { readFileSync } = is_file ? await import('node:fs') : {};
/** A file beside this one, at once: in a page by a worker alone, which Draco's decoder needs. */
function file_beside(name) {
  const address = new URL(name, import.meta.url);
  if (is_file) return readFileSync(address);
  const request = new XMLHttpRequest();
  request.open('GET', address, false);
  request.responseType = 'arraybuffer';
  request.send();
  if (request.status !== 200) throw new Error(`${address}: ${request.status}`);
  return request.response;
}
let compiled;
async function compile() {
  if (is_file) return WebAssembly.compile(file_beside('selvedge.wasm'));
  const answer = await fetch(new URL('selvedge.wasm', import.meta.url));
  if (!answer.ok) throw new Error(`${answer.url}: ${answer.status}`);
  return WebAssembly.compile(await answer.arrayBuffer());
}
const all_codecs = { ...codecs, draco: new DracoDecoder(() => file_beside('draco_decoder.wasm')) };

/**
 * Runs the program with the words behind its name, as `['make', 'twill', '-o', 't.fabric.exr']`; resolves to its exit
 * status: 0 good, 1 bad input or a failed check, 2 usage. `host` (index.d.ts): files, and what is told. Files are written when the
 * program has ended by itself, each once.
 */
export async function run(argv, host) {
  const module = await (compiled ??= compile());
  await Promise.all([codecs.meshopt.ready, codecs.encoder.ready]);
  return run_module(module, argv, host, all_codecs);
}

// The program of this package, one instance for each run.
import { codecs } from './codecs.js';
import { run_module } from './host.js';

/** The module of this package, compiled once. */
let compiled;
const module_of = async () => {
  const address = new URL('./selvedge.wasm', import.meta.url);
  if (address.protocol !== 'file:') return WebAssembly.compile(await (await fetch(address)).arrayBuffer());
  const { readFile } = await import('node:fs/promises');
  return WebAssembly.compile(await readFile(address));
};

/**
 * Runs the program with the words behind its name, as `['make', 'twill', '-o', 't.fabric.exr']`; resolves to its exit
 * status: 0 good, 1 bad input, 2 usage. `host` (index.d.ts): files, and what is told. Files are written when the program has
 * ended by itself, each once.
 */
export async function run(argv, host) {
  const module = await (compiled ??= module_of());
  await codecs.meshopt.ready;
  return run_module(module, argv, host, codecs);
}

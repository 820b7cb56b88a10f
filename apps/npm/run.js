// The host of selvedge.wasm: one instance for each run, with files, zlib and meshopt by JavaScript.
import { deflate, inflate } from 'pako';
import { MeshoptDecoder } from 'meshoptimizer/decoder';

/** Errors of writing, by the numbers of WASI's errno. */
const ERRNO = { EACCES: 2, EPERM: 63, ENOENT: 44, ENOTDIR: 54, EROFS: 69, ENOSPC: 51 }, EIO = 29;
const MODES = ['ATTRIBUTES', 'TRIANGLES', 'INDICES'], FILTERS = ['NONE', 'OCTAHEDRAL', 'QUATERNION', 'EXPONENTIAL'];
const read_text = new TextDecoder(), write_text = new TextEncoder();

/** The module of this package, compiled once. */
let compiled;
const module_of = async () => {
  const address = new URL('./selvedge.wasm', import.meta.url);
  if (address.protocol !== 'file:') return WebAssembly.compile(await (await fetch(address)).arrayBuffer());
  const { readFile } = await import('node:fs/promises');
  return WebAssembly.compile(await readFile(address));
};

/** The functions that the module imports (format/web/host.h). */
function imports(host, state) {
  const bytes = (at, count) => new Uint8Array(state.memory.buffer, at, count), text = (at, count) => read_text.decode(bytes(at, count).slice());
  // Files as this run sees them: its own ones, and those that were read.
  const file = (path) => state.written.get(path) ?? state.read.get(path) ?? (state.read.set(path, host.read(path)), state.read.get(path));
  const tried = (work, otherwise) => { try { return work(); } catch { return otherwise; } };
  return {
    size: (at, count) => {
      const path = text(at, count), kind = state.written.has(path) ? 'file' : host.exists(path);
      return kind === 'file' ? tried(() => file(path).length, 0) : kind === 'folder' ? -2 : kind ? -3 : -1;
    },
    read: (at, count, offset, out, size) => tried(() => (bytes(out, size).set(file(text(at, count)).subarray(offset, offset + size)), true), false),
    refusal: (at, count) => {
      const reason = host.refusal?.(text(at, count));
      return reason ? ERRNO[reason] ?? EIO : 0;
    },
    stage: (at, count, from, size) => { state.staged.set(text(at, count), bytes(from, size).slice()); },
    commit: (at, count) => { state.written.set(text(at, count), state.staged.get(text(at, count))); },
    list: (at, count) => give(state, tried(() => host.list(text(at, count)), []).map((name) => `${name}\0`).join('')),
    progress: (at, count, fraction) => host.progress?.(text(at, count), fraction),
    pack: (level, from, count, out, room) => tried(() => {
      const packed = level < 0 ? inflate(bytes(from, count)) : deflate(bytes(from, count), { level });
      if (!packed || packed.length > room) return -1;
      bytes(out, packed.length).set(packed);
      return packed.length;
    }, -1),
    unpack_meshopt: (mode, filter, count, stride, from, size, out) => tried(() => {
      const elements = new Uint8Array(count * stride);
      MeshoptDecoder.decodeGltfBuffer(elements, count, stride, bytes(from, size).slice(), MODES[mode], FILTERS[filter]);
      bytes(out, elements.length).set(elements);
      return 0;
    }, 1)
  };
}

/** What libc asks for: standard output and error, and clocks. */
function wasi(host, state) {
  const view = () => new DataView(state.memory.buffer), decoders = [];
  const known = {
    fd_write: (stream, list, count, total) => {
      let sum = 0;
      for (let i = 0; i < count; ++i) {
        const at = view().getUint32(list + 8 * i, true), size = view().getUint32(list + 8 * i + 4, true);
        const part = new Uint8Array(state.memory.buffer, at, size).slice();
        (stream === 2 ? host.stderr : host.stdout)?.((decoders[stream] ??= new TextDecoder()).decode(part, { stream: true }));
        sum += size;
      }
      view().setUint32(total, sum, true);
      return 0;
    },
    clock_time_get: (clock, _, out) => {
      const milliseconds = clock === 0 ? Date.now() : performance.now();
      view().setBigUint64(out, BigInt(Math.round(milliseconds * 1e6)), true);
      return 0;
    },
    proc_exit: () => { throw new WebAssembly.RuntimeError('exit'); }
  };
  return new Proxy(known, { get: (all, name) => all[name] ?? (() => 8) });  // EBADF
}

function give(state, string) {
  const bytes = write_text.encode(string);
  new Uint8Array(state.memory.buffer, state.input(bytes.length), bytes.length).set(bytes);
}

/**
 * Runs the program with the words behind its name, as `['make', 'twill', '-o', 't.fabric.exr']`; resolves to its exit
 * status: 0 good, 1 bad input, 2 usage. `host` (index.d.ts): files, and what is told. Files are written when the program has
 * ended by itself, each once.
 */
export async function run(argv, host) {
  const module = await (compiled ??= module_of());
  await MeshoptDecoder.ready;
  const state = { read: new Map(), staged: new Map(), written: new Map() };
  try {
    const instance = await WebAssembly.instantiate(module, { host: imports(host, state), wasi_snapshot_preview1: wasi(host, state) });
    Object.assign(state, instance.exports);
    state._initialize();
    give(state, [host.folder ?? '/', ...argv].map((word) => `${word}\0`).join(''));
    const status = state.run();
    for (const [path, bytes] of state.written) host.write(path, bytes);
    return status;
  } catch (error) {
    // Errors of the host's functions end the run; a trap of the module is told.
    const is_trap = error instanceof WebAssembly.RuntimeError || error instanceof RangeError;
    if (!is_trap && !error.code) throw error;
    host.stderr?.(`selvedge: ${is_trap ? 'ended in the middle, with nothing written' : 'cannot write'}: ${error.message}\n`);
    return 1;
  }
}

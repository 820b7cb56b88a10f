// The host of selvedge.wasm: files, and what codecs of others unpack, by JavaScript.
/** Errors of writing, by the numbers of WASI's errno. */
const ERRNO = { EACCES: 2, EPERM: 63, ENOENT: 44, ENOTDIR: 54, EROFS: 69, ENOSPC: 51 }, EIO = 29;
const MODES = ['ATTRIBUTES', 'TRIANGLES', 'INDICES'], FILTERS = ['NONE', 'OCTAHEDRAL', 'QUATERNION', 'EXPONENTIAL'];
/** Characters of the key of a shape of yarn at rest. */
const KEY = 32;
const read_text = new TextDecoder(), write_text = new TextEncoder();

/** The functions of format/web/host.h. `codecs`: { inflate(bytes), deflate(bytes, level), meshopt, encoder, draco }, the last a DracoDecoder. */
function functions_of(host, codecs, state) {
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
    drop: (at, count) => {
      const folder = `${text(at, count)}/`;
      for (const path of state.written.keys()) if (path.startsWith(folder)) state.written.delete(path);
    },
    open: (at, count) => { state.opened.push(text(at, count)); },
    list: (at, count) => give(state, tried(() => host.list(text(at, count)), []).map((name) => `${name}\0`).join('')),
    progress: (at, count, fraction) => host.progress?.(text(at, count), fraction),
    pack: (level, from, count, out, room) => tried(() => {
      const packed = level < 0 ? codecs.inflate(bytes(from, count)) : codecs.deflate(bytes(from, count), level);
      if (!packed || packed.length > room) return -1;
      bytes(out, packed.length).set(packed);
      return packed.length;
    }, -1),
    unpack_meshopt: (mode, filter, count, stride, from, size, out) => tried(() => {
      const elements = new Uint8Array(count * stride);
      codecs.meshopt.decodeGltfBuffer(elements, count, stride, bytes(from, size).slice(), MODES[mode], FILTERS[filter]);
      bytes(out, elements.length).set(elements);
      return 0;
    }, 1),
    pack_meshopt: (mode, from, count, stride, out) => {
      const packed = codecs.encoder.encodeGltfBuffer(bytes(from, count * stride).slice(), count, stride, MODES[mode]);
      bytes(out, packed.length).set(packed);
      return packed.length;
    },
    order_triangles: (from, count, out) => {
      const [indices, former] = [from, out].map((at) => new Uint32Array(state.memory.buffer, at, count)), ordered = indices.slice();
      const [numbers] = codecs.encoder.reorderMesh(ordered, true, true), vertices = [];
      numbers.forEach((number, vertex) => { vertices[number] = vertex; });
      former.set(ordered.map((number) => vertices[number]));
    },
    unpack_draco: (from, size) => {
      try {
        if (!codecs.draco) throw new Error('this page has no decoder');
        const { points, indices } = codecs.draco.decode(bytes(from, size).slice());
        give(state, indices);
        return points;
      } catch ({ message }) {
        give(state, message);
        return -1;
      }
    },
    draco_components: (id) => codecs.draco.components(id),
    draco_values: (id, type) => {
      const values = codecs.draco.values(id, type);
      if (values) give(state, values);
      return Boolean(values);
    },
    recall: (key) => {
      const shape = host.recall?.(text(key, KEY));
      if (shape) give(state, shape);
      return Boolean(shape);
    },
    keep: (key, at, count) => host.keep?.(text(key, KEY), bytes(at, count).slice())
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

/** Gives the module bytes, or a text. */
function give(state, input) {
  const bytes = typeof input === 'string' ? write_text.encode(input) : input;
  const at = state.input(bytes.length);  // which may move the memory
  new Uint8Array(state.memory.buffer, at, bytes.length).set(bytes);
}

/** A module's instance: its exports, and the files that it has `written`. */
function start(module, host, codecs) {
  const state = { read: new Map(), staged: new Map(), written: new Map(), opened: [] };
  const { exports } = new WebAssembly.Instance(module, { host: functions_of(host, codecs, state), wasi_snapshot_preview1: wasi(host, state) });
  Object.assign(state, exports)._initialize();
  return state;
}

/** A host of files in memory, a Map of names and bytes; what is told is added to `said`, { out, err }. */
export const memory_host = (files, said, progress) => ({
  exists: (path) => files.has(path) ? 'file' : path === '/' || path === '.' ? 'folder' : undefined,
  read: (path) => files.get(path),
  list: () => [...files.keys()],
  write: (path, bytes) => files.set(path, bytes),
  progress,
  stdout: (text) => { said.out += text; },
  stderr: (text) => { said.err += text; }
});

/**
 * Runs the program, as run() of run.js. What yarns at rest look like the host may remember: keep(key, bytes), recall(key).
 * `entry`: 'preview' makes, in a fraction of the time, what looks about like the fabric that these words of `make` ask for; 'edit' and
 * 'recolour' from the fabric of --recolour, of nearly the same yarn, or the same in other colours, 'tint' in these at once.
 */
export function run_module(module, argv, host, codecs, entry = 'run') {
  try {
    const state = start(module, host, codecs);
    give(state, [host.folder ?? '/', host.shared ?? '/', ...argv].map((word) => `${word}\0`).join(''));
    const status = state[entry]();
    for (const [path, bytes] of state.written) host.write(path, bytes);
    for (const path of state.opened) {
      if (host.open?.(path)) continue;
      host.stderr?.(`selvedge: ${path}: --open: no browser can be started [OPTION_OUT_OF_RANGE]\n`);
      return 1;
    }
    return status;
  } catch (error) {
    // Errors of the host's functions end the run; a trap of the module is told.
    const is_trap = error instanceof WebAssembly.RuntimeError || error instanceof RangeError;
    if (!is_trap && !error.code) throw error;
    host.stderr?.(`selvedge: ${is_trap ? 'ended in the middle, with nothing written; the next run starts anew' : 'cannot write'}: ${error.message}\n`);
    return 1;
  }
}

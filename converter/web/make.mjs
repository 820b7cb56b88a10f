// The host of make.wasm: fabrics as `selvedge make` makes them, in Node or a browser's worker.

/**
 * Makes a fabric; returns { bytes, remarks }, the bytes of its file. `module`: make.wasm as a WebAssembly.Module, of which
 * every fabric gets an instance of its own, so that a refusal leaves nothing behind. `recipe`: { stitch, text, set, quality,
 * sides, seed }: a built-in stitch's name, or the name (.txt, .wif, .json) and text of a chart, draft or description;
 * and options of `selvedge make` by their names, such as { set: { radius_mm: 0.5, colour: '#aa3322' }, quality: 'draft' }.
 * `deflate`: packs a Uint8Array by zlib at level 4. `progress` is told the stage (0: yarns come to rest, 1: bake, 2: fit)
 * and the fraction of it that is done; it may throw, which ends the work. `describe` is told the parameters of a text's stitch,
 * as `selvedge stitch --list NAME --json` has them, before it is drawn. Throws an Error of one line.
 */
export function make_fabric(module, recipe, { deflate, progress = () => {}, describe = () => {} }) {
  let bytes;
  const remarks = [];
  const at = (address, count) => new Uint8Array(made.memory.buffer, address, count);
  const host = {
    progress,
    deflate: (address, count, out) => {
      const packed = deflate(at(address, count));
      if (packed.length >= count) return count;
      at(out, packed.length).set(packed);
      return packed.length;
    },
    tell: (what, address, count) => {
      const told = at(address, count).slice();
      if (what === 0) bytes = told;
      if (what === 1) throw new Error(new TextDecoder().decode(told));
      if (what === 2) remarks.push(new TextDecoder().decode(told));
      if (what === 3) describe(JSON.parse(new TextDecoder().decode(told)));
    }
  };
  // The module has no files: libc's messages are refused (EBADF).
  const wasi_snapshot_preview1 = new Proxy({}, { get: () => () => 8 });
  const made = new WebAssembly.Instance(module, { host, wasi_snapshot_preview1 }).exports;
  made._initialize();
  const text = new TextEncoder().encode(JSON.stringify(recipe));
  at(made.input(text.length), text.length).set(text);
  try {
    made.make();
  } catch (error) {
    if (!(error instanceof WebAssembly.RuntimeError)) throw error;
    throw new Error(`${recipe.stitch}: needs more memory than there is [FILE_TOO_LARGE]`);
  }
  return { bytes, remarks };
}

// The host of make.wasm: fabrics as `selvedge make` makes them, in Node or a browser's worker.

/** Shapes of yarn at rest that are kept: bytes, of which the first are the key. */
const MAX_SHAPES = 64, KEY = 32;
const key_of = (bytes) => String.fromCharCode(...bytes.subarray(0, KEY));
/** Keeps a shape as the newest of a Map, from which the oldest one goes. */
export function keep_shape(shapes, shape) {
  shapes.delete(key_of(shape));
  shapes.set(key_of(shape), shape);
  if (shapes.size > MAX_SHAPES) shapes.delete(shapes.keys().next().value);
}

/** Makes fabrics, one after the other. */
export class FabricMaker {
  #made = null;
  #result = {};
  /**
   * `module`: make.wasm as a WebAssembly.Module. `deflate`: packs a Uint8Array by zlib at level 4. `progress`: called with the
   * stage (0: yarns come to rest, 1: bake, 2: fit) and the fraction of it that is done; it may throw, which ends the work.
   * `describe`: called with the parameters of a text's stitch before it is drawn, as `selvedge stitch --list NAME --json` has them.
   * `shapes`: a Map of keep_shape(), how yarns came to rest, which grows; `shape`: called with what is added.
   */
  constructor(module, { deflate, progress = () => {}, describe = () => {}, shapes = new Map(), shape = () => {} }) {
    Object.assign(this, { module, deflate, progress, describe, shapes, shape });
  }
  #at(address, count) {
    return new Uint8Array(this.#made.memory.buffer, address, count);
  }
  #start() {
    const host = {
      progress: (...values) => this.progress(...values),
      deflate: (address, count, out) => {
        const packed = this.deflate(this.#at(address, count));
        if (packed.length >= count) return count;
        this.#at(out, packed.length).set(packed);
        return packed.length;
      },
      recall: (address) => {
        const shape = this.shapes.get(key_of(this.#at(address, KEY)));
        if (shape) this.#input(shape.subarray(KEY));
        return Boolean(shape);
      },
      emit: (event, address, count) => {
        const bytes = this.#at(address, count).slice();
        if (event === 0) this.#result.bytes = bytes;
        if (event === 1) throw new Error(new TextDecoder().decode(bytes));
        if (event === 2) this.#result.remarks.push(new TextDecoder().decode(bytes));
        if (event === 3) this.describe(JSON.parse(new TextDecoder().decode(bytes)));
        if (event === 4) {
          keep_shape(this.shapes, bytes);
          this.shape(bytes);
        }
      }
    };
    // The module has no files: libc's messages are refused (EBADF).
    const wasi_snapshot_preview1 = new Proxy({}, { get: () => () => 8 });
    this.#made = new WebAssembly.Instance(this.module, { host, wasi_snapshot_preview1 }).exports;
    this.#made._initialize();
  }
  #input(bytes) {
    this.#at(this.#made.input(bytes.length), bytes.length).set(bytes);
  }
  /** Calls describe() with the built-in stitches. */
  stitches() {
    if (!this.#made) this.#start();
    this.#made.stitches();
  }
  /**
   * Makes a fabric; returns { bytes, remarks }, the bytes of its file. `recipe`: { stitch, text, set, quality, sides, seed, bytes }:
   * a built-in stitch's name, or the name (.txt, .wif, .json) and text of a chart, draft or description; and options of
   * `selvedge make` by their names, such as { set: { radius_mm: 0.5, colour: '#aa3322' }, quality: 'draft' }. Throws an
   * Error of one line.
   */
  make(recipe) {
    return this.#do('make', recipe);
  }
  /** Makes a fabric with about the same yarn, in a fraction of the time; its recipe may yet be refused. */
  preview(recipe) {
    return this.#do('preview', recipe);
  }
  #do(what, recipe) {
    this.#result = { remarks: [] };
    try {
      if (!this.#made) this.#start();
      this.#input(new TextEncoder().encode(JSON.stringify(recipe)));
      this.#made[what]();
      return this.#result;
    } catch (error) {
      // An instance that ends in the middle leaves nothing behind.
      this.#made = null;
      if (!(error instanceof WebAssembly.RuntimeError)) throw error;
      throw new Error(`${recipe.stitch}: needs more memory than there is [FILE_TOO_LARGE]`);
    }
  }
}

// The host of make.wasm: fabrics as `selvedge make` makes them, in Node or a browser's worker.

/** Shapes of yarn that are remembered. */
export const MAX_SHAPES = 32;

/** Makes fabrics, one after the other, and remembers between them how yarns came to rest. */
export class FabricMaker {
  #made = null;
  #told = {};
  #shapes = [];
  #given = [];
  /**
   * `module`: make.wasm as a WebAssembly.Module. `deflate`: packs a Uint8Array by zlib at level 4. `progress` is told the
   * stage (0: yarns come to rest, 1: bake, 2: fit) and the fraction of it that is done; it may throw, which ends the work.
   * `describe` is told the parameters of a text's stitch before it is drawn, as `selvedge stitch --list NAME --json` has them;
   * `shape` shapes of yarn at rest, bytes that remember() of this or another maker takes.
   */
  constructor(module, { deflate, progress = () => {}, describe = () => {}, shape = () => {} }) {
    Object.assign(this, { module, deflate, progress, describe, shape });
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
      tell: (what, address, count) => {
        const told = this.#at(address, count).slice();
        if (what === 0) this.#told.bytes = told;
        if (what === 1) throw new Error(new TextDecoder().decode(told));
        if (what === 2) this.#told.remarks.push(new TextDecoder().decode(told));
        if (what === 3) this.describe(JSON.parse(new TextDecoder().decode(told)));
        if (what === 4) {
          this.#shapes.splice(0, this.#shapes.push(told) - MAX_SHAPES);
          this.shape(told);
        }
      }
    };
    // The module has no files: libc's messages are refused (EBADF).
    const wasi_snapshot_preview1 = new Proxy({}, { get: () => () => 8 });
    this.#made = new WebAssembly.Instance(this.module, { host, wasi_snapshot_preview1 }).exports;
    this.#made._initialize();
    for (const shape of [...this.#given, ...this.#shapes]) this.#run('remember', shape);
  }
  #run(what, bytes) {
    this.#at(this.#made.input(bytes.length), bytes.length).set(bytes);
    this.#made[what]();
  }
  /** Takes a shape that a maker has told, and keeps it. */
  remember(shape) {
    this.#given.push(shape);
    if (this.#made) this.#run('remember', shape);
  }
  /** Tells describe() the built-in stitches. */
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
    this.#told = { remarks: [] };
    try {
      if (!this.#made) this.#start();
      this.#run(what, new TextEncoder().encode(JSON.stringify(recipe)));
      return this.#told;
    } catch (error) {
      // An instance that ends in the middle leaves nothing behind.
      this.#made = null;
      if (!(error instanceof WebAssembly.RuntimeError)) throw error;
      throw new Error(`${recipe.stitch}: needs more memory than there is [FILE_TOO_LARGE]`);
    }
  }
}

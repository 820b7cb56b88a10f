// Fabrics as `selvedge make` makes them, by recipes, in Node or a browser's worker.
import { KEY, give, start } from './host.js';

/** Shapes of yarn at rest that are kept: bytes, of which the first KEY are the key. */
const MAX_SHAPES = 64;
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
  #text = null;
  /**
   * `module`: selvedge.wasm as a WebAssembly.Module. `deflate`: packs a Uint8Array by zlib at a level. `progress`: called with the
   * stage ('relax': yarns come to rest, 'bake', 'fit') and the fraction of it that is done; it may throw, which ends the work.
   * `describe`: called with the parameters of a text's stitch before it is drawn, as `selvedge stitch --list NAME --json` has them.
   * `shapes`: a Map of keep_shape(), how yarns came to rest, which grows; `shape`: called with what is added.
   */
  constructor(module, { deflate, progress = () => {}, describe = () => {}, shapes = new Map(), shape = () => {} }) {
    Object.assign(this, { module, deflate });
    this.host = {
      exists: () => this.#text === null ? undefined : 'file',
      read: () => this.#text,
      progress,
      recall: (key) => shapes.get(key_of(key))?.subarray(KEY),
      emit: (event, bytes) => {
        const text = () => new TextDecoder().decode(bytes);
        if (event === 0) this.#result.refusal = text();
        if (event === 1) this.#result.remarks.push(text());
        if (event === 2) describe(JSON.parse(text()));
        if (event === 3) {
          keep_shape(shapes, bytes);
          shape(bytes);
        }
      }
    };
  }
  #start = () => this.#made ??= start(this.module, this.host, this);
  /** Calls describe() with the built-in stitches. */
  stitches() {
    this.#start().stitches();
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
    const { stitch, text } = recipe, result = this.#result = { remarks: [] };
    this.#text = text === undefined ? null : new TextEncoder().encode(text);
    try {
      const made = this.#start();
      give(made, JSON.stringify(recipe));
      made[what]();
      result.bytes = made.written.get(stitch);
      for (const files of [made.read, made.staged, made.written]) files.clear();
    } catch (error) {
      // An instance that ends in the middle leaves nothing behind.
      this.#made = null;
      if (!(error instanceof WebAssembly.RuntimeError)) throw error;
      result.refusal = `${stitch}: needs more memory than there is [FILE_TOO_LARGE]`;
    }
    if (result.refusal) throw new Error(result.refusal);
    return result;
  }
}

// The worker of the program (maker_worker.js), as the page has it.
import {keep_shape} from './shapes.js';

const KEY = 32;
export class Maker {
  static #url = URL.createObjectURL(new Blob([document.getElementById('maker').textContent], {type: 'text/javascript'}));
  /** A promise, of one for all. */
  static #program = null;
  /** For the next worker: shapes that the page brings, each after its key and length, and others. */
  static #shapes = new Map();
  #worker = null;
  #is_busy = false;
  #queue = Promise.resolve();
  /** `page`: { progress(stage, fraction), relaxed(), bytes_of(id) }: called with what the worker posts; bytes in the page. */
  constructor(page) {
    this.page = page;
  }
  async #load() {
    const bytes = await this.page.bytes_of('shapes'), numbers = new DataView(bytes), text = new TextDecoder();
    for (let begin = 0, count; begin < bytes.byteLength; begin += KEY + 4 + count) {
      count = numbers.getUint32(begin + KEY, true);
      keep_shape(Maker.#shapes, text.decode(new Uint8Array(bytes, begin, KEY)), new Uint8Array(bytes, begin + KEY + 4, count));
    }
    return {program: await WebAssembly.compile(await this.page.bytes_of('program')), draco: await this.page.bytes_of('draco')};
  }
  /** Runs the program on files, bytes by names: { files, report }, also of the Error of one line that it throws. What it runs yet ends. */
  async run(argv, files, entry) {
    const loaded = await (Maker.#program ??= this.#load());
    if (this.#is_busy) this.#worker.terminate();
    if (this.#is_busy || !this.#worker) {
      this.#worker = new Worker(Maker.#url);
      this.#worker.postMessage({...loaded, shapes: Maker.#shapes});
    }
    this.#is_busy = true;
    const answer = await new Promise((resolve) => {
      const end = (data) => resolve(data, this.#is_busy = false);
      this.#worker.onmessage = ({data}) => {
        if (data.shape) return this.page.relaxed(keep_shape(Maker.#shapes, data.key, data.shape));
        if (data.stage === undefined) return end(data);
        this.page.progress(data.stage, data.fraction);
      };
      this.#worker.onerror = ({message}) => {
        this.#worker = null;
        end({status: 1, out: '', err: message || 'the worker ended'});
      };
      this.#worker.postMessage({argv: [...argv, '--json'], files: new Map(Object.entries(files)), entry});
    });
    const report = answer.out ? JSON.parse(answer.out) : {}, {message, place, code} = report.error ?? {message: answer.err.trim()};
    if (answer.status === 0) return {files: answer.files, report};
    throw Object.assign(new Error([place, message].filter(Boolean).join(': ') + (code ? ` [${code}]` : '')), {report});
  }
  /** The same after what it runs yet. */
  run_next(argv, files) {
    return this.#queue = this.#queue.catch(() => {}).then(() => this.run(argv, files));
  }
}

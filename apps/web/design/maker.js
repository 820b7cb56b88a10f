// The worker of the program (maker_worker.js), as the page has it.
import {keep_shape} from '../../npm/make.mjs';

export class Maker {
  static #url = URL.createObjectURL(new Blob([document.getElementById('maker').textContent], {type: 'text/javascript'}));
  /** A promise, of one for all. */
  static #program = null;
  #worker = null;
  #is_busy = false;
  #run = Promise.resolve();
  /** Shapes of yarn at rest for the next worker: those that the page brings, each after its length, and others. */
  static #shapes = new Map();
  /** `page`: { progress(stage, fraction), relaxed(), bytes_of(id) }: called with what the worker posts; bytes in the page. */
  constructor(page) {
    this.page = page;
  }
  async #load() {
    const bytes = await this.page.bytes_of('shapes'), numbers = new DataView(bytes);
    for (let begin = 0, count; begin < bytes.byteLength; begin += 4 + count)
      keep_shape(Maker.#shapes, new Uint8Array(bytes, begin + 4, count = numbers.getUint32(begin, true)));
    return {program: await WebAssembly.compile(await this.page.bytes_of('program')), draco: await this.page.bytes_of('draco')};
  }
  /** Runs the program on files, bytes by names, after what it runs yet: { files, report }, also of the Error of one line that it throws. */
  run(argv, files) {
    return this.#run = this.#run.catch(() => {}).then(async () => {
      const answer = await this.ask({argv: [...argv, '--json'], files: new Map(Object.entries(files))});
      const report = answer.out ? JSON.parse(answer.out) : {error: {message: answer.refusal ?? answer.err.trim()}}, {error} = report;
      if (!error) return {files: answer.files, report};
      const line = [error.place, error.message].filter(Boolean).join(': ') + (error.code ? ` [${error.code}]` : '');
      throw Object.assign(new Error(line), {report});
    });
  }
  /** Sends the worker work, and returns its answer. A worker that is busy with other work ends. */
  async ask(message) {
    const loaded = await (Maker.#program ??= this.#load());
    if (this.#is_busy) this.#worker.terminate();
    if (this.#is_busy || !this.#worker) {
      this.#worker = new Worker(Maker.#url);
      this.#worker.postMessage({...loaded, shapes: Maker.#shapes});
    }
    this.#is_busy = true;
    return new Promise((end) => {
      const answer = (found) => {
        this.#is_busy = false;
        end(found);
      };
      this.#worker.onmessage = ({data: {stage, fraction, shape, ...found}}) => {
        if (shape) return this.page.relaxed(keep_shape(Maker.#shapes, shape));
        if (stage === undefined) return answer(found);
        this.page.progress(stage, fraction);
      };
      this.#worker.onerror = ({message}) => {
        this.#worker = null;
        answer({refusal: message || 'the worker ended'});
      };
      this.#worker.postMessage(message);
    });
  }
}

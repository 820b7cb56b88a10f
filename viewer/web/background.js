// Runs CellWorker in a worker, so that the page stays responsive; on the main thread if there is no worker.
import {Issue} from './reader/issue.js';

let make_worker = () => new Worker(new URL('./worker.js', import.meta.url), {type: 'module'});
let wasm = new URL('./cells.wasm', import.meta.url).href;
let memory = 64 * 2 ** 20;
let port = null, is_worker = false, is_dead = false;
const waiting = new Map(), listeners = [];
let count = 0;

/**
 * Sets how the worker is made, for pages whose modules are not files: make() returns a Worker that runs worker.js; and the
 * bytes or the address of cells.wasm.
 */
export function use_worker(make, module = wasm) {
  make_worker = make;
  wasm = module;
}
/** Bytes that cell images may take, 4 to 128 MiB, before the first fabric is loaded. */
export const use_memory = (bytes) => void (memory = bytes);
/** Calls listener(message) for messages of kind 'images' and 'rows', and for 'end': nothing more comes. */
export const add_listener = (listener) => void listeners.push(listener);

/** The fabrics and garments of the worker are lost. */
function end_with(message) {
  if (is_dead) return;
  is_dead = true;
  for (const {fail} of waiting.values()) fail(new Issue('GRAPHICS_UNAVAILABLE', '', `the worker ended: ${message}`));
  waiting.clear();
  for (const listener of listeners) listener({kind: 'end', message});
}
function take({kind, id, issue, ...message}) {
  if (kind === 'end') return end_with(message.message);
  if (kind === 'images' || kind === 'rows') return listeners.forEach((listener) => listener({kind, ...message}));
  const {end, fail} = waiting.get(id);
  waiting.delete(id);
  if (issue) return fail(new Issue(...issue));
  end(kind === 'fabric' ? {...message.result, read_in: is_worker ? 'worker' : 'main thread'} : message);
}
function start_here(messages) {
  const here = import('./cell_worker.js').then(({CellWorker}) => new CellWorker(take));
  here.catch(({message}) => end_with(message));
  port = (message) => void here.then((worker) => worker.receive(message), () => {});
  is_worker = false;
  for (const message of messages) port(message);
}
function start() {
  const first = {kind: 'start', wasm, memory}, sent = [first];
  let worker, ready = false;
  const start_without = (why) => {
    if (globalThis.Worker) console.warn(`selvedge: worker.js does not load${why ? `: ${why}` : ''}; serve it where the page looks for it, or make it by use_worker(); the main thread does its work`);
    start_here(sent);
  };
  try {
    worker = make_worker();
  } catch (error) {
    return start_without(error.message);
  }
  is_worker = true;
  port = (message, transfer) => {
    // Until it answers the worker may turn out not to load.
    if (!ready) sent.push(message);
    worker.postMessage(message, ready ? transfer : []);
  };
  worker.postMessage(first);
  worker.onmessage = ({data}) => {
    if (data.kind === 'ready') {
      ready = true;
      sent.length = 0;
    } else
      take(data);
  };
  worker.onerror = (event) => {
    event.preventDefault();
    worker.terminate();
    if (!ready) return start_without(event.message);
    end_with(event.message);
  };
}

/** Sends a message of cell_worker.js that nothing answers. */
export function send_to_worker(message, transfer) {
  if (!port) start();
  if (!is_dead) port(message, transfer);
}
/** The answer to a message; of fabrics with `read_in`: 'worker' or 'main thread'. Throws an Issue. */
export function ask_worker(message, transfer) {
  if (is_dead) throw new Issue('GRAPHICS_UNAVAILABLE', '', 'the worker ended');
  return new Promise((end, fail) => {
    waiting.set(++count, {end, fail});
    send_to_worker({...message, id: count}, transfer);
  });
}

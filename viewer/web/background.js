// Loads fabrics in a worker, so that the page stays responsive; on the main thread if there is no worker.
import {load_words} from './load.js';
import {Issue} from './reader/index.js';

let make_worker = () => new Worker(new URL('./worker.js', import.meta.url), {type: 'module'});
let worker;  // null: none can be made
const jobs = new Map();
let count = 0;

/** Sets how the worker is made, for pages whose modules are not files: make() returns a Worker that runs worker.js. */
export function use_worker(make) {
  make_worker = make;
}

const load_here = async (source) => ({...await load_words(source), read_in: 'main thread'});

function start() {
  try {
    worker = make_worker();
  } catch {
    worker = null;
    return;
  }
  worker.onmessage = ({data: {id, result, issue}}) => {
    const {end, fail} = jobs.get(id);
    jobs.delete(id);
    if (issue)
      fail(new Issue(...issue));
    else
      end({...result, read_in: 'worker'});
  };
  // The worker cannot be loaded: its jobs are done on the main thread.
  worker.onerror = (event) => {
    event.preventDefault();
    worker.terminate();
    worker = null;
    for (const {source, end, fail} of jobs.values()) load_here(source).then(end, fail);
    jobs.clear();
  };
}

/** The result of load_words(), with `read_in`: 'worker' or 'main thread'. Throws an Issue. */
export function load(source) {
  if (worker === undefined) start();
  if (!worker) return load_here(source);
  return new Promise((end, fail) => {
    jobs.set(++count, {source, end, fail});
    worker.postMessage({id: count, source});
  });
}

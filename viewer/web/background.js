// Loads fabrics in a worker, so that pictures go on meanwhile; on this thread where there can be none.
import {load_words} from './load.js';
import {Issue} from './reader/index.js';

let make_worker = () => new Worker(new URL('./worker.js', import.meta.url), {type: 'module'});
let worker;  // null: there can be none
const jobs = new Map();
let count = 0;

/** How the worker is made, for pages whose modules are no files: make() gives a Worker that runs worker.js. */
export function use_worker(make) {
  make_worker = make;
}

function start() {
  try {
    worker = make_worker();
  } catch {
    worker = null;
    return;
  }
  worker.onmessage = ({data: {id, step, issue}}) => {
    const job = jobs.get(id);
    if (step) return job.take(step);
    jobs.delete(id);
    if (issue)
      job.fail(new Issue(...issue));
    else
      job.end('worker');
  };
  // It could not be loaded: what it was to do is done here.
  worker.onerror = (event) => {
    event.preventDefault();
    worker.terminate();
    worker = null;
    for (const {source, take, end, fail} of jobs.values()) load_here(source, take).then(end, fail);
    jobs.clear();
  };
}

async function load_here(source, take) {
  for await (const step of load_words(source)) take(step);
  return 'main thread';
}

/** Gives take() what load_words() gives; returns where that was done, 'worker' or 'main thread'. Throws an Issue. */
export function load(source, take) {
  if (worker === undefined) start();
  if (!worker) return load_here(source, take);
  return new Promise((end, fail) => {
    jobs.set(++count, {source, take, end, fail});
    worker.postMessage({id: count, source});
  });
}

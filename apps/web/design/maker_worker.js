// The worker of the program: takes { program, draco, shapes } first, a WebAssembly.Module, bytes and a Map of keep_shape(). To
// { argv, files, entry } of run_module() it posts { stage, fraction } and { key, shape } meanwhile, then { status, files, out, err }.
import {codecs} from '../../npm/codecs.js';
import {DracoDecoder} from '../../npm/draco.js';
import {memory_host, run_module} from '../../npm/host.js';
import {keep_shape} from './shapes.js';

/** ms between two messages of progress. */
const INTERVAL = 100;
let module = null, draco = null, shapes = null, posted_at = 0;

function progress(stage, fraction) {
  if (performance.now() < posted_at + INTERVAL) return;
  posted_at = performance.now();
  postMessage({stage, fraction});
}
function keep(key, shape) {
  keep_shape(shapes, key, shape);
  postMessage({key, shape});
}
onmessage = (message) => answer(message).catch((error) => postMessage({status: 1, files: new Map(), out: '', err: String(error)}));
async function answer({data}) {
  if (data.program) {
    ({program: module, shapes} = data);
    return draco = new DracoDecoder(() => data.draco);
  }
  const {argv, files, entry} = data, said = {out: '', err: ''};
  await Promise.all([codecs.meshopt.ready, codecs.encoder.ready]);
  // Previews, recoloured cloth and pages are read at once, by this page alone; a make counts the bytes of its files.
  const is_read = ['preview', 'tint', 'recolour'].includes(entry) || argv[0] === 'page', deflate = is_read ? (bytes) => codecs.deflate(bytes, 0) : codecs.deflate;
  const status = run_module(module, argv, {...memory_host(files, said, progress), recall: (key) => shapes.get(key), keep}, {...codecs, deflate, draco}, entry);
  postMessage({status, files, ...said});
}

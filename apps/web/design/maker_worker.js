// The worker of the program: takes { program, draco, shapes } first, a WebAssembly.Module, bytes and a Map of keep_shape(). To { argv, files } it
// posts { files, out, err } of the program's run. To { recipe, whole } it posts { stage, fraction }, { shape }, and
// { bytes, remarks } of a preview or of the whole fabric, or { refusal }, a line.
import {codecs as codecs_of_all} from '../../npm/codecs.js';
import {DracoDecoder} from '../../npm/draco.js';
import {memory_host, run_module} from '../../npm/host.js';
import {FabricMaker} from '../../npm/make.mjs';

/** ms between two messages of progress. */
const INTERVAL = 100;
let codecs = codecs_of_all, module = null, maker = null, posted_at = 0, is_whole = false;

function progress(stage, fraction) {
  if (performance.now() < posted_at + INTERVAL) return;
  posted_at = performance.now();
  postMessage({stage, fraction});
}
onmessage = async ({data: {program, draco, shapes, argv, files, recipe, whole}}) => {
  if (program) {
    codecs = {...codecs_of_all, draco: new DracoDecoder(() => draco)};
    // Previews are read at once, by this page alone.
    const deflate = (bytes, level) => is_whole ? codecs.deflate(bytes, level) : bytes;
    maker = new FabricMaker(module = program, {deflate, progress, shapes, shape: (shape) => postMessage({shape})});
    return;
  }
  if (argv) {
    const said = {out: '', err: ''};
    await Promise.all([codecs.meshopt.ready, codecs.encoder.ready]);
    // A page is read at once, too.
    run_module(module, argv, memory_host(files, said), argv[0] === 'page' ? {...codecs, deflate: (bytes) => codecs.deflate(bytes, 0)} : codecs);
    return postMessage({files, ...said});
  }
  is_whole = whole;
  try {
    const made = whole ? maker.make(recipe) : maker.preview(recipe);
    postMessage(made, [made.bytes.buffer]);
  } catch (error) {
    postMessage({refusal: error.message});
  }
};

// The worker that makes fabrics, one after the other: takes { module, shapes } of FabricMaker first, then { recipe, whole };
// posts { stitch } of a text, { stage, fraction }, { shape }, and { bytes, remarks } of a preview or of the whole, or { refusal }, a line.
import {zlibSync} from 'three/addons/libs/fflate.module.js';
import {FabricMaker} from '../../../converter/web/make.mjs';

/** ms between two messages of progress. */
const INTERVAL = 100;
let maker = null, posted_at = 0, is_whole = false;

function progress(stage, fraction) {
  if (performance.now() < posted_at + INTERVAL) return;
  posted_at = performance.now();
  postMessage({stage, fraction});
}
onmessage = ({data: {module, shapes, recipe, whole}}) => {
  if (module) {
    // Previews are read at once, by this page alone.
    const deflate = (bytes) => is_whole ? zlibSync(bytes, {level: 4}) : bytes;
    maker = new FabricMaker(module, {deflate, progress, shapes, describe: (stitch) => postMessage({stitch}), shape: (shape) => postMessage({shape})});
    return;
  }
  is_whole = whole;
  try {
    const made = whole ? maker.make(recipe) : maker.preview(recipe);
    postMessage(made, [made.bytes.buffer]);
  } catch (error) {
    postMessage({refusal: error.message});
  }
};

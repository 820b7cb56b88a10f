// The worker that makes fabrics, one after the other: takes { module, shapes } of FabricMaker at first, then { recipe, whole };
// posts { stitch } of a text, { stage, fraction }, { shape }, and { bytes, remarks } of a preview or of the whole, or { refusal }, a line.
import {zlibSync} from 'three/addons/libs/fflate.module.js';
import {FabricMaker} from '../../../converter/web/make.mjs';

/** ms between two messages of progress. */
const TELL = 100;
let maker = null, told = 0, is_whole = false;

function progress(stage, fraction) {
  if (performance.now() < told + TELL) return;
  told = performance.now();
  postMessage({stage, fraction});
}
onmessage = ({data: {module, shapes, recipe, whole}}) => {
  if (module) {
    // Previews are read at once, by this page alone.
    const deflate = (bytes) => is_whole ? zlibSync(bytes, {level: 4}) : bytes;
    const describe = (stitch) => postMessage({stitch}), shape = (shape) => postMessage({shape});
    maker = new FabricMaker(module, {deflate, progress, describe, shape});
    for (const known of shapes) maker.remember(known);
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

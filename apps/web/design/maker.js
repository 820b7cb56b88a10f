// The worker that makes a fabric: takes { module, recipe } of make_fabric(); posts { stitch } of a text and { stage, fraction },
// then { bytes, remarks } or { refusal }, a line.
import {zlibSync} from 'three/addons/libs/fflate.module.js';
import {make_fabric} from '../../../converter/web/make.mjs';

/** ms between two messages of progress. */
const TELL = 100;

onmessage = ({data: {module, recipe}}) => {
  let told = 0;
  const progress = (stage, fraction) => {
    if (performance.now() < told + TELL) return;
    told = performance.now();
    postMessage({stage, fraction});
  };
  try {
    const describe = (stitch) => postMessage({stitch}), deflate = (bytes) => zlibSync(bytes, {level: 4});
    const made = make_fabric(module, recipe, {deflate, progress, describe});
    postMessage(made, [made.bytes.buffer]);
  } catch (error) {
    postMessage({refusal: error.message});
  }
};

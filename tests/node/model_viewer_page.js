// In the browser: a file in model-viewer.
import { ModelViewerElement } from '/model-viewer/model-viewer.min.js';

ModelViewerElement.meshoptDecoderLocation = '/meshopt/meshopt_decoder.cjs';

/** The element that shows it, once it is loaded. */
export async function shown(src) {
  const viewer = document.createElement('model-viewer');
  Object.assign(viewer.style, { width: '200px', height: '200px' });
  const loaded = new Promise((good, bad) => {
    viewer.addEventListener('load', good, { once: true });
    viewer.addEventListener('error', ({ detail }) => bad(new Error(`${detail.sourceError}`)), { once: true });
  });
  viewer.src = src;
  document.body.replaceChildren(viewer);
  await loaded;
  return viewer;
}

// In the browser: how tests draw, here with three.js's WebGLRenderer.
import { PMREMGenerator, WebGLRenderTarget, WebGLRenderer } from 'three';

export * from 'selvedge/three';
export { PMREMGenerator, WebGLRenderTarget as RenderTarget };
export async function renderer_of() {
  const renderer = new WebGLRenderer({ preserveDrawingBuffer: true });
  renderer.setClearColor(0, 0);
  renderer.shadowMap.enabled = true;
  return renderer;
}
/** Loses a renderer's graphics, and gives a renderer with them. */
export async function restore(renderer) {
  const { canvas } = renderer.getContext(), lose = renderer.getContext().getExtension('WEBGL_lose_context');
  for (const [event, act] of [['webglcontextlost', 'loseContext'], ['webglcontextrestored', 'restoreContext']]) {
    const comes = new Promise((end) => canvas.addEventListener(event, () => setTimeout(end, 50), { once: true }));
    lose[act]();
    await comes;
  }
  renderer.setClearColor(0, 0);
  return renderer;
}
/** Red, green, blue and alpha of each pixel of a float target, row by row from below. */
export async function read(renderer, target) {
  const { width, height } = target, pixels = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
  return pixels;
}

// In the browser: how tests draw, here with three.js's WebGPURenderer; `?webgl`: with its back end for WebGL 2.
import { WebGPUCoordinateSystem } from 'three';
import { PMREMGenerator, RectAreaLightNode, RenderTarget, WebGPURenderer } from 'three/webgpu';
import { RectAreaLightTexturesLib } from 'three/addons/lights/RectAreaLightTexturesLib.js';

export * from 'selvedge/three/nodes';
export { PMREMGenerator, RenderTarget };
RectAreaLightNode.setLTC(RectAreaLightTexturesLib.init());
export async function renderer_of() {
  const renderer = new WebGPURenderer({ forceWebGL: import.meta.url.endsWith('?webgl') });
  await renderer.init();
  renderer.setClearColor(0, 0);
  renderer.shadowMap.enabled = true;
  return renderer;
}
/** Loses a renderer's graphics, and gives another one: three.js's draws no more. */
export async function restore({ backend: { gl, device } }) {
  gl?.getExtension('WEBGL_lose_context').loseContext();
  device?.destroy();
  await new Promise((end) => setTimeout(end, 50));
  return renderer_of();
}
export async function read(renderer, target) {
  const { width, height } = target, given = await renderer.readRenderTargetPixelsAsync(target, 0, 0, width, height);
  if (renderer.coordinateSystem !== WebGPUCoordinateSystem && given.length === 4 * width * height) return given;
  // Rows begin at multiples of 256 bytes.
  const pixels = new Float32Array(4 * width * height), row = Math.ceil(width / 16) * 64;
  for (let y = 0; y < height; ++y) pixels.set(given.subarray(row * y, row * y + 4 * width), 4 * width * (height - 1 - y));
  return pixels;
}

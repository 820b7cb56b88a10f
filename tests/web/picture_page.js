// In the browser: the camera of a picture, and its pixels.
import { PerspectiveCamera, Vector3 } from 'three';

/** A camera as `selvedge-view render` places it. */
export function camera_of({ look_at, distance, fov, azimuth, elevation, width, height }) {
  const camera = new PerspectiveCamera(fov, width / height, distance / 100, 10 * distance);
  const [a, e] = [azimuth, elevation].map((degrees) => degrees * Math.PI / 180);
  const target = new Vector3(...look_at);
  camera.position.set(Math.sin(a) * Math.cos(e), Math.sin(e), Math.cos(a) * Math.cos(e))
    .multiplyScalar(distance).add(target);
  camera.lookAt(target);
  return camera;
}

/** Pixels of a target, row by row from the top, that come row by row from below. */
export function rows_of(pixels, { width, height }) {
  const row = 4 * width, turned = new Float32Array(row * height);
  for (let y = 0; y < height; ++y) turned.set(pixels.subarray(row * (height - 1 - y), row * (height - y)), row * y);
  return turned;
}

/** The pixels of a float target of a WebGLRenderer, row by row from the top. */
export function read_rows(renderer, target) {
  const { width, height } = target, pixels = new Float32Array(4 * width * height);
  renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
  return rows_of(pixels, target);
}

/** The bytes of floats. */
export function base64(floats) {
  const bytes = new Uint8Array(floats.buffer);
  let text = '';
  for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
  return btoa(text);
}

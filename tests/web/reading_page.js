// In the browser: loads a garment, and watches when its fabric shows.
import { PerspectiveCamera, Scene, WebGLRenderer } from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { xxh3_128 } from 'selvedge/reader/index.js';
import { SelvedgeFabric, use_worker } from 'selvedge/three/index.js';

const renderer = new WebGLRenderer();
renderer.setSize(16, 16);

/**
 * way: 'worker', 'missing worker' (one that cannot be loaded) or 'no worker'. { read_in, digest, ms, longest }: where the
 * fabric was read, the digest of its words in rows of 2048, the ms until it showed, and the longest time between two frames
 * before all of it was read.
 */
export async function first_frame(file, way) {
  if (way === 'no worker') delete globalThis.Worker;
  if (way === 'missing worker') use_worker(() => new Worker('/nowhere.js'));
  const loader = new GLTFLoader(), begin = performance.now();
  loader.register((parser) => new SelvedgeFabric(parser));
  const { scene } = await loader.loadAsync(file), camera = new PerspectiveCamera();
  camera.position.z = 3;
  const { material } = scene.getObjectByProperty('isMesh', true), { fabric } = material;
  let done = false, ms = 0, longest = 0, last = performance.now();
  fabric.settled.then(() => {
    done = true;
  });
  while (!done || (fabric.texture && ms === 0)) {
    await new Promise(requestAnimationFrame);
    longest = Math.max(longest, performance.now() - last);
    renderer.render(new Scene().add(scene), camera);
    if (material.shows === 'fabric' && ms === 0) ms = performance.now() - begin;
    last = performance.now();
  }
  const { data } = fabric.texture?.image ?? { data: new Uint32Array() };
  return { read_in: fabric.read_in, digest: xxh3_128(new Uint8Array(data.buffer)), ms, longest };
}

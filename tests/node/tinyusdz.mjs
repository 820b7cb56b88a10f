// tinyusdz under Node.js: it is built for a browser, asks for a window, and refuses where it finds Node.js.
import { readFileSync } from 'node:fs';

const folder = new URL('node_modules/tinyusdz/', import.meta.url);

async function load() {
  process.type = 'renderer'; // as Electron says that it is a browser
  globalThis.window = {};
  const { default: start } = await import(new URL('tinyusdz.js', folder));
  return start({
    instantiateWasm: (imports, done) => {
      WebAssembly.instantiate(readFileSync(new URL('tinyusdz.wasm', folder)), imports).then(
        ({ instance, module }) => done(instance, module));
    },
  });
}

const native = await load();

/** A scene as tinyusdz reads it, or what it has against the text. */
export function read_usda(text) {
  const loader = new native.TinyUSDZLoaderNative();
  loader.setLoadTextureInNative(false);
  if (!loader.loadFromBinary(new TextEncoder().encode(text), 'test.usda')) return { error: loader.error() };
  const nodes = [];
  const visit = (node) => {
    nodes.push(node);
    for (const child of node.children ?? []) visit(child);
  };
  visit(loader.getDefaultRootNode());
  const meshes = Array.from({ length: loader.numMeshes() }, (_, index) => loader.getMesh(index));
  const materials = meshes.map((mesh) => loader.getMaterial(mesh.materialId));
  const image_of = (texture) => loader.getImage(loader.getTexture(texture).textureImageId).uri;
  return { nodes, meshes, materials, image_of };
}

/** The layer written again by tinyusdz, attributes that no schema knows included. */
export function rewrite_usda(text) {
  const loader = new native.TinyUSDZLoaderNative();
  if (!loader.loadAsLayerFromBinary(new TextEncoder().encode(text), 'test.usda')) return loader.error();
  return loader.layerToString();
}

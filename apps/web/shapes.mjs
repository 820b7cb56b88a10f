// Writes how the yarns of the built-in stitches, and of charts and drafts, come to rest: each shape of FabricMaker after its length.
//
//   node shapes.mjs SELVEDGE.wasm OUTPUT FILE...
import {readFileSync, writeFileSync} from 'node:fs';
import {basename} from 'node:path';
import {FabricMaker} from '../npm/make.mjs';

const [module, output, ...files] = process.argv.slice(2);
const recipes = files.map((file) => ({stitch: basename(file), text: readFileSync(file, 'utf8')})), parts = [], END = 'at rest';
const maker = new FabricMaker(new WebAssembly.Module(readFileSync(module)), {
  deflate: (bytes) => bytes,
  // The shape of lace is as large as Draco's decoder, and comes to rest in a second.
  describe: ({stitch}) => stitch.includes('.') || stitch === 'lace' || recipes.push({stitch}),
  shape: (bytes) => {
    parts.push(Uint32Array.of(bytes.length), bytes);
    throw new Error(END);
  }
});
maker.stitches();
for (const recipe of recipes) {
  try {
    maker.make(recipe);
  } catch ({message}) {
    if (message !== END) throw new Error(message);
  }
}
writeFileSync(output, Buffer.concat(parts.map(({buffer, byteOffset, byteLength}) => new Uint8Array(buffer, byteOffset, byteLength))));

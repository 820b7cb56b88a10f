// Makes the package: its modules, and the WebAssembly module.
//
//   node make.mjs FOLDER CELLS.wasm      FOLDER is made
import {cpSync, mkdirSync, readFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';

const here = dirname(fileURLToPath(import.meta.url)), root = join(here, '../..');
const [folder, wasm] = process.argv.slice(2);
if (!wasm) {
  console.error('node make.mjs FOLDER CELLS.wasm');
  process.exit(2);
}
mkdirSync(folder, {recursive: true});
const {files} = JSON.parse(readFileSync(join(here, 'package.json'), 'utf8'));
for (const name of ['package.json', ...files.filter((file) => !['LICENSE', 'cells.wasm'].includes(file))])
  cpSync(join(here, name), join(folder, name), {recursive: true});
cpSync(join(root, 'LICENSE'), join(folder, 'LICENSE'));
cpSync(wasm, join(folder, 'cells.wasm'));

// Bundles the page of ../vite: the package looks for worker.js and cells.wasm beside the script.
//
//   npm install esbuild three selvedge && node build.mjs OUTPUT_FOLDER
import {copyFileSync} from 'node:fs';
import {build} from 'esbuild';

const outdir = process.argv[2], page = new URL('../vite/', import.meta.url).pathname;
await build({
  entryPoints: {main: `${page}main.js`, worker: 'selvedge/worker.js', cells: 'selvedge/cells.wasm'},
  loader: {'.wasm': 'copy'}, bundle: true, splitting: true, minify: true, format: 'esm', target: 'es2022', outdir
});
copyFileSync(`${page}index.html`, `${outdir}/index.html`);

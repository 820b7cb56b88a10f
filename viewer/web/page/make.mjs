// Makes the page that `selvedge-view page` fills with garments: one file with the package and three.js in it.
//
//   node make.mjs PACKAGE_FOLDER MODULES_FOLDER PAGE.html [MARK=FILE...]
//
// MODULES_FOLDER: a node_modules with three and esbuild. MARK=FILE: a text, script or module for a mark of page.html, such
// as a page's own script, which imports modules of the package as 'selvedge/...'; a picture or bytes as base64; of FILE,FILE the texts
// by their names, as JSON.
import {createHash} from 'node:crypto';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {basename, dirname, join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';
import {deflateSync} from 'node:zlib';

const [package_folder, modules, page] = process.argv.slice(2, 5).map((path) => resolve(path));
const {build} = createRequire(join(modules, 'x.js'))('esbuild');
/** A module of the package with all that it imports, as the text of an element of a page. */
async function bundled(path, format) {
  const {outputFiles: [{text}]} = await build({
    entryPoints: [resolve(package_folder, path)],
    nodePaths: [modules],
    alias: {selvedge: package_folder},
    external: ['fs', 'path'], define: {process: 'undefined'},  // of draco3d, in Node
    bundle: true, minify: true, write: false, format, target: 'es2022', legalComments: 'inline', logLevel: 'warning'
  });
  // Within a page a script ends at the first of these, even in a string.
  return text.replaceAll('</script', '<\\/script').replaceAll('<!--', '<\\!--');
}
const files = {
  PAGE: 'page/page.js', WORKER: 'worker.js', CELLS: 'cells.wasm', ...Object.fromEntries(process.argv.slice(5).map((mark) => mark.split('=')))
};
const here = dirname(fileURLToPath(import.meta.url)), texts = {STYLE: '', PANEL: ''};
for (const [mark, file] of Object.entries(files)) {
  const path = resolve(package_folder, file);
  const named = (one) => [basename(one), readFileSync(one, 'utf8')];
  if (file.includes(',')) texts[mark] = JSON.stringify(Object.fromEntries(file.split(',').map(named))).replaceAll('</', '<\\/');
  else if (file.endsWith('.js')) texts[mark] = await bundled(path, mark === 'PAGE' ? 'esm' : 'iife');
  else if (/\.(wasm|bin)$/.test(file)) texts[mark] = deflateSync(readFileSync(path), {level: 9}).toString('base64');
  else texts[mark] = readFileSync(path, file.endsWith('.webp') ? 'base64' : 'utf8');
}
mkdirSync(dirname(page), {recursive: true});
const html = [1, 2].reduce(
  (text) => text.replaceAll(/\/\*([A-Z]+)\*\//g, (mark, name) => texts[name] ?? mark), readFileSync(join(here, 'page.html'), 'utf8'));
// The page runs its own script and style alone, and loads nothing: pictures of garments are blobs.
const hash_of = (element) => {
  const [, text] = html.match(new RegExp(`<${element}>([^]*?)</${element.split(' ')[0]}>`));
  return `'sha256-${createHash('sha256').update(text).digest('base64')}'`;
};
const policy = [
  "default-src 'none'", `script-src ${hash_of('script type="module"')} 'wasm-unsafe-eval'`, 'worker-src blob:',
  `style-src ${hash_of('style')}`, 'img-src blob: data:', 'connect-src blob: data:', "base-uri 'none'", "form-action 'none'",
];
writeFileSync(page, html.replace('/*POLICY*/', policy.join('; ')));

// Makes the page that `selvedge-view page` fills with garments: one file with the package and three.js in it.
//
//   node make.mjs PACKAGE_FOLDER MODULES_FOLDER PAGE.html
//
// MODULES_FOLDER: a node_modules with three and esbuild.
import {createHash} from 'node:crypto';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {dirname, join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';
import {gzipSync} from 'node:zlib';

const [package_folder, modules, page] = process.argv.slice(2).map((path) => resolve(path));
const {build} = createRequire(join(modules, 'x.js'))('esbuild');
/** A module of the package with all that it imports, as the text of an element of a page. */
async function bundled(path, format) {
  const {outputFiles: [{text}]} = await build({
    entryPoints: [join(package_folder, path)],
    nodePaths: [modules],
    bundle: true,
    minify: true,
    write: false,
    format,
    target: 'es2022',
    legalComments: 'inline',
    logLevel: 'warning',
  });
  // Within a page a script ends at the first of these, even in a string.
  return text.replaceAll('</script', '<\\/script').replaceAll('<!--', '<\\!--');
}
const here = dirname(fileURLToPath(import.meta.url)), texts = {
  PAGE: await bundled('page/page.js', 'esm'),
  WORKER: await bundled('worker.js', 'iife'),
  CELLS: gzipSync(readFileSync(join(package_folder, 'cells.wasm')), {level: 9}).toString('base64'),
};
mkdirSync(dirname(page), {recursive: true});
const html = readFileSync(join(here, 'page.html'), 'utf8').replaceAll(/\/\*([A-Z]+)\*\//g, (mark, name) => texts[name] ?? mark);
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

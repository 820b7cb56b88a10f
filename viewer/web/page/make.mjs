// Makes the page that `selvedge-view page` fills with garments: one file with the package and three.js in it.
//
//   node make.mjs PACKAGE_FOLDER MODULES_FOLDER PAGE.html
//
// MODULES_FOLDER: a node_modules with three and esbuild.
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {createRequire} from 'node:module';
import {dirname, join, resolve} from 'node:path';
import {fileURLToPath} from 'node:url';

const [package_folder, modules, page] = process.argv.slice(2).map((path) => resolve(path));
const {build} = createRequire(join(modules, 'x.js'))('esbuild');
const {outputFiles: [{text}]} = await build({
  entryPoints: [join(package_folder, 'page/page.js')],
  nodePaths: [modules],
  bundle: true,
  minify: true,
  write: false,
  format: 'esm',
  target: 'es2022',
  legalComments: 'inline',
  logLevel: 'warning',
});
const here = dirname(fileURLToPath(import.meta.url));
// Within a page a script ends at the first of these, even in a string.
const script = text.replaceAll('</script', '<\\/script').replaceAll('<!--', '<\\!--');
mkdirSync(dirname(page), {recursive: true});
writeFileSync(page, readFileSync(join(here, 'page.html'), 'utf8').replace('/*PAGE*/', () => script));

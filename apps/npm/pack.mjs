// Adds the program to the folder of the npm package.
//
//   node pack.mjs MODULES FOLDER FILE...
import { copyFileSync, existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { basename, join } from 'node:path';
import { deflateSync } from 'node:zlib';
import { page_with } from './node.js';

const [modules, folder, ...given] = process.argv.slice(2), files = [...given, join(modules, 'draco3d/draco_decoder.wasm')], here = import.meta.dirname ?? new URL('.', import.meta.url).pathname;
const esbuild = createRequire(join(modules, 'node'))('esbuild');
rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
const options = { outdir: folder, nodePaths: [modules], bundle: true, minify: true, format: 'esm', platform: 'node', target: 'es2022', logLevel: 'error' };
// Draco's module would ask Node.js for files by require().
await esbuild.build({ ...options, entryPoints: [join(here, 'draco.js')], define: { process: 'undefined' } });
await esbuild.build({ ...options, entryPoints: [join(here, 'index.js'), join(here, 'cli.js')], splitting: true, external: ['./draco.js'] });
const none = deflateSync('').toString('base64');
for (const file of files) {
  // The size of the package leaves no room for yarns at rest: a stitch's first preview takes up to a second longer.
  if (file.endsWith('.html')) writeFileSync(join(folder, basename(file)), page_with(readFileSync(file, 'utf8').replace(/(id="shapes">)[^<]*/, `$1${none}`), () => ''));
  else copyFileSync(file, join(folder, basename(file)));
}
const debian = ['libcli11-dev', 'libdraco-dev', 'libeigen3-dev', 'libexpected-dev', 'libfmt-dev', 'libimath-dev', 'libstb-dev', 'libxxhash-dev', 'nlohmann-json3-dev', 'libc++-19-dev-wasm32', 'wasi-libc'];
const paths = [join(modules, 'pako/LICENSE'), join(modules, 'meshoptimizer/LICENSE.md'), ...debian.map((name) => `/usr/share/doc/${name}/copyright`)];
const licences = paths.filter(existsSync).map((path) => `${path}\n\n${readFileSync(path, 'utf8')}`);
writeFileSync(join(folder, 'LICENSES'), licences.join('\n\n'));

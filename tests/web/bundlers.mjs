// The examples of Vite and esbuild show a sweater in its fabric; without worker or module they say what is missing, and the remedy.
// By nodes a page has at most 30 kB that the other plugin has not.
//
//   node bundlers.mjs PACKAGE_FOLDER BIN_FOLDER OUTPUT_FOLDER
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { cpSync, existsSync, mkdirSync, readdirSync, rmSync, symlinkSync } from 'node:fs';
import { basename, join, resolve } from 'node:path';
import { sample_garment } from '../node/sample_garment.mjs';
import { MODULES, here, in_browser } from './browser.mjs';

if (!existsSync(join(MODULES, 'vite'))) process.exit(77);
const [package_folder, bin, folder] = process.argv.slice(2).map((path) => resolve(path)), examples = join(folder, 'examples'), output = join(folder, 'site');
rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
cpSync(join(here, '../../examples'), examples, { recursive: true });
// As npm installs it; the package itself is a copy, whose modules find three.js beside it.
mkdirSync(join(folder, 'node_modules'));
for (const name of ['three', 'esbuild', 'vite']) symlinkSync(join(MODULES, name), join(folder, 'node_modules', name));
cpSync(package_folder, join(folder, 'node_modules/selvedge'), { recursive: true });
const run = (program, ...words) => execFileSync(program, words, { cwd: folder, stdio: ['ignore', 'ignore', 'inherit'] });
run(`${bin}/selvedge`, 'make', 'plain-knit', '--set', 'yarn=tube', '-o', join(folder, 'knit.fabric.exr'), '--quiet');
run(`${bin}/selvedge`, 'dress', sample_garment(bin, 'sweater', folder), join(folder, 'knit.fabric.exr'), '-o', join(folder, 'sweater.glb'), '--all', '--quiet');

/** What the console says of a site, which shows the fabric in the end or the fallback. */
async function seen(site, shows) {
  return in_browser(package_folder, { site }, async ({ page, errors }) => {
    await page.goto(new URL('/site/index.html', page.url()).href);
    await page.waitForFunction((shows) => {
      const materials = [];
      globalThis.stage?.scene.traverse(({ material }) => material?.isFabricMaterial && materials.push(material));
      globalThis.stage?.draw();
      return materials.length > 0 && materials.every((material) => material.shows === shows);
    }, shows, { timeout: 60000 });
    if (shows === 'fallback') await page.waitForFunction(() => globalThis.stage, null, { timeout: 60000 });
    // A browser says by lines of its own that files did not load: what is waited for comes after them.
    const said = () => errors.filter((error) => !error.includes('Failed to load resource'));
    for (const end = performance.now() + 60000; shows === 'fallback' && said().length < 2 && performance.now() < end;) await new Promise((go) => setTimeout(go, 50));
    return said();
  });
}
const bundlers = {
  vite: () => run(process.execPath, join(MODULES, 'vite/bin/vite.js'), 'build', join(examples, 'vite'), '--outDir', output, '--emptyOutDir', '--logLevel', 'error'),
  esbuild: () => run(process.execPath, join(examples, 'esbuild/build.mjs'), output),
};
const found = (part) => join(output, readdirSync(output, { recursive: true }).find((name) => part.test(name)));
for (const [name, bundle] of Object.entries(bundlers)) {
  rmSync(output, { recursive: true, force: true });
  bundle();
  cpSync(join(folder, 'sweater.glb'), join(output, 'sweater.glb'));
  assert.deepEqual(await seen(output, 'fabric'), []);
  rmSync(found(/(^|\/)worker[^/]*\.js$/));
  const [of_worker] = await seen(output, 'fabric');
  assert.match(of_worker, /worker\.js does not load.*use_worker\(\)/);
  rmSync(found(/cells.*\.wasm$/));
  const of_module = (await seen(output, 'fallback')).find((error) => error.includes('cells'));
  assert.match(of_module, /GRAPHICS_UNAVAILABLE.*cells.*\.wasm: HTTP 404; serve cells.wasm there.*use_worker\(\)/);
  console.log(`${name}: shown; ${of_worker}; ${of_module}`);
}
// Minified, without three.js: what each plugin has of its own, and what both have.
const { build } = await import(join(MODULES, 'esbuild/lib/main.js')), entryPoints = { three: 'index', nodes: 'nodes' };
for (const name in entryPoints) entryPoints[name] = join(package_folder, `three/${entryPoints[name]}.js`);
const { outputFiles } = await build({ entryPoints, bundle: true, splitting: true, minify: true, format: 'esm', target: 'es2022', external: ['three', 'three/*'], outdir: output, write: false });
const sizes = Object.fromEntries(outputFiles.map(({ path, contents }) => [basename(path), contents.length]));
console.log(sizes);
assert.ok(sizes['nodes.js'] > 0 && sizes['nodes.js'] <= 30e3);
rmSync(folder, { recursive: true, force: true });

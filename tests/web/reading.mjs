// Fabrics at an address: what is read of them by ranges, in Node.js and in a browser's worker, beside the whole files.
//
//   node reading.mjs PACKAGE_FOLDER BIN_FOLDER KIT_FOLDER OUTPUT_FOLDER
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { gunzipSync } from 'node:zlib';
import { in_browser, serve } from './browser.mjs';
import { garment_of } from './garment.mjs';

const [package_folder, bin, kit, folder] = process.argv.slice(2);
const module_of = (name) => import(pathToFileURL(resolve(package_folder, name)));
const { load_words } = await module_of('load.js'), { AT, pack_fabric } = await module_of('pack.js');
const { bytes_to_fetch, fetch_fabric, fetch_layers, open_fabric, read_layer, xxh3_128 } = await module_of('reader/index.js');

rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
process.on('exit', () => rmSync(folder, { recursive: true, force: true }));
const path = (name) => join(folder, name);
const run = (program, ...options) => execFileSync(`${bin}/${program}`, options, { stdio: ['ignore', 'ignore', 'inherit'] });
run('selvedge', 'make', 'plain-knit', '--set', 'yarn=tube', '-o', path('standard.exr'), '--quiet');
run('selvedge', 'repack', path('standard.exr'), '-o', path('large.exr'), '--codec', 'none', '--float-tables', '--quiet');
for (const name of ['standard', 'large', 'none']) writeFileSync(path(`${name}.gltf`), garment_of([`${name}.exr`]));
const bytes_of = (name) => new Uint8Array(readFileSync(path(`${name}.exr`)));
const sum = (sent) => sent.reduce((all, { bytes }) => all + bytes, 0);
const size_of = (name) => statSync(path(`${name}.exr`)).size;

const server = await serve({ made: folder });
const { sent } = server, at = (name) => ({ url: `${server.address}/made/${name}` });
/** What the server sends for work(). */
async function answers_to(work) {
  sent.length = 0;
  await work();
  return [...sent];
}
try {
  for (const name of ['standard', 'large']) {
    const whole = open_fabric(bytes_of(name)), { words } = pack_fabric(whole);
    for (const query of ['', '?whole', '?untold']) {
      const steps = [];
      sent.length = 0;
      for await (const step of load_words(at(`${name}.exr${query}`))) steps.push({ ...step, bytes: sum(sent) });
      assert.deepEqual(steps.at(-1).words, words);
      assert.ok(sum(sent) <= 1.01 * size_of(name) + (query === '?untold' ? 2 ** 15 : 0), `${sum(sent)} bytes`);
      console.log(`${name}${query}: ${steps[0].bytes} of ${size_of(name)} bytes for the first picture, ` +
        `${sent.length} requests`);
      // A small file comes with its headers, and a server without ranges sends all at once.
      const in_two = name === 'large' && query === '';
      assert.equal(steps.length, in_two ? 2 : 1);
      assert.equal(sent.length > 1, in_two || query === '?untold');
      if (!in_two) continue;
      const first = whole.levels - steps[0].words[1 + AT.fabric_level_count];
      assert.ok(first > 0 && steps[0].bytes < size_of(name));
      assert.deepEqual(steps[0].words, pack_fabric(whole, first).words);
    }
  }
  // One layer at one level, of a fabric whose other layers are not touched.
  const fabric = await fetch_fabric(at('large.exr')), wanted = [['products', 1]], missing = bytes_to_fetch(fabric, wanted);
  const answers = await answers_to(() => fetch_layers(fabric, wanted));
  assert.deepEqual(answers.map(({ status, bytes }) => [status, bytes]), [[206, missing]]);
  assert.equal(bytes_to_fetch(fabric, wanted), 0);
  assert.deepEqual(read_layer(fabric, 'products', 1), read_layer(open_fabric(bytes_of('large')), 'products', 1));
  // Whatever is wrong with a file, it is found in pieces, too.
  const outcome = async (source) => {
    let last = null;
    try {
      for await (const { words } of load_words(source)) last = words;
    } catch (error) {
      return error.code;
    }
    return last;
  };
  let files = 0;
  for (const file of readdirSync(kit, { recursive: true }).filter((name) => /\.exr(\.gz)?$/.test(name))) {
    if (!statSync(join(kit, file)).isFile()) continue;
    const stored = readFileSync(join(kit, file)), bytes = file.endsWith('.gz') ? gunzipSync(stored) : stored;
    writeFileSync(path('kit.exr'), bytes);
    const whole = await outcome(new Uint8Array(bytes).buffer), pieces = await outcome({ ...at('kit.exr'), first: 300 });
    assert.deepEqual(pieces, whole, file);
    ++files;
  }
  console.log(`${files} files of the kit are read alike, whole and in pieces`);
  assert.ok(files > 400);
  await assert.rejects(fetch_fabric(at('none.exr')), { code: 'FILE_MISSING' });
} finally {
  server.close();
}

for (const way of ['worker', 'missing worker', 'no worker']) {
  await in_browser(package_folder, { made: folder }, async ({ page, errors }) => {
    const shown = (name) => page.evaluate(async (query) => {
      const { first_frame } = await import('/test/reading_page.js');
      return first_frame(...query);
    }, [`/made/${name}.gltf`, way]);
    for (const name of ['standard', 'large']) {
      const { words } = pack_fabric(open_fabric(bytes_of(name)));
      const rows = new Uint32Array(2048 * Math.ceil(words.length / 2048));
      rows.set(words);
      const { read_in, digest, ms, longest } = await shown(name);
      assert.equal(read_in, way === 'worker' ? 'worker' : 'main thread');
      assert.equal(digest, xxh3_128(new Uint8Array(rows.buffer)));
      console.log(`${way}, ${name}: fabric on the screen after ${ms.toFixed(0)} ms, the page held for at most ` +
        `${longest.toFixed(0)} ms`);
    }
    await shown('none');
    const others = errors.filter((error) => !error.includes('404'));
    assert.deepEqual(others, []);
    assert.ok(errors.some((error) => error.includes('selvedge: GLTF_REFERENCE: ')), `${errors}`);
  });
}

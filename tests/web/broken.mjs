// Broken files of the conformance kit in three.js: if the fabric cannot be read, the fallback is shown and the console
// names the issue's code; nothing throws. Fabrics are read in a worker, or without one on the main thread.
//
//   node broken.mjs PACKAGE_FOLDER KIT_FOLDER OUTPUT_FOLDER
import assert from 'node:assert/strict';
import { existsSync, mkdirSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { gunzipSync } from 'node:zlib';
import { in_browser } from './browser.mjs';
import { garment_of } from './garment.mjs';

const [package_folder, kit, folder] = process.argv.slice(2);

rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
process.on('exit', () => rmSync(folder, { recursive: true, force: true }));

const counts = { 'a fabric, fallback': 0, 'a fabric that is shown': 0, 'a garment, refused by three.js': 0, 'a garment': 0 };
let slowest = 0;
await in_browser(package_folder, { invalid: join(kit, 'invalid'), made: folder }, async ({ page, errors }) => {
  const fate_of = (file) => page.evaluate(async (name) => {
    const { fate } = await import('/test/scene_page.js');
    return fate(name);
  }, file);
  for (const name of readdirSync(join(kit, 'invalid')).sort()) {
    const stored = join(kit, 'invalid', name), expected = JSON.parse(readFileSync(join(stored, 'expected.json'), 'utf8'));
    const is_fabric = expected.file.endsWith('.exr'), codes = expected.issues.flatMap((issue) => issue.code);
    // Faults of glTF itself are met by three.js.
    if (!is_fabric && !codes.some((code) => /^(GLTF_EXTENSION|GARMENT_NO_UVS|FABRIC|EXR)/.test(code))) continue;
    if (is_fabric) {
      const plain = join(stored, expected.file), packed = `${plain}.gz`;
      // Some fixtures are no file at all.
      if (!existsSync(packed) && !statSync(plain, { throwIfNoEntry: false })?.isFile()) continue;
      writeFileSync(join(folder, 'f.exr'), existsSync(packed) ? gunzipSync(readFileSync(packed)) : readFileSync(plain));
      writeFileSync(join(folder, 'g.gltf'), garment_of(['f.exr']));
    }
    errors.length = 0;
    const { refused, states, ms } = await fate_of(is_fabric ? '/made/g.gltf' : `/invalid/${name}/${expected.file}`);
    slowest = Math.max(slowest, ms);
    if (!is_fabric) {
      ++counts[refused === undefined ? 'a garment' : 'a garment, refused by three.js'];
      continue;
    }
    const [[shows, code]] = states;
    ++counts[code ? 'a fabric, fallback' : 'a fabric that is shown'];
    assert.equal(shows, code ? 'fallback' : 'fabric', name);
    if (code) {
      // A fault may break more than its own rule; the reader tells the first that it meets.
      assert.ok(codes.includes(code) || expected.others !== 'none', `${name}: ${code} instead of ${codes}`);
      assert.ok(errors.length === 1 && errors[0].includes(code), `${name}: ${errors}`);
    }
    // A reader must refuse these; of the others a checker complains of what a picture does not need.
    assert.ok(code || !expected.evaluate, `${name}: is shown`);
  }
});

writeFileSync(join(folder, 'good.gltf'), garment_of(['../valid/example-fabric.exr']));
writeFileSync(join(folder, 'missing.gltf'), garment_of(['nowhere.exr']));
for (const way of ['worker', 'missing worker', 'no worker']) {
  await in_browser(package_folder, { valid: join(kit, 'valid'), made: folder }, async ({ page, errors }) => {
    const states_of = (file) => page.evaluate(async (query) => {
      const { fate } = await import('/test/scene_page.js');
      return (await fate(...query)).states;
    }, [file, way]);
    assert.deepEqual(await states_of('/made/good.gltf'), [['fabric', '', way === 'worker' ? 'worker' : 'main thread']]);
    assert.deepEqual((await states_of('/made/missing.gltf'))[0].slice(0, 2), ['fallback', 'GLTF_REFERENCE']);
    const others = errors.filter((error) => !error.includes('404') && !error.includes('GLTF_REFERENCE'));
    assert.ok(way === 'missing worker' ? others.length === 1 && /worker.js does not load.*use_worker/.test(others[0]) : others.length === 0, `${others}`);
  });
}
// Packed yarn, and a map: a reader of versions up to 4 alone shows the fallback, and says why.
for (const name of ['packed', 'map']) writeFileSync(join(folder, `${name}.gltf`), garment_of([`../valid/yarns-${name}.exr`]));
const shown = ['fabric', '', 'main thread'], refused = ['fallback', 'FABRIC_VERSION'];
for (const [name, known, state] of [['packed', 2, shown], ['packed', 1, refused], ['map', 2, shown], ['map', 1, refused]]) {
  await in_browser(package_folder, { valid: join(kit, 'valid'), made: folder }, async ({ page, errors }) => {
    const { states: [found] } = await page.evaluate(async ([file, count]) => {
      const { VERSIONS } = await import('/selvedge/reader/fabric.js');
      VERSIONS.length = count;
      return (await import('/test/scene_page.js')).fate(`/made/${file}.gltf`, 'no worker');
    }, [name, known]);
    assert.deepEqual(found.slice(0, state.length), state);
    assert.deepEqual(errors.map((error) => /FABRIC_VERSION.*version 5.[01] is not read, only 4:/.test(error)), state[1] ? [true] : []);
  });
}
// three.js that gives itself out for another version.
for (const version of [166, 186]) writeFileSync(join(folder, `${version}.js`), `export * from '/three/build/three.module.js'; export const REVISION = '${version}';`);
for (const [way, code, told, imports] of [
  ['no WebAssembly', 'GRAPHICS_UNAVAILABLE', /GRAPHICS_UNAVAILABLE/], ['dying worker', 'GRAPHICS_UNAVAILABLE', /GRAPHICS_UNAVAILABLE/],
  ['worker', '', /three.js 0.166 cannot draw fabrics, 0.160 to 0.165 and those from 0.168 on can/, { three: '/made/166.js' }],
  ['worker', '', /three.js 0.186 cannot draw fabrics by nodes, those from 0.187 on can/, { three: '/made/186.js', way: '/test/nodes_way.js?webgl' }],
]) {
  await in_browser(package_folder, { valid: join(kit, 'valid'), made: folder }, async ({ page, errors }) => {
    const { states } = await page.evaluate(async (query) => (await import('/test/scene_page.js')).fate(...query), ['/made/good.gltf', way]);
    assert.deepEqual(states[0].slice(0, 2), ['fallback', code], `${told}`);
    assert.equal(errors.filter((error) => told.test(error)).length, 1, `${errors}`);
  }, imports);
}
console.log(Object.entries(counts).map(([what, count]) => `${what}: ${count}`).join('; ') +
  `; the slowest took ${slowest.toFixed(0)} ms`);

// The page of `selvedge-view page`, opened from its file at the size of a telephone, and turned with mouse and finger.
//
//   node page.mjs PACKAGE_FOLDER BIN_FOLDER OUTPUT_FOLDER
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, rmSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { from_file } from './browser.mjs';

const [, bin, folder] = process.argv.slice(2);
const SIZE = { width: 400, height: 420 };

rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
process.on('exit', () => rmSync(folder, { recursive: true, force: true }));
const path = (name) => join(folder, name);
const run = (program, ...options) => execFileSync(`${bin}/${program}`, options, { stdio: ['ignore', 'ignore', 'inherit'] });

const small = '--texels 16 --views 16 --lights 16 --samples 4 --truth-samples 2'.split(' ');
run('selvedge', 'make', 'plain-knit', '-o', path('knit.fabric.exr'), '--quiet');
run('selvedge', 'make', 'twill', '--quality', 'paper', ...small, '-o', path('twill.fabric.exr'), '--quiet');
run('selvedge-samples', 'tablecloth', '-o', path('plain.glb'));
// A .gltf beside its fabric: the page takes both.
run('selvedge', 'dress', path('plain.glb'), path('twill.fabric.exr'), '-o', path('cloth.gltf'), '--all', '--quiet');
run('selvedge-view', 'page', path('cloth.gltf'), path('knit.fabric.exr'), '-o', path('cloth.html'), '--quiet');

await from_file(path('cloth.html'), SIZE, async ({ page, errors, touch }) => {
  const begin = performance.now();
  await page.waitForFunction('globalThis.selvedge?.state.frames > 0', null, { timeout: 120000 });
  await page.evaluate(() => globalThis.selvedge.started);
  const first = performance.now() - begin;
  const seen = () => page.evaluate(() => {
    const { state, camera, materials } = globalThis.selvedge;
    return {
      ...state, camera: camera.position.toArray(), shows: [...materials].map(({ shows }) => shows),
      fabrics: [...materials].map(({ fabric }) => fabric.name), width: document.documentElement.scrollWidth,
    };
  });
  /** What is seen after the next frame that follows `act`. */
  const after = async (act) => {
    const { frames } = await seen();
    await act();
    await page.waitForFunction((before) => globalThis.selvedge.state.frames > before, frames, { timeout: 60000 });
    return seen();
  };
  const far = (a, b) => Math.hypot(...a.map((x, i) => x - b[i]));

  const start = await seen();
  assert.ok(start.shows.length > 0 && start.shows.every((shows) => shows === 'fabric'), `${start.shows}`);
  assert.equal(start.width, SIZE.width, 'nothing is wider than the window');
  const picture = await page.screenshot();

  const turned = await after(async () => {
    await page.mouse.move(150, 100);
    await page.mouse.down();
    await page.mouse.move(230, 110, { steps: 3 });
    await page.mouse.up();
  });
  assert.ok(far(turned.camera, start.camera) > 0.01, 'the mouse turns it');
  assert.notDeepEqual(await page.screenshot(), picture);

  const touched = await after(() => touch([[200, 100], [160, 100], [120, 105]]));
  assert.ok(far(touched.camera, turned.camera) > 0.01, 'a finger turns it');

  const nearer = await after(() => page.mouse.wheel(0, -600));
  assert.notEqual(far(nearer.camera, [0, 0, 0]), far(touched.camera, [0, 0, 0]), 'the wheel brings it nearer');

  const light = await page.locator('#light').boundingBox();
  const lit = await after(async () => {
    await page.mouse.move(light.x + 20, light.y + 20);
    await page.mouse.down();
    await page.mouse.move(light.x + 36, light.y + 20, { steps: 2 });
    await page.mouse.up();
  });
  assert.ok(lit.light[0] > 0.5 && far(lit.camera, nearer.camera) === 0, 'the light follows the mouse');

  const fallback = await after(() => page.keyboard.press('f'));
  assert.ok(fallback.shows.every((shows) => shows === 'fallback'), 'F shows the fallback');
  const fabric = await after(() => page.locator('#fallback').click());
  assert.ok(fabric.shows.every((shows) => shows === 'fabric'), 'the button shows the fabric again');

  const levelled = await after(() => page.locator('#level').selectOption('2'));
  assert.equal(levelled.level, 2);
  const brighter = await after(() => page.locator('#exposure').fill('1'));
  assert.equal(brighter.exposure, 1);
  const swapped = await after(() => page.locator('#fabric').selectOption({ label: 'knit.fabric.exr' }));
  assert.ok(swapped.fabrics.every((name) => name === 'knit.fabric.exr'), `${swapped.fabrics}`);
  assert.ok(swapped.shows.every((shows) => shows === 'fabric'));
  assert.deepEqual(errors, []);
  const bytes = statSync(path('cloth.html')).size, packed = gzipSync(readFileSync(path('cloth.html'))).length;
  console.log(`${bytes} bytes, ${packed} packed; first frame after ${first.toFixed(0)} ms; a frame of ${SIZE.width} x ` +
    `${SIZE.height} takes ${brighter.ms.toFixed(0)} ms in software`);
});

// The page of `selvedge-view page`, opened from its file at the size of a telephone, and turned with mouse and finger.
//
//   node page.mjs PACKAGE_FOLDER BIN_FOLDER OUTPUT_FOLDER
//   node page.mjs PAGE.html: when a page of 960 x 540 shows what, and for how long it does not answer
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { gzipSync } from 'node:zlib';
import { sample_garment } from '../node/sample_garment.mjs';
import { from_file } from './browser.mjs';

const [timed, bin, folder] = process.argv.slice(2);
const SIZE = { width: 400, height: 420 }, SECONDS = 60;

if (!folder) {
  await from_file(timed, { width: 960, height: 540 }, async ({ page }) => {
    // Functions: the page evaluates no text.
    const when = async (test) => (await page.waitForFunction(test, null, { timeout: 120000 })).jsonValue();
    const fallback = await when(() => globalThis.selvedge?.state.frames > 0 && performance.now());
    const fabric = await when(() => {
      const { materials } = globalThis.selvedge;
      return materials.size > 0 && [...materials].every(({ shows }) => shows === 'fabric') && performance.now();
    });
    const rest = await when(() => globalThis.selvedge.state.at_rest && performance.now());
    const blocks = await page.evaluate(() => new Promise((end) => new PerformanceObserver(
      (list) => end(list.getEntries().map(({ startTime, duration }) => [startTime, duration])))
      .observe({ type: 'longtask', buffered: true })));
    console.log(`fallback after ${(fallback / 1000).toFixed(1)} s, fabric ${(fabric / 1000).toFixed(1)} s, rest ` +
      `${(rest / 1000).toFixed(1)} s; ms without an answer (and when): ${blocks.sort((a, b) => b[1] - a[1]).slice(0, 6)
        .map(([at, ms]) => `${ms.toFixed(0)} (${(at / 1000).toFixed(1)} s)`).join(', ')}`);
  });
  process.exit();
}

rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
process.on('exit', () => rmSync(folder, { recursive: true, force: true }));
const path = (name) => join(folder, name);
const run = (program, ...options) => execFileSync(`${bin}/${program}`, options, { stdio: ['ignore', 'ignore', 'inherit'] });

const small = '--texels 16 --views 16 --lights 16 --samples 4 --truth-samples 2'.split(' ');
run('selvedge', 'make', 'plain-knit', '--set', 'yarn=tube', '-o', path('knit.fabric.exr'), '--quiet');
run('selvedge', 'make', 'twill', '--set', 'yarn=tube', '--quality', 'paper', ...small, '-o', path('twill.fabric.exr'), '--quiet');
// A .gltf beside its fabric: the page takes both.
run('selvedge', 'dress', sample_garment(bin, 'sweater', folder), path('twill.fabric.exr'), '-o', path('cloth.gltf'), '--all', '--variant', 'red=#aa2222', '--quiet');
run('selvedge-view', 'page', path('cloth.gltf'), path('knit.fabric.exr'), '-o', path('cloth.html'), '--quiet');

await from_file(path('cloth.html'), SIZE, async ({ page, errors, touch }) => {
  const begin = performance.now();
  await page.waitForFunction(() => globalThis.selvedge?.state.frames > 0, null, { timeout: 120000 });
  await page.evaluate(() => globalThis.selvedge.started);
  const first = performance.now() - begin;
  const seen = () => page.evaluate(() => {
    const { state, camera, controls, materials } = globalThis.selvedge;
    return {
      ...state, camera: camera.position.toArray(), target: controls.target.toArray(),
      full: document.fullscreenElement !== null,
      shows: [...materials].map(({ shows }) => shows),
      fabrics: [...materials].map(({ fabric }) => fabric.name), tints: [...materials].map(({ parts: { tint } }) => tint),
      metres: [...materials].flatMap(({ lay: { scale }, fabric: { mm_per_repeat: mm } }) => scale.map((repeats, k) => repeats * mm[k] / 1000)),
      read_in: [...materials].map(({ fabric }) => fabric.read_in), width: document.documentElement.scrollWidth,
    };
  });
  /** What is seen once `holds` is true of it, after `act`. */
  const after = async (act, holds) => {
    await act();
    for (const end = performance.now() + 1000 * SECONDS;;) {
      const now = await seen();
      if (holds(now)) return now;
      assert.ok(performance.now() < end, `${holds} does not hold: ${JSON.stringify(now)}`);
    }
  };
  const far = (a, b) => Math.hypot(...a.map((x, i) => x - b[i]));

  const start = await after(() => {}, ({ shows, at_rest }) => at_rest && shows.length > 0 && shows.every((shown) => shown === 'fabric'));
  assert.deepEqual([...new Set(start.read_in)], ['worker']);
  assert.equal(start.width, SIZE.width, 'nothing is wider than the window');
  const picture = await page.screenshot();

  const turned = await after(async () => {
    await page.mouse.move(150, 100);
    await page.mouse.down();
    await page.mouse.move(230, 110, { steps: 3 });
    await page.mouse.up();
  }, ({ camera }) => far(camera, start.camera) > 0.01);
  assert.notDeepEqual(await page.screenshot(), picture);
  const touched = await after(
    () => touch([[200, 100], [160, 100], [120, 105]]), ({ camera }) => far(camera, turned.camera) > 0.01);
  const distance = ({ camera, target }) => far(camera, target);
  await after(() => page.mouse.wheel(0, -600), (now) => distance(now) < 0.99 * distance(touched));

  const light = await page.locator('#light').boundingBox();
  await after(async () => {
    await page.mouse.move(light.x + 20, light.y + 20);
    await page.mouse.down();
    await page.mouse.move(light.x + 36, light.y + 20, { steps: 2 });
    await page.mouse.up();
  }, (now) => now.light[0] > 0.5);

  // The finger takes it to the other side.
  const { light: turned_light } = await after(() => touch([[light.x + 30, light.y + 20], [light.x + 5, light.y + 20]]), (now) => now.light[0] < -0.5);

  await page.getByRole('slider', { name: 'The light' }).focus();
  await after(() => page.keyboard.press('ArrowRight'), (now) => Math.abs(now.light[0] - turned_light[0] - 0.1) < 1e-6);

  const all_show = (what) => ({ shows }) => shows.every((shown) => shown === what);
  await after(() => page.keyboard.press('f'), all_show('fallback'));
  await after(() => page.getByRole('button', { name: 'Fallback', pressed: true }).tap(), all_show('fabric'));
  await page.locator('#level').focus();
  await after(() => page.keyboard.type('2'), ({ level }) => level === 2);
  const slider = await page.locator('#exposure').boundingBox();
  const at_the_right = () => page.mouse.click(slider.x + 0.8 * slider.width, slider.y + slider.height / 2);
  const brighter = await after(at_the_right, ({ exposure }) => exposure > 1 && exposure < 3);
  await after(() => page.locator('#fabric').selectOption({ label: 'knit.fabric.exr' }), ({ fabrics, shows, frames }) =>
    fabrics.every((name) => name === 'knit.fabric.exr') && shows.every((shown) => shown === 'fabric') &&
    frames > brighter.frames);
  // The other fabric lies as large; variants, tints and swatches are of what is worn.
  (await seen()).metres.forEach((size, k) => assert.ok(Math.abs(size / start.metres[k] - 1) < 1e-6));
  const is_red = ([r, g, b]) => r > 2 * g && r > 2 * b, in_fabric = all_show('fabric');
  await after(() => page.locator('#variant').selectOption('red'), (now) => now.tints.every(is_red) && in_fabric(now));
  await after(() => page.locator('#tint').fill('#2222aa'), ({ tints }) => tints.every(([r, g, b]) => is_red([b, r, g])));
  await after(() => page.locator('#tint').fill('#ffffff'), ({ tints }) => tints.every(is_red));
  await after(() => page.locator('#variant').selectOption('as made'), ({ tints }) => tints.every((tint) => String(tint) === '1,1,1'));
  await after(() => page.getByRole('button', { name: 'Both', exact: true }).tap(), (now) => now.shows.length === start.shows.length + 1 && in_fabric(now));
  await after(() => page.locator('#fabric').selectOption('its own'), (now) => !now.fabrics.includes('knit.fabric.exr') && in_fabric(now));
  await after(() => page.locator('#full').click(), ({ full }) => full);
  await after(() => page.locator('#full').click(), ({ full }) => !full);
  assert.deepEqual(errors, []);
  const bytes = statSync(path('cloth.html')).size, packed = gzipSync(readFileSync(path('cloth.html'))).length;
  console.log(`${bytes} bytes, ${packed} packed; first frame after ${first.toFixed(0)} ms; a frame of ${SIZE.width} x ` +
    `${SIZE.height} takes ${brighter.ms.toFixed(0)} ms in software`);
});

// Fabrics without a garment are swatches.
run('selvedge-view', 'page', path('knit.fabric.exr'), path('twill.fabric.exr'), '-o', path('flat.html'), '--quiet');
await from_file(path('flat.html'), SIZE, async ({ page, errors }) => {
  await page.waitForFunction(() => globalThis.selvedge?.materials.size === 2 &&
    [...globalThis.selvedge.materials].every(({ shows }) => shows === 'fabric'), null, { timeout: 120000 });
  assert.equal(await page.locator('#clips').isVisible(), false);
  assert.deepEqual(errors, []);
});

// Clips play, unless less motion is asked for; a page without them has no place for them.
const moving = JSON.parse(readFileSync(path('cloth.gltf'), 'utf8')), keys = Buffer.from(new Float32Array([0, 2, 0, 0, 0, 0.1, 0, 0]).buffer);
const view = moving.bufferViews.push(...[[0, 8], [8, 24]].map(([byteOffset, byteLength]) => ({ buffer: moving.buffers.length, byteOffset, byteLength }))) - 2;
moving.buffers.push({ byteLength: keys.length, uri: `data:;base64,${keys.toString('base64')}` });
const input = moving.accessors.push({ bufferView: view, componentType: 5126, count: 2, type: 'SCALAR', min: [0], max: [2] },
  { bufferView: view + 1, componentType: 5126, count: 2, type: 'VEC3' }) - 2;
moving.animations = ['slide', 'again'].map((name) => ({ name, samplers: [{ input, output: input + 1 }],
  channels: [{ sampler: 0, target: { node: moving.scenes[0].nodes[0], path: 'translation' } }] }));
writeFileSync(path('moving.gltf'), JSON.stringify(moving));
run('selvedge-view', 'page', path('moving.gltf'), '-o', path('moving.html'), '--quiet');
await from_file(path('moving.html'), SIZE, async ({ page, errors }) => {
  const when = (test) => page.waitForFunction(test, null, { timeout: 120000 });
  const clips = () => page.evaluate(() => (({ time, plays, duration }) => ({ time, plays, duration }))(globalThis.selvedge.stage.clips));
  await when(() => globalThis.selvedge?.stage.clips?.time > 0.1);
  await page.keyboard.press(' ');
  const paused = await clips();
  assert.deepEqual([paused.plays, paused.duration], [false, 2]);
  await page.keyboard.press('ArrowRight');
  const step = ((await clips()).time - paused.time + 2) % 2;
  assert.ok(Math.abs(step - 1 / 30) < 1e-6, `${step}`);
  await page.locator('#clip').selectOption('again');
  assert.equal((await clips()).time, 0);
  await page.getByLabel('Seconds of the clip').fill('1.5');
  assert.deepEqual(await clips(), { time: 1.5, plays: false, duration: 2 });
  // A quarter of a second of a clock that stands.
  await when(() => !globalThis.selvedge.stage.clips.runs);
  await page.getByLabel('Speed').selectOption('2');
  await page.evaluate(() => {
    performance.now = () => 1000;
    globalThis.selvedge.stage.clips.play(true);
    performance.now = () => 1250;
  });
  await when(() => globalThis.selvedge.stage.clips.time === 0);
  await page.emulateMedia({ reducedMotion: 'reduce' });
  await page.reload();
  await when(() => globalThis.selvedge?.stage.clips);
  assert.equal((await clips()).plays, false);
  assert.deepEqual(errors, []);
});

// An environment, white above and black below, takes the place of the lights.
const pixels = Buffer.alloc(4 * 32 * 16);
pixels.fill(Buffer.from([128, 128, 128, 129]), 0, pixels.length / 2);
writeFileSync(path('sky.hdr'), Buffer.concat([Buffer.from('#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16 +X 32\n'), pixels]));
run('selvedge-view', 'page', path('cloth.gltf'), '-o', path('around.html'), '--environment', path('sky.hdr'), '--quiet');
await from_file(path('around.html'), SIZE, async ({ page, errors }) => {
  await page.waitForFunction(
    () => [...globalThis.selvedge?.materials ?? []].some(({ is_lit_around }) => is_lit_around), null, { timeout: 120000 });
  assert.deepEqual(errors, []);
});

// The page of `selvedge-view design`, opened from its file: changes, undo and redo, refusals, and the numbers of the fabric that is saved.
// Prints when a change is seen; PICTURES=FOLDER keeps pictures of the page.
//
//   node design.mjs BIN_FOLDER OUTPUT_FOLDER
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, rmSync, statSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { from_file } from './browser.mjs';

const [bin, folder] = process.argv.slice(2).map((path) => resolve(path)), pictures = process.env.PICTURES, SECONDS = 120;
rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
const path = (name) => join(folder, name);
execFileSync(`${bin}/selvedge-view`, ['design', '-o', path('design.html'), '--quiet'], { stdio: 'inherit' });
const bytes = statSync(path('design.html')).size;
assert.ok(bytes <= 5e6, `the page has ${bytes} bytes`);

await from_file(path('design.html'), { width: 1200, height: 720 }, async ({ page, errors }) => {
  const seen = () => page.evaluate(() => {
    const { state, recipe } = globalThis.selvedge.design, { materials } = globalThis.selvedge;
    const { bytes, ...rest } = state;
    return { ...rest, ...recipe(), count: bytes?.length, shows: [...materials].map(({ shows }) => shows) };
  });
  const until = async (holds) => {
    for (const end = performance.now() + 1000 * SECONDS;;) {
      const now = await seen();
      if (holds(now)) return now;
      assert.ok(performance.now() < end, `${holds} does not hold: ${JSON.stringify(now)}`);
      await new Promise((go) => setTimeout(go, 20));
    }
  };
  const picture = async (name) => pictures && await page.screenshot({ path: `${pictures}/${name}.png` });
  const all_cloth = ({ shows }) => shows.length > 0 && shows.every((shown) => shown === 'fabric');
  await page.waitForFunction(() => globalThis.selvedge?.design, null, { timeout: 60000 });
  const begin = await page.evaluate(() => globalThis.selvedge.started.then(() => performance.now()));
  await until(all_cloth);
  console.log(`${bytes} bytes; garment after ${begin.toFixed(0)} ms, cloth ${await page.evaluate(() => performance.now().toFixed(0))} ms`);
  await picture('first');

  /** Does what changes the recipe, and waits for its cloth; the cloth before stays meanwhile. */
  const changes = async (name, act) => {
    const before = await seen();
    await act();
    const after = await until((now) => {
      assert.ok(all_cloth(now), 'the last good cloth stays');
      assert.ok(now.making || now.refusal === '' || now.refusal === before.refusal, now.refusal);
      return !now.making && now.shown > before.shown;
    });
    console.log(`${name}: made ${after.made_ms.toFixed(0)} ms, seen ${after.shown_ms.toFixed(0)} ms`);
    return after;
  };
  const type = (name, text) => async () => {
    await page.locator(`#set_${name}`).fill(text);
    await page.locator(`#set_${name}`).press('Enter');
  };
  const open = (name) => page.getByText(name, { exact: true }).click();
  const choose = (stitch) => () => page.getByLabel('Stitch', { exact: true }).selectOption(stitch);

  const colour = await changes('colour', () => page.locator('#set_colour').fill('#aa3322'));
  assert.deepEqual(colour.set, { colour: '#aa3322' });
  await picture('red');
  await changes('gauge', type('wale_mm', '5'));
  await open('Fibre');
  await changes('kind', () => page.getByRole('button', { name: 'cotton', exact: true }).click());
  await changes('hairiness', type('hairiness', '3'));
  await changes('stitch', choose('purl'));
  await open('Yarn');
  await changes('radius', type('radius_mm', '0.6'));
  await changes('plies', type('plies', '2'));
  await open('Finish');
  await changes('roughness', type('roughness', '0.3'));
  await changes('reset', () => page.getByRole('button', { name: 'Reset wale' }).click());
  const ten = await changes('weave', choose('denim'));
  assert.equal(ten.stitch, 'denim');
  await picture('denim');

  const undone = await changes('undo', () => page.keyboard.press('Control+z'));
  assert.equal(undone.stitch, 'purl');
  await changes('undo', () => page.getByRole('button', { name: 'Undo' }).click());
  const redone = await changes('redo', () => page.keyboard.press('Control+y'));
  assert.deepEqual({ stitch: redone.stitch, set: redone.set }, { stitch: undone.stitch, set: undone.set });

  // The command makes what was saved.
  const saved = page.waitForEvent('download');
  await page.getByRole('button', { name: 'Save fabric' }).click();
  await (await saved).saveAs(path('saved.exr'));
  const command = await page.getByLabel('Command', { exact: true }).inputValue();
  console.log(command);
  execFileSync('bash', ['-c', `cd '${folder}' && PATH='${bin}':$PATH && ${command} --quiet && selvedge check saved.exr --quiet`], { stdio: 'inherit' });
  const run = (program, ...words) => execFileSync(join(bin, program), words, { encoding: 'utf8' });
  // Of all numbers; another deflate packs them here.
  const [ours, theirs] = ['saved', 'purl.fabric'].map((name) => run('selvedge', 'info', path(`${name}.exr`), '--json').match(/"digest": "\w+"/)[0]);
  assert.equal(ours, theirs);

  // A refusal is a line where it is typed; the cloth stays.
  await type('radius_mm', '3')();
  const refused = await until(({ making, refusal }) => !making && refusal !== '');
  assert.match(refused.refusal, /^purl: --set radius_mm: the yarns are too thick/);
  assert.match(await page.getByRole('alert').filter({ hasText: /./ }).innerText(), /^the yarns are too thick/);
  assert.ok(all_cloth(refused));
  await picture('refused');
  await changes('undo', () => page.keyboard.press('Control+z'));
  await page.emulateMedia({ colorScheme: 'dark' });
  await picture('dark');
  await page.setViewportSize({ width: 400, height: 800 });
  assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 400);
  await picture('narrow');
  // The recipe is kept by the browser.
  await page.reload();
  await page.waitForFunction(() => globalThis.selvedge?.design, null, { timeout: 60000 });
  assert.deepEqual((await seen()).set, redone.set);
  assert.deepEqual(errors, []);
});

// The page of `selvedge-view design`, opened from its file: changes, undo and redo, refusals, and the numbers of the fabric that is saved.
// Prints when a change is seen; PICTURES=FOLDER keeps pictures of the page.
//
//   node design.mjs BIN_FOLDER OUTPUT_FOLDER
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { cpSync, mkdirSync, readFileSync, rmSync, statSync, truncateSync, writeFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { data_uri, png, png_of } from '../../spec/conformance/generate/garment.mjs';
import { with_columns, with_letter, with_number, with_rows, with_stitch } from '../../apps/web/design/text_grid.mjs';
import { read_headers } from '../../viewer/web/reader/exr.js';
import { header_digest } from '../../viewer/web/reader/fabric.js';
import { from_file } from './browser.mjs';
import { json_of_glb, with_json } from './garment.mjs';

const [bin, folder] = process.argv.slice(2).map((path) => resolve(path)), pictures = process.env.PICTURES, SECONDS = 120;
rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
const path = (name) => join(folder, name);
/** The cells of a text as the program reads them. */
function cells_of(name, text) {
  writeFileSync(path(name), text);
  return JSON.parse(spawnSync(join(bin, 'selvedge'), ['stitch', '--list', path(name), '--json'], { encoding: 'utf8' }).stdout).cells;
}
// Cells of a chart, and its text after a change of one: rows from the top, whichever way they are written.
const rope = 'yarn A: albedo=#aabbcc\nyarn B:\n1: k2, p 2 c4f [A]\n2: k2tog2 yo2 k4 [A2 B6]\n', [top, bottom] = cells_of('rope.txt', rope).rows;
assert.deepEqual(bottom, { number: 1, line: 3, stitches: [['k', 1], ['k', 1], ['p', 1], ['p', 1], ['c4f', 4]], yarns: 'AAAAAAAA' });
assert.deepEqual(top.stitches.map(([name]) => name), ['k2tog', 'k2tog', 'yo', 'yo', 'k', 'k', 'k', 'k']);
for (const [change, words, line, expected] of [
  [with_stitch, [1, 1, 'yo'], 2, '1: k yo p2 c4f [A8]'],
  [with_stitch, [1, 5, 'p'], 2, '1: k2 p2 k p k2 [A8]'],
  [with_stitch, [1, 3, 'c4b'], 2, '1: k2 p c4b k [A8]'],
  [with_stitch, [1, 7, 'c2b'], 2, '1: k2 p2 k2 c2b [A8]'],
  [with_stitch, [1, 0, '2/1rc'], 2, '1: 2/1rc p c4f [A8]'],
  [with_letter, [0, 1, 'B'], 3, '2: k2tog2 yo2 k4 [A B7]'],
  [with_rows, [true], 4, '3: k2tog2 yo2 k4 [A2 B6]'],
  [with_rows, [false], 3, ''],
  [with_columns, [true], 2, '1: k2 p2 c4f k [A9]'],
  [with_columns, [false], 2, '1: k2 p2 k3 [A7]'],
]) assert.equal(change(rope, cells_of('rope.txt', rope), ...words).split('\n')[line], expected);
assert.deepEqual(cells_of('half.txt', 'half a chart\n7 k2').rows, []);
// Instructions as a chart, rows of wrong sides from the face.
const worked = cells_of('worked.txt', 'Row 1 (RS): *K1, C4F, C4F, T3B, yo, k2tog; rep from * to end.\nRow 2: P12, p2tog, yo.\n').chart;
assert.equal(worked, '2: k12 k2tog yo\n1: k2tog yo t3b c4f c4f k\n');
assert.deepEqual(cells_of('again.txt', worked).rows.map(({ stitches }) => stitches), cells_of('worked.txt', readFileSync(path('worked.txt'), 'utf8')).rows.map(({ stitches }) => stitches));

const draft = '[WIF]\nVersion=1.1\n[WEAVING]\nShafts=2\nTreadles=2\n[WARP]\nThreads=2\n[WEFT]\nThreads=2\n[THREADING]\n1=1\n2=2 ; end\n[TIEUP]\n1=1\n[TREADLING]\n1=1\n2=2\n';
for (const [text, expected, ...change] of [
  [draft, '#- --'],
  [draft, '#- -#', 'tieup', 2, 2, false],
  [draft, '## --', 'tieup', 1, 2, false],
  [draft, '-- --', 'tieup', 1, 1, false],
  [draft, '## --', 'threading', 2, 1, true],
  [draft.replace('[TIEUP]\n1=1\n[TREADLING]', '[LIFTPLAN]'), '-- -#', 'liftplan', 1, 1, false],
  [draft.replace('Shafts', 'Rising Shed=no\nShafts'), '-# ##'],
]) {
  const edited = change.length > 0 ? with_number(text, cells_of('draft.wif', text), ...change) : text;
  assert.equal(cells_of('draft.wif', edited).drawdown, expected.replace(' ', ''));
}
assert.equal(cells_of('none.wif', 'no draft'), undefined);

execFileSync(`${bin}/selvedge-view`, ['design', '-o', path('design.html'), '--quiet'], { stdio: 'inherit' });
const bytes = statSync(path('design.html')).size;
assert.ok(bytes <= 5e6, `the page has ${bytes} bytes`);

const saver = (page) => async (button, name) => {
  const download = page.waitForEvent('download', { timeout: 1000 * SECONDS });
  await page.getByRole('button', { name: button, exact: true }).click();
  await (await download).saveAs(path(name));
};
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
    console.log(`${name}: preview ${after.preview_ms?.toFixed(0)} ms, made ${after.made_ms.toFixed(0)} ms, seen ${after.shown_ms.toFixed(0)} ms`);
    return after;
  };
  const type = (name, text) => async () => {
    await page.locator(`#set_${name}`).fill(text);
    await page.locator(`#set_${name}`).press('Enter');
  };
  const open = (name) => page.getByText(name, { exact: true }).click();
  const choose = (stitch) => () => page.getByRole('radio', { name: stitch, exact: true }).locator('..').click();

  // A beginner has few controls; the others come by a switch, and names find stitches.
  const controls = () => page.evaluate(() => [...document.querySelectorAll('button, select, textarea, summary, input:not([type=radio])')].filter((control) => control.checkVisibility()).length);
  const few = await controls();
  assert.ok(few <= 10, `${few} controls`);
  await page.getByLabel('All controls').check();
  console.log(`${few} controls of ${await controls()}`);
  await page.getByLabel('Search stitches').fill('denim');
  assert.equal(await page.locator('#stitches label:visible').count(), 1);
  await page.getByLabel('Search stitches').fill('');

  const colour = await changes('colour', () => page.locator('#set_colour').fill('#aa3322'));
  assert.deepEqual(colour.set, { colour: '#aa3322' });
  await picture('red');
  // The page brings how the yarns of built-in stitches rest.
  const { relaxed, set: kept } = await changes('stitch', choose('purl'));
  // Another stitch keeps its own colours: a fair isle of one would be plain.
  assert.deepEqual(kept, {});
  assert.equal(relaxed, colour.relaxed);
  await changes('gauge', type('wale_mm', '4.6'));
  assert.ok((await seen()).relaxed > relaxed);
  await changes('kind', () => page.locator('#set_yarn').selectOption('cotton'));
  await changes('hairiness', type('hairiness', '3'));
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

  const save_as = saver(page);
  const open_file = (file) => page.locator('#file').setInputFiles(file);
  // Twenty changes, undone and done again, are the same recipe; the file's is, too, and makes the same bytes.
  const before = await seen();
  for (let k = 1; k <= 20; ++k) await type('melange', String(k / 100))();
  assert.equal((await seen()).set.melange, 0.2);
  for (let k = 0; k < 20; ++k) await page.keyboard.press('Control+z');
  assert.deepEqual((await seen()).set, before.set);
  await changes('20 changes', async () => {
    for (let k = 0; k < 20; ++k) await page.keyboard.press('Control+y');
  });
  await save_as('Save fabric', 'twenty.exr');
  await changes('undo', () => page.keyboard.press('Control+z'));
  // A stranger's recipe has no other options than make's.
  const file = readFileSync(path('twenty.exr')), at = file.indexOf('{"accuracy"'), size = file.readUInt32LE(at - 4), { sheet, ...header } = JSON.parse(file.subarray(at, at + size));
  Object.assign(header.recipe, { 'keep-samples': 'samples.exr' });
  file.write(JSON.stringify(header).padEnd(size), at);
  file.write(header_digest(read_headers(file)), file.indexOf('selvedge.digest') + 'selvedge.digest.string.....'.length);
  writeFileSync(path('strange.exr'), file);
  assert.doesNotMatch(execFileSync(join(bin, 'selvedge'), ['info', path('strange.exr')], { encoding: 'utf8' }), /--keep-samples/);
  const opened = await changes('open', () => open_file(path('strange.exr')));
  assert.equal(opened['keep-samples'], undefined);
  assert.deepEqual(opened.set, { ...before.set, melange: 0.2 });
  await save_as('Save fabric', 'again.exr');
  assert.ok(readFileSync(path('twenty.exr')).equals(readFileSync(path('again.exr'))));
  await changes('undo', async () => {
    for (let k = 0; k < 20; ++k) await page.keyboard.press('Control+z');
  });

  // The command makes what was saved.
  await save_as('Save fabric', 'saved.exr');
  const command = await page.getByLabel('Command', { exact: true }).inputValue();
  console.log(command);
  execFileSync('bash', ['-c', `cd '${folder}' && PATH='${bin}':$PATH && ${command} --quiet && selvedge check saved.exr --quiet`], { stdio: 'inherit' });
  const run = (program, ...words) => execFileSync(join(bin, program), words, { encoding: 'utf8' });
  // Of all numbers; another deflate packs them here.
  const [ours, theirs] = ['saved', 'purl.fabric'].map((name) => run('selvedge', 'info', path(`${name}.exr`), '--json').match(/"digest": "\w+"/)[0]);
  assert.equal(ours, theirs);

  // The garment is saved in the cloth; others are worn where they can be, and what cannot be read is a line.
  await save_as('Save garment', 'saved.glb');
  for (const [name, write, line] of [
    ['cut.exr', (file) => writeFileSync(file, readFileSync(path('saved.exr')).subarray(0, 20000)), /^cut.exr: .*[a-z]$/],
    ['bare.exr', (file) => cpSync(fileURLToPath(new URL('../data/kept/4.0/yarn.fabric.exr', import.meta.url)), file), /^bare.exr: has no recipe by which it can be edited$/],
    ['cut.glb', (file) => writeFileSync(file, 'glTF'), /^cut.glb: .*[a-z]$/],
    ['large.glb', (file) => { writeFileSync(file, ''); truncateSync(file, 3e8); }, /^large.glb: has 300 MB, this page takes 128 MB: selvedge dress /],
    ['cloth.png', (file) => cpSync(fileURLToPath(new URL('../../samples/pictures/sweater.png', import.meta.url)), file), /^cloth.png: .* colours/],
    ['cloth.tga', (file) => writeFileSync(file, ''), /^cloth.tga: is no fabric /],
  ]) {
    write(path(name));
    await open_file(path(name));
    await page.getByRole('alert').filter({ hasText: line }).waitFor();
    assert.ok(all_cloth(await seen()));
  }
  // The command dresses all that is worn; the body has a print.
  const sweater = readFileSync(fileURLToPath(new URL('../../samples/sweater.glb', import.meta.url))), printed = json_of_glb(sweater);
  const push = (list, value) => (printed[list] ??= []).push(value) - 1;
  const source = push('images', { uri: data_uri('image/png', png()) });
  printed.materials[0].pbrMetallicRoughness = { baseColorFactor: [0.5, 0.2, 0.01, 1], baseColorTexture: { index: push('textures', { source }) } };
  writeFileSync(path('printed.glb'), with_json(sweater, printed));
  const part = (name) => page.getByLabel(name, { exact: true }), dressed = () => page.getByRole('alert').filter({ hasText: /dressing/ }).waitFor({ state: 'detached' });
  const command_has = (words) => page.waitForFunction((wanted) => document.getElementById('command').value.includes(wanted), words, { timeout: 1000 * SECONDS });
  // By Draco, too.
  await open_file(fileURLToPath(new URL('../data/encodings/scarf_draco_sequential.glb', import.meta.url)));
  await command_has('dress scarf_draco_sequential.glb');
  await until(all_cloth);
  await open_file(path('printed.glb'));
  await command_has('dress printed.glb');
  await until(all_cloth);
  await part('trim').click();
  await command_has("--except '#1'");
  await page.getByRole('button', { name: 'Both', exact: true }).click();
  await until(({ shows }) => shows.length === 2 && all_cloth({ shows }));
  await picture('both');
  await save_as('Save garment', 'plain.glb');
  const [, by_page] = (await page.getByLabel('Command', { exact: true }).inputValue()).match(/^(selvedge dress .*)$/m);
  cpSync(path('saved.exr'), path('purl.fabric.exr'));
  execFileSync('bash', ['-c', `cd '${folder}' && PATH='${bin}':$PATH && ${by_page} --quiet`], { stdio: 'inherit' });
  assert.ok(readFileSync(path('plain.glb')).equals(readFileSync(path('printed.purl.glb'))), by_page);
  execFileSync(join(bin, 'selvedge'), ['check', '--quiet', path('saved.glb'), path('plain.glb')], { stdio: 'inherit' });
  execFileSync(join(bin, 'selvedge'), ['dress', path('printed.glb'), path('saved.exr'), '--all', '--variant', 'red=#aa2222', '-o', path('by_dress.glb'), '--quiet']);
  // Names of strangers are judged once, and the reason is told.
  const names = ('wood|Lamp|armchair_fabric|Buttons|metalZip_02|shoe sole|Std_Eyelash|leftEyes|HAIR|skin.001|wooden_leg|Wolf3D_Skin|Wolf3D_Teeth|avaturn_look_0|male_body|Mannequin|' +
    'N00_000_00_Body_00_SKIN (Instance)|Jacket_Zipper|sofa_legs|lampBulb|TVScreen|wall paint|plantLeaves|Chrome|Zähne|botón|皮肤|Soldier_VisorMat|扣子|lunettes|studio_backdrop|console|' +
    'Skinny jeans|unzipped|chair cover|Body|Bodysuit|face_mask|headband|leafprint_dress|floor_length_gown|Armour|Eyelet_lace_top|button_down_shirt|metal_jacket|fabric_gold|Silver silk|' +
    'pants_leg|Female_Dress_Body|Wolf3D_Outfit_Top|N00_002_01_Tops_01_CLOTH|jacket_text|shower curtain|Material.001|上衣服|chemise|Vorhang|GlamVelvetSofa_fabric_navy|fox_material|lambert1').split('|');
  assert.equal(names.length, 60);
  const scarf = readFileSync(fileURLToPath(new URL('../data/encodings/scarf_plain.glb', import.meta.url))), room = json_of_glb(scarf);
  room.meshes = names.map((_, material) => ({ primitives: [{ ...room.meshes[0].primitives[0], material }] }));
  Object.assign(room, { materials: names.map((name) => ({ name })), nodes: names.map((_, mesh) => ({ mesh, scale: [0.1, 0.1, 0.1], translation: [0.03 * (mesh % 10), 0.03 * Math.floor(mesh / 10), 0] })), scenes: [{ nodes: [...names.keys()] }] });
  writeFileSync(path('room.glb'), with_json(scarf, room));
  await open_file(path('room.glb'));
  await part('armchair_fabric').waitFor();
  await dressed();
  const report = JSON.parse(run('selvedge', 'dress', path('room.glb'), path('saved.exr'), '--all', '--json', '-o', path('by_names.glb')));
  const left = new Map(report.warnings.flatMap((line) => [line.match(/^material #(\d+) .* was left alone: (.*); --material/)]).filter(Boolean).map(([, index, why]) => [Number(index), why]));
  const worn_by_names = names.map((name, index) => [name, !left.has(index), left.get(index)]);
  assert.deepEqual(report.materials.map(({ index }) => index), [...names.keys()].filter((index) => !left.has(index)));
  assert.deepEqual(worn_by_names.slice(0, 3), [['wood', false, 'a "wood" is no cloth'], ['Lamp', false, 'a "lamp" is no cloth'], ['armchair_fabric', true, undefined]]);
  assert.deepEqual(await page.locator('#parts > p').evaluateAll((rows) => rows.map((row) => {
    const { checked } = row.querySelector('input');
    return [row.querySelector('label').textContent, checked, checked ? undefined : row.querySelector('small').textContent];
  })), worn_by_names);
  await until(all_cloth);
  await picture('room');
  // Undo brings the garment before, on its own floor; a check box loads no fabric anew.
  const standing = () => page.evaluate(() => globalThis.selvedge.stage.garments.map(({ dataset }) => [dataset.garment, dataset.floor]));
  const in_room = await standing();
  await page.keyboard.press('Control+z');
  await dressed();
  await part('trim').waitFor();
  assert.equal(await part('trim').isChecked(), false);
  assert.notDeepEqual(await standing(), in_room);
  await until(all_cloth);
  const numbers = () => page.evaluate(() => [...new Set([...globalThis.selvedge.materials].map(({ fabric }) => fabric.number))]);
  const before_box = await numbers();
  await part('trim').click();
  await command_has("--material '#1'");
  await until(all_cloth);
  assert.deepEqual(await numbers(), before_box);
  await page.getByRole('button', { name: 'Garment', exact: true }).click();

  // A chart is cells and text; a fault is told in its row, and of a draft, and nothing is lost.
  const text = page.getByLabel('Text', { exact: true }), cell = (name) => page.getByRole('gridcell', { name });
  const seed = await changes('cell of a chart', async () => {
    await choose('seed')();
    await cell('Row 2, column 1: p').press('k');
  });
  assert.match(await text.inputValue(), /^2: k2$/m);
  await text.fill(seed.text.replace('name: seed', 'name: my seed').replace('2: k2', '2: k q'));
  const faulty = await until(({ making, refusal }) => !making && refusal !== '');
  assert.match(faulty.refusal, /^seed.txt: line 8: there is no stitch "q"/);
  await page.locator('.cell.wrong', { hasText: '2: k q' }).waitFor();
  await page.locator('#name', { hasText: 'my seed' }).waitFor();
  assert.ok(all_cloth(faulty));
  await changes('instructions', () => text.fill('Row 1 (RS): *K1, p1; rep from * to end.\nRow 2: P the knits and k the purls.\n'));
  assert.equal(await cell(/^Row 2, column/).count(), 2);
  // A picture is a chart by its colours.
  writeFileSync(path('motif.png'), png_of([[255, 0, 0, 255, 255, 255], [255, 255, 255, 255, 255, 255]], 3));
  const motif = await changes('picture', () => open_file(path('motif.png')));
  assert.equal(motif.stitch, 'motif.txt');
  await cell('Row 2, column 1: k of B').waitFor();
  // Light comes through cloth with a second side.
  assert.equal((await changes('both sides', () => page.getByLabel('Light comes through').check())).sides, 'both');
  assert.match(await page.getByLabel('Command', { exact: true }).inputValue(), / --sides both /);
  await page.keyboard.press('Control+z');
  await choose('poplin')();
  for (const tie of [1, 2]) await cell(`Tie-up ${tie}: ${tie}`).click();
  const unwoven = await until(({ making, refusal }) => !making && refusal !== '');
  assert.match(unwoven.refusal, /^poplin.wif: every warp yarn stays on one side/);
  await text.fill(unwoven.text.replaceAll('Threads=2', 'Threads=5000'));
  await until(({ making, refusal }) => !making && /^poplin.wif: \[WEFT\] Threads: 5000 x 5000 yarns are more than .* \[\w+\]$/.test(refusal));
  await page.locator('#grid', { hasText: 'edited as text' }).waitFor();
  await changes('undo', async () => {
    for (let k = 0; k < 9; ++k) await page.getByRole('button', { name: 'Undo' }).click();
  });

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
  // The browser keeps the recipe, the garment and what can be undone.
  await page.reload();
  await page.waitForFunction(() => globalThis.selvedge?.design, null, { timeout: 60000 });
  assert.deepEqual((await seen()).set, redone.set);
  await page.waitForFunction(() => globalThis.selvedge.stage.garments[0]?.dataset.garment === 'garment.glb', null, { timeout: 1000 * SECONDS });
  assert.ok(await page.getByRole('button', { name: 'Undo' }).isEnabled());
  assert.deepEqual(errors, []);
});

// From the double click to a saved sweater with a cable, in another colour, by 15 taps and keys on a telephone.
await from_file(path('design.html'), { width: 400, height: 800 }, async ({ page, errors, touch }) => {
  let acts = 0;
  const button = (name) => page.getByRole('button', { name, exact: true });
  const tap = (locator) => (++acts, locator.tap({ timeout: 1000 * SECONDS }));
  const save_as = saver(page);
  await tap(page.getByRole('radio', { name: 'rib-4x2', exact: true }).locator('..'));
  for (const name of ['One row more', 'One row more', 'c4f']) await tap(button(name));
  await tap(page.getByRole('gridcell', { name: 'Row 2, column 2: k' }));
  await tap(page.getByLabel('colour, by name or #rrggbb', { exact: true }));
  const keys = [...'brown', 'Enter'];
  for (const key of keys) await page.keyboard.press(key);
  await save_as('Save garment', 'cable.glb');
  assert.ok(acts + keys.length + 1 <= 25, `${acts} taps, and keys`);
  const recipe = () => page.evaluate(() => globalThis.selvedge.design.recipe()), made = await recipe();
  assert.match(made.text, /^3: p k4 p\n2: p c4f p\n1: p k4 p$/m);
  assert.deepEqual(made.set, { colour: '#a52a2a' });
  // A tint is saved, too.
  await page.getByLabel('All controls').check();
  await page.locator('#tint').fill('#22aa22');
  await save_as('Save garment', 'tinted.glb');
  const [{ extensions: { SELVEDGE_materials_fabric: { tintFactor } } }] = json_of_glb(readFileSync(path('tinted.glb'))).materials;
  assert.ok(tintFactor[1] > 2 * tintFactor[0], `${tintFactor}`);
  // Variants keep their tints on the cloth.
  await page.locator('#file').setInputFiles(path('by_dress.glb'));
  await page.locator('#variant').selectOption('red');
  await save_as('Save garment', 'variants.glb');
  // Worn before the next change: changes are undone in the order in which they are taken.
  await page.waitForFunction(() => document.getElementById('command').value.includes('by_dress.glb'), null, { timeout: 1000 * SECONDS });
  execFileSync(join(bin, 'selvedge'), ['check', '--quiet', ...['cable', 'tinted', 'variants'].map((name) => path(`${name}.glb`))], { stdio: 'inherit' });
  const fabrics_of = (name) => json_of_glb(readFileSync(path(name))).materials.map(({ extensions }) => Boolean(extensions?.SELVEDGE_materials_fabric));
  assert.deepEqual(fabrics_of('variants.glb'), fabrics_of('by_dress.glb'));

  // One finger turns the garment, two come closer; one finger that is drawn sideways over cells changes them, as one change.
  const camera = () => page.evaluate(() => globalThis.selvedge.camera.position.distanceTo(globalThis.selvedge.controls.target));
  const place = () => page.evaluate(() => globalThis.selvedge.camera.position.toArray().join());
  const [far, from] = [await camera(), await place()];
  await touch([[200, 150], [150, 150], [100, 155]]);
  assert.notEqual(await place(), from);
  assert.ok(Math.abs(await camera() / far - 1) < 1e-3);
  await touch([[[180, 150], [220, 150]], [[140, 150], [260, 150]], [[100, 150], [300, 150]]]);
  assert.ok(await camera() < 0.8 * far, `${await camera()} of ${far}`);
  await tap(button('p'));
  const [first, last] = [1, 3].map((column) => page.getByRole('gridcell', { name: `Row 3, column ${column}: ` }));
  await first.scrollIntoViewIfNeeded();
  const [a, b] = [await first.boundingBox(), await last.boundingBox()], y = a.y + a.height / 2;
  await touch([[a.x + 8, y], [(a.x + b.x) / 2 + 8, y], [b.x + 8, y + 3]]);
  assert.match((await recipe()).text, /^3: p3 k2 p$/m);
  await tap(button('Undo'));
  // A browser makes a click of a tap when it has told whether a second one follows.
  await page.waitForFunction((text) => globalThis.selvedge.design.recipe().text === text, made.text, { timeout: 1000 * SECONDS });
  assert.deepEqual(errors, []);
});

// The program of the npm package, installed from its tarball into an empty folder, does what the native one does.
//
//   node program.mjs PACKAGE_FOLDER PROGRAMS_FOLDER OUTPUT_FOLDER [KIT_OR_GARMENTS...]
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, readdirSync, rmSync, statSync, symlinkSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve, win32 } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { node_host, opener, plain_word } from '../../apps/npm/node.js';
import { MeshoptDecoder } from '../node/node_modules/meshoptimizer/meshopt_decoder.mjs';
import { evaluate_texel } from '../../spec/conformance/reference/brdf.mjs';
import { in_sight, seen_from } from '../../spec/conformance/reference/sides.mjs';
import { open_fabric } from '../../viewer/web/reader/index.js';

const [package_folder, programs, folder, ...strangers] = process.argv.slice(2).map((path) => resolve(path));
if (!existsSync(join(package_folder, 'program'))) process.exit(77);
const sources = join(dirname(fileURLToPath(import.meta.url)), '../..'), native = join(programs, 'selvedge');
rmSync(folder, { recursive: true, force: true });
for (const name of ['native', 'ours', 'package']) mkdirSync(join(folder, name), { recursive: true });
const options = { cwd: join(folder, 'package'), encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] };
execFileSync('npm', ['pack', '--silent', package_folder], options);
const [tarball] = readdirSync(options.cwd);
assert.ok(statSync(join(options.cwd, tarball)).size <= 3e6);
writeFileSync(join(options.cwd, 'package.json'), '{"type": "module"}');
execFileSync('npm', ['install', '--offline', '--ignore-scripts', '--no-audit', '--no-fund', tarball], options);

/** Numbers in [0, 1), the same ones in every run. */
function random_numbers() {
  let state = 1;
  return () => (state = (state * 1103515245 + 12345) % 2 ** 31) / 2 ** 31;
}

/** The commands of the README, by npx: what they print goes unread, what they write is whole. */
const readme = readFileSync(join(options.cwd, 'node_modules/selvedge/README.md'), 'utf8');
const commands = [...readme.matchAll(/^npx (selvedge .*)$/gm)].map(([, command]) => command.split(' '));
assert.ok(commands.length >= 4);
writeFileSync(join(options.cwd, 'sweater.glb'), readFileSync(join(sources, 'samples/sweater.glb')));
// A browser, which keeps the page's name.
writeFileSync(join(options.cwd, 'xdg-open'), '#!/bin/sh\necho "$1" >> opened.txt\n', { mode: 0o755 });
const seen_by_browser = { ...options, env: { ...process.env, PATH: `${options.cwd}:${process.env.PATH}` } };
for (const words of commands) execFileSync('npx', ['--offline', ...words], seen_by_browser);
const opened = () => readFileSync(join(options.cwd, 'opened.txt'), 'utf8').split('\n').filter(Boolean);
for (let i = 0; i < 100 && opened().length < 2; ++i) await new Promise((done) => setTimeout(done, 50));
assert.deepEqual(opened(), ['dressed.html', 'design.html'].map((name) => join(options.cwd, name)));

// Equal statuses, texts and files.
const { run, make, dress, check, info, SelvedgeError } = await import(pathToFileURL(join(options.cwd, 'node_modules/selvedge/program/index.js')));
process.chdir(join(folder, 'ours'));
async function both(words) {
  const said = spawnSync(/^(page|design)$/.test(words[0]) ? `${native}-view` : native, words, { cwd: join(folder, 'native'), encoding: 'utf8' });
  let stdout = '', stderr = '';
  const status = await run(words, { ...node_host(), shared: join(options.cwd, 'node_modules/selvedge/program'), open: () => false, stdout: (text) => { stdout += text; }, stderr: (text) => { stderr += text; } });
  return [[status, stdout, stderr], [said.status, said.stdout, said.stderr.replaceAll('selvedge-view:', 'selvedge:')]];
}
const read_both = (name) => ['ours', 'native'].map((one) => readFileSync(join(folder, one, name)));
const numbers = { compared: 0, native_alone: 0 };
/** Compares what is told, the exit status, and the files that are left. */
async function compare(words) {
  const [ours, theirs] = await both(words), place = words.join(' ');
  if (/native program alone/.test(ours[1] + ours[2])) {
    assert.equal(ours[0], 1);
    assert.match(ours[1] || ours[2], words.includes('--json') ? /"error"/ : /^selvedge: .*\n$/);
    for (const name of readdirSync(join(folder, 'native'))) if (!existsSync(join(folder, 'ours', name))) rmSync(join(folder, 'native', name));
    return ++numbers.native_alone;
  }
  // The native program has `page` and `design` beside it.
  if (words[0] === '--help') ours[1] = ours[1].replace(/^  (page|design) .*\n/gm, '');
  assert.deepEqual(ours, theirs, place);
  assert.deepEqual(readdirSync('.'), readdirSync(join(folder, 'native')), place);
  const names = words.filter((word) => /\.(glb|gltf|usda|json|ply|html)$/.test(word) && !word.includes('/') && existsSync(word));
  for (const [i, [a, b]] of names.map(read_both).entries()) assert.ok(a.equals(b), `${place}: ${names[i]}`);
  ++numbers.compared;
}

/**
 * Places where two reports of `make` differ: but for times, by more than exp and pow of the C libraries make them, a thousandth or,
 * packed, 2 % of bytes.
 */
function differences(a, b, place = '') {
  if (place.endsWith('/seconds')) return [];
  if (typeof a === 'number' && typeof b === 'number') {
    const tolerance = /bytes/i.test(place) ? 0.02 : 1e-3;
    return Math.abs(a - b) <= tolerance * Math.abs(b) ? [] : [`${place}: ${a}, not ${b}`];
  }
  if (typeof a !== 'object' || !a || !b) return a === b ? [] : [`${place}: ${a}, not ${b}`];
  return Object.keys({ ...a, ...b }).flatMap((key) => differences(a[key], b[key], `${place}/${key}`));
}
/** Least PSNR of the levels of two fabrics at the same texels and random directions. */
async function least_psnr(files) {
  const seen = await Promise.all(files.map(async (bytes) => seen_from(await open_fabric(bytes), false))), decibels = [];
  const random = random_numbers(), direction = () => {
    const z = 0.1 + 0.9 * random(), angle = 2 * Math.PI * random(), radius = Math.sqrt(1 - z * z);
    return [radius * Math.cos(angle), radius * Math.sin(angle), z];
  };
  const pairs = Array.from({ length: 24 }, () => [direction(), direction()]);
  assert.equal(seen[0].levels, seen[1].levels);
  for (let k = 0; k < seen[0].levels; ++k) {
    const [{ width, height }, other] = seen.map((one) => one.level(k));
    assert.deepEqual([width, height], [other.width, other.height]);
    let error = 0, peak = 0;
    for (let texel = 0; texel < width * height; ++texel)
      for (const [from, view] of pairs) {
        const [ours, theirs] = seen.map((one) => {
          const { level, light } = in_sight(one, from);
          return evaluate_texel(level(k), [texel % width, Math.floor(texel / width)], light, view).rgb;
        });
        for (let c = 0; c < 3; ++c) error += (ours[c] - theirs[c]) ** 2;
        peak = Math.max(peak, ...theirs);
      }
    decibels.push(10 * Math.log10(peak ** 2 * width * height * pairs.length * 3 / error));
  }
  return Math.min(...decibels);
}

const chart = join(sources, 'samples/charts/moss.txt'), draft = join(sources, 'samples/drafts/poplin.wif'), bad = 'bad ä.glb';
for (const place of ['native', 'ours']) writeFileSync(join(folder, place, bad), '{"asset": 3');
const verbs = ['make', 'dress', 'check', 'info', 'stitch', 'import', 'bake', 'fit', 'plan', 'export', 'evaluate', 'compare', 'truth'];
for (const words of [['--help'], ['--version'], ['nothing'], ['make', '--bad'], ...verbs.map((verb) => [verb, '--help'])]) await compare(words);
for (const kind of ['charts', 'drafts'])
  for (const name of readdirSync(join(sources, 'samples', kind))) await compare(['stitch', join(sources, 'samples', kind, name), '-o', `${name}.json`, '--json']);
await compare(['stitch', 'twill', '-o', 'twill.ply']);
await compare(['stitch', 'nothing', '--json']);
for (const [input, name] of [['twill', 'twill'], [chart, 'moss'], [draft, 'poplin'], ['plain-knit', 'knit']]) {
  const path = `${name}.fabric.exr`, [ours, theirs] = await both(['make', input, '-o', path, '--quality', 'draft', '--json']);
  assert.equal(ours[0], theirs[0]);
  assert.deepEqual(differences(JSON.parse(ours[1]), JSON.parse(theirs[1])), [], name);
  await compare(['check', path]);
  const psnr = await least_psnr(read_both(path));
  console.log(`${name}: ${psnr.toFixed(1)} dB`);
  assert.ok(psnr >= 60, `${name}: ${psnr} dB`);
}
writeFileSync('twill.fabric.exr', readFileSync(join(folder, 'native/twill.fabric.exr')));
await compare(['make', 'twill', '-o', 'nowhere/twill.fabric.exr']);
await compare(['info', 'twill.fabric.exr', '--json']);
/** Verbs on a garment. */
async function compare_garment(path) {
  await compare(['dress', path, 'twill.fabric.exr', '-o', 'dressed.glb', '--all', '--strict', '--variant', 'Red=#aa2211']);
  await compare(['dress', path, 'twill.fabric.exr', '-o', 'beside.gltf', '--all', '--usda', 'cloth.usda', '--json']);
  if (existsSync('dressed.glb')) {
    await compare(['page', 'dressed.glb', '-o', 'page.html']);
    for (const verb of ['check', 'info']) await compare([verb, 'dressed.glb', '--json']);
  }
  for (const place of ['native', 'ours']) for (const name of ['dressed.glb', 'page.html']) rmSync(join(folder, place, name), { force: true });
  for (const verb of ['check', 'info']) await compare([verb, path, '--json']);
}
const encodings = join(sources, 'tests/data/encodings');
for (const garment of [join(sources, 'samples/sweater.glb'), ...readdirSync(encodings).map((name) => join(encodings, name)), bad, 'missing.glb']) await compare_garment(garment);
// New coordinates. Two versions of meshoptimizer pack the same otherwise; Draco's encoder the native program alone has.
const unwrap = (path) => ['dress', join(sources, path), 'twill.fabric.exr', '-o', 'unwrapped.glb', '--all', '--unwrap', 'always', '--json'];
await compare(unwrap('tests/data/encodings/scarf_plain.glb'));
const [packed, packed_natively] = await both(unwrap('samples/sweater.glb'));
assert.deepEqual(packed, packed_natively);
const [our_views, their_views] = read_both('unwrapped.glb').map((glb) => {
  const size = glb.readUInt32LE(12), { bufferViews: views } = JSON.parse(glb.subarray(20, 20 + size));
  return views.map(({ extensions: { EXT_meshopt_compression: stream } = {}, ...view }) => {
    const { byteOffset = 0, byteLength, count, byteStride, mode, filter } = stream ?? view, bytes = glb.subarray(28 + size + byteOffset).subarray(0, byteLength), values = new Uint8Array(count * byteStride || 0);
    if (stream) MeshoptDecoder.decodeGltfBuffer(values, count, byteStride, bytes, mode, filter);
    return [view, Boolean(stream), stream ? values : bytes];
  });
});
assert.ok(our_views.filter(([, is_packed]) => is_packed).length > 5);
assert.deepEqual(our_views, their_views);
const [plain] = await both(unwrap('tests/data/encodings/scarf_draco_sequential.glb'));
assert.equal(plain[0], 0);
assert.ok(JSON.parse(plain[1]).warnings.some((line) => line.endsWith('written without Draco')));
assert.equal((await run(['check', 'unwrapped.glb', '--quiet'], node_host())), 0);
for (const place of ['native', 'ours']) rmSync(join(folder, place, 'unwrapped.glb'));
assert.equal(numbers.native_alone, 0);
const [, theirs] = await both(['design', join(sources, 'samples/sweater.glb'), '-o', 'design.html']);
assert.equal(theirs[0], 0);
const [our_page, their_page] = read_both('design.html').map((page) => page.toString().replace(/(id="shapes">|data-garment=)[^<]*/g, ''));
assert.ok(our_page === their_page);
// Files of the kit, damaged and not; garments of strangers.
for (const path of strangers.flatMap((one) => readdirSync(one, { recursive: true }).map((name) => join(one, name)))) {
  if (/fabric\.exr$/.test(path)) await compare(['check', path, '--json']);
  else if (/\.gl(b|tf)$/.test(path)) await (path.includes('conformance') ? compare(['check', path, '--json']) : compare_garment(path));
}
console.log(`${numbers.compared} runs are equal, ${numbers.native_alone} are the native program's alone`);

// Bytes in, bytes and reports out.
const { bytes, report } = await make('twill', { quality: 'draft', set: { colour: '#aa3322' } });
assert.equal(report.status, 0);
const garment = readFileSync(join(sources, 'samples/sweater.glb'));
const dressed = await dress(garment, bytes, { material: ['sweater'] });
assert.deepEqual(dressed.report.materials.map(({ name }) => name), ['sweater']);
assert.equal((await check(dressed.bytes)).good, true);
assert.equal((await info(dressed.bytes)).kind, 'gltf');
await assert.rejects(make('nothing'), (error) => error instanceof SelvedgeError && error.code === 'STITCH_UNKNOWN');
await assert.rejects(make('twill', { progress: () => { throw new Error('cancelled'); } }), { message: 'cancelled' });
// A module that traps, and the next one.
await assert.rejects(make('twill', { progress: () => { throw new WebAssembly.RuntimeError('unreachable'); } }), /ended in the middle, with nothing written; the next run starts anew: unreachable/);
assert.equal((await check(bytes)).good, true);

// The same in a browser's worker, with a garment by Draco.
const { MODULES, in_browser } = await import('./browser.mjs');
async function in_worker(address) {
  const script = `import { check, dress, make } from '${address}/selvedge/program/index.js';
    const { bytes } = await make('twill', { quality: 'draft' });
    const garment = new Uint8Array(await (await fetch('${address}/encodings/scarf_draco_sequential.glb')).arrayBuffer());
    const dressed = await dress(garment, bytes, { all: true });
    postMessage([dressed.report.materials.length, (await check(dressed.bytes)).good]);`;
  const worker = new Worker(URL.createObjectURL(new Blob([script], { type: 'text/javascript' })), { type: 'module' });
  return new Promise((told, failed) => Object.assign(worker, { onmessage: ({ data }) => told(data), onerror: ({ message }) => failed(new Error(message)) }));
}
await in_browser(join(options.cwd, 'node_modules/selvedge'), { encodings }, async ({ page }) => assert.deepEqual(await page.evaluate(in_worker, new URL(page.url()).origin), [1, true]));

// Types, as an editor sees them.
writeFileSync(join(options.cwd, 'types.ts'), `
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { SelvedgeError, check, dress, info, make, run, type Host, type Report } from 'selvedge';
import { open_fabric, type Fabric } from 'selvedge/reader';
import { SelvedgeFabric } from 'selvedge/three';
const { bytes } = await make('twill', { quality: 'draft', set: { colour: '#aa3322', radius_mm: 0.5 }, progress: (stage, fraction) => console.log(stage, fraction) });
const dressed = await dress({ name: 'a.glb', bytes }, bytes, { all: true, material: ['Cloth'] });
const reports: Report[] = [await check(dressed.bytes), await info(dressed.bytes)];
const host: Host = { exists: () => undefined, read: () => bytes, write: () => {}, list: () => [] };
const status: number = await run(['check', 'a.glb'], host).catch((error: unknown) => error instanceof SelvedgeError && error.code ? 1 : 2);
const fabric: Fabric = await open_fabric(bytes);
new GLTFLoader().register((parser) => new SelvedgeFabric(parser));
// @ts-expect-error: a fabric is missing
dress(bytes);
export { fabric, reports, status };
`);
symlinkSync(join(MODULES, '@types'), join(options.cwd, 'node_modules/@types'));
execFileSync(process.execPath, [join(MODULES, 'typescript/bin/tsc'), '--strict', '--noEmit', '--module', 'nodenext', '--target', 'es2022', '--lib', 'es2023,dom', 'types.ts'], { ...options, stdio: 'inherit' });

// Names as Windows has them; no such machine is here.
for (const [word, plain] of [
  ['C:\\My cloth\\ä.glb', 'C:/My cloth/ä.glb'], ['..\\a.glb', '../a.glb'], ['\\\\server\\cloth\\a.glb', '//server/cloth/a.glb'], ['--all', '--all'],
  ['file:///C:/My%20cloth/%C3%A4.glb', 'C:/My cloth/ä.glb']
]) assert.equal(plain_word(word, true), plain);
assert.deepEqual(opener('C:\\My cloth\\ä.html', 'win32'), ['cmd', ['/c', 'start', '""', '"C:\\My cloth\\ä.html"']]);
assert.deepEqual(opener('/cloth/a.html', 'darwin'), ['open', ['/cloth/a.html']]);
const disk = new Map(['beside.gltf', 'beside.bin', 'twill.fabric.exr'].map((name) => [win32.join('C:\\My cloth\\ä', name), readFileSync(name)]));
const on_disk = (path) => win32.resolve('C:\\My cloth', path);
const windows = {
  folder: 'C:/My cloth', list: () => [], read: (path) => disk.get(on_disk(path)), write: (path, bytes) => disk.set(on_disk(path), bytes), stderr: (text) => assert.equal(text, ''),
  exists: (path) => disk.has(on_disk(path)) ? 'file' : [...disk.keys()].some((name) => name.startsWith(win32.join(on_disk(path), '\\'))) ? 'folder' : undefined
};
for (const word of ['C:\\My cloth\\ä\\beside.gltf', 'ä\\beside.gltf', 'file:///C:/My%20cloth/%C3%A4/beside.gltf']) assert.equal(await run(['check', plain_word(word, true)], windows), 0);
assert.equal(await run(['dress', 'ä/beside.gltf', 'C:/My cloth/ä/twill.fabric.exr', '-o', 'C:/My cloth/a b.glb', '--all', '--quiet'], windows), 0);
assert.ok(disk.has('C:\\My cloth\\a b.glb'));

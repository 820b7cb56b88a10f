// The program of the npm package, installed from its tarball into an empty folder, does what the native one does.
//
//   node program.mjs PACKAGE_FOLDER PROGRAMS_FOLDER OUTPUT_FOLDER
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, readdirSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { node_host, plain_word } from '../../apps/npm/node.js';
import { evaluate_texel } from '../../spec/conformance/reference/brdf.mjs';
import { in_sight, seen_from } from '../../spec/conformance/reference/sides.mjs';
import { open_fabric } from '../../viewer/web/reader/index.js';

const [package_folder, programs, folder] = process.argv.slice(2).map((path) => resolve(path));
if (!existsSync(join(package_folder, 'program'))) process.exit(77);
const sources = join(dirname(fileURLToPath(import.meta.url)), '../..'), native = join(programs, 'selvedge');
rmSync(folder, { recursive: true, force: true });
for (const name of ['native', 'package']) mkdirSync(join(folder, name), { recursive: true });
const options = { cwd: join(folder, 'package'), encoding: 'utf8', stdio: ['ignore', 'pipe', 'ignore'] };
execFileSync('npm', ['pack', '--silent', package_folder], options);
const [tarball] = readdirSync(options.cwd);
assert.ok(statSync(join(options.cwd, tarball)).size <= 3e6);
writeFileSync(join(options.cwd, 'package.json'), '{}');
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
process.chdir(options.cwd);
async function both(words) {
  const said = spawnSync(/^(page|design)$/.test(words[0]) ? `${native}-view` : native, words, { cwd: join(folder, 'native'), encoding: 'utf8' });
  let stdout = '', stderr = '';
  const status = await run(words, { ...node_host(), shared: join(options.cwd, 'node_modules/selvedge/program'), open: () => false, stdout: (text) => { stdout += text; }, stderr: (text) => { stderr += text; } });
  return [[status, stdout, stderr], [said.status, said.stdout, said.stderr.replaceAll('selvedge-view:', 'selvedge:')]];
}
const read_both = (name) => ['package', 'native'].map((one) => readFileSync(join(folder, one, name)));
async function compare(words, kept = []) {
  const [ours, theirs] = await both(words);
  // The native program has `page` and `design` beside it.
  if (words[0] === '--help') ours[1] = ours[1].replace(/^  (page|design) .*\n/gm, '');
  assert.deepEqual(ours, theirs, words.join(' '));
  for (const [a, b] of kept.map(read_both)) assert.ok(a.equals(b), words.join(' '));
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
for (const place of ['native', 'package']) writeFileSync(join(folder, place, bad), '{"asset": 3');
for (const words of [['--help'], ['--version'], ['nothing'], ['make', '--bad'], ...['make', 'dress', 'check', 'info', 'stitch'].map((verb) => [verb, '--help'])]) await compare(words);
await compare(['stitch', chart, '-o', 'moss.json', '--json'], ['moss.json']);
await compare(['stitch', 'twill', '-o', 'twill.ply'], ['twill.ply']);
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
writeFileSync(join(folder, 'package/twill.fabric.exr'), readFileSync(join(folder, 'native/twill.fabric.exr')));
await compare(['make', 'twill', '-o', 'nowhere/twill.fabric.exr']);
await compare(['info', 'twill.fabric.exr', '--json']);
for (const garment of [join(sources, 'samples/sweater.glb'), join(sources, 'tests/data/encodings/scarf_plain.glb'), ...['meshopt_high', 'draco_edgebreaker', 'draco_sequential'].map((name) => join(sources, `tests/data/encodings/scarf_${name}.glb`)), bad, 'missing.glb']) {
  const is_good = garment.includes('/'), files = is_good ? ['dressed.glb'] : [];
  await compare(['dress', garment, 'twill.fabric.exr', '-o', 'dressed.glb', '--all', '--variant', 'Red=#aa2211'], files);
  await compare(['dress', garment, 'twill.fabric.exr', '-o', 'beside.gltf', '--all', '--usda', 'cloth.usda', '--json'], is_good ? ['beside.gltf', 'cloth.usda'] : []);
  if (is_good) await compare(['page', 'dressed.glb', '-o', 'page.html'], ['page.html']);
  if (is_good) for (const verb of ['check', 'info']) await compare([verb, 'dressed.glb', '--json']);
  await compare(['check', garment]);
}

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

// Names as Windows has them; no such machine is here.
for (const [word, plain] of [['C:\\My cloth\\ä.glb', 'C:/My cloth/ä.glb'], ['..\\a.glb', '../a.glb'], ['--all', '--all']]) assert.equal(plain_word(word, true), plain);

// Shared by the tests over our own garments: programs, an output folder, a small fabric, garments dressed in it.
//
// A test is run as `node TEST.mjs BIN_FOLDER OUTPUT_FOLDER`, and its output folder is gone afterwards. Exit 0: good,
// 1: not, 77 (skipped): what is installed with npm ci is not there.
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, rmSync } from 'node:fs';
import { register } from 'node:module';
import { sample_garment } from './sample_garment.mjs';

const [bin, folder] = process.argv.slice(2);

if (!existsSync(new URL('node_modules/gltf-validator', import.meta.url))) {
  console.log('skipped: no node_modules');
  process.exit(77);
}

// The class in spec/gltf-transform has no node_modules of its own: it takes what is installed here.
const own = new URL('../../spec/gltf-transform/index.mjs', import.meta.url);
const hooks = `export const resolve = (name, context, next) =>
  name === 'selvedge-gltf-transform' ? next('${own}', context)
  : next(name, name.startsWith('@gltf-transform/') ? { ...context, parentURL: '${import.meta.url}' } : context);`;
const module_of = (code) => `data:text/javascript,${encodeURIComponent(code)}`;
register(module_of(hooks));

rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
process.on('exit', () => rmSync(folder, { recursive: true, force: true }));

export const path = (name) => `${folder}/${name}`;

/** Runs one of our programs; its report if `options` ask for --json. */
export function run(program, ...options) {
  const text = execFileSync(`${bin}/${program}`, options, { encoding: 'utf8', stdio: ['ignore', 'pipe', 'inherit'] });
  return options.includes('--json') ? JSON.parse(text) : text;
}

/** The JSON of a .gltf or .glb file. */
export function json_of(file) {
  const bytes = readFileSync(file);
  const binary = bytes.toString('latin1', 0, 4) === 'glTF';
  return JSON.parse(binary ? bytes.toString('utf8', 20, 20 + bytes.readUInt32LE(12)) : bytes.toString('utf8'));
}

/** A knit of few texels: knit.fabric.exr. */
export function make_fabric() {
  const small = '--texels 16 --views 16 --lights 16 --samples 4 --truth-samples 2'.split(' ');
  run('selvedge', 'make', 'plain-knit', '--set', 'yarn=tube', '--quality', 'paper', ...small, '-o', path('knit.fabric.exr'), '--quiet');
  return path('knit.fabric.exr');
}

/** Over that: a knit with yarn. */
export const make_yarn_fabric = () =>
  run('selvedge', 'make', 'plain-knit', '--set', 'yarn=tube', '--quality', 'draft', '-o', path('knit.fabric.exr'), '--quiet');

/** The file of a sample garment as it is made. */
export const plain = (garment) => sample_garment(bin, garment, folder);

/** A sample garment in that fabric: "<garment>.glb" or ".gltf". */
export function dress(garment, form, ...options) {
  const dressed = path(`${garment}.${form}`);
  run('selvedge', 'dress', plain(garment), path('knit.fabric.exr'), '-o', dressed, '--all', '--quiet', ...options);
  return dressed;
}

/** The contents of the fenced blocks of one language in a page of the project, such as "spec/usd.md". */
export function blocks_of(page, language) {
  const text = readFileSync(new URL(`../../${page}`, import.meta.url), 'utf8');
  return [...text.matchAll(/```(\w*)\n([\s\S]*?)```/g)].filter((match) => match[1] === language).map((match) => match[2]);
}

/** Runs a JavaScript module from its text; gives back what it exports. */
export const run_module = (code) => import(module_of(code));

/** Root mean square of the difference between two files' pictures. Files are drawn once. */
export function difference(one, other) {
  for (const file of [one, other]) {
    if (!existsSync(`${file}.png`)) run('selvedge-view', 'render', file, '-o', `${file}.png`, '--size', '160x128', '--supersample', '2', '--quiet');
  }
  return run('compare-pictures', `${one}.png`, `${other}.png`, '--json').rmse;
}

let failures = 0;

/** Notes a fact; `what` is printed if it does not hold, with `details`. */
export function expect(holds, what, details = '') {
  if (holds) return;
  failures += 1;
  console.log(`does not hold: ${what}`, details);
}

/** To be called last. */
export function finish() {
  process.exit(failures > 0 ? 1 : 0);
}

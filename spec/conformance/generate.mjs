// Makes all fixtures of the conformance kit:
//
//   node generate.mjs FOLDER      writes FOLDER/valid, vectors, invalid and warnings; the folder is made
//   node generate.mjs --coverage  lists the codes of issues.md with the number of their fixtures, or why they
//                                 have none; exit 1 if one has neither, or both
//
// Two runs give the same files; other versions of Node may compress them otherwise, and give other last digits of functions
// like Math.pow.
import {mkdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {gzipSync} from 'node:zlib';
import {broken_chunks} from './generate/broken/chunks.mjs';
import {broken_garments, unwise_garments} from './generate/broken/garments.mjs';
import {broken_gltf} from './generate/broken/gltf.mjs';
import {broken_headers} from './generate/broken/headers.mjs';
import {broken_members} from './generate/broken/members.mjs';
import {broken_parts} from './generate/broken/parts.mjs';
import {broken_products} from './generate/broken/products.mjs';
import {broken_yarns} from './generate/broken/yarns.mjs';
import {valid} from './generate/fabrics.mjs';
import {valid_garments} from './generate/garments.mjs';
import {file_of} from './generate/make.mjs';
import {vectors_of} from './generate/vectors.mjs';

const COVERAGE = '--coverage';
const [target] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));
const FOLDERS = ['valid', 'vectors', 'invalid', 'warnings'];
/** Codes that neither a fabric file nor a garment can cause by itself, and why. */
const WITHOUT_FIXTURE = [
  [/^STITCH_/, 'of stitch descriptions (stitch.md)'],
  [/^SAMPLES_/, 'of samples files (samples.md)'],
  [/^MESH_(EMPTY|INVALID)/, 'of meshes from which fabrics are made'],
  [/^(FILE|IMAGE)_UNWRITABLE/, 'reported for outputs'],
  [/^OPTION_OUT_OF_RANGE|^MATERIAL_MISSING/, 'reported for options'],
  [/_MISMATCH/, 'reported for two files that are compared'],
  [/^GARMENT_EMPTY/, 'reported by dress and render; a glTF without triangles is valid'],
  [/^VARIANT_UNREACHED/, 'of a tint that a fabric cannot reach, which readers need not judge'],
  [/^GRAPHICS_UNAVAILABLE/, 'reported for the machine'],
];
const files = new Map();

const lines = (object, list) => {
  const {[list]: items, ...rest} = object;
  const head = JSON.stringify(rest).slice(0, -1);
  return Buffer.from(`${head},"${list}":[\n${items.map((item) => JSON.stringify(item)).join(',\n')}\n]}\n`);
};

for (const fixture of valid) {
  const bytes = file_of(fixture);
  files.set(`valid/${fixture.name}.exr`, bytes);
  if (target !== COVERAGE) files.set(`vectors/${fixture.name}.json`, lines(await vectors_of(fixture, bytes), 'queries'));
}
for (const {name, files: own} of valid_garments) {
  for (const [file, bytes] of Object.entries(own)) files.set(`valid/${name}/${file}`, bytes);
}

/** One folder per rule: the file, or files, and the issues that a checker must find. `large` files are stored packed. */
function add_fixture(kind, {name, about, issues, others = 'none', evaluate, large, file: checked, ...rest}) {
  const own = rest.files ?? {'fabric.exr': file_of({name, ...rest})};
  const expected =
    {file: checked ?? Object.keys(own)[0], about, issues, others, ...(evaluate ? {evaluate} : {})};
  if (files.has(`${kind}/${name}/expected.json`)) throw new Error(`two fixtures ${name}`);
  for (const [file, bytes] of Object.entries(own))
    files.set(`${kind}/${name}/${file}${large ? '.gz' : ''}`, large ? gzipSync(bytes, {level: 9}) : bytes);
  files.set(`${kind}/${name}/expected.json`, Buffer.from(JSON.stringify(expected, null, 2) + '\n'));
}
const broken = [
  ...broken_headers, ...broken_chunks, ...broken_members, ...broken_parts, ...broken_products, ...broken_yarns, ...broken_gltf,
  ...broken_garments
];
for (const fixture of broken) add_fixture('invalid', fixture);
for (const fixture of unwise_garments) add_fixture('warnings', fixture);

function coverage() {
  const page = readFileSync(join(here, '../issues.md'), 'utf8');
  const codes = [...page.matchAll(/^\| `([A-Z_]+)` \|/gm)].map(([, code]) => code);
  const names =
    [...files.keys()].filter((file) => file.endsWith('/expected.json')).map((file) => file.split('/')[1]);
  const code_of = (name) => name.split('-')[0];
  const wrong = names.filter((name) => !codes.includes(code_of(name))).map((name) => `${name}: its code is not in issues.md`);
  for (const code of codes) {
    const count = names.filter((name) => code_of(name) === code).length;
    const reason = WITHOUT_FIXTURE.find(([pattern]) => pattern.test(code))?.[1];
    console.log(`${code.padEnd(22)} ${count > 0 ? count : reason ?? ''}`);
    if ((count === 0) === (reason === undefined))
      wrong.push(`${code} has ${count ? 'a fixture and a reason to have none' : 'neither a fixture nor a reason'}`);
  }
  for (const line of wrong) console.log(line);
  return wrong.length === 0;
}

if (target === COVERAGE) {
  process.exitCode = coverage() ? 0 : 1;
} else if (!target || target.startsWith('-')) {
  console.error('node generate.mjs FOLDER | --coverage');
  process.exitCode = 2;
} else {
  for (const folder of FOLDERS) rmSync(join(target, folder), {recursive: true, force: true});
  let size = 0;
  for (const [file, bytes] of files) {
    mkdirSync(dirname(join(target, file)), {recursive: true});
    writeFileSync(join(target, file), bytes);
    size += bytes.length;
  }
  console.log(`${files.size} files, ${size} bytes`);
}

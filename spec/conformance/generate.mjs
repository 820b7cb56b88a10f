// Makes all fixtures of the conformance kit:
//
//   node generate.mjs FOLDER      writes FOLDER/valid, vectors, invalid and warnings; the folder is made
//   node generate.mjs --coverage  lists the codes of issues.md with the number of their fixtures, or why they
//                                 have none; exit 1 if one has neither, or both
//
// Files are the same byte by byte on every machine: the generator has its own random numbers and its own
// packer. Only the numbers in vectors/ pass through Math.pow and the like, whose last digit differs between
// engines, and files that are kept packed through Node's own zlib.
import {mkdirSync, readFileSync, rmSync, writeFileSync} from 'node:fs';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';
import {gzipSync} from 'node:zlib';
import {broken_chunks} from './generate/broken/chunks.mjs';
import {broken_garments, unwise_garments} from './generate/broken/garments.mjs';
import {broken_gltf_data} from './generate/broken/gltf_data.mjs';
import {broken_gltf_files, unwise_gltf_files} from './generate/broken/gltf_files.mjs';
import {broken_gltf_members} from './generate/broken/gltf_members.mjs';
import {broken_gltf_nodes} from './generate/broken/gltf_nodes.mjs';
import {broken_headers} from './generate/broken/headers.mjs';
import {beyond_limits} from './generate/broken/limits.mjs';
import {broken_members} from './generate/broken/members.mjs';
import {broken_parts} from './generate/broken/parts.mjs';
import {broken_products, unwise_products} from './generate/broken/products.mjs';
import {broken_sides, unwise_sides} from './generate/broken/sides.mjs';
import {broken_texts} from './generate/broken/texts.mjs';
import {broken_yarns} from './generate/broken/yarns.mjs';
import {unwise_fabrics} from './generate/broken/warnings.mjs';
import {valid} from './generate/fabrics.mjs';
import {valid_garments} from './generate/garments.mjs';
import {file_of} from './generate/make.mjs';
import {vectors_of} from './generate/vectors.mjs';

const COVERAGE = '--coverage';
const [target] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));
const FOLDERS = ['valid', 'vectors', 'invalid', 'warnings'];
/** Codes that no fabric file and no garment can cause by itself. */
const OF_OUTPUT = 'said of what is written', OF_VERB = 'said of what a program is asked to do';
const OF_STITCH = 'of stitch descriptions (stitch.md)', OF_SAMPLES = 'of samples files (samples.md)';
const OF_MESH = 'of meshes that a fabric is made of';
const WITHOUT_FIXTURE = {
  FILE_UNWRITABLE: OF_OUTPUT,
  OPTION_OUT_OF_RANGE: OF_VERB,
  STITCH_UNKNOWN: OF_STITCH,
  STITCH_INVALID: OF_STITCH,
  MESH_EMPTY: OF_MESH,
  MESH_INVALID: OF_MESH,
  SAMPLES_MALFORMED: OF_SAMPLES,
  SAMPLES_NOT_FINITE: OF_SAMPLES,
  SAMPLES_SPARSE: OF_SAMPLES,
  SAMPLES_OUTLIER: OF_SAMPLES,
  FABRIC_MISMATCH: 'said of a fabric and the samples it is compared with',
  MATERIAL_MISSING: 'said of a material that is asked for',
  GARMENT_EMPTY: 'said where a garment is dressed or drawn; a glTF without triangles is valid',
  FABRIC_PRECISION: OF_OUTPUT,
  IMAGE_MISMATCH: 'said of two images that are compared',
  IMAGE_UNWRITABLE: OF_OUTPUT,
  GRAPHICS_UNAVAILABLE: 'said of the machine',
};
const files = new Map();

const lines = (object, list) => {
  const {[list]: items, ...rest} = object;
  const head = JSON.stringify(rest).slice(0, -1);
  return Buffer.from(`${head},"${list}":[\n${items.map((item) => JSON.stringify(item)).join(',\n')}\n]}\n`);
};

for (const fixture of valid) {
  const bytes = file_of(fixture);
  files.set(`valid/${fixture.name}.exr`, bytes);
  if (target !== COVERAGE) files.set(`vectors/${fixture.name}.json`, lines(vectors_of(fixture, bytes), 'queries'));
}
for (const {name, files: own} of valid_garments) {
  for (const [file, bytes] of Object.entries(own)) files.set(`valid/${name}/${file}`, bytes);
}

/**
 * One folder per rule: the file, or files, and what a checker has to say. What is `large` is kept packed.
 */
function add_fixture(kind, {name, about, issues, others = 'none', evaluate, large, file: checked, ...rest}) {
  const own = rest.files ?? {'fabric.exr': file_of({name, ...rest})};
  const expected =
    {file: checked ?? Object.keys(own)[0], about, issues, others, ...(evaluate ? {evaluate} : {})};
  if (files.has(`${kind}/${name}/expected.json`)) throw new Error(`two fixtures ${name}`);
  for (const [file, bytes] of Object.entries(own))
    files.set(`${kind}/${name}/${file}${large ? '.gz' : ''}`, large ? gzipSync(bytes, {level: 9}) : bytes);
  files.set(`${kind}/${name}/expected.json`, Buffer.from(JSON.stringify(expected, null, 2) + '\n'));
}
const broken_fabrics = [
  ...broken_headers, ...broken_chunks, ...beyond_limits, ...broken_texts, ...broken_members, ...broken_parts,
  ...broken_products, ...broken_yarns, ...broken_sides
];
const broken_gltf = [
  ...broken_gltf_files, ...broken_gltf_members, ...broken_gltf_data, ...broken_gltf_nodes, ...broken_garments
];
const unwise_gltf = [...unwise_gltf_files, ...unwise_garments];
for (const fixture of [...broken_fabrics, ...broken_gltf]) add_fixture('invalid', fixture);
for (const fixture of [...unwise_fabrics, ...unwise_products, ...unwise_sides, ...unwise_gltf]) add_fixture('warnings', fixture);

function coverage() {
  const page = readFileSync(join(here, '../issues.md'), 'utf8');
  const codes = [...page.matchAll(/^\| `([A-Z_]+)` \|/gm)].map(([, code]) => code);
  const names =
    [...files.keys()].filter((file) => file.endsWith('/expected.json')).map((file) => file.split('/')[1]);
  const wrong = [...Object.keys(WITHOUT_FIXTURE), ...names.map((name) => name.split('-')[0])]
                  .filter((code) => !codes.includes(code))
                  .map((code) => `${code} is not in issues.md`);
  for (const code of codes) {
    const count = names.filter((name) => name.split('-')[0] === code).length, reason = WITHOUT_FIXTURE[code];
    console.log(`${code.padEnd(22)} ${count > 0 ? count : reason ?? ''}`);
    if ((count === 0) === (reason === undefined))
      wrong.push(
        `${code} has ${count ? 'a fixture and a reason to have none' : 'neither a fixture nor a reason'}`);
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

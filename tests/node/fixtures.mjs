// The Khronos validator over the garments of the conformance kit: it finds an error in each that breaks a rule of
// glTF, and none in those that are valid or only unwise.
//
//   node fixtures.mjs KIT   the folder that generate.mjs wrote
import { existsSync, readdirSync } from 'node:fs';

if (!existsSync(new URL('node_modules/gltf-validator', import.meta.url))) {
  console.log('skipped: no node_modules');
  process.exit(77);
}
const { validate } = await import('./validate.mjs');
const [kit] = process.argv.slice(2);

/** Codes of what breaks a rule of glTF itself. */
const CODES = ['GLTF_MALFORMED', 'GLTF_ACCESSOR', 'JSON_MALFORMED', 'FILE_DAMAGED', 'MESH_NOT_FINITE', 'IMAGE_UNREADABLE'];
/** Those in which it finds none, and why. */
const UNSEEN = {
  'JSON_MALFORMED-member-twice': 'its JSON parser keeps the last of two members',
  'GLTF_MALFORMED-sparse-indices-of-another-type': 'to it a warning',
};

async function errors_of(file) {
  try {
    return (await validate(file)).errors;
  } catch {
    return 1; // it does not find glTF in the file
  }
}

let checked = 0;
const wrong = [];
for (const kind of ['valid', 'invalid', 'warnings']) {
  for (const name of readdirSync(`${kit}/${kind}`)) {
    const file = ['garment.gltf', 'garment.glb'].map((garment) => `${kit}/${kind}/${name}/${garment}`).find(existsSync);
    const breaks_gltf = kind === 'invalid' && CODES.includes(name.split('-')[0]);
    if (!file || (kind === 'invalid' && !breaks_gltf)) continue;
    const errors = await errors_of(file);
    checked += 1;
    if ((errors > 0) !== (breaks_gltf && !UNSEEN[name])) wrong.push(`${kind}/${name}: ${errors} errors`);
  }
}
console.log(`${checked} garments, ${wrong.length} with another verdict`);
wrong.forEach((line) => console.log(line));
process.exit(wrong.length > 0 || checked < 89 ? 1 : 0);

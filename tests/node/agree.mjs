// `selvedge check` and the verbs that read garments agree: what check lets pass, they read, and what they refuse, it
// refuses. Over the garments of the conformance kit, each also with numbers that only drawing or dressing meets.
//
//   node agree.mjs BIN KIT   the folders of the programs, and what generate.mjs wrote
import { spawnSync } from 'node:child_process';
import { copyFileSync, existsSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const [bin, kit] = process.argv.slice(2);
const work = mkdtempSync(join(tmpdir(), 'selvedge-agree-'));

/** Code of the refusal of a verb; '' without one. */
function refusal(program, ...words) {
  const run = spawnSync(join(bin, program), [...words, '--json'], { encoding: 'utf8', timeout: 60_000 });
  if (run.status === 0) return '';
  if (run.status !== 1) return `status ${run.status} ${run.signal}`;
  return JSON.parse(run.stdout).error.code;
}

function check(file) {
  const run = spawnSync(join(bin, 'selvedge'), ['check', file, '--json'], { encoding: 'utf8', timeout: 60_000 });
  return JSON.parse(run.stdout).files[0];
}

/** What a verb asks for and a garment may lack without a fault. */
const OF_VERB = ['MATERIAL_MISSING', 'GARMENT_EMPTY', 'OPTION_OUT_OF_RANGE'];

let compared = 0;
const wrong = [];

function compare(name, file, fabric) {
  const found = check(file);
  const codes = [
    ['info', refusal('selvedge', 'info', file)],
    // Drawn or refused: light has no part in it.
    ['render', refusal('selvedge-view', 'render', file, '-o', join(work, 'o.png'), '--size', '8x8', '--environment', 'none',
      '--shadows', '0')],
    ['dress', refusal('selvedge', 'dress', file, fabric, '-o', join(work, 'o.glb'), '--all', '--no-fallback')],
  ];
  for (const [verb, code] of codes) {
    compared += 1;
    if (code && found.good && !OF_VERB.includes(code)) wrong.push(`${name}: ${verb} refuses it with ${code}, check does not`);
  }
  // A fabric's own faults are met by those who read the fabric, rules of the extension by nobody.
  const broken = found.issues.filter((issue) => issue.severity === 'error').map((issue) => issue.code);
  const geometry = ['GLTF_MALFORMED', 'GLTF_ACCESSOR', 'JSON_MALFORMED', 'MESH_NOT_FINITE', 'GLTF_UNSUPPORTED'];
  if (broken.some((code) => geometry.includes(code)) && codes.every(([, code]) => !code))
    wrong.push(`${name}: check refuses it with ${broken}, nobody else does`);
}

const fabric = join(kit, 'valid', 'example-fabric.exr');
for (const kind of ['valid', 'invalid', 'warnings']) {
  for (const name of readdirSync(join(kit, kind))) {
    const file = ['garment.gltf', 'garment.glb'].map((garment) => join(kit, kind, name, garment)).find(existsSync);
    if (file) compare(`${kind}/${name}`, file, fabric);
  }
}

// Numbers that are finite alone.
const folder = join(kit, 'valid', 'garment-beside');
for (const beside of readdirSync(folder)) copyFileSync(join(folder, beside), join(work, beside));
const plain = JSON.parse(readFileSync(join(folder, 'garment.gltf'), 'utf8'));
const changes = {
  'a node of scale 0': (g) => { for (const node of g.nodes) node.scale = [0, 0, 0]; },
  'a node of scale 0 along an axis': (g) => { for (const node of g.nodes) node.scale = [1, 0, 1]; },
  'a node of scale 1e308': (g) => { for (const node of g.nodes) node.scale = [1e308, 1e308, 1e308]; },
  'nodes of scales whose product is infinite': (g) => {
    const { length } = g.nodes;
    g.nodes.push({ children: [g.scenes[0].nodes[0]], scale: [1e200, 1e200, 1e200] });
    g.nodes[g.scenes[0].nodes[0]].scale = [1e200, 1e200, 1e200];
    g.scenes[0].nodes = [length];
  },
};
for (const [texture, owner] of [['baseColorTexture', 'pbrMetallicRoughness'], ['emissiveTexture', ''], ['occlusionTexture', '']]) {
  for (const transform of [{ scale: [1e308, 1e308] }, { offset: [0, -1e39] }, { rotation: 1e300 }]) {
    changes[`${texture} ${JSON.stringify(transform)}`] = (g) => {
      const material = owner ? (g.materials[0][owner] ??= {}) : g.materials[0];
      material[texture] = { index: 0, extensions: { KHR_texture_transform: transform } };
    };
  }
}
for (const [what, change] of Object.entries(changes)) {
  const garment = structuredClone(plain);
  change(garment);
  const file = join(work, 'changed.gltf');
  writeFileSync(file, JSON.stringify(garment));
  compare(what, file, fabric);
  if (check(file).good) wrong.push(`${what}: check lets it pass`);
}
rmSync(work, { recursive: true });
for (const line of wrong) console.error(line);
console.log(`${compared} verdicts of verbs compared with check`);
process.exit(wrong.length > 0 || compared < 400 ? 1 : 0);

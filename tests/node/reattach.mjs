// gltfpack -ke drops the extension and keeps extras; `selvedge reattach` restores it, and the picture is the same.
import { execFileSync } from 'node:child_process';
import { readFileSync, writeFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { difference, dress, expect, finish, json_of, make_fabric, path, refusal, run } from './workshop.mjs';
import { validate } from './validate.mjs';

const NAME = 'SELVEDGE_materials_fabric';
const gltfpack = fileURLToPath(new URL('node_modules/gltfpack/cli.js', import.meta.url));
const pack = (input, output, ...options) => {
  execFileSync(process.execPath, [gltfpack, '-i', input, '-o', path(output), '-ke', ...options]);
  return path(output);
};

/** The bytes of fabric 0 that is embedded in a .glb file. */
function embedded_fabric(file) {
  const json = json_of(file);
  const view = json.bufferViews[json.extensions[NAME].fabrics[0].bufferView];
  const bytes = readFileSync(file);
  const start = 20 + bytes.readUInt32LE(12) + 8 + (view.byteOffset ?? 0);
  return bytes.subarray(start, start + view.byteLength);
}

const fabric = make_fabric();
// Bounds on the root mean square difference of two pictures: without quantisation vertices only change their order
// (measured: up to 1e-4); with gltfpack's 14, 12 and 8 bits for positions, texture coordinates and normals, texels at
// the edge of a pixel change places (measured: 0.003 to 0.004). A garment in the wrong repeats differs by 0.1 and more.
const bounds = { quantised: 0.008, exact: 1e-3 };  // other orders of triangles make other patches
for (const [garment, form, kind] of [
  ['sweater', 'glb', 'exact'], ['sweater', 'gltf', 'quantised'],
]) {
  const what = `${garment}.${form}, ${kind}`;
  const dressed = dress(garment, form);
  const packed = pack(dressed, `${garment}-${kind}.${form}`, ...(kind === 'exact' ? ['-noq'] : []));
  expect(!JSON.stringify(json_of(packed).extensionsUsed ?? []).includes(NAME), `${what}: gltfpack drops it`);
  const restored = path(`${garment}-${kind}-restored.${form}`);
  const given = [];
  if (form === 'glb') {
    const { status, line } = refusal('selvedge', 'reattach', packed, '-o', restored);
    expect(status === 1 && line.includes(`/materials/0/extras/${NAME}: `) && line.includes('"knit.fabric"') &&
      line.endsWith('[GLTF_REFERENCE]'), `${what}: an embedded fabric is asked for`, line);
    given.push('--fabric', fabric);
  }
  const report = run('selvedge', 'reattach', packed, '-o', restored, ...given, '--json');
  expect(report.materials.length === 2 && report.warnings.length === 0, `${what}: both materials`, report);
  run('selvedge', 'check', restored);
  const issues = await validate(restored);
  expect(issues.errors + issues.warnings === 0, `${what}: validator`, JSON.stringify(issues.messages.slice(0, 8)));
  for (const material of json_of(restored).materials) {
    const [fabric_place, base_place] = [material.extensions[NAME].fabric, material.pbrMetallicRoughness.baseColorTexture]
      .map((info) => JSON.stringify([info.texCoord ?? 0, { offset: [0, 0], rotation: 0, ...info.extensions.KHR_texture_transform }]));
    expect(fabric_place === base_place, `${what}: the fabric lies as its fallback`, fabric_place + base_place);
  }
  if (form === 'glb') expect(embedded_fabric(restored).equals(readFileSync(fabric)), `${what}: the same bytes`);
  const rms = difference(dressed, restored);
  console.log(`${what}: RMS difference ${rms.toPrecision(3)} (bound ${bounds[kind]})`);
  expect(rms <= bounds[kind], `${what}: the same picture`, rms);
}

// The measure can tell: with the transform from before gltfpack the cloth looks wrong.
const json = json_of(path('sweater-quantised-restored.gltf'));
for (const material of json.materials) {
  material.extensions[NAME].fabric.extensions = json_of(path('sweater.gltf')).materials[0].extensions[NAME].fabric.extensions;
}
writeFileSync(path('wrong.gltf'), JSON.stringify(json));
const wrong = difference(path('sweater.gltf'), path('wrong.gltf'));
expect(wrong > 0.03, 'the old transform would be seen', wrong);

// gltfpack -c makes EXT_meshopt_compression required: its streams stay as they are, and look the same.
const squeezed = path('squeezed-restored.glb');
const streams_of = (file) => json_of(file).bufferViews.flatMap(({ extensions }) => extensions?.EXT_meshopt_compression ?? [])
  .map(({ byteOffset = 0, byteLength }) => {
    const bytes = readFileSync(file), start = 28 + bytes.readUInt32LE(12) + byteOffset;
    return bytes.subarray(start, start + byteLength).toString('base64');
  });
run('selvedge', 'reattach', pack(path('sweater.glb'), 'c.glb', '-c'), '-o', squeezed, '--fabric', fabric, '--quiet');
expect(streams_of(squeezed).length > 0 && streams_of(squeezed).join() === streams_of(path('c.glb')).join(), '-c: the streams stay');
run('selvedge', 'check', squeezed);
const squeezed_rms = difference(path('sweater.glb'), squeezed);
console.log(`-c: RMS difference ${squeezed_rms.toPrecision(3)} (bound ${bounds.quantised})`);
expect(squeezed_rms <= bounds.quantised, '-c: the same picture', squeezed_rms);
finish();

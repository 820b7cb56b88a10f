// Garments in Draco and meshopt, the one of docs/dress.md by gltfpack among them, dressed: the decoders of others
// (three.js' Draco, npm meshoptimizer), run by glTF-Transform and three.js, find in the output what they find in the garment.
import { Logger, NodeIO } from '@gltf-transform/core';
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import { execFileSync } from 'node:child_process';
import { existsSync, readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { fileURLToPath } from 'node:url';
import { MeshoptDecoder } from 'meshoptimizer';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { compare } from './validate.mjs';
import { blocks_of, expect, finish, json_of, make_fabric, path, plain, run } from './workshop.mjs';

/** The decoder that three.js has in its package, a script for browsers. */
function draco_decoder() {
  const file = fileURLToPath(import.meta.resolve('three/addons/libs/draco/draco_decoder.js'));
  const module = { exports: {} };
  new Function('module', 'exports', 'require', '__dirname', readFileSync(file, 'utf8'))(
    module, module.exports, createRequire(import.meta.url), '');
  return module.exports();
}

await MeshoptDecoder.ready;
const io = new NodeIO()
  .registerExtensions(ALL_EXTENSIONS)
  .registerDependencies({ 'meshopt.decoder': MeshoptDecoder, 'draco3d.decoder': await draco_decoder() })
  .setLogger(new Logger(Logger.Verbosity.SILENT));

/** All vertices and corners of a file as plain numbers, and the mean corner in texture coordinates and space. */
async function geometry_of(file) {
  const found = [], mean = [0, 0, 0, 0, 0];
  let corners = 0;
  for (const primitive of (await io.read(file)).getRoot().listMeshes().flatMap((mesh) => mesh.listPrimitives())) {
    const attributes = Object.fromEntries(primitive.listSemantics().map((name) => [name, primitive.getAttribute(name)]));
    const indices = primitive.getIndices();
    found.push(indices.getArray().join());
    for (const name of Object.keys(attributes).sort()) found.push(name, attributes[name].getArray().join());
    for (const i of indices.getArray()) {
      [...attributes.TEXCOORD_0.getElement(i, []), ...attributes.POSITION.getElement(i, [])].forEach((x, c) => { mean[c] += x; });
    }
    corners += indices.getCount();
  }
  return { all: JSON.stringify(found), corners, mean: mean.map((x) => x / corners) };
}

/** The number of corners that three.js draws; its loader is given no decoder for Draco. */
async function corners_in_three(file) {
  const bytes = readFileSync(file);
  const { scene } = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).parseAsync(
    bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length), '');
  let corners = 0;
  scene.traverse(({ geometry }) => { corners += geometry?.index?.count ?? 0; });
  return corners;
}

const fabric = make_fabric();
const ours = fileURLToPath(new URL('../data/encodings/scarf_', import.meta.url));
const theirs = fileURLToPath(new URL('../../../shared/data/garments/encodings/enc__SheenCloth__', import.meta.url));
const encodings = ['draco_edgebreaker', 'draco_sequential', 'meshopt_high', 'meshopt_medium'];
const inputs = [ours, theirs].filter((name) => existsSync(`${name}plain.glb`))
  .flatMap((name) => encodings.map((encoding) => `${name}${encoding}.glb`));
const gltfpack = fileURLToPath(new URL('node_modules/gltfpack/cli.js', import.meta.url)), packed = path('packed.glb');
const words = { gltfpack, 'plain.glb': plain('sweater'), 'packed.glb': packed };
execFileSync(process.execPath, blocks_of('docs/dress.md', 'text')[0].split('\n')[0].split(' ').map((word) => words[word] ?? word));
for (const input of [...inputs, packed]) {
  const before = await geometry_of(input);
  for (const unwrap of [false, true]) {
    const what = `${input}${unwrap ? ', unwrapped' : ''}`, output = path('dressed.glb');
    run('selvedge', 'dress', input, fabric, '-o', output, '--all', '--no-fallback', '--quiet', '--unwrap', unwrap ? 'always' : 'never');
    expect(json_of(output).extensionsRequired.some((name) => name.endsWith('compression')), `${what}: is compressed`);
    const { fresh, messages } = await compare(input, output);
    expect(fresh.length === 0, `${what}: the validator says nothing new`, JSON.stringify(messages));
    const after = await geometry_of(output);
    if (unwrap) {
      const off = Math.hypot(...[2, 3, 4].map((c) => after.mean[c] - before.mean[c])) / Math.hypot(...before.mean.slice(2));
      expect(after.corners === before.corners && off < 1e-4, `${what}: the same triangles`, off);
    } else {
      expect(after.all === before.all, `${what}: the same vertices`);
    }
    if (!input.includes('draco')) expect(await corners_in_three(output) === after.corners, `${what}: three.js draws it`);
  }
}
finish();

// glTF-Transform with the class in spec/gltf-transform keeps fabrics through dedup, prune, quantize and meshopt.
import { readFileSync } from 'node:fs';
import { MeshoptDecoder, MeshoptEncoder } from 'meshoptimizer';
import { blocks_of, difference, dress, expect, finish, json_of, make_fabric, path, run, run_module } from './workshop.mjs';
import { validate } from './validate.mjs';

const { Logger, NodeIO } = await import('@gltf-transform/core');
const { ALL_EXTENSIONS } = await import('@gltf-transform/extensions');
const { cloneDocument, dedup, meshopt, prune, quantize } = await import('@gltf-transform/functions');
const { FabricFile, MaterialsFabric } = await import('../../spec/gltf-transform/index.mjs');

const NAME = 'SELVEDGE_materials_fabric';
await Promise.all([MeshoptDecoder.ready, MeshoptEncoder.ready]);
const io = new NodeIO()
  .registerExtensions([...ALL_EXTENSIONS, MaterialsFabric])
  .registerDependencies({ 'meshopt.decoder': MeshoptDecoder, 'meshopt.encoder': MeshoptEncoder })
  .setLogger(new Logger(Logger.Verbosity.SILENT));
const bytes = readFileSync(make_fabric());

/** The fabrics of a document's materials as plain data. */
const fabrics_of = (document) => document.getRoot().listMaterials().map((material) => {
  const reference = material.getExtension(NAME);
  const file = reference.getFabric();
  const transform = reference.getFabricInfo().getExtension('KHR_texture_transform');
  return {
    name: file.getName(), uri: file.getURI(), mimeType: file.getMimeType(), embedded: file.getImage() && Buffer.from(file.getImage()).equals(bytes),
    kept: ['maskTexture', 'normalTexture', 'tintTexture'].map((name) => [
      name, reference.getTexture(name)?.getImage()?.length, reference.getTextureInfo(name)?.getTexCoord()]),
    numbers: ['maskCutoff', 'normalScale', 'tintFactor'].map((name) => reference.getNumber(name)),
    texCoord: reference.getFabricInfo().getTexCoord(), scale: transform.getScale(), offset: transform.getOffset(), rotation: transform.getRotation(),
  };
});
const same = (one, other) => JSON.stringify(one) === JSON.stringify(other);

/** Writes the document, holds what is read back against it, and demands a clean bill of health. */
async function write(document, name) {
  const file = path(name);
  document.getRoot().listBuffers().forEach((buffer) => buffer.setURI(`${name}.bin`));  // not over the one that was read
  await io.write(file, document);
  const [read, meant] = [fabrics_of(await io.read(file)), fabrics_of(document)];
  expect(same(read, meant), `${name}: what was written is read`, JSON.stringify({ read, meant }));
  const json = json_of(file);
  const { images = [] } = json;
  expect(images.every((image) => image.mimeType !== 'image/x-exr'), `${name}: the fabric is no image`);
  expect(!(json.extensionsRequired ?? []).includes(NAME), `${name}: not required`);
  const report = await validate(file);
  expect(report.errors + report.warnings === 0, `${name}: validator`, JSON.stringify(report.messages.slice(0, 8)));
  return file;
}

/** Through everything; the pictures of what our own reader understands are compared with the first one. */
async function road(dressed, label, bound) {
  const form = dressed.split('.').pop();
  const document = await io.read(dressed);
  const before = fabrics_of(document);
  const step = async (name, ...transforms) => {
    await document.transform(...transforms);
    const file = await write(document, `${label}-${name}.${form}`);
    run('selvedge', 'check', file);
    const rms = difference(dressed, file);
    console.log(`${label}, ${name}: RMS difference ${rms.toPrecision(3)} (bound ${name === 'prune' ? 0 : bound})`);
    expect(rms <= (name === 'prune' ? 0 : bound), `${label}, ${name}: the same picture`, rms);
    return file;
  };
  await step('prune', dedup(), prune());
  await step('quantize', quantize());
  await document.transform(meshopt({ encoder: MeshoptEncoder }));
  const compressed = await write(document, `${label}-meshopt.${form}`);
  expect(json_of(compressed).extensionsRequired.includes('EXT_meshopt_compression'), `${label}: meshopt is on`);
  const unpacked = await io.read(compressed);
  unpacked.disposeExtension('EXT_meshopt_compression');
  const file = await write(unpacked, `${label}-unpacked.${form}`);
  const rms = difference(dressed, file);
  console.log(`${label}, meshopt and back: RMS difference ${rms.toPrecision(3)} (bound ${bound})`);
  expect(rms <= bound, `${label}, meshopt: the same picture`, rms);
  return { before, after: fabrics_of(unpacked), file };
}

// Positions of 14 bits, normals of 10 (8 in meshopt): measured 0.002 to 0.004.
for (const form of ['glb', 'gltf']) {
  const { before, after, file } = await road(dress('sweater', form), `sweater-${form}`, 0.008);
  expect(before.every((fabric) => fabric.embedded === (form === 'glb' ? true : null)), 'embedded in .glb only');
  expect(same(before, after), `${form}: fabrics as before`, JSON.stringify({ before, after }));
  const { attributes } = json_of(file).meshes[0].primitives[0];
  expect('TEXCOORD_0' in attributes, `${form}: texture coordinates are kept`);
}

// A fabric on a second UV set that nothing else uses, without a fallback: prune drops the first set and calls the second
// TEXCOORD_0, and the reference has to follow. Its coordinates are moved into [0, 1], where quantize touches them.
const two_sets = await io.read(path('sweater-plain.glb'));
for (const primitive of two_sets.getRoot().listMeshes().flatMap((mesh) => mesh.listPrimitives())) {
  const uvs = primitive.getAttribute('TEXCOORD_0').clone();
  const [low, high] = [uvs.getMin([]), uvs.getMax([])];
  uvs.setArray(uvs.getArray().map((value, i) => (value - low[i % 2]) / (high[i % 2] - low[i % 2])));
  primitive.setAttribute('TEXCOORD_1', uvs);
}
await io.write(path('two-plain.glb'), two_sets);
const second = await road(dress('two', 'glb', '--texcoord', '1', '--no-fallback'), 'second-set', 0.008);
expect(second.before.every((fabric) => fabric.texCoord === 1), 'the fabric is on the second set');
expect(second.after.every((fabric) => fabric.texCoord === 0), 'and follows it to the first', JSON.stringify(second.after));
expect(same(second.before.map(({ scale, offset }) => [scale, offset]), second.after.map(({ scale, offset }) => [scale, offset])),
  'quantize folds nothing into the transform');
const quantised = json_of(second.file);
const uvs = quantised.accessors[quantised.meshes[0].primitives[0].attributes.TEXCOORD_0];
expect(uvs.normalized && uvs.componentType === 5123, 'the texture coordinates were quantised', JSON.stringify(uvs));

// By hand: clones keep the fabric out of images[], bytes with a name become a file, a broken index is refused.
const copy = cloneDocument(await io.read(path('sweater.glb')));
const file = copy.getRoot().listMaterials()[0].getExtension(NAME).getFabric();
expect(file instanceof FabricFile && copy.getRoot().listTextures().length === 1, 'a clone has the fabric and the texture');
await write(copy, 'clone.glb');
file.setURI('by-hand.fabric.exr');
await io.write(path('by-hand.gltf'), copy);
expect(readFileSync(path('by-hand.fabric.exr')).equals(bytes), 'bytes with a name are written as a file');
run('selvedge', 'check', path('by-hand.gltf'));
const broken = await io.readAsJSON(path('sweater.glb'));
broken.json.materials[0].extensions[NAME].fabric.index = 1;
const message = await io.readJSON(broken).then(() => '', (error) => error.message);
expect(message === `/materials/0/extensions/${NAME}/fabric/index: there is no such fabric`, 'a broken index is refused', message);

// The examples of the class's README, with our files.
const [optimise, config, create] = blocks_of('spec/gltf-transform/README.md', 'js').map((code) =>
  code.replace("'dressed.glb'", `'${path('sweater.glb')}'`).replace("'small.glb'", `'${path('small.glb')}'`)
    .replace("readFileSync('plain-knit.exr')", `readFileSync('${path('knit.fabric.exr')}')`));
await run_module(optimise);
run('selvedge', 'check', path('small.glb'));
expect((await run_module(config)).default.extensions.includes(MaterialsFabric), 'the configuration has the class');
const made = await io.read(path('sweater-plain.glb'));
const [material] = made.getRoot().listMaterials();
const transforms = made.createExtension(ALL_EXTENSIONS.find((one) => one.EXTENSION_NAME === 'KHR_texture_transform'));
new Function('document', 'material', 'transforms', 'MaterialsFabric', 'readFileSync', create)(made, material, transforms, MaterialsFabric, readFileSync);
await io.write(path('made.glb'), made);
run('selvedge', 'check', path('made.glb'));
const reference = json_of(path('made.glb')).materials[0].extensions[NAME].fabric;
expect(same(reference, { index: 0, extensions: { KHR_texture_transform: { scale: [200, 250] } } }), 'made by hand', reference);
finish();

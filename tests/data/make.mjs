// Makes the scarf of tests/data/encodings: one cloth, plain and in five encodings by glTF-Transform, whose encoders are
// not ours. Kept in the repository, so that a clone without ../shared/data tests reading and dressing too.
//
//   npm install @gltf-transform/{core,extensions,functions}@4.5.1 draco3dgltf@1.5.7 meshoptimizer@1.3.0
//   node make.mjs FOLDER
import { Document, NodeIO } from '@gltf-transform/core';
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import { draco, meshopt, quantize } from '@gltf-transform/functions';
import draco3d from 'draco3dgltf';
import { MeshoptDecoder, MeshoptEncoder } from 'meshoptimizer';

const [folder] = process.argv.slice(2);
const columns = 16, rows = 48;

/** A strip of 0.3 x 0.9 m that hangs in folds; texture coordinates in metres, not across the unit square. */
function scarf() {
  const position = [], normal = [], uv = [], index = [];
  for (let j = 0; j <= rows; ++j) {
    for (let i = 0; i <= columns; ++i) {
      const x = 0.3 * i / columns, z = 0.9 * j / rows, wave = 30 * x + 4 * z;
      position.push(x - 0.15, 0.02 * Math.sin(wave), z - 0.45);
      const slope = [-0.02 * 30 * Math.cos(wave), 1, -0.02 * 4 * Math.cos(wave)], length = Math.hypot(...slope);
      normal.push(...slope.map((n) => n / length));
      uv.push(x * 1.08, z);
      if (i < columns && j < rows) {
        const v = j * (columns + 1) + i;
        index.push(v, v + columns + 1, v + 1, v + 1, v + columns + 1, v + columns + 2);
      }
    }
  }
  const document = new Document(), buffer = document.createBuffer();
  const accessor = (type, array) => document.createAccessor().setType(type).setArray(array).setBuffer(buffer);
  const material = document.createMaterial('scarf').setDoubleSided(true).setBaseColorFactor([0.5, 0.1, 0.1, 1]);
  const primitive = document.createPrimitive()
    .setIndices(accessor('SCALAR', new Uint16Array(index)))
    .setAttribute('POSITION', accessor('VEC3', new Float32Array(position)))
    .setAttribute('NORMAL', accessor('VEC3', new Float32Array(normal)))
    .setAttribute('TEXCOORD_0', accessor('VEC2', new Float32Array(uv)))
    .setMaterial(material);
  document.createScene().addChild(document.createNode('scarf').setMesh(document.createMesh('scarf').addPrimitive(primitive)));
  return document;
}

await MeshoptEncoder.ready;
const io = new NodeIO().registerExtensions(ALL_EXTENSIONS).registerDependencies({
  'draco3d.encoder': await draco3d.createEncoderModule(),
  'draco3d.decoder': await draco3d.createDecoderModule(),
  'meshopt.encoder': MeshoptEncoder,
  'meshopt.decoder': MeshoptDecoder,
});
const encodings = {
  plain: [],
  draco_edgebreaker: [draco({ method: 'edgebreaker' })],
  draco_sequential: [draco({ method: 'sequential' })],
  quantized: [quantize()],
  meshopt_medium: [meshopt({ encoder: MeshoptEncoder, level: 'medium' })],
  meshopt_high: [meshopt({ encoder: MeshoptEncoder, level: 'high' })],
};
for (const [name, steps] of Object.entries(encodings)) {
  const document = scarf();
  await document.transform(...steps);
  await io.write(`${folder}/scarf_${name}.glb`, document);
}

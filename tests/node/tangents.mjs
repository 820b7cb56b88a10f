// Dressing adds the tangents of MikkTSpace (npm mikktspace), corner by corner: on our own garments, and on garments of
// others if present.
import { NodeIO } from '@gltf-transform/core';
import { ALL_EXTENSIONS } from '@gltf-transform/extensions';
import { existsSync } from 'node:fs';
import { createRequire } from 'node:module';
import { expect, finish, make_fabric, path, plain, run } from './workshop.mjs';

const { generateTangents } = createRequire(import.meta.url)('mikktspace');
const data = new URL('../../../shared/data/garments/', import.meta.url).pathname;
// MikkTSpace works in single precision: on triangles that are tiny in UV its directions are off by up to 0.0027.
const bound = 4e-3;
const io = new NodeIO().registerExtensions(ALL_EXTENSIONS);

/** The corners of a primitive as one array per attribute. */
function corners(primitive, semantic) {
  const accessor = primitive.getAttribute(semantic);
  const indices = primitive.getIndices();
  const size = accessor.getElementSize();
  const count = indices ? indices.getCount() : accessor.getCount();
  const values = new Float32Array(count * size);
  for (let i = 0; i < count; i += 1) {
    values.set(accessor.getElement(indices ? indices.getScalar(i) : i, []), i * size);
  }
  return values;
}

async function compare(name, file) {
  const plain = await io.read(file);
  for (const primitive of plain.getRoot().listMeshes().flatMap((mesh) => mesh.listPrimitives())) {
    primitive.setAttribute('TANGENT', null);
  }
  // With normals of its own, a garment needs none of the fabric's.
  for (const material of plain.getRoot().listMaterials()) material.setNormalTexture(null);
  await io.write(path(`${name}-plain.glb`), plain);
  run('selvedge', 'dress', path(`${name}-plain.glb`), fabric, '-o', path(`${name}-dressed.glb`), '--all', '--quiet');
  const dressed = await io.read(path(`${name}-dressed.glb`));
  let [total, far, other_hand, worst] = [0, 0, 0, 0];
  for (const primitive of dressed.getRoot().listMeshes().flatMap((mesh) => mesh.listPrimitives())) {
    if (!primitive.getAttribute('TANGENT')) continue;
    const ours = corners(primitive, 'TANGENT');
    const given = ['POSITION', 'NORMAL', 'TEXCOORD_0'].map((semantic) => corners(primitive, semantic));
    const theirs = generateTangents(...given);
    for (let i = 0; i < ours.length; i += 4) {
      // MikkTSpace counts v upwards, glTF downwards: the sign is the other one.
      const angle = Math.hypot(ours[i] - theirs[i], ours[i + 1] - theirs[i + 1], ours[i + 2] - theirs[i + 2]);
      total += 1;
      worst = Math.max(worst, angle);
      if (angle > bound) far += 1;
      if (ours[i + 3] !== -theirs[i + 3]) other_hand += 1;
    }
  }
  console.log(`${name}: ${total} corners, ${far} farther than ${bound}, ${other_hand} of the other hand, worst ${worst.toPrecision(3)}`);
  return { total, far, other_hand };
}

const fabric = make_fabric();
{
  const { total, far, other_hand } = await compare('sweater', plain('sweater'));
  expect(total > 1000 && far === 0 && other_hand === 0, 'sweater: all tangents are the same');
}
for (const [name, file] of Object.entries({
  cloth: 'khronos/SheenCloth/glTF/SheenCloth.gltf',
  folds: 'babylon/clothFolds.glb',
  chair: 'khronos/SheenChair/glTF/SheenChair.gltf',
  mirrors: 'khronos/NormalTangentMirrorTest/glTF-Binary/NormalTangentMirrorTest.glb',
  suzanne: 'khronos/Suzanne/glTF/Suzanne.gltf',
  flat: 'khronos/TextureTransformTest/glTF/TextureTransformTest.gltf',
})) {
  if (!existsSync(data + file)) {
    console.log(`${name}: skipped, no shared data`);
    continue;
  }
  const { total, far, other_hand } = await compare(name, data + file);
  expect(total > 0 && far === 0 && other_hand === 0, `${name}: all tangents are the same`);
}
finish();

// The .usda that `selvedge dress --usda` writes, as tinyusdz reads it.
import { existsSync, readFileSync } from 'node:fs';
import { dirname, resolve } from 'node:path';
import { blocks_of, dress, expect, finish, json_of, make_fabric, make_yarn_fabric, path, run } from './workshop.mjs';
import { read_usda, rewrite_usda } from './tinyusdz.mjs';

const { NodeIO } = await import('@gltf-transform/core');

make_fabric();
for (const [garment, form] of [['sweater', 'glb'], ['sweater', 'gltf']]) {
  const layer = path(`${form}.usda`);
  const dressed = dress(garment, form, '--usda', layer);
  const text = readFileSync(layer, 'utf8');
  const scene = read_usda(text);
  expect(scene.error === undefined, `${garment}: tinyusdz reads it`, scene.error);

  // The same geometry as in the glTF, which another program has read.
  const [mesh] = (await new NodeIO().read(path(`${garment}-plain.glb`))).getRoot().listMeshes();
  const primitives = mesh.listPrimitives();
  expect(scene.meshes.length === primitives.length, `${garment}: meshes`, scene.meshes.length);
  primitives.forEach((primitive, i) => {
    const { faceVertexCounts, faceVertexIndices, points, normals, texcoords } = scene.meshes[i];
    const same = (array, semantic, map) => {
      const wanted = primitive.getAttribute(semantic).getArray();
      return array.length === wanted.length && array.every((value, k) => Math.abs(value - map(wanted[k], k)) <= 1e-6);
    };
    expect(faceVertexCounts.length * 3 === primitive.getIndices().getCount() && faceVertexCounts.every((n) => n === 3) &&
      faceVertexIndices.every((index, k) => index === primitive.getIndices().getScalar(k)), `${garment} ${i}: triangles`);
    expect(same(points, 'POSITION', (value) => value), `${garment} ${i}: points`);
    expect(same(normals, 'NORMAL', (value) => value), `${garment} ${i}: normals`);
    expect(same(texcoords, 'TEXCOORD_0', (value, k) => (k % 2 === 0 ? value : 1 - value)), `${garment} ${i}: st`);
  });

  // Its materials with the fallback as files beside.
  const names = json_of(dressed).materials.map((material) => material.name);
  const paths = scene.nodes.map((node) => node.absPath);
  for (const name of names) expect(paths.includes(`/Garment/Materials/${name}`), `${garment}: material ${name}`, paths);
  for (const material of scene.materials) {
    expect(material.metallic === 0 && material.roughness === 1, `${garment}: matt`);
    for (const texture of [material.diffuseColorTextureId]) {
      const file = resolve(dirname(layer), scene.image_of(texture));
      expect(readFileSync(file).toString('latin1', 1, 4) === 'PNG', `${garment}: ${file} is a picture`);
    }
  }

  // The fabric's name survives a program that does not know it, and leads to a fabric.
  const again = rewrite_usda(text);
  const files = [...again.matchAll(/custom asset selvedge:fabric:file = @([^@]+)@/g)].map((match) => match[1]);
  expect(files.length === names.length, `${garment}: each material has a fabric`, again.slice(0, 200));
  for (const file of files) run('selvedge', 'check', resolve(dirname(layer), file));
  const coordinates = [...again.matchAll(/custom float2 selvedge:fabric:st\.connect = <([^>]+)\.outputs:result>/g)];
  for (const [, shader] of coordinates) expect(paths.includes(shader), `${garment}: ${shader} exists`);
  expect(coordinates.length === names.length, `${garment}: each fabric has its place`);
}

// The yarn of a garment: copies, and curves in the region.
make_yarn_fabric();
run('selvedge', 'export', dress('sweater', 'glb', '--repeats', '20,26'), '-o', path('yarn.usda'), '--region', '2,2,8,8', '--quiet');
const yarn = readFileSync(path('yarn.usda'), 'utf8');
expect(read_usda(yarn).error === undefined, 'tinyusdz reads the yarn', read_usda(yarn).error);
const kept = rewrite_usda(yarn);
for (const type of ['PointInstancer', 'BasisCurves'])
  expect(kept.split(`def ${type} `).length === yarn.split(`def ${type} `).length && yarn.includes(`def ${type} `), type);

// tinyusdz rejects broken text, so all of this says something.
const text = readFileSync(path('gltf.usda'), 'utf8');
for (const broken of [text.slice(0, text.length * 3 / 4), text.replace('def Scope', 'def def Scope'), text.replace('= [3, 3', '= [3 3')]) {
  expect(read_usda(broken).error?.length > 0, 'broken text is rejected');
}
// The example of the page, within what it leaves out.
const [example] = blocks_of('spec/usd.md', 'usda');
const whole = `#usda 1.0\n(\n    defaultPrim = "Garment"\n)\ndef Xform "Garment"\n{\ndef Scope "Materials"\n{\n${example}}\n}\n`;
expect(rewrite_usda(whole).includes('selvedge:fabric:file = @./plain-knit.exr@'), 'the example is read', rewrite_usda(whole).slice(0, 300));

expect(existsSync(path('glb-fabric0.exr')) && !existsSync(path('gltf-fabric0.exr')), 'an embedded fabric is written beside');
finish();

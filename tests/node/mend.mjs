// Garments that break rules of glTF which our readers pass over: what `dress` makes of them is good by `check` and by
// the Khronos validator, or they are refused in one line. Each is a triangle with one fault.
import { writeFileSync } from 'node:fs';
import { expect, finish, make_fabric, path, refusal } from './workshop.mjs';
import { validate } from './validate.mjs';

const fabric = make_fabric();

function triangle() {
  const numbers = [0, 0, 0, 1, 0, 0, 0, 1, 0, /* normals */ 0, 0, 1, 0, 0, 1, 0, 0, 1, /* uv */ 0, 1, 1, 1, 0, 0];
  const bytes = Buffer.from(new Float32Array(numbers).buffer);
  const accessor = (bufferView, type) => ({ bufferView, componentType: 5126, count: 3, type });
  return {
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1, TEXCOORD_0: 2 }, material: 0 }] }],
    materials: [{ name: 'cloth', doubleSided: true }],
    buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}` }],
    bufferViews: [[0, 36], [36, 36], [72, 24]].map(([byteOffset, byteLength]) => ({ buffer: 0, byteOffset, byteLength, target: 34962 })),
    accessors: [{ ...accessor(0, 'VEC3'), min: [0, 0, 0], max: [1, 1, 0] }, accessor(1, 'VEC3'), accessor(2, 'VEC2')],
  };
}

const attributes = (g) => g.meshes[0].primitives[0].attributes;
function worn(g, image) {
  g.images = [image];
  g.textures = [{ source: 0 }];
  g.materials[0].emissiveTexture = { index: 0 };
  g.materials[0].emissiveFactor = [1, 1, 1];
}
writeFileSync(path('text.png'), 'text');
const mended = {
  'nothing': () => {},
  'a name that is a number': (g) => { g.scenes[0].name = 7; },
  'a name that is a list': (g) => { g.nodes[0].name = [1]; },
  'a generator that is a number': (g) => { g.asset.generator = 5; },
  'empty lists of the root': (g) => {
    for (const list of ['cameras', 'skins', 'images', 'textures', 'samplers', 'animations', 'extensionsUsed', 'extensionsRequired']) g[list] = [];
  },
  'a node with no children': (g) => { g.nodes[0].children = []; },
  'a mesh with no weights': (g) => { g.meshes[0].weights = []; },
  'a primitive with no targets': (g) => { g.meshes[0].primitives[0].targets = []; },
  'an animation of nothing': (g) => { g.animations = [{ channels: [], samplers: [] }]; },
  'a scene of nothing': (g) => { g.scenes.push({ nodes: [] }); },
  'a camera that is null': (g) => { g.nodes[0].camera = null; },
  'an attribute of no known name': (g) => { attributes(g).uv = 2; attributes(g).TEXCOORD_01 = 2; },
  'a picture that is not there': (g) => worn(g, { uri: 'none.png' }),
  'a picture that is a text': (g) => worn(g, { uri: 'text.png' }),
  'a picture of no bytes': (g) => worn(g, { uri: 'data:image/png;base64,' }),
  'a texture that is not there': (g) => { g.materials.push({ normalTexture: { index: 0 } }); },
  'a picture that nothing uses and is not there': (g) => { g.images = [{ uri: 'none.png' }]; },
};
const refused = {
  'texture coordinates with a gap': (g) => { attributes(g).TEXCOORD_2 = 2; },
  'texture coordinates that begin at 1': (g) => { attributes(g).TEXCOORD_1 = 2; delete attributes(g).TEXCOORD_0; },
  'colours with a gap': (g) => { attributes(g).COLOR_1 = 1; },
  'a node of a mesh that is not there': (g) => { g.nodes.push({ mesh: 1 }); },
  'a mesh of nothing': (g) => { g.meshes.push({ primitives: [] }); },
  'a picture that is not there, and an extension that may need it': (g) => {
    worn(g, { uri: 'none.png' });
    g.extensionsUsed = ['ACME_pictures'];
  },
};

function dressed(change, form) {
  const garment = triangle();
  change(garment);
  writeFileSync(path('garment.gltf'), JSON.stringify(garment));
  const output = path(`dressed.${form}`);
  return { output, ...refusal('selvedge', 'dress', path('garment.gltf'), fabric, '-o', output, '--all') };
}

/** Each form stores pictures in its own way; what is wrong with the JSON is the same in both, so these faults take turns. */
const forms = ['glb', 'gltf'];
const of_form = (faults, form) => Object.entries(faults).filter(
  ([fault], i) => fault === 'nothing' || fault.includes('picture') || form === forms[i % 2]);

for (const form of forms) {
  for (const [fault, change] of of_form(mended, form)) {
    const { output, status, line } = dressed(change, form);
    expect(status === 0, `${form}: ${fault} is mended`, line);
    expect((line !== '') === (fault !== 'nothing'), `${form}: ${fault} has a remark`, line);
    const report = await validate(output);
    expect(report.errors + report.warnings === 0, `${form}: ${fault}: validator`, JSON.stringify(report.messages));
    const checked = refusal('selvedge', 'check', output);
    expect(checked.status === 0, `${form}: ${fault}: check`, checked.line);
  }
  for (const [fault, change] of of_form(refused, form)) {
    const { status, line } = dressed(change, form);
    expect(status === 1 && !line.includes('\n'), `${form}: ${fault} is refused in one line`, `${status} ${line}`);
  }
}
finish();

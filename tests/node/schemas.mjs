// The JSON schemas of SELVEDGE_materials_fabric: what dress writes is valid, what breaks a rule is not.
import { readFileSync, readdirSync } from 'node:fs';
import Ajv from 'ajv/dist/2020.js';
import { blocks_of, dress, expect, finish, json_of, make_fabric } from './workshop.mjs';

const NAME = 'SELVEDGE_materials_fabric';
const folder = new URL('../../spec/SELVEDGE_materials_fabric/', import.meta.url);
const ajv = new Ajv({ allErrors: true, allowUnionTypes: true });
ajv.addKeyword('gltf_uriType');
ajv.addFormat('iri-reference', (text) => !/[\s<>"{}|\\^`]/.test(text));

// The parts of glTF's own schemas that ours refer to.
const property = { type: 'object', properties: { extensions: { type: 'object', additionalProperties: { type: 'object' } } } };
const index = { type: 'integer', minimum: 0 };
ajv.addSchema(property, 'glTFProperty.schema.json');
ajv.addSchema({ ...property, properties: { ...property.properties, name: { type: 'string' } } }, 'glTFChildOfRootProperty.schema.json');
ajv.addSchema(index, 'glTFid.schema.json');
ajv.addSchema({ ...property, properties: { ...property.properties, index, texCoord: index }, required: ['index'] }, 'textureInfo.schema.json');
ajv.addSchema({
  ...property,
  properties: { ...property.properties, index, texCoord: index, scale: { type: 'number' } },
  required: ['index'],
}, 'material.normalTextureInfo.schema.json');
const files = readdirSync(new URL('schema/', folder));
for (const file of files) ajv.addSchema(JSON.parse(readFileSync(new URL(`schema/${file}`, folder), 'utf8')));
const valid = (schema, json) => {
  const good = ajv.validate(schema, json);
  return good ? '' : ajv.errorsText();
};
const [root, material] = [`glTF.${NAME}.schema.json`, `material.${NAME}.schema.json`];

function check(json, what) {
  expect(valid(root, json.extensions[NAME]) === '', `${what}: root`, valid(root, json.extensions[NAME]));
  for (const one of json.materials) {
    const extension = valid(material, one.extensions[NAME]);
    expect(extension === '', `${what}: ${one.name}`, extension);
  }
  return json;
}

make_fabric();
const beside = check(json_of(dress('sweater', 'gltf')), 'beside');
const inside = check(json_of(dress('sweater', 'glb')), 'inside');

// One broken rule each.
const broken = (schema, json, ...edits) => {
  for (const edit of edits) {
    const copy = structuredClone(json);
    edit(copy);
    expect(valid(schema, copy) !== '', `refused by ${schema}: ${edit}`);
  }
};
const of_root = [
  (e) => delete e.fabrics, (e) => { e.fabrics = []; }, (e) => { e.fabrics = {}; }, (e) => delete e.fabrics[0].mimeType,
  (e) => { e.fabrics[0].mimeType = 'image/png'; }, (e) => { e.fabrics[0].name = 1; },
];
broken(root, beside.extensions[NAME], ...of_root, (e) => delete e.fabrics[0].uri, (e) => { e.fabrics[0].bufferView = 0; },
  (e) => { e.fabrics[0].uri = ''; }, (e) => { e.fabrics[0].uri = 'a fabric.exr'; });
broken(root, inside.extensions[NAME], ...of_root, (e) => delete e.fabrics[0].bufferView, (e) => { e.fabrics[0].uri = 'a.exr'; },
  (e) => { e.fabrics[0].bufferView = -1; }, (e) => { e.fabrics[0].bufferView = 0.5; });
broken(material, inside.materials[0].extensions[NAME], (e) => delete e.fabric, (e) => { e.fabric = 0; }, (e) => delete e.fabric.index,
  (e) => { e.fabric.index = -1; }, (e) => { e.fabric.texCoord = '0'; }, (e) => { e.fabric.extensions = []; });

// The examples of the README are as good, and it names every schema.
const readme = readFileSync(new URL('README.md', folder), 'utf8');
for (const file of files) expect(readme.includes(`schema/${file}`), `the README names ${file}`);
const examples = blocks_of('spec/SELVEDGE_materials_fabric/README.md', 'json').map((text) => JSON.parse(`{${text}}`));
expect(examples.length === 2, 'the README has an example of each');
for (const example of examples) {
  if (example.extensions?.[NAME]) expect(valid(root, example.extensions[NAME]) === '', 'example of the root', valid(root, example.extensions[NAME]));
  for (const one of example.materials ?? []) expect(valid(material, one.extensions[NAME]) === '', 'example of a material', valid(material, one.extensions[NAME]));
}
finish();

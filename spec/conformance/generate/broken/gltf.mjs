// glTF files that break the rules of glTF itself: container, JSON, members, buffer views, accessors, primitives, nodes, skins.
// Rows: [code, what, about, place, change, more], as of_square() and of_glb() of square.mjs take them.
import {AT, add_accessor, add_view, bytes_of, glb_of, of_glb, of_square, primitive_of} from '../square.mjs';
import {set} from './common.mjs';

const {f32, u16} = bytes_of;
const FLOAT = 5126;
const DAMAGED = ['FILE_DAMAGED', 'GLTF_MALFORMED'], NO_JSON = ['JSON_MALFORMED', 'GLTF_MALFORMED'];
const MALFORMED = 'GLTF_MALFORMED', ACCESSOR = 'GLTF_ACCESSOR', UNSUPPORTED = 'GLTF_UNSUPPORTED';
/** A value out of range that refers to nothing: issues.md leaves open which of the two codes it has. */
const VALUES = [ACCESSOR, MALFORMED];
const PRIMITIVE = '/meshes/0/primitives/0', ATTRIBUTES = `${PRIMITIVE}/attributes`;
const same = () => {};
const at = (pointer, value) => ({json}) => set(pointer, value)(json);

const JSON_AND_BIN = (json, bin) => [['JSON', json], ['BIN\0', bin]];
const both = (json, bin) => glb_of(JSON_AND_BIN(json, bin));
/** The GLB with four bytes changed. */
const with_u32 = (bytes, value, place) => {
  bytes.writeUInt32LE(value, place);
  return bytes;
};
const containers = [
  [UNSUPPORTED, 'version-1', 'a GLB of version 1', '', (json, bin) => glb_of(JSON_AND_BIN(json, bin), {version: 1})],
  [DAMAGED, 'header-cut', 'a GLB that ends within its header', '', (json) => glb_of([['JSON', json]]).subarray(0, 10)],
  [DAMAGED, 'cut', 'a GLB that is shorter than its header says', '', (json, bin) => both(json, bin).subarray(0, -4)],
  [
    DAMAGED, 'chunk-beyond-the-end', 'a chunk that is longer than the GLB', '',
    (json, bin) => with_u32(both(json, bin), bin.length + 4, 12 + 8 + json.length)
  ],
  [
    DAMAGED, 'chunk-header-cut', 'four bytes in place of a chunk', '', (json, bin) => {
      const bytes = Buffer.concat([both(json, bin), Buffer.alloc(4)]);
      return with_u32(bytes, bytes.length, 8);
    }
  ],
  [
    MALFORMED, 'chunk-not-of-4', 'a JSON chunk whose size is not a multiple of 4', '',
    (json, bin) => both(Buffer.concat([json, Buffer.from('  ')]), Buffer.concat([bin, Buffer.alloc(2)]))
  ],
  [
    MALFORMED, 'first-chunk-not-json', 'the binary chunk before the JSON', '',
    (json, bin) => glb_of(JSON_AND_BIN(json, bin).reverse())
  ],
  [
    MALFORMED, 'two-json-chunks', 'a second JSON chunk', '',
    (json, bin) => glb_of([...JSON_AND_BIN(json, bin), ['JSON', json]])
  ],
  [MALFORMED, 'json-empty', 'a JSON chunk of no bytes', '', (json, bin) => both(Buffer.alloc(0), bin)],
  [
    MALFORMED, 'binary-not-second', 'a binary chunk behind one of another type', '',
    (json, bin) => glb_of([['JSON', json], ['SEAM', Buffer.alloc(4)], ['BIN\0', bin]])
  ],
  [
    MALFORMED, 'without-binary-chunk', 'a buffer without a uri, and no binary chunk', '/buffers/0',
    (json) => glb_of([['JSON', json]])
  ],
].map(([code, what, ...row]) => of_glb(code, `glb-${what}`, ...row));

const files = [
  [NO_JSON, 'not-json', 'a garment that is not JSON', '', same, {text: (text) => text.slice(0, -1)}],
  [NO_JSON, 'member-twice', 'a duplicate member', '', same, {text: (text) => text.replace('{', '{"scene":0,')}],
  [MALFORMED, 'not-an-object', 'JSON that is an array', '', same, {text: (text) => `[${text}]`}],
  [MALFORMED, 'asset-missing', 'no asset', '/asset', at('/asset', undefined)],
  [MALFORMED, 'version-missing', 'no version', '/asset/version', at('/asset/version', undefined)],
  [UNSUPPORTED, 'version-3', 'version 3.0 of glTF', '/asset/version', at('/asset/version', '3.0')],
  [
    UNSUPPORTED, 'version-2-1-at-least', 'at least version 2.1 of glTF', '/asset/minVersion',
    at('/asset', {version: '2.1', minVersion: '2.1'})
  ],
  [
    UNSUPPORTED, 'extension-required', 'an unknown extension is required', '/extensionsRequired', ({json}) => {
      json.extensionsUsed = json.extensionsRequired = ['EXAMPLE_mesh_of_dreams'];
    }
  ],
  [
    [...DAMAGED, ACCESSOR], 'buffer-shorter-than-it-says', 'a data URI with fewer bytes than byteLength', '/buffers/0',
    ({json}) => {
      json.buffers[0].byteLength += 4;
    }
  ],
  [
    ['GLTF_REFERENCE', 'FILE_MISSING'], 'buffer-not-there', 'a buffer in a file that is not there', '/buffers/0',
    at('/buffers/0/uri', 'square.bin')
  ],
  [
    MALFORMED, 'buffer-not-base64', 'a buffer whose data URI is not base64', '/buffers/0', (s) => {
      s.json.buffers[0].uri = `data:application/octet-stream;base64,*${s.bytes.toString('base64')}`;
    }
  ],
  ['IMAGE_UNREADABLE', 'not-there', 'a picture in a file that is not there', '/images/0', at('/images', [{uri: 'cloth.png'}])],
];

/** One member changed: [code, what, pointer, value, place], the place being the pointer if it is absent. */
const members = [
  [MALFORMED, 'member-missing', '/accessors/1/count', undefined, '/accessors/1'],
  [MALFORMED, 'integer-fraction', '/accessors/1/count', 3.5, '/accessors/1'],
  [MALFORMED, 'integer-below-its-range', '/accessors/1/count', 0, '/accessors/1'],
  [MALFORMED, 'integer-above-its-range', `${PRIMITIVE}/mode`, 7],
  [MALFORMED, 'array-object', '/samplers', {}],
  [MALFORMED, 'array-of-numbers', '/samplers', [1], '/samplers/0'],
  [MALFORMED, 'array-of-another-length', '/nodes/0/scale', [1, 1], '/nodes/0'],
  [MALFORMED, 'array-with-an-item-twice', '/scenes/0/nodes', [0, 0], '/nodes/0'],
  [MALFORMED, 'component-type-unknown', '/accessors/1/componentType', 5124, '/accessors/1'],
  [MALFORMED, 'accessor-type-unknown', '/accessors/1/type', 'VEC5', '/accessors/1'],
  [ACCESSOR, 'scene-not-there', '/scene', 1],
  [ACCESSOR, 'node-not-there', '/scenes/0/nodes/0', 1, '/scenes'],
  [ACCESSOR, 'mesh-not-there', '/nodes/0/mesh', 1],
  [ACCESSOR, 'accessor-not-there', `${PRIMITIVE}/attributes/NORMAL`, 9],
  [ACCESSOR, 'indices-not-there', `${PRIMITIVE}/indices`, 9],
  [ACCESSOR, 'material-not-there', `${PRIMITIVE}/material`, 1],
  [ACCESSOR, 'buffer-view-not-there', '/accessors/1/bufferView', 9, '/accessors/1'],
  [ACCESSOR, 'buffer-not-there', '/bufferViews/1/buffer', 1, '/bufferViews/1'],
  [ACCESSOR, 'skin-not-there', '/nodes/0/skin', 0],
].map(([code, what, pointer, value, place = pointer]) =>
  [code, what, `${pointer}: ${what.replaceAll('-', ' ')}`, place, at(pointer, value)]);

const views = [
  [
    ACCESSOR, 'view-beyond-its-buffer', 'a bufferView that reaches beyond its buffer', '/bufferViews/4',
    at('/bufferViews/4/byteLength', 16)
  ],
  [
    ACCESSOR, 'accessor-beyond-its-view', 'an accessor that reaches beyond its bufferView', '/accessors/3',
    at('/accessors/3/byteOffset', 4)
  ],
  [
    ACCESSOR, 'accessor-of-too-many', 'an accessor of more elements than its bufferView has', '/accessors/4',
    at('/accessors/4/count', 9)
  ],
  [
    VALUES, 'stride-less-than-an-element', 'a byteStride of 8 for elements of 12 bytes', '/accessors/1',
    at('/bufferViews/1/byteStride', 8)
  ],
  [
    ACCESSOR, 'stride-beyond-the-view', 'a byteStride by which the last element lies beyond the bufferView', '/accessors/1',
    at('/bufferViews/1/byteStride', 16)
  ],
];

const last_index = (value) => (s) => s.bytes.writeUInt16LE(value, AT[4] + 10);
const second_uv = (value) => (s) => s.bytes.writeFloatLE(value, AT[3] + 4);
const primitives = [
  [ACCESSOR, 'index-beyond-the-vertices', 'index 4 of 4 vertices', PRIMITIVE, last_index(4)],
  [VALUES, 'index-that-restarts', 'index 65,535, which means a restart', PRIMITIVE, last_index(65535)],
  [MALFORMED, 'indices-signed', 'indices of signed shorts', PRIMITIVE, at('/accessors/4/componentType', 5122)],
  [
    MALFORMED, 'indices-of-vectors', 'indices of two components', PRIMITIVE,
    ({json}) => Object.assign(json.accessors[4], {type: 'VEC2', count: 3})
  ],
  [
    MALFORMED, 'attribute-of-another-format', 'texture coordinates of three components', `${ATTRIBUTES}/TEXCOORD_0`,
    (s) => Object.assign(primitive_of(s).attributes, {TEXCOORD_0: 1})
  ],
  [MALFORMED, 'attributes-of-other-counts', 'attributes of different counts', ATTRIBUTES, at('/accessors/3/count', 3)],
  ['MESH_NOT_FINITE', 'vertex-nan', 'a texture coordinate of NaN', `${ATTRIBUTES}/TEXCOORD_0`, second_uv(NaN)],
  ['MESH_NOT_FINITE', 'vertex-infinite', 'an infinite texture coordinate', `${ATTRIBUTES}/TEXCOORD_0`, second_uv(Infinity)],
];

/** Replaces the first elements of a sparse accessor by themselves; `change` breaks a rule. */
const sparse = ([code, what, about, change, numbers = [0, 1, 2]]) => [code, `sparse-${what}`, about, '/accessors/3/sparse', (s) => {
  const rule = {
    count: numbers.length,
    indices: {bufferView: add_view(s, u16(...numbers, ...numbers.length % 2 ? [0] : [])), componentType: 5123},
    values: {bufferView: add_view(s, f32(0, 1, 1, 1, 1, 0))},
  };
  s.json.accessors[3].sparse = rule;
  change(rule, s);
}];
const replacements = [
  [
    VALUES, 'of-too-many', 'more replacements than there are elements', (rule, s) => {
      rule.count = 5;
      rule.indices.bufferView = add_view(s, u16(0, 1, 2, 3, 4, 5));
      rule.values.bufferView = add_view(s, Buffer.alloc(40));
    }
  ],
  [ACCESSOR, 'index-beyond', 'a replacement of an element that is not there', same, [0, 1, 4]],
  [VALUES, 'indices-falling', 'indices of replacements that do not increase', same, [0, 2, 1]],
  [ACCESSOR, 'indices-beyond-their-view', 'indices of replacements beyond their bufferView', set('/indices/byteOffset', 4)],
  [ACCESSOR, 'values-beyond-their-view', 'replacements beyond their bufferView', set('/values/byteOffset', 4)],
  [MALFORMED, 'indices-of-another-type', 'indices of replacements as floats', set('/indices/componentType', FLOAT)],
].map(sparse);

const nodes = (...more) => (s) => s.json.nodes.push(...more);
/** A skin of one joint, node 1, on the square; the first vertex follows joint `joint`. */
function add_skin(s, joint = 0) {
  const {attributes} = s.json.meshes[0].primitives[0], joints = Buffer.alloc(16);
  joints[0] = joint;
  attributes.JOINTS_0 = add_accessor(s, joints, 5121, 'VEC4', 4);
  attributes.WEIGHTS_0 = add_accessor(s, f32(...Array.from({length: 16}, (_, i) => i % 4 ? 0 : 1)), FLOAT, 'VEC4', 4);
  s.json.nodes.push({});
  s.json.nodes[0].skin = 0;
  s.json.scenes[0].nodes.push(1);
  s.json.skins = [{joints: [1]}];
  return s.json.skins[0];
}
const MATRICES = '/skins/0/inverseBindMatrices';
const hierarchy = [
  [MALFORMED, 'node-with-two-parents', 'a node with two parents', '/nodes/3', nodes({children: [3]}, {children: [3]}, {})],
  [
    MALFORMED, 'nodes-in-a-loop', 'nodes that are each other\'s children', '/nodes/', (s) => {
      s.json.nodes[0].children = [1];
      s.json.nodes.push({children: [0]});
    },
    {others: 'allowed'}
  ],
  [MALFORMED, 'scene-of-a-child', 'a scene that lists a node with a parent', '/nodes/0', nodes({children: [0]})],
  [
    ACCESSOR, 'joint-not-there', 'a vertex that follows the second of one joint', `${ATTRIBUTES}/JOINTS_0`,
    (s) => add_skin(s, 1)
  ],
  [
    MALFORMED, 'skin-matrices-of-another-format', 'inverse bind matrices of MAT3', MATRICES, (s) => {
      add_skin(s).inverseBindMatrices = add_accessor(s, f32(1, 0, 0, 0, 1, 0, 0, 0, 1), FLOAT, 'MAT3', 1);
    }
  ],
  [
    MALFORMED, 'skin-matrices-too-few', 'one inverse bind matrix for two joints', MATRICES, (s) => {
      const skin = add_skin(s), identity = f32(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1);
      skin.joints.push(0);
      skin.inverseBindMatrices = add_accessor(s, identity, FLOAT, 'MAT4', 1);
    }
  ],
];

export const broken_gltf = [
  ...containers,
  ...[...files, ...members, ...views, ...primitives, ...replacements, ...hierarchy].map((row) => of_square(...row)),
];

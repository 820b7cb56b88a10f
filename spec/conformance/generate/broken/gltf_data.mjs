// Buffer views, accessors and primitives that cannot be read.
import {AT, add_view, bytes_of, of_square, primitive_of} from '../square.mjs';

const {f32, u16} = bytes_of;
const FLOAT = 5126;
// What is out of range and refers to nothing of itself; issues.md does not say which of the two it is.
const VALUES = ['GLTF_ACCESSOR', 'GLTF_MALFORMED'];
const malformed = (what, about, place, change, more) =>
  of_square('GLTF_MALFORMED', what, about, place, change, more);
const beyond = (what, about, place, change) => of_square('GLTF_ACCESSOR', what, about, place, change);
const values = (what, about, place, change) => of_square(VALUES, what, about, place, change);
const PRIMITIVE = '/meshes/0/primitives/0', ATTRIBUTES = `${PRIMITIVE}/attributes`;

const views = [
  beyond(
    'view-beyond-its-buffer', 'a bufferView that reaches beyond its buffer', '/bufferViews/4',
    (s) => {
      s.json.bufferViews[4].byteLength = 16;
    }),
  beyond(
    'accessor-beyond-its-view', 'an accessor that reaches beyond its bufferView', '/accessors/3',
    (s) => {
      s.json.accessors[3].byteOffset = 4;
    }),
  beyond(
    'accessor-of-too-many', 'an accessor of more elements than its bufferView has', '/accessors/4',
    (s) => {
      s.json.accessors[4].count = 9;
    }),
  values(
    'stride-less-than-an-element', 'a byteStride of 8 for elements of 12 bytes', '/accessors/1',
    (s) => {
      s.json.bufferViews[1].byteStride = 8;
    }),
  beyond(
    'stride-beyond-the-view', 'a byteStride by which the last element lies beyond the bufferView',
    '/accessors/1',
    (s) => {
      s.json.bufferViews[1].byteStride = 16;
    }),
];

const index = (what, about, value) =>
  beyond(what, about, PRIMITIVE, (s) => s.bytes.writeUInt16LE(value, AT[4] + 10));
const indices = [
  index('index-beyond-the-vertices', 'index 4 of 4 vertices', 4),
  values(
    'index-that-restarts', 'index 65,535, which means a restart', PRIMITIVE,
    (s) => s.bytes.writeUInt16LE(65535, AT[4] + 10)),
  malformed(
    'indices-signed', 'indices of signed shorts', PRIMITIVE,
    (s) => {
      s.json.accessors[4].componentType = 5122;
    }),
  malformed(
    'indices-of-vectors', 'indices of two components', PRIMITIVE,
    (s) => {
      Object.assign(s.json.accessors[4], {type: 'VEC2', count: 3});
    }),
];

/** Replaces the first four of a sparse accessor's elements by themselves; `sparse` says what is wrong. */
const sparse = (code, what, about, change, numbers = [0, 1, 2]) =>
  of_square(code, what, about, '/accessors/3/sparse', (s) => {
    const rule = {
      count: numbers.length,
      indices: {bufferView: add_view(s, padded_shorts(numbers)), componentType: 5123},
      values: {bufferView: add_view(s, f32(0, 1, 1, 1, 1, 0))},
    };
    s.json.accessors[3].sparse = rule;
    change(rule, s);
  });
const padded_shorts = (numbers) => u16(...numbers, ...numbers.length % 2 ? [0] : []);
const nothing = () => {};

const replacements = [
  sparse(
    VALUES, 'sparse-of-too-many', 'more replacements than there are elements',
    (rule, s) => {
      rule.count = 5;
      rule.indices.bufferView = add_view(s, u16(0, 1, 2, 3, 4, 5));
      rule.values.bufferView = add_view(s, Buffer.alloc(40));
    }),
  sparse(
    'GLTF_ACCESSOR', 'sparse-index-beyond', 'a replacement of an element that is not there', nothing,
    [0, 1, 4]),
  sparse(
    VALUES, 'sparse-indices-falling', 'indices of replacements that do not increase', nothing, [0, 2, 1]),
  sparse(
    'GLTF_ACCESSOR', 'sparse-indices-beyond-their-view', 'indices of replacements beyond their bufferView',
    (rule) => {
      rule.indices.byteOffset = 4;
    }),
  sparse(
    'GLTF_ACCESSOR', 'sparse-values-beyond-their-view', 'replacements beyond their bufferView',
    (rule) => {
      rule.values.byteOffset = 4;
    }),
  sparse(
    'GLTF_MALFORMED', 'sparse-indices-of-another-type', 'indices of replacements as floats',
    (rule) => {
      rule.indices.componentType = FLOAT;
    }),
];

const attributes = [
  malformed(
    'attribute-of-another-format', 'texture coordinates of three components', `${ATTRIBUTES}/TEXCOORD_0`,
    (s) => {
      primitive_of(s).attributes.TEXCOORD_0 = 1;
    }),
  malformed(
    'attributes-of-other-counts', 'attributes of different counts', ATTRIBUTES,
    (s) => {
      s.json.accessors[3].count = 3;
    }),
  of_square(
    'MESH_NOT_FINITE', 'vertex-nan', 'a texture coordinate of NaN', `${ATTRIBUTES}/TEXCOORD_0`,
    (s) => s.bytes.writeFloatLE(NaN, AT[3] + 4)),
  of_square(
    'MESH_NOT_FINITE', 'vertex-infinite', 'a texture coordinate that is infinite', `${ATTRIBUTES}/TEXCOORD_0`,
    (s) => s.bytes.writeFloatLE(Infinity, AT[3] + 4)),
];

export const broken_gltf_data = [...views, ...indices, ...replacements, ...attributes];

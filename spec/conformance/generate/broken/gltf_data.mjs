// Buffer views, accessors and primitives that break the rules of glTF.
import {AT, add_accessor, add_view, bytes_of, of_square, primitive_of} from '../square.mjs';

const {f32, u16, u8} = bytes_of;
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
  malformed(
    'stride-not-of-4', 'a byteStride of 14', '/bufferViews/5/byteStride',
    (s) => {
      add_view(s, Buffer.alloc(28), {byteStride: 14});
    }),
  malformed(
    'stride-above-252', 'a byteStride of 256', '/bufferViews/5/byteStride',
    (s) => {
      add_view(s, Buffer.alloc(512), {byteStride: 256});
    }),
  malformed(
    'stride-more-than-the-view', 'a byteStride that is longer than its bufferView',
    '/bufferViews/5/byteStride',
    (s) => {
      add_view(s, Buffer.alloc(12), {byteStride: 16});
    }),
  malformed(
    'stride-of-indices', 'a byteStride of indices', PRIMITIVE,
    (s) => {
      const indices = add_accessor(s, u16(0, 0, 1, 0, 2, 0), 5123, 'SCALAR', 3, {view: {byteStride: 4}});
      primitive_of(s).indices = indices;
    }),
  malformed(
    'view-for-two-things', 'vertices and indices in one bufferView', PRIMITIVE,
    (s) => {
      const [vertices, indices] = [{...s.json.accessors[3], bufferView: 0}, {...s.json.accessors[4]}];
      const both = add_view(s, s.bytes.subarray(AT[3]));
      s.json.accessors[3] = {...vertices, bufferView: both};
      s.json.accessors[4] = {...indices, bufferView: both, byteOffset: 32};
    }),
  malformed(
    'view-of-another-target', 'indices in a bufferView whose target is vertices', PRIMITIVE,
    (s) => {
      s.json.bufferViews[4].target = 34962;
    }),
  malformed(
    'view-shared-without-stride', 'two accessors of vertices in a bufferView without byteStride',
    '/bufferViews/0',
    (s) => {
      Object.assign(s.json.bufferViews[0], {byteLength: 96});
      s.json.accessors[1] = {...s.json.accessors[1], bufferView: 0, byteOffset: 48};
    }),
];

const accessors = [
  malformed(
    'accessor-not-aligned', 'shorts that begin at an odd byte', '/accessors/4/byteOffset',
    (s) => {
      s.json.accessors[4].bufferView = add_view(s, Buffer.concat([Buffer.alloc(1), s.bytes.subarray(AT[4])]));
      s.json.accessors[4].byteOffset = 1;
    }),
  malformed(
    'view-not-aligned', 'shorts in a bufferView that begins at an odd byte', '/accessors/4',
    (s) => {
      const i = add_view(s, Buffer.concat([Buffer.alloc(1), s.bytes.subarray(AT[4])]));
      ++s.json.bufferViews[i].byteOffset;
      --s.json.bufferViews[i].byteLength;
      s.json.accessors[4].bufferView = i;
    }),
  malformed(
    'vertices-not-aligned', 'texture coordinates of three bytes each', `${ATTRIBUTES}/TEXCOORD_0`,
    (s) => {
      primitive_of(s).attributes.TEXCOORD_0 =
        add_accessor(s, u8(0, 0, 255, 0, 255, 255, 0, 255), 5121, 'VEC2', 4, {normalized: true});
    }),
  malformed(
    'normalized-floats', 'floats that are normalised', '/accessors/5/normalized',
    (s) => {
      add_accessor(s, f32(0, 1), FLOAT, 'SCALAR', 2, {normalized: true});
    }),
  malformed(
    'min-of-another-length', 'min of two numbers for VEC3', '/accessors/5/min',
    (s) => {
      add_accessor(s, f32(0, 0, 0), FLOAT, 'VEC3', 1, {min: [0, 0]});
    }),
  values(
    'min-of-other-values', 'min that is below the values', '/accessors/0/min',
    (s) => {
      s.json.accessors[0].min = [-1, 0, 0];
    }),
  values(
    'max-of-other-values', 'max that is above the values', '/accessors/0/max',
    (s) => {
      s.json.accessors[0].max = [1, 2, 0];
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
    'attribute-unknown', 'an attribute of an unknown name', `${ATTRIBUTES}/UV`,
    (s) => {
      primitive_of(s).attributes.UV = 3;
    }),
  malformed(
    'attribute-of-another-format', 'texture coordinates of three components', `${ATTRIBUTES}/TEXCOORD_0`,
    (s) => {
      primitive_of(s).attributes.TEXCOORD_0 = 1;
    }),
  malformed(
    'attribute-of-32-bit-integers', 'an attribute of 32-bit integers', `${ATTRIBUTES}/_SEAM`,
    (s) => {
      primitive_of(s).attributes._SEAM = add_accessor(s, Buffer.alloc(16), 5125, 'SCALAR', 4);
    }),
  malformed(
    'quantized-without-the-extension', 'positions of shorts without KHR_mesh_quantization',
    `${ATTRIBUTES}/POSITION`,
    (s) => {
      const shorts = u16(0, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 0, 0, 1, 0, 0);
      primitive_of(s).attributes.POSITION =
        add_accessor(s, shorts, 5122, 'VEC3', 4, {min: [0, 0, 0], max: [1, 1, 0], view: {byteStride: 8}});
    }),
  malformed(
    'position-without-bounds', 'an accessor of POSITION without min', `${ATTRIBUTES}/POSITION`,
    (s) => {
      delete s.json.accessors[0].min;
    }),
  malformed(
    'attributes-of-other-counts', 'attributes of different counts', ATTRIBUTES,
    (s) => {
      s.json.accessors[3].count = 3;
    }),
  malformed(
    'set-left-out', 'TEXCOORD_0 and TEXCOORD_2', ATTRIBUTES,
    (s) => {
      primitive_of(s).attributes.TEXCOORD_2 = 3;
    }),
  malformed(
    'joints-without-weights', 'JOINTS_0 without WEIGHTS_0', ATTRIBUTES,
    (s) => {
      primitive_of(s).attributes.JOINTS_0 = add_accessor(s, Buffer.alloc(16), 5121, 'VEC4', 4);
    }),
  malformed(
    'texture-without-its-set', 'a texture that takes TEXCOORD_1, which is not there', PRIMITIVE,
    (s) => {
      s.json.textures = [{}];
      s.json.materials[0].emissiveTexture = {index: 0, texCoord: 1};
    }),
  of_square(
    'MESH_NOT_FINITE', 'vertex-nan', 'a texture coordinate of NaN', `${ATTRIBUTES}/TEXCOORD_0`,
    (s) => s.bytes.writeFloatLE(NaN, AT[3] + 4)),
  of_square(
    'MESH_NOT_FINITE', 'vertex-infinite', 'a texture coordinate that is infinite', `${ATTRIBUTES}/TEXCOORD_0`,
    (s) => s.bytes.writeFloatLE(Infinity, AT[3] + 4)),
  values(
    'normal-of-length-2', 'a normal of length 2', `${ATTRIBUTES}/NORMAL`,
    (s) => s.bytes.writeFloatLE(2, AT[1] + 8)),
  values(
    'tangent-of-length-2', 'a tangent of length 2', `${ATTRIBUTES}/TANGENT`,
    (s) => s.bytes.writeFloatLE(2, AT[2])),
  values(
    'tangent-of-no-side', 'a tangent whose w is 0', `${ATTRIBUTES}/TANGENT`,
    (s) => s.bytes.writeFloatLE(0, AT[2] + 12)),
  values(
    'colour-above-1', 'a colour above 1', `${ATTRIBUTES}/COLOR_0`,
    (s) => {
      primitive_of(s).attributes.COLOR_0 =
        add_accessor(s, f32(0, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0), FLOAT, 'VEC3', 4);
    }),
];

const morph = (s, count = 4) =>
  add_accessor(s, Buffer.alloc(12 * count), FLOAT, 'VEC3', count, {min: [0, 0, 0], max: [0, 0, 0]});
const targets = [
  malformed(
    'target-of-no-attribute', 'a morph target of an attribute that is not there', `${PRIMITIVE}/targets/0`,
    (s) => {
      delete primitive_of(s).attributes.TANGENT;
      primitive_of(s).targets = [{TANGENT: morph(s)}];
    }),
  malformed(
    'target-of-another-count', 'a morph target of three vertices', `${PRIMITIVE}/targets/0`,
    (s) => {
      primitive_of(s).targets = [{POSITION: morph(s, 3)}];
    }),
  malformed(
    'targets-of-other-numbers', 'primitives with one morph target and with none', '/meshes/0/primitives',
    (s) => {
      s.json.meshes[0].primitives.push({...primitive_of(s)});
      primitive_of(s).targets = [{POSITION: morph(s)}];
    }),
  malformed(
    'weights-without-targets', 'two weights of a mesh for one morph target', '/meshes/0/weights',
    (s) => {
      primitive_of(s).targets = [{POSITION: morph(s)}];
      s.json.meshes[0].weights = [0, 0];
    }),
];

export const broken_gltf_data =
  [...views, ...accessors, ...indices, ...replacements, ...attributes, ...targets];

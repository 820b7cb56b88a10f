// Members of glTF objects that are missing, of the wrong type or out of range.
import {of_square, primitive_of} from '../square.mjs';
import {set} from './common.mjs';

const member = (what, pointer, value, more) => of_square(
  'GLTF_MALFORMED', what, `${pointer}: ${what.replaceAll('-', ' ')}`, pointer,
  (s) => set(pointer, value)(s.json), more);
const absent = (what, pointer, value, more) => of_square(
  'GLTF_ACCESSOR', what, `${pointer}: ${what.replaceAll('-', ' ')}`, pointer,
  (s) => set(pointer, value)(s.json), more);
const advice = (what, about, place, change) => of_square('GLTF_ADVICE', what, about, place, change);

export const broken_gltf_members = [
  member('member-missing', '/accessors/1/count', undefined),
  member('flag-number', '/materials/0/doubleSided', 1),
  member('number-text', '/materials/0/alphaCutoff', '0.5'),
  member('number-out-of-range', '/materials/0/alphaCutoff', -1),
  member('integer-fraction', '/accessors/1/count', 3.5),
  member('integer-below-its-range', '/accessors/1/count', 0),
  member('integer-above-its-range', '/meshes/0/primitives/0/mode', 7),
  member('text-number', '/materials/0/name', 7),
  member('object-array', '/materials/0/pbrMetallicRoughness', []),
  member('array-object', '/samplers', {}),
  member('array-empty', '/images', []),
  member('array-of-another-length', '/nodes/0/scale', [1, 1]),
  member('array-with-an-item-twice', '/scenes/0/nodes', [0, 0]),
  member('attributes-empty', '/meshes/0/primitives/0/attributes', {}),
  member('index-negative', '/nodes/0/mesh', -1),
  member('index-text', '/nodes/0/mesh', '0'),
  absent('scene-not-there', '/scene', 1),
  absent('node-not-there', '/scenes/0/nodes/0', 1),
  absent('mesh-not-there', '/nodes/0/mesh', 1),
  absent('accessor-not-there', '/meshes/0/primitives/0/attributes/NORMAL', 9),
  absent('indices-not-there', '/meshes/0/primitives/0/indices', 9),
  absent('material-not-there', '/meshes/0/primitives/0/material', 1),
  absent('buffer-view-not-there', '/accessors/1/bufferView', 9),
  absent('buffer-not-there', '/bufferViews/1/buffer', 1),
  absent('texture-not-there', '/materials/0/emissiveTexture', {index: 0}),
  absent('image-not-there', '/textures', [{source: 0}]),
  absent('sampler-not-there', '/textures', [{sampler: 0}]),
  absent('skin-not-there', '/nodes/0/skin', 0, {others: 'allowed'}),
  absent('camera-not-there', '/nodes/0/camera', 0),
  member('component-type-unknown', '/accessors/1/componentType', 5124),
  member('accessor-type-unknown', '/accessors/1/type', 'VEC5'),
  of_square(
    'GLTF_MALFORMED', 'byte-offset-without-a-view', 'a byteOffset without a bufferView',
    '/accessors/5/byteOffset',
    (s) => {
      s.json.accessors.push({byteOffset: 0, componentType: 5126, count: 4, type: 'SCALAR'});
    }),
  of_square(
    'GLTF_MALFORMED', 'transform-text', 'a rotation that is a text', '/materials/0/emissiveTexture',
    (s) => {
      s.json.extensionsUsed = ['KHR_texture_transform'];
      s.json.textures = [{}];
      s.json.materials[0].emissiveTexture = {index: 0, extensions: {KHR_texture_transform: {rotation: '1'}}};
    }),
];

const choice = (what, pointer, value) =>
  advice(what, `${pointer}: a value that is not known`, pointer, (s) => set(pointer, value)(s.json));

export const unwise_gltf_members = [
  advice(
    'target-unknown', 'a bufferView of an unknown target', '/bufferViews/5/target',
    (s) => {
      s.json.bufferViews.push({buffer: 0, byteLength: 4, target: 1});
    }),
  choice('alpha-mode-unknown', '/materials/0/alphaMode', 'GLASS'),
  ...Object.entries({magFilter: 1, minFilter: 1, wrapS: 1, wrapT: 1})
    .map(
      ([name, value]) => advice(
        `sampler-${name}-unknown`, `a sampler with an unknown ${name}`, `/samplers/0/${name}`,
        (s) => {
          s.json.samplers = [{[name]: value}];
        })),
  advice(
    'camera-type-unknown', 'a camera of an unknown type', '/cameras/0/type',
    (s) => {
      s.json.cameras = [{type: 'pinhole', perspective: {yfov: 1, znear: 0.1}}];
    }),
  advice(
    'no-position', 'a primitive without POSITION', '/meshes/0/primitives/0/attributes',
    (s) => {
      delete primitive_of(s).attributes.POSITION;
    }),
  advice(
    'tangents-without-normals', 'tangents without normals', '/meshes/0/primitives/0/attributes',
    (s) => {
      delete primitive_of(s).attributes.NORMAL;
    }),
  advice(
    'no-whole-triangles', 'five indices of triangles', '/meshes/0/primitives/0',
    (s) => {
      s.json.accessors[4].count = 5;
    }),
];

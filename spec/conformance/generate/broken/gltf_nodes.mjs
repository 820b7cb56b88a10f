// Nodes, cameras, skins and animations that break the rules of glTF.
import {add_accessor, bytes_of, of_square} from '../square.mjs';

const {f32} = bytes_of;
const FLOAT = 5126;
const malformed = (what, about, place, change, more) =>
  of_square('GLTF_MALFORMED', what, about, place, change, more);
const node = (change) => (s) => Object.assign(s.json.nodes[0], change);
const nodes = (...more) => (s) => s.json.nodes.push(...more);
const SHEARED = [1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];

const hierarchy = [
  malformed(
    'node-with-two-parents', 'a node with two parents', '/nodes/2/children',
    nodes({children: [3]}, {children: [3]}, {})),
  malformed(
    'nodes-in-a-loop', 'nodes that are each other\'s children', '/nodes/',
    nodes({children: [2]}, {children: [1]}), {others: 'allowed'}),
  malformed(
    'scene-of-a-child', 'a scene that lists a node with a parent', '/scenes/0/nodes/0',
    nodes({children: [0]})),
  malformed(
    'matrix-beside-scale', 'a node with matrix and scale', '/nodes/0/matrix',
    node({matrix: IDENTITY, scale: [1, 1, 1]})),
  malformed(
    'matrix-sheared', 'a matrix that is no product of translation, rotation and scale', '/nodes/0/matrix',
    node({matrix: SHEARED})),
  malformed(
    'rotation-not-unit', 'a quaternion of length 1.4', '/nodes/0/rotation', node({rotation: [0, 0, 1, 1]})),
  malformed(
    'node-weights-without-mesh', 'weights of a node without a mesh', '/nodes/1/weights',
    nodes({weights: [0]})),
  malformed(
    'node-weights-without-targets', 'weights of a mesh without morph targets', '/nodes/0/weights',
    node({weights: [0]})),
];

const camera = (what, about, lens) => malformed(`camera-${what}`, about, '/cameras/0', (s) => {
  s.json.cameras = [lens];
});
const perspective = {
  yfov: 1,
  znear: 1
};
const orthographic = {
  xmag: 1,
  ymag: 1,
  znear: 0,
  zfar: 1
};
const cameras = [
  camera('of-no-lens', 'a camera of neither kind', {type: 'perspective'}),
  camera('of-two-lenses', 'a camera of both kinds', {type: 'perspective', perspective, orthographic}),
  camera(
    'far-before-near', 'a zfar that is not greater than znear',
    {type: 'perspective', perspective: {...perspective, zfar: 1}}),
  camera(
    'of-no-width', 'an orthographic camera of no width',
    {type: 'orthographic', orthographic: {...orthographic, xmag: 0}}),
];

/** A skin of one joint, node 1, on the square. */
function add_skin(s) {
  const {attributes} = s.json.meshes[0].primitives[0];
  attributes.JOINTS_0 = add_accessor(s, Buffer.alloc(16), 5121, 'VEC4', 4);
  attributes.WEIGHTS_0 =
    add_accessor(s, f32(...Array.from({length: 16}, (_, i) => i % 4 ? 0 : 1)), FLOAT, 'VEC4', 4);
  s.json.nodes.push({});
  s.json.nodes[0].skin = 0;
  s.json.scenes[0].nodes.push(1);
  s.json.skins = [{joints: [1]}];
  return s.json.skins[0];
}
const skin = (what, about, place, change) => malformed(what, about, place, (s) => change(add_skin(s), s));
const MATRICES = '/skins/0/inverseBindMatrices';
const skins = [
  skin(
    'skin-without-mesh', 'a skin of a node without a mesh', '/nodes/1/skin',
    (of, s) => {
      s.json.nodes[1].skin = 0;
    }),
  skin(
    'skin-without-joints', 'a skin of a mesh without joints', '/nodes/0/skin',
    (of, s) => {
      const {attributes} = s.json.meshes[0].primitives[0];
      delete attributes.JOINTS_0;
      delete attributes.WEIGHTS_0;
    }),
  skin(
    'skin-matrices-of-another-format', 'inverse bind matrices of MAT3', MATRICES,
    (of, s) => {
      of.inverseBindMatrices = add_accessor(s, f32(1, 0, 0, 0, 1, 0, 0, 0, 1), FLOAT, 'MAT3', 1);
    }),
  skin(
    'skin-matrices-too-few', 'one inverse bind matrix for two joints', MATRICES,
    (of, s) => {
      of.joints.push(0);
      of.inverseBindMatrices = add_accessor(s, f32(...IDENTITY), FLOAT, 'MAT4', 1);
    }),
];

/** Moves node 0 at two times; `change` takes the sampler, the channel, { times, values } and the square. */
const animation = (code, what, about, place, change) =>
  of_square(code, what, about, `/animations/0/${place}`, (s) => {
    const input = add_accessor(s, f32(0, 1), FLOAT, 'SCALAR', 2, {min: [0], max: [1]});
    const output = add_accessor(s, f32(0, 0, 0, 1, 1, 1), FLOAT, 'VEC3', 2);
    const sampler = {input, output}, channel = {sampler: 0, target: {node: 0, path: 'translation'}};
    s.json.animations = [{samplers: [sampler], channels: [channel]}];
    change(sampler, channel, {times: s.json.accessors[input], values: s.json.accessors[output]}, s);
  });
const moved = (what, about, place, change) =>
  animation('GLTF_MALFORMED', `animation-${what}`, about, place, change);
const animations = [
  animation(
    'GLTF_ACCESSOR', 'animation-sampler-not-there', 'a channel of a sampler that is not there',
    'channels/0/sampler',
    (sampler, channel) => {
      channel.sampler = 1;
    }),
  moved(
    'of-one-target-twice', 'two channels of one target', 'channels/1/target',
    (sampler, channel, accessors, s) => {
      s.json.animations[0].channels.push(channel);
    }),
  moved(
    'of-a-matrix', 'a translation of a node that has a matrix', 'channels/0/target',
    (sampler, channel, accessors, s) => {
      s.json.nodes[0].matrix = IDENTITY;
    }),
  moved(
    'times-of-another-format', 'times of two components', 'samplers/0/input',
    (sampler, channel, {times}, s) => {
      Object.assign(times, {type: 'VEC2', min: [0, 0], max: [1, 1]});
      times.bufferView = s.json.bufferViews.length;
      add_accessor(s, f32(0, 0, 1, 1), FLOAT, 'VEC2', 2);
      s.json.accessors.pop();
    }),
  moved(
    'times-without-bounds', 'times without max', 'samplers/0/input',
    (sampler, channel, {times}) => {
      delete times.max;
    }),
  moved(
    'spline-of-one-time', 'a cubic spline of one time', 'samplers/0/input',
    (sampler, channel, {times, values}, s) => {
      sampler.interpolation = 'CUBICSPLINE';
      Object.assign(times, {count: 1, max: [0]});
      values.count = 3;
      values.bufferView = s.json.bufferViews.length;
      add_accessor(s, Buffer.alloc(36), FLOAT, 'VEC3', 3);
      s.json.accessors.pop();
    }),
  moved(
    'output-of-another-format', 'a scalar as a translation', 'channels/0/sampler',
    (sampler, channel, {values}) => {
      values.type = 'SCALAR';
    }),
  moved(
    'output-of-another-count', 'one translation for two times', 'channels/0/sampler',
    (sampler, channel, {values}) => {
      values.count = 1;
    }),
  moved(
    'weights-without-targets', 'weights of a mesh without morph targets', 'channels/0',
    (sampler, channel, {values}) => {
      channel.target.path = 'weights';
      values.type = 'SCALAR';
    }),
];

export const broken_gltf_nodes = [...hierarchy, ...cameras, ...skins, ...animations];

export const unwise_gltf_nodes = [
  animation(
    'GLTF_ADVICE', 'interpolation-unknown', 'an interpolation that is not known', 'samplers/0/interpolation',
    (sampler) => {
      sampler.interpolation = 'WOBBLE';
    }),
];

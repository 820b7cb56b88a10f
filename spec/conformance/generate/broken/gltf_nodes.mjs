// Nodes and skins that cannot be read.
import {add_accessor, bytes_of, of_square} from '../square.mjs';

const {f32} = bytes_of;
const FLOAT = 5126;
const malformed = (what, about, place, change, more) =>
  of_square('GLTF_MALFORMED', what, about, place, change, more);
const nodes = (...more) => (s) => s.json.nodes.push(...more);

const hierarchy = [
  malformed(
    'node-with-two-parents', 'a node with two parents', '/nodes/3',
    nodes({children: [3]}, {children: [3]}, {})),
  malformed(
    'nodes-in-a-loop', 'nodes that are each other\'s children', '/nodes/',
    (s) => {
      s.json.nodes[0].children = [1];
      s.json.nodes.push({children: [0]});
    },
    {others: 'allowed'}),
  malformed(
    'scene-of-a-child', 'a scene that lists a node with a parent', '/nodes/0', nodes({children: [0]})),
];

/** A skin of one joint, node 1, on the square; the first vertex follows joint `joint`. */
function add_skin(s, joint = 0) {
  const {attributes} = s.json.meshes[0].primitives[0], joints = Buffer.alloc(16);
  joints[0] = joint;
  attributes.JOINTS_0 = add_accessor(s, joints, 5121, 'VEC4', 4);
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
  of_square(
    'GLTF_ACCESSOR', 'joint-not-there', 'a vertex that follows the second of one joint',
    '/meshes/0/primitives/0/attributes/JOINTS_0', (s) => add_skin(s, 1)),
  skin(
    'skin-matrices-of-another-format', 'inverse bind matrices of MAT3', MATRICES,
    (of, s) => {
      of.inverseBindMatrices = add_accessor(s, f32(1, 0, 0, 0, 1, 0, 0, 0, 1), FLOAT, 'MAT3', 1);
    }),
  skin(
    'skin-matrices-too-few', 'one inverse bind matrix for two joints', MATRICES,
    (of, s) => {
      of.joints.push(0);
      of.inverseBindMatrices =
        add_accessor(s, f32(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1), FLOAT, 'MAT4', 1);
    }),
];

export const broken_gltf_nodes = [...hierarchy, ...skins];

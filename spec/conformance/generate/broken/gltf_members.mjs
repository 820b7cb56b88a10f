// Members of glTF objects that a reader needs and that are missing, of the wrong type or out of range.
import {of_square} from '../square.mjs';
import {set} from './common.mjs';

/** One member changed. `place`: where it is noticed, if not at the member itself. */
const changed = (code, what, pointer, value, place = pointer, more = {}) => of_square(
  code, what, `${pointer}: ${what.replaceAll('-', ' ')}`, place, (s) => set(pointer, value)(s.json), more);
const member = (...rest) => changed('GLTF_MALFORMED', ...rest);
const absent = (...rest) => changed('GLTF_ACCESSOR', ...rest);
const ACCESSOR = '/accessors/1', PRIMITIVE = '/meshes/0/primitives/0';

export const broken_gltf_members = [
  member('member-missing', '/accessors/1/count', undefined, ACCESSOR),
  member('integer-fraction', '/accessors/1/count', 3.5, ACCESSOR),
  member('integer-below-its-range', '/accessors/1/count', 0, ACCESSOR),
  member('integer-above-its-range', `${PRIMITIVE}/mode`, 7),
  member('array-object', '/samplers', {}),
  member('array-of-numbers', '/samplers', [1], '/samplers/0'),
  member('array-of-another-length', '/nodes/0/scale', [1, 1], '/nodes/0'),
  member('array-with-an-item-twice', '/scenes/0/nodes', [0, 0], '/nodes/0'),
  member('component-type-unknown', '/accessors/1/componentType', 5124, ACCESSOR),
  member('accessor-type-unknown', '/accessors/1/type', 'VEC5', ACCESSOR),
  absent('scene-not-there', '/scene', 1),
  absent('node-not-there', '/scenes/0/nodes/0', 1, '/scenes'),
  absent('mesh-not-there', '/nodes/0/mesh', 1),
  absent('accessor-not-there', `${PRIMITIVE}/attributes/NORMAL`, 9),
  absent('indices-not-there', `${PRIMITIVE}/indices`, 9),
  absent('material-not-there', `${PRIMITIVE}/material`, 1),
  absent('buffer-view-not-there', '/accessors/1/bufferView', 9, ACCESSOR),
  absent('buffer-not-there', '/bufferViews/1/buffer', 1, '/bufferViews/1'),
  absent('skin-not-there', '/nodes/0/skin', 0),
];

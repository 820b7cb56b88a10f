// Sorts the triangles of a surface with holes from far to near, so that any number of its layers shows through them.
import {BufferAttribute, Matrix4} from 'three';

/** Places that the depths of a surface are sorted into. */
const PLACES = 2 ** 16;
const surfaces = new WeakMap();
const to_view = new Matrix4(), of_bone = new Matrix4();

/** What of a geometry stays: its corners, the centre of each triangle, and the bone that moves it most. */
function surface_of(geometry, {position, skinIndex, skinWeight}) {
  const {index} = geometry, count = index ? index.count : position.count;
  const corners = Uint32Array.from({length: count - count % 3}, (_, i) => index ? index.getX(i) : i), n = corners.length / 3;
  const centres = new Float32Array(3 * n), bones = skinIndex ? new Uint16Array(n) : null;
  for (let t = 0; t < n; ++t) {
    for (let axis = 0; axis < 3; ++axis)
      for (let k = 0; k < 3; ++k) centres[3 * t + axis] += position.getComponent(corners[3 * t + k], axis) / 3;
    if (!bones) continue;
    const vertex = corners[3 * t], weights = [0, 1, 2, 3].map((k) => skinWeight.getComponent(vertex, k));
    bones[t] = skinIndex.getComponent(vertex, weights.indexOf(Math.max(...weights)));
  }
  // An index of its own: others may share the one that it has.
  geometry.setIndex(new BufferAttribute(corners.slice(), 1));
  return {position, version: position.version, corners, centres, bones, depths: new Float32Array(n), last: ''};
}

/** The rows of matrices from the geometry to the depth before a camera, one a bone, or one. */
function depth_rows(object, camera) {
  to_view.multiplyMatrices(camera.matrixWorldInverse, object.matrixWorld);
  const row_of = ({elements}) => [elements[2], elements[6], elements[10], elements[14]];
  if (!object.isSkinnedMesh) return [row_of(to_view)];
  to_view.multiply(object.bindMatrixInverse);
  return object.skeleton.bones.map((_, i) => {
    of_bone.fromArray(object.skeleton.boneMatrices, 16 * i).premultiply(to_view).multiply(object.bindMatrix);
    return row_of(of_bone);
  });
}

/**
 * Sorts the triangles of an object as a camera sees them; whether it could. Morphed surfaces are sorted as if they were at
 * rest, and instances and groups of triangles are not sorted.
 */
export function sort_triangles(object, geometry, camera) {
  const {position} = geometry.attributes;
  if (object.isInstancedMesh || object.isBatchedMesh || geometry.groups.length > 0 || geometry.drawRange.count !== Infinity)
    return false;
  let surface = surfaces.get(geometry);
  if (surface?.position !== position || surface.version !== position.version)
    surfaces.set(geometry, surface = surface_of(geometry, geometry.attributes));
  const {corners, centres, bones, depths} = surface, rows = depth_rows(object, camera), now = rows.join();
  if (now === surface.last) return true;
  surface.last = now;
  let least = Infinity, most = -Infinity;
  for (let t = 0; t < depths.length; ++t) {
    const [x, y, z, one] = rows[bones ? bones[t] : 0];
    depths[t] = x * centres[3 * t] + y * centres[3 * t + 1] + z * centres[3 * t + 2] + one;
    least = Math.min(least, depths[t]);
    most = Math.max(most, depths[t]);
  }
  const scale = most > least ? (PLACES - 1) / (most - least) : 0, next = new Uint32Array(PLACES + 1);
  const place_of = (t) => Math.floor((depths[t] - least) * scale);
  for (let t = 0; t < depths.length; ++t) ++next[place_of(t) + 1];
  for (let place = 0; place < PLACES; ++place) next[place + 1] += next[place];
  const {array} = geometry.index;
  for (let t = 0; t < depths.length; ++t) {
    const at = 3 * next[place_of(t)]++;
    for (let k = 0; k < 3; ++k) array[at + k] = corners[3 * t + k];
  }
  geometry.index.needsUpdate = true;
  return true;
}

// Sorts the triangles of surfaces with holes from far to near, so that any number of their layers shows through them.
import {BufferAttribute, Matrix4, Vector3, Vector4} from 'three';

/** Places that the depths of a surface are sorted into. */
const PLACES = 2 ** 16;
/** Depths that surfaces beside each other are drawn in turns for. */
const SLABS = 32;
/** The group of triangles of a surface that was drawn with another one. */
export const DRAWN = {start: 0, count: 0};
const surfaces = new WeakMap();
const to_view = new Matrix4(), of_bone = new Matrix4(), place = new Vector4(), origin = new Vector3();

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
  return {position, version: position.version, corners, centres, bones, depths: new Float32Array(n), ends: new Uint32Array(PLACES + 1), last: ''};
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
  const {corners, centres, bones, depths, ends} = surface, rows = depth_rows(object, camera), now = rows.join();
  if (now === surface.last) return true;
  surface.last = now;
  let least = Infinity, most = -Infinity;
  for (let t = 0; t < depths.length; ++t) {
    const [x, y, z, one] = rows[bones ? bones[t] : 0];
    depths[t] = x * centres[3 * t] + y * centres[3 * t + 1] + z * centres[3 * t + 2] + one;
    least = Math.min(least, depths[t]);
    most = Math.max(most, depths[t]);
  }
  const scale = most > least ? (PLACES - 1) / (most - least) : 0;
  const place_of = (t) => Math.floor((depths[t] - least) * scale);
  Object.assign(surface, {least, most, scale});
  ends.fill(0);
  for (let t = 0; t < depths.length; ++t) ++ends[place_of(t) + 1];
  for (let i = 0; i < PLACES; ++i) ends[i + 1] += ends[i];
  const {array} = geometry.index;
  for (let t = 0; t < depths.length; ++t) {
    const at = 3 * ends[place_of(t)]++;
    for (let k = 0; k < 3; ++k) array[at + k] = corners[3 * t + k];
  }
  geometry.index.needsUpdate = true;
  return true;
}

/** How many of the triangles of a sorted surface lie beyond a depth. */
function beyond({least, most, scale, ends, depths}, depth) {
  if (depth > most) return depths.length;
  const i = Math.floor((depth - least) * scale);
  return i > 0 ? ends[i - 1] : 0;
}

/** What three.js draws in this frame from an object on without anything between that is no fabric. */
function run_from(renderer, scene, camera, object, material) {
  const {center} = object.boundingSphere ?? object.geometry.boundingSphere ?? {center: origin};
  place.set(...center, 1).applyMatrix4(object.matrixWorld).applyMatrix4(to_view.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse));
  const z = camera.reversedDepth ? -place.z : place.z;
  // Mirrors are drawn while their scene is; by its depth, a list is of this camera.
  for (const list of [0, 1].map((depth) => renderer.renderLists.get(scene, depth).transparent)) {
    const first = list.findIndex((item) => item.object === object && item.material === material && item.z === z);
    if (first < 0) continue;
    const is_along = ({material: {shows, transparent}, groupOrder, renderOrder, group}) => shows === 'fabric' && transparent &&
        !group && groupOrder === list[first].groupOrder && renderOrder === list[first].renderOrder;
    let last = first;
    while (last < list.length && is_along(list[last])) ++last;
    return list.slice(first, last);
  }
  return [];
}

/** The geometry of a run's first surface, which three.js would draw again: it has chosen its group before. */
let drawn_first = null;
export function go_on_drawing() {
  drawn_first?.setDrawRange(0, Infinity);
  drawn_first = null;
}

/** Draws sorted surfaces that follow one another in a frame by depth; three.js then finds them DRAWN. */
export function draw_sorted(renderer, scene, camera, object, material) {
  const items = run_from(renderer, scene, camera, object, material);
  if (items.length < 2) return;
  const sorted = items.filter(({object, geometry, material}, i) => {
    if (i > 0) material.prepare(renderer, scene, camera, geometry, object);
    return material.shows === 'fabric' && material.forceSinglePass;
  });
  if (sorted.length < 2) return;
  for (const {object} of sorted) {
    object.modelViewMatrix.multiplyMatrices(camera.matrixWorldInverse, object.matrixWorld);
    object.normalMatrix.getNormalMatrix(object.modelViewMatrix);
  }
  const all = sorted.map(({geometry}) => surfaces.get(geometry)), drawn = all.map(() => 0);
  const least = Math.min(...all.map((surface) => surface.least)), most = Math.max(...all.map((surface) => surface.most));
  for (let slab = 1; slab <= SLABS; ++slab) {
    sorted.forEach(({object, geometry, material}, i) => {
      const end = slab === SLABS ? all[i].depths.length : beyond(all[i], least + (most - least) * slab / SLABS);
      if (end > drawn[i])
        renderer.renderBufferDirect(camera, scene, geometry, material, object, {start: 3 * drawn[i], count: 3 * (end - drawn[i])});
      drawn[i] = Math.max(drawn[i], end);
    });
  }
  for (const item of sorted) item.group = DRAWN;
  drawn_first = sorted[0].geometry;
  drawn_first.setDrawRange(0, 0);
}

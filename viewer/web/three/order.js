// Sorts the triangles of surfaces with holes from far to near, so that any number of their layers shows through them; of others from
// near to far, so that few are shaded that others hide.
import {BufferAttribute, DynamicDrawUsage, Frustum, Matrix4, Vector3, Vector4} from 'three';

/** Places that the depths of a surface are sorted into. */
const PLACES = 2 ** 12;
/** Triangles that stay together, each with a vertex of one before it: vertices that they share are shaded once. */
const CLUSTER = 8;
/** Cosine of the turn of a view after which what has no holes is sorted again. */
const TURNED = 0.8;
/** Depths that surfaces beside each other are drawn in turns for. */
const SLABS = 32;
/** The group of triangles of a surface that was drawn with another one. */
export const ALREADY_DRAWN = {start: 0, count: 0};
const surfaces = new WeakMap();
const to_view = new Matrix4(), to_clip = new Matrix4(), of_bone = new Matrix4(), place = new Vector4(), corner = new Vector3(), origin = new Vector3();
const frustum = new Frustum();

/** What of a geometry stays while it is `made_of` the same: the corners of its clusters, a sphere around each, and the bone that moves it most. */
function surface_of({index, attributes: {position, skinIndex, skinWeight}}, made_of) {
  const count = index ? index.count : position.count, triangles = Math.floor(count / 3), firsts = [];
  const corners = Uint32Array.from({length: 3 * triangles}, (_, i) => index ? index.getX(i) : i);
  for (let at = 0, first = 0; at < corners.length; at += 3) {
    let joins = false;
    for (let i = first; i < at && at < first + 3 * CLUSTER && !joins; ++i)
      joins = corners[i] === corners[at] || corners[i] === corners[at + 1] || corners[i] === corners[at + 2];
    if (!joins) firsts.push(first = at);
  }
  const n = firsts.length, spheres = new Float32Array(4 * n), bones = skinIndex ? new Uint16Array(n) : null;
  firsts.push(corners.length);
  for (let c = 0; c < n; ++c) {
    const all = corners.subarray(firsts[c], firsts[c + 1]), sum = new Vector3();
    for (const vertex of all) sum.add(corner.fromBufferAttribute(position, vertex));
    sum.divideScalar(all.length).toArray(spheres, 4 * c);
    for (const vertex of all)
      spheres[4 * c + 3] = Math.max(spheres[4 * c + 3], sum.distanceTo(corner.fromBufferAttribute(position, vertex)));
    if (!bones) continue;
    const weights = [0, 1, 2, 3].map((k) => skinWeight.getComponent(all[0], k));
    bones[c] = skinIndex.getComponent(all[0], weights.indexOf(Math.max(...weights)));
  }
  const sorted = new BufferAttribute(new (position.count < 2 ** 16 - 1 ? Uint16Array : Uint32Array)(corners.length), 1);
  return {
    made_of, corners, firsts: Uint32Array.from(firsts), spheres, bones, sorted: sorted.setUsage(DynamicDrawUsage),
    seen: new Uint32Array(n), depths: new Float32Array(n), ends: new Uint32Array(PLACES + 1), last: origin, count: 0
  };
}

/** The rows of matrices from the geometry to the depth before a camera, one a bone, or one. */
function depth_rows(object, camera) {
  to_view.multiplyMatrices(camera.matrixWorldInverse, object.matrixWorld);
  to_clip.multiplyMatrices(camera.projectionMatrix, to_view);
  const row_of = ({elements}) => [elements[2], elements[6], elements[10], elements[14]];
  if (!object.isSkinnedMesh) return [row_of(to_view)];
  to_view.multiply(object.bindMatrixInverse);
  return object.skeleton.bones.map((_, i) => {
    of_bone.fromArray(object.skeleton.boneMatrices, 16 * i).premultiply(to_view).multiply(object.bindMatrix);
    return row_of(of_bone);
  });
}

/**
 * Sorts the triangles of an object that a camera sees; whether it could. Morphed surfaces are sorted as if they were at rest, and
 * instances and groups of triangles are not sorted.
 */
export function sort_triangles(object, geometry, camera, {displacementMap, transparent}) {
  const {index, attributes: {position}, groups, drawRange: {start, count}} = geometry;
  if (object.isInstancedMesh || object.isBatchedMesh || groups.length > 0 || start > 0 || count !== Infinity) return false;
  const made_of = [position, index, index?.version, transparent && position.version];
  let surface = surfaces.get(geometry);
  if (made_of.some((part, i) => part !== surface?.made_of[i])) surfaces.set(geometry, surface = surface_of(geometry, made_of));
  const {corners, firsts, spheres, bones, sorted, seen, depths, ends} = surface, rows = depth_rows(object, camera), to = sorted.array;
  // Without holes any order shows the same: another one where the view, of skins their first bone, has turned far.
  const now = transparent ? `${rows} ${to_clip.elements}` : new Vector3(...rows[0]).normalize();
  if (transparent ? now === surface.last : now.dot(surface.last) > TURNED) return true;
  surface.last = now;
  // Where other shapes than the geometry's are drawn, all are.
  const is_still = transparent && !object.isSkinnedMesh && !object.morphTargetInfluences?.length && !displacementMap;
  const planes = is_still ? frustum.setFromProjectionMatrix(to_clip, camera.coordinateSystem, camera.reversedDepth).planes : [];
  let n = 0, least = Infinity, most = -Infinity;
  for (let c = 0; c < firsts.length - 1; ++c) {
    const px = spheres[4 * c], py = spheres[4 * c + 1], pz = spheres[4 * c + 2], radius = spheres[4 * c + 3];
    if (planes.some(({normal: {x, y, z}, constant}) => x * px + y * py + z * pz + constant < -radius)) continue;
    const row = rows[bones ? bones[c] : 0];
    depths[n] = row[0] * px + row[1] * py + row[2] * pz + row[3];
    least = Math.min(least, depths[n]);
    most = Math.max(most, depths[n]);
    seen[n++] = c;
  }
  const scale = most > least ? (PLACES - 1) / (most - least) : 0, place_of = (i) => Math.floor((transparent ? depths[i] - least : most - depths[i]) * scale);
  ends.fill(0);
  for (let i = 0; i < n; ++i) ends[place_of(i) + 1] += firsts[seen[i] + 1] - firsts[seen[i]];
  for (let i = 0; i < PLACES; ++i) ends[i + 1] += ends[i];
  for (let i = 0; i < n; ++i) {
    const place = place_of(i), end = firsts[seen[i] + 1];
    for (let from = firsts[seen[i]]; from < end; ++from) to[ends[place]++] = corners[from];
  }
  Object.assign(surface, {least, most, scale, count: ends[PLACES]});
  sorted.clearUpdateRanges();
  sorted.addUpdateRange(0, surface.count);
  sorted.needsUpdate = true;
  return true;
}

/** How many corners of a sorted surface lie beyond a depth. */
function beyond({least, most, scale, ends, count}, depth) {
  if (depth > most) return count;
  const i = Math.floor((depth - least) * scale);
  return i > 0 ? ends[i - 1] : 0;
}

/** What three.js draws in this frame from an object on without anything between that is no fabric. */
function run_from(renderer, scene, camera, object, material) {
  const {center} = object.boundingSphere ?? object.geometry.boundingSphere ?? {center: origin};
  place.set(...center, 1).applyMatrix4(object.matrixWorld).applyMatrix4(to_view.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse));
  const z = camera.reversedDepth ? -place.z : place.z;
  // Before 0.168 depths are divided by w.
  const divided = corner.copy(center).applyMatrix4(object.matrixWorld).applyMatrix4(to_view).z;
  // Mirrors are drawn while their scene is; by its depth, a list is of this camera.
  for (const list of [0, 1].map((depth) => renderer.renderLists.get(scene, depth).transparent)) {
    const first = list.findIndex((item) => item.object === object && item.material === material && (item.z === z || item.z === divided));
    if (first < 0) continue;
    const is_along = ({material: {shows, transparent}, groupOrder, renderOrder, group}) => shows === 'fabric' && transparent &&
        !group && groupOrder === list[first].groupOrder && renderOrder === list[first].renderOrder;
    let last = first;
    while (last < list.length && is_along(list[last])) ++last;
    return list.slice(first, last);
  }
  return [];
}

/** Lets three.js draw `count` sorted corners of an object, and gives it its own ones back then. */
export function draw_once(object, geometry, count) {
  const {index} = geometry, {onAfterRender} = object;
  geometry.index = surfaces.get(geometry).sorted;
  geometry.setDrawRange(0, count);
  object.onAfterRender = (...of_three) => {
    geometry.index = index;
    geometry.setDrawRange(0, Infinity);
    object.onAfterRender = onAfterRender;
    object.onAfterRender(...of_three);
  };
}

/** Draws sorted surfaces that follow one another in a frame by depth; three.js then finds the others ALREADY_DRAWN. */
export function draw_sorted(renderer, scene, camera, object, geometry, material) {
  const {count} = surfaces.get(geometry), items = count > 0 ? run_from(renderer, scene, camera, object, material) : [];
  const run = items.filter(({object, geometry, material}, i) => {
    if (i > 0) material.prepare(renderer, scene, camera, geometry, object);
    return material.shows === 'fabric' && material.forceSinglePass && surfaces.get(geometry).count > 0;
  });
  if (run.length < 2) return draw_once(object, geometry, count);
  const all = run.map(({geometry}) => surfaces.get(geometry)), drawn = all.map(() => 0);
  for (const {object, geometry} of run) {
    object.modelViewMatrix.multiplyMatrices(camera.matrixWorldInverse, object.matrixWorld);
    object.normalMatrix.getNormalMatrix(object.modelViewMatrix);
    draw_once(object, geometry, Infinity);
  }
  const least = Math.min(...all.map((surface) => surface.least)), most = Math.max(...all.map((surface) => surface.most));
  for (let slab = 1; slab <= SLABS; ++slab) {
    run.forEach(({object, geometry, material}, i) => {
      const end = slab === SLABS ? all[i].count : beyond(all[i], least + (most - least) * slab / SLABS);
      if (end > drawn[i])
        renderer.renderBufferDirect(camera, scene, geometry, material, object, {start: drawn[i], count: end - drawn[i]});
      drawn[i] = Math.max(drawn[i], end);
    });
  }
  for (const item of run) item.group = ALREADY_DRAWN;
  geometry.setDrawRange(0, 0);
}

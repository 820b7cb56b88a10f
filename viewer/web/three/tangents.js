// Tangents along growing u, for the frame of a fabric: vertices with the same position, normal and coordinates share one,
// the mean over their triangles by angle (format/scene/tangents.h). Where mirrored and other triangles meet in a vertex,
// and where nothing else is known, it is zero, and the shader takes the tangent of the triangle.
import {BufferAttribute} from 'three';

const names = new Map();

/** The attribute of a lay: materials with different ones can share a geometry. */
export function tangents_name({uv_set, rotation, scale}) {
  const lay = [uv_set, rotation, ...scale].join();
  if (!names.has(lay)) names.set(lay, `fabric_tangent_${names.size}`);
  return names.get(lay);
}

/** Adds the attribute of a lay to a geometry with positions, normals and the coordinates of the lay. */
export function add_tangents(geometry, {uv_set, rotation, scale}) {
  const name = tangents_name({uv_set, rotation, scale});
  const {position, normal} = geometry.attributes, uv = geometry.attributes[uv_set === 1 ? 'uv1' : 'uv'];
  if (!position || !normal || !uv || geometry.attributes[name]) return;
  const count = position.count, c = Math.cos(rotation), s = Math.sin(rotation);
  const joined = new Map(), first = new Uint32Array(count), key = [];
  for (let i = 0; i < count; ++i) {
    for (const attribute of [position, normal, uv])
      for (let k = 0; k < attribute.itemSize; ++k) key.push(attribute.getComponent(i, k));
    const vertex = key.join(' ');
    key.length = 0;
    if (!joined.has(vertex)) joined.set(vertex, i);
    first[i] = joined.get(vertex);
  }
  const sums = new Float64Array(3 * count), signs = new Int8Array(count), mixed = new Uint8Array(count);
  const at = (attribute, i) => [attribute.getX(i), attribute.getY(i), attribute.getZ(i)];
  const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const flattened = (a, n) => {
    const along = dot(a, n), flat = a.map((x, k) => x - n[k] * along), length = Math.hypot(...flat);
    return length > 0 ? flat.map((x) => x / length) : [0, 0, 0];
  };
  const corners = geometry.index ? geometry.index.count : count;
  const corner = (i) => geometry.index ? geometry.index.getX(i) : i;
  for (let t = 0; t + 2 < corners; t += 3) {
    const v = [corner(t), corner(t + 1), corner(t + 2)], p = v.map((i) => at(position, i));
    const [a, b, d] = v.map((i) => {
      const x = scale[0] * uv.getX(i), y = scale[1] * uv.getY(i);
      return [c * x + s * y, c * y - s * x];
    });
    const d1 = [b[0] - a[0], b[1] - a[1]], d2 = [d[0] - a[0], d[1] - a[1]], area = d1[0] * d2[1] - d1[1] * d2[0];
    if (area === 0 || !Number.isFinite(area)) continue;
    const e1 = minus(p[1], p[0]), e2 = minus(p[2], p[0]), sign = Math.sign(area);
    const du = [0, 1, 2].map((k) => (e1[k] * d2[1] - e2[k] * d1[1]) * sign);
    for (let k = 0; k < 3; ++k) {
      const n = at(normal, v[k]), i = first[v[k]];
      const angle = Math.acos(Math.min(Math.max(
        dot(flattened(minus(p[(k + 1) % 3], p[k]), n), flattened(minus(p[(k + 2) % 3], p[k]), n)), -1), 1));
      flattened(du, n).forEach((x, axis) => {
        sums[3 * i + axis] += x * angle;
      });
      if (signs[i] === -sign) mixed[i] = 1;
      signs[i] = sign;
    }
  }
  const tangents = new Float32Array(3 * count);
  for (let i = 0; i < count; ++i) {
    const j = first[i], sum = [sums[3 * j], sums[3 * j + 1], sums[3 * j + 2]], length = Math.hypot(...sum);
    if (!mixed[j] && length > 1e-9) tangents.set(sum.map((x) => x / length), 3 * i);
  }
  geometry.setAttribute(name, new BufferAttribute(tangents, 3));
}

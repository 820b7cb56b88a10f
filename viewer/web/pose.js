// Poses a mesh as three.js's shaders do: by morph targets, then by bones.
/**
 * Six numbers a vertex, its position and normal, of `vertices` with eight each. `of_mesh`: { targets, is_relative, joints, weights },
 * `targets` of positions and of normals, joints and weights four of each vertex or null; `influences` of targets; `bones`: twelve
 * numbers each, the first three rows of a matrix.
 */
export function posed(vertices, {targets, is_relative, joints, weights}, influences, bones) {
  const count = vertices.length / 8, shape = new Float32Array(6 * count), sum = influences.reduce((a, b) => a + b, 0);
  targets.forEach((all, k) => {
    const rest = is_relative || all.length === 0 ? 1 : 1 - sum;
    for (let i = 0; i < count; ++i)
      for (let c = 0; c < 3; ++c) shape[6 * i + 3 * k + c] = rest * vertices[8 * i + 3 * k + c];
    for (const [t, target] of all.entries()) {
      const influence = influences[t] ?? 0;
      if (influence === 0) continue;
      for (let i = 0; i < count; ++i)
        for (let c = 0; c < 3; ++c) shape[6 * i + 3 * k + c] += influence * target[3 * i + c];
    }
  });
  const m = new Float64Array(12);
  for (let i = 0; joints && i < count; ++i) {
    m.fill(0);
    for (let j = 4 * i; j < 4 * i + 4; ++j)
      for (let e = 0; weights[j] !== 0 && e < 12; ++e) m[e] += weights[j] * bones[12 * joints[j] + e];
    for (const [at, one] of [[6 * i, 1], [6 * i + 3, 0]]) {
      const x = shape[at], y = shape[at + 1], z = shape[at + 2];
      for (let r = 0; r < 3; ++r) shape[at + r] = m[4 * r] * x + m[4 * r + 1] * y + m[4 * r + 2] * z + one * m[4 * r + 3];
    }
  }
  return shape;
}

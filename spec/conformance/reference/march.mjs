// The march of a ray through the slabs of a level with heights (spec/brdf.md, Heights).

/** Cells that a ray visits at most. */
export const MOST_CELLS = 16384;
/** The least z of a view, as far as the march goes. */
export const LEAST_Z = 1 / 32;

const {abs, floor, max, min} = Math;
const repeated = (cell, n) => ((cell % n) + n) % n;

/**
 * What all rays of a level have in common: the number of cells along both axes, the entries of a cell
 * [{ top, bottom, texel, entry }], those without yarn left out, and the heights between which there is yarn.
 */
export function slabs_of(level) {
  const {width, height, heights: {columns, rows, slabs, ends}} = level;
  let highest = -Infinity, lowest = Infinity;
  const entries_at = (i, j) => {
    const texel = floor(j / rows) * width + floor(i / columns);
    const found = [];
    for (let slab = 0; slab < slabs; ++slab) {
      const entry = (slab * rows + j % rows) * columns + i % columns;
      const [top, bottom] = ends(texel, entry);
      if (top > bottom) found.push({top, bottom, texel, entry});
    }
    return found;
  };
  const cells = [width * columns, height * rows];
  const all =
    Array.from({length: cells[0] * cells[1]}, (_, n) => entries_at(n % cells[0], floor(n / cells[0])));
  for (const {top, bottom} of all.flat()) {
    highest = max(highest, top);
    lowest = min(lowest, bottom);
  }
  return {
    cells,
    highest,
    lowest,
    entries: (i, j) => all[repeated(j, cells[1]) * cells[0] + repeated(i, cells[0])]
  };
}

/** The cells that a ray moves on for each mm upwards, along both axes. */
export function slope_of({heights: {mmPerRepeat}}, cells, view) {
  const z = max(view[2], LEAST_Z);
  return [view[0] / (z * mmPerRepeat[0]) * cells[0], -view[1] / (z * mmPerRepeat[1]) * cells[1]];
}

/** { texel, entry } that the ray towards `view` meets which passes the reference plane at (u, v), or null. */
export function march(level, [u, v], view) {
  level.slabs ??= slabs_of(level);
  const {cells, highest, lowest, entries} = level.slabs;
  const plane = level.heights.referenceHeight;
  const slope = slope_of(level, cells, view);
  const at_plane = [u * cells[0], v * cells[1]];
  const cell = at_plane.map((x, axis) => floor(x + (highest - plane) * slope[axis]));
  /** The height at which the ray, on its way down, leaves the cell along an axis. */
  const leaves = (axis) => {
    if (slope[axis] === 0) return -Infinity;
    const edge = cell[axis] + (slope[axis] > 0 ? 0 : 1);
    return plane + (edge - at_plane[axis]) / slope[axis];
  };
  let h_in = highest;
  for (let visited = 0; visited < MOST_CELLS && h_in > lowest; ++visited) {
    const next = [leaves(0), leaves(1)];
    const axis = next[0] >= next[1] ? 0 : 1;
    const h_out = max(next[axis], lowest);
    let hit = null;
    for (const yarn of entries(...cell)) {
      if (h_out > yarn.top || h_in < yarn.bottom) continue;
      if (!hit || min(yarn.top, h_in) > min(hit.top, h_in)) hit = yarn;
    }
    if (hit) return hit;
    if (next[axis] <= lowest) return null;
    h_in = h_out;
    cell[axis] += slope[axis] > 0 ? -1 : 1;
  }
  return null;
}

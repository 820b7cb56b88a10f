// The march of spec/brdf.md once more, with the question whether rounding can decide what the ray meets. All
// edges that the ray crosses are taken together and sorted, instead of walked along one by one.
import {LEAST_Z, MOST_CELLS, slabs_of} from '../reference/march.mjs';

const U = 2 ** -24;
/**
 * How far a crossing stays from where it would be decided otherwise: the rounding of the view to single
 * precision, of which two components count, and as much again; and so much of a cell.
 */
const OF_THE_WAY = 4 * U, OF_A_CELL = 1e-6;

const {abs, floor, max, min, sign} = Math;

/** The way of the ray along one axis: { at: its place in cells at a height, slope: cells per mm upwards }. */
function axis_of(at_plane, plane, slope) {
  const at = (h) => at_plane + (h - plane) * slope;
  /** The height at which it crosses an edge, and how far off that may be. */
  const crossing = (edge) => ({
    h: plane + (edge - at_plane) / slope,
    slack: (OF_THE_WAY * abs(edge - at_plane) + OF_A_CELL) / abs(slope),
  });
  return {at, slope, crossing, slack: (h) => OF_THE_WAY * abs((h - plane) * slope) + OF_A_CELL};
}

/**
 * The cells of a ray from the height `highest` down to `lowest`: [{ cell, h_in, h_out }], or null: unsure.
 */
function cells_of(axes, highest, lowest) {
  const first = axes.map(({at}) => floor(at(highest)));
  for (const {at, slope, slack} of axes) {
    const x = at(highest);
    if (slope !== 0 && abs(x - Math.round(x)) <= slack(highest)) return null;
  }
  const crossings = axes.flatMap(({slope, crossing}, axis) => {
    const found = [];
    for (let n = 0; slope !== 0 && n < MOST_CELLS; ++n) {
      const there = crossing(slope > 0 ? first[axis] - n : first[axis] + 1 + n);
      if (abs(there.h - lowest) <= there.slack) return [null];
      if (there.h < lowest) break;
      found.push({...there, axis, to: first[axis] - sign(slope) * (n + 1)});
    }
    return found;
  });
  if (crossings.includes(null)) return null;
  crossings.sort((a, b) => b.h - a.h);
  const cell = [...first], cells = [];
  let from = {h: highest, slack: 0};
  for (const there of [...crossings, {h: lowest, slack: 0}]) {
    if (cells.length > 0 && from.h - there.h <= from.slack + there.slack) return null;
    cells.push({cell: [...cell], h_in: from, h_out: there});
    if (there.axis !== undefined) cell[there.axis] = there.to;
    from = there;
  }
  return cells.slice(0, MOST_CELLS);
}

/** Whether a height that may be off is sure to lie above or below one that is not. */
const is_sure = ({h, slack}, height) => slack === 0 || abs(h - height) > slack;

/** What the ray meets, { texel, entry } or null, and whether rounding leaves no doubt of it. */
export function sure_march(level, [u, v], view) {
  level.slabs ??= slabs_of(level);
  const {cells: [W, H], highest, lowest, entries} = level.slabs;
  if (!(highest > lowest)) return {hit: null, sure: true};
  const {mmPerRepeat: [P_x, P_y], referenceHeight: plane} = level.heights;
  const z = max(view[2], LEAST_Z);
  const axes =
    [axis_of(u * W, plane, view[0] * W / (z * P_x)), axis_of(v * H, plane, -view[1] * H / (z * P_y))];
  const cells = cells_of(axes, highest, lowest);
  if (!cells) return {hit: null, sure: false};
  for (const {cell, h_in, h_out} of cells) {
    const yarns = entries(...cell);
    if (!yarns.every(({top, bottom}) => is_sure(h_out, top) && is_sure(h_in, bottom)))
      return {hit: null, sure: false};
    const met = yarns.filter(({top, bottom}) => h_out.h <= top && h_in.h >= bottom);
    if (met.length === 0) continue;
    const met_at = ({top}) => min(top, h_in.h);
    const best = max(...met.map(met_at));
    const hit = met.find((yarn) => met_at(yarn) === best);
    return {hit, sure: met.length === 1 || met.every(({top}) => is_sure(h_in, top))};
  }
  return {hit: null, sure: true};
}

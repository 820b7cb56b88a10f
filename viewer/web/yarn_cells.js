// The cells that rays through yarn are marched along: the twin of format/fabric/yarn_cells.cpp, without the room that
// its bundles of rays need.
import {wide} from './reader/sections.js';

const {floor, hypot, max, min, sqrt} = Math;
const MOST_CELLS = 2 ** 20, MOST_IN_A_ROW = 4096;
/** So much is added to what rounding could take away. */
const SPARE = 1.001;

/**
 * Of yarns of yarns_of: { columns, rows, size, cells }. A cell: { low, high, references: [{ segment, start }] }, the start
 * seen from the middle of the cell at height 0; the highest first. Lengths in mm.
 */
export function cells_of({period, segments}) {
  const of_chains = segments.filter(({rank}) => rank === 0);
  const mean = of_chains.reduce((sum, {radius, squeeze}) => sum + sqrt(radius * wide(radius, squeeze)), 0) / of_chains.length;
  const side = max(mean, sqrt(period[0] * period[1] / MOST_CELLS), period[0] / MOST_IN_A_ROW, period[1] / MOST_IN_A_ROW);
  const [columns, rows] = period.map((length) => max(1, floor(length / side)));
  const size = [period[0] / columns, period[1] / rows], half_diagonal = SPARE * hypot(...size) / 2;
  const cells = Array.from({length: columns * rows}, () => ({low: Infinity, high: -Infinity, references: []}));
  segments.forEach(({radius, start, along, reach: widest, rank, squeeze}, segment) => {
    const reach = SPARE * wide(widest, squeeze);
    const [low, high] = [[0, 1].map((axis) => floor((start[axis] + min(0, along[axis]) - reach) / size[axis])),
                         [0, 1].map((axis) => floor((start[axis] + max(0, along[axis]) + reach) / size[axis]))];
    const length2 = along[0] ** 2 + along[1] ** 2;
    const z = [start[2] + min(0, along[2]) - widest, start[2] + max(0, along[2]) + widest];
    // Widths of rays from which on none meets it: hairs that vanish first are the last.
    const lasts = rank > 0 && rank * widest >= radius ? 2 * radius / rank : Infinity;
    for (let y = low[1]; y <= high[1]; ++y) {
      for (let x = low[0]; x <= high[0]; ++x) {
        const middle = [(x + 0.5) * size[0], (y + 0.5) * size[1]], from = middle.map((m, axis) => m - start[axis]);
        const share = length2 > 0 ? min(max((from[0] * along[0] + from[1] * along[1]) / length2, 0), 1) : 0;
        if (hypot(from[0] - along[0] * share, from[1] - along[1] * share) > reach + half_diagonal) continue;
        const cell = cells[(y - floor(y / rows) * rows) * columns + x - floor(x / columns) * columns];
        cell.references.push({segment, start: [-from[0], -from[1], start[2]], height: 2 * start[2] + along[2], lasts});
        cell.low = min(cell.low, z[0]);
        cell.high = max(cell.high, z[1]);
      }
    }
  });
  for (const {references} of cells) references.sort((a, b) => a.lasts === b.lasts ? b.height - a.height : b.lasts - a.lasts);
  return {columns, rows, size, cells};
}

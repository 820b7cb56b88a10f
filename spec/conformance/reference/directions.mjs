// Directions of the hemisphere on the unit square (spec/fabric.md, Layout of directions).

const {PI, abs, atan2, cos, floor, max, min, sin, sqrt} = Math;

/** The direction of a point (s, t) of the unit square. */
export function square_to_direction(s, t) {
  const a = 2 * s - 1, b = 2 * t - 1;
  if (a === 0 && b === 0) return [0, 0, 1];
  const [r, phi] = abs(a) > abs(b) ? [a, PI / 4 * (b / a)] : [b, PI / 2 - PI / 4 * (a / b)];
  const length = r * sqrt(2 - r * r);
  return [length * cos(phi), length * sin(phi), 1 - r * r];
}

/** The point (s, t) of a direction; one below the horizon is taken as if z were 0. */
export function direction_to_square([x, y, below]) {
  const z = max(0, below);
  if (x === 0 && y === 0) return [0.5, 0.5];
  const p = sqrt(x * x + y * y), q = sqrt(p * p + z * z);
  const r = (p / q) / sqrt(1 + z / q);
  let phi = atan2(y, x);
  if (phi < -PI / 4) phi += 2 * PI;
  const quarter = [1, 3, 5].filter((k) => phi >= k * PI / 4).length, c = r * (phi - quarter * PI / 2) / (PI / 4);
  const [a, b] = [[r, c], [-c, r], [-r, -c], [c, -r]][quarter];
  return [(a + 1) / 2, (b + 1) / 2];
}

/** The direction of a cell of a grid. */
export const cell_direction = ({columns, rows}, index) =>
  square_to_direction((index % columns + 0.5) / columns, (floor(index / columns) + 0.5) / rows);

/** A point of the square in units of cells: [0, columns - 1] x [0, rows - 1]; cell centres have whole numbers. */
export const square_to_grid = ({columns, rows}, [s, t]) =>
  [min(max(s * columns - 0.5, 0), columns - 1), min(max(t * rows - 0.5, 0), rows - 1)];

/** The four cells around a point of the grid, and their weights: [[index, weight], ...]. */
export function grid_weights({columns, rows}, [x, y]) {
  const c0 = floor(x), r0 = floor(y), fx = x - c0, fy = y - r0;
  const c1 = min(c0 + 1, columns - 1), r1 = min(r0 + 1, rows - 1);
  return [
    [r0 * columns + c0, (1 - fx) * (1 - fy)],
    [r0 * columns + c1, fx * (1 - fy)],
    [r1 * columns + c0, (1 - fx) * fy],
    [r1 * columns + c1, fx * fy],
  ];
}

// Variation of cloth beyond its repeat (spec/brdf.md, Variation).
import {hash, noise} from './swells.mjs';
import {trace} from './yarns.mjs';

const {abs, floor, log2, max, min, round, sqrt} = Math;
const MOST_REPEATS = 2 ** 30, MM = 8, SIDE = 32, TILE = 64;
const clamp = (x, low, high) => min(max(x, low), high);

const along_v = ({turns: [X, Y]}, [P_x, P_y]) => abs(Y * P_y) > abs(X * P_x);

/** What counts as a repeat, mm: of a map so many stitches. */
const tile_of = ({period, map}) => map ? period.map((mm, axis) => mm * TILE / map.kinds[axis]) : period;

function lengths_of(yarns, axis) {
  const lengths = tile_of(yarns)[axis] / MM;
  return {lengths: clamp(round(lengths), 1, 4096), repeats: 2 ** clamp(round(-log2(lengths)), 0, 12)};
}

/** Rows, lengths and change of the curves along an axis; null: none. */
function runs_of(yarns, axis) {
  const {curves, period, map} = yarns;
  const own = curves.filter((curve) => curve.turns[axis] !== 0 && along_v(curve, period) === (axis === 1));
  if (own.length === 0) return null;
  const across = own[0].points.map((p) => axis === 0 ? -p[1] : p[0]);
  const rows = own.reduce((sum, {turns}) => sum + abs(turns[axis]), 0), middle = across.reduce((sum, x) => sum + x, 0) / across.length;
  return {
    rows: map ? max(1, floor(rows * TILE / map.kinds[1 - axis])) : rows,
    offset: -middle / period[1 - axis] * rows,
    ...lengths_of(yarns, axis),
    change: sqrt(own.reduce((sum, {strands: {change}}) => sum + change * change, 0) / own.length),
  };
}

/** Noise of a lattice between two rows and two lengths. */
function lattice_noise(key, [i, p], [j, s]) {
  const rows = [i, i + 1].map((row) => {
    const bits = hash(key + row | 0);
    return noise_between(s, hash(bits + j | 0), hash(bits + j + 1 | 0));
  });
  const q = p * p * (3 - 2 * p);
  return ((1 - q) * rows[0] + q * rows[1]) / sqrt((1 - q) ** 2 + q * q);
}
const noise_between = (s, a, b) => noise(s, a, b, 0);

const key_of = (yarns, m) => hash(hash(yarns.curves[0].strands.seed) + m | 0);

/** The place among rows across, and lengths along an axis: whole number and rest of both. */
function lattice_place(runs, axis, repeats, within) {
  const split = (first, x) => [first + floor(x) | 0, x - floor(x)];
  const {offset, rows, lengths} = runs;
  const row = split(Math.imul(repeats[1 - axis], rows), within[1 - axis] * rows + offset - floor(offset));
  const of_length = repeats[axis] - floor(repeats[axis] / runs.repeats) * runs.repeats;
  return [row, split(
    Math.imul(floor(repeats[axis] / runs.repeats), lengths), (of_length + within[axis]) * lengths / runs.repeats)];
}

function factor_of(yarns, axis, repeats, within) {
  const runs = runs_of(yarns, axis);
  if (!runs || runs.change === 0) return 1;
  const [row, length] = lattice_place(runs, axis, repeats, within);
  const of_area = ([i, p], size) => [floor(i / size), (i - floor(i / size) * size + p) / size];
  const single = lattice_noise(key_of(yarns, 2 * axis), [row[0], clamp((row[1] - 0.5) / 0.75 + 0.5, 0, 1)], length);
  const area = lattice_noise(key_of(yarns, 2 * axis + 1), of_area(row, 8), of_area(length, 4));
  return clamp(1 + runs.change * (single + 0.25 * area), 0, 2);
}

const tiles_of = (yarns) => tile_of(yarns).map((mm, axis) => yarns.repeat[axis] / mm);
const split_uv = (yarns, uv) => {
  const places = tiles_of(yarns).map((tiles, axis) => uv[axis] * tiles);
  return [places.map((x) => clamp(floor(x), -MOST_REPEATS, MOST_REPEATS)), places.map((x) => x - floor(x))];
};

/** Where the fabric is looked up at (u, v). */
export function place_at(yarns, uv) {
  const [repeats, within] = split_uv(yarns, uv), tile = tile_of(yarns), both = [0, 1].map((axis) => runs_of(yarns, axis));
  return uv.map((x, across) => {
    const axis = 1 - across, own = both[axis], other = both[1 - axis];
    if (!own && !other) return x;
    const wales = {
      ...lengths_of(yarns, axis), offset: 0, change: other?.change,
      rows: clamp(round((other?.rows ?? 0) * tile[1 - axis] / tile[axis]), 1, 4096),
    };
    const runs = own ?? wales;
    return x + min(0.1, 0.5 * runs.change) / runs.rows / tiles_of(yarns)[across] *
      lattice_noise(key_of(yarns, 4 + axis), ...lattice_place(runs, axis, repeats, within));
  });
}

const fractions = new WeakMap();
/** The fraction of curves along v in the cloth seen from above. */
function fraction_along_v(yarns) {
  if (fractions.has(yarns)) return fractions.get(yarns);
  const {curves, period} = yarns;
  const both = [0, 1].every((axis) => runs_of(yarns, axis)), hits = [];
  for (let i = 0; both && i < SIDE * SIDE; ++i) {
    const hit = trace(yarns, [(i % SIDE + 0.5) / SIDE, (floor(i / SIDE) + 0.5) / SIDE], [0, 0, 1]);
    if (hit) hits.push(along_v(hit.segment.curve, period));
  }
  const fraction = hits.length > 0 ? hits.filter((is) => is).length / hits.length : curves.some((c) => along_v(c, period)) ? 1 : 0;
  fractions.set(yarns, fraction);
  return fraction;
}

/** The factor at place_at(), of the curve that is met; without one, of a level of texels. */
export function variation_at(yarns, uv, curve = null) {
  const [repeats, within] = split_uv(yarns, uv);
  const fraction = curve ? (along_v(curve, yarns.period) ? 1 : 0) : fraction_along_v(yarns);
  const [of_u, of_v] = [0, 1].map((axis) => factor_of(yarns, axis, repeats, within));
  return of_u + fraction * (of_v - of_u);
}

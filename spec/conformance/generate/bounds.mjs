// How far single precision may be from the value of spec/brdf.md: the evaluation once more, each number with
// a bound of its error. This is where the tolerances of the vectors come from.
//
// The model of the arithmetic: light, view and level are rounded to single precision first; every operation
// and square root is within 1 unit of rounding U = 2^-24 (relative); logarithm, exponential and arc tangent
// are within 4 U of their result, a power is exp2(n log2(x)). Results below the smallest normal number may
// become 0.
import {direction_to_square, grid_weights, square_to_grid} from '../reference/directions.mjs';
import {LARGEST, interpolated, lobes_of, look_up, texel_at} from '../reference/brdf.mjs';
import {place_at, variation_at} from '../reference/variation.mjs';
import {yarn_changes} from './near_yarns.mjs';

export const U = 2 ** -24;
const SMALLEST = 2 ** -126;
/** Units of rounding in a mean of texels, and what no coefficient of such exceeds. */
const OF_MEANS = 16, LARGEST_COEFFICIENT = 1;

/** A value and a bound of the error of its single-precision twin. */
class Bounded {
  constructor(value, error = 0) {
    this.value = value;
    this.error = error;
  }
}
const exact = (x) => new Bounded(x);
const rounded = (x) => new Bounded(x, U * Math.abs(x));
const add = (a, b) =>
  new Bounded(a.value + b.value, a.error + b.error + U * (Math.abs(a.value + b.value) + a.error + b.error));
const times = (a, b) => {
  const error = Math.abs(a.value) * b.error + Math.abs(b.value) * a.error + a.error * b.error;
  return new Bounded(a.value * b.value, error + U * (Math.abs(a.value * b.value) + error));
};
const minus = (a) => new Bounded(-a.value, a.error);
const divide = (a, b) => {
  if (b.error >= Math.abs(b.value)) return new Bounded(a.value / b.value, Infinity);
  const q = a.value / b.value;
  const error = (a.error + Math.abs(q) * b.error) / (Math.abs(b.value) - b.error);
  return new Bounded(q, error + U * (Math.abs(q) + error));
};
const root = (a) => {
  const value = Math.sqrt(a.value);
  const error = a.value > 0 ? value - Math.sqrt(Math.max(0, a.value - a.error)) : Math.sqrt(a.error);
  return new Bounded(value, error + U * (value + error));
};
const arc = (y, x) => {
  const q = x.value ** 2 + y.value ** 2;
  const value = Math.atan2(y.value, x.value);
  return new Bounded(
    value, (Math.abs(x.value) * y.error + Math.abs(y.value) * x.error) / q + 4 * U * Math.abs(value));
};
const held_above_0 = (a) => a.value > 0 ? a : new Bounded(0, Math.max(0, a.value + a.error));
const dot = (a, b) => add(add(times(a[0], b[0]), times(a[1], b[1])), times(a[2], b[2]));
const cross =
  (a, b) => [[1, 2], [2, 0], [0, 1]].map(([i, j]) => add(times(a[i], b[j]), minus(times(a[j], b[i]))));

/** max(0, x)^n as the lobes have it: 0 for x <= 0. */
function lobe_power(base, n) {
  const top = base.value + base.error;
  if (base.value <= 0) return new Bounded(0, top > 0 ? top ** n : 0);
  const value = base.value ** n;
  // Where the base may be 0 or below, all of the power may be lost.
  if (base.value <= base.error) return new Bounded(value, Math.max(value, top ** n - value));
  const own = 4 * U + 6 * U * Math.abs(n * Math.log(base.value)) + 2 * U * n;
  const ratio = (top / base.value) ** n * (1 + own) - 1;
  return new Bounded(value, value * Math.max(ratio, own));
}

/** A point of the square and a bound of the error of both its coordinates. */
function bounded_square(view) {
  const [x, y] = view.map(rounded);
  const z = view[2] > 0 ? rounded(view[2]) : exact(0);
  const point = direction_to_square(view);
  if (view[0] === 0 && view[1] === 0) return {point, error: 0};
  const p = root(add(times(x, x), times(y, y))), q = root(add(times(p, p), times(z, z)));
  const r = divide(divide(p, q), root(add(exact(1), divide(z, q))));
  // a or b is r, the other r times (phi - a multiple of pi/2) / (pi/4), whose factor is at most 1.
  const phi = arc(y, x);
  const turn = phi.error + 3 * U * 2 * Math.PI;
  const other = r.error + r.value * (turn / (Math.PI / 4) + 3 * U);
  return {point, error: Math.max(r.error, other) / 2 + 4 * U};
}

/** The point of a grid for a direction, and all the points, with it, between which rounding may bring it. */
function bounded_points(grid, direction) {
  const {point, error} = bounded_square(direction);
  // Both ends of the range, and the cell centre between them, where the interpolation has its kink.
  const near = (x, n) => {
    const centre = (Math.round(x * n - 0.5) + 0.5) / n;
    return [x - error, x + error, ...(Math.abs(x - centre) < error ? [centre] : [])];
  };
  const around = near(point[0], grid.columns)
                   .flatMap((s) => near(point[1], grid.rows).map((t) => square_to_grid(grid, [s, t])));
  return {here: square_to_grid(grid, point), around};
}

/**
 * alpha and T with their bounds: over the box of the points that rounding may give, and the rounding of the
 * sums.
 */
function bounded_look_up(level, texel, {here: point, around}) {
  const here = look_up(level, texel, point);
  let alpha = 0;
  const T = [0, 0, 0];
  for (const other of around) {
    const there = look_up(level, texel, other);
    alpha = Math.max(alpha, Math.abs(there.alpha - here.alpha));
    there.T.forEach((value, c) => { T[c] = Math.max(T[c], Math.abs(value - here.T[c])); });
  }
  return {
    alpha: new Bounded(here.alpha, level.opacity ? alpha + (8 + OF_MEANS * level.means) * U * here.alpha : 0),
    T: here.T.map((value, c) => new Bounded(value, level.table ? T[c] + 18 * U * value : 0)),
  };
}

/** A value given for the cells of a grid, interpolated with the weights alone. */
function bounded_interpolation(grid, {here, around}, value) {
  const result = interpolated(grid, here, value);
  const step = Math.max(...around.map((point) => Math.abs(interpolated(grid, point, value) - result)));
  const size = grid_weights(grid, here).reduce((sum, [k, weight]) => sum + weight * Math.abs(value(k)), 0);
  return new Bounded(result, step + 8 * U * size);
}

/** The sum of some numbers in any order. */
function sum_of(terms) {
  const sum = (number) => terms.reduce((total, term) => total + number(term), 0);
  const size = sum(({value, error}) => Math.abs(value) + error);
  return new Bounded(
    sum(({value}) => value), sum(({error}) => error) + Math.max(0, terms.length - 1) * U * size);
}

/** What is held at the largest number. */
function hold(x) {
  if (!(x.value > LARGEST)) return x;
  // Far above the largest number every rounding of it is held as well.
  return new Bounded(LARGEST, Number.isFinite(x.value) && x.value - x.error <= LARGEST ? Infinity : 0);
}

/** F of formula (3) for one channel. */
function bounded_bracket(level, texel, T, c, of_view, of_light) {
  const {table, light, products, views, lights, means} = level;
  const terms = [];
  if (light) {
    const S = bounded_interpolation(lights, of_light, (k) => light(texel, k)[c]);
    terms.push(times(T, S));
  } else if (table || !products) {
    terms.push(T);
  }
  products?.pairs.forEach(([a, b], m) => {
    const coefficient = new Bounded(products.coefficient(texel, m), OF_MEANS * means * U * LARGEST_COEFFICIENT);
    const phi = a === 0 ? exact(1) : bounded_interpolation(views, of_view, (k) => products.phi(a, k));
    const psi = bounded_interpolation(lights, of_light, (k) => products.psi(b, k)[c]);
    const factor = a === 0 ? coefficient : times(coefficient, phi);
    const term = times(factor, psi);
    // Either product may fall below the smallest number.
    term.error += term.value === 0 && term.error === 0 ? 0 : SMALLEST * (1 + Math.abs(psi.value));
    if (Math.abs(factor.value) > LARGEST) term.error = Infinity;
    terms.push(term);
  });
  if (terms.length === 1 && !products) return hold(terms[0]);
  const sum = sum_of(terms);
  const most = (sign) =>
    terms.reduce((total, {value, error}) => total + Math.max(0, sign * value + error), 0);
  // An overflow on the way must not change what the sum is held at.
  const up = most(1) > LARGEST && !(sum.value - sum.error > LARGEST);
  const down = most(-1) > LARGEST && !(sum.value + sum.error < 0);
  if (up || down || Math.min(most(1), most(-1)) > LARGEST) return new Bounded(0, Infinity);
  return hold(held_above_0(sum));
}

/**
 * { rgb, alpha, powers } of a texel, bounded; `powers` is the largest n * (relative error of the base) met.
 */
export function bounded_texel(level, [i, j], light, view) {
  const texel = j * level.width + i;
  const of_view = bounded_points(level.views, view);
  const {alpha, T} = bounded_look_up(level, texel, of_view);
  if (light[2] <= 0 || view[2] <= 0) return {rgb: [exact(0), exact(0), exact(0)], alpha, powers: 0};
  let l = light.map(rounded), v = view.map(rounded);
  if (level.frame) {
    const {normal, tangent} = level.frame(texel);
    const n = normal.map(exact), t = tangent.map(exact), b = cross(n, t);
    [l, v] = [l, v].map((d) => [dot(d, t), dot(d, b), dot(d, n)]);
  }
  let powers = 0;
  const g = lobes_of(level, texel).map(({rho, lobes}) => {
    if (l[2].value <= 0) return new Bounded(0, l[2].value + l[2].error > 0 ? Infinity : 0);
    let sum = exact(rho);
    for (const {cx, cy, cz, n} of lobes) {
      const products = [cx, cy, cz].map((c, k) => times(times(exact(c), l[k]), v[k]));
      const base = add(add(products[0], products[1]), products[2]);
      const power = lobe_power(base, n);
      if (power.value > 0) powers = Math.max(powers, n * base.error / base.value);
      sum = add(sum, power);
    }
    return times(held_above_0(l[2]), sum);
  });
  const of_light = level.lights && bounded_points(level.lights, light);
  const F = T.map((value, c) => bounded_bracket(level, texel, value, c, of_view, of_light));
  const rgb = g.map((value, c) => {
    const product = hold(times(F[c], hold(value)));
    const f = level.scale === 1 ? product : hold(times(exact(level.scale), product));
    const grown = Math.max(1, F[c].value) * Math.max(1, level.scale);
    return new Bounded(f.value, f.error + (f.value === 0 && f.error === 0 ? 0 : SMALLEST * grown));
  });
  return {rgb, alpha, powers};
}

/** The same of the yarn at (u, v); null where rounding decides what a ray meets. */
function bounded_yarns(yarns, uv, light, view) {
  const changes = yarn_changes(yarns, uv, light, view, U);
  if (!changes) return null;
  const {rgb, alpha, errors, curve} = changes;
  return {rgb: rgb.map((f, c) => new Bounded(f, errors[c])), alpha: exact(alpha), powers: 0, curve};
}

/** The factor of the variation at (u, v): its change where the place within the repeat is rounded. */
function bounded_variation(yarns, uv, curve) {
  const here = variation_at(yarns, uv, curve), step = 16 * U;
  const beside = [[step, 0], [-step, 0], [0, step], [0, -step]];
  const changes = beside.map(([x, y]) => Math.abs(variation_at(yarns, [uv[0] + x, uv[1] + y], curve) - here));
  return new Bounded(here, 2 * Math.max(...changes) + 64 * U);
}

/** The same at (u, v) and a fractional level. */
export function bounded_uv(level, levels, fractional, coordinates, light, view) {
  const L = Math.min(Math.max(fractional, level(0).yarns ? -1 : 0), levels - 1), k = Math.floor(L);
  const {yarns} = level(0), uv = yarns ? place_at(yarns, coordinates) : coordinates;
  const at = (n) => {
    const of = n < 0 ? bounded_yarns(yarns, uv, light, view) :
                       bounded_texel(level(n), texel_at(level(n), uv), light, view);
    if (!of || !yarns) return of;
    const factor = bounded_variation(yarns, uv, of.curve);
    return {...of, rgb: of.rgb.map((f) => times(f, factor))};
  };
  const a = at(k), b = L === k ? a : at(k + 1);
  if (!a || !b) return null;
  if (L === k) return a;
  // The level itself is rounded, unless single precision holds it.
  const s = new Bounded(L - k, Math.fround(L) === L ? 0 : 2 * U * Math.abs(L));
  const rest = add(exact(1), minus(s));
  const fraction_a = times(rest, a.alpha), fraction_b = times(s, b.alpha);
  const alpha = add(fraction_a, fraction_b);
  const rgb = a.rgb.map(
    (value, c) => alpha.value === 0 && alpha.error === 0 ?
      exact(0) :
      divide(add(times(fraction_a, value), times(fraction_b, b.rgb[c])), alpha));
  return {rgb, alpha, powers: Math.max(a.powers, b.powers)};
}

// Light from all around in closed form, and what a fabric shows in it (spec/brdf.md, Environments): integrals by
// Gauss-Legendre over boxes of polar angles about an axis, which are quartered until quarters change nothing.
import {across, cross, dot, plus, times, unit} from './vector.mjs';

const {PI, abs, acos, cos, max, min, sin} = Math;
const UP = [0, 0, 1];
/** Nodes and weights on [0, 1], of four points. */
const GAUSS = [0.8611363115940526, 0.3399810435848563].flatMap((x, i) => {
  const weight = [0.17392742256872693, 0.32607257743127307][i];
  return [[(1 - x) / 2, weight], [(1 + x) / 2, weight]];
});
/** A box is quartered as long as that changes it by so much of the whole, and at most so many times. */
export const FINE = 1.6e-5;
const MOST_QUARTERED = 12;

const radians = (degrees) => degrees * PI / 180;
const sum_of = (lists) => lists.reduce((a, b) => plus(a, b));

/** p of L = a + b p, of a direction's cosine to the axis. */
function pattern({kind, exponent, degrees}, cosine) {
  if (kind === 'cosine') return cosine;
  if (kind === 'lobe') return cosine > 0 ? cosine ** exponent : 0;
  return kind === 'disc' && acos(min(max(cosine, -1), 1)) < radians(degrees) ? 1 : 0;
}

/** L of a unit direction, red, green and blue. */
export function radiance_of(environment, direction) {
  const {kind, a, b, axis} = environment;
  return kind === 'constant' ? a : plus(a, b, pattern(environment, dot(unit(axis), direction)));
}

/** The integral of f(direction), a list of three, over directions of angles [0, end] to an axis. */
function integral(f, axis, end, fine) {
  const u = unit(across(abs(axis[0]) < 0.5 ? [1, 0, 0] : [0, 1, 0], axis)), w = cross(axis, u);
  const rule = ([t0, t1, p0, p1]) => {
    let sum = [0, 0, 0];
    for (const [x, of_x] of GAUSS) {
      const t = t0 + (t1 - t0) * x, ring = times(axis, cos(t));
      for (const [y, of_y] of GAUSS) {
        const p = p0 + (p1 - p0) * y;
        const d = plus(ring, plus(times(u, cos(p)), w, sin(p)), sin(t));
        sum = plus(sum, f(d), of_x * of_y * sin(t));
      }
    }
    return times(sum, (t1 - t0) * (p1 - p0));
  };
  const quarters = ([t0, t1, p0, p1]) => {
    const t = (t0 + t1) / 2, p = (p0 + p1) / 2;
    return [[t0, t, p0, p], [t0, t, p, p1], [t, t1, p0, p], [t, t1, p, p1]].map((box) => ({box, value: rule(box)}));
  };
  const more = (list) => list.flatMap(({box}) => quarters(box));
  const first = more(more(quarters([0, end, 0, 2 * PI])));
  const least = fine * max(...sum_of(first.map(({value}) => value)), 1e-9);
  const refined = ({box, value}, left) => {
    const parts = quarters(box), sum = sum_of(parts.map((part) => part.value));
    if (left === 0 || sum.every((x, c) => abs(x - value[c]) <= least)) return sum;
    return sum_of(parts.map((part) => refined(part, left - 1)));
  };
  return sum_of(first.map((part) => refined(part, MOST_QUARTERED)));
}

/**
 * { rgb, alpha }, rgb being L_o: `at(light)` is f and alpha, f being 0 below the horizon. Without background the
 * environment is behind. `known` keeps the integral of f for other environments of the same place, view and `fine`.
 * `both`: light from below the horizon comes through.
 */
export function shown(
  at, view, environment, background = radiance_of(environment, times(view, -1)), {fine = FINE, known = {}, both = false} = {}) {
  const {kind, a, b, axis, degrees} = environment, {alpha} = at(UP);
  known.even ??= integral((d) => at(d).rgb, UP, both ? PI : PI / 2, fine);
  let light = known.even.map((x, c) => x * a[c]);
  if (kind !== 'constant') {
    const middle = unit(axis), end = {cosine: PI, lobe: PI / 2, disc: radians(degrees)}[kind];
    // A disc ends where its boxes end.
    const fraction = kind === 'disc' ? () => 1 : (d) => pattern(environment, dot(middle, d));
    const shaped = integral((d) => times(at(d).rgb, fraction(d)), middle, end, fine);
    light = light.map((x, c) => x + b[c] * shaped[c]);
  }
  return {rgb: light.map((x, c) => alpha * x + (1 - alpha) * background[c]), alpha};
}

/** A direction of the world in the frame of a fabric, three axes of the world. */
export const in_frame = (frame, d) => frame.map((axis) => dot(axis, d));

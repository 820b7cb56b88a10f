// The reflectance of spec/brdf.md in double precision.
//
// A level, as make_level of level.mjs gives it: { width, height, scale, views, lights, means, lobes, frame, table,
// opacity, light, products, yarns }, a layer being null where the level lacks it, else a function of
// the texel's index:
//   lobes(t)      [{ rho, lobes: [{ cx, cy, cz, n }, ...] } for red, green and blue]
//   frame(t)      { normal, tangent }
//   table(t, k)   [red, green, blue] for the view k
//   opacity(t, k) alpha for the view k
//   light(t, k)   [red, green, blue] for the light k
// or an object:
//   products      { pairs: [[a, b], ...], coefficient(t, m), phi(a, k) of view k,
//                 psi(b, k): [red, green, blue] of light k }
//   yarns         at level 0: see yarns.mjs
import {direction_to_square, grid_weights, square_to_grid} from './directions.mjs';
import {place_at, variation_at} from './variation.mjs';
import {evaluate_yarns} from './yarns.mjs';

/** The largest finite number of single precision. */
export const LARGEST = 3.4028234663852886e38;

const {floor, max, min} = Math;
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** A direction of the fabric frame in the frame of a texel. */
function to_texel({normal, tangent}, d) {
  return [dot(d, tangent), dot(d, cross(normal, tangent)), dot(d, normal)];
}

/** { alpha, T } at a point of the grid of views (spec/brdf.md, step 1). */
export function look_up(level, texel, point) {
  let alpha = 0;
  const sum = [0, 0, 0];
  for (const [k, weight] of grid_weights(level.views, point)) {
    const fraction = weight * (level.opacity ? level.opacity(texel, k) : 1);
    alpha += fraction;
    if (level.table)
      level.table(texel, k).forEach((value, c) => {
        sum[c] += fraction * value;
      });
  }
  const T = level.table ? sum.map((s) => alpha === 0 ? 0 : s / alpha) : [1, 1, 1];
  return {alpha: level.opacity ? min(1, alpha) : 1, T};
}

/** The lobes of each channel; without the layer rho is 1. */
export const lobes_of = (level, texel) => level.lobes?.(texel) ?? Array(3).fill({rho: 1, lobes: []});

/** g of formula (2) for one channel; l and v in the frame of the texel. */
function lobes_times_cosine({rho, lobes}, l, v) {
  if (l[2] <= 0) return 0;
  let sum = rho;
  for (const {cx, cy, cz, n} of lobes) {
    const base = cx * l[0] * v[0] + cy * l[1] * v[1] + cz * l[2] * v[2];
    if (base > 0) sum += base ** n;
  }
  return min(l[2] * sum, LARGEST);
}

/** A value given for the cells of a grid of directions, interpolated at a point of it. */
export function interpolated(grid, point, value) {
  return grid_weights(grid, point).reduce((sum, [k, weight]) => sum + weight * value(k), 0);
}

/** F of formula (3) for one channel of a texel; with T of the view. */
function bracket(level, texel, T, c, view_point, light_point) {
  const {table, light, products, views, lights} = level;
  let sum = table || light || !products ? T : 0;
  if (light) sum *= interpolated(lights, light_point, (k) => light(texel, k)[c]);
  products?.pairs.forEach(([a, b], m) => {
    const phi = a === 0 ? 1 : interpolated(views, view_point, (k) => products.phi(a, k));
    const psi = interpolated(lights, light_point, (k) => products.psi(b, k)[c]);
    sum += products.coefficient(texel, m) * phi * psi;
  });
  return min(max(0, sum), LARGEST);
}

/** A point of the grid for a direction; of no meaning where there is no grid. */
const point_of = (grid, direction) => grid ? square_to_grid(grid, direction_to_square(direction)) : null;

/** { rgb, alpha } of texel (i, j) of a level. */
export function evaluate_texel(level, [i, j], light, view) {
  const texel = j * level.width + i;
  const view_point = point_of(level.views, view), light_point = point_of(level.lights, light);
  const {alpha, T} = look_up(level, texel, view_point);
  if (light[2] <= 0 || view[2] <= 0) return {rgb: [0, 0, 0], alpha};
  const frame = level.frame && level.frame(texel);
  const l = frame ? to_texel(frame, light) : light;
  const v = frame ? to_texel(frame, view) : view;
  const g = lobes_of(level, texel).map((channel) => lobes_times_cosine(channel, l, v));
  const F = T.map((value, c) => bracket(level, texel, value, c, view_point, light_point));
  return {rgb: g.map((value, c) => min(level.scale * min(F[c] * value, LARGEST), LARGEST)), alpha};
}

/** The texel that contains (u, v). */
export function texel_at({width, height}, [u, v]) {
  return [min(floor((u - floor(u)) * width), width - 1), min(floor((v - floor(v)) * height), height - 1)];
}

/** { rgb, alpha } at (u, v) and a fractional level; level(k) gives level k of `levels`, from 0 up. */
export function evaluate_uv(level, levels, fractional, coordinates, light, view) {
  const L = min(max(fractional, fractional < 0 && level(0).yarns ? -1 : 0), levels - 1);
  const s = L - floor(L);
  const {yarns} = level(0), uv = yarns ? place_at(yarns, coordinates) : coordinates;
  const at = (k) => {
    const {rgb, alpha, hit} = k < 0 ? evaluate_yarns(yarns, uv, light, view) :
                                      evaluate_texel(level(k), texel_at(level(k), uv), light, view);
    const factor = yarns ? variation_at(yarns, uv, hit?.segment.curve) : 1;
    return {rgb: rgb.map((f) => f * factor), alpha};
  };
  const a = at(floor(L));
  if (s === 0) return a;
  const b = at(floor(L) + 1);
  const alpha = (1 - s) * a.alpha + s * b.alpha;
  const blend = (c) => ((1 - s) * a.alpha * a.rgb[c] + s * b.alpha * b.rgb[c]) / alpha;
  return {rgb: [0, 1, 2].map((c) => alpha === 0 ? 0 : blend(c)), alpha};
}

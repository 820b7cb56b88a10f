// Evaluates the yarn itself (spec/brdf.md, Yarn), the result of yarns_of.
import {strand_at} from './strands.mjs';
import {across, cross, dot, minus, plus, squeezed, stretched, times, unit, wide} from './vector.mjs';

const {abs, ceil, floor, hypot, max, min, sqrt, PI} = Math;
const LEAST_Z = 1 / 32, MOST_RADII = 2 ** 13, LEAST_FACING = 0.01, LEAST_WIDTH = 0.01, OFF_THE_YARN = 1 / 64;

const lifted = ([x, y, z]) => unit([x, y, max(z, LEAST_Z)]);

/**
 * How far along a ray from o, given from the segment's start, it enters the segment's side or the ball about its
 * start; Infinity if neither. The ball about its end is the next segment's.
 */
function entry({round, length, radius, ball: about, squeeze}, from, way) {
  const o = squeezed(from, squeeze), to = squeezed(way, squeeze), size = hypot(...to), d = times(to, 1 / size);
  const off = across(o, d), under = about ** 2 - dot(off, off);
  const ball = under < 0 ? Infinity : -dot(o, d) - sqrt(under);
  const axis = times(round, 1 / length), m = across(o, axis), e = across(d, axis), a = dot(e, e);
  let side = Infinity;
  const D = dot(m, e) ** 2 - a * (dot(m, m) - radius ** 2);
  if (a > 1e-24 && D >= 0) {
    const t = (-dot(m, e) - sqrt(D)) / a, at = dot(plus(o, d, t), axis);
    if (at >= 0 && at <= length) side = t;
  }
  return min(side, ball) / size;
}

const modulo = (i, size) => i - floor(i / size) * size;

/** Calls visit(segment, the origin seen from the start of its copy) for every copy that a ray of length `way` may touch. */
function for_each_near({segments, period, map}, o, d, way, visit) {
  const [P_x, P_y] = map ? period.map((mm, axis) => mm / map.kinds[axis]) : period;
  const is_shown = ([column, row], X, Y) =>
    map.shown[modulo(row - Y, map.size[1]) * map.size[0] + modulo(column + X, map.size[0])] ===
      modulo(row, map.kinds[1]) * map.kinds[0] + modulo(column, map.kinds[0]);
  const ends = [0, 1].map((axis) => [o[axis], o[axis] + way * d[axis]]);
  const [[x_0, x_1], [y_0, y_1]] = ends.map(([a, b]) => [min(a, b), max(a, b)]);
  for (const segment of segments) {
    const {start, along, ball, squeeze, stitch} = segment, [x, y, z] = start, [w_x, w_y, w_z] = along, around = wide(ball, squeeze);
    const X_0 = ceil((x_0 - max(x, x + w_x) - around) / P_x), X_1 = floor((x_1 - min(x, x + w_x) + around) / P_x);
    const Y_0 = ceil((y_0 - max(y, y + w_y) - around) / P_y), Y_1 = floor((y_1 - min(y, y + w_y) + around) / P_y);
    if (X_0 > X_1 || Y_0 > Y_1) continue;
    const most = (hypot(w_x, w_y, w_z) / 2 + around) ** 2, c_z = o[2] - z - w_z / 2;
    for (let X = X_0; X <= X_1; ++X) {
      for (let Y = Y_0; Y <= Y_1; ++Y) {
        if (map && !is_shown(stitch, X, Y)) continue;
        const f_x = o[0] - x - X * P_x, f_y = o[1] - y - Y * P_y, c_x = f_x - w_x / 2, c_y = f_y - w_y / 2;
        const forward = c_x * d[0] + c_y * d[1] + c_z * d[2];
        if (c_x * c_x + c_y * c_y + c_z * c_z - forward * forward <= most) visit(segment, [f_x, f_y, o[2] - z]);
      }
    }
  }
}

/** The segment that the ray towards `view` through (u, v) enters first, P from its start, and P; or null. */
export function trace(yarns, [u, v], view) {
  const {repeat, plane, top, bottom, thinnest} = yarns;
  const w = lifted(view), at = [(u - floor(u)) * repeat[0], -(v - floor(v)) * repeat[1], plane];
  const o = plus(at, w, (top - plane) / w[2]), d = times(w, -1);
  let best = min((top - bottom) / w[2], MOST_RADII * thinnest), hit = null;
  for_each_near(yarns, o, d, best, (segment, from) => {
    const t = entry(segment, from, d);
    if (t >= best) return;
    best = t;
    hit = {segment, from_start: plus(from, d, t), point: plus(o, d, t)};
  });
  return hit;
}

/** The surface at a hit: { N, F, cos_a, sin_a, x, b, side }, x in stations. */
export function surface({segment, from_start}) {
  if (segment.rank > 0) {
    const F = segment.tangents[0], [cos_a, sin_a, b] = segment.across[0];
    return {N: unit(across(from_start, F)), F, cos_a, sin_a, x: segment.stations[0], b, side: segment.across[1]};
  }
  const {curve, squeeze, round: along, length, tangents: [t_0, t_1], across: [A_0, A_1], out: [E_0, E_1]} = segment;
  const P = squeezed(from_start, squeeze), [x_0, x_1] = segment.stations, clamp = (x) => min(max(x, -0.25), 1.25);
  const C = (s) => plus(
    times(along, 3 * s * s - 2 * s ** 3), plus(times(t_0, s - 2 * s * s + s ** 3), t_1, s ** 3 - s * s), length);
  const slope = (s) =>
    plus(times(along, 6 * s - 6 * s * s), plus(times(t_0, 1 - 4 * s + 3 * s * s), t_1, 3 * s * s - 2 * s), length);
  const s_0 = clamp(dot(P, along) / length ** 2), way = slope(s_0);
  const s = clamp(s_0 + dot(minus(P, C(s_0)), way) / dot(way, way));
  const T = unit(slope(s)), n = unit(across(minus(P, C(s)), T));
  const A = plus(times(A_0, 1 - s), A_1, s), [c, e] = [dot(n, A), dot(n, cross(T, A))];
  const E = plus(times(E_0, 1 - s), E_1, s), x = x_0 + s * (x_1 - x_0), b = dot(n, E);
  const side = [dot(E, A), dot(E, cross(T, A))];
  const F = unit(stretched(plus(T, cross(T, n), curve.slope), squeeze)), N = unit(squeezed(n, squeeze));
  return {N, F, cos_a: c / hypot(c, e), sin_a: e / hypot(c, e), x: x < 0 ? x + curve.stations : x, b, side};
}

/** Whether yarn hides the light from a point; 'by a tip': only the ball at the end of a segment does, perhaps a hair's. */
function is_hidden(yarns, point, L) {
  let hidden = false, by_tip = false;
  for_each_near(yarns, point, L, max(0, (yarns.top - point[2]) / L[2]), (segment, from) => {
    const {round, length, radius, squeeze} = segment, off = squeezed(from, squeeze);
    const s = min(max(dot(off, round) / length ** 2, 0), 1);
    // The tip of a hair as well, which is no other segment's.
    const tip = {...segment, ball: radius, round: times(round, -1)};
    const is_met = (t) => t >= 0 && t < Infinity;
    by_tip ||= is_met(entry(tip, minus(from, segment.along), L));
    hidden ||= hypot(...plus(off, round, -s)) < radius || is_met(entry(segment, from, L));
  });
  return hidden || (by_tip && 'by a tip');
}

/** D M / (4 N.L N.V) of the fibres: GGX of width `along` along F and 1 along N x F. */
function glossy(N, F, along, L, V) {
  const B = cross(N, F), local = (d) => [dot(d, F), dot(d, B), dot(d, N)];
  const h = local(unit(plus(L, V)));
  const D = 1 / (PI * along * ((h[0] / along) ** 2 + h[1] ** 2 + h[2] ** 2) ** 2);
  const lambda = ([x, y, z]) => (sqrt(1 + ((along * x) ** 2 + y ** 2) / z ** 2) - 1) / 2;
  return D / (1 + lambda(local(L)) + lambda(local(V))) / (4 * dot(N, L) * dot(N, V));
}

/** What white yarn reflects without its gloss: x and y are along the fibre. */
const body = (s, x, y) =>
  (1 - s * s) / (PI * ((1 - s * s) ** 2 + 4 * s * (1 + s * s) * x * y + 4 * s * s * (x * x + y * y)));

/** { rgb, alpha, hit, hidden, strand } at (u, v) of the reference plane, or of a hit; hidden: yarn hides the light. */
export function evaluate_yarns(yarns, uv, light, view, hit = trace(yarns, uv, view)) {
  const dark = {rgb: [0, 0, 0], alpha: hit ? 1 : 0, hit, hidden: false, strand: 0};
  if (!hit || light[2] <= 0 || view[2] <= 0) return dark;
  const {radius, rows, rank} = hit.segment;
  const {albedo, gloss, roughness, lustre, stations, first_station, strands, plies, tangent} = hit.segment.curve;
  if (yarns.dark) return dark;
  const smooth = surface(hit), {cos_a, sin_a, x, b: outward, side} = smooth, L = lifted(light), V = lifted(view);
  // The coefficients of light from below hold direct light as well.
  const hidden = yarns.by_light || is_hidden(yarns, plus(hit.point, smooth.N, OFF_THE_YARN * radius), L);
  const upright = abs(tangent[2]) >= 0.9;
  const own = rank > 0 ? {...strands, count: 0} : strands;
  const {N, F, b, strand} = strand_at(own, {...smooth, angle: [cos_a, sin_a], t: x / stations, upright, rows, plies: plies.count}, V);
  const facing = dot(N, L);
  const V_raised = unit(plus(V, N, max(0, LEAST_FACING - dot(N, V))));
  const [l_x, l_y, l_z] = light;
  const A = [1, cos_a, sin_a, ...plies.sides ? [side[0], side[1]] : [cos_a ** 2 - sin_a ** 2, 2 * cos_a * sin_a]];
  const B = [1, l_x, l_y, l_z, l_x * l_y, l_x * l_z, l_y * l_z, l_x ** 2 - l_y ** 2, 3 * l_z ** 2 - 1];
  const place = floor(x), [here, next] = [place, place + 1].map((s) => first_station + s % stations);
  const mean = (n) => A.reduce((sum, a, j) =>
    sum + a * ((1 - x + place) * yarns.moment(here, n, j) + (x - place) * yarns.moment(next, n, j)), 0);
  // Hairs, and light from below, reflect as matt yarn does.
  const s = rank > 0 || yarns.by_light ? 0 : lustre, y = dot(F, V_raised);
  const by_view = max(0, 1 - 2 * s * y * mean(1) + s * s * (4 * y * y - 1) * mean(2));
  const rgb = albedo.map((colour, c) => {
    let direct = 0, indirect = 0;
    if (facing > 0 && !hidden) {
      const shine = gloss > 0 ? gloss * glossy(N, F, max(LEAST_WIDTH, roughness), L, V_raised) : 0;
      direct = min(1, 32 * l_z) * facing * ((1 - gloss) * min(1, b * colour) * body(lustre, dot(F, L), dot(F, V_raised)) + shine);
    }
    A.forEach((a, j) => B.forEach((of_light, k) => {
      indirect += a * of_light * ((1 - x + place) * yarns.light(here, j, k, c) + (x - place) * yarns.light(next, j, k, c));
    }));
    return direct + b * by_view * max(0, l_z * indirect * (1 + plies.groove[c] * outward));
  });
  return {...dark, rgb, hidden, strand};
}

// Queries of the yarn itself, and how far single precision may be from the answer: the evaluation once more
// beside the point, the light and the view.
import {evaluate_yarns, trace} from '../reference/yarns.mjs';
import {random, random_direction, unit} from './random.mjs';

const AROUND = [[1, 0], [-1, 0], [0, 1], [0, -1], [0.7, 0.7], [-0.7, 0.7], [0.7, -0.7], [-0.7, -0.7]];
/**
 * Rays that pass so far beside the point, in radii along the plane, meet the same segment and the same shadow; so do
 * those whose light or view is turned by so much. Across the least rise of a ray that is 3 * 10^-5 radii.
 */
const BESIDE = 1e-3, TURN = 1e-4;
/** Units of rounding in the place of a point, of its way and of the repeat; in light and view; in f. */
const OF_PLACE = 16, OF_DIRECTION = 4, OF_F = 64, OF_TERMS = 8;

/** Terms of indirect light, and its functions of the light. */
const TERMS = 45, LIGHTS = 9;

const {abs, hypot, max} = Math;

/** A unit vector turned by the angles x and y about two axes across it. */
function turned(d, [x, y]) {
  const [a, b] = d[2] * d[2] < 0.5 ? [[-d[1], d[0], 0], [-d[0] * d[2], -d[1] * d[2], d[0] ** 2 + d[1] ** 2]] :
                                     [[d[2], 0, -d[0]], [-d[0] * d[1], d[0] ** 2 + d[2] ** 2, -d[1] * d[2]]];
  const [p, q] = [unit(a), unit(b)];
  return d.map((c, i) => c + x * p[i] + y * q[i]);
}

/** The most that the terms of a curve's indirect light of a colour come to. */
function size_of({light}, {first_station, stations, plies}, c) {
  const of_station = (s) => {
    let sum = 0;
    for (let term = 0; term < TERMS; ++term) sum += abs(light(s, Math.floor(term / LIGHTS), term % LIGHTS, c));
    return sum;
  };
  return (1 + abs(plies.groove[c])) * max(...Array.from({length: stations}, (_, s) => of_station(first_station + s)));
}

/** { rgb, alpha, errors } at a point of the plane, errors of rgb; null where rounding decides. */
export function yarn_changes(yarns, uv, light, view, U) {
  const {repeat, thinnest, top} = yarns;
  const here = evaluate_yarns(yarns, uv, light, view);
  const {rgb, alpha, hit} = here;
  const beside = ([x, y], mm) => [uv[0] + x * mm / repeat[0], uv[1] + y * mm / repeat[1]];
  const shifted = AROUND.map((d) => evaluate_yarns(yarns, beside(d, BESIDE * thinnest), light, view));
  const small = (d) => d.map((x) => x * TURN);
  for (const d of AROUND) {
    shifted.push(evaluate_yarns(yarns, uv, light[2] > 0 ? turned(light, small(d)) : light, view));
    shifted.push(evaluate_yarns(yarns, uv, light, view[2] > 0 ? turned(view, small(d)) : view));
  }
  const lit = light[2] > 0 && view[2] > 0;
  const agrees = ({hit: other, hidden, strand}) =>
    other?.segment === hit?.segment && (!lit || (hidden === here.hidden && strand === here.strand));
  // The ball about the end of a hair may hide light or not.
  if (!shifted.every(agrees) || here.hidden === 'by a tip') return null;
  if (!hit || !lit) return {rgb, alpha, errors: [0, 0, 0]};
  const {curve} = hit.segment;

  const way = (top - hit.point[2]) / max(unit(view)[2], 1 / 32);
  const place = OF_PLACE * U * (way + max(...repeat)), angle = (d) => d.map((x) => x * OF_DIRECTION * U);
  const moved = [0, 1, 2].map((axis) => {
    const by = (a) => a.map((x, i) => x + (i === axis ? place : 0));
    return evaluate_yarns(yarns, uv, light, view, {...hit, point: by(hit.point), from_start: by(hit.from_start)});
  });
  const groups = [
    AROUND.map((d) => evaluate_yarns(yarns, beside(d, place), light, view)),
    moved,
    AROUND.map((d) => evaluate_yarns(yarns, uv, turned(light, angle(d)), view)),
    AROUND.map((d) => evaluate_yarns(yarns, uv, light, turned(view, angle(d)))),
  ];
  const errors = rgb.map((f, c) => {
    const changes = groups.map((group) => max(...group.map((other) => abs(other.rgb[c] - f))));
    return changes.reduce((sum, x) => sum + x, 0) + U * (OF_F * f + OF_TERMS * size_of(yarns, curve, c));
  });
  return {rgb, alpha, errors, curve};
}

/** What is asked besides of a fabric with yarn: level -1, and those down to it. */
export function* yarn_queries(fixture, {yarns}) {
  const next = random(`yarn of ${fixture.name}`);
  const direction = (least) => random_direction(next, least);
  const leaning = (z) => {
    const [x, y] = random_direction(next, 0);
    return unit([x, y, z * hypot(x, y)]);
  };
  const at = (why, light, view, level = -1, uv = [next(), next()]) => ({level, uv, light, view, why});
  for (let n = 0; n < 16; ++n) yield at('yarn, light and view at random', direction(), direction());
  for (let n = 0; n < 4; ++n) {
    yield at('grazing view', direction(), leaning(0.1 - 0.02 * n));
    yield at('light near the horizon', leaning([0.001, 0.02, 0.04, 0.1][n]), direction());
    yield at('view below the least rise of a ray', direction(), leaning(0.02 - 0.004 * n));
    yield at('between the yarn and level 0', direction(), direction(), [-0.5, -0.25, -0.75, -0.1][n]);
  }
  yield at('light and view along the normal', [0, 0, 1], [0, 0, 1]);
  yield at('light on the horizon: f = 0', [0.6, -0.8, 0], direction());
  yield at('light below the horizon: f = 0', unit([0.3, 0.2, -0.5]), direction());
  yield at('view on the horizon: f = 0, alpha of the least rise', direction(), [-0.8, 0.6, 0]);
  yield at('view straight down: f = 0, alpha of the pole', direction(), [0, 0, -1]);
  yield at('uv far away', direction(), direction(), -1, [1048576.25, -524287.375]);
  // Light that shines, where curves are glossy: the brightest of some.
  for (let n = 0; n < 4; ++n) {
    const uv = [next(), next()], view = direction(0.3);
    const value = (light) => evaluate_yarns(yarns, uv, light, view).rgb[0];
    const lights = Array.from({length: 40}, () => direction());
    yield at('the brightest of some lights', lights.reduce((a, b) => value(b) > value(a) ? b : a), view, -1, uv);
  }
  for (let n = 0, hairs = 0; n < 4000 && hairs < 16; ++n) {
    const uv = [next(), next()], view = direction(0.1);
    if (!(trace(yarns, uv, view)?.segment.rank > 0)) continue;
    yield at('a hair', direction(), view, -1, uv);
    ++hairs;
  }
  for (let n = 0, misses = 0; n < 400 && misses < 3; ++n) {
    const uv = [next(), next()], view = direction();
    if (trace(yarns, uv, view)) continue;
    yield at('a ray that meets nothing: alpha = 0', direction(), view, [-1, -0.5][misses++ % 2], uv);
  }
  for (const uv of [[0.1, 0.3], [0.4, 0.8], [0.7, 0.2]]) {
    yield at('view below the horizon: f = 0, alpha of the least rise over its x and y as they are', direction(),
      unit([0.06, 0.03, -1]), -1, uv);
  }
}

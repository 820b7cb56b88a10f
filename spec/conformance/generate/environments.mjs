// Queries about light from all around (spec/brdf.md, Environments), with expected answers.
import {evaluate_texel, evaluate_uv} from '../reference/brdf.mjs';
import {FINE, in_frame, radiance_of, shown} from '../reference/environment.mjs';
import {in_sight} from '../reference/sides.mjs';
import {unit} from './random.mjs';

const {PI, abs, acos, sin} = Math;
const UP = [0, 0, 1];
const SIDE = unit([0.5, -0.3, 0.6]);
const LOW = unit([-0.8, 0.5, 0.1]);
const VIEW = unit([-0.3, 0.2, 0.9]), BELOW = VIEW.map((x) => -x), GRAZING = unit([0.7, 0.6, 0.05]);

const BLACK = [0, 0, 0];
const A = [0.2, 0.25, 0.3], B = [1, 0.75, 0.5];
const constant = {kind: 'constant', a: A};
const cosine = (axis, b = [0.2, -0.1, 0.3]) => ({kind: 'cosine', a: A, b, axis});
const lobe = (axis, exponent) => ({kind: 'lobe', a: A, b: B, axis, exponent});
const step = (axis) => ({kind: 'disc', a: A, b: B, axis, degrees: 90});
const sun = (axis) => ({kind: 'disc', a: A, b: [800, 700, 600], axis, degrees: 2});
const small_sun = (axis) => ({kind: 'disc', a: A, b: [4e4, 3.6e4, 3.2e4], axis, degrees: 0.27});
const all = (axis) => [constant, cosine(axis), lobe(axis, 8), step(axis), sun(axis), small_sun(axis)];

/** Axes of a fabric in the world: of a turned cloth, and of its back. */
const TURNED = [[0.36, 0.48, 0.8], [-0.8, 0.6, 0], [-0.48, -0.64, 0.6]];
const BACK = [...TURNED.slice(0, 2), TURNED[2].map((x) => -x)];

/** a E_a + b E_b by hand, of integrals of f and of f times the shape. */
const by_hand = (of_a, of_b = 0) => ({b = BLACK}) => A.map((a, c) => a * of_a + b[c] * of_b);
/** For f = l_z. */
const MATT = [
  ['the constant', constant, by_hand(PI)],
  ['the cosine about the normal', cosine(UP), by_hand(PI, 2 * PI / 3)],
  ['the cosine', cosine(SIDE), by_hand(PI, 2 * PI / 3 * SIDE[2])],
  ['the lobe about the normal', lobe(UP, 6), by_hand(PI, 2 * PI / 8)],
  ['the lobe of exponent 1', lobe(LOW, 1), by_hand(PI, 2 / 3 * (sin(acos(LOW[2])) + (PI - acos(LOW[2])) * LOW[2]))],
  ['the step', step(SIDE), by_hand(PI, PI / 2 * (1 + SIDE[2]))],
  ['the step at the horizon, from below', step([0, 0, -1]), by_hand(PI, 0)],
  ['the sun', sun(SIDE), by_hand(PI, PI * sin(2 * PI / 180) ** 2 * SIDE[2])],
  ['the small sun', small_sun(LOW), by_hand(PI, PI * sin(0.27 * PI / 180) ** 2 * LOW[2])],
  ['the sun below the horizon', sun(unit([0.3, 0.3, -0.5])), by_hand(PI, 0)],
];

const on_yarn = (uv) => ({level: -1, uv, view: VIEW});
/** Queries by fixture; `closed` is the integral, known without a sum. */
const QUERIES = {
  'layers-none': [
    ...MATT.map(([name, environment, closed]) => ({environment, view: VIEW, why: `matt under ${name}`, closed})),
    {environment: constant, view: BELOW, why: 'view below the horizon: f = 0', closed: by_hand(0)},
    {environment: step(UP), view: VIEW, frame: TURNED, why: 'the step leans', closed: by_hand(PI, 0.8 * PI)},
    {environment: step(UP), view: BELOW, frame: BACK, why: 'the back of it', closed: by_hand(PI, 0.2 * PI)},
  ],
  // f = l_z (1/4 + (l_z / 2)^4), alpha = 3/4.
  'example-fabric': [
    {environment: constant, view: UP, why: 'a hole shows the environment', closed: by_hand(PI * (1 / 4 + 1 / 48))},
    {
      environment: cosine(UP),
      view: UP,
      background: [0, 0.5, 1],
      why: 'a hole shows what lies behind',
      closed: by_hand(PI * (1 / 4 + 1 / 48), 2 * PI * (1 / 12 + 1 / 112)),
    },
  ],
  'layers-lobes-frame-table-opacity': [
    ...all(SIDE).map((environment) => ({environment, texel: [1, 0], view: VIEW, why: 'lobes, tables and holes'})),
    {environment: step(LOW), texel: [2, 1], view: GRAZING, background: [1, 1, 1], why: 'grazing view over white'},
    {environment: lobe(SIDE, 2.5), texel: [1, 1], view: unit([-0.4, -0.5, 0.6]), frame: TURNED, why: 'turned'},
    {environment: lobe(SIDE, 2.5), texel: [1, 1], view: unit([0.4, 0.5, -0.6]), frame: BACK, why: 'the back'},
  ],
  'lobes-16': [lobe(LOW, 20), sun(SIDE)].map((environment) => ({environment, view: VIEW, why: 'many lobes'})),
  'grid-8x8': [{environment: step(LOW), view: GRAZING, texel: [1, 0], why: 'a fine view table, grazing view'}],
  'light-lobes': [cosine(SIDE), step(LOW)].map((environment) => ({environment, view: VIEW, why: 'a light table'})),
  'products-several': [cosine(LOW), lobe(LOW, 8), step(LOW), sun(LOW)].map(
    (environment) => ({environment, view: VIEW, why: 'products'})),
  'products-all-layers':
    [lobe(SIDE, 3), step(SIDE), sun(SIDE)].map(
      (environment) => ({environment, view: VIEW, background: BLACK, why: 'every layer'})),
  'levels-each-its-own': [cosine(SIDE), lobe(LOW, 4)].map(
    (environment) => ({environment, level: 1.25, uv: [0.3, -0.8], view: VIEW, why: 'between two levels'})),
  'yarns-straight': [{environment: step(LOW), ...on_yarn([0.13, 0.36]), why: 'yarn without gloss'}],
  'yarns-crossing': [
    ...[constant, step(SIDE), sun(SIDE)].map(
      (environment) => ({environment, ...on_yarn([0.13, 0.52]), why: 'yarn'})),
    {environment: lobe(LOW, 4), ...on_yarn([0.4, 0.1]), level: -0.5, why: 'between the yarn and level 0'},
  ],
  'sides-all': [
    ...[constant, cosine(LOW), lobe(BELOW, 4), sun(BELOW)].map(
      (environment) => ({environment, view: VIEW, why: 'light from both sides'})),
    {environment: step(BELOW), view: VIEW, behind: true, why: 'light from both sides, from behind'},
  ],
  'yarns-upright': [{environment: step(SIDE), ...on_yarn([0.13, 0.52]), why: 'beside the yarn: the environment'}],
};

/** Half a million directions, evenly spread, are within these of the integral; yarn has edges of shadow. */
const RELATIVE = 1e-4, RELATIVE_OF_YARN = 1e-3;
const round = (x) => Number(x.toPrecision(8));

/** What a file is asked about light from all around, and what it answers. */
export function environment_queries({name}, fabric, seen) {
  const known = {};
  return (QUERIES[name] ?? []).map(({closed, why, ...query}) => {
    const asked = {op: 'environment', level: 0, ...query.uv ? {} : {texel: [0, 0]}, ...query};
    const {environment: given, frame, texel, uv, background} = asked;
    const turn = (d) => d && frame ? in_frame(frame, d) : d;
    const view = turn(asked.view), environment = {...given, axis: turn(given.axis)};
    const side = seen[asked.behind ? 1 : 0], both = side.through !== null;
    const at = (light) => {
      const {level, light: above} = in_sight(side, light);
      return texel ? evaluate_texel(level(asked.level), texel, above, view) :
                     evaluate_uv(level, fabric.levels, asked.level, uv, above, view);
    };
    const of_yarn = asked.level < 0, relative = of_yarn ? RELATIVE_OF_YARN : RELATIVE;
    const [sum, coarse] = (of_yarn ? [1 / 2, 1] : [1 / 16, 1 / 8]).map((factor) => {
      const place = known[JSON.stringify([asked.level, texel, uv, view, asked.behind, factor])] ??= {};
      return shown(at, view, environment, background, {fine: factor * FINE, known: place, both});
    });
    const agree = (a, b) => a.every((x, c) => abs(x - b[c]) <= relative / 4 * abs(b[c]));
    if (!agree(coarse.rgb, sum.rgb)) throw new Error(`${name}: the sum is too coarse: ${why}`);
    let {rgb} = sum;
    if (closed) {
      const behind = background ?? radiance_of(environment, view.map((x) => -x));
      rgb = closed(given).map((x, c) => sum.alpha * x + (1 - sum.alpha) * behind[c]);
      if (!agree(sum.rgb, rgb)) throw new Error(`${name}: ${why}: ${sum.rgb} is not ${rgb}`);
    }
    return {
      ...asked,
      rgb: rgb.map(round),
      alpha: round(sum.alpha),
      tolerance: {relative, absolute: 0, alpha: 1e-6},
      why: closed ? `${why}; a closed form` : why,
    };
  });
}

/** Environments that cannot be; for one file only. */
export function* refused_environments() {
  const common = {op: 'environment', level: 0, texel: [0, 0], view: UP, environment: constant};
  const bad = (environment, why) => ({...common, environment, why});
  yield bad(undefined, 'no environment');
  yield bad({kind: 'sky', a: A}, 'an unknown kind');
  yield bad({kind: 'constant', a: [1, 1]}, 'radiance of two numbers');
  yield bad({kind: 'constant', a: [1, -1, 1]}, 'negative radiance');
  yield bad(cosine(UP, [0.2, 0.25, -0.35]), 'radiance that is negative on one side');
  yield bad({...step(UP), axis: undefined}, 'no axis');
  yield bad({...step(UP), axis: [0, 0, 2]}, 'an axis of another length');
  yield bad(lobe(UP, -1), 'a negative exponent');
  yield bad({...step(UP), degrees: 0}, 'a disc without radius');
  yield {...common, frame: [[1, 0, 0], [0, 1, 0], [0.6, 0, 0.8]], why: 'a frame without right angles'};
  yield {...common, background: [1, 1], why: 'a background of two numbers'};
  yield {...common, texel: undefined, why: 'neither texel nor uv'};
}

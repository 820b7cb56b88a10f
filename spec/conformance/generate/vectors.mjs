// Queries of a valid fabric file with their expected answers and tolerances.
import {evaluate_texel, evaluate_uv} from '../reference/brdf.mjs';
import {cell_direction} from '../reference/directions.mjs';
import {header_digest, open_fabric, repeat_size} from '../reference/reader.mjs';
import {in_sight, seen_from} from '../reference/sides.mjs';
import {U, bounded_texel, bounded_uv} from './bounds.mjs';
import {random, random_direction, unit} from './random.mjs';
import {environment_queries, refused_environments} from './environments.mjs';
import {yarn_queries} from './near_yarns.mjs';

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const UP = [0, 0, 1];

/**
 * What every file is asked, once the fixture's own queries are through; less where the reading is the point.
 */
function* ordinary_queries(fixture, fabric, level) {
  const next = random(`queries of ${fixture.name}`);
  const direction = (least) => random_direction(next, least);
  const pick = (k) => [Math.floor(next() * level(k).width), Math.floor(next() * level(k).height)];
  for (let k = 0; k < fabric.levels; ++k) {
    for (let n = 0; n < (k === 0 ? 3 : 2); ++n) {
      yield {level: k, texel: pick(k), light: direction(), view: direction(), why: 'light and view at random'};
    }
  }
  const k = Math.floor(next() * fabric.levels);
  if (fixture.brief) {
    yield {level: k, uv: [-0.7, 3.2], light: direction(0.2), view: direction(0.2), why: 'uv'};
    return;
  }
  const at = (why, light, view) => ({level: k, texel: pick(k), light, view, why});
  yield at('light and view along the normal', UP, UP);
  yield at('grazing light', unit([0.8, -0.6, 0.001]), direction());
  yield at('grazing view', direction(), unit([-0.6, 0.8, 0.001]));
  yield at('light on the horizon: f = 0', [0.6, -0.8, 0], direction());
  yield at('light below the horizon: f = 0, alpha as ever', unit([0.3, 0.2, -0.5]), direction());
  yield at('view on the horizon: f = 0, alpha of the rim', direction(), [-0.8, 0.6, 0]);
  yield at(
    'view below the horizon: f = 0, alpha of the rim in that direction', direction(), unit([0.5, 0.3, -0.4]));
  yield at('view straight down: f = 0, alpha of the pole', direction(), [0, 0, -1]);
  if (level(k).frame) {
    const below = (texel) => {
      const {normal} = level(k).frame(texel);
      for (let n = 0; n < 2000; ++n) {
        const d = direction(0.02);
        if (dot(d, normal) < -0.02) return d;
      }
      return null;
    };
    const texel = pick(k), t = texel[1] * level(k).width + texel[0], low = below(t);
    if (low) {
      yield {level: k, texel, light: low, view: direction(), why: 'light below the texel\'s horizon: g = 0'};
      yield {
        level: k,
        texel,
        light: direction(),
        view: low,
        why: 'view below the texel\'s horizon: the formula as it stands'
      };
    }
  }
  if (fabric.views.columns * fabric.views.rows > 1) {
    const {views} = fabric, V = views.columns * views.rows;
    yield at('view at the centre of the first cell', direction(), cell_direction(views, 0));
    yield at('view at the centre of the last cell', direction(), cell_direction(views, V - 1));
    yield at('view between the outermost centres and the rim', direction(), unit([1, -1, 0.02]));
    yield at(
      'view on the line where the map of directions begins its turn', direction(), unit([0.5, -0.5, 0.4]));
    yield at('view next to the pole', direction(), unit([1e-6, -3e-7, 1]));
    for (let n = 0; fixture.many_views && n < 12; ++n) yield at('view at random', direction(), direction());
  }
  const on = (why, fractional, uv) =>
    ({level: fractional, uv, light: direction(0.2), view: direction(0.2), why});
  const last = fabric.levels - 1;
  yield on('uv inside', k, [0.3, 0.7]);
  yield on('uv negative', k, [-3.3, -0.2]);
  yield on('uv huge, still exact', k, [1048576.25, -524287.375]);
  yield on('uv on the corner of the repeat', 0, [1, -2]);
  yield on('uv just below 0: the last texel', 0, [-1e-30, -1e-30]);
  const {width, height} = level(0);
  if (Number.isInteger(Math.log2(width)) && Number.isInteger(Math.log2(height))) {
    yield on(
      'uv on a border between texels', 0, [Math.floor(width / 2) / width, Math.floor(height / 2) / height]);
  }
  const finest = level(0).yarns ? 'the yarn' : 'level 0';
  yield on(`a level below the finest is ${finest}`, -1.5, [0.6, 0.1]);
  yield on('a level beyond the last is the last', last + 0.75, [0.6, 0.1]);
  for (let n = 0; n < last; ++n)
    yield on('between two levels', n + [0.5, 0.25, 0.875, 0.1][n % 4], [next(), next()]);
}

/** What is asked besides where light and view are looked up in bases, or the light in a table. */
function* light_queries(fixture, fabric, level) {
  const next = random(`lights of ${fixture.name}`);
  const direction = (least) => random_direction(next, least);
  const {lights} = fabric, L = lights.columns * lights.rows;
  for (let k = 0; k < fabric.levels; ++k) {
    const {width, height} = level(k);
    const at = (why, light, view = direction()) =>
      ({level: k, texel: [Math.floor(next() * width), Math.floor(next() * height)], light, view, why});
    for (let n = 0; n < 2; ++n) yield at('light and view at random, both looked up', direction());
    if (k > 0) continue;
    yield at('light at the centre of the first cell', cell_direction(lights, 0));
    yield at('light at the centre of the last cell', cell_direction(lights, L - 1));
    yield at('light between the outermost centres and the rim', unit([-1, 1, 0.02]));
    yield at('light next to the pole', unit([-1e-6, 3e-7, 1]));
    yield at('grazing light and grazing view', unit([0.8, 0.6, 0.001]), unit([-0.6, -0.8, 0.001]));
    yield at('light on the horizon: f = 0', [-0.8, 0.6, 0]);
  }
}

/** What is asked of each case of sides, where a file has more than the front. */
function* side_queries(fixture, fabric, level) {
  const next = random(`sides of ${fixture.name}`);
  const direction = (least) => random_direction(next, least);
  const sides = Object.keys(fabric.sides).length > 0;
  for (const [behind, below] of sides ? [[false, true], [true, false], [true, true]] : []) {
    const why = `${behind ? 'the back' : 'the front'}, light ${below ? 'through the cloth' : 'on the side that is seen'}`;
    const from = (z) => {
      const d = direction(z);
      return below ? [d[0], d[1], -d[2]] : d;
    };
    for (let k = 0; k < fabric.levels; ++k) {
      const {width, height} = level(k);
      for (let n = 0; n < 4; ++n) {
        const texel = [Math.floor(next() * width), Math.floor(next() * height)];
        yield {level: k, texel, light: from(0.02), view: direction(), behind, why};
      }
    }
    for (const k of [0.5, ...level(0).yarns ? [-0.5, ...Array(10).fill(-1)] : []])
      yield {level: k, uv: [next(), next()], light: from(0.1), view: direction(0.2), behind, why};
  }
}

/** Queries that must be refused. */
function* refused_queries(fabric, level) {
  const last = fabric.levels - 1;
  const common = {light: UP, view: UP};
  yield {level: last + 1, texel: [0, 0], ...common, why: 'a level that does not exist'};
  yield {level: 0, texel: [level(0).width, 0], ...common, why: 'a texel that does not exist'};
  if (level(0).yarns) yield {level: -1, texel: [0, 0], ...common, why: 'yarn has no texels'};
}

/** What cannot be answered, whatever the file; for one file only. */
function* malformed_queries() {
  const common = {light: UP, view: UP};
  yield {level: -1, texel: [0, 0], ...common, why: 'a negative level of a texel'};
  yield {level: 0.5, texel: [0, 0], ...common, why: 'a texel of a fractional level'};
  yield {level: 0, texel: [0, -1], ...common, why: 'a negative texel'};
  yield {level: 0, texel: [0.5, 0], ...common, why: 'a fractional texel'};
  yield {level: 0, texel: [0], ...common, why: 'a texel of one number'};
  yield {level: 0, ...common, why: 'neither texel nor uv'};
  yield {level: 0, texel: [0, 0], uv: [0, 0], ...common, why: 'both texel and uv'};
  yield {level: 0, uv: ['0', 0], ...common, why: 'a text for a number'};
  yield {level: 0, uv: [null, 0], ...common, why: 'null for a number'};
  yield {texel: [0, 0], ...common, why: 'no level'};
  yield {level: 0, texel: [0, 0], view: UP, why: 'no light'};
  yield {level: 0, texel: [0, 0], light: UP, why: 'no view'};
  yield {level: 0, texel: [0, 0], light: [0, 1], view: UP, why: 'a light of two numbers'};
}

const up_to_two_digits = (x) => x === 0 ? 0 : Number((x * 1.05).toPrecision(2));

/** The tolerance and its reason. `bounded` has a bound of the error of each number. */
function tolerance_of({rgb, alpha, powers}, grids) {
  let relative = 0, absolute = 0;
  for (const {value, error} of rgb) {
    if (error === 0) continue;
    if (error <= 1e-2 * value)
      relative = Math.max(relative, error / value);
    else
      absolute = Math.max(absolute, error);
  }
  // One more rounding, for the number in the answer.
  const tolerance = {
    relative: up_to_two_digits(relative + (rgb.some((x) => x.value > 0) ? U : 0)),
    absolute: up_to_two_digits(absolute),
    alpha: up_to_two_digits(alpha.error + (alpha.error > 0 ? U * alpha.value : 0)),
  };
  const reasons = [];
  if (powers > 32 * U)
    reasons.push(
      `the exponent makes the error of the base ${up_to_two_digits(powers).toExponential()} of the power`);
  if (absolute > 1e-30) reasons.push('cancellation in a dot product leaves an absolute error');
  if (absolute > 0 && absolute <= 1e-30) reasons.push('a number below 2^-126 may become 0');
  if (grids && relative > 0 && powers <= 32 * U)
    reasons.push(`rounding, also of the place ${grids}`);
  else if (relative > 0 && reasons.length === 0)
    reasons.push('rounding alone');
  return {tolerance, reason: reasons.join('; ')};
}

const ok = ({rgb, alpha}, result) => rgb.every(({value, error}, c) => {
  // Sums are taken in another order, which shows where they cancel.
  if (Math.abs(value - result.rgb[c]) > 1e-12 * Math.abs(result.rgb[c]) + 1e-6 * error)
    throw new Error(`bounds.mjs evaluates something else: ${value}, not ${result.rgb[c]}`);
  return Number.isFinite(error) && (error <= 1e-2 * value || error <= 1e-4);
}) &&
  Number.isFinite(alpha.error);

/** The vectors of a file: { file, about, queries }. A query of the fixture that no tolerance fits is an error. */
export async function vectors_of(fixture, bytes) {
  const opened = await open_fabric(bytes), fabric = {...opened, levels: repeat_size(opened).levels};
  const digests = [header_digest(fabric), ...Object.values(fabric.raw.digests).flat()];
  if (fixture.digests && String(fixture.digests) !== String(digests))
    throw new Error(`${fixture.name}: other digests than on the page: ${digests}`);
  const seen = [seen_from(opened, false), seen_from(opened, true)], {level} = seen[0];
  const queries = [];
  const answer = (query, required) => {
    const {texel, uv, view} = query, {level: of_side, light} = in_sight(seen[query.behind ? 1 : 0], query.light);
    const evaluated = texel ? evaluate_texel(of_side(query.level), texel, light, view) :
                              evaluate_uv(of_side, fabric.levels, query.level, uv, light, view);
    const bounded = texel ? bounded_texel(of_side(query.level), texel, light, view) :
                            bounded_uv(of_side, fabric.levels, query.level, uv, light, view);
    if (!bounded || !ok(bounded, evaluated)) {
      if (required)
        throw new Error(`${fixture.name}: no tolerance fits: ${query.why}: ${JSON.stringify(bounded)}`);
      return;
    }
    const has = (...layers) => layers.some((layer) => fabric.layers[layer]);
    const grids = query.level < 0 && fabric.layers.yarns ? 'on the yarn' :
      has('light', 'products')                           ? 'in the grids' :
      has('table', 'opacity')                            ? 'in the grid of views' :
                                                           null;
    const {tolerance, reason} = tolerance_of(bounded, grids);
    const {why, page, ...asked} = query;
    if (page && [
          ...page.rgb, page.alpha
        ].some((x, i) => Math.abs(x - [...evaluated.rgb, evaluated.alpha][i]) > 1e-6)) {
      throw new Error(`${fixture.name}: the page says something else`);
    }
    const round = (x) => Number(x.toPrecision(12));
    queries.push({
      ...asked,
      rgb: evaluated.rgb.map(round),
      alpha: round(evaluated.alpha),
      tolerance,
      why: reason ? `${why}; ${reason}` : why
    });
  };
  for (const query of fixture.queries ?? []) answer(query, true);
  for (const query of ordinary_queries(fixture, fabric, level)) answer(query, false);
  for (const query of side_queries(fixture, fabric, level)) answer(query, false);
  if (fabric.lights && !fixture.brief)
    for (const query of light_queries(fixture, fabric, level)) answer(query, false);
  if (level(0).yarns)
    for (const query of yarn_queries(fixture, level(0))) answer(query, false);
  if (!fabric.layers.map) queries.push(...environment_queries(fixture, fabric, seen));
  for (const query of refused_queries(fabric, level)) queries.push({...query, error: true});
  if (fixture.name === 'layers-lobes') {
    for (const query of [...malformed_queries(), ...refused_environments()]) queries.push({...query, error: true});
  }
  return {file: `valid/${fixture.name}.exr`, about: fixture.about, queries};
}

// Responses of a fabric to light from all around, from its words: the twin of pack_around() in
// viewer/scene/packed_fabric.cpp and of format/fabric/yarn_sky.cpp.
import {smooth_basis} from './environment.js';
import {AT} from './pack.js';
import {squeezed, stretched, thin} from './reader/sections.js';
import {ANGLES, LIGHTS} from './reader/yarns.js';
import {cross, dot, minus, plus, times, unit} from './reader/vector.js';

const {PI, abs, cos, floor, hypot, max, min, sin, sqrt} = Math;
/** Directions in integrals of products, and in integrals of yarn at so many angles about it. */
const FINE = 32, SKY = [8, 12], AROUND_YARN = 12;
const MIN_RISE = 1 / 32, LEAVE_RADII = 1 / 64, NOWHERE = 1e30;
/** Of plies, as the shader has it: how the sky darkens between them; and the mean share of their normals outwards. */
const SKY_GROOVE = 0.5, MEAN_OUTWARD = 0.6;

/** The directions of a grid over the hemisphere (format/fabric/directions.h). */
const directions_of = (columns, rows) => Array.from({length: columns * rows}, (_, cell) => {
  const a = 2 * (cell % columns + 0.5) / columns - 1, b = 2 * (floor(cell / columns) + 0.5) / rows - 1;
  const along = abs(a) > abs(b), r = along ? a : b, lift = sqrt(2 - r * r);
  const angle = r === 0 ? 0 : along ? PI / 4 * b / a : PI / 2 - PI / 4 * a / b;
  return [r * cos(angle) * lift, r * sin(angle) * lift, 1 - r * r];
});
/** Four cells of a grid and their weights: [cell, weight]. */
function taps_of(columns, rows, [x, y, z]) {
  const planar = hypot(x, y), r = planar / sqrt(1 + z), along = abs(x) > abs(y);
  const [far, near] = along ? [x, y] : [y, x], p = far > 0 ? r : -r, q = Math.atan(near / far) / (PI / 4) * p;
  const place = planar > 0 ? along ? [p, q] : [q, p] : [0, 0];
  const [c, s] = [columns, rows].map((n, i) => min(max((place[i] + 1) / 2 * n - 0.5, 0), n - 1));
  const left = floor(c), top = floor(s), right = min(left + 1, columns - 1), bottom = min(top + 1, rows - 1);
  return [[top * columns + left, (1 - c + left) * (1 - s + top)], [top * columns + right, (c - left) * (1 - s + top)],
          [bottom * columns + left, (1 - c + left) * (s - top)], [bottom * columns + right, (c - left) * (s - top)]];
}
const lifted = ([x, y, z]) => unit([x, y, max(z, MIN_RISE)]);

/** Integrals of psi_b, the cosine and the functions of smooth light: [b][function][colour]. */
function integrals({words, floats}, fabric) {
  const basis = fabric === 0 ? 0 : words[fabric + AT.fabric_light_basis];
  if (basis === 0) return new Float32Array(0);
  let functions = 0;
  for (let k = 0; k < words[fabric + AT.fabric_level_count]; ++k) {
    const level = words[fabric + AT.fabric_level_places + k], pairs = words[level + AT.level_pairs];
    for (let m = 0; m < words[level + AT.level_products]; ++m) functions = max(functions, words[pairs + 2 * m + 1] + 1);
  }
  const columns = words[fabric + AT.fabric_light_columns], rows = words[fabric + AT.fabric_light_rows];
  const sums = new Float64Array(functions * LIGHTS * 3);
  for (const direction of directions_of(FINE, FINE)) {
    const taps = taps_of(columns, rows, direction), part = direction[2] * 2 * PI / FINE ** 2;
    const of_light = smooth_basis(...direction);
    for (let b = 0; b < functions; ++b)
      for (let c = 0; c < 3; ++c) {
        const first = basis + 3 * b * columns * rows + c;
        const psi = taps.reduce((sum, [cell, weight]) => sum + weight * floats[first + 3 * cell], 0);
        for (let k = 0; k < LIGHTS; ++k) sums[(b * LIGHTS + k) * 3 + c] += psi * of_light[k] * part;
      }
  }
  return Float32Array.from(sums);
}

/** The walk of a ray along one axis of the cells, as yarn.glsl has it. */
function walk_of(origin, direction, size, cells) {
  const forward = direction > 0 ? 1 : -1, cell = min(max(floor(origin / size), 0), cells - 1);
  const moves = abs(direction) > 1e-20;
  return {
    cell,
    forward,
    cells,
    next: moves ? ((cell + (direction > 0 ? 1 : 0)) * size - origin) / direction : NOWHERE,
    each: moves ? size / abs(direction) : NOWHERE,
  };
}
/** Moves on by a cell; returns by how many repeats. */
function advance(walk) {
  walk.next += walk.each;
  walk.cell += walk.forward;
  if (walk.cell >= 0 && walk.cell < walk.cells) return 0;
  walk.cell -= walk.forward * walk.cells;
  return walk.forward;
}

/** Whether a ray meets yarn, or begins in it: march_yarn() of yarn.glsl. */
class YarnRays {
  constructor({words, floats}, yarn) {
    this.words = words;
    this.floats = floats;
    this.yarn = yarn;
    this.segments = words[yarn + AT.yarn_segments];
    const two = (name) => [floats[yarn + AT[name]], floats[yarn + AT[name] + 1]];
    this.period = two('yarn_period');
    this.size = two('yarn_cell_size');
  }
  #enters(segment, x, y, z, [dx, dy, dz], start, begins) {
    const {floats} = this, gx = floats[segment + AT.segment_squeeze], gy = floats[segment + AT.segment_squeeze + 1];
    let d2 = 1;
    if (gx !== 0 || gy !== 0) {
      [[x, y], [dx, dy]] = [[x, y, z], [dx, dy, dz]].map((v) => squeezed(v, [gx, gy, 0]));
      d2 = dx * dx + dy * dy + dz * dz;
    }
    const axis = segment + AT.segment_axis, ax = floats[axis], ay = floats[axis + 1], az = floats[axis + 2];
    const radius = floats[segment + AT.segment_radius], length = floats[segment + AT.segment_length], r2 = radius * radius;
    const ball = floats[segment + AT.segment_rank] > 0 ? radius : floats[segment + AT.segment_reach];
    const along = ax * x + ay * y + az * z, back = dx * x + dy * y + dz * z;
    if (begins) {
      const share = min(max(along, 0), length);
      if (r2 > (x - ax * share) ** 2 + (y - ay * share) ** 2 + (z - az * share) ** 2) return true;
    }
    const g = d2 * ball * ball - (d2 * (x * x + y * y + z * z) - back * back);
    if (g > 0 && (-back - sqrt(g)) / d2 > start) return true;
    const nx = dy * az - dz * ay, ny = dz * ax - dx * az, nz = dx * ay - dy * ax;
    const a = nx * nx + ny * ny + nz * nz, gap = x * nx + y * ny + z * nz, h = a * r2 - gap * gap;
    if (!(h > 0)) return false;
    const slope = ax * dx + ay * dy + az * dz, side = (along * slope - back - sqrt(h)) / a, at = along + side * slope;
    return at > 0 && at < length && side > start;
  }
  meet(from, direction) {
    const {words, floats, yarn, size, period} = this, dz = direction[2];
    let [ox, oy] = from.map((place, axis) => place - floor(place / period[axis]) * period[axis]);
    const oz = from[2], end = (floats[yarn + (dz < 0 ? AT.yarn_low : AT.yarn_high)] - oz) / dz;
    const x = walk_of(ox, direction[0], size[0], words[yarn + AT.yarn_columns]);
    const y = walk_of(oy, direction[1], size[1], words[yarn + AT.yarn_rows]);
    for (let entered = 0, begins = true;; begins = false) {
      const left = min(x.next, y.next, end), z = [oz + dz * entered, oz + dz * left];
      const cell = words[yarn + AT.yarn_cells] + AT.cell_words * (y.cell * x.cells + x.cell);
      const first = words[cell + AT.cell_first], last = first + AT.reference_words * words[cell + AT.cell_count];
      if (min(...z) <= floats[cell + AT.cell_high] && max(...z) >= floats[cell + AT.cell_low]) {
        const px = ox + direction[0] * entered - (x.cell + 0.5) * size[0];
        const py = oy + direction[1] * entered - (y.cell + 0.5) * size[1];
        for (let at = first; at < last; at += AT.reference_words) {
          const segment = this.segments + AT.segment_words * words[at + AT.reference_segment];
          const start = at + AT.reference_start;
          const off = [px - floats[start], py - floats[start + 1], z[0] - floats[start + 2]];
          if (this.#enters(segment, ...off, direction, -entered, begins)) return true;
        }
      }
      if (left >= end) return false;
      entered = left;
      if (x.next <= left)
        ox -= advance(x) * period[0];
      else
        oy -= advance(y) * period[1];
    }
  }
}

/** Integrals of z B_j B_k: the functions of indirect light times the functions of smooth light. */
function upper_products() {
  const products = Array.from({length: LIGHTS}, () => new Float64Array(LIGHTS));
  for (const d of directions_of(64, 64)) {
    const basis = smooth_basis(...d), part = d[2] * 2 * PI / 64 ** 2;
    for (let j = 0; j < LIGHTS; ++j)
      for (let k = 0; k < LIGHTS; ++k) products[j][k] += part * basis[j] * basis[k];
  }
  return products;
}

/** Share of light from all around that gloss reflects: the mean over views. */
function mean_gloss(roughness) {
  const r = max(0.01, roughness), directions = directions_of(16, 16), part = 2 * PI / directions.length;
  const lambda = ([x, y, z]) => (sqrt(1 + (r * r * x * x + y * y) / (z * z)) - 1) / 2;
  let sum = 0;
  for (const v of directions)
    for (const l of directions) {
      const h = plus(l, v), q = (h[0] * h[0] / (r * r) + h[1] * h[1] + h[2] * h[2]) / dot(h, h);
      sum += 1 / (PI * r * q * q * (1 + lambda(l) + lambda(v)) * 4);
    }
  return min(1, sum * part * part / PI);
}

/** Place, tangent, the direction that angles count from, squeeze and thickness at a station of a curve of these segments. */
function frame_at(floats, segments, station) {
  const ends = segments.filter((_, i) => {
    // The first segment of the yarn, or of a ply, follows the last.
    const from = floats[segments[i] + AT.segment_station], next = floats[segments[i + 1] + AT.segment_station];
    return from <= station && !(next > from && next <= station);
  });
  const vector = (at) => [floats[at], floats[at + 1], floats[at + 2]];
  const mean = (of) => times(ends.map(of).reduce((sum, v) => plus(sum, v)), 1 / ends.length);
  const share = (s) => min(max((station - floats[s + AT.segment_station]) / floats[s + AT.segment_stations], 0), 1);
  const mixed = (name) => mean((s) => plus(times(vector(s + AT[name]), 1 - share(s)), vector(s + AT[name] + 3), share(s)));
  const squeeze = (s) => [floats[s + AT.segment_squeeze], floats[s + AT.segment_squeeze + 1], 0];
  // Of the segment and of that behind it, which follows in the list or is the first.
  const thickest = (s) => {
    const next = segments[(segments.indexOf(s) + 1) % segments.length], [own, other] = [s, next].map((at) => floats[at + AT.segment_reach]);
    return max(own, thin(other / thin(1, squeeze(next)), squeeze(s)));
  };
  const place = (s) => plus(
    vector(s + AT.segment_start), stretched(vector(s + AT.segment_axis), squeeze(s)), share(s) * floats[s + AT.segment_length]);
  const tangent = unit(mixed('segment_tangents')), across = mixed('segment_across'), position = mean(place);
  return {
    position,
    tangent,
    across: unit(minus(across, times(tangent, dot(tangent, across)))),
    squeeze: squeeze(ends[0]),
    radius: thickest(ends[0]) + hypot(...squeezed(minus(place(ends[0]), position), squeeze(ends[0]))),
    plied: ends.length > 1,
  };
}

/** Factors of the yarn's stations and angles, laid out as its indirect light. */
function sky_of_yarn(of, fabric) {
  const {words, floats} = of, yarn = fabric === 0 ? 0 : words[fabric + AT.fabric_yarns];
  if (yarn === 0) return new Float32Array(0);
  const [first_segment, curves, table] =
    ['yarn_segments', 'yarn_curves', 'yarn_light'].map((name) => words[yarn + AT[name]]);
  const of_curve = new Map();
  for (let s = first_segment; s < curves; s += AT.segment_words) {
    if (floats[s + AT.segment_rank] > 0) continue;
    const curve = words[s + AT.segment_curve];
    of_curve.set(curve, [...of_curve.get(curve) ?? [], s]);
  }
  const from_below = words[yarn + AT.yarn_through];
  const rays = new YarnRays(of, yarn), upper = upper_products(), glosses = new Map();
  const lights = directions_of(...SKY).map((l) => {
    const toward = lifted(l), part = 2 * PI / (SKY[0] * SKY[1]) * min(1, l[2] / MIN_RISE);
    return {toward, basis: smooth_basis(...l).map((value) => value * part)};
  });
  const values = [];
  for (let c = 0; curves + c * AT.curve_words < table; ++c) {
    const curve = curves + c * AT.curve_words, weight = floats[curve + AT.curve_gloss];
    const roughness = floats[curve + AT.curve_roughness];
    if (!glosses.has(roughness)) glosses.set(roughness, mean_gloss(roughness));
    const reflectance = [0, 1, 2].map(
      (k) => (floats[curve + AT.curve_albedo + k] * (1 - weight) + weight * glosses.get(roughness)) / PI);
    for (let number = 0; number < words[curve + AT.curve_stations]; ++number) {
      const sums = new Float64Array(3 * ANGLES * LIGHTS);
      const indirect = table + sums.length * (words[curve + AT.curve_first_station] + number);
      for (let i = 0; i < ANGLES; ++i)
        for (let j = 0; j < LIGHTS; ++j)
          for (let k = 0; k < LIGHTS; ++k)
            for (let colour = 0; colour < 3; ++colour)
              sums[(i * LIGHTS + k) * 3 + colour] += floats[indirect + (i * LIGHTS + j) * 3 + colour] * upper[j][k];
      for (let at = 0; from_below !== 0 && at < sums.length * LIGHTS; ++at) {
        const colour = at % 3, k = floor(at / 3) % LIGHTS, j = floor(at / 3 / LIGHTS) % LIGHTS, i = floor(at / 3 / LIGHTS ** 2);
        const through = floats[from_below - table + indirect + (i * LIGHTS + j) * 3 + colour];
        // Mirrored lights: functions 3, 5 and 6 are odd in z.
        sums[(i * LIGHTS + k) * 3 + colour] += through * upper[j][k] * (k === 3 || k === 5 || k === 6 ? -1 : 1);
      }
      const {position, tangent, across, squeeze, radius, plied} = frame_at(floats, of_curve.get(c), number);
      const beside = cross(tangent, across), outermost = plied ? 1 + SKY_GROOVE : 1;
      if (plied)
        sums.forEach((sum, i) => {
          const groove = floats[curve + AT.curve_groove + i % 3];
          sums[i] = sum * (1 + groove * MEAN_OUTWARD) / (1 + SKY_GROOVE * MEAN_OUTWARD);
        });
      for (let a = 0; a < AROUND_YARN; ++a) {
        const angle = 2 * PI * a / AROUND_YARN, x = cos(angle), y = sin(angle);
        const round = plus(times(across, x), beside, y), normal = unit(squeezed(round, squeeze));
        const from = plus(plus(position, stretched(round, squeeze), radius), normal, radius * LEAVE_RADII);
        const seen = new Float64Array(LIGHTS);
        for (const {toward, basis} of lights) {
          const cosine = dot(normal, toward);
          if (!(cosine > 0) || rays.meet(from, toward)) continue;
          for (let k = 0; k < LIGHTS; ++k) seen[k] += cosine * basis[k];
        }
        [1, x, y, x * x - y * y, 2 * x * y].forEach((of_angle, i) => {
          const share = of_angle * (i === 0 ? 1 : 2) / AROUND_YARN;
          for (let k = 0; k < LIGHTS; ++k)
            for (let colour = 0; colour < 3; ++colour)
              sums[(i * LIGHTS + k) * 3 + colour] += share * seen[k] * reflectance[colour] / outermost;
        });
      }
      values.push(sums);
    }
  }
  const result = new Float32Array(values.length * 3 * ANGLES * LIGHTS);
  values.forEach((sums, i) => result.set(sums, i * sums.length));
  return result;
}

/** Words to be appended to a fabric's words, in the layout of around.glsl. */
export function sky_of(words) {
  const of = {words, floats: new Float32Array(words.buffer, words.byteOffset, words.length)};
  const place_in = (fabric, name) => fabric === 0 ? 0 : words[fabric + AT[name]];
  const parts = [words[0], place_in(words[0], 'fabric_turned')].flatMap(
    (seen) => [integrals(of, seen), sky_of_yarn(of, seen), integrals(of, place_in(seen, 'fabric_through'))]);
  const sky = new Uint32Array(parts.reduce((sum, part) => sum + part.length, parts.length));
  const floats = new Float32Array(sky.buffer);
  let at = parts.length;
  parts.forEach((part, i) => {
    sky[i] = words.length + at;
    floats.set(part, at);
    at += part.length;
  });
  return sky;
}

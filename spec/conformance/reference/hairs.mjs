// Hairs that stand off yarn (spec/brdf.md, Hairs), as segments of curves.mjs.
import {hash, swell} from './swells.mjs';
import {across, cross, dot, minus, plus, squeezed, stretched, thin, times, unit} from './vector.mjs';

const {abs, cos, expm1, fround, hypot, log1p, max, min, sin, sqrt, PI} = Math;
const PIECES = 7, LONGEST = 3, WIDEST = 1 / 8;

/** From the root: x along the fibres, y across them, z out of the yarn; `u`: the numbers of the hair. */
function shape_of({length: mean, loops}, u) {
  const length = -mean * log1p(u(3) * expm1(-LONGEST)), numbers = Array.from({length: PIECES}, (_, k) => k + 1);
  if (u(4) < loops) {
    const lean = (u(5) - 0.5) * PI / 2, width = length * (0.3 + 0.2 * u(6));
    const height = 0.4 * sqrt(length * length - width * width);
    return numbers.map((k) => {
      const angle = PI * k / PIECES, up = height * sin(angle);
      return [width / 2 * (1 - cos(angle)), up * sin(lean), up * cos(lean)];
    });
  }
  const slant = (15 + 55 * u(5)) * PI / 180, azimuth = PI / 2 * (u(6) + u(7) - 1) + (u(8) < 0.5 ? PI : 0);
  const plane = 2 * PI * u(9), turn = (0.3 + 1.5 * u(10)) / PIECES, [x, y] = [cos(azimuth), sin(azimuth)];
  const way = [x * sin(slant), y * sin(slant), cos(slant)], aside = [-y, x, 0];
  const bend = plus(times([x * cos(slant), y * cos(slant), -sin(slant)], cos(plane)), aside, sin(plane));
  let point = [0, 0, 0];
  return numbers.map((k) => {
    point = plus(point, plus(times(way, cos(k * turn)), bend, sin(k * turn)), length / PIECES);
    return point;
  });
}

/** The pieces of a curve's hairs; `chain`: its segments, ply by ply; `sideways`: angles count from the x axis. */
export function hairs_of(curve, chain, sideways) {
  const {hairs, strands, plies, stations, slope} = curve, n = abs(hairs.count), over = hairs.count < 0;
  if (n === 0) return [];
  const each = chain.length / plies.count, seed = hash(strands.seed), radius = hairs.radius * hairs.kept;
  const sense = over ? sideways ? [1, -1] : [-1, 1] : [1, 1];
  return Array.from({length: n}, (_, h) => {
    const u = (k) => ((hash(seed ^ (0x80000000 + 16 * h + k)) >>> 8) + 0.5) / 2 ** 24;
    const ply = Math.floor(plies.count * u(1)), own = each * (over ? (plies.count - ply) % plies.count : ply);
    let i = own;
    for (let end = own + each; end - i > 1;) {
      const middle = (i + end) >> 1;
      if (fround(chain[middle].stations[0]) <= u(0) * stations) i = middle;
      else end = middle;
    }
    const {start, round, length, squeeze: g, tangents: [t_0, t_1], across: [A_0, A_1], out: [E_0, E_1], stations: x} = chain[i];
    const s = min(max((u(0) * stations - x[0]) / (x[1] - x[0]), 0), 1), mix = (a, b) => plus(times(a, 1 - s), b, s);
    const off = plus(times(round, 3 * s * s - 2 * s ** 3),
                     plus(times(t_0, s - 2 * s * s + s ** 3), t_1, s ** 3 - s * s), length);
    const T = unit(plus(times(round, 6 * s - 6 * s * s),
                        plus(times(t_0, 1 - 4 * s + 3 * s * s), t_1, 3 * s * s - 2 * s), length));
    const E = mix(E_0, E_1), A = unit(across(mix(A_0, A_1), T)), angle = 2 * PI * u(2);
    const light = [sense[0] * cos(angle), sense[1] * sin(angle)];
    const round_normal = plus(times(A, light[0]), cross(T, A), light[1]), N = unit(squeezed(round_normal, g));
    const F = unit(stretched(plus(T, cross(T, round_normal), slope), g)), G = times(cross(N, F), sense[0] * sense[1]);
    const root = plus(start, stretched(plus(off, round_normal, thin(curve.ply_radius * swell(strands, u(0)), g)), g));
    const place = ([a, b, c]) => plus(plus(plus(root, F, a), G, b), N, c);
    const points = [root, ...shape_of(hairs, u).map(place)];
    return points.slice(1).map((end, k) => {
      const way = minus(end, points[k]), of = {curve, radius, ball: radius, start: points[k], along: way, round: way, squeeze: [0, 0, 0]};
      return {
        ...of,
        length: hypot(...way),
        tangents: [unit(way), unit(way)],
        across: [[...light, dot(round_normal, E)], [dot(E, A), dot(E, cross(T, A)), 0]],
        out: [[0, 0, 0], [0, 0, 0]],
        stations: [u(0) * stations, u(0) * stations],
        rows: [0, 0],
        reach: max(radius, WIDEST * curve.radius),
        rank: (h + 0.5) / n,
      };
      // A piece without a direction in single precision cannot be met.
    }).filter(({along}) => Number.isFinite(fround(1 / fround(dot(along, along)))));
  }).flat();
}

// Strands of fibres (spec/brdf.md, Strands).
import {hash, noise, swell} from './swells.mjs';
import {cross, dot, minus, plus, times, unit} from './vector.mjs';

const {abs, atan2, floor, max, min, PI} = Math;
const PLACE_OF_OFFSET = 65535, OF_COLOUR = 3;
const LEAST_FACING = 0.05;

/**
 * { N, F, b, strand } of a point of a curve that has the normal N and the fibre F, seen from V; angle: (cos a, sin a), t:
 * the fraction of the chain, upright: whether A_0 is of the x axis, rows: of strand 0 on its ply, and on the ply which the
 * ply goes on as. `strand` tells neighbours apart.
 */
export function strand_at({count, pieces, shift, seed, irregularity, swells, contrast, marl}, {N, F, angle, t: way, upright, rows, plies}, V) {
  const n = abs(count), t = way - floor(way), hashed = hash(seed);
  const bits = (row, place) => hash(hashed ^ (row << 16 | place));
  const b = swell({seed, irregularity, swells}, way, OF_COLOUR);
  if (n === 0) return {N, F, b, strand: 0};
  const [cos_a, sin_a] = count > 0 ? angle : upright ? [angle[0], -angle[1]] : [-angle[0], angle[1]];
  const turns = atan2(sin_a, cos_a) / (2 * PI) - t * shift / n, y = n * (turns - floor(turns));
  const own = min(floor(y), n - 1), i = own + rows[0], next = (own + (shift % n + n) % n) % n + rows[1];
  const shade = plies > 1 ? 1 + marl * (2 * (rows[0] + t * (rows[1] - rows[0])) / (n * (plies - 1)) - 1) : 1;
  const offset = (strand) => floor(bits(strand, PLACE_OF_OFFSET) / 512) / 2 ** 23;
  const z = pieces * t + offset(i) + t * (offset(next) - offset(i)), j = floor(z);
  const [here, there] = [j, j + 1].map((place) => place < pieces ? bits(i, place) : bits(next, place - pieces));
  const [leans, rises, sways, shades] = [0, 1, 2, 3].map((k) => noise(z - j, here, there, k));
  const B = count > 0 ? cross(F, N) : cross(N, F);
  const bent = unit(plus(plus(N, B, y - own - 0.5 + 0.22 * leans), F, 0.12 * rises));
  const facing = unit(plus(bent, V, max(0, LEAST_FACING - dot(bent, V)))), swayed = plus(F, B, 0.16 * sways);
  return {
    N: facing,
    F: unit(minus(swayed, times(facing, dot(swayed, facing)))),
    b: b * shade * (1 + contrast * shades),
    strand: i,
  };
}

// Vectors of three numbers, and flat sections of yarn (spec/brdf.md, "Flat yarn").
const {hypot, sqrt} = Math;

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** a + x b. */
export const plus = (a, b, x = 1) => [a[0] + x * b[0], a[1] + x * b[1], a[2] + x * b[2]];
export const minus = (a, b) => plus(a, b, -1);
export const times = (a, x) => [a[0] * x, a[1] * x, a[2] * x];
export const unit = (a) => times(a, 1 / hypot(...a));
export const across = (a, axis) => minus(a, times(axis, dot(a, axis)));

/** g of flat yarn whose axis runs along a way; 0 of round yarn. */
export function squeeze_of({flattening}, way) {
  if (flattening === 1 || hypot(...way) === 0) return [0, 0, 0];
  const [x, y, z] = unit(way);
  return times([y, -x, 0], sqrt((1 - flattening) * (1 + z ** 2)));
}
/** g between two places, so far on: g and -g are the same section. */
export const between = (a, b, fraction) => plus(times(a, 1 - fraction), b, dot(a, b) < 0 ? -fraction : fraction);
/** To the round section, and of offsets and ways along the surface back from it. */
export const squeezed = (p, g) => minus(p, times(g, dot(g, p)));
export const stretched = (p, g) => plus(p, g, dot(g, p) / (1 - dot(g, g)));
/** Half the thickness of a section, and from that half its width. */
export const thin = (radius, g) => radius * sqrt(1 - dot(g, g));
export const wide = (radius, g) => radius / (1 - dot(g, g));

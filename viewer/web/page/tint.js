/** Luminance of the darkest cloth, and the largest tint. */
const DARKEST = 0.03, MAX_TINT = 16;

/** The factor on a cloth of mean `albedo` that gives it a colour, as tint_towards() of `dress` has it. */
export function tint_towards([r, g, b], albedo) {
  const grey = Math.max(DARKEST - 0.2126 * r - 0.7152 * g - 0.0722 * b, 0);
  return [r, g, b].map((c, k) => Math.min((c + grey) / Math.max(albedo[k], 1e-6), MAX_TINT));
}

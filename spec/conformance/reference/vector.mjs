// Vectors of three numbers.
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const cross = (a, b) =>
  [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** a + x b. */
export const plus = (a, b, x = 1) => [a[0] + x * b[0], a[1] + x * b[1], a[2] + x * b[2]];
export const minus = (a, b) => plus(a, b, -1);
export const times = (a, x) => [a[0] * x, a[1] * x, a[2] * x];
export const unit = (a) => times(a, 1 / Math.hypot(...a));
export const across = (a, axis) => minus(a, times(axis, dot(a, axis)));

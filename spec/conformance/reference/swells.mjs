// The noise of strands, colour, thickness and hairs (spec/brdf.md, Strands).

const {floor, min, sqrt} = Math;
const ROW_OF_YARN = 65535, OF_THICKNESS = 0;

const mixed = (k, shift, factor) => Math.imul(k ^ k >>> shift, factor);
/** Wellons' lowbias32. */
export function hash(k) {
  const mixed_twice = mixed(mixed(k, 16, 0x7feb352d), 15, 0x846ca68b);
  return (mixed_twice ^ mixed_twice >>> 16) >>> 0;
}

const value = (bits, k) => ((bits >>> 8 * k & 255) - 127.5) * sqrt(12 / 65535);
/** Noise k a fraction p of the way from one place of the lattice to the next. */
export function noise(p, a, b, k) {
  const q = p * p * (3 - 2 * p);
  return ((1 - q) * value(a, k) + q * value(b, k)) / sqrt((1 - q) ** 2 + q * q);
}

/** A change along a yarn, about 1, at a fraction of its chain. */
export function swell({seed, irregularity, swells}, fraction, byte = OF_THICKNESS) {
  if (irregularity === 0) return 1;
  const place = (fraction - floor(fraction)) * swells, e = min(floor(place), swells - 1), hashed = hash(seed);
  const [here, next] = [e, (e + 1) % swells].map((cell) => hash(hashed ^ (ROW_OF_YARN << 16 | cell)));
  return 1 + irregularity * noise(place - e, here, next, byte);
}

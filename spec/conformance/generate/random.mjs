/** Numbers in [0, 1) that are the same everywhere: Weyl steps through a 32-bit mixer; `name` is the seed. */
export function random(name) {
  let state = [...name].reduce((sum, c) => Math.imul(sum ^ c.codePointAt(0), 0x01000193) >>> 0, 0x811C9DC5);
  return () => {
    state = (state + 0x9E3779B9) >>> 0;
    let x = Math.imul(state ^ (state >>> 16), 0x85EBCA6B);
    x = Math.imul(x ^ (x >>> 13), 0xC2B2AE35);
    return ((x ^ (x >>> 16)) >>> 0) / 2 ** 32;
  };
}

/** A unit vector; only square roots, which are exactly rounded, so the same everywhere. */
export function unit([x, y, z]) {
  const length = Math.sqrt(x * x + y * y + z * z);
  return [x / length, y / length, z / length];
}

/** A direction with z >= `least`, roughly uniform. */
export function random_direction(next, least = 0.05) {
  for (;;) {
    const [x, y] = [2 * next() - 1, 2 * next() - 1];
    const z = least + (1 - least) * next();
    if (x * x + y * y > 0 && x * x + y * y < 1) {
      const side = Math.sqrt((1 - z * z) / (x * x + y * y));
      return [x * side, y * side, z];
    }
  }
}

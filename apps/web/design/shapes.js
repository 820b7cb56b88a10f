// How yarns came to rest: bytes by keys, a Map of which the newest stay.
const BYTES = 96e6;
export function keep_shape(shapes, key, bytes) {
  shapes.delete(key);
  shapes.set(key, bytes);
  let sum = 0;
  for (const [old, {length}] of [...shapes].reverse()) if ((sum += length) > BYTES) shapes.delete(old);
}

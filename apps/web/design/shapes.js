// How yarns came to rest: bytes by keys, a Map of which the newest stay.
const COUNT = 64;
export function keep_shape(shapes, key, bytes) {
  shapes.delete(key);
  shapes.set(key, bytes);
  if (shapes.size > COUNT) shapes.delete(shapes.keys().next().value);
}

// Mip levels and taps from the derivatives of texture coordinates: the GLSL twin of footprint() in
// format/scene/footprint.h. Returns vec4(level, ratio, axis); the slopes (x, y) are per pixel to the right
// and up, in texels of level 0.
vec4 footprint(vec2 right, vec2 up, float taps) {
  float e = right.x * right.x + up.x * up.x;
  float f = right.x * right.y + up.x * up.y;
  float g = right.y * right.y + up.y * up.y;
  float mean = (e + g) * 0.5;
  float half_difference = (e - g) * 0.5;
  float root = sqrt(half_difference * half_difference + f * f);
  float long2 = mean + root;
  float long_kept = max(long2, 1e-24);
  float short_kept = max(mean - root, long_kept / (taps * taps));
  vec2 axis = e > g ? vec2(long2 - g, f) : vec2(f, long2 - e);
  float length2 = dot(axis, axis);
  float reach = (sqrt(long_kept) - sqrt(short_kept)) / sqrt(max(length2, 1e-24));
  return vec4(log2(short_kept) * 0.5, sqrt(long_kept / short_kept), length2 > 1e-24 ? axis * reach : vec2(0.0));
}

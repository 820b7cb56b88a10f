// The texels under a pixel: the GLSL twin of format/fabric/footprint.h. `right` and `up`: change of texture
// coordinates per pixel, in texels of a level.
const float max_elongation = 8.0;
const float max_pixel_size = 3.5;
const int max_pixel_texels = 8;

float pixel_size(vec2 right, vec2 up) {
  float e = right.x * right.x + up.x * up.x;
  float f = right.x * right.y + up.x * up.y;
  float g = right.y * right.y + up.y * up.y;
  float half_difference = (e - g) * 0.5;
  float long2 = (e + g) * 0.5 + sqrt(half_difference * half_difference + f * f);
  float area = abs(right.x * up.y - right.y * up.x);
  return sqrt(max(max(area, long2 / max_elongation), 1e-24));
}

// Of the ellipse on the plane that a pixel is, the shorter axis.
float width_across_view(vec2 right, vec2 up) {
  float e = right.x * right.x + up.x * up.x;
  float f = right.x * right.y + up.x * up.y;
  float g = right.y * right.y + up.y * up.y;
  float long2 = (e + g) * 0.5 + sqrt((e - g) * (e - g) * 0.25 + f * f);
  return abs(right.x * up.y - right.y * up.x) * inversesqrt(max(long2, 1e-30));
}

struct PixelBox {
  mat2 into_pixel;  // from texels to the pixel's coordinates, -1/2 to 1/2 within it
  vec2 texel;       // size of a texel in these coordinates
  vec2 reach;       // texels whose centres are further away have no share
};

PixelBox pixel_box(vec2 right, vec2 up, float size) {
  float shrink = min(max_pixel_size / size, 1.0);
  right *= shrink;
  up *= shrink;
  float r = length(right);
  float u = length(up);
  right = r > 1e-12 ? right * (r < 1.0 ? 1.0 / r : 1.0) : vec2(1.0, 0.0);
  up = u > 1e-12 ? up * (u < 1.0 ? 1.0 / u : 1.0) : vec2(0.0, 1.0);
  float area = right.x * up.y - right.y * up.x;
  if (!(abs(area) > 0.5 * min(length(right), length(up)))) {
    right += dot(right, up) > 0.0 ? up : -up;
    up = vec2(-right.y, right.x) / sqrt(max(dot(right, right), 1e-12));
  }
  float inverse = 1.0 / (right.x * up.y - right.y * up.x);
  PixelBox box;
  box.into_pixel = mat2(up.y, -right.y, -up.x, right.x) * inverse;
  box.texel = sqrt(box.into_pixel[0] * box.into_pixel[0] + box.into_pixel[1] * box.into_pixel[1]);
  vec2 half_size = (1.0 + box.texel) * 0.5;
  box.reach = min(abs(right) * half_size.x + abs(up) * half_size.y, vec2(0.5 * float(max_pixel_texels)));
  return box;
}

float texel_share(PixelBox box, vec2 from_centre) {
  vec2 at = abs(box.into_pixel * from_centre);
  vec2 share = min(max((1.0 + box.texel) * 0.5 - at, vec2(0.0)), min(box.texel, vec2(1.0)));
  return all(lessThan(abs(from_centre), box.reach)) ? share.x * share.y : 0.0;
}

float blend_of_levels(float part, float steep) {
  return clamp((part - 0.5) * steep + 0.5, 0.0, 1.0);
}

float yarn_share(float size, float largest) {
  return largest > 0.0 ? blend_of_levels(log2(largest / size) + 0.5, 4.0) : 0.0;
}

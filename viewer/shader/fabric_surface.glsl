// A fabric under a pixel: its frame, its levels and its yarn (spec/brdf.md, "Over a surface"), for OpenGL and for WebGL 2.
// The includer defines what evaluate.glsl and footprint.glsl ask for, with YARN what yarn.glsl asks for, and
// the names of level_options.glsl.

vec3 unit_or(vec3 v, vec3 otherwise) {
  float length2 = dot(v, v);
  return length2 > 1e-36 && length2 < 1e36 ? v * inversesqrt(length2) : otherwise;
}

// Normals that interpolation has turned away from the viewer are raised over the horizon.
vec3 facing_normal(vec3 normal, vec3 view) {
  float cosine = dot(normal, view);
  const float horizon = 0.01;
  return cosine < horizon ? unit_or(normal + view * (horizon - cosine), view) : normal;
}
vec3 tangent_across(vec3 normal, vec3 along_u) {
  vec3 axis = 1.0 - normal.x * normal.x > 1e-6 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
  vec3 fixed_axis = unit_or(axis - normal * dot(normal, axis), axis);
  return unit_or(along_u - normal * dot(normal, along_u), fixed_axis);
}

// A front's normal bent by the slope of a normal texture in the frame of a fabric, as seen from a side.
vec3 bent_normal(vec3 normal, vec3 along_u, vec2 slope, float side, float handedness) {
  vec3 tangent = tangent_across(normal, along_u);
  vec3 up = cross(normal, tangent) * (side * handedness);
  return side * (tangent * slope.x + up * slope.y) + normal * sqrt(max(1.0 - dot(slope, slope), 0.0));
}

ivec2 size_of(uint fabric, uint level) {
  uint place = word(fabric + fabric_level_places + level);
  return ivec2(int(word(place + level_width)), int(word(place + level_height)));
}

// The number of what is seen of a fabric from a side, 1 or -1.
uint seen_from(float side, uint index) {
  uint turned = word(index) + fabric_turned;
  return side < 0.0 && word(turned) != 0u ? turned : index;
}

// Adds the mean of the texels of a level under the pixel; `right` and `up` in whole repeats.
void shade_level(uint index, uint level, vec2 uv, vec2 right, vec2 up, vec3 view, mat3 frame, float part,
                 inout vec4 sum) {
  uint fabric = word(index);
  uint through = fabric + fabric_through;
  ivec2 size = size_of(fabric, level);
  vec2 centre = (uv - floor(uv)) * vec2(size);
  bool nearest = forced_level >= 0;
  vec2 finest = vec2(size_of(fabric, 0u));
  float scale = exp2(-float(level));
  vec2 farthest = vec2(1e6);
  PixelBox box = pixel_box(clamp(right * vec2(size), -farthest, farthest), clamp(up * vec2(size), -farthest, farthest),
                           pixel_size(right * finest, up * finest) * scale);
  ivec2 first = nearest ? min(ivec2(centre), size - 1) : ivec2(floor(centre - box.reach + 0.5));
  ivec2 count = nearest ? ivec2(1) : ivec2(ceil(2.0 * box.reach));
  float total = nearest ? 1.0 : 0.0;
  for (int i = 0; !nearest && i < count.x * count.y; ++i) {
    ivec2 texel = first + ivec2(i % count.x, i / count.x);
    total += texel_share(box, vec2(texel) + 0.5 - centre);
  }
  float alpha = sum.a;
  for (int pass = 0; pass < (word(through) == 0u ? 1 : 2); ++pass) {
    if (pass == 1) {
      alpha = sum.a;
      index = through;
      fabric = word(index);
      mirror_lights();
    }
    uint place = word(fabric + fabric_level_places + level);
    bool of_products = is_of_products(place);
    if (of_products) clear_coefficients(place);
    Taps taps = taps_of(word(fabric + fabric_view_columns), word(fabric + fabric_view_rows), view);
    // One call for both ways: compilers copy the function to every call.
    for (int i = 0; i < count.x * count.y; ++i) {
      ivec2 texel = first + ivec2(i % count.x, i / count.x);
      float share = nearest ? 1.0 : texel_share(box, vec2(texel) + 0.5 - centre);
      if (!(share > 0.0)) continue;
      // Texels beyond the border are those of the next repeat.
      ivec2 at = (texel % size + size) % size;
      uint number_of_texel = uint(at.y * size.x + at.x);
      float weight = part * share / total;
      if (of_products) {
        weight *= opacity_of(fabric, place, number_of_texel, taps);
        sum.a += weight;
        add_coefficients(place, number_of_texel, weight);
      } else {
        shade_texel(index, level, number_of_texel, view, frame, weight, sum);
      }
    }
    if (of_products) shine(fabric, place, view, frame, sum);
    if (pass == 0) continue;
    // The opacity is known.
    sum.a = alpha;
    mirror_lights();
  }
}

#ifdef YARN
// How far from the reference plane a ray meets yarn, mm, as in viewer/cells/cell_pass.cpp. `right`, `up`: change of the
// texture coordinates per pixel; `turn`: of the front's unit normal.
float grazing_depth(uint fabric, vec2 right, vec2 up, mat2x3 turn, vec3 view, mat3 frame) {
  uint yarn = word(fabric + fabric_yarns);
  vec2 period = vec2(number(yarn + yarn_period), -number(yarn + yarn_period + 1u));
  float thickness = number(fabric + fabric_reference_height) - number(yarn + yarn_low);
  vec2 a = right * period;
  vec2 b = up * period;
  float area = a.x * b.y - a.y * b.x;
  float level = length(view.xy);
  if (!(level > 0.0) || !(thickness > 0.0) || area == 0.0) return nowhere;
  vec2 across = view.xy / level;
  vec3 along = frame[0] * across.x + frame[1] * across.y;
  float bend = dot((across.x * b.y - across.y * b.x) * turn[0] + (a.x * across.y - a.y * across.x) * turn[1], along) / area;
  if (!(bend > 0.0)) return nowhere;
  float slope = max(view.z, 0.0) / level;
  return 0.5 * slope * slope / min(bend, 0.25 / thickness);
}
#endif

// alpha * (radiance, 1) of the pixel at `uv`; `right` and `up`: its change per pixel. `view` is in the frame. `turn`:
// change of the front's unit normal per pixel to the right and up, where the yarn is to have its own outline; else 0.
// `side`: 1 where the front is seen, else -1.
vec4 shade_fabric(uint index, vec2 uv, vec2 right, vec2 up, mat2x3 turn, float side, vec3 view, mat3 frame) {
  uint fabric = word(index);
  vec2 size = vec2(size_of(fabric, 0u));
  float pixel_width = pixel_size(right * size, up * size);
  float level = forced_level >= 0 ? float(forced_level) : log2(pixel_width) - 1.0;  // level_bias
  vec4 sum = vec4(0.0);
  float of_texels = 1.0;
#ifdef YARN
  if (word(fabric + fabric_yarns) != 0u && forced_level < 0) {
    of_texels -= yarn_share(pixel_width, number(fabric + fabric_largest_yarn_pixel) * max(0.5, float(points - 1)));
    uint yarn = word(fabric + fabric_yarns);
    vec2 period = vec2(number(yarn + yarn_period), number(yarn + yarn_period + 1u));
    float spacing = width_across_view(right * period, up * period) / float(points);
    float depth = grazing_depth(fabric, right, up, turn, view, frame);
    float of_point = (1.0 - of_texels) / float(points * points);
    for (int i = 0; of_point > 0.0 && i < points * points; ++i) {
      vec2 at = (vec2(float(i % points), float(i / points)) + 0.5) / float(points) - 0.5;
      shade_yarn(fabric, uv - floor(uv) + right * at.x + up * at.y, view, depth, side, frame,
                 spacing, of_point, sum);
    }
  }
#endif
  level = clamp(level, 0.0, float(word(fabric + fabric_level_count) - 1u));
  float lower = floor(level);
  float of_upper = blend_of_levels(level - lower, 2.0);
  for (int k = 0; k < 2; ++k) {
    float part = of_texels * (k == 0 ? 1.0 - of_upper : of_upper);
    if (part == 0.0) continue;
    shade_level(index, uint(lower + float(k)), uv, right, up, view, frame, part, sum);
  }
  return sum;
}

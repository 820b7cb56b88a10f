// The evaluation of a fabric as a shader: the twin of format/fabric/evaluate.h (spec/brdf.md), held to it by
// a test.
#pragma once

namespace selvedge {

/// GLSL 4.50. Needs the buffer of shader_words() at binding 0 and defines
///   void shade_texel(uint fabric, uint level, uint texel, vec3 view, mat3 frame, float weight, inout vec4
///   sum)
/// which adds weight * alpha * (radiance, 1) of a texel under all lights: `view` is in the fabric's frame,
/// and d * frame brings a direction of the world there. The caller defines before it
///   uint light_count(), and void light_at(uint i, out vec3 direction, out vec3 irradiance), world.
inline constexpr const char* shader_evaluation_glsl = R"(
layout(std430, binding = 0) readonly buffer Fabrics { uint words[]; };

const float largest = 3.4028234e38;

float number(uint at) { return uintBitsToFloat(words[at]); }
vec3 vector_at(uint at) { return vec3(number(at), number(at + 1u), number(at + 2u)); }
float table_number(uint place, bool halves, uint i) {
  if (!halves) return number(place + i);
  vec2 pair = unpackHalf2x16(words[place + (i >> 1u)]);
  return (i & 1u) == 0u ? pair.x : pair.y;
}
vec3 table_vector(uint place, bool halves, uint i) {
  return vec3(table_number(place, halves, i), table_number(place, halves, i + 1u), table_number(place, halves, i + 2u));
}
vec3 held(vec3 x) { return min(x, vec3(largest)); }

struct Taps {
  uvec4 cell;
  vec4 weight;
};

// format/fabric/directions.h
vec2 hemisphere_to_square(vec3 d) {
  const float quarter = 0.78539816339744831;
  float planar = length(d.xy);
  if (!(planar > 0.0)) return vec2(0.5);
  float z = clamp(d.z, 0.0, 1.0);
  float whole = length(vec2(planar, z));
  float r = planar / whole / sqrt(1.0 + z / whole);
  // The angle from the nearest axis, of at most an eighth of a turn.
  vec2 s = abs(d.x) > abs(d.y) ? vec2(d.x, d.y) : vec2(d.y, d.x);
  float turn = atan(s.y / s.x) / quarter;
  vec2 p = vec2(s.x > 0.0 ? r : -r, 0.0);
  p.y = turn * p.x;
  vec2 ab = abs(d.x) > abs(d.y) ? p : p.yx;
  return clamp((ab + 1.0) * 0.5, 0.0, 1.0);
}
Taps taps_of(uint columns, uint rows, vec3 direction) {
  vec2 square = hemisphere_to_square(direction);
  vec2 last = vec2(float(columns), float(rows)) - 1.0;
  vec2 p = clamp(square * (last + 1.0) - 0.5, vec2(0.0), last);
  uvec2 a = uvec2(p);
  uvec2 b = min(a + 1u, uvec2(last));
  vec2 f = p - vec2(a);
  return Taps(uvec4(a.y * columns + a.x, a.y * columns + b.x, b.y * columns + a.x, b.y * columns + b.x),
              vec4((1.0 - f.x) * (1.0 - f.y), f.x * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * f.y));
}

// format/fabric/lafortune.h, red, green and blue
vec3 lobes_at(uint place, uint lobes, vec3 l, vec3 v) {
  if (!(l.z > 0.0)) return vec3(0.0);
  vec3 p = l * v;
  vec3 sum;
  for (uint c = 0u; c < 3u; ++c) {
    uint at = place + c * (1u + 4u * lobes);
    float one = number(at);
    for (uint j = 0u; j < lobes; ++j) {
      uint lobe = at + 1u + 4u * j;
      float base = number(lobe) * p.x + number(lobe + 1u) * p.y + number(lobe + 2u) * p.z;
      float n = number(lobe + 3u);
      if (base > 0.0) one += n == 0.0 ? 1.0 : pow(base, n);
    }
    sum[c] = one;
  }
  return held(sum * l.z);
}

// One entry of a texel under all lights, as it is seen from `view`: adds weight * alpha * (radiance, 1).
void shade_entry(uint fabric, uint level, uint texel, uint entry, vec3 view, mat3 frame, float weight,
                 inout vec4 sum) {
  uint views = words[fabric + 1u] * words[fabric + 2u];
  uint lights = words[fabric + 3u] * words[fabric + 4u];
  uint table = words[level + 5u];
  uint opacity = words[level + 7u];
  uint light_table = words[level + 9u];
  uint products = words[level + 11u];
  Taps view_taps = taps_of(words[fabric + 1u], words[fabric + 2u], view);
  vec3 of_view = vec3(1.0);
  float alpha = 1.0;
  if (table != 0u || opacity != 0u) {
    vec3 colour = vec3(0.0);
    float total = 0.0;
    for (int tap = 0; tap < 4; ++tap) {
      uint at = texel * views + view_taps.cell[tap];
      float share = view_taps.weight[tap];
      if (opacity != 0u) share *= table_number(opacity, words[level + 8u] != 0u, at);
      total += share;
      if (table != 0u) colour += share * table_vector(table, words[level + 6u] != 0u, 3u * at);
    }
    if (opacity != 0u) alpha = min(total, 1.0);
    if (table != 0u) of_view = total > 0.0 ? held(colour / total) : vec3(0.0);
  }
  sum.a += weight * alpha;
  if (!(view.z > 0.0) || !(alpha > 0.0)) return;

  vec3 normal = vec3(0.0, 0.0, 1.0);
  vec3 tangent = vec3(1.0, 0.0, 0.0);
  if (words[level + 4u] != 0u) {
    normal = vector_at(words[level + 4u] + 6u * texel);
    tangent = vector_at(words[level + 4u] + 6u * texel + 3u);
  }
  mat3 local = mat3(tangent, cross(normal, tangent), normal);
  vec3 local_view = view * local;
  uint lobes = words[level + 2u];
  uint own_lobes = words[level + 3u] == 0u ? 0u : words[level + 3u] + texel * 3u * (1u + 4u * lobes);
  uint coefficients = words[level + 14u] + (texel * words[level + 12u] + entry) * products;
  float scale = number(fabric + 5u);
  vec3 radiance = vec3(0.0);
  for (uint i = 0u; i < light_count(); ++i) {
    vec3 direction;
    vec3 irradiance;
    light_at(i, direction, irradiance);
    vec3 l = direction * frame;
    if (!(l.z > 0.0)) continue;
    vec3 bracket = of_view;
    if (light_table != 0u || products != 0u) {
      Taps taps = taps_of(words[fabric + 3u], words[fabric + 4u], l);
      if (table == 0u && light_table == 0u) bracket = vec3(0.0);
      if (light_table != 0u) {
        vec3 of_light = vec3(0.0);
        for (int tap = 0; tap < 4; ++tap) {
          of_light += taps.weight[tap] *
                      table_vector(light_table, words[level + 10u] != 0u, 3u * (texel * lights + taps.cell[tap]));
        }
        bracket *= of_light;
      }
      for (uint m = 0u; m < products; ++m) {
        float factor = number(coefficients + m);
        if (factor == 0.0) continue;
        uint a = words[words[level + 13u] + 2u * m];
        uint b = words[words[level + 13u] + 2u * m + 1u];
        if (a > 0u) {
          float phi = 0.0;
          for (int tap = 0; tap < 4; ++tap) {
            phi += view_taps.weight[tap] * number(words[fabric + 6u] + (a - 1u) * views + view_taps.cell[tap]);
          }
          factor *= phi;
        }
        vec3 psi = vec3(0.0);
        for (int tap = 0; tap < 4; ++tap) {
          psi += taps.weight[tap] * vector_at(words[fabric + 7u] + 3u * (b * lights + taps.cell[tap]));
        }
        bracket += factor * psi;
      }
      // Not max(): NaN becomes 0 as well.
      for (int c = 0; c < 3; ++c) bracket[c] = bracket[c] > 0.0 ? min(bracket[c], largest) : 0.0;
    }
    vec3 g = own_lobes == 0u ? vec3(1.0) : lobes_at(own_lobes, lobes, l * local, local_view);
    radiance += held(scale * held(bracket * g)) * irradiance;
  }
  for (int c = 0; c < 3; ++c) radiance[c] = radiance[c] >= 0.0 ? min(radiance[c], 1e30) : 0.0;
  sum.rgb += weight * alpha * radiance;
}

// format/fabric/slabs.h: the walk of a ray along one axis of the cells, by the depth below the top.
struct Walk {
  float slope;
  float edge;
  float steps;
  int cell;
  int cells;
};
Walk walk_from(double start, float slope, int cells) {
  // Single precision would lose the place within the cell.
  double repeated = start - floor(start / double(cells)) * double(cells);
  Walk walk;
  walk.slope = slope;
  walk.steps = 0.0;
  walk.cells = cells;
  walk.cell = clamp(int(repeated), 0, cells - 1);
  float within = float(repeated - double(walk.cell));
  walk.edge = slope > 0.0 ? 1.0 - within : within;
  return walk;
}
float leaves(Walk walk) {
  return walk.slope == 0.0 ? largest : (walk.edge + walk.steps) / abs(walk.slope);
}
void step_on(inout Walk walk) {
  walk.steps += 1.0;
  walk.cell += walk.slope > 0.0 ? 1 : -1;
  if (walk.cell == walk.cells) walk.cell = 0;
  if (walk.cell < 0) walk.cell = walk.cells - 1;
}

// Texel and entry of the yarn that a ray meets; false: none.
bool march(uint fabric, uint level, dvec2 uv, vec3 view, out uvec2 hit) {
  hit = uvec2(0u);
  int columns = int(words[level + 16u]);
  int rows = int(words[level + 17u]);
  int slabs = int(words[level + 18u]);
  float highest = number(level + 19u);
  float deepest = highest - number(level + 20u);
  if (!(deepest > 0.0)) return false;
  ivec2 cells = ivec2(int(words[level]) * columns, int(words[level + 1u]) * rows);
  dvec2 per_mm = dvec2(number(fabric + 8u), number(fabric + 9u));
  dvec2 up = dvec2(view.xy) / double(max(view.z, 1.0 / 32.0)) * per_mm * dvec2(cells);
  double above = double(highest) - double(number(fabric + 10u));
  Walk x = walk_from(uv.x * double(cells.x) + above * up.x, float(-up.x), cells.x);
  Walk y = walk_from(uv.y * double(cells.y) + above * up.y, float(-up.y), cells.y);
  float entered = 0.0;
  for (int visited = 0; visited < 16384; ++visited) {
    float left = min(min(leaves(x), leaves(y)), deepest);
    float from = highest - entered;
    float to = highest - left;
    uint texel = uint(y.cell / rows) * words[level] + uint(x.cell / columns);
    uint cell = uint((y.cell % rows) * columns + x.cell % columns);
    float best = -largest;
    bool met = false;
    for (int slab = 0; slab < slabs; ++slab) {
      uint entry = uint(slab * columns * rows) + cell;
      uint at = words[level + 15u] + 2u * (texel * uint(slabs * columns * rows) + entry);
      float top = number(at);
      float bottom = number(at + 1u);
      if (!(top > bottom) || to > top || from < bottom || min(top, from) <= best) continue;
      best = min(top, from);
      hit = uvec2(texel, entry);
      met = true;
    }
    if (met) return true;
    if (left >= deepest) return false;
    entered = left;
    if (leaves(x) <= left) {
      step_on(x);
    } else {
      step_on(y);
    }
  }
  return false;
}

void shade_texel(uint fabric_index, uint level_index, uint texel, vec3 view, mat3 frame, float weight,
                 inout vec4 sum) {
  uint fabric = words[fabric_index];
  uint level = words[fabric + 14u + level_index];
  if (words[level + 15u] == 0u) {
    shade_entry(fabric, level, texel, 0u, view, frame, weight, sum);
    return;
  }
  int columns = int(words[level + 16u]);
  int rows = int(words[level + 17u]);
  ivec2 at = ivec2(int(texel % words[level]) * columns, int(texel / words[level]) * rows);
  dvec2 cells = dvec2(double(int(words[level]) * columns), double(int(words[level + 1u]) * rows));
  float share = weight / float(columns * rows);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      dvec2 centre = (dvec2(at + ivec2(column, row)) + dvec2(0.5LF)) / cells;
      uvec2 hit;
      if (march(fabric, level, centre, view, hit)) {
        shade_entry(fabric, level, hit.x, hit.y, view, frame, share, sum);
      }
    }
  }
}
)";

}  // namespace selvedge

// The evaluation of a texel of a fabric under all lights: the twin of format/fabric/evaluate.h (spec/brdf.md), held to it
// by a test. shade_texel() adds weight * alpha * (radiance, 1) of a texel: `view` is in the fabric's frame, and
// d * frame brings a direction of the world there. The includer defines word() (fabric_words.glsl) and
//   uint light_count(), and void light_at(uint i, out vec3 direction, out vec3 irradiance), world.
// AROUND: there is light from all around, too; around.glsl comes first.
const float largest = 3.4028234e38;

float number(uint at) { return uintBitsToFloat(word(at)); }
vec3 vector_at(uint at) { return vec3(number(at), number(at + 1u), number(at + 2u)); }
float table_number(uint place, bool halves, uint i) {
  if (!halves) return number(place + i);
  vec2 pair = unpackHalf2x16(word(place + (i >> 1u)));
  return (i & 1u) == 0u ? pair.x : pair.y;
}
vec3 table_vector(uint place, bool halves, uint i) {
  return vec3(table_number(place, halves, i), table_number(place, halves, i + 1u), table_number(place, halves, i + 2u));
}
vec3 clamp_to_finite(vec3 x) { return min(x, vec3(largest)); }

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
  // The angle from the nearest axis, at most an eighth of a turn.
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
  return clamp_to_finite(sum * l.z);
}

// The coefficients of a level's products: of a texel, or a sum of those of texels. Then see() makes them factors of the
// functions of the light.
float factors[256];
void clear_coefficients(uint level) {
  for (uint m = 0u; m < word(level + level_products); ++m) factors[m] = 0.0;
}
void add_coefficients(uint level, uint texel, float weight) {
  uint products = word(level + level_products);
  uint place = word(level + level_coefficients) + texel * products;
  for (uint m = 0u; m < products; ++m) factors[m] += weight * number(place + m);
}
void see(uint fabric, uint level, Taps taps) {
  uint pairs = word(level + level_pairs);
  uint views = word(fabric + fabric_view_columns) * word(fabric + fabric_view_rows);
  for (uint m = 0u; m < word(level + level_products); ++m) {
    uint a = word(pairs + 2u * m);
    if (a == 0u || factors[m] == 0.0) continue;
    float phi = 0.0;
    for (int tap = 0; tap < 4; ++tap) {
      phi += taps.weight[tap] * number(word(fabric + fabric_view_basis) + (a - 1u) * views + taps.cell[tap]);
    }
    factors[m] *= phi;
  }
}
vec3 lit_products(uint fabric, uint level, Taps taps) {
  uint pairs = word(level + level_pairs);
  uint basis = word(fabric + fabric_light_basis);
  uint lights = word(fabric + fabric_light_columns) * word(fabric + fabric_light_rows);
  vec3 sum = vec3(0.0);
  for (uint m = 0u; m < word(level + level_products); ++m) {
    if (factors[m] == 0.0) continue;
    uint first = basis + 3u * word(pairs + 2u * m + 1u) * lights;
    vec3 psi = vec3(0.0);
    for (int tap = 0; tap < 4; ++tap) psi += taps.weight[tap] * vector_at(first + 3u * taps.cell[tap]);
    sum += factors[m] * psi;
  }
  return sum;
}

// Unlike max(), this turns NaN into 0.
vec3 from_zero(vec3 x, float most) {
  for (int c = 0; c < 3; ++c) x[c] = x[c] > 0.0 ? min(x[c], most) : 0.0;
  return x;
}

float opacity_of(uint fabric, uint level, uint texel, Taps taps) {
  uint place = word(level + level_opacity);
  if (place == 0u) return 1.0;
  uint views = word(fabric + fabric_view_columns) * word(fabric + fabric_view_rows);
  float alpha = 0.0;
  for (int tap = 0; tap < 4; ++tap) {
    alpha += taps.weight[tap] * table_number(place, word(level + level_opacity_halves) != 0u, texel * views + taps.cell[tap]);
  }
  return min(alpha, 1.0);
}

// Whether a level has products alone. As F is linear in their coefficients, a sum of texels is lit at once
// (viewer/hybrid/mean_products.h).
bool is_of_products(uint level) {
  return word(level + level_products) != 0u && word(level + level_lobes) == 0u && word(level + level_frames) == 0u &&
         word(level + level_view_table) == 0u && word(level + level_light_table) == 0u;
}

// 1: the lights in front of the cloth count; -1: those behind it, mirrored in its plane.
float lit_side = 1.0;
void mirror_lights() {
  lit_side = -lit_side;
#ifdef AROUND
  around[3] = -around[3];
  around[5] = -around[5];
  around[6] = -around[6];
  sky = lit_side > 0.0 ? sky - sky_of_through : sky + sky_of_through;
#endif
}

// Adds the light of such a sum under all lights, seen from `view`.
void shine(uint fabric, uint level, vec3 view, mat3 frame, inout vec4 sum) {
  if (!(view.z > 0.0)) return;
  see(fabric, level, taps_of(word(fabric + fabric_view_columns), word(fabric + fabric_view_rows), view));
  float scale = number(fabric + fabric_radiance_scale);
  vec3 radiance = vec3(0.0);
  for (uint i = 0u; i < light_count(); ++i) {
    vec3 direction;
    vec3 irradiance;
    light_at(i, direction, irradiance);
    vec3 l = direction * frame * vec3(1.0, 1.0, lit_side);
    if (!(l.z > 0.0)) continue;
    Taps taps = taps_of(word(fabric + fabric_light_columns), word(fabric + fabric_light_rows), l);
    vec3 bracket = from_zero(lit_products(fabric, level, taps), largest);
    radiance += clamp_to_finite(scale * clamp_to_finite(bracket * l.z)) * irradiance;
  }
#ifdef AROUND
  uint pairs = word(level + level_pairs);
  vec3 from_around = vec3(0.0);
  for (uint m = 0u; m < word(level + level_products); ++m) {
    if (factors[m] == 0.0) continue;
    uint first = word(sky) + 27u * word(pairs + 2u * m + 1u);
    vec3 psi = vec3(0.0);
    for (uint k = 0u; k < 9u; ++k) psi += vector_at(first + 3u * k) * around[k];
    from_around += factors[m] * psi;
  }
  radiance += clamp_to_finite(scale * from_zero(from_around, largest));
#endif
  sum.rgb += from_zero(radiance, 1e30);
}

// Lights in the fabric's frame; light from all around comes last.
uint lamp_count() {
#ifdef AROUND
  return light_count() + around_lamps;
#else
  return light_count();
#endif
}
void lamp_at(uint i, mat3 frame, out vec3 l, out vec3 irradiance) {
#ifdef AROUND
  if (i >= light_count()) {
    around_lamp(i - light_count(), l, irradiance);
    // The dark side of what a scene hides from itself is below 0 here and there.
    if (lit_side < 0.0) irradiance = max(irradiance, vec3(0.0));
    return;
  }
#endif
  vec3 direction;
  light_at(i, direction, irradiance);
  l = direction * frame * vec3(1.0, 1.0, lit_side);
}

// Evaluates a texel under all lights, seen from `view`: adds weight * alpha * (radiance, 1).
void shade_texel(uint fabric_index, uint level_index, uint texel, vec3 view, mat3 frame, float weight,
                 inout vec4 sum) {
  uint fabric = word(fabric_index);
  uint level = word(fabric + fabric_level_places + level_index);
  uint views = word(fabric + fabric_view_columns) * word(fabric + fabric_view_rows);
  uint lights = word(fabric + fabric_light_columns) * word(fabric + fabric_light_rows);
  uint table = word(level + level_view_table);
  uint opacity = word(level + level_opacity);
  uint light_table = word(level + level_light_table);
  uint products = word(level + level_products);
  Taps view_taps = taps_of(word(fabric + fabric_view_columns), word(fabric + fabric_view_rows), view);
  vec3 of_view = vec3(1.0);
  float alpha = 1.0;
  if (table != 0u || opacity != 0u) {
    vec3 colour = vec3(0.0);
    float total = 0.0;
    for (int tap = 0; tap < 4; ++tap) {
      uint at = texel * views + view_taps.cell[tap];
      float share = view_taps.weight[tap];
      if (opacity != 0u) share *= table_number(opacity, word(level + level_opacity_halves) != 0u, at);
      total += share;
      if (table != 0u) colour += share * table_vector(table, word(level + level_view_table_halves) != 0u, 3u * at);
    }
    if (opacity != 0u) alpha = min(total, 1.0);
    if (table != 0u) of_view = total > 0.0 ? clamp_to_finite(colour / total) : vec3(0.0);
  }
  sum.a += weight * alpha;
  if (!(view.z > 0.0) || !(alpha > 0.0)) return;

  vec3 normal = vec3(0.0, 0.0, 1.0);
  vec3 tangent = vec3(1.0, 0.0, 0.0);
  if (word(level + level_frames) != 0u) {
    normal = vector_at(word(level + level_frames) + 6u * texel);
    tangent = vector_at(word(level + level_frames) + 6u * texel + 3u);
  }
  mat3 local = mat3(tangent, cross(normal, tangent), normal);
  vec3 local_view = view * local;
  uint lobes = word(level + level_lobe_count);
  uint own_lobes = word(level + level_lobes) == 0u ? 0u : word(level + level_lobes) + texel * 3u * (1u + 4u * lobes);
  clear_coefficients(level);
  add_coefficients(level, texel, 1.0);
  see(fabric, level, view_taps);
  float scale = number(fabric + fabric_radiance_scale);
  vec3 radiance = vec3(0.0);
  for (uint i = 0u; i < lamp_count(); ++i) {
    vec3 l;
    vec3 irradiance;
    lamp_at(i, frame, l, irradiance);
    if (!(l.z > 0.0)) continue;
    vec3 bracket = of_view;
    if (light_table != 0u || products != 0u) {
      Taps taps = taps_of(word(fabric + fabric_light_columns), word(fabric + fabric_light_rows), l);
      if (table == 0u && light_table == 0u) bracket = vec3(0.0);
      if (light_table != 0u) {
        vec3 of_light = vec3(0.0);
        for (int tap = 0; tap < 4; ++tap) {
          of_light += taps.weight[tap] *
                      table_vector(light_table, word(level + level_light_table_halves) != 0u, 3u * (texel * lights + taps.cell[tap]));
        }
        bracket *= of_light;
      }
      if (products != 0u) bracket += lit_products(fabric, level, taps);
      bracket = from_zero(bracket, largest);
    }
    vec3 l_local = l * local;
    vec3 g = own_lobes == 0u ? vec3(max(l_local.z, 0.0)) : lobes_at(own_lobes, lobes, l_local, local_view);
    radiance += clamp_to_finite(scale * clamp_to_finite(bracket * g)) * irradiance;
  }
  sum.rgb += weight * alpha * from_zero(radiance, 1e30);
}

// Shader texts for materials without a fabric: what a pixel sees of one (both paths write it down), and the
// light on it (the twin of pbr_brdf.h, for the path that evaluates with OpenGL).
#pragma once

namespace selvedge {

/// For vertex shaders: hands coordinates and colours on by pass_pbr(). MAPPINGS is their number, 1 at least.
inline constexpr const char* pbr_vertex_glsl = R"(
#if MAPPINGS > 1
layout(location = 3) in vec2 more_uv[MAPPINGS - 1];
out vec2 surface_more_uv[MAPPINGS - 1];
#endif
#ifdef VERTEX_COLOURS
layout(location = 7) in vec4 vertex_colour;
out vec4 surface_colour;
#endif
void pass_pbr() {
#if MAPPINGS > 1
  surface_more_uv = more_uv;
#endif
#ifdef VERTEX_COLOURS
  surface_colour = vertex_colour;
#endif
}
)";

/// For fragment shaders, after `in vec2 surface_uv`: write_pbr() writes PbrPixel (surface_material.h) and
/// tells whether there is anything to see. Derivatives are taken in it: nothing may be discarded before.
inline constexpr const char* pbr_fragment_glsl = R"(
layout(location = 20) uniform int is_pbr;  // else the surface has a fabric, and of the material only emission
layout(location = 21) uniform vec4 pbr_base_color;
layout(location = 22) uniform float pbr_opaque_from;  // mask: below this opacity nothing is drawn
layout(location = 23) uniform int pbr_keeps_opacity;
// Four bits for each of the five textures: its coordinates; 15 where there is none.
layout(location = 24) uniform int pbr_textures;
layout(location = 25) uniform vec4 pbr_factors;  // metal, roughness, scale of normals, strength of occlusion
layout(location = 26) uniform vec3 pbr_emission;
layout(binding = 3) uniform sampler2D base_color_texture;
layout(binding = 4) uniform sampler2D metallic_roughness_texture;
layout(binding = 5) uniform sampler2D normal_texture;
layout(binding = 6) uniform sampler2D occlusion_texture;
layout(binding = 7) uniform sampler2D emissive_texture;
#if MAPPINGS > 1
in vec2 surface_more_uv[MAPPINGS - 1];
#endif
#ifdef VERTEX_COLOURS
in vec4 surface_colour;
#endif
layout(location = 1) out vec4 out_colour;
layout(location = 2) out uvec4 out_pbr;

int mapping_of(int which) { return (pbr_textures >> (4 * which)) & 15; }
vec2 uv_of(int mapping) {
#if MAPPINGS > 1
  if (mapping > 0) return surface_more_uv[mapping - 1];
#endif
  return surface_uv;
}

bool write_pbr() {
  vec4 colour = pbr_base_color;
#ifdef VERTEX_COLOURS
  colour *= surface_colour;
#endif
  vec2 metal = pbr_factors.xy;
  vec2 slope = vec2(0.0);
  float occlusion = 1.0;
  vec3 emission = pbr_emission;
  int mapping = mapping_of(0);
  if (mapping < 15) colour *= texture(base_color_texture, uv_of(mapping));
  mapping = mapping_of(1);
  if (mapping < 15) metal *= texture(metallic_roughness_texture, uv_of(mapping)).bg;
  mapping = mapping_of(2);
  if (mapping < 15) {
    vec3 n = texture(normal_texture, uv_of(mapping)).xyz * 2.0 - 1.0;
    n.xy *= pbr_factors.z;
    slope = n.xy * inversesqrt(max(dot(n, n), 1e-12));
  }
  mapping = mapping_of(3);
  if (mapping < 15) occlusion += pbr_factors.w * (texture(occlusion_texture, uv_of(mapping)).r - 1.0);
  mapping = mapping_of(4);
  if (mapping < 15) emission *= texture(emissive_texture, uv_of(mapping)).rgb;
  bool shows = is_pbr == 0 || colour.a >= pbr_opaque_from;
  if (pbr_keeps_opacity == 0) colour.a = 1.0;
  emission = clamp(emission, 0.0, 65504.0);
  out_colour = colour;
  out_pbr = uvec4(packSnorm2x16(slope), packUnorm2x16(metal), packHalf2x16(emission.rg),
                   packHalf2x16(vec2(emission.b, occlusion)));
  return shows;
}
)";

/// pbr_brdf.h. pbr_light() is the radiance of a surface without fabric; the caller defines light_count()
/// and light_at() as for shader_evaluation_glsl. `frame` is that of the garment, `side` -1 where the back is
/// seen.
inline constexpr const char* pbr_shading_glsl = R"(
float fifth_power_below(float x) {
  float rest = max(1.0 - x, 0.0);
  return rest * rest * (rest * rest) * rest;
}
vec3 pbr_brdf(vec3 base, float metallic, float roughness, vec3 n, vec3 v, vec3 l) {
  const float pi = 3.14159265358979324;
  float nl = max(dot(n, l), 0.0);
  float nv = abs(dot(n, v));
  vec3 h = v + l;
  h *= inversesqrt(max(dot(h, h), 1e-12));
  float nh = dot(n, h);
  float alpha = roughness * roughness;
  float a2 = max(alpha * alpha, 1e-6);
  vec3 c = cross(n, h);
  float spread = nh * nh * a2 + dot(c, c);
  float d = nh > 0.0 ? a2 / (pi * spread * spread) : 0.0;
  float visibility = 1.0 / ((nl + sqrt(a2 + (1.0 - a2) * nl * nl)) * (nv + sqrt(a2 + (1.0 - a2) * nv * nv)));
  vec3 f0 = mix(vec3(0.04), base, metallic);
  vec3 f = f0 + (1.0 - f0) * fifth_power_below(dot(v, h));
  return ((1.0 - f) * base * ((1.0 - metallic) / pi) + f * (visibility * d)) * nl;
}
vec3 pbr_ambient(vec3 base, float metallic, float roughness, vec3 n, vec3 v) {
  vec3 f0 = mix(vec3(0.04), base, metallic);
  vec3 f = f0 + (max(vec3(1.0 - roughness), f0) - f0) * fifth_power_below(abs(dot(n, v)));
  return (1.0 - f) * base * (1.0 - metallic) + f;
}

vec3 pbr_emission(uvec4 words) { return vec3(unpackHalf2x16(words.z), unpackHalf2x16(words.w).x); }

vec3 pbr_light(vec3 base, uvec4 words, bool unlit, float ambient, mat3 frame, float side, vec3 view) {
  if (unlit) return base / 3.14159265358979324;
  vec2 slope = unpackSnorm2x16(words.x);
  vec2 metal = unpackUnorm2x16(words.y);
  vec3 n = normalize(frame * vec3(slope * side, sqrt(max(1.0 - dot(slope, slope), 0.0))));
  float occlusion = unpackHalf2x16(words.w).y;
  vec3 sum = pbr_ambient(base, metal.x, metal.y, n, view) * (ambient * occlusion) + pbr_emission(words);
  for (uint i = 0u; i < light_count(); ++i) {
    vec3 direction;
    vec3 irradiance;
    light_at(i, direction, irradiance);
    sum += pbr_brdf(base, metal.x, metal.y, n, view, direction) * irradiance;
  }
  return sum;
}
)";

}  // namespace selvedge

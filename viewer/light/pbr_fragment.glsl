// For fragment shaders: write_pbr() writes a PbrPixel (viewer/scene/material.h) and returns
// whether anything is visible. It takes derivatives: nothing may be discarded before it.
in vec2 surface_uv;
layout(location = 20) uniform int is_pbr;  // else the surface has a fabric, and what PbrMaterial says of one
layout(location = 21) uniform vec4 pbr_base_color;
layout(location = 22) uniform float pbr_opaque_from;  // mask: below this opacity nothing is drawn
layout(location = 23) uniform int pbr_keeps_opacity;
// Four bits for each of the five textures: its mapping; 15 without a texture. Then PbrMaterial::normal_frame.
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
  vec4 of_metal = mapping < 15 ? texture(metallic_roughness_texture, uv_of(mapping)) : vec4(1.0);
  if (is_pbr != 0)
    metal *= of_metal.bg;
  else
    colour.a = of_metal.a;
  mapping = mapping_of(2);
  if (mapping < 15) {
    vec3 n = texture(normal_texture, uv_of(mapping)).xyz * 2.0 - 1.0;
    n.xy *= pbr_factors.z;
    slope = n.xy * inversesqrt(max(dot(n, n), 1e-12));
    mapping = mapping_of(5);
    if (mapping > 0) {
      vec2 along = uv_of(mapping);
      vec2 up = uv_of(mapping + 1);
      slope = along * (slope.x * inversesqrt(max(dot(along, along), 1e-12))) +
              up * (slope.y * inversesqrt(max(dot(up, up), 1e-12)));
    }
  }
  mapping = mapping_of(3);
  if (mapping < 15) occlusion += pbr_factors.w * (texture(occlusion_texture, uv_of(mapping)).r - 1.0);
  mapping = mapping_of(4);
  if (mapping < 15) emission *= texture(emissive_texture, uv_of(mapping)).rgb;
  bool shows = colour.a >= pbr_opaque_from;
  if (pbr_keeps_opacity == 0) colour.a = 1.0;
  emission = clamp(emission, 0.0, 65504.0);
  out_colour = colour;
  out_pbr = uvec4(packSnorm2x16(slope), packUnorm2x16(metal), packHalf2x16(emission.rg),
                   packHalf2x16(vec2(emission.b, occlusion)));
  return shows;
}

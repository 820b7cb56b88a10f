// The two shaders of the index pass. They look nothing up and light nothing: they write down, per pixel,
// which texels the processor has to evaluate, and in which frame.
#pragma once

namespace selvedge {

inline constexpr const char* index_vertex_shader = R"(#version 450 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in vec2 uv;

layout(location = 0) uniform mat4 to_clip;

out vec3 surface_normal;
out vec4 surface_tangent;
out vec2 surface_uv;
// The layers compare depths of several passes for equality.
invariant gl_Position;

void main() {
  gl_Position = to_clip * vec4(position, 1.0);
  surface_normal = normal;
  surface_tangent = tangent;
  surface_uv = uv;
}
)";

inline constexpr const char* index_fragment_shader = R"(#version 450 core
in vec3 surface_normal;
in vec4 surface_tangent;
in vec2 surface_uv;

layout(location = 1) uniform int surface;         // number that marks the pixel; 0 is an empty pixel
layout(location = 2) uniform int has_fabric;
layout(location = 3) uniform int level_mode;      // -1: one level, -2: two levels, k >= 0: always level k
layout(location = 4) uniform int last_level;
layout(location = 5) uniform int layer;
layout(location = 6) uniform vec4 base_color;
layout(location = 7) uniform int has_texture;
layout(location = 8) uniform float opaque_from;   // mask: below this opacity nothing is drawn
layout(location = 9) uniform int keeps_opacity;

// x, y: the texel's own position; z: the number of its level. Nearest texel, nearest level.
layout(binding = 0) uniform usampler2D index_texture;
// The number of the level. Nearest texel, linear between levels.
layout(binding = 1) uniform sampler2D level_texture;
layout(binding = 2) uniform sampler2D base_color_texture;
layout(binding = 3) uniform sampler2D depth_before;
layout(binding = 4) uniform usampler2D finished;

layout(location = 0) out vec4 out_normal;    // xyz: normal; w: weight of the second level
layout(location = 1) out vec4 out_surface;   // fabric: tangent, handedness; else: base colour, opacity
layout(location = 2) out uvec4 out_texels;   // x, y in the first level; x, y in the second
layout(location = 3) out uvec4 out_marks;    // surface, first level, second level, 1 on the back

void main() {
  uvec4 texels = uvec4(0u);
  uvec2 levels = uvec2(0u);
  float weight = 0.0;
  vec4 surface_value = surface_tangent;
  if (has_fabric != 0) {
    if (level_mode == -1) {
      uvec4 chosen = texture(index_texture, surface_uv);
      texels = chosen.xyxy;
      levels = chosen.zz;
    } else {
      float level = level_mode >= 0 ? float(level_mode) : texture(level_texture, surface_uv).r;
      level = clamp(level, 0.0, float(last_level));
      float first = floor(level);
      float second = min(first + 1.0, float(last_level));
      weight = level - first;
      texels = uvec4(textureLod(index_texture, surface_uv, first).xy,
                     textureLod(index_texture, surface_uv, second).xy);
      levels = uvec2(first, second);
    }
  } else {
    surface_value = base_color;
    if (has_texture != 0) surface_value *= texture(base_color_texture, surface_uv);
  }
  // Only here: implicit derivatives need all four pixels of a quad.
  if (layer > 0) {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (texelFetch(finished, pixel, 0).r != 0u) discard;
    if (gl_FragCoord.z <= texelFetch(depth_before, pixel, 0).r) discard;
  }
  if (has_fabric == 0) {
    if (surface_value.a < opaque_from) discard;
    if (keeps_opacity == 0) surface_value.a = 1.0;
  }
  out_normal = vec4(surface_normal, weight);
  out_surface = surface_value;
  out_texels = texels;
  out_marks = uvec4(uint(surface), levels, gl_FrontFacing ? 0u : 1u);
}
)";

}  // namespace selvedge

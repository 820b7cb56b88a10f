// The shaders of the visibility pass. They light nothing: they write down, per pixel, which triangle the
// processor has to look at.
#pragma once

#include <string>

namespace selvedge {

inline constexpr const char* visibility_vertex_shader = R"(#version 450 core
layout(location = 0) in vec4 clip;
layout(location = 1) in vec2 uv;

out vec2 surface_uv;
// Rounds compare depths of several passes.
invariant gl_Position;

void main() {
  gl_Position = clip;
  surface_uv = uv;
}
)";

/// `colours`: the scene has surfaces without fabric. `later`: what lies behind the round before.
inline std::string visibility_fragment_shader(bool colours, bool later) {
  std::string text = "#version 450 core\n";
  if (colours) text += "#define COLOURS\n";
  if (later) text += "#define LATER\n";
  return text + R"(
in vec2 surface_uv;

layout(location = 0) uniform int first_triangle;  // of the list, the number of the first that is drawn
#ifdef COLOURS
layout(location = 1) uniform int has_surface_colour;
layout(location = 2) uniform vec4 base_color;
layout(location = 3) uniform int has_texture;
layout(location = 4) uniform float opaque_from;   // mask: below this opacity nothing is drawn
layout(location = 5) uniform int keeps_opacity;
layout(binding = 0) uniform sampler2D base_color_texture;
layout(location = 1) out vec4 out_colour;
#endif
#ifdef LATER
layout(binding = 1) uniform sampler2D depth_before;
#endif
layout(location = 0) out uint out_triangle;

void main() {
#ifdef COLOURS
  vec4 colour = base_color;
  if (has_texture != 0) colour *= texture(base_color_texture, surface_uv);
  if (has_surface_colour != 0 && colour.a < opaque_from) discard;
  if (keeps_opacity == 0) colour.a = 1.0;
  out_colour = colour;
#endif
#ifdef LATER
  // Only here: implicit derivatives need all four pixels of a quad.
  if (gl_FragCoord.z <= texelFetch(depth_before, ivec2(gl_FragCoord.xy), 0).r) discard;
#endif
  out_triangle = uint(first_triangle + gl_PrimitiveID);
}
)";
}

}  // namespace selvedge

// The shaders of the visibility pass. They light nothing: they write down, per pixel, which triangle the
// processor has to look at.
#pragma once

#include <string>

#include "viewer/light/pbr_glsl.h"

namespace selvedge {

/// `definitions`: PbrInputs::definitions().
inline std::string visibility_vertex_shader(const std::string& definitions) {
  return "#version 450 core\n" + definitions + (definitions.empty() ? "" : pbr_vertex_glsl) + R"(
layout(location = 0) in vec4 clip;
layout(location = 1) in vec2 uv;

out vec2 surface_uv;
// Rounds compare depths of several passes.
invariant gl_Position;

void main() {
  gl_Position = clip;
  surface_uv = uv;
#ifdef CORE
  pass_pbr();
#endif
}
)";
}

/// `later`: what lies behind the round before.
inline std::string visibility_fragment_shader(const std::string& definitions, bool later) {
  return "#version 450 core\n" + definitions + (later ? "#define LATER\n" : "") + R"(
in vec2 surface_uv;
)" + (definitions.empty() ? "" : pbr_fragment_glsl) +
         R"(
layout(location = 0) uniform int first_triangle;  // of the list, the number of the first that is drawn
#ifdef LATER
layout(binding = 1) uniform sampler2D depth_before;
#endif
layout(location = 0) out uint out_triangle;

void main() {
#ifdef CORE
  if (!write_pbr()) discard;
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

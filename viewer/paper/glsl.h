// The shaders of the paper's passes: what its hardware did without shaders.
#pragma once

#include <string>

namespace selvedge {

/// `what`: NORMALS, TANGENTS or TEXELS; they write the colours of paper_coding.h.
inline std::string paper_vertex_shader(const char* what) {
  return std::string("#version 450 core\n#define ") + what + R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in vec2 uv;
layout(location = 0) uniform mat4 to_clip;

out vec2 texture_coordinates;
out vec4 colour;
// The passes compare depths for equality.
invariant gl_Position;

void main() {
  gl_Position = to_clip * vec4(position, 1.0);
  texture_coordinates = uv;
#if defined(NORMALS)
  colour = vec4((normal + 1.0) / 2.0, 1.0);
#elif defined(TANGENTS)
  colour = vec4((tangent.xyz + 1.0) / 2.0, tangent.w);
#else
  colour = vec4(0.0);
#endif
}
)";
}

/// `later`: only what lies behind the round before.
inline std::string paper_fragment_shader(const char* what, bool later) {
  return std::string("#version 450 core\n#define ") + what + (later ? "\n#define LATER\n" : "\n") + R"(
in vec2 texture_coordinates;
in vec4 colour;

layout(location = 1) uniform int culls_back;
layout(location = 2) uniform int kind;        // alpha of the front's normals, less 1 than that of the back's
layout(location = 3) uniform float level_bias;
layout(binding = 0) uniform sampler2D index_texture;
layout(binding = 1) uniform sampler2D depth_before;
layout(location = 0) out vec4 out_colour;

void main() {
#if defined(NORMALS)
  out_colour = vec4(colour.rgb, float(gl_FrontFacing ? kind : kind + 1) / 255.0);
#elif defined(TANGENTS)
  out_colour = colour;
#else
  out_colour = texture(index_texture, texture_coordinates, level_bias);
#endif
  // Only here: implicit derivatives need all four pixels of a quad.
  if (culls_back != 0 && !gl_FrontFacing) discard;
#ifdef LATER
  if (gl_FragCoord.z <= texelFetch(depth_before, ivec2(gl_FragCoord.xy), 0).r) discard;
#endif
}
)";
}

}  // namespace selvedge

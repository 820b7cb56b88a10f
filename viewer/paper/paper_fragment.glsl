// The fragment shader of the paper's passes, with the definitions of paper_vertex.glsl. LATER: draws only
// what lies behind the previous round.
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
  // Discard only here: implicit derivatives need all four pixels of a quad.
  if (culls_back != 0 && !gl_FrontFacing) discard;
#ifdef LATER
  if (gl_FragCoord.z <= texelFetch(depth_before, ivec2(gl_FragCoord.xy), 0).r) discard;
#endif
}

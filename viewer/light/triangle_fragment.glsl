// Writes the visible triangle's index in a list of triangles by visible side. LATER: draws only what lies behind the
// previous round. PBR: some material has no fabric (follows pbr_fragment.glsl).
layout(location = 1) uniform int first_triangle;  // the number of the first triangle of a draw call
layout(binding = 1) uniform sampler2D depth_before;
layout(location = 0) out uint out_triangle;

void main() {
#ifdef PBR
  if (!write_pbr()) discard;
#endif
#ifdef LATER
  // Discard only here: implicit derivatives need all four pixels of a quad.
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  if (gl_FragCoord.z <= texelFetch(depth_before, pixel, 0).r) discard;
#endif
  out_triangle = uint(first_triangle + gl_PrimitiveID);
}

// Writes the number of the visible triangle. LISTED: the index in a list of triangles by visible side; else
// it counts from 1, with the highest bit set if the back is visible. LATER: draws only what lies behind the
// previous round. PBR: some material has no fabric (follows pbr_fragment.glsl).
layout(location = 1) uniform int first_triangle;  // the number of the first triangle of a draw call
#ifndef LISTED
layout(location = 2) uniform int culls_back;
layout(binding = 2) uniform sampler2D frame_before;
#endif
layout(binding = 1) uniform sampler2D depth_before;
layout(location = 0) out uint out_triangle;

void main() {
#ifdef PBR
  if (!write_pbr()) discard;
#endif
#ifndef LISTED
  if (culls_back != 0 && !gl_FrontFacing) discard;
#endif
#ifdef LATER
  // Discard only here: implicit derivatives need all four pixels of a quad.
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  if (gl_FragCoord.z <= texelFetch(depth_before, pixel, 0).r) discard;
#ifndef LISTED
  // Opaque to within half a step of an 8-bit picture.
  if (1.0 - texelFetch(frame_before, pixel, 0).a < 0.5 / 255.0) discard;
#endif
#endif
  out_triangle = uint(first_triangle + gl_PrimitiveID);
#ifndef LISTED
  if (!gl_FrontFacing) out_triangle |= 0x80000000u;
#endif
}

// Projects the triangles for triangle_fragment.glsl. LISTED: vertices are already projected. PBR: some
// material has no fabric (follows pbr_vertex.glsl).
#ifdef LISTED
layout(location = 0) in vec4 clip;
layout(location = 1) in vec2 uv;
#else
layout(location = 0) in vec3 position;
layout(location = 1) in float u;
layout(location = 2) in float v;
layout(location = 0) uniform mat4 to_clip;
#endif

out vec2 surface_uv;
// Rounds compare depths between passes.
invariant gl_Position;

void main() {
#ifdef LISTED
  gl_Position = clip;
  surface_uv = uv;
#else
  gl_Position = to_clip * vec4(position, 1.0);
  surface_uv = vec2(u, v);
#endif
#ifdef PBR
  pass_pbr();
#endif
}

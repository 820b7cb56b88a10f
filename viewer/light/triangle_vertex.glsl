// Passes on projected triangles to triangle_fragment.glsl. PBR: some material has no fabric (follows pbr_vertex.glsl).
layout(location = 0) in vec4 clip;
layout(location = 1) in vec2 uv;

out vec2 surface_uv;
// Rounds compare depths between passes.
invariant gl_Position;

void main() {
  gl_Position = clip;
  surface_uv = uv;
#ifdef PBR
  pass_pbr();
#endif
}

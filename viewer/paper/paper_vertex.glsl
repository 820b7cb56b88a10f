// The vertex shader of the paper's passes, which its hardware did without. One of NORMALS, TANGENTS and
// TEXELS is defined: the colour of viewer/paper/coding.h to write.
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 tangent;
layout(location = 3) in vec2 uv;
layout(location = 0) uniform mat4 to_clip;

out vec2 texture_coordinates;
out vec4 colour;
// Passes compare depths for equality.
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

// Projects surfaces to a light's view by the rows of a ShadowView.
layout(location = 0) in vec3 position;
layout(location = 0) uniform vec4 row_x;
layout(location = 1) uniform vec4 row_y;
layout(location = 2) uniform vec4 row_z;
layout(location = 3) uniform vec4 row_w;
layout(location = 4) uniform float size;
#ifdef MASKED
layout(location = 1) in vec2 uv;
out vec2 mask_uv;
#endif
void main() {
#ifdef MASKED
  mask_uv = uv;
#endif
  vec4 p = vec4(position, 1.0);
  float w = dot(row_w, p);
  gl_Position = vec4(dot(row_x, p) * (2.0 / size) - w, dot(row_y, p) * (2.0 / size) - w, dot(row_z, p) * 2.0 - w, w);
}

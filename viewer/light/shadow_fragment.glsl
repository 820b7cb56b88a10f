// Shadow maps hold only the depth. MASKED: a mask cuts the surface.
#ifdef MASKED
layout(binding = 0) uniform sampler2D mask;
layout(location = 5) uniform float cutoff;
in vec2 mask_uv;
#endif
void main() {
#ifdef MASKED
  if (texture(mask, mask_uv).a < cutoff) discard;
#endif
}

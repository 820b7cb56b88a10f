// Looks up shadow maps: the GLSL twin of shadow_share() (viewer/light/shadows.h), held to it by tests. `map`
// counts from 0.
layout(binding = 3) uniform sampler2DArray shadow_depths;
// Five per map: the rows of the projection; the side in texels and that of a texel in metres.
layout(std430, binding = 5) readonly buffer Shadows { vec4 shadow_rows[]; };

float shadow_share(uint map, vec3 point, vec3 normal, vec3 light) {
  float cosine = dot(normal, light);
  if (!(cosine > 0.0)) return 0.0;
  uint at_map = 5u * map;
  vec4 row_w = shadow_rows[at_map + 3u];
  float texel = shadow_rows[at_map + 4u].y * dot(row_w, vec4(point, 1.0));
  float sine = sqrt(max(1.0 - cosine * cosine, 0.0));
  vec4 p = vec4(point + normal * (texel * shadow_normal_offset * sine) + light * (texel * shadow_light_offset), 1.0);
  float w = dot(row_w, p);
  if (!(w > 0.0)) return 1.0;
  vec3 at = vec3(dot(shadow_rows[at_map], p), dot(shadow_rows[at_map + 1u], p), dot(shadow_rows[at_map + 2u], p)) / w;
  vec2 corner = at.xy - 0.5;
  vec2 first = floor(corner);
  float last = shadow_rows[at_map + 4u].x - 3.0;
  if (!(first.x >= 1.0 && first.y >= 1.0 && first.x <= last && first.y <= last)) return 1.0;
  vec2 part = corner - first;
  vec4 columns = vec4(1.0 - part.x, 1.0, 1.0, part.x);
  vec4 rows = vec4(1.0 - part.y, 1.0, 1.0, part.y);
  float sum = 0.0;
  for (int j = 0; j < 4; ++j) {
    float row = 0.0;
    for (int i = 0; i < 4; ++i) {
      float depth = texelFetch(shadow_depths, ivec3(ivec2(first) + ivec2(i - 1, j - 1), int(map)), 0).r;
      row += depth >= at.z ? columns[i] : 0.0;
    }
    sum += row * rows[j];
  }
  return sum / 9.0;
}

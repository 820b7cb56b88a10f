// The lights at garment_point, and, with AROUND, from all around; SHADOWS: dimmed by shadow_shares, which the includer computes for the pixel. Four per
// light: direction towards it (spot: against its axis) and kind (0 directional, 1 point, 2 spot); irradiance and
// range; position and where the cone begins; where it ends, 1 + the number of its shadow map, whether it is of an
// environment.
layout(std430, binding = 4) readonly buffer Lights { vec4 lights[]; };
layout(location = 5) uniform int lights_in_use;

float share_of_lamps = 1.0;  // of an environment, that a texture leaves a fabric
vec3 garment_point;  // relative to the origin of the vertices
uint light_count() { return uint(lights_in_use); }
bool is_of_environment(uint i) { return lights[4u * i + 3u].z != 0.0; }
void open_light_at(uint i, out vec3 direction, out vec3 irradiance) {
  vec4 towards_kind = lights[4u * i];
  vec4 irradiance_range = lights[4u * i + 1u];
  direction = towards_kind.xyz;
  irradiance = irradiance_range.xyz;
  if (towards_kind.w == 0.0) return;
  // As light_share_at() (lights.h).
  vec3 towards = lights[4u * i + 2u].xyz - garment_point;
  float distance2 = dot(towards, towards);
  if (!(distance2 > 0.0)) {
    irradiance = vec3(0.0);
    return;
  }
  direction = towards * inversesqrt(distance2);
  float share = 1.0 / distance2;
  float range = irradiance_range.w;
  if (range > 0.0) {
    float r2 = distance2 / (range * range);
    share *= clamp(1.0 - r2 * r2, 0.0, 1.0);
  }
  if (towards_kind.w == 2.0) {
    float cos_inner = lights[4u * i + 2u].w;
    float cos_outer = lights[4u * i + 3u].x;
    float t = clamp((dot(direction, towards_kind.xyz) - cos_outer) / max(cos_inner - cos_outer, 1e-3), 0.0, 1.0);
    share *= t * t;
  }
  irradiance *= min(share, 1e24);
}
#ifdef AROUND
// Factors of the functions in world axes, 27 numbers for all and then for each vertex, or for all alone and the stride is 0.
layout(std430, binding = 6) readonly buffer Around { float around_factors[]; };
layout(location = 12) uniform int around_stride;
vec3 around_factor(int first, int k) {
  int at = first + 3 * k;
  return vec3(around_factors[at], around_factors[at + 1], around_factors[at + 2]);
}
#endif
#ifdef SHADOWS
// Indexed by shadow map.
float shadow_shares[16];
#endif
void light_at(uint i, out vec3 direction, out vec3 irradiance) {
  open_light_at(i, direction, irradiance);
  if (is_of_environment(i)) irradiance *= share_of_lamps;
#ifdef SHADOWS
  int map = int(lights[4u * i + 3u].y);
  if (map > 0) irradiance *= shadow_shares[map - 1];
#endif
}

// Shades materials without a fabric: the GLSL twin of viewer/light/pbr_brdf.h, held to it by tests.
// pbr_light() returns radiance. The includer defines light_count() and light_at()
// (viewer/shader/evaluate.glsl). `frame` is that of the garment; `side` is -1 if the back is visible. AROUND: around.glsl
// comes first.
float fifth_power_below(float x) {
  float rest = max(1.0 - x, 0.0);
  return rest * rest * (rest * rest) * rest;
}
vec3 pbr_brdf(vec3 base, float metallic, float roughness, vec3 n, vec3 v, vec3 l) {
  const float pi = 3.14159265358979324;
  float nl = max(dot(n, l), 0.0);
  float nv = abs(dot(n, v));
  vec3 h = v + l;
  h *= inversesqrt(max(dot(h, h), 1e-12));
  float nh = dot(n, h);
  float alpha = roughness * roughness;
  float a2 = max(alpha * alpha, 1e-6);
  vec3 c = cross(n, h);
  float spread = nh * nh * a2 + dot(c, c);
  float d = nh > 0.0 ? a2 / (pi * spread * spread) : 0.0;
  float visibility = 1.0 / ((nl + sqrt(a2 + (1.0 - a2) * nl * nl)) * (nv + sqrt(a2 + (1.0 - a2) * nv * nv)));
  vec3 f0 = mix(vec3(0.04), base, metallic);
  vec3 f = f0 + (1.0 - f0) * fifth_power_below(dot(v, h));
  return ((1.0 - f) * base * ((1.0 - metallic) / pi) + f * (visibility * d)) * nl;
}
vec3 pbr_ambient(vec3 base, float metallic, float roughness, vec3 n, vec3 v) {
  vec3 f0 = mix(vec3(0.04), base, metallic);
  vec3 f = f0 + (max(vec3(1.0 - roughness), f0) - f0) * fifth_power_below(abs(dot(n, v)));
  return (1.0 - f) * base * (1.0 - metallic) + f;
}

vec3 pbr_emission(uvec4 words) { return vec3(unpackHalf2x16(words.z), unpackHalf2x16(words.w).x); }

vec3 pbr_light(vec3 base, uvec4 words, bool unlit, float ambient, mat3 frame, float side, vec3 view) {
  if (unlit) return base / 3.14159265358979324;
  vec2 slope = unpackSnorm2x16(words.x);
  vec2 metal = unpackUnorm2x16(words.y);
  vec3 n = normalize(frame * vec3(slope * side, sqrt(max(1.0 - dot(slope, slope), 0.0))));
  float occlusion = unpackHalf2x16(words.w).y;
  vec3 from_around = vec3(ambient);
#ifdef AROUND
  from_around += mean_around(n * frame);
#endif
  vec3 sum = pbr_ambient(base, metal.x, metal.y, n, view) * (from_around * occlusion) + pbr_emission(words);
  for (uint i = 0u; i < light_count(); ++i) {
    vec3 direction;
    vec3 irradiance;
    light_at(i, direction, irradiance);
    sum += pbr_brdf(base, metal.x, metal.y, n, view, direction) * irradiance;
  }
  return sum;
}

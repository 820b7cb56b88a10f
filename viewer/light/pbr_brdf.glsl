// Shades materials without a fabric: the GLSL twin of viewer/light/pbr_brdf.h, held to it by tests.
// and of light from around in viewer/hybrid/pbr_shading.cpp and viewer/light/reflections.h. pbr_light() returns radiance.
// The includer defines light_count(), light_at() and is_of_environment() (viewer/shader/lights.glsl). `frame` is that of the
// garment; `side` is -1 if the back is visible. AROUND: around.glsl comes first.
const int share_side = 32;
const int reflection_levels = 2 * share_side * share_side;
// reflected_shares(); place and width of each level of Reflections; their radiance.
layout(std430, binding = 7) readonly buffer ReflectionNumbers { float reflections[]; };
#ifdef AROUND
layout(location = 14) uniform int last_reflection;  // 0: there are none
layout(location = 15) uniform vec2 environment;     // its turn, 1 is once around; its strength
#endif
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
  float schlick = fifth_power_below(dot(v, h));
  vec3 f = f0 + (1.0 - f0) * schlick;
  return (base * (0.96 * (1.0 - schlick) * (1.0 - metallic) / pi) + f * (visibility * d)) * nl;
}
vec3 mirrored_more(vec3 f0, vec2 share) {
  float lost = 1.0 - share.x - share.y;
  vec3 average = f0 + (1.0 - f0) / 21.0;
  return lost * (f0 * share.x + share.y) * average / (1.0 - lost * average);
}
vec3 pbr_around(vec3 base, float metallic, vec2 share, vec3 mean, vec3 mirrored) {
  vec3 f0 = mix(vec3(0.04), base, metallic);
  vec3 more = mirrored_more(vec3(0.04), share);
  vec3 diffuse = (1.0 - (0.04 * share.x + share.y) - more) * (1.0 - metallic) * base;
  return (diffuse + mix(more, mirrored_more(base, share), metallic)) * mean + (f0 * share.x + share.y) * mirrored;
}

vec3 pbr_emission(uvec4 words) { return vec3(unpackHalf2x16(words.z), unpackHalf2x16(words.w).x); }

vec2 reflected_share(float roughness, float cosine) {
  vec2 at = clamp(vec2(roughness, cosine), 0.0, 1.0) * float(share_side - 1);
  ivec2 low = min(ivec2(at), share_side - 2);
  vec2 share = at - vec2(low);
  vec2 sum = vec2(0.0);
  for (int k = 0; k < 4; ++k) {
    ivec2 corner = ivec2(k & 1, k >> 1);
    int first = 2 * ((low.x + corner.x) * share_side + low.y + corner.y);
    vec2 weight = mix(1.0 - share, share, vec2(corner));
    sum += weight.x * weight.y * vec2(reflections[first], reflections[first + 1]);
  }
  return sum;
}

#ifdef AROUND
// As Environment::at().
vec3 reflection_level(int level, vec3 d) {
  int at = reflection_levels + 2 * level;
  int first = int(reflections[at]);
  int width = int(reflections[at + 1]);
  const float pi = 3.14159265358979324;
  vec2 place = vec2(fract(atan(d.x, -d.z) / (2.0 * pi) + environment.x + 0.5) * float(width),
                    atan(length(d.xz), d.y) / pi * float(width / 2)) - 0.5;
  vec2 low = floor(place);
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 4; ++k) {
    ivec2 texel = ivec2(low) + ivec2(k & 1, k >> 1);
    vec2 weight = mix(1.0 - place + low, place - low, vec2(k & 1, k >> 1));
    int texel_first = first + 3 * (clamp(texel.y, 0, width / 2 - 1) * width + (texel.x + width) % width);
    sum += weight.x * weight.y *
           vec3(reflections[texel_first], reflections[texel_first + 1], reflections[texel_first + 2]);
  }
  return sum * environment.y;
}
vec3 reflection_at(vec3 d, float roughness) {
  float place = clamp(roughness, 0.0, 1.0) * float(last_reflection);
  int level = min(int(place), last_reflection - 1);
  return mix(reflection_level(level, d), reflection_level(level + 1, d), place - float(level));
}

// The share that the scene leaves of light from all around: along a normal of the frame, which is `n` in the world.
float share_around(vec3 in_frame, vec3 n) {
  if (around_stride == 0) return 1.0;
  vec3 all_factors[9];
  for (int k = 0; k < 9; ++k) all_factors[k] = around_factor(0, k);
  return visible_share(mean_of(around, in_frame), mean_of(all_factors, n));
}
#endif
// Dims what reaches a fabric from all around.
void occlude(float occlusion, vec3 normal) {
#ifndef SHADOWS
  share_of_lamps = occlusion;
#endif
#ifdef AROUND
  float left = min(1.0, occlusion / max(share_around(vec3(0.0, 0.0, 1.0), normal), 1e-3));
  for (int k = 0; k < 9; ++k) around[k] *= left;
#endif
}

vec3 pbr_light(vec3 base, uvec4 words, bool unlit, float ambient, mat3 frame, float side, vec3 view) {
  const float pi = 3.14159265358979324;
  if (unlit) return base / pi;
  vec2 slope = unpackSnorm2x16(words.x);
  vec2 metal = unpackUnorm2x16(words.y);
  vec3 n = normalize(frame * vec3(slope * side, sqrt(max(1.0 - dot(slope, slope), 0.0))));
  float nv = abs(dot(n, view));
  float occlusion = unpackHalf2x16(words.w).y;
  float of_mirrored = clamp(pow(nv + occlusion, exp2(-16.0 * metal.y - 1.0)) - 1.0 + occlusion, 0.0, 1.0);
  vec3 mean = vec3(0.0);
  vec3 mirrored = vec3(0.0);
#ifdef SHADOWS
  float of_lamps = 1.0 / pi;
#else
  float of_lamps = occlusion / pi;
#endif
#ifdef AROUND
  float alpha = metal.y * metal.y;
  vec3 towards = normalize(mix(reflect(-view, n), n, alpha * alpha));
  mean = mean_of(around, n * frame) * min(1.0, occlusion / max(share_around(n * frame, n), 1e-3));
  mirrored = vec3(ambient);
  if (last_reflection > 0) mirrored += reflection_at(towards, metal.y);
  mirrored *= min(share_around(towards * frame, towards), of_mirrored);
#endif
  vec3 sum = pbr_emission(words);
  for (uint i = 0u; i < light_count(); ++i) {
    vec3 direction;
    vec3 irradiance;
    light_at(i, direction, irradiance);
    if (is_of_environment(i))
      mean += irradiance * (max(dot(n, direction), 0.0) * of_lamps);
    else
      sum += pbr_brdf(base, metal.x, metal.y, n, view, direction) * irradiance;
  }
  return sum + pbr_around(base, metal.x, reflected_share(metal.y, nv), mean, mirrored);
}

// Shades a pixel from its triangle number: the GLSL twin of viewer/hybrid/index_pass.h and shade.h. PBR: some
// material has no fabric; SHADOWS: there are shadow maps; YARN: some fabric has yarn; AROUND: there is light from all
// around.
layout(binding = 0) uniform usampler2D triangle_numbers;
#ifdef PBR
// PbrPixel (viewer/scene/material.h).
layout(binding = 1) uniform sampler2D pbr_colours;
layout(binding = 2) uniform usampler2D pbr_words;
#endif
// Three per vertex: position and u, normal and v, tangent and padding.
layout(std430, binding = 1) readonly buffer Vertices { vec4 vertices[]; };
// Corners; surface, with the highest bit set if the tangents are left-handed.
layout(std430, binding = 2) readonly buffer Triangles { uvec4 triangles[]; };
// Number of the fabric or -1; flags: 1 keeps its opacity, 2 unlit, 4 emission; of a fabric: 8 tinted, 16 bent by a normal
// texture, 32 occluded by a texture.
layout(std430, binding = 3) readonly buffer Surfaces { ivec2 surfaces[]; };
layout(location = 0) uniform mat4 to_clip;
layout(location = 1) uniform vec2 frame_size;
layout(location = 2) uniform vec3 ray_base;
layout(location = 3) uniform vec3 ray_right;
layout(location = 4) uniform vec3 ray_up;
#ifdef PBR
layout(location = 10) uniform float ambient;  // DrawOptions::ambient
#endif
#ifdef AROUND
layout(location = 13) uniform int skies;  // place of the fabrics' sky words
#endif

layout(location = 0) out vec4 out_colour;

// Barycentric coordinates of corners 1 and 2, and their change per pixel to the right and up.
struct Interpolation {
  vec2 at;
  vec2 right;
  vec2 up;
};
Interpolation interpolation(uvec3 corner, vec2 pixel) {
  vec3 a;
  vec3 b;
  vec3 w;
  for (int k = 0; k < 3; ++k) {
    vec4 clip = to_clip * vec4(vertices[3u * corner[k]].xyz, 1.0);
    a[k] = clip.x * 0.5 * frame_size.x - pixel.x * clip.w;
    b[k] = clip.y * 0.5 * frame_size.y - pixel.y * clip.w;
    w[k] = clip.w;
  }
  vec3 e = a.yzx * b.zxy - a.zxy * b.yzx;
  float sum = e.x + e.y + e.z;
  float scale = sum != 0.0 ? 1.0 / sum : 0.0;
  vec3 e_right = w.zxy * b.yzx - w.yzx * b.zxy;
  vec3 e_up = a.zxy * w.yzx - a.yzx * w.zxy;
  Interpolation result;
  result.at = e.yz * scale;
  result.right = (e_right.yz - result.at * (e_right.x + e_right.y + e_right.z)) * scale;
  result.up = (e_up.yz - result.at * (e_up.x + e_up.y + e_up.z)) * scale;
  return result;
}

float along(vec2 weights, float a, float b, float c) { return weights.x * (b - a) + weights.y * (c - a); }

void main() {
  uint number_seen = texelFetch(triangle_numbers, ivec2(gl_FragCoord.xy), 0).r;
  if (number_seen == 0u) discard;
  uvec4 triangle = triangles[(number_seen & 0x7fffffffu) - 1u];
  float side = (number_seen & 0x80000000u) != 0u ? -1.0 : 1.0;
  float handedness = (triangle.w & 0x80000000u) != 0u ? -1.0 : 1.0;
  ivec2 surface = surfaces[triangle.w & 0x7fffffffu];
  vec2 pixel = gl_FragCoord.xy - 0.5 * frame_size;
  Interpolation within = interpolation(triangle.xyz, pixel);
  vec4 normal_v[3];
  vec4 tangent_of[3];
  vec3 u;
  for (int k = 0; k < 3; ++k) {
    uint at = 3u * triangle[k];
    u[k] = vertices[at].w;
    normal_v[k] = vertices[at + 1u];
    tangent_of[k] = vertices[at + 2u];
  }
  garment_point = vertices[3u * triangle.x].xyz +
                  within.at.x * (vertices[3u * triangle.y].xyz - vertices[3u * triangle.x].xyz) +
                  within.at.y * (vertices[3u * triangle.z].xyz - vertices[3u * triangle.x].xyz);
  vec3 ray = ray_base + ray_right * pixel.x + ray_up * pixel.y;
  vec3 view = ray * inversesqrt(dot(ray, ray));
  vec3 normal = normal_v[0].xyz + within.at.x * (normal_v[1] - normal_v[0]).xyz +
                within.at.y * (normal_v[2] - normal_v[0]).xyz;
  // The change of the front's unit normal to the right and up, but for what lies along it.
  mat2x3 turn = mat2x3(0.0);
  if ((surface.y & 1) != 0) {
    mat2x3 edges = mat2x3((normal_v[1] - normal_v[0]).xyz, (normal_v[2] - normal_v[0]).xyz);
    turn = edges * mat2(within.right, within.up) * inversesqrt(max(dot(normal, normal), 1e-36));
  }
  normal = unit_or(normal, view * side) * side;
  vec3 t = tangent_of[0].xyz + within.at.x * (tangent_of[1] - tangent_of[0]).xyz +
           within.at.y * (tangent_of[2] - tangent_of[0]).xyz;
#ifdef PBR
  uvec4 pbr = texelFetch(pbr_words, ivec2(gl_FragCoord.xy), 0);
  if ((surface.y & 16) != 0) normal = unit_or(bent_normal(normal, t, unpackSnorm2x16(pbr.x), side, handedness), view);
#endif
  normal = facing_normal(normal, view);

  uint index = surface.x < 0 ? 0u : seen_from(side, uint(surface.x));
#ifdef SHADOWS
  // What comes through leaves the cloth on the light's side, so that it is not in its own shadow.
  bool lets_through = surface.x >= 0 && word(word(index) + fabric_through) != 0u;
  for (uint i = 0u; i < light_count(); ++i) {
    int map = int(lights[4u * i + 3u].y);
    if (map == 0) continue;
    vec3 direction;
    vec3 irradiance;
    open_light_at(i, direction, irradiance);
    vec3 leaving = lets_through && dot(normal, direction) < 0.0 ? -normal : normal;
    shadow_shares[map - 1] = shadow_share(uint(map - 1), garment_point, leaving, direction);
  }
#endif
  vec3 tangent = tangent_across(normal, t);
  vec3 upwards = cross(normal, tangent) * (side * handedness);
  mat3 frame = mat3(tangent, upwards, normal);
  vec3 local_view = view * frame;
#ifdef AROUND
  for (int k = 0; k < 9; ++k) {
    around[k] = vec3(0.0);
    for (int corner = 0; corner < 3; ++corner) {
      float share = corner == 0 ? 1.0 - within.at.x - within.at.y : within.at[corner - 1];
      around[k] += share * around_factor(around_stride * (int(triangle[corner]) + 1), k);
    }
  }
  turn_around_into(frame);
#endif
#ifdef PBR
  if (surface.x < 0) {
    vec4 colour = texelFetch(pbr_colours, ivec2(gl_FragCoord.xy), 0);
    vec3 light = pbr_light(colour.rgb, pbr, (surface.y & 2) != 0, ambient / 3.14159265358979324, frame, side, view);
    float alpha = clamp(colour.a, 0.0, 1.0);
    // Unlike max(), this turns NaN into 0.
    for (int c = 0; c < 3; ++c) light[c] = light[c] >= 0.0 ? min(light[c], 1e30) : 0.0;
    out_colour = vec4(light * alpha, alpha);
    return;
  }
#endif

#ifdef PBR
  if ((surface.y & 32) != 0) occlude(unpackHalf2x16(pbr.w).y, normal);
#endif
  vec3 v = vec3(normal_v[0].w, normal_v[1].w, normal_v[2].w);
  vec2 uv = vec2(u.x - floor(u.x) + along(within.at, u.x, u.y, u.z),
                 v.x - floor(v.x) + along(within.at, v.x, v.y, v.z));
  vec2 right = vec2(along(within.right, u.x, u.y, u.z), along(within.right, v.x, v.y, v.z));
  vec2 up = vec2(along(within.up, u.x, u.y, u.z), along(within.up, v.x, v.y, v.z));

#ifdef AROUND
  sky = uint(skies) + 2u * sky_of_turned * uint(surface.x) + (index == uint(surface.x) ? 0u : sky_of_turned);
#endif
  vec4 sum = shade_fabric(index, uv, right, up, turn, side, local_view, frame);
  if ((surface.y & 1) == 0) sum = sum.a > 0.0 ? sum / sum.a : vec4(0.0, 0.0, 0.0, 1.0);
  sum.a = min(sum.a, 1.0);
#ifdef PBR
  if ((surface.y & 8) != 0) sum.rgb *= texelFetch(pbr_colours, ivec2(gl_FragCoord.xy), 0).rgb;
  if ((surface.y & 4) != 0) sum.rgb += pbr_emission(pbr) * sum.a;
#endif
  out_colour = sum;
}

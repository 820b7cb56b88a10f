// The shaders of a material with a fabric: three.js's own vertex shader with coordinates of the fabric, and a fragment
// shader that lights the fabric by three.js's lights, shadows, tone mapping and fog.
import {ShaderChunk} from 'three';
import {MOST_LAMPS} from '../environment.js';
import {part_fragment, part_vertex} from './garment_parts.js';
import {VERTEX_LIGHT} from './surroundings.js';
import {around, evaluate, fabric_surface, fabric_words, footprint, word_layout, yarn} from '../glsl.js';

const VERTEX_NAMES = `
#if FABRIC_UV_SET == 1 || defined(KEPT_UV1)
  #ifndef USE_UV1
    attribute vec2 uv1;
  #endif
#endif
#if FABRIC_UV_SET == 1
  #define fabric_coordinates uv1
#else
  #define fabric_coordinates uv
#endif
attribute vec3 fabric_tangent;
uniform mat3 fabric_transform;
varying vec2 fabric_uv;
varying vec3 fabric_along_u;  // dP/du, unit; zero where it is not known
`;
const LIGHT_NAMES = VERTEX_LIGHT.map((name) => `attribute vec4 ${name};\n`).join('') +
  `varying vec4 light_of_vertex[${VERTEX_LIGHT.length}];  // nine colours\n`;
const LIGHT_BODY = VERTEX_LIGHT.map((name, k) => `light_of_vertex[${k}] = ${name};\n`).join('');

const VERTEX_BODY = `
  fabric_uv = (fabric_transform * vec3(fabric_coordinates, 1.0)).xy;
  fabric_along_u = fabric_tangent;
#ifdef USE_MORPHTARGETS
  fabric_along_u = vec3(0.0);
#endif
#ifdef USE_SKINNING
  fabric_along_u = (skinMatrix * vec4(fabric_along_u, 0.0)).xyz;
#endif
#ifdef USE_BATCHING
  fabric_along_u = mat3(batchingMatrix) * fabric_along_u;
#endif
#ifdef USE_INSTANCING
  fabric_along_u = mat3(instanceMatrix) * fabric_along_u;
#endif
  fabric_along_u = (modelViewMatrix * vec4(fabric_along_u, 0.0)).xyz;
`;

// three.js lifts the cloth off its shadow along its normal, into it where the light comes from behind.
const SHADOWS = ShaderChunk.shadowmap_vertex.replace(
  /shadowWorldNormal \* (directional|spot)LightShadows\[ i \]/g,
  (text, kind) => `side_of_light( ${kind}${kind === 'spot' ? 'Light' : 'Shadow'}Matrix[ i ], worldPosition, shadowWorldNormal ) * ${text}`);
const SIDE_OF_LIGHT = `
float side_of_light(mat4 shadow, vec4 place, vec3 normal) {
  vec4 at = shadow * place, along = shadow * vec4(normal, 0.0);
  return along.z * at.w - at.z * along.w > 0.0 ? -1.0 : 1.0;
}
`;

/**
 * three.js's vertex shader of MeshPhysicalMaterial, with what the fabric needs. `tangents`: the name of an attribute;
 * `has_vertex_light`: whether surroundings.js gives the light from all around; `parts`: garment_parts.js.
 */
export function vertex_shader(of_three, uv_set, tangents, has_vertex_light, parts) {
  const kept = part_vertex(parts);
  const names = `${VERTEX_NAMES}${kept.names}${SIDE_OF_LIGHT}${has_vertex_light ? LIGHT_NAMES : ''}`;
  return `#define FABRIC_UV_SET ${uv_set}
#define fabric_tangent ${tangents}
${kept.defines}${of_three
    .replace('void main() {', `${names}\nvoid main() {${has_vertex_light ? LIGHT_BODY : ''}`)
    .replace('#include <shadowmap_vertex>', SHADOWS)
    .replace('#include <project_vertex>', `#include <project_vertex>\n${VERTEX_BODY}${kept.body}`)}`;
}

// three.js has sun lights since r187.
const SUN_LIGHTS = ShaderChunk.lights_pars_begin.includes('NUM_SUN_LIGHTS') ? ' + NUM_SUN_LIGHTS' : '';

const FRAGMENT_NAMES = `
// Features of the chunks for the fallback alone.
#undef STANDARD
#undef PHYSICAL
#undef USE_CLEARCOAT
#undef USE_IRIDESCENCE
#undef USE_ANISOTROPY
#undef USE_NORMALMAP_TANGENTSPACE
varying vec3 vViewPosition;
uniform vec3 emissive;
#include <common>
#include <dithering_pars_fragment>
#include <uv_pars_fragment>
#include <emissivemap_pars_fragment>
#include <aomap_pars_fragment>
#include <fog_pars_fragment>
#include <lights_pars_begin>
#include <normal_pars_fragment>
#include <shadowmap_pars_fragment>
#include <logdepthbuf_pars_fragment>
#include <clipping_planes_pars_fragment>

uniform int forced_level;
// level_options.glsl, as selvedge-view has it.
const int points = 2;
varying vec2 fabric_uv;
varying vec3 fabric_along_u;

#ifdef AROUND
  // The environment, in axes of its own, and where the fabric's sky lies among its words.
  #define AROUND_LAMPS ${MOST_LAMPS}
  uniform vec3 around_factors[9];
  uniform vec3 around_lamp_directions[AROUND_LAMPS];
  uniform vec3 around_lamp_irradiances[AROUND_LAMPS];
  uniform int around_lamp_count;
  uniform float around_strength;
  uniform mat3 around_from_world;
  uniform int fabric_sky;
  #ifdef VERTEX_LIGHT
    varying vec4 light_of_vertex[7];
    float number_of_vertex(int k) { return light_of_vertex[k / 4][k % 4]; }
  #endif
#else
  #define AROUND_LAMPS 0
#endif

// three.js's loops over lights call RE_Direct, which keeps them, shadows included.
const int most_lights = max(1, NUM_DIR_LIGHTS + NUM_POINT_LIGHTS + NUM_SPOT_LIGHTS${SUN_LIGHTS} + AROUND_LAMPS);
vec3 light_directions[most_lights];
vec3 light_irradiances[most_lights];
int lights_kept = 0;
struct NoMaterial { int nothing; };
void keep_light(const in IncidentLight light, const in vec3 position, const in vec3 normal, const in vec3 view,
                const in vec3 clearcoat_normal, const in NoMaterial material, inout ReflectedLight reflected) {
  light_directions[lights_kept] = light.direction;
  light_irradiances[lights_kept] = light.color;
  ++lights_kept;
}
#define RE_Direct keep_light

uint light_count() { return uint(lights_kept); }
void light_at(uint i, out vec3 direction, out vec3 irradiance) {
  direction = light_directions[i];
  irradiance = light_irradiances[i];
}
`;

const FRAGMENT_BODY = `
// The frame of coordinates that change so much per pixel, and the surface with them; \`known\`: dP/du, or zero.
mat3 frame_of(vec3 normal, vec2 right, vec2 up, vec3 to_right, vec3 to_top, vec3 known) {
  float turn = right.x * up.y - right.y * up.x < 0.0 ? -1.0 : 1.0;
  vec3 along_u = (to_right * up.y - to_top * right.y) * turn;
  vec3 along_v = (to_top * right.x - to_right * up.x) * turn;
  bool is_known = dot(known, known) > 0.0;
  vec3 tangent = tangent_across(normal, is_known ? known : along_u * inversesqrt(max(dot(along_u, along_u), 1e-36)));
  vec3 y = cross(normal, tangent);
  return mat3(tangent, dot(y, along_v) > 0.0 ? -y : y, normal);
}

void main() {
  vec4 diffuseColor = vec4(0.0, 0.0, 0.0, 1.0);
  #include <clipping_planes_fragment>
  vec3 totalEmissiveRadiance = emissive;
  #include <logdepthbuf_fragment>
  #include <emissivemap_fragment>

  vec2 right = dFdx(fabric_uv);
  vec2 up = dFdy(fabric_uv);
  vec3 to_right = -dFdx(vViewPosition);
  vec3 upwards_of_pixel = -dFdy(vViewPosition);
  vec3 view = isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(vViewPosition);
  #include <normal_fragment_begin>
  float fabric_side = gl_FrontFacing ? 1.0 : -1.0;
#ifdef FLIP_SIDED
  fabric_side = -fabric_side;  // three.js turns the winding over to draw back sides alone
#endif
  normal = unit_or(normal, view);
#ifdef FABRIC_KEEPS_OPACITY
  mat2x3 turn = mat2x3(dFdx(normal), dFdy(normal)) * fabric_side;
#else
  mat2x3 turn = mat2x3(0.0);
#endif
#ifdef KEPT_NORMAL
  vec3 bent = texture2D(kept_normal, kept_normal_uv).xyz * 2.0 - 1.0;
  bent.xy *= kept_normal_scale * fabric_side;
  mat3 of_texture =
    frame_of(normal, dFdx(kept_normal_uv), dFdy(kept_normal_uv), to_right, upwards_of_pixel, vec3(0.0));
  normal = unit_or(of_texture * bent, normal);
#endif
  normal = facing_normal(normal, view);
  mat3 frame = frame_of(normal, right, up, to_right, upwards_of_pixel, fabric_along_u);
  vec3 tint = kept_tint;
#ifdef KEPT_TINT_TEXTURE
  tint *= texture2D(kept_tint_texture, kept_tint_texture_uv).rgb;
#endif
#ifdef USE_AOMAP
  float occlusion = 1.0 + aoMapIntensity * (texture2D(aoMap, vAoMapUv).r - 1.0);
#else
  float occlusion = 1.0;
#endif
#ifdef KEPT_MASK
  // Where all that takes derivatives is done.
  if (texture2D(kept_mask, kept_mask_uv).a < kept_mask_cutoff) discard;
#endif

  uint seen = seen_from(fabric_side, 0u);
  NoMaterial material;
  ReflectedLight reflectedLight = ReflectedLight(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
  #include <lights_fragment_begin>
#ifdef AROUND
  mat3 from_view = around_from_world * transpose(mat3(viewMatrix));
  for (int i = 0; i < around_lamp_count; ++i) {
    light_directions[lights_kept] = around_lamp_directions[i] * from_view;
    light_irradiances[lights_kept] = around_lamp_irradiances[i] * occlusion;
    ++lights_kept;
  }
  for (int k = 0; k < 9; ++k) {
#ifdef VERTEX_LIGHT
    around[k] = vec3(number_of_vertex(3 * k), number_of_vertex(3 * k + 1), number_of_vertex(3 * k + 2)) * around_strength;
#else
    around[k] = around_factors[k];
#endif
  }
  turn_around_into(from_view * frame);
  float visible = 1.0;
#ifdef VERTEX_LIGHT
  visible = visible_share(mean_of(around, vec3(0.0, 0.0, 1.0)), mean_of(around_factors, from_view * normal) * around_strength);
#endif
  for (int k = 0; k < 9; ++k) around[k] *= min(1.0, occlusion / max(visible, 1e-3));
  sky = uint(fabric_sky) + (seen == 0u ? 0u : sky_of_turned);
#endif

  vec4 sum = shade_fabric(seen, fabric_uv - floor(fabric_uv), right, up, turn, fabric_side, view * frame, frame);
#ifdef FABRIC_KEEPS_OPACITY
  if (!(sum.a > 0.0)) discard;
  diffuseColor.a = min(sum.a, 1.0);
#endif
  vec3 outgoingLight = (sum.a > 0.0 ? sum.rgb / sum.a : vec3(0.0)) * tint + totalEmissiveRadiance;
  #include <opaque_fragment>
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
  #include <fog_fragment>
  #include <premultiplied_alpha_fragment>
  #include <dithering_fragment>
}
`;

/** The fragment shader of a fabric. */
export const fragment_shader = ({has_yarn, keeps_opacity, is_lit_around, has_vertex_light, parts}) => [
  is_lit_around ? '#define AROUND\n' : '', has_vertex_light ? '#define VERTEX_LIGHT\n' : '', has_yarn ? '#define YARN\n' : '',
  keeps_opacity ? '#define FABRIC_KEEPS_OPACITY\n' : '', part_fragment(parts), FRAGMENT_NAMES, word_layout, fabric_words,
  is_lit_around ? around : '', evaluate, has_yarn ? yarn : '', footprint, fabric_surface, FRAGMENT_BODY
].join('');

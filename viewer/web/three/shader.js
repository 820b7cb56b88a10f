// The shaders of a material with a fabric: three.js's own vertex shader with coordinates of the fabric, and a fragment
// shader that lights the fabric by three.js's lights, shadows, tone mapping and fog.
import {ShaderChunk} from 'three';
import {MAX_LAMPS} from '../environment.js';
import {parts_fragment_code, parts_vertex_code} from './garment_parts.js';
import {VERTEX_LIGHT} from './lights.js';
import {ATLAS_WIDTH, CHART_ATTRIBUTES} from './cell_images.js';

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
uniform mat3 fabric_transform;
attribute vec4 fabric_chart;
attribute vec2 fabric_chart_size;
varying vec2 fabric_uv;
flat varying vec4 of_chart;  // first entry of its table, first u and v, smallest patches along a repeat
flat varying vec2 chart_cells;
`;
const LIGHT_NAMES = `attribute vec3 ${VERTEX_LIGHT};\nvarying mat3 brightness_of_vertex;\n`;
const LIGHT_BODY = `brightness_of_vertex = mat3(${VERTEX_LIGHT});\n`;

const VERTEX_BODY = `
  fabric_uv = (fabric_transform * vec3(fabric_coordinates, 1.0)).xy;
  of_chart = fabric_chart;
  chart_cells = fabric_chart_size;
`;

// three.js lifts the cloth off its shadow along its normal, into it where the light comes from behind.
const SHADOWS = ShaderChunk.shadowmap_vertex.replace(
  /shadowWorldNormal \* (directional|spot)LightShadows\[ i \]/g,
  (text, kind) => `side_of_light( ${kind}${kind === 'spot' ? 'Light' : 'Shadow'}Matrix[ i ], worldPosition, shadowWorldNormal ) * ${text}`);
/** three.js's shadows, whose disk of five samples is turned once a lamp: its ten sines and cosines cost more than its samples. */
const SHADOWED = ShaderChunk.shadowmap_pars_fragment
  .replace(/float phi = interleaved.*/g, (text) => `${text} vec2 turn = vec2(cos(phi), sin(phi));`)
  .replace(/vogelDiskSample\( (\d), 5, phi \)/g, (_, k) => {
    const angle = k * 2.399963229728653, r = Math.sqrt((Number(k) + 0.5) / 5), [x, y] = [r * Math.cos(angle), r * Math.sin(angle)];
    return `(turn * ${x.toFixed(9)} + vec2(-turn.y, turn.x) * ${y.toFixed(9)})`;
  });
const SIDE_OF_LIGHT = `
float side_of_light(mat4 shadow, vec4 place, vec3 normal) {
  vec4 at = shadow * place, along = shadow * vec4(normal, 0.0);
  return along.z * at.w - at.z * along.w > 0.0 ? -1.0 : 1.0;
}
`;

/**
 * three.js's vertex shader of MeshPhysicalMaterial, with what the fabric needs. `charts`: names of the attributes of cell_images.js;
 * `has_vertex_light`: whether surroundings.js gives the light from all around; `parts`: garment_parts.js.
 */
export function vertex_shader(of_three, uv_set, charts, has_vertex_light, parts) {
  const kept = parts_vertex_code(parts);
  const names = `${VERTEX_NAMES}${kept.names}${SIDE_OF_LIGHT}${has_vertex_light ? LIGHT_NAMES : ''}`;
  return `#define FABRIC_UV_SET ${uv_set}
${charts[0] === CHART_ATTRIBUTES[0] ? '' : CHART_ATTRIBUTES.map((name, i) => `#define ${name} ${charts[i]}\n`).join('')}${kept.defines}${of_three
    .replace('void main() {', `${names}\nvoid main() {${has_vertex_light ? LIGHT_BODY : ''}`)
    .replace('#include <shadowmap_vertex>', SHADOWS)
    .replace('#include <project_vertex>', `#include <project_vertex>\n${VERTEX_BODY}${kept.body}`)}`;
}

/** three.js's light of a rectangle on what is matt, whatever the direction of view. */
const RECTANGLES = ShaderChunk.lights_physical_pars_fragment.match(/float LTC_ClippedSphereFormFactor[^]*?return vec3\( result \);\s*}/)[0];

const FRAGMENT_NAMES = `
// Features of the chunks for the fallback alone.
${['STANDARD', 'PHYSICAL', 'USE_CLEARCOAT', 'USE_IRIDESCENCE', 'USE_ANISOTROPY', 'USE_NORMALMAP_TANGENTSPACE'].map((name) => `#undef ${name}\n`).join('')}
varying vec3 vViewPosition;
uniform vec3 emissive;
#include <common>
#include <packing>  // of shadow maps before 0.183
${['dithering', 'uv', 'color', 'emissivemap', 'aomap', 'fog', 'normal', 'logdepthbuf', 'clipping_planes'].map((name) => `#include <${name}_pars_fragment>\n`).join('')}
#include <lights_pars_begin>
${SHADOWED}

// Cell images of the worker (cell_images.js).
uniform sampler2D cell_atlas, cell_heights;
uniform highp usampler2D cell_table, cell_tiles;
uniform vec3 cell_albedo;     // of the fabric, its mean
uniform float cell_beyond;    // fraction of the light of one side that the other side gets
uniform float cell_brighter;  // bound on a place's brightness over its image's
varying vec2 fabric_uv; flat varying vec4 of_chart; flat varying vec2 chart_cells;

#ifdef AROUND
  // The environment, in axes of its own.
  #define AROUND_LAMPS ${MAX_LAMPS}
  uniform vec3 around_lamp_directions[AROUND_LAMPS], around_lamp_irradiances[AROUND_LAMPS];
  uniform int around_lamp_count; uniform float around_strength;
  uniform mat3 around_from_world;
  #ifdef VERTEX_LIGHT
    varying mat3 brightness_of_vertex;
    #define around_brightness (brightness_of_vertex * around_strength)
  #else
    uniform mat3 around_brightness;
  #endif
  uniform mat3 soft_brightness;  // of ambient lights, which nothing hides
  // CellLights::brightness() of smooth light: pi times its irradiance by the clamped cosine.
  float brightness_around(mat3 f, vec3 n) {
    return max(f[0].x + dot(vec3(f[0].yz, f[1].x), n) + dot(vec3(f[1].yz, f[2].x), n.xxy * n.yzz) +
      f[2].y * (n.x * n.x - n.y * n.y) + f[2].z * (3.0 * n.z * n.z - 1.0), 0.0);
  }
#endif

// three.js's loops over lights call RE_Direct, shadows included.
float bright = 0.0;
float light_of_cosine(float cosine) {
  return (1.0 - cell_beyond) * max(cosine, 0.0) + cell_beyond * 0.5 * (1.0 + cosine);
}
struct NoMaterial { int nothing; };
void add_light(const in IncidentLight light, const in vec3 position, const in vec3 normal, const in vec3 view,
               const in vec3 clearcoat_normal, const in NoMaterial material, inout ReflectedLight reflected) {
  bright += dot(light.color, vec3(1.0 / 3.0)) * light_of_cosine(dot(normal, light.direction));
}
#define RE_Direct add_light
#if NUM_RECT_AREA_LIGHTS > 0
${RECTANGLES}
float light_of_rectangle(RectAreaLight light, vec3 position, vec3 normal) {
  vec3 w = light.halfWidth, h = light.halfHeight, p = light.position, view = abs(normal.x) < 0.5 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
  vec3 corners[4] = vec3[4](p + w - h, p - w - h, p - w + h, p + w + h);
  return LTC_Evaluate(normal, view, position, mat3(1.0), corners).x;
}
void add_rectangle(const in RectAreaLight light, const in vec3 position, const in vec3 normal, const in vec3 view,
                   const in vec3 clearcoat_normal, const in NoMaterial material, inout ReflectedLight reflected) {
  // light_of_cosine() of what comes to the front, to the back, and to a surface that faces it.
  float front = light_of_rectangle(light, position, normal), back = light_of_rectangle(light, position, -normal);
  float facing = cell_beyond > 0.0 ? light_of_rectangle(light, position, normalize(light.position - position)) : 0.0;
  bright += dot(light.color, vec3(PI / 3.0)) * mix(front, 0.5 * (facing + front - back), cell_beyond);
}
#define RE_Direct_RectArea add_rectangle
#endif

#define AT(entry) ivec2(entry % ${ATLAS_WIDTH}, entry / ${ATLAS_WIDTH})
// The tile at a place, from one side; 0: none.
int tile_at(vec2 uv, int side) {
  if (chart_cells.x < 1.0) return 0;  // the mesh is not known yet
  ivec2 cell = clamp(ivec2(floor((uv - of_chart.yz) * of_chart.w)), ivec2(0), ivec2(chart_cells) - 1);
  int entry = int(of_chart.x) + cell.y * int(chart_cells.x) + cell.x;
  uint tiles = texelFetch(cell_table, AT(entry), 0).x;
  return int(side == 0 ? tiles & 65535u : tiles >> 16);
}

// Variation beyond the repeat: the twin of format/fabric/variation.h, whose lattices are layers of a texture (noise.js).
uniform mediump sampler2DArray cell_noise;
uniform vec4 noise_places[4];  // of each lattice, rows and lengths of a repeat, and where they begin
uniform vec2 noise_layers[4];  // first and last
uniform float varied_numbers[16];  // change of each run the second of three; fractions of yarn along v, front and back; relief
// Noise of a lattice at a place along and across its rows: of single rows, and of areas.
vec2 noise_at(int k, vec2 place, bool of_single_rows) {
  vec2 at = place.yx * noise_places[k].xy + noise_places[k].zw, whole = floor(at), part = at - whole, size = vec2(textureSize(cell_noise, 0));
  if (of_single_rows) part.x = clamp(part.x * (4.0 / 3.0) - 1.0 / 6.0, 0.0, 1.0);
  vec2 next = part * part * (3.0 - 2.0 * part), here = 1.0 - next, weight = here * here + next * next;
  float layer = clamp(floor((whole.x + 0.5) / (size.y - 1.0)) + noise_layers[k].x, noise_layers[k].x, noise_layers[k].y);
  at = whole + next + 0.5 - vec2((layer - noise_layers[k].x) * (size.y - 1.0), 0.0);
  return (textureLod(cell_noise, vec3(at.yx / size, layer), 0.0).rg - 0.5) * vec2(inversesqrt(weight.x * weight.y) * 3.4505963, 6.9011926);
}
// Rows and lengths that a pixel shows, and areas.
vec4 seen_at_once(int k, vec2 pixel) {
  vec2 seen = pixel.yx * noise_places[k].xy;
  return max(vec4(seen, seen / vec2(8.0, 4.0)), 1.0);
}
// Where the fabric is looked up: rows leave their places as far as pixels show single ones.
vec2 place_of(vec2 uv, vec2 pixel) {
  vec4 along_u = seen_at_once(0, pixel), along_v = seen_at_once(1, pixel.yx);
  vec2 change = clamp(4.0 / max(along_u.x * along_u.y, along_v.x * along_v.y) - 1.0, 0.0, 1.0) * vec2(varied_numbers[10], varied_numbers[7]);
  return change.x + change.y > 0.0 ? uv + change * vec2(noise_at(3, uv.yx, false).x, noise_at(2, uv, false).x) : uv;
}
// The change of yarn along an axis.
float varied_along(int axis, vec2 place, vec2 pixel) {
  float change = varied_numbers[3 * axis + 1];
  if (!(change > 0.0)) return 1.0;
  vec4 seen = seen_at_once(axis, pixel);
  return clamp(1.0 + change * dot(noise_at(axis, place, true), vec2(1.0, 0.25) / (seen.xz * seen.yw)), 0.0, 2.0);
}
float varied(float along_v, vec2 place, vec2 pixel) {
  float of_u = 1.0, of_v = 1.0;
  if (along_v < 1.0) of_u = varied_along(0, place, pixel);
  if (along_v > 0.0) of_v = varied_along(1, place.yx, pixel.yx);
  return mix(of_u, of_v, along_v);
}
`;

const FRAGMENT_BODY = `
// The frame of coordinates that change so much per pixel, and the surface with them.
mat3 frame_of(vec3 normal, vec2 right, vec2 up, vec3 to_right, vec3 to_top) {
  float turn = right.x * up.y - right.y * up.x < 0.0 ? -1.0 : 1.0;
  vec3 along_u = (to_right * up.y - to_top * right.y) * turn, along_v = (to_top * right.x - to_right * up.x) * turn;
  vec3 tangent = normalize(along_u - normal * dot(normal, along_u)), y = cross(normal, tangent);
  return mat3(tangent, dot(y, along_v) > 0.0 ? -y : y, normal);
}

void main() {
  vec4 diffuseColor = vec4(0.0, 0.0, 0.0, 1.0);
  #include <clipping_planes_fragment>
  vec3 totalEmissiveRadiance = emissive;
  #include <logdepthbuf_fragment>
  #include <emissivemap_fragment>

  #include <normal_fragment_begin>
  float fabric_side = gl_FrontFacing ? 1.0 : -1.0;
#ifdef FLIP_SIDED
  fabric_side = -fabric_side;  // three.js turns the winding over to draw back sides alone
#endif
  vec3 to_right = -dFdx(vViewPosition), to_top = -dFdy(vViewPosition);
  vec2 uv_right = dFdx(fabric_uv), uv_top = dFdy(fabric_uv);
  mat3 frame = frame_of(normal, uv_right, uv_top, to_right, to_top);
#ifdef KEPT_NORMAL
  vec3 bent = texture2D(kept_normal, kept_normal_uv).xyz * 2.0 - 1.0;
  bent.xy *= kept_normal_scale * fabric_side;
  normal = normalize(frame_of(normal, dFdx(kept_normal_uv), dFdy(kept_normal_uv), to_right, to_top) * bent);
#endif
  vec3 tint = kept_tint;
#ifdef KEPT_TINT_TEXTURE
  tint *= texture2D(kept_tint_texture, kept_tint_texture_uv).rgb;
#endif
#if defined(USE_COLOR) || defined(USE_COLOR_ALPHA)
  tint *= vColor.rgb;
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

  vec4 sum = vec4(cell_albedo / PI, 1.0);  // no image yet
  float brighter = 1.0, brightest = 1e9, change = 1.0;
  int tile = tile_at(fabric_uv, fabric_side > 0.0 ? 0 : 1);
  if (tile > 0) {
    uvec4 numbers = texelFetch(cell_tiles, AT(tile), 0);  // TileNumbers
    vec2 corner = vec2(numbers.x & 2047u, (numbers.x >> 8) & 8184u), size = vec2(numbers.x >> 21, numbers.y & 2047u);
    float scale = uintBitsToFloat((numbers.y >> 24) << 23);
    vec2 pixel = sqrt(uv_right * uv_right + uv_top * uv_top), place = place_of(fabric_uv, pixel);
    vec2 at = (place - floor(place)) * vec2(1.0, -1.0) + vec2(0.0, 1.0);
    at = at * size - 0.25 * vec2((numbers.y >> 11) & 8191u, numbers.z & 8191u);
    // The yarn there stands out of the plane, and rays of the image came from another side.
    vec3 view = (isOrthographic ? vec3(0.0, 0.0, 1.0) : normalize(vViewPosition)) * frame;
    int height = int(texelFetch(cell_heights, ivec2(corner + mod(at, size) + 0.5), 0).r * 255.0 + 0.5);
    vec2 relief = vec2(varied_numbers[14], varied_numbers[15]) * size * float(height > 0 ? height - 128 : 0);
    at += clamp(view.xy / max(view.z, 1.0 / 32.0) - unpackHalf2x16(numbers.w), -1.0, 1.0) * relief;
    sum = textureLod(cell_atlas, (corner + mod(at, size) + 0.5) / vec2(textureSize(cell_atlas, 0)), 0.0);
    sum.rgb *= scale;
    brighter = unpackHalf2x16(numbers.z >> 13).x / scale;
    brightest = cell_brighter;
    // Odd steps are yarn along v, where there is both.
    float along_v = height > 0 && noise_places[0].x * noise_places[1].x > 0.0 ? float(height & 1) : fabric_side > 0.0 ? varied_numbers[12] : varied_numbers[13];
    change = varied(along_v, place, pixel);
  }
#ifdef FABRIC_KEEPS_OPACITY
  if (!(sum.a > 0.0)) discard;
  diffuseColor.a = min(sum.a, 1.0);
#endif

  NoMaterial material;
  ReflectedLight reflectedLight = ReflectedLight(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
  #include <lights_fragment_begin>
#ifdef AROUND
  mat3 from_view = around_from_world * transpose(mat3(viewMatrix));
  vec3 n = from_view * normal;
  for (int i = 0; i < around_lamp_count; ++i)
    bright += dot(around_lamp_irradiances[i], vec3(occlusion / 3.0)) * light_of_cosine(dot(n, around_lamp_directions[i]));
  bright += brightness_around(around_brightness + soft_brightness, n) * occlusion;
#endif

#ifdef INSTANCED
  // The mean takes the place of another instance's images that too little light has reached.
  float gain = bright > 0.0 ? bright * brighter : 0.0;
  sum.rgb = mix(cell_albedo * (sum.a * bright / PI), sum.rgb * min(gain, brightest) * change, min(brightest / max(gain, 1e-6), 1.0));
#else
  sum.rgb *= min(bright * brighter, brightest) * change;
#endif
  vec3 outgoingLight = (sum.a > 0.0 ? sum.rgb / sum.a : vec3(0.0)) * tint + totalEmissiveRadiance;
  ${['opaque', 'tonemapping', 'colorspace', 'fog', 'premultiplied_alpha', 'dithering'].map((name) => `#include <${name}_fragment>\n`).join('')}
}
`;

/** The fragment shader of a fabric. */
export const fragment_shader = ({keeps_opacity, is_lit_around, has_vertex_light, parts}, is_instanced) => [
  is_instanced ? '#define INSTANCED\n' : '', is_lit_around ? '#define AROUND\n' : '', has_vertex_light ? '#define VERTEX_LIGHT\n' : '',
  keeps_opacity ? '#define FABRIC_KEEPS_OPACITY\n' : '', parts_fragment_code(parts), FRAGMENT_NAMES, FRAGMENT_BODY
].join('');

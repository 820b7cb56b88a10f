// The look-up of a fabric in three.js's shading language: the twin of shader.js, whose comments say why.
import {Matrix3, Vector3} from 'three';
import {
  If, attribute, cameraViewMatrix, clamp, cross, dot, faceDirection, float, floor, fract, int, inverseSqrt, ivec2, ivec4, max, min,
  mix, normalize, positionView, positionViewDirection, select, sqrt, texture, textureSize, uint, uintBitsToFloat, uniform, uniformArray,
  unpackHalf2x16, uv, uvec2, uvec4, varying, vec2, vec3, vec4
} from 'three/tsl';
import {MAX_LAMPS} from '../environment.js';
import {ATLAS_WIDTH} from './cell_images.js';
import {VERTEX_LIGHT} from './lights.js';

const zeros = (count) => Array.from({length: count}, () => 0), vectors = () => Array.from({length: MAX_LAMPS}, () => new Vector3());
const matrix = () => uniform(new Matrix3()), number = () => uniform(0);

/** The nodes of a material by the names of its uniforms, whose values set_nodes() takes. */
export const nodes_of = (textures) => ({
  fabric_transform: matrix(), cell_beyond: number(), cell_albedo: uniform(new Vector3()), cell_brighter: number(),
  varied_keys: uniformArray(zeros(6), 'uint'), varied_runs: uniformArray(zeros(12), 'int'), varied_numbers: uniformArray(zeros(16), 'float'),
  around_brightness: matrix(), soft_brightness: matrix(), around_from_world: matrix(), around_lamp_count: uniform(0, 'int'),
  around_lamp_directions: uniformArray(vectors()), around_lamp_irradiances: uniformArray(vectors()),
  kept_mask_transform: matrix(), kept_normal_transform: matrix(), kept_tint_texture_transform: matrix(), kept_mask_cutoff: number(),
  kept_normal_scale: number(), around_strength: number(), kept_tint: uniform(new Vector3()),
  ...Object.fromEntries(Object.entries(textures).map(([name, {value}]) => [name, texture(value)])),
});
export function set_nodes(nodes, uniforms) {
  for (const [name, node] of Object.entries(nodes)) {
    const {value} = uniforms[name];
    if (node.isArrayBufferNode) node.array = value;
    else if (Array.isArray(value)) node.value.fromArray(value);
    else node.value = value;
  }
}

const third = (colour) => dot(colour, vec3(1 / 3));
export const light_of_cosine = ({cell_beyond}, cosine) =>
  float(1).sub(cell_beyond).mul(max(cosine, 0)).add(cell_beyond.mul(0.5).mul(cosine.add(1)));

/** The frame of coordinates along the surface that change so much per pixel, as its two axes beside the normal. */
function frame_of(normal, coordinates) {
  const right = coordinates.dFdx().toVar(), up = coordinates.dFdy().toVar(), to_right = positionView.dFdx(), to_top = positionView.dFdy();
  const turn = select(right.x.mul(up.y).sub(right.y.mul(up.x)).lessThan(0), float(-1), float(1)).toVar();
  const along_u = to_right.mul(up.y).sub(to_top.mul(right.y)).mul(turn).toVar(), along_v = to_top.mul(right.x).sub(to_right.mul(up.x)).mul(turn);
  const tangent = normalize(along_u.sub(normal.mul(dot(normal, along_u)))).toVar(), y = cross(normal, tangent).toVar();
  return {right, up, tangent, y: select(dot(y, along_v).greaterThan(0), y.negate(), y).toVar()};
}

function strand_hash(of) {
  const x = of.toVar();
  for (const [shift, factor] of [[16, 0x7feb352d], [15, 0x846ca68b]]) x.assign(x.bitXor(x.shiftRight(uvec4(shift))).mul(uvec4(factor)));
  return x.bitXor(x.shiftRight(uvec4(16))).toVar();
}
function blend_of(part) {
  const next = part.mul(part).mul(float(3).sub(part.mul(2))).toVar(), here = next.oneMinus().toVar();
  return vec4(here, next).mul(inverseSqrt(here.mul(here).add(next.mul(next))).xyxy).toVar();
}
function lattice_noise(keys, whole, part) {
  const weights = blend_of(part.xy), others = blend_of(part.zw);
  const rows = strand_hash(keys.xxyy.add(uvec4(whole.xxzz)).add(uvec4(0, 1, 0, 1))).add(uvec4(whole.yyww)).toVar();
  const [here, next] = [0, 1].map((k) => vec4(strand_hash(rows.add(uvec4(k))).bitAnd(uvec4(255))).sub(127.5));
  const of_rows = vec4(weights.xz, others.xz).mul(here.mul(vec4(weights.yy, others.yy)).add(next.mul(vec4(weights.ww, others.ww)))).toVar();
  return of_rows.xz.add(of_rows.yw).mul(0.013531648).toVar();
}
/** Variation beyond the repeat of a material's yarn. */
function variation_of({varied_keys, varied_runs, varied_numbers}) {
  const run = (i, k) => varied_runs.element(3 * i + k), number = (i, k) => varied_numbers.element(3 * i + k), key = (i) => varied_keys.element(i);
  const find_row = (i, place) => {
    const of_place = floor(place).toVar(), repeat = ivec2(clamp(of_place, -1e9, 1e9)).toVar(), within = place.sub(of_place);
    const first = repeat.x.bitAnd(run(i, 2).sub(int(1))).toVar();
    const at = vec2(within.y.mul(float(run(i, 0))).add(number(i, 0)), float(first).add(within.x).mul(number(i, 2))).toVar();
    const whole = ivec2(repeat.y.mul(run(i, 0)), int(float(repeat.x.sub(first)).div(float(run(i, 2)))).mul(run(i, 1))).add(ivec2(floor(at)));
    return {whole: whole.toVar(), part: fract(at).toVar()};
  };
  const seen_at_once = (i, pixel) => pixel.yx.mul(vec2(float(run(i, 0)), number(i, 2)));
  const place_of = (coordinates, pixel) => {
    const along_u = max(seen_at_once(0, pixel), 1).toVar(), along_v = max(seen_at_once(1, pixel.yx), 1).toVar(), place = coordinates.toVar();
    const seen = max(along_u.x.mul(along_u.y), along_v.x.mul(along_v.y)), change = clamp(float(4).div(seen).sub(1), 0, 1).mul(vec2(number(3, 1), number(2, 1))).toVar();
    If(change.x.add(change.y).greaterThan(0), () => {
      const one = find_row(3, coordinates.yx), other = find_row(2, coordinates);
      place.addAssign(change.mul(lattice_noise(uvec2(key(5), key(4)), ivec4(one.whole, other.whole), vec4(one.part, other.part))));
    });
    return place;
  };
  const varied_along = (i, place, seen) => {
    const result = float(1).toVar();
    If(number(i, 1).greaterThan(0), () => {
      const {whole, part} = find_row(i, place), of_area = ivec2(whole.x.bitAnd(int(7)), whole.y.bitAnd(int(3))).toVar(), area = vec2(0.125, 0.25);
      const areas = ivec2(vec2(whole.sub(of_area)).mul(area)), x = clamp(part.x.mul(4 / 3).sub(1 / 6), 0, 1);
      const at_once = max(seen.xyxy.mul(vec4(1, 1, 0.125, 0.25)), 1).toVar();
      const noise = lattice_noise(uvec2(key(2 * i), key(2 * i + 1)), ivec4(whole, areas), vec4(x, part.y, vec2(of_area).add(part).mul(area)).toVar());
      const mean = noise.div(at_once.xz.mul(at_once.yw)).toVar();
      result.assign(clamp(number(i, 1).mul(mean.x.add(mean.y.mul(0.25))).add(1), 0, 2));
    });
    return result;
  };
  const varied = (along_v, place, pixel) => {
    const of_u = float(1).toVar(), of_v = float(1).toVar();
    If(along_v.lessThan(1), () => { of_u.assign(varied_along(0, place, seen_at_once(0, pixel))); });
    If(along_v.greaterThan(0), () => { of_v.assign(varied_along(1, place.yx, seen_at_once(1, pixel.yx))); });
    return mix(of_u, of_v, along_v);
  };
  return {place_of, varied, has_both: run(0, 0).mul(run(1, 0)).greaterThan(int(0)), number: (i) => varied_numbers.element(i)};
}

const at_texel = (node, texel) => node.load(ivec2(texel.mod(int(ATLAS_WIDTH)), texel.div(int(ATLAS_WIDTH)))).toVar();
const floor_mod = (x, y) => x.sub(y.mul(floor(x.div(y))));

/**
 * What a pixel shows, within the flow of a fragment: { normal, tint, sum, brighter, brightest, change }, of shader.js's main().
 * `normal`: of the surface; `is_known`: whether it has the attributes of cell_images.js.
 */
export function look_up(nodes, {lay, names, parts}, normal, is_known) {
  const at_channel = (name) => nodes[`kept_${name}_transform`].mul(vec3(uv(parts[name].channel === 1 ? 1 : 0), 1)).xy;
  const fabric_uv = varying(nodes.fabric_transform.mul(vec3(uv(lay.uv_set), 1)).xy).toVar();
  const {right, up, tangent, y} = frame_of(normal, fabric_uv), pixel = sqrt(right.mul(right).add(up.mul(up))).toVar(), variation = variation_of(nodes);
  const front = faceDirection.greaterThan(0), shown = {normal, tint: vec3(nodes.kept_tint)};
  if (parts.normal) {
    const coordinates = at_channel('normal').toVar(), of_normal = frame_of(normal, coordinates), bent = texture(parts.normal, coordinates).xyz.mul(2).sub(1).toVar();
    const [x, v] = [bent.x, bent.y].map((c) => c.mul(nodes.kept_normal_scale).mul(faceDirection));
    shown.normal = normalize(of_normal.tangent.mul(x).add(of_normal.y.mul(v)).add(normal.mul(bent.z))).toVar();
  }
  if (parts.tint_texture) shown.tint = shown.tint.mul(texture(parts.tint_texture, at_channel('tint_texture')).rgb);
  shown.tint = shown.tint.toVar();
  if (parts.mask) texture(parts.mask, at_channel('mask')).a.lessThan(nodes.kept_mask_cutoff).discard();

  const sum = vec4(nodes.cell_albedo.div(Math.PI), 1).toVar(), brighter = float(1).toVar(), brightest = float(1e9).toVar(), change = float(1).toVar();
  if (!is_known) return {...shown, sum, brighter, brightest, change};
  const [chart, cells] = ['vec4', 'vec2'].map((type, k) => varying(attribute(names[k], type)).setInterpolation('flat', 'first'));
  const cell = clamp(ivec2(floor(fabric_uv.sub(chart.yz).mul(chart.w))), ivec2(0), ivec2(cells).sub(ivec2(1))).toVar();
  const tiles = at_texel(nodes.cell_table, int(chart.x).add(cell.y.mul(int(cells.x))).add(cell.x).toVar()).x;
  const tile = int(select(front, tiles.bitAnd(uint(65535)), tiles.shiftRight(uint(16)))).toVar();
  If(tile.greaterThan(int(0)), () => {
    const numbers = at_texel(nodes.cell_tiles, tile), bits = (c, first, mask) => float(numbers[c].shiftRight(uint(first)).bitAnd(uint(mask)));
    const corner = vec2(bits('x', 0, 2047), bits('x', 8, 8184)).toVar(), size = vec2(bits('x', 21, 2047), bits('y', 0, 2047)).toVar();
    const scale = uintBitsToFloat(numbers.y.shiftRight(uint(24)).shiftLeft(uint(23))).toVar(), place = variation.place_of(fabric_uv, pixel);
    const at = fract(place).mul(vec2(1, -1)).add(vec2(0, 1)).mul(size).sub(vec2(bits('y', 11, 8191), bits('z', 0, 8191)).mul(0.25)).toVar();
    const view = vec3(dot(positionViewDirection, tangent), dot(positionViewDirection, y), dot(positionViewDirection, normal)).toVar();
    const height = int(nodes.cell_heights.load(ivec2(corner.add(floor_mod(at, size)).add(0.5))).r.mul(255).add(0.5)).toVar(), is_known = height.greaterThan(int(0));
    const relief = vec2(variation.number(14), variation.number(15)).mul(size).mul(select(is_known, float(height).sub(128), float(0)));
    at.addAssign(clamp(view.xy.div(max(view.z, 1 / 32)).sub(unpackHalf2x16(numbers.w)), -1, 1).mul(relief));
    const texel = corner.add(floor_mod(at, size)).add(0.5);
    sum.assign(nodes.cell_atlas.sample(texel.div(vec2(textureSize(nodes.cell_atlas, int(0))))).level(0));
    sum.rgb.mulAssign(scale);
    brighter.assign(unpackHalf2x16(numbers.z.shiftRight(uint(13))).x.div(scale));
    brightest.assign(nodes.cell_brighter);
    const along_v = select(is_known.and(variation.has_both), float(height.bitAnd(int(1))), select(front, variation.number(12), variation.number(13))).toVar();
    change.assign(variation.varied(along_v, place, pixel));
  });
  return {...shown, sum, brighter, brightest, change};
}

/** The brightness of smooth light, each vertex's where surroundings.js gives it, and lamps from all around. */
export function brightness_around(nodes, normal, occlusion, has_vertex_light) {
  const of_world = vec3(...[0, 1, 2].map((k) => dot(cameraViewMatrix.element(int(k)).xyz, normal))), n = nodes.around_from_world.mul(of_world).toVar();
  const smooth = (k) => has_vertex_light ? varying(attribute(VERTEX_LIGHT[k], 'vec3')).mul(nodes.around_strength) : nodes.around_brightness.element(int(k));
  const [a, b, c] = [0, 1, 2].map((k) => smooth(k).add(nodes.soft_brightness.element(int(k))).toVar());
  const bright = max(a.x.add(dot(vec3(a.yz, b.x), n)).add(dot(vec3(b.yz, c.x), n.xxy.mul(n.yzz))).add(c.y.mul(n.x.mul(n.x).sub(n.y.mul(n.y))))
    .add(c.z.mul(n.z.mul(n.z).mul(3).sub(1))), 0).toVar();
  for (let i = 0; i < MAX_LAMPS; ++i) {
    If(nodes.around_lamp_count.greaterThan(int(i)), () => {
      bright.addAssign(third(nodes.around_lamp_irradiances.element(i)).mul(light_of_cosine(nodes, dot(n, nodes.around_lamp_directions.element(i)))));
    });
  }
  return bright.mul(occlusion);
}

/** The light that a pixel sends, without its tint. */
export function outgoing_light({cell_albedo}, {sum, brighter, brightest, change}, bright, is_instanced) {
  const gain = max(bright.mul(brighter), 0).toVar(), lit = sum.rgb.mul(min(gain, brightest)).mul(change);
  const shown = is_instanced ? mix(cell_albedo.mul(sum.a).mul(bright).div(Math.PI), lit, min(brightest.div(max(gain, 1e-6)), 1)) : lit;
  return select(sum.a.greaterThan(0), shown.div(sum.a), vec3(0));
}

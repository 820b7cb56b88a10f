// The look-up of a fabric in three.js's shading language: the twin of shader.js, whose comments say why.
import {Matrix3, Vector2, Vector3, Vector4} from 'three';
import {
  If, attribute, cameraViewMatrix, clamp, cross, dot, faceDirection, float, floor, fract, int, inverseSqrt, ivec2, max, min,
  mix, normalize, positionView, positionViewDirection, select, sqrt, texture, textureSize, uint, uintBitsToFloat, uniform, uniformArray,
  unpackHalf2x16, uv, varying, vec2, vec3, vec4
} from 'three/tsl';
import {MAX_LAMPS} from '../environment.js';
import {ATLAS_WIDTH} from './cell_images.js';
import {VERTEX_LIGHT} from './lights.js';

const each = (length, make) => Array.from({length}, make), vectors = () => each(MAX_LAMPS, () => new Vector3());
const matrix = () => uniform(new Matrix3()), number = () => uniform(0);

/** The nodes of a material by the names of its uniforms, whose values set_nodes() takes. */
export const nodes_of = (textures) => ({
  fabric_transform: matrix(), cell_beyond: number(), cell_albedo: uniform(new Vector3()), cell_brighter: number(),
  noise_places: uniformArray(each(4, () => new Vector4())), noise_layers: uniformArray(each(4, () => new Vector2())), varied_numbers: uniformArray(each(16, () => 0), 'float'),
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

/** Variation beyond the repeat of a material's yarn. */
function variation_of({cell_noise, noise_places, noise_layers, varied_numbers}) {
  const number = (i) => varied_numbers.element(i), number_of = (k) => noise_places.element(k);
  const noise_at = (k, place, of_single_rows) => {
    const first = place.yx.mul(number_of(k).xy).add(number_of(k).zw).toVar(), whole = floor(first).toVar(), size = vec2(textureSize(cell_noise, int(0)).xy).toVar();
    let part = first.sub(whole).toVar();
    if (of_single_rows) part = vec2(clamp(part.x.mul(4 / 3).sub(1 / 6), 0, 1), part.y).toVar();
    const next = part.mul(part).mul(float(3).sub(part.mul(2))).toVar(), here = next.oneMinus().toVar(), weight = here.mul(here).add(next.mul(next)).toVar();
    const [begin, end] = [noise_layers.element(k).x, noise_layers.element(k).y], rows = size.y.sub(1).toVar();
    const layer = clamp(floor(whole.x.add(0.5).div(rows)).add(begin), begin, end).toVar(), at = whole.add(next).add(0.5).sub(vec2(layer.sub(begin).mul(rows), 0));
    const bytes = cell_noise.sample(at.yx.div(size)).depth(int(layer)).level(0).rg;
    return bytes.sub(0.5).mul(vec2(inverseSqrt(weight.x.mul(weight.y)).mul(3.4505963), 6.9011926));
  };
  const seen_at_once = (k, pixel, area = [1, 1]) => {
    const seen = max(pixel.yx.mul(number_of(k).xy).div(vec2(...area)), 1);
    return seen.x.mul(seen.y);
  };
  const place_of = (coordinates, pixel) => {
    const seen = max(seen_at_once(0, pixel), seen_at_once(1, pixel.yx)), place = coordinates.toVar();
    const change = clamp(float(4).div(seen).sub(1), 0, 1).mul(vec2(number(10), number(7))).toVar();
    If(change.x.add(change.y).greaterThan(0), () => {
      place.addAssign(change.mul(vec2(noise_at(3, coordinates.yx).x, noise_at(2, coordinates).x)));
    });
    return place;
  };
  const varied_along = (axis, place, pixel) => {
    const result = float(1).toVar();
    If(number(3 * axis + 1).greaterThan(0), () => {
      const noise = noise_at(axis, place, true).toVar(), areas = noise.y.mul(0.25).div(seen_at_once(axis, pixel, [8, 4]));
      result.assign(clamp(number(3 * axis + 1).mul(noise.x.div(seen_at_once(axis, pixel)).add(areas)).add(1), 0, 2));
    });
    return result;
  };
  const varied = (along_v, place, pixel) => {
    const of_u = float(1).toVar(), of_v = float(1).toVar();
    If(along_v.lessThan(1), () => { of_u.assign(varied_along(0, place, pixel)); });
    If(along_v.greaterThan(0), () => { of_v.assign(varied_along(1, place.yx, pixel.yx)); });
    return mix(of_u, of_v, along_v);
  };
  return {place_of, varied, has_both: number_of(0).x.mul(number_of(1).x).greaterThan(0), number};
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

// Garments as .glb files: read, dressed in a fabric that they embed, and written (spec/SELVEDGE_materials_fabric).
import {tint_towards} from '../../../viewer/web/page/tint.js';

export const EXTENSION = 'SELVEDGE_materials_fabric';
const TRANSFORM = 'KHR_texture_transform', EMISSION = 'KHR_materials_emissive_strength';
const GLB = 0x46546c67, JSON_CHUNK = 0x4e4f534a, BIN_CHUNK = 0x004e4942;
const padded = (length) => (length + 3) & ~3;

/** { json, bin } of the bytes of a file. Throws an Error of one line. */
export function read_glb(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength), int = (at) => at + 4 <= bytes.length ? view.getUint32(at, true) : NaN;
  if (int(0) !== GLB || int(4) !== 2) throw new Error('is no .glb file of version 2');
  const length = int(12);
  if (int(16) !== JSON_CHUNK || !(20 + length <= bytes.length)) throw new Error('is cut short');
  let json;
  try {
    json = JSON.parse(new TextDecoder('utf-8', {fatal: true}).decode(bytes.subarray(20, 20 + length)));
  } catch {
    throw new Error('its JSON is malformed');
  }
  const at = 20 + length, has_bin = int(at + 4) === BIN_CHUNK;
  if (has_bin && at + 8 + int(at) > bytes.length) throw new Error('is cut short');
  if ([...json.buffers ?? [], ...json.images ?? []].some(({uri}, k) => uri !== undefined && (k === 0 || !uri.startsWith('data:'))))
    throw new Error('has parts in other files, which a page cannot open');
  return {json, bin: has_bin ? bytes.subarray(at + 8, at + 8 + int(at)) : new Uint8Array()};
}
export function write_glb({json, bin}) {
  const text = new TextEncoder().encode(JSON.stringify(json)), long = padded(text.length), bytes = new Uint8Array(28 + long + padded(bin.length));
  const view = new DataView(bytes.buffer);
  [GLB, 2, bytes.length, long, JSON_CHUNK].forEach((word, k) => view.setUint32(4 * k, word, true));
  bytes.fill(32, 20, 20 + long).set(text, 20);
  view.setUint32(20 + long, padded(bin.length), true);
  view.setUint32(24 + long, BIN_CHUNK, true);
  bytes.set(bin, 28 + long);
  return bytes;
}
/** The fabric that a material wears: { bytes, reference }; null without one, or where it is a file of its own. */
export function embedded_fabric({json, bin}, material) {
  const reference = json.materials?.[material]?.extensions?.[EXTENSION]?.fabric;
  const {byteOffset = 0, byteLength, buffer} = json.bufferViews?.[json.extensions?.[EXTENSION]?.fabrics?.[reference?.index]?.bufferView] ?? {};
  return buffer === 0 ? {bytes: bin.slice(byteOffset, byteOffset + byteLength), reference} : null;
}
/** Puts bytes into a document: in place of a view's, or in a new view; its number. Other bytes that nothing holds go. */
function with_bytes(document, bytes, number) {
  const {json} = document, views = json.bufferViews ??= [];
  const others = views.flatMap((view, k) => k === number ? [] : [view, ...Object.values(view.extensions ?? {})]).filter(({buffer}) => buffer === 0);
  const count = others.reduce((sum, {byteLength}) => sum + padded(byteLength), 0);
  const view = {buffer: 0, byteLength: bytes.length};
  if (number === undefined) number = views.push(view) - 1;
  else views[number] = view;
  // Views that share bytes are left where they are.
  const moves = count <= padded(document.bin.length), bin = new Uint8Array((moves ? count : padded(document.bin.length)) + bytes.length);
  let at = moves ? 0 : padded(document.bin.length);
  if (!moves) bin.set(document.bin);
  for (const other of moves ? others : []) {
    const {byteOffset = 0, byteLength} = other;
    bin.set(document.bin.subarray(byteOffset, byteOffset + byteLength), at);
    other.byteOffset = at;
    at += padded(byteLength);
  }
  view.byteOffset = at;
  bin.set(bytes, at);
  document.bin = bin;
  json.buffers = [{...json.buffers?.[0], byteLength: bin.length}, ...json.buffers?.slice(1) ?? []];
  delete json.buffers[0].uri;
  return number;
}
/** The colour of a material whose picture tints its cloth; else null. */
export function print_colour({extensions, pbrMetallicRoughness: {baseColorTexture, baseColorFactor = [1, 1, 1]} = {}}) {
  const is_colour = Array.isArray(baseColorFactor) && baseColorFactor.length > 2 && baseColorFactor.every(Number.isFinite);
  return !extensions?.[EXTENSION] && baseColorTexture && !(baseColorTexture.texCoord > 1) ? is_colour ? baseColorFactor : [1, 1, 1] : null;
}
/** The members beside `fabric` that a garment brings to a cloth of mean `albedo`: its own once dressed, else its normals, print and mask. */
export function kept_members(material, albedo) {
  const {extensions, normalTexture, alphaMode, alphaCutoff, pbrMetallicRoughness: {baseColorTexture} = {}} = material, print = print_colour(material);
  if (extensions?.[EXTENSION]) return extensions[EXTENSION];
  const is_cut = alphaMode === 'MASK' && baseColorTexture;
  return {
    ...normalTexture && {normalTexture}, ...print && {tintTexture: baseColorTexture, tintFactor: tint_towards(print, albedo)},
    ...is_cut && {maskTexture: baseColorTexture, maskCutoff: alphaCutoff ?? 0.5}
  };
}
const at_most_one = (colour) => colour.map((c) => Math.min(c, 1));

/**
 * A garment whose materials wear a cloth, as `selvedge dress` writes it. `cloth`: { bytes, name,
 * fallback, has_holes, picture }: a fabric file, its fallback, and a PNG of it. `lays`: by material { scale, offset, rotation,
 * uv_set, tint }, of each that wears it; `tint`: in place of its own.
 */
export function dress_garment({json: undressed, bin}, {bytes, name, fallback, has_holes, picture}, lays) {
  const json = structuredClone(undressed), document = {json, bin}, used = new Set(json.extensionsUsed);
  const old = (json.extensions?.[EXTENSION]?.fabrics ?? []).map(({bufferView}) => bufferView).filter((view) => view !== undefined);
  // A garment that was dressed: its fabric goes, and the picture of it.
  const image = (json.images ?? []).findIndex((one) => one.name === 'fabric base colour');
  const fabric = {bufferView: with_bytes(document, bytes, old.length === 1 ? old[0] : undefined), mimeType: 'image/x-exr', name};
  json.extensions = {...json.extensions, [EXTENSION]: {fabrics: [fabric]}};
  const png = {bufferView: with_bytes(document, picture, json.images?.[image]?.bufferView), mimeType: 'image/png', name: 'fabric base colour'};
  const push = (list, value) => (json[list] ??= []).push(value) - 1;
  const source = image < 0 ? push('images', png) : image;
  json.images[source] = png;
  const sampler = push('samplers', {magFilter: 9729, minFilter: 9987, wrapS: 10497, wrapT: 10497}), texture = push('textures', {sampler, source});
  for (const [number, material] of (json.materials ?? []).entries()) {
    const lay = lays.get(number), {[EXTENSION]: was, ...extensions} = material.extensions ?? {};
    if (!lay) {
      if (was) material.extensions = extensions;
      continue;
    }
    const {scale, offset = [0, 0], rotation = 0, uv_set = 0, tint: other} = lay;
    const {fabric: _, ...parts} = {...kept_members(material, fallback.albedo ?? [1, 1, 1]), ...other && {tintFactor: other}};
    const info = (index) => ({index, ...uv_set && {texCoord: uv_set}, extensions: {[TRANSFORM]: {scale, ...offset.some(Boolean) && {offset}, ...rotation && {rotation}}}});
    const own = parts.tintTexture ?? parts.maskTexture, {baseColor = [0.5, 0.5, 0.5], sheenColor, sheenRoughness, transmission, transmissionColor} = fallback;
    const tint = parts.tintFactor ?? [1, 1, 1], factor = own ? baseColor.map((c, k) => c * tint[k]) : tint;
    material.pbrMetallicRoughness = {baseColorFactor: [...at_most_one(factor), 1], baseColorTexture: own ?? info(texture), metallicFactor: 0, roughnessFactor: 1};
    for (const member of ['normalTexture', 'alphaMode', 'alphaCutoff']) delete material[member];
    if (parts.normalTexture) material.normalTexture = parts.normalTexture;
    if (parts.maskTexture || has_holes)
      Object.assign(material, {alphaMode: 'MASK', alphaCutoff: parts.maskTexture ? parts.maskCutoff ?? 0.5 : own ? 0 : 0.5});
    const tinted = (colour) => at_most_one(colour.map((c, k) => c * tint[k]));
    material.doubleSided = true;
    material.extensions = {
      ...Object.fromEntries(Object.entries(extensions).filter(([key]) => !key.startsWith('KHR_materials_') || key === EMISSION)),
      [EXTENSION]: {...parts, fabric: info(0)},
      KHR_materials_specular: {specularFactor: 0},
      ...transmission > 0 && {KHR_materials_diffuse_transmission: {diffuseTransmissionFactor: transmission, diffuseTransmissionColorFactor: tinted(transmissionColor)}},
      ...sheenColor?.some(Boolean) && {KHR_materials_sheen: {sheenColorFactor: tinted(sheenColor), sheenRoughnessFactor: sheenRoughness}},
    };
    [TRANSFORM, ...Object.keys(material.extensions)].forEach((key) => used.add(key));
  }
  const all = JSON.stringify(json.materials) + JSON.stringify(json.extensions);
  json.extensionsUsed = [...used].filter((key) => !key.startsWith('KHR_materials_') || all.includes(`"${key}"`));
  return write_glb(document);
}

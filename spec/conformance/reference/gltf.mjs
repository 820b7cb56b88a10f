// The rules of SELVEDGE_materials_fabric for a glTF file (spec/SELVEDGE_materials_fabric/README.md).
import {evaluate_texel} from './brdf.mjs';
import {check_fabric} from './check.mjs';
import {read_fabric_level} from './level.mjs';
import {Issue, is_object, open_fabric} from './reader.mjs';
import {read_buffers, read_container, resolve_uri} from './gltf_container.mjs';
import {check_core} from './gltf_core.mjs';

const NAME = 'SELVEDGE_materials_fabric';
const EXCLUDED = ['KHR_materials_unlit', 'KHR_materials_pbrSpecularGlossiness'];
const WARNINGS = ['GLTF_FALLBACK', 'GLTF_ALPHA', 'GLTF_TRANSFORM', 'GLTF_ADVICE'];
/** The objects of what should be an array of them, each with its index. */
const objects = (array) =>
  Array.isArray(array) ? array.map((x, i) => [x, i]).filter(([x]) => is_object(x)) : [];
const is_index = (x) => Number.isInteger(x) && x >= 0;
const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

function fabric_bytes(file, {gltf, buffers}, item, place) {
  if (item.uri !== undefined) return resolve_uri(file, item.uri, `${place}/uri`);
  const view = gltf.bufferViews[item.bufferView];
  const data = buffers[view.buffer], begin = view.byteOffset ?? 0, size = view.byteLength;
  if (!data || !is_index(begin) || !is_index(size) || begin + size > data.length) {
    throw new Issue('GLTF_ACCESSOR', `/bufferViews/${item.bufferView}`, 'reaches beyond its buffer');
  }
  return data.subarray(begin, begin + size);
}

async function check_item(file, parsed, item, place, issues) {
  const error = (code, at, message) => {
    issues.push({code, severity: 'error', place: at, message});
  };
  const before = issues.length;
  const wrong = (at, message) => error('GLTF_EXTENSION', `${place}${at}`, message);
  if (!is_object(item)) return wrong('', 'is not an object');
  if (item.name !== undefined && typeof item.name !== 'string') wrong('/name', 'is not a string');
  if (item.mimeType !== 'image/x-exr') wrong('/mimeType', 'is not "image/x-exr"');
  if ((item.uri === undefined) === (item.bufferView === undefined))
    wrong('', 'has not exactly one of uri and bufferView');
  else if (item.uri !== undefined && (typeof item.uri !== 'string' || item.uri === ''))
    wrong('/uri', 'is not a string, or empty');
  else if (item.bufferView !== undefined) {
    const view = is_index(item.bufferView) ? parsed.gltf.bufferViews?.[item.bufferView] : null;
    if (!view)
      wrong('/bufferView', 'is not a buffer view');
    else if (view.byteStride !== undefined || view.target !== undefined)
      wrong('/bufferView', 'has a byteStride or a target');
  }
  if (issues.length > before) return null;
  try {
    const bytes = fabric_bytes(file, parsed, item, place);
    const found = await check_fabric(bytes);
    found.forEach((issue) => issues.push({...issue, place: `${place}: ${issue.place}`}));
    return found.some(({severity}) => severity === 'error') ? null : await open_fabric(bytes);
  } catch (issue) {
    if (!(issue instanceof Issue)) throw issue;
    error(issue.code, issue.place, issue.message);
    return null;
  }
}

/** Whether more than 1/2000 of a fabric is open, seen along the normal. */
function has_holes(fabric) {
  const level = read_fabric_level(fabric, 0);
  const {width, height} = level, above = [0, 0, 1];
  const alphas = Array.from({length: width * height}, (_, t) => [t % width, Math.floor(t / width)])
    .map((texel) => evaluate_texel(level, texel, above, above).alpha);
  return alphas.reduce((sum, alpha) => sum + 1 - alpha, 0) > 0.0005 * alphas.length;
}

/** The primitives of triangles that a material is on, directly or in a variant: [primitive, its place]. */
function primitives_of(gltf, material) {
  const found = [];
  objects(gltf.meshes).forEach(([mesh, m]) => objects(mesh.primitives).forEach(([primitive, p]) => {
    const mappings = primitive.extensions?.KHR_materials_variants?.mappings ?? [];
    if ((primitive.mode ?? 4) >= 4 && [primitive, ...mappings].some((user) => user.material === material))
      found.push([primitive, `/meshes/${m}/primitives/${p}/attributes`]);
  }));
  return found;
}

const PARTS = ['maskTexture', 'normalTexture', 'tintTexture'];
const MOST_TINT = 16;

function check_primitives(gltf, material, i, set, report) {
  const primitives = primitives_of(gltf, i), extension = material.extensions[NAME];
  const parts = PARTS.map((part) => extension[part]).filter(is_object).map((info) => transform_of(info).set);
  if (primitives.length === 0) report('GLTF_ADVICE', `/materials/${i}`, 'is on no triangles');
  for (const [{attributes = {}}, place] of primitives) {
    for (const needed of new Set([set, ...parts]))
      if (attributes[`TEXCOORD_${needed}`] === undefined)
        report('GARMENT_NO_UVS', place, `no TEXCOORD_${needed}, which the fabric or a texture is laid by`);
    if (attributes.NORMAL === undefined) report('GLTF_ADVICE', place, 'no NORMAL: flat triangles');
  }
}

function transform_of(info) {
  const t = info.extensions?.KHR_texture_transform ?? {};
  const {offset = [0, 0], scale = [1, 1], rotation = 0} = t;
  return {offset, scale, rotation, set: t.texCoord ?? info.texCoord ?? 0};
}

/** What keeps a fabric from lying on a surface by its transform: the member and why; null where nothing does. */
function transform_fault(reference) {
  const {offset, scale, rotation} = transform_of(reference);
  const beyond = Object.entries({offset, rotation: [rotation], scale})
    .find(([, values]) => values.some((x) => !Number.isFinite(Math.fround(x))));
  if (beyond) return [beyond[0], 'is beyond 32-bit floats'];
  return scale.some((x) => Math.abs(x) < 2 ** -126) ? ['scale', 'is no scale'] : null;
}

/** What the garment brings: textures of the file, a cutoff and a tint. */
function check_parts(gltf, extension, at, wrong) {
  for (const part of PARTS) {
    const info = extension[part];
    if (info !== undefined && !(is_index(info?.index) && is_object(gltf.textures?.[info.index])))
      wrong(`${at}/${part}`, 'is no texture of the file');
  }
  const {maskCutoff = 0, tintFactor = [1, 1, 1]} = extension;
  if (!(Number.isFinite(maskCutoff) && maskCutoff >= 0)) wrong(`${at}/maskCutoff`, 'is no number from 0 on');
  const in_range = (c) => Number.isFinite(c) && c >= 0 && c <= MOST_TINT;
  if (!(Array.isArray(tintFactor) && tintFactor.length === 3 && tintFactor.every(in_range)))
    wrong(`${at}/tintFactor`, `has not three numbers from 0 to ${MOST_TINT}`);
}

/** The fallback repeats as the fabric does, but for pictures of the garment. */
function check_wrapping(gltf, material, place, report) {
  const {baseColorTexture, metallicRoughnessTexture} = material.pbrMetallicRoughness ?? {};
  const {maskTexture, normalTexture, tintTexture} = material.extensions[NAME];
  const textures = {
    'pbrMetallicRoughness/baseColorTexture': tintTexture ?? maskTexture ? undefined : baseColorTexture,
    'pbrMetallicRoughness/metallicRoughnessTexture': metallicRoughnessTexture,
    normalTexture: normalTexture ? undefined : material.normalTexture,
  };
  for (const [at, info] of Object.entries(textures)) {
    const {wrapS = 10497, wrapT = 10497} = gltf.samplers?.[gltf.textures?.[info?.index]?.sampler] ?? {};
    if (wrapS !== 10497 || wrapT !== 10497)
      report('GLTF_FALLBACK', `${place}/${at}`, 'does not repeat as the fabric does');
  }
}

function check_fallback(material, reference, place, report) {
  const {metallicFactor = 1, baseColorTexture} = material.pbrMetallicRoughness ?? {};
  const warn = (at, message) => report('GLTF_FALLBACK', `${place}/${at}`, message);
  if (!baseColorTexture)
    warn('pbrMetallicRoughness', 'no baseColorTexture: other viewers show none of the fabric');
  if (metallicFactor !== 0) warn('pbrMetallicRoughness/metallicFactor', 'other viewers show metal');
  const {maskTexture, maskCutoff = 0.5, normalTexture, tintTexture} = material.extensions[NAME];
  const cutoff = maskTexture ? maskCutoff : tintTexture ? null : 0.5;
  if (maskTexture && material.alphaMode !== 'MASK') warn('alphaMode', 'is not MASK, so that the mask is not seen');
  if (material.alphaMode === 'MASK' && cutoff !== null && (material.alphaCutoff ?? 0.5) !== cutoff)
    warn('alphaCutoff', `is not ${cutoff}`);
  const pairs = [
    ['pbrMetallicRoughness/baseColorTexture', baseColorTexture, tintTexture ?? maskTexture],
    ['normalTexture', material.normalTexture, normalTexture],
  ];
  for (const [at, texture, of_garment] of pairs) {
    if (texture && !same(transform_of(texture), transform_of(of_garment ?? reference)))
      report('GLTF_TRANSFORM', place, 'fallback and fabric do not lie alike');
    if (texture && of_garment && texture.index !== of_garment.index) warn(at, 'is not the texture of the extension');
  }
}

function check_alpha({alphaMode = 'OPAQUE'}, fabric, place, report) {
  const holes = has_holes(fabric);
  if (alphaMode === 'OPAQUE' && holes)
    report('GLTF_ALPHA', place, 'alphaMode OPAQUE hides the holes of the fabric');
  if (alphaMode === 'BLEND' && !holes) report('GLTF_ALPHA', place, 'the fabric has no holes to blend');
  if (alphaMode === 'BLEND' && holes)
    report('GLTF_FALLBACK', place, 'other viewers have to sort the triangles');
}

function check_material(gltf, material, i, fabrics, items, report) {
  const place = `/materials/${i}`;
  const at = `${place}/extensions/${NAME}`;
  const wrong = (where, message) => report('GLTF_EXTENSION', where, message);
  const extension = material.extensions[NAME];
  for (const other of EXCLUDED)
    if (material.extensions[other]) wrong(`${place}/extensions/${other}`, 'does not go with a fabric');
  if (!is_object(extension)) return wrong(at, 'is not an object');
  const reference = extension.fabric;
  if (!is_object(reference)) return wrong(`${at}/fabric`, 'is missing or not an object');
  if (!is_index(reference.index) || reference.index >= items.length)
    return wrong(`${at}/fabric/index`, 'is not a fabric of the file');
  const {set} = transform_of(reference);
  if (!is_index(set)) return wrong(`${at}/fabric/texCoord`, 'is not a UV set');
  const fault = transform_fault(reference);
  if (fault) return wrong(`${at}/fabric/extensions/KHR_texture_transform/${fault[0]}`, fault[1]);
  const fabric = fabrics[reference.index];
  check_parts(gltf, extension, at, wrong);
  if (material.doubleSided !== true)
    report('GLTF_ADVICE', `${place}/doubleSided`, 'the back of the cloth is not drawn');
  check_wrapping(gltf, material, place, report);
  check_primitives(gltf, material, i, set, report);
  check_fallback(material, reference, place, report);
  if (fabric) check_alpha(material, fabric, place, report);
}

/** The issues of a glTF file: { code, severity, place, message }. */
export async function check_gltf(file, bytes) {
  const issues = [];
  const report = (code, place, message) =>
    issues.push({code, severity: WARNINGS.includes(code) ? 'warning' : 'error', place, message});
  const container = read_container(bytes, report);
  if (!container) return issues;
  const {gltf} = container, buffers = read_buffers(file, container, report);
  check_core(file, gltf, buffers, NAME, report);
  const wrong = (place, message) => report('GLTF_EXTENSION', place, message);
  const root = gltf.extensions?.[NAME];
  const users = objects(gltf.materials).filter(([material]) => material.extensions?.[NAME] !== undefined);
  if (gltf.extensionsRequired?.includes?.(NAME)) wrong('/extensionsRequired', 'the extension is optional');
  if (root === undefined && users.length === 0) return issues;
  if (!gltf.extensionsUsed?.includes?.(NAME)) wrong('/extensionsUsed', 'does not list the extension');
  const items = Array.isArray(root?.fabrics) ? root.fabrics : [];
  if (items.length === 0) wrong(`/extensions/${NAME}/fabrics`, 'is not a list of fabrics');
  const fabrics = [];
  for (const [i, item] of items.entries())
    fabrics.push(await check_item(file, {gltf, buffers}, item, `/extensions/${NAME}/fabrics/${i}`, issues));
  for (const [material, i] of users) check_material(gltf, material, i, fabrics, items, report);
  return issues;
}

// The rules of SELVEDGE_materials_fabric for a glTF file (spec/SELVEDGE_materials_fabric/README.md). What
// glTF itself asks for is the Khronos validator's affair; only what the extension builds on is looked at
// here.
import {readFileSync} from 'node:fs';
import {dirname, resolve} from 'node:path';
import {check_fabric} from './check.mjs';
import {LAYERS, header_digest, open_fabric, read_layer} from './fabric.mjs';
import {Issue} from './issue.mjs';

const NAME = 'SELVEDGE_materials_fabric';
const is_object = (x) => typeof x === 'object' && x !== null && !Array.isArray(x);
const is_index = (x) => Number.isInteger(x) && x >= 0;
const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

/** The JSON of a .gltf or .glb file, and the binary chunk of the latter. */
function parse(bytes) {
  let json = bytes, binary = null;
  const malformed = (message) => {
    throw new Issue('GLTF_MALFORMED', '', message);
  };
  if (bytes.length >= 12 && bytes.readUInt32LE(0) === 0x46546C67) {
    json = null;
    for (let at = 12; at + 8 <= bytes.length;) {
      const size = bytes.readUInt32LE(at), kind = bytes.readUInt32LE(at + 4);
      if (at + 8 + size > bytes.length) malformed('a chunk is cut short');
      const chunk = bytes.subarray(at + 8, at + 8 + size);
      if (kind === 0x4E4F534A)
        json ??= chunk;
      else if (kind === 0x004E4942)
        binary ??= chunk;
      at += 8 + size;
    }
    if (!json) malformed('no JSON chunk');
  }
  let gltf;
  try {
    gltf = JSON.parse(json.toString('utf8'));
  } catch (error) { malformed(error.message); }
  if (!is_object(gltf) || typeof gltf.asset?.version !== 'string') malformed('no asset with a version');
  return {gltf, binary};
}

/** The bytes behind a uri, beside `file`; an Issue if there are none. */
function resolve_uri(file, uri, place) {
  const fail = (message) => {
    throw new Issue('GLTF_REFERENCE', place, message);
  };
  if (uri.startsWith('data:')) {
    const [head, data] = [uri.slice(0, uri.indexOf(',')), uri.slice(uri.indexOf(',') + 1)];
    if (!head.endsWith(';base64') || !/^[A-Za-z0-9+/]*={0,2}$/.test(data)) fail('the data URI is not base64');
    return Buffer.from(data, 'base64');
  }
  try {
    return readFileSync(resolve(dirname(file), decodeURIComponent(uri)));
  } catch (error) { return fail(error.message); }
}

function fabric_bytes(file, {gltf, binary}, item, place) {
  if (item.uri !== undefined) return resolve_uri(file, item.uri, `${place}/uri`);
  const view = gltf.bufferViews[item.bufferView];
  const buffer = gltf.buffers?.[view.buffer];
  const data =
    buffer?.uri !== undefined ? resolve_uri(file, buffer.uri, `/buffers/${view.buffer}/uri`) : binary;
  const begin = view.byteOffset ?? 0, size = view.byteLength;
  if (!data || !is_index(begin) || !is_index(size) || begin + size > data.length) {
    throw new Issue('GLTF_ACCESSOR', `/bufferViews/${item.bufferView}`, 'reaches beyond its buffer');
  }
  return data.subarray(begin, begin + size);
}

function check_item(file, parsed, item, place, issues) {
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
  else if (item.uri !== undefined && typeof item.uri !== 'string')
    wrong('/uri', 'is not a string');
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
    const found = check_fabric(bytes);
    found.forEach((issue) => issues.push({...issue, place: `${place}: ${issue.place}`}));
    return found.some(({severity}) => severity === 'error') ? null : open_fabric(bytes);
  } catch (issue) {
    if (!(issue instanceof Issue)) throw issue;
    error(issue.code, issue.place, issue.message);
    return null;
  }
}

function has_holes(fabric) {
  const values = read_layer(fabric, LAYERS[3], 0);
  return values !== null && [...values.values()].some((numbers) => numbers.some((x) => x < 1));
}

function check_material(gltf, material, i, fabrics, items, issues) {
  const at = `/materials/${i}/extensions/${NAME}`;
  const note = (severity) => (code, place, message) => {
    issues.push({code, severity, place, message});
  };
  const wrong = (place, message) => note('error')('GLTF_EXTENSION', `${at}${place}`, message);
  const warn = note('warning');
  const extension = material.extensions[NAME];
  if (!is_object(extension)) return wrong('', 'is not an object');
  const reference = extension.fabric;
  if (!is_object(reference)) return wrong('/fabric', 'is missing or not an object');
  if (!is_index(reference.index) || reference.index >= items.length)
    return wrong('/fabric/index', 'is not a fabric of the file');
  const set = reference.texCoord ?? 0;
  if (!is_index(set)) return wrong('/fabric/texCoord', 'is not a UV set');
  (gltf.meshes ?? []).forEach((mesh, m) => mesh.primitives?.forEach((primitive, p) => {
    if (primitive.material === i && primitive.attributes?.[`TEXCOORD_${set}`] === undefined) {
      note('error')(
        'GARMENT_NO_UVS', `/meshes/${m}/primitives/${p}`,
        `has no TEXCOORD_${set}, which the fabric is laid by`);
    }
  }));

  const place = `/materials/${i}`;
  const fallback = material.pbrMetallicRoughness?.baseColorTexture;
  if (!fallback)
    warn('GLTF_FALLBACK', place, 'no baseColorTexture: other viewers show none of the fabric');
  else {
    const transform = (info) => {
      const t = info.extensions?.KHR_texture_transform ?? {};
      return {
        offset: t.offset ?? [0, 0],
        scale: t.scale ?? [1, 1],
        rotation: t.rotation ?? 0,
        set: t.texCoord ?? info.texCoord ?? 0
      };
    };
    if (!same(transform(fallback), transform(reference)))
      warn('GLTF_TRANSFORM', place, 'fallback and fabric do not lie alike');
  }
  const fabric = fabrics[reference.index];
  const mirror = material.extras?.[NAME];
  if (!is_object(mirror)) {
    warn('GLTF_MIRROR', place, 'no mirror in extras');
  } else {
    const {name, uri} = items[reference.index];
    const here = {...reference, name, uri, digest: mirror.digest && fabric && header_digest(fabric.file)};
    for (const member of ['index', 'texCoord', 'extensions', 'name', 'uri', 'digest']) {
      const fallback_value = member === 'texCoord' ? 0 : undefined;
      if (!same(mirror[member] ?? fallback_value, here[member] ?? fallback_value))
        warn('GLTF_MIRROR', `${place}/extras/${NAME}/${member}`, 'differs from what it mirrors');
    }
  }
  if (fabric) {
    const opaque = (material.alphaMode ?? 'OPAQUE') === 'OPAQUE';
    if (opaque && has_holes(fabric))
      warn('GLTF_ALPHA', place, 'alphaMode OPAQUE hides the holes of the fabric');
    if (!opaque && !has_holes(fabric)) warn('GLTF_ALPHA', place, 'the fabric has no holes to blend');
  }
}

/** The issues of a glTF file: { code, severity, place, message }. */
export function check_gltf(file, bytes) {
  const issues = [];
  const parsed = parse(bytes);
  const {gltf} = parsed;
  const wrong = (place, message) => {
    issues.push({code: 'GLTF_EXTENSION', severity: 'error', place, message});
  };
  const root = gltf.extensions?.[NAME];
  const users =
    (gltf.materials ?? []).flatMap((material, i) => material.extensions?.[NAME] !== undefined ? [i] : []);
  if (gltf.extensionsRequired?.includes(NAME)) wrong('/extensionsRequired', 'the extension is optional');
  if ((root !== undefined || users.length > 0) && !gltf.extensionsUsed?.includes(NAME))
    wrong('/extensionsUsed', 'does not list the extension');
  const items = Array.isArray(root?.fabrics) ? root.fabrics : [];
  if (root !== undefined || users.length > 0) {
    if (items.length === 0) wrong(`/extensions/${NAME}/fabrics`, 'is not a list of fabrics');
  }
  const fabrics =
    items.map((item, i) => check_item(file, parsed, item, `/extensions/${NAME}/fabrics/${i}`, issues));
  for (const i of users) check_material(gltf, gltf.materials[i], i, fabrics, items, issues);
  return issues;
}

// Checks of a glTF 2.0 file before it is used: version, lists, indices, bounds, values. The other
// rules of glTF are the Khronos validator's work.
import {resolve_uri} from './gltf_container.mjs';
import {Issue, is_object} from './reader.mjs';

/** Extensions that may be required: those that change how data is read, and that this program knows. */
const READ = ['KHR_texture_transform', 'KHR_mesh_quantization'];
const LISTS = [
  'accessors', 'bufferViews', 'buffers', 'cameras', 'images', 'materials', 'meshes', 'nodes', 'samplers',
  'scenes', 'skins', 'textures'
];
const READERS = {
  5120: ['readInt8', 1],
  5121: ['readUInt8', 1],
  5122: ['readInt16LE', 2],
  5123: ['readUInt16LE', 2],
  5125: ['readUInt32LE', 4],
  5126: ['readFloatLE', 4]
};
const COMPONENTS = {SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT2: 4, MAT3: 9, MAT4: 16};
const ATTRIBUTES = {
  POSITION: [3],
  NORMAL: [3],
  TANGENT: [4],
  TEXCOORD_0: [2],
  TEXCOORD_1: [2],
  COLOR_0: [3, 4],
  JOINTS_0: [4],
  WEIGHTS_0: [4]
};
const FLOAT = 5126, INDEX_TYPES = [5121, 5123, 5125], MOST_UNBACKED = 1e6;
const TRIANGLES = 4, LAST_MODE = 6;

const list_of = (object, name) => Array.isArray(object?.[name]) ? object[name] : [];
const is_count = (x) => Number.isInteger(x) && x >= 0;

function check_asset({asset}, report) {
  const {version, minVersion} = asset ?? {};
  if (typeof version !== 'string')
    report('GLTF_MALFORMED', '/asset/version', 'no version');
  else if (!version.startsWith('2.'))
    report('GLTF_UNSUPPORTED', '/asset/version', `glTF ${version}`);
  else if (minVersion !== undefined && minVersion !== '2.0')
    report('GLTF_UNSUPPORTED', '/asset/minVersion', `glTF ${minVersion}`);
}

function check_lists(gltf, ours, report) {
  for (const name of LISTS) {
    if (gltf[name] !== undefined && !Array.isArray(gltf[name]))
      report('GLTF_MALFORMED', `/${name}`, 'is not an array');
    list_of(gltf, name).forEach((entry, i) => {
      if (!is_object(entry)) report('GLTF_MALFORMED', `/${name}/${i}`, 'is not an object');
    });
  }
  for (const name of list_of(gltf, 'extensionsRequired')) {
    if (!READ.includes(name) && name !== ours)
      report('GLTF_UNSUPPORTED', '/extensionsRequired', `${name} is required`);
  }
}

/** Accessors and what they refer to. What is wrong is reported once, and its values are null. */
class Data {
  constructor(gltf, buffers, report) {
    this.gltf = gltf;
    this.buffers = buffers;
    this.report = report;
    this.values = new Map();
  }
  entry(list, i, place) {
    const found = is_count(i) ? list_of(this.gltf, list)[i] : undefined;
    if (found === undefined) this.report('GLTF_ACCESSOR', place, `there is no /${list}/${i}`);
    return found ?? null;
  }
  /** A view within its buffer. */
  view(i, place) {
    const view = this.entry('bufferViews', i, place), at = `/bufferViews/${i}`;
    const buffer = view && this.entry('buffers', view.buffer, at);
    if (!buffer) return null;
    if ((view.byteOffset ?? 0) + view.byteLength <= buffer.byteLength) return view;
    this.report('GLTF_ACCESSOR', at, 'reaches beyond its buffer');
    return null;
  }
  /** Where `count` elements of `size` bytes stand: { bytes, begin, step }. */
  run({bufferView, byteOffset = 0}, count, size, place) {
    const view = this.view(bufferView, place);
    if (!view) return null;
    const step = view.byteStride ?? size;
    if (step >= size && byteOffset + step * (count - 1) + size <= view.byteLength) {
      const bytes = this.buffers[view.buffer];
      return bytes && {bytes, begin: (view.byteOffset ?? 0) + byteOffset, step};
    }
    this.report('GLTF_ACCESSOR', place, `reaches beyond buffer view ${bufferView}`);
    return null;
  }
  /** { n, numbers, componentType } of an accessor. */
  read(i, place) {
    const accessor = this.entry('accessors', i, place);
    if (!accessor) return null;
    if (!this.values.has(i)) this.values.set(i, this.read_numbers(accessor, `/accessors/${i}`));
    return this.values.get(i);
  }
  read_numbers(accessor, place) {
    const {bufferView, componentType, count, type, sparse} = accessor, n = COMPONENTS[type];
    const [read, bytes_each] = READERS[componentType] ?? [];
    if (!is_count(count) || count === 0 || !n || !read) {
      this.report('GLTF_MALFORMED', place, 'wrong count, type or componentType');
      return null;
    }
    const numbers_of = (from) => Float64Array.from(
      {length: from.count * n},
      (_, k) => from.bytes[read](from.begin + from.step * Math.floor(k / n) + bytes_each * (k % n)));
    let numbers = null;
    if (bufferView !== undefined) {
      const from = this.run(accessor, count, bytes_each * n, place);
      if (!from) return null;
      numbers = numbers_of({...from, count});
    } else if (count <= MOST_UNBACKED) {
      numbers = new Float64Array(count * n);
    }
    if (sparse && !this.replace(sparse, numbers, count, bytes_each * n, `${place}/sparse`, numbers_of))
      return null;
    return {n, numbers, componentType};
  }
  /** Puts the values of a sparse accessor in their places; whether they are all right. */
  replace({count, indices, values}, numbers, elements, size, place, numbers_of) {
    const wrong = (code, message, at = place) => {
      this.report(code, at, message);
      return false;
    };
    if (!is_count(count) || count > elements)
      return wrong('GLTF_ACCESSOR', 'more than there are elements', `${place}/count`);
    if (!INDEX_TYPES.includes(indices?.componentType))
      return wrong('GLTF_MALFORMED', 'indices are unsigned integers', `${place}/indices`);
    const [read, bytes_each] = READERS[indices.componentType];
    const where = this.run(indices, count, bytes_each, `${place}/indices`);
    const what = this.run(values ?? {}, count, size, `${place}/values`);
    if (!where || !what) return false;
    const replacements = numbers_of({...what, count}), n = replacements.length / count;
    for (let k = 0, last = -1; k < count; ++k) {
      const to = where.bytes[read](where.begin + k * where.step);
      if (to >= elements) return wrong('GLTF_ACCESSOR', `index ${to} of ${elements}`);
      if (to <= last) return wrong('GLTF_MALFORMED', 'the indices do not increase');
      numbers.set(replacements.subarray(k * n, k * n + n), to * n);
      last = to;
    }
    return true;
  }
}

/** Attributes and indices of a primitive of triangles; the smallest skin on its mesh has `joints`. */
function check_primitive(data, primitive, place, joints) {
  const {attributes, indices, mode = TRIANGLES, material} = primitive;
  const wrong = (code, at, message) => data.report(code, `${place}/${at}`, message);
  if (mode < TRIANGLES || attributes?.POSITION === undefined) return;
  if (!(mode <= LAST_MODE)) wrong('GLTF_MALFORMED', 'mode', 'is unknown');
  if (material !== undefined) data.entry('materials', material, `${place}/material`);
  let vertices = null;
  for (const [name, sizes] of Object.entries(ATTRIBUTES)) {
    if (attributes[name] === undefined) continue;
    const at = `attributes/${name}`, read = data.read(attributes[name], `${place}/${at}`);
    if (!read) continue;
    const count = read.numbers.length / read.n;
    vertices ??= count;
    if (!sizes.includes(read.n) || count !== vertices)
      wrong('GLTF_MALFORMED', at, `${count} elements of ${read.n} numbers`);
    else if (!read.numbers.every(Number.isFinite))
      wrong('MESH_NOT_FINITE', at, 'a value is not finite');
    else if (name === 'JOINTS_0' && read.numbers.some((x) => x >= joints))
      wrong('GLTF_ACCESSOR', at, `a joint of ${joints} is not there`);
  }
  if (indices === undefined) return;
  const read = data.read(indices, `${place}/indices`);
  if (read && (read.n !== 1 || !INDEX_TYPES.includes(read.componentType)))
    wrong('GLTF_MALFORMED', 'indices', 'are SCALAR and of unsigned integers');
  else if (read?.numbers.some((x) => x >= vertices))
    wrong('GLTF_ACCESSOR', 'indices', `an index of ${vertices} vertices is not there`);
}

function check_skin(data, {inverseBindMatrices, joints = []}, place) {
  joints.forEach((joint, j) => data.entry('nodes', joint, `${place}/joints/${j}`));
  if (inverseBindMatrices === undefined) return;
  const at = `${place}/inverseBindMatrices`, read = data.read(inverseBindMatrices, at);
  if (read && (read.n !== 16 || read.componentType !== FLOAT || read.numbers.length < 16 * joints.length))
    data.report('GLTF_MALFORMED', at, 'there is not one matrix of floats per joint');
}

/** Nodes are a forest: every one is reached once, from its scene or its parent. */
function check_nodes(data, {nodes = [], scenes = [], scene = 0}) {
  const wrong = (i, message) => data.report('GLTF_MALFORMED', `/nodes/${i}`, message);
  if (scenes.length > 0) data.entry('scenes', scene, '/scene');
  const children = new Set(nodes.flatMap((node) => list_of(node, 'children')));
  const listed = list_of(scenes[scene], 'nodes'), reached = new Set();
  const open = [...listed, ...nodes.keys()].filter(
    (node, i) => i < listed.length || (!children.has(node) && !listed.includes(node)));
  const lengths = {matrix: 16, translation: 3, rotation: 4, scale: 3};
  while (open.length > 0) {
    const i = open.pop(), node = data.entry('nodes', i, '/scenes');
    if (!node) continue;
    if (reached.size === reached.add(i).size) {
      wrong(i, 'is reached twice');
      continue;
    }
    for (const [name, length] of Object.entries(lengths))
      if (node[name] !== undefined && list_of(node, name).length !== length)
        wrong(i, `${name} has not ${length} numbers`);
    if (node.mesh !== undefined) data.entry('meshes', node.mesh, `/nodes/${i}/mesh`);
    if (node.skin !== undefined) data.entry('skins', node.skin, `/nodes/${i}/skin`);
    open.push(...list_of(node, 'children'));
  }
}

function check_image(file, data, image, place) {
  const {uri, bufferView} = image;
  try {
    if (uri !== undefined)
      resolve_uri(file, uri, place);
    else if (bufferView !== undefined)
      data.view(bufferView, place);
  } catch (error) {
    if (!(error instanceof Issue)) throw error;
    data.report('IMAGE_UNREADABLE', place, error.message);
  }
}

/** Reports what keeps a file from being read. `ours`: the extension whose own rules are checked elsewhere. */
export function check_core(file, gltf, buffers, ours, report) {
  let errors = 0;
  const note = (code, place, message) => {
    ++errors;
    report(code, place, message);
  };
  check_asset(gltf, note);
  check_lists(gltf, ours, note);
  if (errors > 0) return;
  const data = new Data(gltf, buffers, note);
  list_of(gltf, 'bufferViews').forEach((_, i) => data.view(i, ''));
  if (errors > 0) return;
  list_of(gltf, 'accessors').forEach((_, i) => data.read(i, ''));
  if (errors > 0) return;
  list_of(gltf, 'meshes').forEach((mesh, m) => {
    const skins = list_of(gltf, 'nodes').filter((node) => node.mesh === m && gltf.skins?.[node.skin]);
    const joints = Math.min(...skins.map((node) => list_of(gltf.skins[node.skin], 'joints').length));
    list_of(mesh, 'primitives')
      .forEach((primitive, p) => check_primitive(data, primitive, `/meshes/${m}/primitives/${p}`, joints));
  });
  list_of(gltf, 'skins').forEach((skin, i) => check_skin(data, skin, `/skins/${i}`));
  check_nodes(data, gltf);
  list_of(gltf, 'images').forEach((image, i) => check_image(file, data, image, `/images/${i}`));
}

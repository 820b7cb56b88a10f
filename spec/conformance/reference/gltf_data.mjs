// Buffer views, accessors and what meshes make of them (glTF 2.0, sections 3.6 and 3.7).

const COMPONENT_BYTES = {
  5120: 1,
  5121: 1,
  5122: 2,
  5123: 2,
  5125: 4,
  5126: 4
};
const COMPONENTS = {
  SCALAR: 1,
  VEC2: 2,
  VEC3: 3,
  VEC4: 4,
  MAT2: 4,
  MAT3: 9,
  MAT4: 16
};
const READERS = {
  5120: 'readInt8',
  5121: 'readUInt8',
  5122: 'readInt16LE',
  5123: 'readUInt16LE',
  5125: 'readUInt32LE',
  5126: 'readFloatLE'
};
const FLOAT = 5126, VERTICES = 34962, INDICES = 34963;
const LARGEST_INDEX = {
  5121: 0xFF,
  5123: 0xFFFF,
  5125: 0xFFFFFFFF
};
const UNIT_TOLERANCE = 0.00682;  // of vectors rounded to 8 bits

/**
 * The formats of attributes, "TYPE component" with "n" where it is normalised; then those of quantization.
 */
const plain = (type, ...components) => components.map((c) => `${type} ${c}`);
const BYTES_AND_SHORTS = ['5120', '5121', '5122', '5123'], NORMALISED = ['5121n', '5123n'];
const SEMANTICS = {
  POSITION:
    [plain('VEC3', FLOAT), plain('VEC3', ...BYTES_AND_SHORTS, ...BYTES_AND_SHORTS.map((c) => `${c}n`))],
  NORMAL: [plain('VEC3', FLOAT), plain('VEC3', '5120n', '5122n')],
  TANGENT: [plain('VEC4', FLOAT), plain('VEC4', '5120n', '5122n')],
  TEXCOORD: [plain('VEC2', FLOAT, ...NORMALISED), plain('VEC2', ...BYTES_AND_SHORTS, '5120n', '5122n')],
  COLOR: [[...plain('VEC3', FLOAT, ...NORMALISED), ...plain('VEC4', FLOAT, ...NORMALISED)], []],
  JOINTS: [plain('VEC4', 5121, 5123), []],
  WEIGHTS: [plain('VEC4', FLOAT, ...NORMALISED), []]
};
const semantic_of = (name) => /^(TEXCOORD|COLOR|JOINTS|WEIGHTS)_(0|[1-9][0-9]*)$/.exec(name)?.[1] ??
  (['POSITION', 'NORMAL', 'TANGENT'].includes(name) ? name : null);

/**
 * Reads the accessors of a glTF whose members are of their types (check_schema). buffers: their bytes, or
 * null.
 */
export class Accessors {
  constructor(gltf, buffers, report) {
    this.gltf = gltf;
    this.buffers = buffers;
    this.report = report;
    this.values = (gltf.accessors ?? []).map((_, i) => this.check_accessor(i));
  }
  wrong(place, message) {
    this.report('GLTF_MALFORMED', place, message);
  }
  beyond(place, message) {
    this.report('GLTF_ACCESSOR', place, message);
  }
  accessor(i) {
    return this.gltf.accessors[i];
  }
  /** Where the elements stand: { bytes, begin, step }; null where there is something wrong. */
  elements(view_index, offset, count, size, place) {
    const view = this.gltf.bufferViews[view_index], step = view.byteStride ?? size;
    if (step < size) return this.beyond(place, `a byteStride of ${step} for ${size} bytes`);
    if (offset + step * (count - 1) + size > view.byteLength)
      return this.beyond(place, `reaches beyond buffer view ${view_index}`);
    return {bytes: this.buffers[view.buffer], begin: (view.byteOffset ?? 0) + offset, step};
  }
  aligned(view_index, offset, size, place) {
    const start = this.gltf.bufferViews[view_index].byteOffset ?? 0;
    if (offset % size !== 0 || (start + offset) % size !== 0)
      this.wrong(place, `is not aligned to ${size} bytes`);
  }
  /** The numbers of an accessor, as stored; null where they cannot be had. */
  check_accessor(i) {
    const accessor = this.accessor(i), place = `/accessors/${i}`;
    const {bufferView, byteOffset = 0, componentType, normalized, count, type, sparse} = accessor;
    const bytes_each = COMPONENT_BYTES[componentType], n = COMPONENTS[type], size = bytes_each * n;
    if (normalized && (componentType === FLOAT || componentType === 5125))
      this.wrong(`${place}/normalized`, 'is for bytes and shorts');
    for (const bound of ['min', 'max']) {
      if (accessor[bound] && accessor[bound].length !== n)
        this.wrong(`${place}/${bound}`, `has not ${n} items`);
    }
    const read = (from, k) =>
      from.bytes[READERS[componentType]](from.begin + from.step * Math.floor(k / n) + bytes_each * (k % n));
    let numbers = null;
    if (bufferView === undefined) {
      if (!sparse || count > 1e6) return null;
      numbers = new Float64Array(count * n);
    } else {
      const from = this.elements(bufferView, byteOffset, count, size, place);
      if (!from) return null;
      this.aligned(bufferView, byteOffset, bytes_each, `${place}/byteOffset`);
      if (!from.bytes) return null;
      numbers = Float64Array.from({length: count * n}, (_, k) => read(from, k));
    }
    if (sparse && !this.replace(sparse, accessor, size, place, (from, k, to) => {
          for (let c = 0; c < n; ++c) numbers[to * n + c] = read(from, k * n + c);
        }))
      return null;
    this.check_bounds(accessor, numbers, n, place);
    return numbers;
  }
  /** Puts the values of a sparse accessor in their places; whether they are all right. */
  replace({count, indices, values}, accessor, size, place, put) {
    if (count > accessor.count) return this.beyond(`${place}/sparse/count`, 'more than there are elements');
    const index_bytes = COMPONENT_BYTES[indices.componentType];
    const where = this.elements(
      indices.bufferView, indices.byteOffset ?? 0, count, index_bytes, `${place}/sparse/indices`);
    const what =
      this.elements(values.bufferView, values.byteOffset ?? 0, count, size, `${place}/sparse/values`);
    if (!where || !what) return false;
    this.aligned(indices.bufferView, indices.byteOffset ?? 0, index_bytes, `${place}/sparse/indices`);
    this.aligned(
      values.bufferView, values.byteOffset ?? 0, COMPONENT_BYTES[accessor.componentType],
      `${place}/sparse/values`);
    if (!where.bytes || !what.bytes) return false;
    let last = -1;
    for (let k = 0; k < count; ++k) {
      const to = where.bytes[READERS[indices.componentType]](where.begin + k * where.step);
      if (to >= accessor.count) return this.beyond(`${place}/sparse`, `index ${to} of ${accessor.count}`);
      if (to <= last) return this.wrong(`${place}/sparse`, 'the indices do not increase');
      put(what, k, last = to);
    }
    return true;
  }
  check_bounds(accessor, numbers, n, place) {
    for (const [bound, choose] of [['min', Math.min], ['max', Math.max]]) {
      if (accessor[bound]?.length !== n) continue;
      accessor[bound].forEach((said, c) => {
        let real = numbers[c];
        for (let k = c; k < numbers.length; k += n) real = choose(real, numbers[k]);
        const stored = accessor.componentType === FLOAT ? Math.fround(said) : said;
        if (Number.isFinite(real) && stored !== real)
          this.beyond(`${place}/${bound}/${c}`, `is ${said}, not ${real}`);
      });
    }
  }
}

export function check_views({bufferViews = [], buffers = []}, report) {
  bufferViews.forEach((view, i) => {
    const place = `/bufferViews/${i}`, {byteOffset = 0, byteLength, byteStride, target} = view;
    if (byteOffset + byteLength > buffers[view.buffer].byteLength)
      report('GLTF_ACCESSOR', place, 'reaches beyond its buffer');
    if (byteStride === undefined) return;
    if (byteStride % 4 !== 0 || byteStride > byteLength)
      report('GLTF_MALFORMED', `${place}/byteStride`, 'is no multiple of 4, or more than the view has');
    if (target === INDICES) report('GLTF_MALFORMED', `${place}/byteStride`, 'indices have none');
  });
}

/** What views are used for: one kind of thing each, and that of their target. */
export class ViewUses {
  constructor(gltf, report) {
    this.gltf = gltf;
    this.report = report;
    this.kinds = new Map();
    this.vertices = new Map();  // view -> accessors
  }
  use(view_index, kind, place, accessor) {
    if (view_index === undefined) return;
    const wrong = (at, message) => this.report('GLTF_MALFORMED', at, message);
    const view = this.gltf.bufferViews[view_index], before = this.kinds.get(view_index);
    if (before !== undefined && before !== kind)
      wrong(place, `buffer view ${view_index} is used for something else, too`);
    else if (view.target !== undefined && before === undefined && view.target !== kind && [
               VERTICES, INDICES
             ].includes(view.target))
      wrong(place, `is not what buffer view ${view_index} is the target of`);
    if (before === undefined && kind !== VERTICES && view.byteStride !== undefined)
      wrong(place, `buffer view ${view_index} has a byteStride, which is for vertices`);
    this.kinds.set(view_index, kind);
    if (kind !== VERTICES) return;
    const sharing = this.vertices.get(view_index) ?? new Set();
    this.vertices.set(view_index, sharing.add(accessor));
    if (sharing.size === 2 && view.byteStride === undefined)
      wrong(`/bufferViews/${view_index}`, 'has no byteStride, but several accessors of vertices');
  }
  use_all() {
    const {gltf} = this;
    const of = (i) => gltf.accessors[i]?.bufferView;
    (gltf.meshes ?? []).forEach(({primitives}, m) => primitives.forEach((primitive, p) => {
      const place = `/meshes/${m}/primitives/${p}`;
      for (const [group, where] of [
             [primitive.attributes, 'attributes'],
             ...(primitive.targets ?? []).map((t, i) => [t, `targets/${i}`])]) {
        for (const [name, accessor] of Object.entries(group))
          this.use(of(accessor), VERTICES, `${place}/${where}/${name}`, accessor);
      }
      if (primitive.indices !== undefined) this.use(of(primitive.indices), INDICES, `${place}/indices`);
    }));
    (gltf.accessors ?? []).forEach(({sparse}, i) => {
      this.use(sparse?.indices.bufferView, 'other', `/accessors/${i}/sparse`);
      this.use(sparse?.values.bufferView, 'other', `/accessors/${i}/sparse`);
    });
    (gltf.images ?? []).forEach(({bufferView}, i) => this.use(bufferView, 'other', `/images/${i}`));
    (gltf.skins ?? []).forEach((skin, i) => this.use(of(skin.inverseBindMatrices), 'other', `/skins/${i}`));
    (gltf.animations ?? []).forEach(({samplers}, a) => samplers.forEach(({input, output}, s) => {
      for (const accessor of [input, output])
        this.use(of(accessor), 'other', `/animations/${a}/samplers/${s}`);
    }));
  }
}

/** Attributes, indices and morph targets of all primitives. */
export class MeshCheck {
  constructor(gltf, accessors, report) {
    this.gltf = gltf;
    this.accessors = accessors;
    this.report = report;
    this.quantized = gltf.extensionsUsed?.includes('KHR_mesh_quantization') ?? false;
  }
  wrong(place, message) {
    this.report('GLTF_MALFORMED', place, message);
  }
  check() {
    (this.gltf.meshes ?? []).forEach(({primitives, weights}, m) => {
      const place = `/meshes/${m}`;
      primitives.forEach((primitive, p) => this.check_primitive(primitive, `${place}/primitives/${p}`));
      const counts = new Set(primitives.map(({targets = []}) => targets.length));
      if (counts.size > 1) this.wrong(`${place}/primitives`, 'the numbers of morph targets differ');
      if (weights && !counts.has(weights.length))
        this.wrong(`${place}/weights`, 'as many as morph targets are due');
    });
  }
  check_primitive(primitive, place) {
    const {attributes, targets = [], mode = 4} = primitive;
    const at = `${place}/attributes`;
    for (const [name, i] of Object.entries(attributes)) this.check_attribute(name, i, `${at}/${name}`, false);
    const counts = Object.values(attributes).map((i) => this.accessors.accessor(i).count);
    if (new Set(counts).size > 1) this.wrong(at, 'the attributes have different counts');
    this.check_numbers(attributes, at);
    if (attributes.POSITION === undefined) this.report('GLTF_ADVICE', at, 'no POSITION');
    if (attributes.TANGENT !== undefined && attributes.NORMAL === undefined)
      this.report('GLTF_ADVICE', `${at}/TANGENT`, 'tangents without normals');
    const drawn = this.check_indices(primitive, counts[0], `${place}/indices`);
    if (mode === 4 && drawn % 3 !== 0 && !primitive.extensions?.KHR_draco_mesh_compression)
      this.report('GLTF_ADVICE', place, `${drawn} vertices or indices make no triangles`);
    targets.forEach((target, t) => {
      for (const [name, i] of Object.entries(target)) {
        const where = `${place}/targets/${t}/${name}`;
        this.check_attribute(name, i, where, true);
        if (attributes[name] === undefined) this.wrong(where, 'the primitive has no such attribute');
        if (this.accessors.accessor(i).count !== counts[0])
          this.wrong(where, 'has another count than the attributes');
      }
    });
    this.check_sets(primitive, place);
  }
  check_attribute(name, i, place, morph) {
    const accessor = this.accessors.accessor(i), numbers = this.accessors.values[i];
    const semantic = semantic_of(name);
    if (semantic === null && !name.startsWith('_')) this.wrong(place, 'is no name of an attribute');
    if (accessor.componentType === 5125) this.wrong(place, 'attributes cannot be of 32-bit integers');
    if (semantic !== null && !morph) {
      const [usual, quantized] = SEMANTICS[semantic];
      const format = `${accessor.type} ${accessor.componentType}${accessor.normalized ? 'n' : ''}`;
      if (![...usual, ...(this.quantized ? quantized : [])].includes(format))
        this.wrong(place, `${format} is no format of this attribute`);
    }
    if (name === 'POSITION' && !(accessor.min && accessor.max)) this.wrong(place, 'needs min and max');
    const view = this.gltf.bufferViews?.[accessor.bufferView];
    const size = COMPONENT_BYTES[accessor.componentType] * COMPONENTS[accessor.type];
    if (view && [
          accessor.byteOffset ?? 0, view.byteStride ?? (accessor.count > 1 ? size : 4),
          (view.byteOffset ?? 0) + (accessor.byteOffset ?? 0)
        ].some((x) => x % 4 !== 0))
      this.wrong(place, 'vertices are not aligned to 4 bytes');
    if (!numbers) return;
    if (numbers.some((x) => !Number.isFinite(x)))
      this.report('MESH_NOT_FINITE', place, 'a value is not finite');
    const values = (text) => this.report('GLTF_ACCESSOR', place, text);
    if (morph || accessor.componentType !== FLOAT) return;
    if (semantic === 'COLOR' && numbers.some((x) => x < 0 || x > 1)) values('colours beyond 0 to 1');
    const n = COMPONENTS[accessor.type];
    for (let k = 0; (name === 'NORMAL' || name === 'TANGENT') && k < numbers.length; k += n) {
      const length = Math.hypot(...numbers.subarray(k, k + 3));
      if (Math.abs(length - 1) > UNIT_TOLERANCE) return values(`a vector of length ${length}`);
      if (name === 'TANGENT' && Math.abs(numbers[k + 3]) !== 1)
        return values('w of a tangent is not 1 or -1');
    }
  }
  /** Numbers of sets begin with 0 and leave none out; joints and weights go together. */
  check_numbers(attributes, place) {
    const counts = {};
    for (const name of ['TEXCOORD', 'COLOR', 'JOINTS', 'WEIGHTS']) {
      const numbers =
        Object.keys(attributes).filter((a) => semantic_of(a) === name).map((a) => Number(a.split('_')[1]));
      counts[name] = numbers.length;
      if (numbers.some((x) => x >= numbers.length)) this.wrong(place, `the numbers of ${name} leave one out`);
    }
    if (counts.JOINTS !== counts.WEIGHTS) this.wrong(place, 'joints and weights do not go together');
  }
  /** Gives the number of vertices that are drawn. */
  check_indices({indices}, vertices, place) {
    if (indices === undefined) return vertices;
    const {type, componentType, normalized, count} = this.accessors.accessor(indices);
    const restart = LARGEST_INDEX[componentType];
    if (type !== 'SCALAR' || restart === undefined || normalized)
      this.wrong(place, 'indices are SCALAR and of unsigned integers');
    else
      for (const x of this.accessors.values[indices] ?? []) {
        if (x === restart || x >= vertices) {
          this.report('GLTF_ACCESSOR', place, `index ${x} of ${vertices} vertices`);
          break;
        }
      }
    return count;
  }
  /** That the UV sets are there which the textures of the material take. */
  check_sets({material, attributes}, place) {
    const visit = (value) => {
      for (const [name, x] of Object.entries(value)) {
        if (typeof x !== 'object' || x === null || name === 'extras') continue;
        if (name.endsWith('Texture') && x.index !== undefined) {
          const set = x.extensions?.KHR_texture_transform?.texCoord ?? x.texCoord ?? 0;
          if (attributes[`TEXCOORD_${set}`] === undefined)
            this.wrong(`${place}/material`, `a texture of the material takes TEXCOORD_${set}`);
        } else {
          visit(x);
        }
      }
    };
    if (material !== undefined) visit(this.gltf.materials[material]);
  }
}

// The objects of glTF 2.0 (chapter 5 of its specification) as tables: members, types, ranges, choices.
import {is_object} from './json.mjs';

// A member: what makes a value good, and what holds of the array if it is one. 'of' names the table of an
// object, or the array of the root that an index leads into.
const text = {
  is: (x) => typeof x === 'string',
  what: 'a string'
};
const flag = {
  is: (x) => typeof x === 'boolean',
  what: 'a boolean'
};
const number = (low = -Infinity, high = Infinity) =>
  ({is: (x) => typeof x === 'number' && x >= low && x <= high, what: `a number from ${low} to ${high}`});
const above_0 = {
  is: (x) => typeof x === 'number' && x > 0,
  what: 'a number above 0'
};
const integer = (low = 0, high = Infinity) =>
  ({is: (x) => Number.isInteger(x) && x >= low && x <= high, what: `an integer from ${low} to ${high}`});
const index = (array) => ({...integer(), what: 'an index', array});
const object = (table) => ({is: is_object, what: 'an object', table});
const indices_by_name = (array) =>
  ({is: (x) => is_object(x) && Object.keys(x).length > 0, what: 'an object of indices', map: array});
const one_of = (member, ...choices) => ({...member, choices});
/** Values that a reader may have to guess at: no error. */
const better_one_of = (member, ...choices) => ({...member, choices, advice: true});
const needed = (member) => ({...member, needed: true});
const list = (member, least = 1, most = Infinity) => ({...member, list: [least, most]});
const set = (member) => ({...list(member), unique: true});

const COMPONENTS = [5120, 5121, 5122, 5123, 5125, 5126];
const TYPES = ['SCALAR', 'VEC2', 'VEC3', 'VEC4', 'MAT2', 'MAT3', 'MAT4'];
const WRAPS = [10497, 33071, 33648];
const texture_info = {
  index: needed(index('textures')),
  texCoord: integer()
};

const TABLES = {
  root: {
    asset: needed(object('asset')),
    extensionsUsed: set(text),
    extensionsRequired: set(text),
    accessors: list(object('accessor')),
    animations: list(object('animation')),
    buffers: list(object('buffer')),
    bufferViews: list(object('bufferView')),
    cameras: list(object('camera')),
    images: list(object('image')),
    materials: list(object('material')),
    meshes: list(object('mesh')),
    nodes: list(object('node')),
    samplers: list(object('sampler')),
    scene: index('scenes'),
    scenes: list(object('scene')),
    skins: list(object('skin')),
    textures: list(object('texture'))
  },
  asset: {version: needed(text), minVersion: text, generator: text, copyright: text},
  accessor: {
    bufferView: index('bufferViews'),
    byteOffset: integer(),
    componentType: needed(one_of(integer(), ...COMPONENTS)),
    normalized: flag,
    count: needed(integer(1)),
    type: needed(one_of(text, ...TYPES)),
    max: list(number(), 1, 16),
    min: list(number(), 1, 16),
    sparse: object('sparse')
  },
  sparse: {
    count: needed(integer(1)),
    indices: needed(object('sparse_indices')),
    values: needed(object('sparse_values'))
  },
  sparse_indices: {
    bufferView: needed(index('bufferViews')),
    byteOffset: integer(),
    componentType: needed(one_of(integer(), 5121, 5123, 5125))
  },
  sparse_values: {bufferView: needed(index('bufferViews')), byteOffset: integer()},
  animation: {channels: needed(list(object('channel'))), samplers: needed(list(object('animation_sampler')))},
  channel: {sampler: needed(integer()), target: needed(object('target'))},
  target: {node: index('nodes'), path: needed(text)},
  animation_sampler: {
    input: needed(index('accessors')),
    interpolation: better_one_of(text, 'LINEAR', 'STEP', 'CUBICSPLINE'),
    output: needed(index('accessors'))
  },
  buffer: {uri: text, byteLength: needed(integer(1))},
  bufferView: {
    buffer: needed(index('buffers')),
    byteOffset: integer(),
    byteLength: needed(integer(1)),
    byteStride: integer(4, 252),
    target: better_one_of(integer(), 34962, 34963)
  },
  camera: {
    type: needed(better_one_of(text, 'perspective', 'orthographic')),
    perspective: object('perspective'),
    orthographic: object('orthographic')
  },
  perspective: {aspectRatio: above_0, yfov: needed(above_0), zfar: above_0, znear: needed(above_0)},
  orthographic:
    {xmag: needed(number()), ymag: needed(number()), zfar: needed(above_0), znear: needed(number(0))},
  image: {uri: text, mimeType: text, bufferView: index('bufferViews')},
  material: {
    pbrMetallicRoughness: object('pbr'),
    normalTexture: object('normal_texture'),
    occlusionTexture: object('occlusion_texture'),
    emissiveTexture: object('texture_info'),
    emissiveFactor: list(number(0, 1), 3, 3),
    alphaMode: better_one_of(text, 'OPAQUE', 'MASK', 'BLEND'),
    alphaCutoff: number(0),
    doubleSided: flag
  },
  pbr: {
    baseColorFactor: list(number(0, 1), 4, 4),
    baseColorTexture: object('texture_info'),
    metallicFactor: number(0, 1),
    roughnessFactor: number(0, 1),
    metallicRoughnessTexture: object('texture_info')
  },
  texture_info,
  normal_texture: {...texture_info, scale: number()},
  occlusion_texture: {...texture_info, strength: number(0, 1)},
  mesh: {primitives: needed(list(object('primitive'))), weights: list(number())},
  primitive: {
    attributes: needed(indices_by_name('accessors')),
    indices: index('accessors'),
    material: index('materials'),
    mode: integer(0, 6),
    targets: list(indices_by_name('accessors'))
  },
  node: {
    camera: index('cameras'),
    children: set(index('nodes')),
    skin: index('skins'),
    matrix: list(number(), 16, 16),
    mesh: index('meshes'),
    rotation: list(number(-1, 1), 4, 4),
    scale: list(number(), 3, 3),
    translation: list(number(), 3, 3),
    weights: list(number())
  },
  sampler: {
    magFilter: better_one_of(integer(), 9728, 9729),
    minFilter: better_one_of(integer(), 9728, 9729, 9984, 9985, 9986, 9987),
    wrapS: better_one_of(integer(), ...WRAPS),
    wrapT: better_one_of(integer(), ...WRAPS)
  },
  scene: {nodes: set(index('nodes'))},
  skin:
    {inverseBindMatrices: index('accessors'), skeleton: index('nodes'), joints: needed(set(index('nodes')))},
  texture: {sampler: index('samplers'), source: index('images')},
  transform:
    {offset: list(number(), 2, 2), rotation: number(), scale: list(number(), 2, 2), texCoord: integer()},
};

/** Members that mean nothing without another one: table, member, the other. */
const NEEDS = [
  ['accessor', 'byteOffset', 'bufferView'], ['image', 'bufferView', 'mimeType'],
  ['root', 'extensionsRequired', 'extensionsUsed']
];

/** Whether the members of the root and of all below it are of their types; reports what is not. */
export function check_schema(gltf, report) {
  const wrong = (place, message) => report('GLTF_MALFORMED', place, message);
  const check_index = (value, array, place) => {
    if (!Number.isInteger(value) || value < 0)
      wrong(place, 'is no index');
    else if (!(value < gltf[array]?.length))
      report('GLTF_ACCESSOR', place, `there is no /${array}/${value}`);
  };
  const check_value = (value, member, place) => {
    if (!member.is(value)) return wrong(place, `is not ${member.what}`);
    if (member.array) check_index(value, member.array, place);
    if (member.map)
      Object.entries(value).forEach(([name, x]) => check_index(x, member.map, `${place}/${name}`));
    if (member.choices && !member.choices.includes(value))
      report(member.advice ? 'GLTF_ADVICE' : 'GLTF_MALFORMED', place, 'is not one of the known values');
    if (member.table) check_object(value, member.table, place);
  };
  const check_object = (value, table, place) => {
    for (const [name, member] of Object.entries(TABLES[table])) {
      const here = value[name], at = `${place}/${name}`;
      if (here === undefined) {
        if (member.needed) wrong(at, 'is missing');
      } else if (!member.list) {
        check_value(here, member, at);
      } else if (!Array.isArray(here)) {
        wrong(at, 'is not an array');
      } else {
        if (here.length < member.list[0] || here.length > member.list[1])
          wrong(at, `has ${here.length} items`);
        if (member.unique && new Set(here).size < here.length) wrong(at, 'has an item twice');
        here.forEach((item, i) => check_value(item, member, `${at}/${i}`));
      }
    }
    if (value.name !== undefined && typeof value.name !== 'string') wrong(`${place}/name`, 'is not a string');
    for (const [of, name, other] of NEEDS) {
      if (of === table && value[name] !== undefined && value[other] === undefined)
        wrong(`${place}/${name}`, `stands without ${other}`);
    }
  };
  const check_extensions = (value, place) => {
    for (const [name, member] of Object.entries(value)) {
      if (typeof member !== 'object' || member === null || name === 'extras') continue;
      const at = `${place}/${name}`;
      if (name === 'KHR_texture_transform') check_object(member, 'transform', at);
      if (name === 'extensions' && !Array.isArray(member)) {
        for (const [extension, x] of Object.entries(member))
          if (!is_object(x)) wrong(`${at}/${extension}`, 'is not an object');
      }
      check_extensions(member, at);
    }
  };
  check_object(gltf, 'root', '');
  check_extensions(gltf, '');
}

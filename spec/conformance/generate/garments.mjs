// glTF files that use the extension against its rules, or unwisely: one triangle each.
import {read_headers} from '../reference/exr.mjs';
import {file_of} from './make.mjs';
import {deflate} from './deflate.mjs';

const NAME = 'SELVEDGE_materials_fabric';
const sound = {
  name: 'cloth',
  texels: [1, 1],
  layers: ['lobes'],
  K: 0,
  value: {lobes: () => 0.125}
};
const FABRIC = file_of(sound);
const HOLED = file_of({
  ...sound,
  name: 'holed cloth',
  layers: ['lobes', 'opacity'],
  grid: [1, 1],
  value: {...sound.value, opacity: () => 0.25}
});
const BROKEN = file_of({...sound, name: 'broken cloth', value: {lobes: () => -1}});
const data_uri = (type, bytes) => `data:${type};base64,${bytes.toString('base64')}`;

function crc(bytes) {
  let sum = 0xFFFFFFFF;
  for (const byte of bytes) {
    sum ^= byte;
    for (let i = 0; i < 8; ++i) sum = sum >>> 1 ^ (sum & 1 ? 0xEDB88320 : 0);
  }
  return (sum ^ 0xFFFFFFFF) >>> 0;
}

/** The fallback's picture, 1 x 1 pixel: the albedo pi rho = 0.39, sRGB-encoded. */
function png() {
  const chunk = (type, data) => {
    const body = Buffer.concat([Buffer.from(type), data]);
    const ends = Buffer.alloc(8);
    ends.writeUInt32BE(data.length, 0);
    ends.writeUInt32BE(crc(body), 4);
    return Buffer.concat([ends.subarray(0, 4), body, ends.subarray(4)]);
  };
  const head = Buffer.from([0, 0, 0, 1, 0, 0, 0, 1, 8, 2, 0, 0, 0]);
  return Buffer.concat([
    Buffer.from([0x89, 0x50, 0x4E, 0x47, 0x0D, 0x0A, 0x1A, 0x0A]), chunk('IHDR', head),
    chunk('IDAT', deflate(Buffer.from([0, 168, 168, 168]))), chunk('IEND', Buffer.alloc(0))
  ]);
}

/** A sound garment: a triangle whose material has the fabric, with fallback and mirror. */
function garment() {
  const transform = () => ({KHR_texture_transform: {scale: [4, 4]}});
  // Four repeats of 2.5 x 1.25 mm along each side: positions, normals, texture coordinates.
  const vertices =
    Buffer.from(new Float32Array([
                  0, 0, 0, 0.01, 0, 0, 0, 0.005, 0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 1, 1, 0, 0,
                ]).buffer);
  return {
    asset: {version: '2.0'},
    extensionsUsed: [NAME, 'KHR_texture_transform'],
    extensions: {[NAME]: {fabrics: [{name: 'cloth', mimeType: 'image/x-exr', uri: 'cloth.fabric.exr'}]}},
    scene: 0,
    scenes: [{nodes: [0]}],
    nodes: [{mesh: 0}],
    meshes: [{primitives: [{attributes: {POSITION: 0, NORMAL: 1, TEXCOORD_0: 2}, material: 0}]}],
    materials: [{
      pbrMetallicRoughness: {baseColorTexture: {index: 0, extensions: transform()}, metallicFactor: 0},
      extensions: {[NAME]: {fabric: {index: 0, texCoord: 0, extensions: transform()}}},
      extras: {[NAME]: {index: 0, extensions: transform(), name: 'cloth', uri: 'cloth.fabric.exr'}},
    }],
    textures: [{source: 0}],
    images: [{uri: data_uri('image/png', png())}],
    accessors: [
      {
        bufferView: 0,
        componentType: 5126,
        count: 3,
        type: 'VEC3',
        min: [0, 0, 0],
        max: [0.01, 0.005, 0].map(Math.fround)
      },
      {bufferView: 1, componentType: 5126, count: 3, type: 'VEC3'},
      {bufferView: 2, componentType: 5126, count: 3, type: 'VEC2'},
    ],
    bufferViews: [[0, 36], [36, 36], [72, 24]].map(
      ([byteOffset, byteLength]) => ({buffer: 0, byteOffset, byteLength, target: 34962})),
    buffers: [{byteLength: 96, uri: data_uri('application/octet-stream', vertices)}],
  };
}

/** The fabric in a buffer view of the garment instead of a file beside it. */
function embed(gltf, bytes) {
  gltf.buffers.push({byteLength: bytes.length, uri: data_uri('application/octet-stream', bytes)});
  gltf.bufferViews.push({buffer: 1, byteLength: bytes.length});
  const [item] = gltf.extensions[NAME].fabrics;
  delete item.uri;
  item.bufferView = 3;
  delete gltf.materials[0].extras[NAME].uri;
  return item;
}

const root = `/extensions/${NAME}/fabrics`;
const material = `/materials/0/extensions/${NAME}`;
const item_of = (gltf) => gltf.extensions[NAME].fabrics[0];
const reference_of = (gltf) => gltf.materials[0].extensions[NAME].fabric;

/** The header digest that a fabric file says it has. */
const open_digest = (bytes) =>
  read_headers(bytes).parts[0].attributes.get('selvedge.digest').value.toString();

/** A fixture: { name, about, issues, others, files }. */
function fixture(code, what, about, place, change, {fabric = FABRIC, others = 'none'} = {}) {
  const gltf = garment();
  const mirror = gltf.materials[0].extras[NAME];
  mirror.digest = open_digest(fabric);
  const beside = change(gltf) ?? {'cloth.fabric.exr': fabric};
  return {
    name: `${[code].flat()[0]}-${what}`,
    about,
    issues: code ? [{code, place}] : [],
    others,
    files: {'garment.gltf': Buffer.from(JSON.stringify(gltf, null, 1) + '\n'), ...beside},
  };
}
const nothing = {};  // no file beside the garment
const extension = (what, about, place, change, more) =>
  fixture('GLTF_EXTENSION', what, about, place, change, more);
const allowed = {
  others: 'allowed'
};

export const invalid = [
  extension(
    'required', 'the extension is listed in extensionsRequired', '/extensionsRequired',
    (g) => {
      g.extensionsRequired = [NAME];
    }),
  fixture(
    ['GLTF_EXTENSION', 'GLTF_MALFORMED'], 'not-listed-as-used', 'the extension is not in extensionsUsed', '',
    (g) => {
      g.extensionsUsed.shift();
    }),
  extension(
    'no-root', 'a material uses the extension, the root has none', '',
    (g) => {
      delete g.extensions;
    },
    allowed),
  extension(
    'fabrics-missing', 'the root object has no fabrics', root,
    (g) => {
      delete g.extensions[NAME].fabrics;
    },
    allowed),
  extension(
    'fabrics-empty', 'fabrics is empty', root,
    (g) => {
      g.extensions[NAME].fabrics = [];
    },
    allowed),
  extension(
    'fabrics-object', 'fabrics is an object', root,
    (g) => {
      g.extensions[NAME].fabrics = {0: item_of(g)};
    },
    allowed),
  extension(
    'item-not-an-object', 'an item of fabrics is a string', `${root}/0`,
    (g) => {
      g.extensions[NAME].fabrics = ['cloth.fabric.exr'];
    },
    allowed),
  extension(
    'mime-type-missing', 'an item without mimeType', `${root}/0`,
    (g) => {
      delete item_of(g).mimeType;
    }),
  extension(
    'mime-type-other', 'an item with the mimeType of a PNG', `${root}/0/mimeType`,
    (g) => {
      item_of(g).mimeType = 'image/png';
    }),
  extension(
    'uri-and-buffer-view', 'an item with uri and bufferView', `${root}/0`,
    (g) => {
      item_of(embed(g, FABRIC) && g).uri = 'cloth.fabric.exr';
    },
    allowed),
  extension(
    'neither-uri-nor-buffer-view', 'an item with neither uri nor bufferView', `${root}/0`,
    (g) => {
      delete item_of(g).uri;
      return nothing;
    },
    allowed),
  extension(
    'uri-number', 'a uri that is a number', `${root}/0/uri`,
    (g) => {
      item_of(g).uri = 7;
      return nothing;
    },
    allowed),
  extension(
    'name-number', 'a name that is a number', `${root}/0/name`,
    (g) => {
      item_of(g).name = 7;
    },
    allowed),
  fixture(
    ['GLTF_EXTENSION', 'GLTF_ACCESSOR'], 'buffer-view-not-there', 'a buffer view that does not exist',
    `${root}/0/bufferView`,
    (g) => {
      embed(g, FABRIC).bufferView = 9;
      return nothing;
    },
    allowed),
  extension(
    'buffer-view-with-stride', 'a buffer view with byteStride', '',
    (g) => {
      embed(g, FABRIC);
      g.bufferViews[3].byteStride = 4;
      return nothing;
    },
    allowed),
  extension(
    'buffer-view-with-target', 'a buffer view with a target', '',
    (g) => {
      embed(g, FABRIC);
      g.bufferViews[3].target = 34962;
      return nothing;
    },
    allowed),
  extension(
    'material-not-an-object', 'the extension of a material is true', material,
    (g) => {
      g.materials[0].extensions[NAME] = true;
    },
    allowed),
  extension(
    'fabric-missing', 'a material without fabric', material,
    (g) => {
      delete g.materials[0].extensions[NAME].fabric;
    }),
  extension(
    'index-missing', 'a reference without index', `${material}/fabric`,
    (g) => {
      delete reference_of(g).index;
    }),
  fixture(
    ['GLTF_EXTENSION', 'GLTF_REFERENCE'], 'index-beyond', 'an index beyond fabrics',
    `${material}/fabric/index`,
    (g) => {
      reference_of(g).index = 1;
    }),
  fixture(
    ['GLTF_EXTENSION', 'GLTF_REFERENCE'], 'index-negative', 'a negative index', `${material}/fabric/index`,
    (g) => {
      reference_of(g).index = -1;
    }),
  extension(
    'index-text', 'an index that is a text', `${material}/fabric/index`,
    (g) => {
      reference_of(g).index = '0';
    }),
  extension(
    'tex-coord-negative', 'a negative texCoord', `${material}/fabric/texCoord`,
    (g) => {
      reference_of(g).texCoord = -1;
    }),
  fixture(
    ['GARMENT_NO_UVS', 'GLTF_EXTENSION'], 'uv-set-not-there', 'a UV set that the triangle lacks', '',
    (g) => {
      reference_of(g).texCoord = 1;
      g.materials[0].pbrMetallicRoughness.baseColorTexture.texCoord = 1;
    },
    allowed),
  fixture('GLTF_REFERENCE', 'file-not-there', 'a fabric file that is not there', `${root}/0`, () => nothing),
  fixture(
    ['GLTF_REFERENCE', 'GLTF_MALFORMED'], 'data-uri', 'a data URI that is not base64', `${root}/0`,
    (g) => {
      item_of(g).uri = 'data:image/x-exr;base64,@@@@';
      return nothing;
    },
    allowed),
  fixture(
    'GLTF_ACCESSOR', 'buffer-view-beyond-its-buffer',
    'the buffer view of the fabric is longer than its buffer', '/bufferViews/3',
    (g) => {
      embed(g, FABRIC);
      ++g.bufferViews[3].byteLength;
      return nothing;
    },
    allowed),
  fixture(
    'FABRIC_NOT_FINITE', 'in-a-fabric-beside', 'the fabric file beside the garment is broken', '', () => {},
    {fabric: BROKEN}),
  fixture(
    'FABRIC_NOT_FINITE', 'in-an-embedded-fabric', 'the embedded fabric file is broken', '',
    (g) => {
      embed(g, BROKEN);
      return nothing;
    }),
  fixture(
    'EXR_MALFORMED', 'in-a-garment', 'the fabric of a garment is a PNG', '',
    (g) => {
      item_of(g).uri = data_uri('image/x-exr', png());
      g.materials[0].extras[NAME].uri = item_of(g).uri;
      return nothing;
    }),
  {
    name: 'GLTF_MALFORMED-not-json',
    about: 'a garment that is not JSON',
    issues: [{code: ['GLTF_MALFORMED', 'JSON_MALFORMED'], place: ''}],
    others: 'none',
    files: {'garment.gltf': Buffer.from('{"asset": {"version": "2.0"}\n')}
  },
];

export const warnings = [
  fixture(
    'GLTF_FALLBACK', 'no-texture', 'a material with no baseColorTexture', '/materials/0',
    (g) => {
      delete g.materials[0].pbrMetallicRoughness.baseColorTexture;
      g.materials[0].extras[NAME].baseColorTexture = null;
    }),
  fixture(
    'GLTF_ALPHA', 'opaque-with-holes', 'alphaMode OPAQUE over a fabric with holes', '/materials/0', () => {},
    {fabric: HOLED}),
  fixture(
    'GLTF_ALPHA', 'blend-without-holes', 'alphaMode BLEND over a fabric without holes', '/materials/0',
    (g) => {
      g.materials[0].alphaMode = 'BLEND';
    }),
  fixture(
    'GLTF_TRANSFORM', 'scale', 'fallback and fabric repeat at different rates', '/materials/0',
    (g) => {
      const {baseColorTexture} = g.materials[0].pbrMetallicRoughness;
      baseColorTexture.extensions.KHR_texture_transform.scale = [5, 5];
      g.materials[0].extras[NAME].baseColorTexture = {extensions: baseColorTexture.extensions};
    }),
  fixture(
    'GLTF_TRANSFORM', 'none-on-the-fallback', 'the fallback has no transform', '/materials/0',
    (g) => {
      delete g.materials[0].pbrMetallicRoughness.baseColorTexture.extensions;
      g.materials[0].extras[NAME].baseColorTexture = {};
    }),
  fixture(
    'GLTF_MIRROR', 'missing', 'no mirror in extras', '/materials/0',
    (g) => {
      delete g.materials[0].extras;
    }),
  fixture(
    'GLTF_MIRROR', 'differs', 'the mirror names another file', '/materials/0',
    (g) => {
      g.materials[0].extras[NAME].uri = 'other.exr';
    }),
  fixture(
    'GLTF_MIRROR', 'digest', 'the mirror has the digest of another file', '/materials/0',
    (g) => {
      g.materials[0].extras[NAME].digest = open_digest(HOLED);
    }),
  fixture(
    'GLTF_MIRROR', 'transform', 'the mirror has another transform than the reference', '/materials/0',
    (g) => {
      g.materials[0].extras[NAME].extensions.KHR_texture_transform.scale = [2, 2];
    }),
];

/** Garments without any issue. */
export const valid = [
  fixture('', 'beside', 'a sound garment, its fabric in a file beside it', '', () => {}),
  fixture(
    '', 'embedded', 'a sound garment, its fabric in a buffer view', '',
    (g) => {
      embed(g, FABRIC);
      return nothing;
    }),
  fixture(
    '', 'holes', 'a sound garment with holes, alphaMode MASK', '',
    (g) => {
      g.materials[0].alphaMode = 'MASK';
    },
    {fabric: HOLED}),
].map((garment_fixture) => ({...garment_fixture, name: `garment${garment_fixture.name}`}));

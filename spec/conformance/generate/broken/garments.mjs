// Garments that use the extension against its rules, or unwisely.
import {broken_parts, unwise_parts} from './garment_parts.mjs';
import {
  BROKEN,
  FABRIC,
  HOLED,
  NAME,
  SHEER,
  add_tangents,
  allowed,
  data_uri,
  embed,
  extension,
  fixture,
  item_of,
  material,
  nothing,
  open_digest,
  png,
  reference_of,
  root
} from '../garment.mjs';

const UV = 'KHR_texture_transform', BASE_COLOUR = 'pbrMetallicRoughness/baseColorTexture';
/** The same change to the transforms of fabric, fallback and mirror. */
const transform_all = (g, change) => {
  const {pbrMetallicRoughness, extras} = g.materials[0];
  for (const info of [reference_of(g), pbrMetallicRoughness.baseColorTexture, extras[NAME]])
    Object.assign(info.extensions[UV], change);
};

export const broken_garments = [
  ...broken_parts,
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
    'scale-zero', 'a scale of 0: the fabric lies in no direction', `${material}/fabric/extensions/${UV}/scale`,
    (g) => transform_all(g, {scale: [0, 4]})),
  extension(
    'offset-beyond-floats', 'an offset beyond 32-bit floats', `${material}/fabric/extensions/${UV}/offset`,
    (g) => transform_all(g, {offset: [1e39, 0]})),
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
  extension(
    'uri-empty', 'a uri of no characters', `${root}/0/uri`,
    (g) => {
      item_of(g).uri = '';
      return nothing;
    },
    allowed),
  ...['KHR_materials_unlit', 'KHR_materials_pbrSpecularGlossiness'].map(
    (name) => extension(
      `beside-${name}`, `a fabric beside ${name}`, `/materials/0/extensions/${name}`,
      (g) => {
        g.extensionsUsed.push(name);
        g.materials[0].extensions[name] = {};
      })),
  fixture(
    'GARMENT_NO_UVS', 'uv-set-of-a-variant-not-there',
    'a variant whose fabric takes a UV set that the triangle lacks', '',
    (g) => {
      const variant = structuredClone(g.materials[0]);
      variant.extensions[NAME].fabric.texCoord = variant.extras[NAME].texCoord = 1;
      variant.pbrMetallicRoughness.baseColorTexture.texCoord = 1;
      g.materials.push(variant);
      g.extensionsUsed.push('KHR_materials_variants');
      g.extensions.KHR_materials_variants = {variants: [{name: 'other'}]};
      g.meshes[0].primitives[0].extensions = {
        KHR_materials_variants: {mappings: [{material: 1, variants: [0]}]}
      };
    },
    allowed),
];

export const unwise_garments = [
  ...unwise_parts,
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
    'GLTF_ALPHA', 'opaque-and-sheer', 'alphaMode OPAQUE over a fabric that is open everywhere by a sixteenth',
    '/materials/0', () => {}, {fabric: SHEER}),
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
  ...['index', 'name', 'tex-coord'].map(
    (what) => fixture(
      'GLTF_MIRROR', what, `the mirror has another ${what} than what it mirrors`, '/materials/0/extras',
      (g) => {
        Object.assign(
          g.materials[0].extras[NAME],
          {index: {index: 1}, name: {name: 'wool'}, 'tex-coord': {texCoord: 1}}[what]);
      })),
  fixture(
    'GLTF_FALLBACK', 'clamped', 'a fallback that does not repeat', `/materials/0/${BASE_COLOUR}`,
    (g) => {
      g.samplers = [{wrapS: 33071}];
      g.textures[0].sampler = 0;
    }),
  fixture(
    'GLTF_ADVICE', 'single-sided', 'cloth that is not drawn from behind', '/materials/0/doubleSided',
    (g) => {
      g.materials[0].doubleSided = false;
    }),
  fixture(
    'GLTF_FALLBACK', 'metal', 'a fallback without metallicFactor: it is metal', '/materials/0',
    (g) => {
      delete g.materials[0].pbrMetallicRoughness.metallicFactor;
    }),
  fixture(
    'GLTF_FALLBACK', 'cutoff', 'a fallback whose holes are cut at 0.25', '/materials/0',
    (g) => {
      Object.assign(g.materials[0], {alphaMode: 'MASK', alphaCutoff: 0.25});
    },
    {fabric: HOLED}),
  fixture(
    'GLTF_FALLBACK', 'blend-with-holes', 'alphaMode BLEND over a fabric with holes', '/materials/0',
    (g) => {
      g.materials[0].alphaMode = 'BLEND';
    },
    {fabric: HOLED}),
  fixture(
    'GLTF_TRANSFORM', 'uv-set', 'the fallback is on another UV set', '/materials/0',
    (g) => {
      g.meshes[0].primitives[0].attributes.TEXCOORD_1 = 2;
      g.materials[0].pbrMetallicRoughness.baseColorTexture.texCoord = 1;
      g.materials[0].extras[NAME].baseColorTexture = {
        ...g.materials[0].pbrMetallicRoughness.baseColorTexture};
    }),
  fixture(
    'GLTF_TRANSFORM', 'normal-texture', 'the normal texture repeats at another rate', '/materials/0',
    (g) => {
      g.materials[0].normalTexture = {index: 0, extensions: {KHR_texture_transform: {scale: [5, 5]}}};
      g.meshes[0].primitives[0].attributes.TANGENT = add_tangents(g);
    }),
  fixture(
    'GLTF_ADVICE', 'no-normals', 'a triangle without normals', '/meshes/0/primitives/0',
    (g) => {
      delete g.meshes[0].primitives[0].attributes.NORMAL;
    }),
  fixture(
    'GLTF_ADVICE', 'no-tangents', 'a normal texture without tangents', '/meshes/0/primitives/0',
    (g) => {
      g.materials[0].normalTexture = structuredClone(g.materials[0].pbrMetallicRoughness.baseColorTexture);
    }),
  fixture(
    'GLTF_ADVICE', 'material-on-nothing', 'a material that is on no triangle', '/materials/0',
    (g) => {
      delete g.meshes[0].primitives[0].material;
    }),
];

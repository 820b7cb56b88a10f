// Garments that use the extension against its rules, or unwisely. Rows: [code, what, about, place, change, more], as
// fixture() of garment.mjs takes them.
import {
  BROKEN, FABRIC, HOLED, NAME, SHEER, data_uri, embed, fixture, item_of, material, nothing, png,
  reference_of, root
} from '../garment.mjs';
import {with_parts} from '../garments.mjs';
import {set} from './common.mjs';

const UV = 'KHR_texture_transform', EXTENSION = 'GLTF_EXTENSION';
const others = {others: 'allowed'};
/** Several changes; the last gives the files beside the garment. */
const all = (...changes) => (g) => changes.map((change) => change(g)).at(-1);
/** Changes of a fabric's item, of the reference, of material 0. */
const of_item = (change) => (g) => Object.assign(item_of(g), change);
const of_reference = (change) => (g) => Object.assign(reference_of(g), change);
const of_material = (change) => (g) => Object.assign(g.materials[0], change);
const of_extension = (change) => (g) => Object.assign(g.materials[0].extensions[NAME], change);
const no_file = () => nothing;
/** Runs a change that returns nothing, for the file beside the garment. */
const quiet = (change) => (g) => {
  change(g);
};
/** The same change to the transforms of fabric and fallback. */
const transform_all = (change) => quiet((g) => {
  for (const info of [reference_of(g), g.materials[0].pbrMetallicRoughness.baseColorTexture]) Object.assign(info.extensions[UV], change);
});
const embedded = (change) => (g) => {
  embed(g, FABRIC);
  change(g);
  return nothing;
};
/** A second material, a variant whose fabric takes UV set 1, which the triangle lacks. */
function add_variant(g) {
  const variant = structuredClone(g.materials[0]);
  variant.extensions[NAME].fabric.texCoord = 1;
  variant.pbrMetallicRoughness.baseColorTexture.texCoord = 1;
  g.materials.push(variant);
  g.extensionsUsed.push('KHR_materials_variants');
  g.extensions.KHR_materials_variants = {variants: [{name: 'other'}]};
  g.meshes[0].primitives[0].extensions = {KHR_materials_variants: {mappings: [{material: 1, variants: [0]}]}};
}
const remove = (pointer) => quiet(set(pointer, undefined));
const fabrics = (value) => quiet(set(root, value));

const faults = [
  [
    EXTENSION, 'required', 'the extension is listed in extensionsRequired', '/extensionsRequired',
    quiet(set('/extensionsRequired', [NAME]))
  ],
  [
    [EXTENSION, 'GLTF_MALFORMED'], 'not-listed-as-used', 'the extension is not in extensionsUsed', '',
    quiet((g) => g.extensionsUsed.shift())
  ],
  [EXTENSION, 'no-root', 'a material uses the extension, the root has none', '', remove('/extensions'), others],
  [EXTENSION, 'fabrics-missing', 'the root object has no fabrics', root, fabrics(undefined), others],
  [EXTENSION, 'fabrics-empty', 'fabrics is empty', root, fabrics([]), others],
  [EXTENSION, 'fabrics-object', 'fabrics is an object', root, fabrics({}), others],
  [
    EXTENSION, 'item-not-an-object', 'an item of fabrics is a string', `${root}/0`, fabrics(['cloth.fabric.exr']),
    others
  ],
  [EXTENSION, 'mime-type-missing', 'an item without mimeType', `${root}/0`, remove(`${root}/0/mimeType`)],
  [
    EXTENSION, 'mime-type-other', 'an item with the mimeType of a PNG', `${root}/0/mimeType`,
    quiet(of_item({mimeType: 'image/png'}))
  ],
  [
    EXTENSION, 'uri-and-buffer-view', 'an item with uri and bufferView', `${root}/0`,
    quiet((g) => Object.assign(embed(g, FABRIC), {uri: 'cloth.fabric.exr'})), others
  ],
  [
    EXTENSION, 'neither-uri-nor-buffer-view', 'an item with neither uri nor bufferView', `${root}/0`,
    all(remove(`${root}/0/uri`), no_file), others
  ],
  [EXTENSION, 'uri-number', 'a uri that is a number', `${root}/0/uri`, all(of_item({uri: 7}), no_file), others],
  [EXTENSION, 'uri-empty', 'a uri of no characters', `${root}/0/uri`, all(of_item({uri: ''}), no_file), others],
  [EXTENSION, 'name-number', 'a name that is a number', `${root}/0/name`, quiet(of_item({name: 7})), others],
  [
    [EXTENSION, 'GLTF_ACCESSOR'], 'buffer-view-not-there', 'a buffer view that does not exist', `${root}/0/bufferView`,
    embedded(of_item({bufferView: 9})), others
  ],
  [
    EXTENSION, 'buffer-view-with-stride', 'a buffer view with byteStride', '',
    embedded(set('/bufferViews/3/byteStride', 4)), others
  ],
  [
    EXTENSION, 'buffer-view-with-target', 'a buffer view with a target', '',
    embedded(set('/bufferViews/3/target', 34962)), others
  ],
  [
    EXTENSION, 'material-not-an-object', 'the extension of a material is true', material, quiet(set(material, true)),
    others
  ],
  [EXTENSION, 'fabric-missing', 'a material without fabric', material, remove(`${material}/fabric`)],
  [EXTENSION, 'index-missing', 'a reference without index', `${material}/fabric`, remove(`${material}/fabric/index`)],
  [
    [EXTENSION, 'GLTF_REFERENCE'], 'index-beyond', 'an index beyond fabrics', `${material}/fabric/index`,
    quiet(of_reference({index: 1}))
  ],
  [
    [EXTENSION, 'GLTF_REFERENCE'], 'index-negative', 'a negative index', `${material}/fabric/index`,
    quiet(of_reference({index: -1}))
  ],
  [EXTENSION, 'index-text', 'an index that is a text', `${material}/fabric/index`, quiet(of_reference({index: '0'}))],
  [
    EXTENSION, 'scale-zero', 'a scale of 0: the fabric lies in no direction',
    `${material}/fabric/extensions/${UV}/scale`, transform_all({scale: [0, 4]})
  ],
  [
    EXTENSION, 'offset-beyond-floats', 'an offset beyond 32-bit floats', `${material}/fabric/extensions/${UV}/offset`,
    transform_all({offset: [1e39, 0]})
  ],
  [
    EXTENSION, 'tex-coord-negative', 'a negative texCoord', `${material}/fabric/texCoord`,
    quiet(of_reference({texCoord: -1}))
  ],
  [['GARMENT_NO_UVS', EXTENSION], 'uv-set-not-there', 'a UV set that the triangle lacks', '', quiet((g) => {
    reference_of(g).texCoord = g.materials[0].pbrMetallicRoughness.baseColorTexture.texCoord = 1;
  }), others],
  [
    'GARMENT_NO_UVS', 'uv-set-of-a-variant-not-there', 'a variant whose fabric takes a UV set that the triangle lacks',
    '', quiet(add_variant), others
  ],
  ['GLTF_REFERENCE', 'file-not-there', 'a fabric file that is not there', `${root}/0`, no_file],
  [
    ['GLTF_REFERENCE', 'GLTF_MALFORMED'], 'data-uri', 'a data URI that is not base64', `${root}/0`,
    all(of_item({uri: 'data:image/x-exr;base64,@@@@'}), no_file), others
  ],
  [
    'GLTF_ACCESSOR', 'buffer-view-beyond-its-buffer', 'the buffer view of the fabric is longer than its buffer',
    '/bufferViews/3', embedded((g) => ++g.bufferViews[3].byteLength), others
  ],
  [
    'FABRIC_NOT_FINITE', 'in-a-fabric-beside', 'the fabric file beside the garment is broken', '', () => {},
    {fabric: BROKEN}
  ],
  [
    'FABRIC_NOT_FINITE', 'in-an-embedded-fabric', 'the embedded fabric file is broken', '',
    all((g) => embed(g, BROKEN), no_file)
  ],
  ['EXR_MALFORMED', 'in-a-garment', 'the fabric of a garment is a PNG', '', all(
    of_item({uri: data_uri('image/x-exr', png())}), no_file)],
  ...['KHR_materials_unlit', 'KHR_materials_pbrSpecularGlossiness'].map((name) => [
    EXTENSION, `beside-${name}`, `a fabric beside ${name}`, `/materials/0/extensions/${name}`, quiet((g) => {
      g.extensionsUsed.push(name);
      g.materials[0].extensions[name] = {};
    })
  ]),
];

// Mask, normals and tint of the garment.
const part_faults = [
  ...['maskTexture', 'normalTexture', 'tintTexture'].map((part) => [
    [EXTENSION, 'GLTF_ACCESSOR'], `${part.toLowerCase().replace('texture', '-texture')}-not-there`,
    `a ${part} that is not in the file`, `${material}/${part}`, set(`${material}/${part}/index`, 7)
  ]),
  [
    EXTENSION, 'mask-cutoff-negative', 'a negative maskCutoff', `${material}/maskCutoff`, of_extension({maskCutoff: -1})
  ],
  ...[['negative', [1, -1, 1]], ['of-two', [1, 1]], ['beyond', [17, 1, 1]]].map(([what, tintFactor]) => [
    EXTENSION, `tint-factor-${what}`, `a tintFactor of ${tintFactor}`, `${material}/tintFactor`, of_extension({tintFactor})
  ]),
  [
    'GARMENT_NO_UVS', 'uv-set-of-the-mask', 'a mask on a UV set that the triangle lacks', '',
    set('/meshes/0/primitives/0/attributes/TEXCOORD_1', undefined)
  ],
].map(([code, what, about, place, change]) => [code, what, about, place, quiet(all(with_parts, change)), others]);

export const broken_garments = [...faults, ...part_faults].map((row) => fixture(...row));

const [FALLBACK, ALPHA, TRANSFORM, ADVICE] = ['FALLBACK', 'ALPHA', 'TRANSFORM', 'ADVICE'].map((name) => `GLTF_${name}`);
const MATERIAL = '/materials/0', PBR = `${MATERIAL}/pbrMetallicRoughness`;
const holed = {fabric: HOLED};
export const unwise_garments = [
  [
    FALLBACK, 'no-texture', 'a material with no baseColorTexture', MATERIAL,
    remove(`${PBR}/baseColorTexture`)
  ],
  [
    FALLBACK, 'clamped', 'a fallback that does not repeat', `${PBR}/baseColorTexture`,
    quiet(all(set('/samplers', [{wrapS: 33071}]), set('/textures/0/sampler', 0)))
  ],
  [FALLBACK, 'metal', 'a fallback without metallicFactor: it is metal', MATERIAL, remove(`${PBR}/metallicFactor`)],
  [
    FALLBACK, 'cutoff', 'a fallback whose holes are cut at 0.25', MATERIAL,
    quiet(of_material({alphaMode: 'MASK', alphaCutoff: 0.25})), holed
  ],
  [
    FALLBACK, 'blend-with-holes', 'alphaMode BLEND over a fabric with holes', MATERIAL,
    quiet(of_material({alphaMode: 'BLEND'})), holed
  ],
  [
    FALLBACK, 'without-the-mask', 'a mask beside a fallback that is OPAQUE', '',
    quiet(all(with_parts, remove(`${MATERIAL}/alphaMode`)))
  ],
  [
    FALLBACK, 'of-another-picture', 'a tint texture beside a fallback of another picture', '',
    quiet(all(with_parts, set(`${PBR}/baseColorTexture/index`, 0)))
  ],
  [ALPHA, 'opaque-with-holes', 'alphaMode OPAQUE over a fabric with holes', MATERIAL, () => {}, holed],
  [
    ALPHA, 'opaque-and-sheer', 'alphaMode OPAQUE over a fabric that is open everywhere by a sixteenth', MATERIAL,
    () => {}, {fabric: SHEER}
  ],
  [
    ALPHA, 'blend-without-holes', 'alphaMode BLEND over a fabric without holes', MATERIAL,
    quiet(of_material({alphaMode: 'BLEND'}))
  ],
  [
    TRANSFORM, 'scale', 'fallback and fabric repeat at different rates', MATERIAL,
    quiet(set(`${PBR}/baseColorTexture/extensions/${UV}/scale`, [5, 5]))
  ],
  [
    TRANSFORM, 'none-on-the-fallback', 'the fallback has no transform', MATERIAL,
    remove(`${PBR}/baseColorTexture/extensions`)
  ],
  [
    TRANSFORM, 'uv-set', 'the fallback is on another UV set', MATERIAL,
    quiet(all(set('/meshes/0/primitives/0/attributes/TEXCOORD_1', 2), set(`${PBR}/baseColorTexture/texCoord`, 1)))
  ],
  [TRANSFORM, 'normal-texture', 'the normal texture repeats at another rate', MATERIAL, quiet((g) => {
    g.materials[0].normalTexture = {index: 0, extensions: {[UV]: {scale: [5, 5]}}};
  })],
  [
    ADVICE, 'single-sided', 'cloth that is not drawn from behind', `${MATERIAL}/doubleSided`,
    quiet(of_material({doubleSided: false}))
  ],
  [
    ADVICE, 'no-normals', 'a triangle without normals', '/meshes/0/primitives/0',
    remove('/meshes/0/primitives/0/attributes/NORMAL')
  ],
  [ADVICE, 'material-on-nothing', 'a material on no triangle', MATERIAL, remove('/meshes/0/primitives/0/material')],
].map((row) => fixture(...row));

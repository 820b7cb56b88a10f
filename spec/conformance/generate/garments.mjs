// The valid garments: { name, files }.
import {ALMOST_CLOSED, FABRIC, HOLED, NAME, data_uri, embed, fixture, material, nothing, png} from './garment.mjs';
import {glb_of, padded} from './square.mjs';

/** The garment as a GLB: fabric and picture in views of its only buffer. */
function as_glb(gltf) {
  const picture = png();
  gltf.buffers.push({byteLength: picture.length, uri: gltf.images[0].uri});
  gltf.bufferViews.push({buffer: gltf.buffers.length - 1, byteLength: picture.length});
  gltf.images = [{bufferView: gltf.bufferViews.length - 1, mimeType: 'image/png'}];
  const sizes = gltf.buffers.map(({byteLength}) => byteLength);
  const bytes = gltf.buffers.map(({uri}) => Buffer.from(uri.slice(uri.indexOf(',') + 1), 'base64'));
  for (const view of gltf.bufferViews) {
    view.byteOffset = (view.byteOffset ?? 0) + sizes.slice(0, view.buffer).reduce((sum, n) => sum + n, 0);
    view.buffer = 0;
  }
  const all = Buffer.concat(bytes);
  gltf.buffers = [{byteLength: all.length}];
  return glb_of([['JSON', padded(Buffer.from(JSON.stringify(gltf)), ' ')], ['BIN\0', padded(all, 0)]]);
}

/** The fabric on UV set 1, which only the fabric and its fallback take. */
function on_set_1(g) {
  g.meshes[0].primitives[0].attributes.TEXCOORD_1 = 2;
  const [{extensions, pbrMetallicRoughness}] = g.materials;
  for (const info of [extensions[NAME].fabric, pbrMetallicRoughness.baseColorTexture])
    info.texCoord = 1;
}

/** A second material with the fabric, another transform, in a variant. */
function with_variant(g) {
  const variant = structuredClone(g.materials[0]);
  const {extensions, pbrMetallicRoughness} = variant;
  for (const info of [extensions[NAME].fabric, pbrMetallicRoughness.baseColorTexture])
    info.extensions = {KHR_texture_transform: {scale: [8, 8], rotation: 0.5, offset: [0.25, 0]}};
  g.materials.push(variant);
  g.extensionsUsed.push('KHR_materials_variants');
  g.extensions.KHR_materials_variants = {variants: [{name: 'fine'}]};
  g.meshes[0].primitives[0].extensions = {KHR_materials_variants: {mappings: [{material: 1, variants: [0]}]}};
}

/** Texture coordinates as bytes, of KHR_mesh_quantization. */
function quantized(g) {
  const bytes = Buffer.from([0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 0, 0]);
  g.buffers.push({byteLength: bytes.length, uri: data_uri('application/octet-stream', bytes)});
  g.bufferViews.push({buffer: 1, byteLength: bytes.length, byteStride: 4, target: 34962});
  g.accessors[2] = {bufferView: 3, componentType: 5121, count: 3, type: 'VEC2'};
  g.extensionsUsed.push('KHR_mesh_quantization');
  g.extensionsRequired = ['KHR_mesh_quantization'];
}

/** Mask, normals and tint of the garment, on its second UV set. */
export function with_parts(g) {
  const [material] = g.materials, own = () => ({index: 1, texCoord: 1});
  g.meshes[0].primitives[0].attributes.TEXCOORD_1 = 2;
  g.textures.push({source: 0});
  Object.assign(material.extensions[NAME], {
    maskTexture: own(), maskCutoff: 0.25, normalTexture: {index: 1, texCoord: 1, scale: 0.5}, tintFactor: [0.5, 1, 1.5],
    tintTexture: own(),
  });
  Object.assign(material, {alphaMode: 'MASK', alphaCutoff: 0.25, normalTexture: {index: 1, texCoord: 1, scale: 0.5}});
  Object.assign(material.pbrMetallicRoughness, {baseColorTexture: own(), baseColorFactor: [0.2, 0.39, 0.59, 1]});
}

/** Garments without any issue. */
export const valid_garments = [
  fixture('', 'beside', 'a sound garment, its fabric in a file beside it', '', () => {}),
  fixture(
    '', 'embedded', 'a sound garment, its fabric in a buffer view', '',
    (g) => {
      embed(g, FABRIC);
      return nothing;
    }),
  fixture(
    '', 'holes', 'a sound garment with holes, alphaMode MASK', '',
    (g) => { g.materials[0].alphaMode = 'MASK'; },
    {fabric: HOLED}),
  fixture(
    '', 'almost-closed', 'alphaMode OPAQUE over a fabric of which less than 1/2000 is open', '', () => {},
    {fabric: ALMOST_CLOSED}),
  fixture('', 'uv-set-1', 'the fabric on the second UV set', '', on_set_1),
  fixture('', 'parts', 'a sound garment with mask, normals and tint of its own', '', with_parts),
  fixture('', 'variant', 'a variant with the same fabric, laid otherwise', '', with_variant),
  fixture('', 'quantized', 'texture coordinates of KHR_mesh_quantization', '', quantized),
  fixture(
    '', 'glb', 'a GLB with its fabric in the binary chunk', '',
    (g) => {
      embed(g, FABRIC);
      return nothing;
    },
    {write: (g) => ({'garment.glb': as_glb(g)})}),
].map((garment_fixture) => ({...garment_fixture, name: `garment${garment_fixture.name}`}));

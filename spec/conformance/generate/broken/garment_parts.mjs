// Mask, normals and tint of a garment beside its fabric, against the rules.
import {NAME, allowed, extension, fixture, material} from '../garment.mjs';
import {with_parts} from '../garments.mjs';

export const broken_parts = [
  ...['maskTexture', 'normalTexture', 'tintTexture'].map((part) => fixture(
    ['GLTF_EXTENSION', 'GLTF_ACCESSOR'], `${part.toLowerCase().replace('texture', '-texture')}-not-there`,
    `a ${part} that is no texture of the file`, `${material}/${part}`,
    (g) => {
      with_parts(g);
      g.materials[0].extensions[NAME][part].index = 7;
    },
    allowed)),
  extension(
    'mask-cutoff-negative', 'a negative maskCutoff', `${material}/maskCutoff`,
    (g) => {
      with_parts(g);
      g.materials[0].extensions[NAME].maskCutoff = -1;
    },
    allowed),
  ...[['negative', [1, -1, 1]], ['of-two', [1, 1]], ['beyond', [17, 1, 1]]].map(([what, tintFactor]) => extension(
    `tint-factor-${what}`, `a tintFactor of ${tintFactor}`, `${material}/tintFactor`,
    (g) => {
      with_parts(g);
      Object.assign(g.materials[0].extensions[NAME], {tintFactor});
    },
    allowed)),
  fixture(
    'GARMENT_NO_UVS', 'uv-set-of-the-mask', 'a mask on a UV set that the triangle lacks', '',
    (g) => {
      with_parts(g);
      delete g.meshes[0].primitives[0].attributes.TEXCOORD_1;
    },
    allowed),
];

export const unwise_parts = [
  fixture(
    'GLTF_FALLBACK', 'without-the-mask', 'a mask beside a fallback that is OPAQUE', '',
    (g) => {
      with_parts(g);
      delete g.materials[0].alphaMode;
    }),
  fixture(
    'GLTF_FALLBACK', 'of-another-picture', 'a tint texture beside a fallback of another picture', '',
    (g) => {
      with_parts(g);
      g.materials[0].pbrMetallicRoughness.baseColorTexture.index = 0;
    }),
];

// Textures and factors of the garment beside its fabric: mask, normals and tint, members of the extension.
import {Matrix3, SRGBColorSpace, Vector3} from 'three';

const TEXTURES = {mask: 'maskTexture', normal: 'normalTexture', tint_texture: 'tintTexture'};

const MAX_TINT = 16;

/** What a material without such members has; GarmentParts in index.d.ts. */
export const default_parts = { mask: null, mask_cutoff: 0.5, normal: null, normal_scale: 1, tint: [1, 1, 1], tint_texture: null };

const number_or = (x, otherwise) => Number.isFinite(Math.fround(x)) && typeof x === 'number' ? x : otherwise;
const are_numbers = (x, n) => Array.isArray(x) && x.length === n && x.every((a) => number_or(a, null) !== null);

/** The parts that an extension describes; those whose texture cannot be loaded are left out. */
export async function load_parts(parser, extension) {
  const {maskCutoff, normalTexture, tintFactor} = extension ?? {};
  const parts = {
    ...default_parts,
    mask_cutoff: number_or(maskCutoff, default_parts.mask_cutoff),
    normal_scale: number_or(normalTexture?.scale, default_parts.normal_scale),
    tint: (are_numbers(tintFactor, 3) ? tintFactor : default_parts.tint).map((c) => Math.min(Math.max(c, 0), MAX_TINT)),
  };
  await Promise.all(Object.entries(TEXTURES).map(async ([name, member]) => {
    const info = extension?.[member];
    if (!info) return;
    try {
      await parser.assignTexture(parts, name, info, name === 'tint_texture' ? SRGBColorSpace : undefined);
    } catch (error) {
      console.warn(`selvedge: GLTF_REFERENCE: ${member}: ${error.message}; it is left out`);
    }
  }));
  return parts;
}

const textures_of = (parts) => Object.keys(TEXTURES).filter((name) => parts[name]);

/** The key by which shaders of parts differ. */
export const parts_cache_key = (parts) => textures_of(parts).map((name) => `${name}${parts[name].channel}`).join();

export const part_uniforms = () => ({
  kept_mask: {value: null}, kept_mask_transform: {value: new Matrix3()}, kept_mask_cutoff: {value: 0},
  kept_normal: {value: null}, kept_normal_transform: {value: new Matrix3()}, kept_normal_scale: {value: 1},
  kept_tint_texture: {value: null}, kept_tint_texture_transform: {value: new Matrix3()},
  kept_tint: {value: new Vector3(1, 1, 1)},
});

/** Sets the uniforms to the parts of a material. */
export function set_kept_textures(uniforms, parts) {
  for (const name of textures_of(parts)) {
    const texture = parts[name];
    if (texture.matrixAutoUpdate) texture.updateMatrix();
    uniforms[`kept_${name}`].value = texture;
    uniforms[`kept_${name}_transform`].value.copy(texture.matrix);
  }
  uniforms.kept_mask_cutoff.value = parts.mask_cutoff;
  uniforms.kept_normal_scale.value = parts.normal_scale;
}
/** Tints by the parts, and by a colour beside another one, the fabric's own: as the fallback changes. */
export function set_tint(uniforms, parts, colour, own) {
  const change = ['r', 'g', 'b'].map((c) => colour[c] === own[c] ? 1 : Math.min(colour[c] / own[c], MAX_TINT));
  uniforms.kept_tint.value.fromArray(parts.tint.map((tint, k) => tint * change[k]));
}

/** Names and body for a vertex shader. */
export function parts_vertex_code(parts) {
  const names = textures_of(parts), set = (name) => parts[name].channel === 1 ? 'uv1' : 'uv';
  return {
    defines: names.some((name) => set(name) === 'uv1') ? '#define KEPT_UV1\n' : '',
    names: names.map((name) => `uniform mat3 kept_${name}_transform;\nvarying vec2 kept_${name}_uv;\n`).join(''),
    body: names.map((name) => `kept_${name}_uv = (kept_${name}_transform * vec3(${set(name)}, 1.0)).xy;\n`).join(''),
  };
}

/** Names for a fragment shader: KEPT_MASK, KEPT_NORMAL, KEPT_TINT_TEXTURE say what there is. */
export const parts_fragment_code = (parts) => textures_of(parts).map((name) =>
  `#define KEPT_${name.toUpperCase()}\nuniform sampler2D kept_${name};\nvarying vec2 kept_${name}_uv;\n`).join('') +
  'uniform float kept_mask_cutoff;\nuniform float kept_normal_scale;\nuniform vec3 kept_tint;\n';

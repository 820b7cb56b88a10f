// The environments of three.js as fabrics are drawn in them.
import {
  Camera, DataUtils, EquirectangularReflectionMapping, EquirectangularRefractionMapping, Euler, FloatType, HalfFloatType, Matrix3, Matrix4, Mesh, PlaneGeometry,
  ShaderMaterial, Vector3, WebGLRenderTarget
} from 'three';
import {SMOOTH_LIGHT_INTEGRALS, MAX_LAMPS, split_light} from '../environment.js';
import {lights_of, sum_soft_lights} from './lights.js';

/** From three.js's axes of an environment, the middle column along x, to the axes of environment.js. */
const FROM_THREE = new Matrix3(0, 0, 1, 0, 1, 0, -1, 0, 0);
const known = new WeakMap(), rotation = new Matrix4(), no_turn = new Euler();

/** The picture of an equirectangular texture of numbers, for split_light(); null of other textures. */
function picture_of({mapping, type, flipY, image}) {
  const {data, width, height} = image ?? {};
  if (mapping !== EquirectangularReflectionMapping || !data || width !== 2 * height) return null;
  if (type !== FloatType && type !== HalfFloatType) return null;
  const step = data.length / (width * height), radiance = new Float32Array(3 * width * height);
  const number = type === FloatType ? (x) => x : DataUtils.fromHalfFloat;
  for (let y = 0, to = 0; y < height; ++y) {
    const row = (flipY ? y : height - 1 - y) * width;
    for (let x = 0; x < width; ++x)
      for (let c = 0; c < 3; ++c) radiance[to++] = Math.min(Math.max(number(data[(row + x) * step + c]), 0), 1e30) || 0;
  }
  return {width, height, radiance};
}

/** The mapping of PMREMGenerator's textures before 0.187, which three.js does not export; later ones are cubes. */
const CUBE_UV = 306;
/** Columns of a picture that is drawn, and the samples of a pixel: a sun is smaller. */
const DRAWN_WIDTH = 256, SAMPLES = 16;

/** The material that draws a texture of any layout from all around, and its colour from a direction `d`. */
function drawing_material(texture) {
  const {mapping, isCubeTexture, isRenderTargetTexture, image} = texture, is_cube_uv = mapping === CUBE_UV;
  const levels = is_cube_uv ? Math.log2(image.height) - 2 : 0, towards = isRenderTargetTexture ? 'd' : 'vec3(-d.x, d.yz)';
  const colour = is_cube_uv ? 'textureCubeUV(picture, d, 0.0)' : isCubeTexture ? `textureLod(picture, ${towards}, 0.0)` : 'texture2D(picture, equirectUv(d))';
  return new ShaderMaterial({
    uniforms: {picture: {value: texture}},
    // As three.js's WebGLProgram has them.
    defines: is_cube_uv ? {
      ENVMAP_TYPE_CUBE_UV: '', CUBEUV_TEXEL_WIDTH: 1 / (3 * Math.max(2 ** levels, 112)), CUBEUV_TEXEL_HEIGHT: 1 / image.height,
      CUBEUV_MAX_MIP: levels.toFixed(1)
    } : {},
    depthTest: false, depthWrite: false, toneMapped: false,
    vertexShader: 'varying vec2 place; void main() { place = uv; gl_Position = vec4(position.xy, 0.0, 1.0); }',
    fragmentShader: `#include <common>
      ${is_cube_uv ? '#include <cube_uv_reflection_fragment>' : ''}
      varying vec2 place; uniform ${isCubeTexture ? 'samplerCube' : 'sampler2D'} picture;
      void main() {
        vec2 part = vec2(dFdx(place.x), dFdy(place.y)) * 0.25;
        gl_FragColor = vec4(0.0, 0.0, 0.0, 1.0);
        for (int i = 0; i < ${SAMPLES}; ++i) {
          vec2 a = (place - 0.5 + (vec2(i & 3, i >> 2) - 1.5) * part) * vec2(2.0, 1.0) * PI;
          vec3 d = vec3(cos(a.x) * cos(a.y), sin(a.y), sin(a.x) * cos(a.y));
          gl_FragColor.rgb += ${colour}.rgb * ${1 / SAMPLES};
        }
      }`,
  });
}
/** The picture of any texture that three.js takes for an environment, drawn and read back; null of others. */
function picture_drawn(texture, renderer) {
  const {mapping, isCubeTexture} = texture;
  if (!isCubeTexture && ![CUBE_UV, EquirectangularReflectionMapping, EquirectangularRefractionMapping].includes(mapping)) return null;
  const width = DRAWN_WIDTH, height = width / 2, target = new WebGLRenderTarget(width, height, {type: FloatType, depthBuffer: false});
  const quad = new Mesh(new PlaneGeometry(2, 2), drawing_material(texture)), data = new Float32Array(4 * width * height), {xr} = renderer;
  const drawn_to = [renderer.getRenderTarget(), renderer.getActiveCubeFace(), renderer.getActiveMipmapLevel()], is_xr = xr.enabled;
  quad.frustumCulled = xr.enabled = false;
  renderer.setRenderTarget(target);
  renderer.render(quad, new Camera());
  renderer.readRenderTargetPixels(target, 0, 0, width, height, data);
  renderer.setRenderTarget(...drawn_to);
  xr.enabled = is_xr;
  for (const each of [target, quad.geometry, quad.material]) each.dispose();
  return picture_of({mapping: EquirectangularReflectionMapping, type: FloatType, flipY: false, image: {data, width, height}});
}

/** What split_light() makes of a texture, found once for each of its versions; null of textures that are no environment, or not loaded. */
function light_of(texture, renderer) {
  if (texture.version === 0 && !texture.isRenderTargetTexture) return null;
  const last = known.get(texture), version = `${texture.version} ${texture.pmremVersion}`;
  if (last?.version === version) return last.light;
  const picture = picture_of(texture) ?? picture_drawn(texture, renderer), light = picture && split_light(picture);
  if (!light) console.warn(`selvedge: the environment "${texture.name}" has the mapping ${texture.mapping}, and lights no fabrics`);
  known.set(texture, {version, light});
  return light;
}

const vectors = (count) => Array.from({length: count}, () => new Vector3());
export const environment_uniforms = () => ({
  around_factors: {value: vectors(9)},
  around_brightness: {value: new Matrix3()},
  soft_brightness: {value: new Matrix3()},
  around_lamp_directions: {value: vectors(MAX_LAMPS)},
  around_lamp_irradiances: {value: vectors(MAX_LAMPS)},
  around_lamp_count: {value: 0},
  around_strength: {value: 1},
  around_from_world: {value: new Matrix3()},
});

const axis = new Vector3();

/** The same light in the axes of a mesh, as the worker has it (cell_images.js): { around, lamps }. `inverse`: world to mesh. */
export function environment_in_mesh_axes(uniforms, {elements: e}) {
  const {around_factors, around_lamp_directions, around_lamp_irradiances, around_lamp_count, around_from_world} = uniforms;
  const axes = [0, 1, 2].flatMap(
    (k) => axis.set(e[k], e[k + 4], e[k + 8]).normalize().applyMatrix3(around_from_world.value).toArray());
  const lamps = around_lamp_directions.value.slice(0, around_lamp_count.value).map((d, i) => {
    const local = [0, 1, 2].map((k) => axes[3 * k] * d.x + axes[3 * k + 1] * d.y + axes[3 * k + 2] * d.z);
    return [0, ...local, ...around_lamp_irradiances.value[i].toArray(), 0, 0, 0];
  });
  return {around: [...around_factors.value.flatMap((factor) => factor.toArray()), ...axes], lamps};
}

const soft = vectors(9);
const brightness_of = (factors) => factors.map(({x, y, z}, k) => (x + y + z) / 3 * SMOOTH_LIGHT_INTEGRALS[k]);

/** Sets the uniforms to what lights a material in a scene from all around; whether anything does. */
export function set_environment_uniforms(uniforms, material, scene, renderer, camera) {
  const texture = material.envMap ?? scene.userData.fabric_environment ?? scene.environment, light = texture ? light_of(texture, renderer) : null;
  const {envMapIntensity, envMapRotation} = material.envMap ? material : {envMapIntensity: scene.environmentIntensity, envMapRotation: scene.environmentRotation};
  const strength = light ? envMapIntensity ?? 1 : 0, lamps = light?.lamps ?? [], {soft: lights} = lights_of(renderer, scene, camera);
  rotation.makeRotationFromEuler(envMapRotation ?? no_turn);
  uniforms.around_from_world.value.setFromMatrix4(rotation).transpose().premultiply(FROM_THREE);
  const factors = uniforms.around_factors.value;
  factors.forEach((factor, k) => factor.fromArray(light?.rest[k] ?? [0, 0, 0]).multiplyScalar(strength));
  uniforms.around_brightness.value.fromArray(brightness_of(factors));
  sum_soft_lights(soft, lights, uniforms.around_from_world.value);
  uniforms.soft_brightness.value.fromArray(brightness_of(soft));
  factors.forEach((factor, k) => factor.add(soft[k]));
  uniforms.around_strength.value = strength;
  uniforms.around_lamp_count.value = lamps.length;
  lamps.forEach(({direction, irradiance}, i) => {
    uniforms.around_lamp_directions.value[i].fromArray(direction);
    uniforms.around_lamp_irradiances.value[i].fromArray(irradiance).multiplyScalar(strength);
  });
  return light !== null || lights.length > 0;
}

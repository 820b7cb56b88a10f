// The environments of three.js as fabrics are drawn in them.
import {DataUtils, EquirectangularReflectionMapping, Euler, FloatType, HalfFloatType, Matrix3, Matrix4, Vector3} from 'three';
import {SMOOTH_LIGHT_INTEGRALS, MAX_LAMPS, split_light} from '../environment.js';
import {cell_images} from './cell_images.js';
import {lights_of, sum_soft_lights} from './lights.js';

/** From three.js's axes of an environment, the middle column along x, to the axes of environment.js. */
const FROM_THREE = new Matrix3(0, 0, 1, 0, 1, 0, -1, 0, 0);
/** Columns of a picture that is drawn. */
export const DRAWN_WIDTH = 256;
const known = new WeakMap(), rotation = new Matrix4(), no_turn = new Euler();

/** The picture of an equirectangular texture of numbers, for split_light(); null of other textures. */
export function picture_of({mapping, type, flipY, image}) {
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

/**
 * What split_light() makes of a texture, found once for each of its versions; null of textures that are no environment, or not loaded.
 * `draw`(texture, renderer): the picture of a texture that is drawn, null of no environment, or a promise.
 */
function light_of(texture, renderer, draw) {
  if (texture.version === 0 && !texture.isRenderTargetTexture) return null;
  const last = known.get(texture), version = `${texture.version} ${texture.pmremVersion}`;
  if (last?.version === version) return last.light;
  const take = (picture) => {
    const light = picture && split_light(picture);
    if (!light) console.warn(`selvedge: the environment "${texture.name}" has the mapping ${texture.mapping}, and lights no fabrics`);
    known.set(texture, {version, light});
    return light;
  };
  const picture = picture_of(texture) ?? draw(texture, renderer);
  if (!picture?.then) return take(picture);
  known.set(texture, {version, light: last?.light ?? null});
  cell_images.wait_for(picture.then(take));
  return known.get(texture).light;
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
/** The brightness of nine factors, vectors. */
export const brightness_of = (factors) => factors.map(({x, y, z}, k) => (x + y + z) / 3 * SMOOTH_LIGHT_INTEGRALS[k]);

/** Sets the uniforms to what lights a material in a scene from all around, `draw`: light_of()'s; whether anything does. */
export function set_environment_uniforms(uniforms, material, scene, renderer, camera, draw) {
  const texture = material.envMap ?? scene.userData.fabric_environment ?? scene.environment, light = texture ? light_of(texture, renderer, draw) : null;
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

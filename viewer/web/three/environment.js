// The environments of three.js as fabrics are drawn in them.
import { DataUtils, EquirectangularReflectionMapping, Euler, FloatType, HalfFloatType, Matrix3, Matrix4, Vector3 } from 'three';
import {AROUND_WEIGHTS, MAX_LAMPS, divide} from '../environment.js';

/** From three.js's axes of an environment, the middle column along x, to the axes of environment.js. */
const FROM_THREE = new Matrix3(0, 0, 1, 0, 1, 0, -1, 0, 0);
const known = new WeakMap(), rotation = new Matrix4(), no_turn = new Euler();

/** The picture of an equirectangular texture of numbers, for divide(); null of other textures. */
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

/** What divide() makes of a texture, found once for each of its versions; null of textures that it cannot read. */
function light_of(texture) {
  const last = known.get(texture);
  if (last?.version === texture.version) return last.light;
  const picture = picture_of(texture), light = picture && divide(picture);
  if (!light)
    console.warn('selvedge: fabrics see environments that are equirectangular textures of floats or halves, with their data');
  known.set(texture, {version: texture.version, light});
  return light;
}

const vectors = (count) => Array.from({length: count}, () => new Vector3());
export const around_uniforms = () => ({
  around_factors: {value: vectors(9)},
  around_brightness: {value: new Matrix3()},
  around_lamp_directions: {value: vectors(MAX_LAMPS)},
  around_lamp_irradiances: {value: vectors(MAX_LAMPS)},
  around_lamp_count: {value: 0},
  around_strength: {value: 1},
  around_from_world: {value: new Matrix3()},
});

const axis = new Vector3();

/** The same light in the axes of a mesh, as the worker has it (cell_images.js): { around, lamps }. `inverse`: world to mesh. */
export function around_of_mesh(uniforms, {elements: e}) {
  const {around_factors, around_lamp_directions, around_lamp_irradiances, around_lamp_count, around_from_world} = uniforms;
  const axes = [0, 1, 2].flatMap(
    (k) => axis.set(e[k], e[k + 4], e[k + 8]).normalize().applyMatrix3(around_from_world.value).toArray());
  const lamps = around_lamp_directions.value.slice(0, around_lamp_count.value).map((d, i) => {
    const local = [0, 1, 2].map((k) => axes[3 * k] * d.x + axes[3 * k + 1] * d.y + axes[3 * k + 2] * d.z);
    return [0, ...local, ...around_lamp_irradiances.value[i].toArray(), 0, 0, 0];
  });
  return {around: [...around_factors.value.flatMap((factor) => factor.toArray()), ...axes], lamps};
}

/** Sets the uniforms to what lights a material in a scene; whether anything does. */
export function set_around(uniforms, material, scene) {
  const texture = material.envMap ?? scene.userData.fabric_environment ?? scene.environment, light = texture ? light_of(texture) : null;
  if (!light) return false;
  const of = material.envMap ? material : null, strength = of ? of.envMapIntensity : scene.environmentIntensity ?? 1;
  rotation.makeRotationFromEuler((of ? of.envMapRotation : scene.environmentRotation) ?? no_turn);
  uniforms.around_from_world.value.setFromMatrix4(rotation).transpose().premultiply(FROM_THREE);
  light.rest.forEach((factor, k) => uniforms.around_factors.value[k].fromArray(factor).multiplyScalar(strength));
  uniforms.around_brightness.value.fromArray(light.rest.map(([r, g, b], k) => (r + g + b) / 3 * AROUND_WEIGHTS[k] * strength));
  uniforms.around_strength.value = strength;
  uniforms.around_lamp_count.value = light.lamps.length;
  light.lamps.forEach(({direction, irradiance}, i) => {
    uniforms.around_lamp_directions.value[i].fromArray(direction);
    uniforms.around_lamp_irradiances.value[i].fromArray(irradiance).multiplyScalar(strength);
  });
  return true;
}

// The lights of a scene as fabrics have them: lamps one by one, and what comes from all around as smooth light of environment.js.
import {Color, Vector3} from 'three';
import {smooth_basis, smooth_factors} from '../environment.js';

/** Attributes of Surroundings: nine brightnesses, a vector of three each. */
export const VERTEX_LIGHT = [0, 1, 2].map((k) => `around_vertex_${k}`);

const place = new Vector3(), other = new Vector3(), colour = new Color();

/** A number of the frame that a WebGLRenderer, or a WebGPURenderer, draws. */
export const frame_of = ({info}) => info.render.frame ?? info.calls;

let found = {};
/** { lamps, soft }: the lights of a scene that a camera sees, found once a frame. */
export function lights_of(renderer, scene, camera) {
  const frame = frame_of(renderer);
  if (found.scene === scene && found.camera === camera && found.frame === frame && found.renderer === renderer) return found;
  found = {renderer, scene, camera, frame, lamps: [], soft: []};
  scene.traverseVisible((object) => {
    if (!object.isLight || object.userData.spares_fabrics || !object.layers.test(camera.layers)) return;
    const {isDirectionalLight, isSunLight, isPointLight, isSpotLight, isRectAreaLight, isAmbientLight, isHemisphereLight, isLightProbe} = object;
    if (isDirectionalLight || isSunLight || isPointLight || isSpotLight || isRectAreaLight) found.lamps.push(object);
    if (isAmbientLight || isHemisphereLight || isLightProbe) found.soft.push(object);
  });
  return found;
}

/**
 * A lamp as the module has it, in the axes of a mesh whose unit is `scale` m long; `inverse`: world to mesh. Images have point
 * lights without an end and without a cone, which are factors of the place, and rectangles as points.
 */
export function numbers_of_lamp(light, scale, inverse) {
  const {r, g, b} = light.color, area = light.isRectAreaLight ? light.width * light.height : 1;
  const irradiance = [r, g, b].map((x) => x * area * light.intensity), position = place.setFromMatrixPosition(light.matrixWorld);
  if (!light.isDirectionalLight && !light.isSunLight)
    return [1, 0, 0, 1, ...irradiance.map((x) => x / scale ** 2), ...position.applyMatrix4(inverse).toArray()];
  if (light.target) position.sub(other.setFromMatrixPosition(light.target.matrixWorld));
  const towards = position.transformDirection(inverse);
  return [0, ...towards.toArray(), ...irradiance, 0, 0, 0];
}

/** The corners of an icosahedron: their mean is a sphere's of all that smooth light times its functions can be (a 5-design). */
const CORNERS = [-1, 1].flatMap((a) => [-1, 1].flatMap((b) => {
  const long = b * (1 + Math.sqrt(5)) / 2;
  return [[0, a, long], [a, long, 0], [long, 0, a]].map((corner) => new Vector3(...corner).normalize());
}));

/** Sets radiance, a vector, to what a soft light sends from a direction: three.js's irradiance divided by pi where it is even. */
function find_radiance(radiance, light, direction) {
  if (light.isLightProbe) return light.sh.getAt(direction, radiance).multiplyScalar(light.intensity);
  colour.copy(light.color);
  // Irradiance is linear in the cosine to the sky, so that radiance is, by three halves.
  if (light.isHemisphereLight) colour.lerp(light.groundColor, 0.5 - 0.75 * other.setFromMatrixPosition(light.matrixWorld).normalize().dot(direction));
  return radiance.set(colour.r, colour.g, colour.b).multiplyScalar(light.intensity / Math.PI);
}

/** Sets nine factors to the sum of soft lights, in axes to which `from_world` turns. */
export function sum_soft_lights(factors, lights, from_world) {
  for (const factor of factors) factor.set(0, 0, 0);
  for (const light of lights)
    for (const corner of CORNERS) {
      find_radiance(place, light, corner);
      const basis = smooth_basis(...other.copy(corner).applyMatrix3(from_world));
      smooth_factors(basis, 4 * Math.PI / CORNERS.length).forEach((weight, k) => factors[k].addScaledVector(place, weight));
    }
}

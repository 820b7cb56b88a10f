// An environment around a scene that hides parts of it from itself: lamps with shadow maps for what is bright, and for the
// rest what folds, sleeves and collar leave each vertex of the fabrics. The twin of viewer/light/shadow_maps.cpp.
//
//   const surroundings = new Surroundings(scene, picture);  // { width, height, radiance }: environment.js
//   surroundings.stand(garment);                            // after it has moved, too
//   await surroundings.shade(renderer, garment);            // it takes some seconds
//   surroundings.set({turn: 30, strength: 1});
import {
  Box3, Color, DataTexture, DirectionalLight, DoubleSide, EquirectangularReflectionMapping, Euler, FloatType, Fog, InterleavedBuffer,
  InterleavedBufferAttribute, LinearFilter, MathUtils, Matrix3, Mesh, MeshBasicMaterial, NearestFilter, OrthographicCamera, RGBAFormat, Scene,
  Sphere, Vector3, WebGLRenderTarget, WebGPUCoordinateSystem
} from 'three';
import {project_to_smooth_light, smooth_factors, smooth_basis, extract_lamps} from '../environment.js';
import {brightness_of} from './environment.js';
import {VERTEX_LIGHT} from './lights.js';

const {PI, SQRT1_2, cos, floor, max, round, sin, sqrt} = Math;
const DIRECTIONS = 48, SKY_MAP = 512, LAMP_MAP = 1024;
/** Offset of look-ups, in texels, along the normal, by the sine of the angle to the light, and along the light. */
const NORMAL_OFFSET = 3, LIGHT_OFFSET = 0.5;

/** Points of a spiral, each with the same part of the sphere. */
const spiral = Array.from({length: DIRECTIONS}, (_, i) => {
  const z = 1 - (2 * i + 1) / DIRECTIONS, angle = i * PI * (3 - sqrt(5)), planar = sqrt(1 - z * z);
  return new Vector3(planar * cos(angle), planar * sin(angle), z);
});

/** Black in white fog: all renderers of three.js draw depths so, smoothstep() of them. */
const depth_material = new MeshBasicMaterial({color: 0, side: DoubleSide, toneMapped: false});

/** The picture as three.js has environments, the first row the lowest. */
function texture_of({width, height, radiance}) {
  const texels = new Float32Array(4 * width * height).fill(1);
  for (let i = 0; i < width * height; ++i) {
    const from = 3 * ((height - 1 - floor(i / width)) * width + i % width);
    texels.set(radiance.subarray(from, from + 3), 4 * i);
  }
  const texture = new DataTexture(texels, width, height, RGBAFormat, FloatType, EquirectangularReflectionMapping);
  texture.minFilter = texture.magFilter = LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

/** A camera that looks from a direction at all within a sphere. */
function looking_from(direction, {center, radius}) {
  const camera = new OrthographicCamera(-radius, radius, radius, -radius, 0, 2 * radius);
  camera.up.set(0, direction.z ** 2 > 0.8 ? 1 : 0, direction.z ** 2 > 0.8 ? 0 : 1);
  camera.position.copy(center).addScaledVector(direction, radius);
  camera.lookAt(center);
  camera.updateMatrixWorld();
  return camera;
}

export class Surroundings {
  #factors;
  #picture;
  #meshes = [];
  #is_known = false;
  /** The turn that the vertices are lit for. */
  #lit_at = NaN;
  /** `reflects`: other materials than fabrics are lit by it, too, for which three.js needs a second or more. */
  constructor(scene, picture, {reflects = true} = {}) {
    const {lamps, rest} = extract_lamps(picture);
    this.#factors = project_to_smooth_light(rest).map((factor) => new Vector3(...factor));
    this.#picture = picture;
    this.scene = scene;
    scene.userData.fabric_environment = texture_of(rest);
    /** Radiance, the mean of all directions without the lamps. */
    this.mean = this.#factors[0].toArray().map((factor) => factor * smooth_basis(0, 0, 1)[0]);
    if (reflects) this.reflect();
    this.lamps = lamps.map(({direction, irradiance}) => {
      const light = new DirectionalLight();
      light.castShadow = true;
      light.shadow.mapSize.set(LAMP_MAP, LAMP_MAP);
      scene.add(light, light.target);
      return {direction, irradiance, light};
    });
    this.sphere = new Sphere(new Vector3(), 1);
    this.set({turn: 0, strength: 1});
  }

  /** Lights other materials than fabrics, too. */
  reflect() {
    const {scene, scene: {userData}} = this;
    scene.environment = userData.fabric_environment ?? scene.environment;
    delete userData.fabric_environment;
  }
  /** Shows the environment behind the scene, blurred by 0 to 1. */
  show(blur) {
    this.scene.background = texture_of(this.#picture);
    this.scene.backgroundBlurriness = blur;
  }

  /** Lets a garment cast shadows. */
  stand(garment) {
    garment.updateMatrixWorld(true);
    new Box3().setFromObject(garment).getBoundingSphere(this.sphere);
    this.#meshes = [];
    const geometries = new Set();
    garment.traverse((mesh) => {
      if (!mesh.isMesh) return;
      mesh.castShadow = mesh.receiveShadow = true;
      const is_plain = !mesh.isSkinnedMesh && !mesh.isInstancedMesh && !mesh.isBatchedMesh;
      if (!mesh.material.isFabricMaterial || !is_plain || !mesh.geometry.attributes.normal) return;
      // Light is of one place.
      if (geometries.has(mesh.geometry)) mesh.geometry = mesh.geometry.clone();
      geometries.add(mesh.geometry);
      this.#meshes.push({mesh, hidden: new Uint8Array(DIRECTIONS * mesh.geometry.attributes.position.count)});
    });
    for (const {light} of this.lamps) {
      const {camera} = light.shadow, {radius} = this.sphere;
      Object.assign(camera, {left: -radius, right: radius, top: radius, bottom: -radius, near: 0, far: 4 * radius});
      camera.updateProjectionMatrix();
      light.shadow.normalBias = NORMAL_OFFSET * SQRT1_2 * 2 * radius / LAMP_MAP;
    }
    this.#is_known = false;
    this.set(this);
  }
  /** Finds what a garment that stands hides from itself, at rest; settled when its vertices are lit so. */
  async shade(renderer, garment) {
    await this.#look(renderer, garment);
    this.#is_known = true;
    this.#lit_at = NaN;
    this.set(this);
  }

  /** Turns the environment by degrees, counter-clockwise from above, and scales it. */
  set({turn = this.turn, strength = this.strength}) {
    this.turn = turn;
    this.strength = strength;
    const {scene, sphere} = this, angle = turn / 180 * PI, [c, s] = [cos(angle), sin(angle)];
    // Its middle column is seen along -z.
    // three.js before 0.162 turns nothing, and lacks asynchronous reading (#look).
    for (const name of ['environmentRotation', 'backgroundRotation']) (scene[name] ??= new Euler()).y = PI / 2 + angle;
    scene.environmentIntensity = scene.backgroundIntensity = strength;
    for (const {direction: [x, y, z], irradiance, light} of this.lamps) {
      light.target.position.copy(sphere.center);
      light.position.set(x * c + z * s, y, z * c - x * s).multiplyScalar(2 * sphere.radius).add(sphere.center);
      light.color.setRGB(...irradiance.map((e) => e * strength));
    }
    if (this.#lit_at === turn || !this.#is_known) return;
    this.#lit_at = turn;
    // In the axes of the environment.
    const parts = spiral.map(({x, y, z}) => {
      const basis = smooth_basis(x * c - z * s, y, z * c + x * s), radiance = new Vector3();
      basis.forEach((b, i) => radiance.addScaledVector(this.#factors[i], b));
      return brightness_of(smooth_factors(basis, 4 * PI / DIRECTIONS).map((weight) => radiance.clone().multiplyScalar(weight)));
    });
    for (const {mesh, hidden} of this.#meshes) this.#light(mesh.geometry, hidden, parts);
  }

  /** Light at the vertices: the whole without what is hidden. */
  #light(geometry, hidden, parts) {
    const count = hidden.length / DIRECTIONS, all = brightness_of(this.#factors), sums = new Float64Array(9);
    // One buffer: WebGPU has eight.
    if (!geometry.attributes[VERTEX_LIGHT[0]]) {
      const light = new InterleavedBuffer(new Float32Array(9 * count), 9);
      VERTEX_LIGHT.forEach((name, k) => geometry.setAttribute(name, new InterleavedBufferAttribute(light, 3, 3 * k)));
    }
    const {data: light} = geometry.attributes[VERTEX_LIGHT[0]];
    light.needsUpdate = true;
    for (let v = 0; v < count; ++v) {
      sums.set(all);
      for (let i = 0; i < DIRECTIONS; ++i) {
        const weight = hidden[v * DIRECTIONS + i] / 255;
        if (weight === 0) continue;
        const part = parts[i];
        for (let k = 0; k < 9; ++k) sums[k] -= weight * part[k];
      }
      light.array.set(sums, 9 * v);
    }
  }

  /** Draws depths from all around, and looks the vertices up in them. */
  async #look(renderer, garment) {
    const {sphere} = this, only = new Scene();
    only.background = new Color(1, 1, 1);
    only.fog = new Fog(only.background, 0, 2 * sphere.radius);
    garment.traverse((mesh) => {
      if (!mesh.isMesh) return;
      const copy = new Mesh(mesh.geometry, depth_material);
      copy.matrixAutoUpdate = false;
      copy.matrix.copy(mesh.matrixWorld);
      only.add(copy);
    });
    const target = new WebGLRenderTarget(SKY_MAP, SKY_MAP, {type: FloatType, minFilter: NearestFilter, magFilter: NearestFilter});
    const texels = new Float32Array(4 * SKY_MAP ** 2), is_from_top = renderer.coordinateSystem === WebGPUCoordinateSystem;
    for (const [i, direction] of spiral.entries()) {
      const camera = looking_from(direction, sphere), before = renderer.getRenderTarget();
      renderer.setRenderTarget(target);
      renderer.render(only, camera);
      renderer.setRenderTarget(before);
      const read = renderer.readRenderTargetPixelsAsync ?? renderer.readRenderTargetPixels;
      const depths = await read.call(renderer, target, 0, 0, SKY_MAP, SKY_MAP, ...renderer.isWebGLRenderer ? [texels] : []) ?? texels;
      for (const of of this.#meshes) this.#hide(of, i, depths, camera.matrixWorld, is_from_top);
    }
    target.dispose();
  }

  /** The fractions of light from a direction that are hidden from vertices, the mean of 3 x 3 lookups between the texels of the map. */
  #hide({mesh, hidden}, i, depths, matrix, is_from_top) {
    const {center, radius} = this.sphere, texel = 2 * radius / SKY_MAP, direction = spiral[i];
    const {position, normal} = mesh.geometry.attributes, p = new Vector3(), n = new Vector3();
    const [right, up] = [0, 1].map((k) => new Vector3().setFromMatrixColumn(matrix, k));
    const of_normals = new Matrix3().getNormalMatrix(mesh.matrixWorld);
    if (is_from_top) up.negate();
    for (let v = 0; v < position.count; ++v) {
      n.fromBufferAttribute(normal, v).applyNormalMatrix(of_normals);
      const cosine = n.dot(direction), sine = sqrt(max(0, 1 - cosine * cosine));
      p.fromBufferAttribute(position, v).applyMatrix4(mesh.matrixWorld).sub(center);
      p.addScaledVector(n, (cosine > 0 ? 1 : -1) * NORMAL_OFFSET * sine * texel).addScaledVector(direction, LIGHT_OFFSET * texel);
      const z = MathUtils.smoothstep((1 - p.dot(direction) / radius) / 2, 0, 1);
      const x = p.dot(right) / texel + SKY_MAP / 2 - 0.5, y = p.dot(up) / texel + SKY_MAP / 2 - 0.5;
      const [left, low] = [floor(x), floor(y)], [a, b] = [x - left, y - low];
      if (left < 1 || low < 1 || left > SKY_MAP - 3 || low > SKY_MAP - 3) continue;
      const columns = [1 - a, 1, 1, a], rows = [1 - b, 1, 1, b];
      let sum = 0;
      for (let j = 0; j < 4; ++j)
        for (let k = 0; k < 4; ++k)
          sum += depths[4 * ((low - 1 + j) * SKY_MAP + left - 1 + k)] < z ? rows[j] * columns[k] / 9 : 0;
      hidden[v * DIRECTIONS + i] = round(255 * sum);
    }
  }
}

// Fabrics in three.js's WebGPURenderer, with either back end, from its GLTFLoader:
//
//   loader.register((parser) => new SelvedgeFabric(parser));
import {REVISION} from 'three';
import {LightingModel, MeshPhysicalNodeMaterial, Node, NodeUpdateType} from 'three/webgpu';
import {
  LTC_Evaluate, abs, diffuseColor, dot, emissive, float, fract, lightingContext, mat3, materialAO, materialEmissive, mix, normalView, normalize,
  positionView, positionLocal, screenCoordinate, select, sin, uniform, vec2, vec3, vec4, vertexColor, instanceColor, min, floor
} from 'three/tsl';
import {cell_images} from './cell_images.js';
import {fabric_material} from './fabric_material.js';
import {set_kept_textures} from './garment_parts.js';
import {frame_of} from './lights.js';
import {node_atlas, picture_drawn} from './node_atlas.js';
import {brightness_around, light_of_cosine, look_up, nodes_of, outgoing_light, set_nodes} from './node_shader.js';
import {plugin_of} from './plugin.js';

const FIRST = 187, revision = Number.parseInt(REVISION, 10), is_of_use = revision >= FIRST;
if (!is_of_use) console.warn(`selvedge: GRAPHICS_UNAVAILABLE: three.js 0.${revision} cannot draw fabrics by nodes, those from 0.${FIRST} on can; the fallback is shown`);

/** Prepares a material for each object that it is drawn with. */
class BeforeEach extends Node {
  constructor() {
    super('void');
    this.updateBeforeType = NodeUpdateType.OBJECT;
  }
  updateBefore({renderer, scene, camera, object, material}) {
    material.prepare(renderer, scene, camera, object.geometry, object);
  }
  generate = () => '';
}

/** Sums the brightness of lights. */
class FabricLight extends LightingModel {
  constructor(nodes, normal) {
    super();
    Object.assign(this, {nodes, normal});
  }
  direct({lightDirection, lightColor, reflectedLight}) {
    reflectedLight.directDiffuse.addAssign(lightColor.mul(light_of_cosine(this.nodes, dot(this.normal, lightDirection))));
  }
  directRectArea({lightColor, lightPosition: p, halfWidth: w, halfHeight: h, reflectedLight}) {
    const {normal, nodes: {cell_beyond}} = this, view = select(abs(normal.x).lessThan(0.5), vec3(1, 0, 0), vec3(0, 1, 0));
    const corners = {p0: p.add(w).sub(h), p1: p.sub(w).sub(h), p2: p.sub(w).add(h), p3: p.add(w).add(h)};
    const at = (N) => LTC_Evaluate({N, V: view, P: positionView, mInv: mat3(1, 0, 0, 0, 1, 0, 0, 0, 1), ...corners}).x;
    const front = at(normal), back = at(normal.negate()), facing = at(normalize(p.sub(positionView)));
    reflectedLight.directDiffuse.addAssign(lightColor.mul(Math.PI).mul(mix(front, facing.add(front).sub(back).mul(0.5), cell_beyond)));
  }
}

export class FabricMaterial extends fabric_material(MeshPhysicalNodeMaterial) {
  #shown;
  get is_of_use() { return is_of_use; }
  get atlas() { return node_atlas; }
  get draw_environment() { return picture_drawn; }
  get sorts_holes() { return false; }
  provokes_first({backend}) { return backend.isWebGPUBackend === true; }
  make_nodes() {
    this.nodes = nodes_of({...cell_images.uniforms, ...node_atlas.uniforms(), cell_noise: this.fabric_uniforms.cell_noise});
    this.before_each = new BeforeEach();
    /** What is added to the thresholds of holes: another one in each frame, so that frames average out. */
    this.hole_turn = uniform(0);
  }
  /** three.js's copy() reads it, and warns that it is old. */
  get iridescenceThicknessRange() { return undefined; }
  copy_fallback(fallback) {
    for (const [name, value] of Object.entries(fallback))
      if (!/^(is[A-Z]|(uuid|type|version|defines)$)/.test(name)) this[name] = value?.clone && !value.isTexture ? value.clone() : value;
  }
  take_garment() {
    super.take_garment();
    // Its programs know the attributes that there were.
    this.needsUpdate = true;
  }
  prepare(renderer, scene, camera, geometry, object) {
    super.prepare(renderer, scene, camera, geometry, object);
    set_kept_textures(this.part_uniforms, this.parts);
    const {fabric_uniforms, around_uniforms, part_uniforms} = this;
    set_nodes(this.nodes, {...fabric_uniforms, ...around_uniforms, ...part_uniforms, ...cell_images.uniforms, ...node_atlas.uniforms(renderer)});
    this.hole_turn.value = frame_of(renderer) * (Math.sqrt(5) - 1) / 2 % 1;
  }
  setupDiffuseColor(builder) {
    builder.stack.addToStack(this.before_each);
    if (this.shows !== 'fabric') return super.setupDiffuseColor(builder);
    const shown = look_up(this.nodes, this, normalView, builder.geometry.hasAttribute(this.names[0]));
    if (this.vertexColors && builder.geometry.hasAttribute('color')) shown.tint = shown.tint.mul(vertexColor().rgb);
    if (builder.object.instanceColor) shown.tint = shown.tint.mul(instanceColor.rgb);
    const alpha = this.keeps_opacity ? min(shown.sum.a, 1) : float(1);
    if (this.keeps_opacity) alpha.lessThanEqual(this.alphaToCoverage ? float(0) : this.#threshold()).discard();
    diffuseColor.assign(vec4(0, 0, 0, this.alphaToCoverage ? alpha : float(1)));
    this.#shown = shown;
  }
  /** A number from 0 to 1 of a pixel and what lies there, so that one layer's is not another's. */
  #threshold() {
    const hash = (v) => fract(sin(dot(v, vec2(12.9898, 78.233))).mul(43758.5453));
    return fract(hash(floor(screenCoordinate.xy).add(fract(positionLocal.z.mul(97)))).add(this.hole_turn));
  }
  setupVariants(builder) {
    if (this.shows !== 'fabric') super.setupVariants(builder);
  }
  setupNormal(builder) {
    return this.shows === 'fabric' ? normalView : super.setupNormal(builder);
  }
  setupLighting(builder) {
    if (this.shows !== 'fabric') return super.setupLighting(builder);
    const {nodes} = this, shown = this.#shown, lights = this.lightsNode ?? builder.lightsNode;
    const is_lit = builder.renderer.lighting.enabled && lights.getScope().hasLights;
    const light = is_lit ? lightingContext(lights, new FabricLight(nodes, shown.normal), [], null, null) : vec3(0);
    const bright = dot(light, vec3(1 / 3)).toVar();
    if (this.is_lit_around) bright.addAssign(brightness_around(nodes, shown.normal, this.aoMap ? materialAO : float(1), this.has_vertex_light));
    emissive.assign(materialEmissive);
    return outgoing_light(nodes, shown, bright, builder.object.isInstancedMesh).mul(shown.tint).add(emissive);
  }
  customProgramCacheKey() {
    const {uuid, shows, names, keeps_opacity, is_lit_around, has_vertex_light} = this;
    return [uuid, shows, names[0], keeps_opacity, is_lit_around, has_vertex_light].join(' ');
  }
}
export const SelvedgeFabric = plugin_of(FabricMaterial);
export {use_memory, use_worker} from '../background.js';
export {cell_images} from './cell_images.js';
export {LoadedFabric} from './fabric.js';
export {plain_lay} from './fabric_material.js';
export {Surroundings} from './surroundings.js';

// Materials of three.js that show a fabric once it is loaded, and their fallback before that, and where it is broken: what its
// renderers have in common.
import {Color, Matrix3} from 'three';
import {CHART_ATTRIBUTES, cell_images} from './cell_images.js';
import {environment_in_mesh_axes, environment_uniforms, set_environment_uniforms} from './environment.js';
import {default_parts, part_uniforms, set_tint} from './garment_parts.js';
import {VERTEX_LIGHT} from './lights.js';
import {noise_of} from './noise.js';

/** The lay of a fabric on a surface, as KHR_texture_transform: of the material's reference. */
export const plain_lay = {uv_set: 0, offset: [0, 0], rotation: 0, scale: [1, 1]};

const zeros = Array(18).fill(0), no_noise = noise_of({keys: zeros, runs: zeros, numbers: zeros}, [zeros, zeros]);

function matrix_of({offset, rotation, scale}) {
  const c = Math.cos(rotation), s = Math.sin(rotation);
  return new Matrix3(c * scale[0], s * scale[1], offset[0], -s * scale[0], c * scale[1], offset[1], 0, 0, 1);
}

/** What a copy has of its own. */
const OWN = ['ready', 'garment', 'names', 'part_uniforms', 'fabric_uniforms', 'environment_uniforms', 'nodes'];

/**
 * A class of materials on a MeshPhysicalMaterial of one of three.js's renderers. Its own classes have
 *
 *   is_of_use           whether this version of three.js draws them
 *   atlas               webgl_atlas.js's or node_atlas.js's
 *   draw_environment    light_of()'s (environment.js)
 *   sorts_holes         whether what lies behind holes is mixed in, in order
 *   provokes_first(r)   whether a renderer takes flat attributes from a triangle's first corner
 */
export const fabric_material = (Base) => class extends Base {
  #settle;
  /**
   * fallback       a MeshStandardMaterial or MeshPhysicalMaterial, whose members the material takes
   * fabric         a LoadedFabric
   * lay            { uv_set, offset, rotation, scale }
   * keeps_opacity  whether the holes of the fabric are open: alphaMode MASK or BLEND
   * parts          what the garment brings: garment_parts.js
   */
  constructor({fallback = null, fabric = null, lay = plain_lay, keeps_opacity = false, parts = default_parts} = {}) {
    super();
    this.isFabricMaterial = true;
    /** Becomes what is shown, 'fabric' or 'fallback', once frames show the one or it is known that they never will. */
    this.ready = new Promise((settle) => this.#settle = settle);
    this.fabric = fabric;
    this.lay = lay;
    /** Metres of cloth in a unit of the texture coordinates, once another fabric has come. */
    this.metres = null;
    this.matrix = matrix_of(lay);
    this.keeps_opacity = keeps_opacity;
    this.parts = parts;
    this.part_uniforms = part_uniforms();
    /** The colour of the material when the fabric has its own; another one tints it. */
    this.own_color = new Color(1, 1, 1);
    this.fabric_uniforms = {
      fabric_transform: {value: this.matrix},
      cell_beyond: {value: 0},
      cell_albedo: {value: [1, 1, 1]},
      cell_brighter: {value: 2},
      cell_noise: {value: no_noise.texture},
      noise_places: {value: no_noise.places},
      noise_layers: {value: no_noise.layers},
      varied_numbers: {value: new Float32Array(16)},
    };
    /** The level that is shown everywhere; -1: by the size of a pixel. */
    this.level = -1;
    /** The garment of cell_images that was drawn last. */
    this.garment = null;
    this.names = CHART_ATTRIBUTES;
    this.around_uniforms = environment_uniforms();
    this.is_lit_around = this.has_vertex_light = false;
    /** Whether the fabric is to be shown where it can be; else the fallback. */
    this.shows_fabric = true;
    this.shows = 'fallback';
    this.make_nodes?.();
    if (fallback) this.#take(fallback);
  }
  #take(fallback) {
    this.copy_fallback(fallback);
    this.own_color.copy(this.color);
    // State that the fabric has otherwise.
    const {transparent, depthWrite, alphaTest, forceSinglePass} = this;
    this.of_fallback = {transparent, depthWrite, alphaTest, forceSinglePass};
  }
  /** The lay in which another repeat, in mm, lies as large as the one before; unchanged where a size is not known. */
  lay_of_repeat(mm) {
    const {rotation, scale} = this.lay, was = this.fabric?.mm_per_repeat;
    // Cloth that lies on its side has its courses along v.
    const turned = ([x, y]) => Math.round(rotation / (Math.PI / 2)) % 2 === 0 ? [x, y] : [y, x];
    this.metres ??= was && turned(was).map((size, k) => scale[k] * size / 1000);
    return this.metres && mm ? {...this.lay, scale: turned(mm).map((size, k) => 1000 * this.metres[k] / size)} : this.lay;
  }
  /** Takes another LoadedFabric, as large; `keeps`: what is shown stays until its images are there, or it is found not to have any. */
  set_fabric(fabric, {keeps = false} = {}) {
    const lay = this.lay_of_repeat(fabric?.mm_per_repeat);
    Object.assign(this, {fabric, lay, matrix: matrix_of(lay)});
    if (!keeps) this.garment = null;
    this.select_fabric_or_fallback();
    return this;
  }
  /** Takes another factor on the fabric alone, linear. */
  set_tint(tint) {
    this.parts = {...this.parts, tint};
  }
  /** Shows what is due now; before every drawing. */
  select_fabric_or_fallback() {
    const due = this.shows_fabric && this.garment?.state === 'shown' ? 'fabric' : 'fallback';
    if (due === 'fabric' || !this.is_of_use || !this.fabric || this.fabric.state === 'broken' || this.garment?.state === 'ended') this.#settle(due);
    if (due === this.shows) return;
    this.shows = due;
    if (due === 'fabric') {
      this.transparent = this.keeps_opacity && this.sorts_holes && !this.alphaToCoverage;
      this.depthWrite = this.forceSinglePass = true;
      // The fallback's picture has the mask, for shadow maps: the fabric's shader knows no such test.
      this.alphaTest = this.parts.mask ? this.of_fallback.alphaTest : 0;
    } else {
      Object.assign(this, this.of_fallback);
    }
    this.needsUpdate = true;
  }
  /** Shows what is due once a garment has its attributes. */
  take_garment() {
    this.select_fabric_or_fallback();
  }
  /** Lights the fabric from all around; whether anything does. */
  #update_around(renderer, scene, camera, geometry) {
    const lit = set_environment_uniforms(this.around_uniforms, this, scene, renderer, camera, this.draw_environment), has_vertex_light = lit && VERTEX_LIGHT[0] in geometry.attributes;
    if (this.shows === 'fabric' && (lit !== this.is_lit_around || has_vertex_light !== this.has_vertex_light))
      this.needsUpdate = true;
    this.is_lit_around = lit;
    this.has_vertex_light = has_vertex_light;
    return lit;
  }
  /** Makes an object ready to be drawn. */
  prepare(renderer, scene, camera, geometry, object) {
    set_tint(this.part_uniforms, this.parts, this.color, this.own_color);
    const lit = this.#update_around(renderer, scene, camera, geometry);
    const {state} = this.is_of_use && this.shows_fabric && this.fabric || {};
    if (state === 'loading') cell_images.await_fabric(object, this.fabric);
    if (state === 'ready') {
      const garment = cell_images.garment(object, geometry, this, this.provokes_first(renderer));
      if (garment) {
        cell_images.look(
          garment, this.atlas, renderer, scene, camera, object, this.level,
          (inverse) => lit ? environment_in_mesh_axes(this.around_uniforms, inverse) : {around: null, lamps: []});
        if (this.garment?.state !== 'shown' || ['shown', 'ended'].includes(garment.state)) this.#show(garment);
      }
    }
    this.select_fabric_or_fallback();
  }
  #show(garment) {
    if (garment.names[0] !== this.names[0]) this.needsUpdate = true;
    Object.assign(this, {garment, names: garment.names});
    const {fabric_uniforms: uniforms, fabric} = this, {has_yarn, variation, albedo, fallback, edition} = fabric;
    uniforms.fabric_transform.value = new Matrix3().makeScale(...fabric.tiles).multiply(this.matrix);
    uniforms.cell_beyond.value = garment.beyond;
    uniforms.cell_albedo.value = fallback.albedo || edition > 0 ? albedo : this.own_color.toArray();
    uniforms.cell_brighter.value = has_yarn ? 2 : 8;
    const {texture, places, layers} = fabric.noise();
    uniforms.cell_noise.value = texture;
    uniforms.noise_places.value = places;
    uniforms.noise_layers.value = layers;
    uniforms.varied_numbers.value = variation.numbers;
  }
  copy(source) {
    const own = OWN.map((name) => [name, this[name]]);
    super.copy(source);
    Object.assign(this, Object.fromEntries(own));
    if (!source.isFabricMaterial) return this;
    for (const name of ['fabric', 'lay', 'metres', 'matrix', 'keeps_opacity', 'parts', 'shows_fabric', 'level']) this[name] = source[name];
    this.of_fallback = {...source.of_fallback};
    this.own_color.copy(source.own_color);
    Object.assign(this, this.of_fallback, {shows: 'fallback'});
    for (const [name, uniform] of Object.entries(source.fabric_uniforms)) {
      const {value} = uniform;
      this.fabric_uniforms[name].value = value?.isMatrix3 ? value.clone() : value;
    }
    return this;
  }
};

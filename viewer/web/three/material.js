// A material of three.js's WebGLRenderer that shows a fabric.
import {MeshPhysicalMaterial, MeshStandardMaterial, REVISION} from 'three';
import {cell_images} from './cell_images.js';
import {fabric_material} from './fabric_material.js';
import {parts_cache_key, set_kept_textures} from './garment_parts.js';
import {ALREADY_DRAWN, draw_once, draw_sorted, sort_triangles} from './order.js';
import {fragment_shader, vertex_shader} from './shader.js';
import {webgl_atlas} from './webgl_atlas.js';
import {picture_drawn} from './webgl_environment.js';

const revision = Number.parseInt(REVISION, 10);
/** Two versions of three.js have no Material.onBeforeRender. */
const is_of_use = revision >= 160 && revision !== 166 && revision !== 167;
if (!is_of_use)
  console.warn(`selvedge: GRAPHICS_UNAVAILABLE: three.js 0.${revision} cannot draw fabrics, 0.160 to 0.165 and those from 0.168 on can; the fallback is shown`);

export class FabricMaterial extends fabric_material(MeshPhysicalMaterial) {
  get is_of_use() { return is_of_use; }
  get atlas() { return webgl_atlas; }
  get draw_environment() { return picture_drawn; }
  get sorts_holes() { return true; }
  provokes_first() { return false; }
  copy_fallback(fallback) {
    if (fallback.isMeshPhysicalMaterial)
      MeshPhysicalMaterial.prototype.copy.call(this, fallback);
    else if (fallback.isMeshStandardMaterial)
      MeshStandardMaterial.prototype.copy.call(this, fallback);
    this.defines = {STANDARD: '', PHYSICAL: ''};
  }
  onBeforeRender(renderer, scene, camera, geometry, object, group) {
    if (group === ALREADY_DRAWN) return;
    this.prepare(renderer, scene, camera, geometry, object);
    if (this.shows !== 'fabric') return;
    if (this.transparent && this.forceSinglePass) draw_sorted(renderer, scene, camera, object, geometry, this);
    if (!this.transparent && sort_triangles(object, geometry, camera, this)) draw_once(object, geometry, Infinity);
  }
  prepare(renderer, scene, camera, geometry, object) {
    super.prepare(renderer, scene, camera, geometry, object);
    // three.js draws what it takes for one layer twice, back sides first.
    if (this.shows === 'fabric' && this.transparent) this.forceSinglePass = sort_triangles(object, geometry, camera, this);
  }
  onBeforeCompile(shader) {
    // Also for the fallback: three.js keeps the uniforms of the program that it has compiled last.
    set_kept_textures(this.part_uniforms, this.parts);
    Object.assign(
      shader.uniforms, this.fabric_uniforms, this.around_uniforms, this.part_uniforms, cell_images.uniforms, webgl_atlas.uniforms);
    if (this.shows !== 'fabric') return;
    shader.vertexShader = vertex_shader(shader.vertexShader, this.lay.uv_set, this.names, this.has_vertex_light, this.parts);
    shader.fragmentShader = fragment_shader(this, shader.instancing);
  }
  customProgramCacheKey() {
    if (this.shows !== 'fabric') return 'selvedge fallback';
    const {keeps_opacity, is_lit_around, has_vertex_light, parts} = this;
    return ['selvedge', this.lay.uv_set, this.names[0], keeps_opacity, is_lit_around, has_vertex_light, parts_cache_key(parts)].join(' ');
  }
}

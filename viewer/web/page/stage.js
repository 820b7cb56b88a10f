// Garments, swatches or both, as the page shows them, and their clothes: a fabric of the menu or their own, a variant and a tint.
import {Box3, Color, DoubleSide, Group, Mesh, PlaneGeometry} from 'three';
import {FabricMaterial, plain_lay} from '../three/index.js';

/** Metres of cloth on a swatch, of its side on the stage, and from one to the next. */
const SWATCH = 0.06, SIDE = 0.5, STEP = 0.54;
/** Cloth whose size no file states: mm of a repeat. */
const REPEAT = [10, 10];
/** Luminance of the darkest cloth, and the largest tint. */
const DARKEST = 0.03, MAX_TINT = 16;
const VARIANTS = 'KHR_materials_variants', AS_IT_IS = '#ffffff';
const by_id = (id) => document.getElementById(id);
const variants_of = ({parser}) => (parser.json.extensions?.[VARIANTS]?.variants ?? []).map(({name}) => name);

function fill(menu, first, options) {
  by_id(`of_${menu}`).hidden = options.length === 0;
  by_id(menu).replaceChildren(new Option(first, ''), ...options);
}
/** The factor on a cloth of mean `albedo` that gives it a colour, as tint_towards() of `dress` has it. */
function tint_towards([r, g, b], albedo) {
  const grey = Math.max(DARKEST - 0.2126 * r - 0.7152 * g - 0.0722 * b, 0);
  return [r, g, b].map((c, k) => Math.min((c + grey) / Math.max(albedo[k], 1e-6), MAX_TINT));
}
/** The lay of a repeat (mm) on a surface by the length (m) of its unit of texture coordinates. */
export const lay_for_size = (metres, mm) => ({...plain_lay, scale: metres.map((size, k) => 1000 * size / (mm ?? REPEAT)[k])});

export class Stage {
  /** What stands on the stage. */
  group = new Group();
  /** { scene, parser, dataset, floor } each. */
  garments = [];
  /** Fabrics of the menu. */
  fabrics = [];
  /** The fabric, and its linear colour, that all wear in place of their own; null: none. */
  cloth = null;
  tint_colour = null;
  shown_view = 'garment';
  swatches = new Group();
  #own = new WeakMap();
  #plane = new PlaneGeometry(SIDE, SIDE);

  /** `view`: { materials, restage(moves), moved() } of the page. */
  constructor(view) {
    this.view = view;
    by_id('views').addEventListener('click', ({target: {value}}) => value && this.show_view(value));
    by_id('variant').addEventListener('change', ({target: {value}}) => this.show_variant(value));
    by_id('fabric').addEventListener('change', async ({target: {value}}) => {
      this.cloth = this.fabrics[value] ?? null;
      await this.cloth?.settled;
      this.show_view();
    });
    by_id('tint').addEventListener('input', ({target: {value}}) => {
      this.tint_colour = value === AS_IT_IS ? null : new Color(value).toArray();
      this.put_on_cloth();
    });
  }
  /** Fills the menus, and puts on the stage what there is. */
  show_all() {
    fill('fabric', this.garments.length > 0 ? 'its own' : 'all', this.fabrics.map(({name}, k) => new Option(name, k)));
    fill('variant', 'as made', [...new Set(this.garments.flatMap(variants_of))].map((name) => new Option(name)));
    by_id('views').hidden = this.garments.length === 0;
    for (const {scene} of this.garments) scene.traverse((mesh) => mesh.isMesh && (mesh.userData.made ??= mesh.material));
    this.show_view(this.garments.length > 0 ? this.shown_view : 'swatch');
  }
  #own_of(material) {
    const {fabric, parts: {tint}, keeps_opacity, color} = material, known = this.#own.get(material);
    return known ?? this.#own.set(material, {fabric, tint, keeps_opacity, color: color.clone()}).get(material);
  }
  #lay_out() {
    const [first] = this.garments, fabrics = new Set(this.cloth ? [this.cloth] : first ? [] : this.fabrics);
    if (!this.cloth) for (const {scene} of this.garments) scene.traverse(({material}) => material?.fabric && fabrics.add(this.#own_of(material).fabric));
    const columns = Math.ceil(Math.sqrt(fabrics.size)), count = this.swatches.children.length;
    for (const [k, fabric] of [...fabrics].entries()) {
      const lay = lay_for_size([SWATCH, SWATCH], fabric.mm_per_repeat);
      const mesh = this.swatches.children[k] ?? new Mesh(this.#plane, new FabricMaterial({fabric, lay, keeps_opacity: fabric.has_holes}));
      mesh.material.side = DoubleSide;
      mesh.position.set(k % columns * STEP, -Math.floor(k / columns) * STEP, 0);
      this.#own_of(mesh.material).fabric = fabric;
      this.swatches.add(mesh);
    }
    this.swatches.remove(...this.swatches.children.slice(fabrics.size));
    if (first) new Box3().setFromObject(first.scene).getCenter(this.swatches.position).setX(0);
    return count !== fabrics.size;
  }
  /** Puts garments, swatches or both on the stage. */
  show_view(what = this.shown_view) {
    const {group} = this, lies_otherwise = what !== 'garment' && this.#lay_out(), moves = lies_otherwise || what !== this.shown_view || group.children.length === 0;
    this.shown_view = what;
    group.clear();
    if (what !== 'swatch') group.add(...this.garments.map(({scene}) => scene));
    if (what !== 'garment') group.add(this.swatches);
    for (const button of by_id('views').children) button.ariaPressed = String(button.value === what);
    this.view.restage(moves);
    this.put_on_cloth();
  }
  async show_variant(name) {
    for (const garment of this.garments) {
      const number = variants_of(garment).indexOf(name), meshes = [];
      garment.scene.traverse((mesh) => mesh.userData.gltfExtensions?.[VARIANTS] && meshes.push(mesh));
      for (const mesh of meshes) {
        const {material} = mesh.userData.gltfExtensions[VARIANTS].mappings.find(({variants}) => variants.includes(number)) ?? {};
        mesh.material = material === undefined ? mesh.userData.made : await garment.parser.getDependency('material', material);
        if (material !== undefined) garment.parser.assignFinalMaterial(mesh);
        await mesh.material.fabric?.settled;
      }
    }
    this.show_view();
  }
  put_on_cloth() {
    for (const material of this.view.materials) {
      const own = this.#own_of(material), fabric = this.cloth ?? own.fabric;
      if (material.fabric !== fabric) material.set_fabric(fabric);
      this.fit_material(material, fabric);
    }
    this.view.moved();
  }
  /** Lets a material have the holes and the colour of its fabric. */
  fit_material(material, fabric) {
    const own = this.#own_of(material), colour = this.tint_colour ?? material.userData.print;
    const keeps_opacity = fabric === own.fabric && fabric.edition === 0 ? own.keeps_opacity : fabric.has_holes || Boolean(material.parts.mask);
    // A material whose holes open or close is set up again.
    if (material.keeps_opacity !== keeps_opacity) Object.assign(material, {keeps_opacity, shows: 'another'});
    material.set_tint(colour ? tint_towards(colour, fabric.albedo) : own.tint);
    const [r, g, b] = material.parts.tint.map((c, k) => c / (own.tint[k] || 1));
    material.own_color.copy(material.color.setRGB(own.color.r * r, own.color.g * g, own.color.b * b));
  }
}

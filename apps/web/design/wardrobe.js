// The garment that the page shows, and a flat swatch: which materials wear the cloth, and how it lies on them.
import {Box3, DoubleSide, Group, Mesh, PlaneGeometry, Vector3} from 'three';
import {FabricMaterial} from 'selvedge/three/index.js';
import {load_parts} from 'selvedge/three/garment_parts.js';
import {dressed, fabric_of, parts_of, print_of, read_glb, tint_towards} from './garment.mjs';
import {picture_of, text_of} from './fabric_file.js';

const LARGEST = 128e6, NO_CLOTH = /skin|hair|eye|lash|brow|teeth|tooth|tongue|head|face|hand|body|nail|button|zip|buckle|metal|sole|glass|lens/i;
/** Cloth whose texture coordinates are missing or stretched more than so many times one way on so much of its area is laid flat. */
const USELESS = 4, UNUSABLE = 0.1;
/** Metres of cloth on the swatch, and of its side on the stage. */
const SWATCH = 0.06, SIDE = 0.5;

function median(values) {
  values.sort(([a], [b]) => a - b);
  let half = values.reduce((sum, [, area]) => sum + area, 0) / 2;
  return values.find(([, area]) => (half -= area) <= 0)?.[0] ?? 0;
}
/** { metres, unusable }: metres of cloth in a unit of the texture coordinates of meshes, as measure_uv() of `dress` has them. */
function measure(meshes) {
  const samples = [], p = [0, 1, 2].map(() => new Vector3()), u = new Vector3(), v = new Vector3(), normal = new Vector3();
  let without = 0, all = 0;
  for (const {geometry: {index, attributes: {position, uv}}, matrixWorld} of meshes) {
    const count = index?.count ?? position.count;
    for (let t = 0; t + 2 < count; t += 3) {
      const corners = [t, t + 1, t + 2].map((k) => index ? index.getX(k) : k);
      corners.forEach((k, c) => p[c].fromBufferAttribute(position, k).applyMatrix4(matrixWorld));
      const e1 = p[1].sub(p[0]), e2 = p[2].sub(p[0]), area = normal.crossVectors(e1, e2).length();
      if (!(area > 0)) continue;
      const [a, b, c] = corners, at = (k) => uv ? [uv.getX(k), uv.getY(k)] : [0, 0], [s, r] = [at(b), at(c)].map((x) => x.map((y, i) => y - at(a)[i]));
      const determinant = s[0] * r[1] - s[1] * r[0];
      u.copy(e1).multiplyScalar(r[1]).addScaledVector(e2, -s[1]).divideScalar(determinant);
      v.copy(e2).multiplyScalar(s[0]).addScaledVector(e1, -r[0]).divideScalar(determinant);
      all += area;
      if (Number.isFinite(u.length() + v.length())) samples.push([u.length(), v.length(), u.dot(v), area]);
      else without += area;
    }
  }
  const metres = [0, 1].map((c) => median(samples.map((sample) => [sample[c], sample[3]])));
  for (const [along_u, along_v, dot, area] of samples) {
    const x = (along_u / metres[0]) ** 2, y = (along_v / metres[1]) ** 2, root = Math.hypot(x - y, 2 * dot / metres[0] / metres[1]);
    if (!(Math.max(Math.sqrt((x + y + root) / 2), 1 / Math.sqrt(Math.max(0, (x + y - root) / 2))) <= USELESS)) without += area;
  }
  return {metres, unusable: without / all};
}

export class Wardrobe {
  /** `view`: the page's. */
  constructor(view) {
    this.view = view;
    const [[scene, element]] = view.elements;
    this.name = 'garment';
    /** Of each material that can wear the cloth: { index, name, lay, metres, wears, own, material, meshes }. */
    this.parts = this.#parts_of(scene, element.associations).filter(({material}) => material.fabric?.state === 'ready');
    for (const part of this.parts) this.#take_lay(part, part.material.fabric.mm_per_repeat);
    this.scene = scene;
    this.glb = null;
    this.element = element;
    this.shows = 'garment';
    this.swatch = this.#make_swatch();
  }
  #parts_of(scene, associations) {
    const parts = new Map();
    scene.updateMatrixWorld(true);
    scene.traverse((mesh) => {
      const index = mesh.isMesh ? associations.get(mesh.material)?.materials : undefined, material = mesh.material;
      if (index === undefined) return;
      const known = parts.get(material) ?? {index, name: material.name || `#${index}`, own: material, material, meshes: [], wears: true};
      known.meshes.push(mesh);
      parts.set(material, known);
    });
    return [...parts.values()];
  }
  /** How a cloth of so many mm lies on a part that wears it. */
  #take_lay(part, mm) {
    part.lay = part.material.lay;
    part.metres = part.lay.scale.map((repeats, k) => repeats * mm[this.#side(part.lay, k)] / 1000);
  }
  /** Cloth that lies on its side has its courses along v. */
  #side = ({rotation}, k) => Math.round(rotation / (Math.PI / 2)) % 2 === 0 ? k : 1 - k;
  lay_for({lay, metres}, mm) {
    return {...lay, scale: metres.map((size, k) => 1000 * size / mm[this.#side(lay, k)])};
  }
  #make_swatch() {
    const material = new FabricMaterial({keeps_opacity: true}), mesh = new Mesh(new PlaneGeometry(SIDE, SIDE), material);
    material.side = DoubleSide;
    this.of_swatch = {lay: material.lay, metres: [SWATCH, SWATCH], material, wears: true};
    return new Group().add(mesh);
  }
  /** All that wears the cloth and is on the stage. */
  worn() {
    const garment = this.shows === 'swatch' ? [] : this.parts.filter(({wears}) => wears);
    return this.shows === 'garment' ? garment : [...garment, this.of_swatch];
  }
  /** Shows the garment, the swatch, or both; `fabric`: the cloth. */
  show(what, fabric) {
    this.shows = what;
    this.view.stage.clear();
    if (what !== 'swatch') this.view.stage.add(this.scene);
    if (what !== 'garment') {
      new Box3().setFromObject(this.scene).getCenter(this.swatch.position).setX(0);
      this.view.stage.add(this.swatch);
    }
    for (const part of this.worn()) part.material.set_fabric(fabric, {lay: this.lay_for(part, fabric.mm_per_repeat), keeps: true});
    this.view.restage();
  }
  /** Whether a part wears the cloth; show() follows. */
  set_wears(part, wears) {
    part.wears = wears;
    for (const mesh of part.meshes) mesh.material = wears ? part.material : part.own;
    if (!wears) this.view.reflect();
  }
  /**
   * Takes a garment from the bytes of a .glb file, in a cloth of mean `albedo`; remarks, lines. Throws an Error of one line, and the garment
   * before stays.
   */
  async take(file, fabric, albedo) {
    const advice = `selvedge dress '${file.name}' cloth.fabric.exr --all -o dressed.glb`;
    if (file.size > LARGEST) throw new Error(`has ${Math.round(file.size / 1e6)} MB, this page takes ${LARGEST / 1e6} MB: ${advice} dresses it`);
    const bytes = new Uint8Array(await file.arrayBuffer()), glb = read_glb(bytes), remarks = [];
    const {scene, parser} = await this.view.loader.parseAsync(bytes.buffer, '').catch(({message}) => {
      throw new Error(`${message.replace('THREE.GLTFLoader: ', '')} (${advice} may read it)`);
    });
    const parts = this.#parts_of(scene, parser.associations);
    for (const part of parts) {
      const {metres, unusable} = measure(part.meshes), is_dressed = part.material.isFabricMaterial, worn = is_dressed && fabric_of(glb, part.index);
      part.is_usable = is_dressed || (unusable <= UNUSABLE && metres.every((size) => size > 0));
      part.wears = part.is_usable && (is_dressed || parts.length === 1 || !NO_CLOTH.test(part.name));
      if (!part.is_usable) {
        remarks.push(`${part.name} needs new texture coordinates: ${advice} makes them`);
        continue;
      }
      if (!is_dressed) {
        const more = await load_parts(parser, parts_of(glb.json.materials[part.index], albedo));
        part.print = print_of(glb.json.materials[part.index]);
        part.material = new FabricMaterial({fallback: part.own, fabric, keeps_opacity: true, parts: more});
        part.material.side = DoubleSide;
        if (part.wears) part.meshes.forEach((mesh) => mesh.material = part.material);
      }
      Object.assign(part, {lay: part.material.lay, metres});
      const mm = worn && text_of(worn.bytes)?.mmPerRepeat;
      if (mm) this.#take_lay(part, mm);
    }
    const wearable = parts.filter((part) => part.is_usable);
    if (!wearable.some(({wears}) => wears)) throw new Error(remarks[0] ?? 'has no material that can wear cloth');
    this.scene.traverse(({geometry}) => geometry?.dispose());
    Object.assign(this, {scene, glb, parts: wearable, name: file.name.replace(/\.glb$/i, '')});
    this.show(this.shows === 'swatch' ? 'both' : this.shows, fabric);
    if (!parts.every(({wears}) => wears)) this.view.reflect();
    return remarks;
  }
  /** Lets prints have their colours on a cloth of mean `albedo`. */
  tint(albedo) {
    for (const {print, material: {parts, part_uniforms: {kept_tint}}} of this.parts.filter(({print}) => print))
      kept_tint.value.fromArray(parts.tint = tint_towards(print, albedo));
  }
  /** The bytes of the garment in a cloth, a .glb file. */
  async save(bytes, name, mm) {
    this.glb ??= read_glb(new Uint8Array(await this.view.bytes_of(this.element)));
    const lays = new Map(this.parts.filter(({wears}) => wears).map((part) => [part.index, this.lay_for(part, mm)]));
    return dressed(this.glb, {bytes, name, text: text_of(bytes), picture: await picture_of(bytes)}, lays);
  }
  /** The bytes of the fabric that the page began with. */
  async first_fabric() {
    this.glb ??= read_glb(new Uint8Array(await this.view.bytes_of(this.element)));
    return fabric_of(this.glb, this.parts[0].index)?.bytes ?? null;
  }
}

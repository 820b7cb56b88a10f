// The garment that the page shows: which of its materials wear the cloth, and how it lies on them.
import {DoubleSide, Vector3} from 'three';
import {lay_for_size} from 'selvedge/page/stage.js';
import {FabricMaterial, LoadedFabric} from 'selvedge/three/index.js';
import {load_parts} from 'selvedge/three/garment_parts.js';
import {EXTENSION, dress_garment, embedded_fabric, kept_members, print_colour, read_glb} from './garment.mjs';
import {preview_png} from './fabric_file.js';

const LARGEST = 128e6, NO_CLOTH = /skin|hair|eye|lash|brow|teeth|tooth|tongue|head|face|hand|body|nail|button|zip|buckle|metal|sole|glass|lens/i;
/** Cloth whose texture coordinates are missing or stretched more than this, one way against the other, on more than this fraction of its area is laid flat. */
const USELESS = 4, UNUSABLE = 0.1;

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

export class GarmentEditor {
  name = 'garment';
  /** By each material as it was made: { index, name, wears, own, material, meshes }; `material` can wear the cloth. */
  #known = new Map();
  #glb = null;
  /** `view`: the page's. */
  constructor(view) {
    this.view = view;
    this.stage = view.stage;
    this.stage.accepts_cloth = (material) => this.parts.every((part) => part.material !== material || part.wears);
  }
  /** Parts of a garment as it is on the stage, which wear the cloth or may, and remarks, lines. */
  async fit_cloth({scene, parser}, cloth, advice = 'selvedge dress') {
    const parts = new Map(), remarks = [];
    scene.updateMatrixWorld(true);
    scene.traverse((mesh) => {
      const own = this.#known.get(mesh.material)?.own ?? mesh.material, index = mesh.isMesh ? parser.associations.get(own)?.materials : undefined;
      if (index === undefined) return;
      const part = this.#known.get(own) ?? {index, name: own.name || `#${index}`, own, material: own};
      this.#known.set(own, part);
      if (!parts.has(own)) part.meshes = [];
      part.meshes.push(mesh);
      parts.set(own, part);
    });
    for (const part of parts.values()) {
      const {own, meshes} = part, {metres, unusable} = measure(meshes), is_dressed = own.isFabricMaterial;
      await own.fabric?.settled;
      part.is_usable = is_dressed || (unusable <= UNUSABLE && metres.every((size) => size > 0));
      part.wears ??= part.is_usable && (is_dressed || parts.size === 1 || !NO_CLOTH.test(part.name));
      if (!part.is_usable) remarks.push(`${part.name} needs new texture coordinates: ${advice} makes them`);
      else if (is_dressed && !own.fabric?.mm_per_repeat) own.metres ??= metres;
      else if (part.material === own && !is_dressed) {
        const definition = parser.json.materials[part.index], more = await load_parts(parser, kept_members(definition, cloth.albedo));
        part.material = new FabricMaterial({fallback: own, fabric: cloth, lay: lay_for_size(metres, cloth.mm_per_repeat), keeps_opacity: cloth.has_holes, parts: more});
        part.material.userData.print = print_colour(definition);
        part.material.side = DoubleSide;
        this.#known.set(part.material, part);
      }
      this.#put_on(part);
    }
    const usable = [...parts.values()].filter((part) => part.is_usable);
    if (!usable.some(({wears}) => wears)) throw new Error(remarks[0] ?? 'has no material that can wear cloth');
    this.parts = usable;
    if ([...parts.values()].some(({wears}) => !wears)) this.view.reflect();
    return remarks;
  }
  #put_on = ({wears, meshes, material, own}) => meshes.forEach((mesh) => mesh.material = wears ? material : own);
  /** Whether a part wears the cloth. */
  set_wears(part, wears) {
    part.wears = wears;
    this.#put_on(part);
    if (!wears) this.view.reflect();
    this.stage.show_view();
  }
  /** Takes a garment from a .glb file in the cloth; remarks, lines. Throws an Error of one line, and the garment before stays. */
  async open_file(file, cloth) {
    const advice = `selvedge dress '${file.name}' cloth.fabric.exr --all -o dressed.glb`;
    if (file.size > LARGEST) throw new Error(`has ${Math.round(file.size / 1e6)} MB, this page takes ${LARGEST / 1e6} MB: ${advice} dresses it`);
    const bytes = new Uint8Array(await file.arrayBuffer()), glb = read_glb(bytes);
    const {scene, parser} = await this.view.loader.parseAsync(bytes.buffer, '').catch(({message}) => {
      throw new Error(`${message.replace('THREE.GLTFLoader: ', '')} (${advice} may read it)`);
    });
    const remarks = await this.fit_cloth({scene, parser}, cloth, advice), [before] = this.stage.garments.splice(0, 1, {scene, parser, dataset: {}});
    before.scene.traverse(({geometry}) => geometry?.dispose());
    this.#glb = glb;
    this.name = file.name.replace(/\.glb$/i, '');
    if (this.stage.shown_view === 'swatch') this.stage.shown_view = 'both';
    this.stage.show_all();
    return remarks;
  }
  #read = async () => this.#glb ??= read_glb(new Uint8Array(await this.view.bytes_of(this.stage.garments[0].element)));
  /** The bytes of the garment in a cloth, a .glb file. */
  async dressed_glb(bytes, name) {
    const fabric = new LoadedFabric(bytes.slice().buffer, name), [{parser}] = this.stage.garments;
    await fabric.settled;
    const {fallback, has_holes, mm_per_repeat: mm} = fabric, worn = new Map(this.parts.map(({index, material, wears}) => [index, wears && material]));
    fabric.dispose();
    // Variants that are not seen wear it, too.
    for (const [index, {extensions}] of parser.json.materials.entries())
      if (extensions?.[EXTENSION] && !worn.has(index)) worn.set(index, await parser.getDependency('material', index));
    const lays = new Map();
    for (const [index, material] of worn) {
      await material?.fabric?.settled;
      if (material.isFabricMaterial) lays.set(index, {...material.lay_of_repeat(mm), tint: this.stage.tint_colour && material.parts.tint});
    }
    return dress_garment(await this.#read(), {bytes, name, fallback, has_holes, picture: await preview_png(bytes, fabric)}, lays);
  }
  /** The bytes of the fabric that the page began with. */
  first_fabric = async () => embedded_fabric(await this.#read(), this.parts[0].index)?.bytes ?? null;
}

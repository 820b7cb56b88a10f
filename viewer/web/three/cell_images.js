// Cell images of the fabrics on a page, as its worker makes them: an atlas of tiles, the table by which the shader finds a
// place's tile, and what each tile is of. One for all scenes, and for any number of renderers.
import {
  BufferAttribute, BufferGeometry, DataTexture, EventDispatcher, Matrix4, REVISION, RGBAIntegerFormat, RedIntegerFormat, UnsignedIntType, Vector2,
  Vector3, Vector4
} from 'three';
import {ask_worker, add_listener, send_to_worker} from '../background.js';
import {frame_of, lights_of, numbers_of_lamp} from './lights.js';

/** Texels of a row of the atlas (cells/atlas.h), of the table and of the tiles. */
export const ATLAS_WIDTH = 2048;
/** Attributes of a mesh, by which a place finds its entry of the table (cells/module.cpp). */
export const CHART_ATTRIBUTES = ['fabric_chart', 'fabric_chart_size'];

function texture_of(data, format) {
  const channels = format === RedIntegerFormat ? 1 : 4, texture = new DataTexture(data, ATLAS_WIDTH, data.length / channels / ATLAS_WIDTH, format, UnsignedIntType);
  // three.js 0.160 and 0.161 have no name for it; WebGPU has another one.
  if (Number.parseInt(REVISION, 10) < 162) texture.internalFormat = channels === 1 ? 'R32UI' : 'RGBA32UI';
  texture.needsUpdate = true;
  return texture;
}
/** Coordinates beyond are refused, m or repeats. */
const FARTHEST = 1e9;
/** ms after which a garment that a camera has not seen is another camera's. */
const CAMERAS = 500;
/** ms for which an object without a geometry of its own may be waited for. */
const WAITING = 1000;
/** ms between the shapes of a skin that the worker makes. */
const POSE = 150;

/** A geometry with the same attributes, but for its fabric's. */
function own_geometry(geometry) {
  const own = new BufferGeometry();
  own.copy({...geometry, index: null, attributes: {}, morphAttributes: {}});
  Object.assign(own, {index: geometry.index?.clone() ?? null, morphAttributes: geometry.morphAttributes});
  for (const [name, attribute] of Object.entries(geometry.attributes))
    if (!name.startsWith(CHART_ATTRIBUTES[0])) own.setAttribute(name, attribute);
  return own;
}

/** The numbers of an attribute, one after the other. */
function numbers_of(attribute, size, Numbers = Float32Array) {
  const {array, count, isInterleavedBufferAttribute, normalized, itemSize} = attribute;
  if (array instanceof Numbers && itemSize === size && !normalized && !isInterleavedBufferAttribute) return array;
  return Numbers.from({length: size * count}, (_, i) => attribute.getComponent(Math.floor(i / size), i % size));
}
/** How skin and morphs move a mesh, for posed() (pose.js); null where none do. */
function moves_of({isSkinnedMesh, morphTargetInfluences}, {attributes: {skinIndex, skinWeight}, morphAttributes, morphTargetsRelative}) {
  if (!isSkinnedMesh && !morphTargetInfluences?.length) return null;
  const targets = ['position', 'normal'].map((name) => (morphAttributes[name] ?? []).map((target) => numbers_of(target, 3)));
  return {
    targets, is_relative: morphTargetsRelative, joints: isSkinnedMesh ? numbers_of(skinIndex, 4, Uint16Array) : null,
    weights: isSkinnedMesh ? numbers_of(skinWeight, 4) : null
  };
}

const refused = new WeakSet();
/** Says once why a mesh shows the fallback. */
function refuse(object, why) {
  if (!refused.has(object)) console.warn(`selvedge: ${object.name || 'a mesh without a name'}: ${why}; the fallback is shown`);
  refused.add(object);
}

const inverse = new Matrix4(), of_instance = new Matrix4(), one_instance = new Matrix4(), of_bone = new Matrix4(), place = new Vector3(), other = new Vector3(), viewport = new Vector4();

/** Turns `matrix` into the matrix of the instance in sight of a camera that is nearest to it. */
function find_nearest(matrix, object, camera) {
  const center = object.geometry.boundingSphere?.center ?? other.set(0, 0, 0), {x, y, z} = center;
  let nearest = Infinity;
  for (let i = 0; i < object.count; ++i) {
    object.getMatrixAt(i, one_instance);
    if (one_instance.determinant() === 0) continue;
    place.set(x, y, z).applyMatrix4(one_instance).applyMatrix4(object.matrixWorld).applyMatrix4(camera.matrixWorldInverse);
    const is_behind = place.z > 0, distance = place.length();
    place.applyMatrix4(camera.projectionMatrix);
    const rank = distance + (is_behind || Math.max(Math.abs(place.x), Math.abs(place.y)) > 1 ? FARTHEST : 0);
    if (rank >= nearest) continue;
    nearest = rank;
    matrix.copy(one_instance);
  }
}

/** A camera as the module has it, in the axes of a mesh. */
function numbers_of_camera(camera, scale) {
  const {elements: p} = camera.projectionMatrix, perspective = p[11] === -1, unit = perspective ? 1 : scale;
  const axes = [0, 1, 2].map((k) => place.setFromMatrixColumn(camera.matrixWorld, k).transformDirection(inverse).toArray());
  const centre = perspective ? [p[8] / p[0], p[9] / p[5]] : [-p[12] / p[0], -p[13] / p[5]];
  // The module's axes are right-handed: it sees a mirrored mesh in a mirror.
  if (inverse.determinant() < 0) {
    axes[0] = axes[0].map((x) => -x);
    centre[0] = -centre[0];
  }
  return [
    perspective ? 0 : 1, ...place.setFromMatrixPosition(camera.matrixWorld).applyMatrix4(inverse).toArray(), ...axes[0],
    ...axes[1], ...axes[2], centre[0] / unit, centre[1] / unit, 1 / p[0] / unit, 1 / p[5] / unit, camera.near / scale,
    camera.far / scale, Math.max(viewport.z, 1), Math.max(viewport.w, 1)
  ];
}

class CellImages extends EventDispatcher {
  #garments = new WeakMap();
  #of_number = new Map();
  /** { renderer, atlas, handle }: a WeakRef, how the renderer takes tiles, and the atlas as its graphics have it. */
  #renderers = [];
  #has_uploads = false;
  #rows = 0;
  /** Objects that are to have a geometry of their own, until when; and how many garments the worker does not know yet. */
  #waiting = new Map();
  #asked = 0;
  #views = 0;
  constructor() {
    super();
    /** Pixels of a frame along a side of what images are to be as fine as. */
    this.supersample = 1;
    this.uniforms = {
      // WebGPU has no textures of numbers of 16 bits.
      cell_table: {value: texture_of(new Uint32Array(ATLAS_WIDTH), RedIntegerFormat)},
      cell_tiles: {value: texture_of(new Uint32Array(4 * ATLAS_WIDTH), RGBAIntegerFormat)},
    };
    add_listener((message) => this.#take(message));
  }

  /** Lets nothing be at rest until an object is drawn in a fabric that is loading, for which a frame is asked then. */
  await_fabric(object, fabric) {
    if (this.#waiting.get(object) === Infinity) return;
    this.#waiting.set(object, Infinity);
    fabric.settled.then(() => {
      if (fabric.state === 'ready') this.#waiting.set(object, performance.now() + WAITING);
      else this.#waiting.delete(object);
      this.#tell();
    });
  }
  /** Lets nothing be at rest until a promise is settled, and asks for a frame then. */
  wait_for(promise) {
    ++this.#asked;
    promise.finally(() => {
      --this.#asked;
      this.#tell();
    });
  }
  /**
   * { state, beyond, names } of an object in the fabric of its material: 'asked', 'waiting' for its first images, 'shown', or
   * 'ended'; null where it has to wait for a geometry of its own. `names`: attributes; `first`: flat ones are read at the first
   * corner of a triangle, not at the last one.
   */
  garment(object, geometry, material, first) {
    const {fabric, lay} = material, key = `${fabric.number} ${JSON.stringify(lay)}`;
    if (!this.#garments.has(geometry)) {
      this.#garments.set(geometry, {owner: new WeakRef(object), all: new Map()});
      geometry.addEventListener('dispose', this.#dropped);
    }
    const {owner, all} = this.#garments.get(geometry);
    if (owner.deref() !== object) {
      this.#waiting.set(object, performance.now() + WAITING);
      // Images are of one place: all but the first object have a geometry of their own, of the same attributes.
      queueMicrotask(() => {
        if (object.geometry === geometry) object.geometry = own_geometry(geometry);
      });
      return null;
    }
    // Other fabrics of the object that no material shows any more.
    for (const [old, garment] of all) {
      const is_coming = ['asked', 'waiting'].includes(garment.state) && garment.fabric.number !== null;
      if (old === key || is_coming || [...garment.materials].some((one) => one.garment === garment)) continue;
      this.#remove(garment);
      all.delete(old);
    }
    if (!all.has(key)) {
      const taken = new Set([...all.values()].map(({names}) => names[0]));
      let k = 0;
      while (taken.has(CHART_ATTRIBUTES[0] + (k || ''))) ++k;
      const asked = this.#ask_worker(object, geometry, material, first, CHART_ATTRIBUTES.map((name) => name + (k || '')));
      all.set(key, asked);
      asked.is_known = () => this.#garments.get(geometry)?.all.get(key) === asked;
    }
    this.#waiting.delete(object);
    const garment = all.get(key);
    garment.materials.add(material);
    return garment;
  }
  #dropped = ({target: geometry}) => {
    geometry.removeEventListener('dispose', this.#dropped);
    for (const garment of this.#garments.get(geometry)?.all.values() ?? []) this.#remove(garment);
    this.#garments.delete(geometry);
  };
  #remove({geometry, number, names, other}) {
    clearTimeout(other?.timer);
    for (const name of names) geometry.deleteAttribute(name);
    if (number === null) return;
    this.#of_number.delete(number);
    send_to_worker({kind: 'remove', garment: number});
  }
  #ask_worker(object, geometry, {fabric, lay, matrix}, first, names) {
    // glTF has flat normals then, for which the shader needs none.
    if (geometry.attributes.position && !geometry.attributes.normal) geometry.computeVertexNormals();
    const garment = {
      object, fabric, state: 'asked', number: null, beyond: 0, last: '', camera: null, looked_at: -CAMERAS, turns: new WeakSet(), other: null, view: null, moves: moves_of(object, geometry), pose: null, posed_at: -POSE, fraction: 0, at_rest: false, materials: new Set(), geometry, names, edition: 0
    };
    const {position, normal} = geometry.attributes, uv = geometry.attributes[lay.uv_set === 1 ? 'uv1' : 'uv'];
    if (!position || !uv || object.isBatchedMesh) {
      refuse(object, object.isBatchedMesh ? 'a BatchedMesh has no fabric' : `GARMENT_NO_UVS: no ${uv ? 'places' : `coordinates of set ${lay.uv_set}`}`);
      queueMicrotask(() => this.#tell());
      return {...garment, state: 'ended'};
    }
    const {count} = position;
    this.wait_for((async () => {
      // The first frame comes first.
      await new Promise((end) => setTimeout(end));
      const vertices = new Float32Array(8 * count), at = new Vector2(), {index} = geometry;
      for (let i = 0; i < count; ++i) {
        at.set(uv.getX(i), uv.getY(i)).applyMatrix3(matrix);
        place.fromBufferAttribute(position, i).toArray(vertices, 8 * i);
        place.fromBufferAttribute(normal, i).toArray(vertices, 8 * i + 3);
        at.toArray(vertices, 8 * i + 6);
      }
      // The worker charts a triangle at its last corner.
      const turned = (i) => first ? i - i % 3 + (i + 1) % 3 : i;
      const corners = Uint32Array.from({length: index?.count ?? count}, (_, i) => index ? index.getX(turned(i)) : turned(i));
      if (!vertices.every((x) => Math.abs(x) < FARTHEST)) throw new Error('a vertex is not finite, or too far away');
      if (corners.some((i) => i >= count)) throw new Error('a triangle has a vertex that is not there');
      if (fabric.number === null) throw new Error('the fabric is gone');
      fabric.reach(vertices.filter((_, i) => i % 8 > 5));
      // Another fabric may have taken its place since.
      Object.assign(fabric, fabric.coming);
      garment.edition = fabric.edition;
      const {moves} = garment;
      const {number, charts, beyond} = await ask_worker({kind: 'garment', fabric: fabric.number, vertices, corners, moves}, [vertices.buffer, corners.buffer]);
      if (!garment.is_known()) return send_to_worker({kind: 'remove', garment: number});
      const [chart, chart_size] = [new Float32Array(4 * count), new Float32Array(2 * count)];
      for (let i = 0; i < count; ++i) {
        for (let k = 0; k < 4; ++k) chart[4 * i + k] = charts[6 * i + k];
        for (let k = 0; k < 2; ++k) chart_size[2 * i + k] = charts[6 * i + 4 + k];
      }
      Object.assign(garment, {number, beyond, attributes: [new BufferAttribute(chart, 4), new BufferAttribute(chart_size, 2)], state: 'waiting'});
      this.#of_number.set(number, garment);
      this.#send_view(garment);
    })().catch((error) => {
      garment.state = 'ended';
      refuse(object, error.message);
    }));
    return garment;
  }

  /** Tells the worker what is seen of an object; `around`: null, or 36 numbers (cells/module.cpp) for light from all around. */
  look(garment, atlas, renderer, scene, camera, object, level, around_of) {
    this.#upload(renderer, atlas);
    inverse.copy(object.matrixWorld);
    if (object.isInstancedMesh) {
      find_nearest(of_instance, object, camera);
      inverse.multiply(of_instance);
    }
    const scale = Math.cbrt(Math.abs(inverse.determinant()));
    if (!(scale > 0)) return;
    inverse.invert();
    atlas.find_viewport(renderer, viewport);
    const lights = lights_of(renderer, scene, camera).lamps.map((light) => numbers_of_lamp(light, scale, inverse));
    const {around, lamps} = around_of(inverse);
    viewport.divideScalar(this.supersample);
    const view = {camera: numbers_of_camera(camera, scale), level, around, lights: [...lights, ...lamps]};
    const now = JSON.stringify(view), frame = frame_of(renderer);
    if (!this.#is_due(garment, camera, frame, now, () => this.#take_view(garment, camera, now, view))) return;
    if (this.#pose(garment, object)) garment.last = '';
    this.#take_view(garment, camera, now, view);
  }
  #take_view(garment, camera, now, view) {
    Object.assign(garment, {camera, looked_at: performance.now(), other: null});
    if (garment.last === now) return;
    Object.assign(garment, {last: now, view: {...view, serial: ++this.#views}, at_rest: false});
    this.#send_view(garment);
  }
  /**
   * Whether a garment's images are to be for a camera. Where cameras take turns, as for a mirror, the first one's images stay;
   * another camera has to wait until it is seen that the first one has ended, and nothing is at rest until then.
   */
  #is_due(garment, camera, frame, now, take) {
    const {camera: first, other, turns, looked_at, last} = garment;
    if (camera !== first && last === now) return false;
    const is_over = performance.now() >= looked_at + CAMERAS || (other?.camera === camera && other.frame !== frame);
    if (camera !== first && !is_over && turns.has(camera)) return false;
    clearTimeout(other?.timer);
    if (camera === first && other) turns.add(other.camera);
    if (camera === first || is_over) return true;
    garment.other = {camera, frame, timer: setTimeout(take, CAMERAS)};
    return false;
  }
  /** Tells the worker how bones and morphs move a mesh, some times a second; whether it has. */
  #pose(garment, {skeleton, bindMatrix, bindMatrixInverse, morphTargetInfluences}) {
    if (garment.number === null || !garment.moves) return false;
    // Nodes do so later in a frame.
    skeleton?.update();
    const bones = new Float32Array(12 * (skeleton?.bones.length ?? 0)), influences = [...morphTargetInfluences ?? []];
    for (let i = 0; 12 * i < bones.length; ++i) {
      const {elements: e} = of_bone.fromArray(skeleton.boneMatrices, 16 * i).premultiply(bindMatrixInverse).multiply(bindMatrix);
      for (let k = 0; k < 12; ++k) bones[12 * i + k] = e[k % 4 * 4 + (k >> 2)];
    }
    const {pose} = garment, is_same = (now, last) => now.every((x, i) => x === last[i]);
    if (pose && is_same(bones, pose.bones) && is_same(influences, pose.influences)) return false;
    garment.at_rest = false;
    if (performance.now() < garment.posed_at + POSE) {
      // For a shape that stays no other frame may be asked.
      garment.posing ??= setTimeout(() => this.#tell(garment.posing = undefined), POSE);
      return false;
    }
    Object.assign(garment, {pose: {bones, influences}, posed_at: performance.now()});
    send_to_worker({kind: 'pose', garment: garment.number, bones, influences});
    return true;
  }
  #send_view = ({number, view}) => number !== null && view && send_to_worker({kind: 'view', garment: number, ...view});

  #take({kind, message, rows, garment: number, first, entries, tiles, missing, wanted, uploads, at_rest, serial, edition}) {
    if (kind === 'end') {
      for (const garment of this.#of_number.values()) {
        garment.state = 'ended';
        refuse(garment.object, `GRAPHICS_UNAVAILABLE: ${message}`);
        for (const material of garment.materials) material.select_fabric_or_fallback();
      }
      this.#of_number.clear();
      return this.dispatchEvent({type: 'change', at_rest: true});
    }
    if (kind === 'rows') {
      this.#rows = rows;
      return;
    }
    const {cell_table, cell_tiles} = this.uniforms;
    const grown = (uniform, length, channels) => {
      const {image: {data}, format} = uniform.value, row = channels * ATLAS_WIDTH;
      if (data.length >= length) return data;
      uniform.value.dispose();
      const more = new Uint32Array(row * Math.ceil(length / row));
      more.set(data);
      uniform.value = texture_of(more, format);
      return more;
    };
    grown(cell_table, first + entries.length, 1).set(entries, first);
    grown(cell_tiles, tiles.length, 4).set(tiles);
    cell_table.value.needsUpdate = cell_tiles.value.needsUpdate = true;
    this.#has_uploads = true;
    for (const {renderer: known, atlas, handle} of this.#renderers) {
      const renderer = known.deref();
      // Another context's, or a renderer's that is gone.
      if (renderer && atlas.handle(renderer) === handle) atlas.write(renderer, uploads);
    }
    // Tiles of others came with it.
    const garment = this.#of_number.get(number);
    if (!garment) return;
    if (edition > garment.edition) {
      garment.edition = edition;
      if (edition === garment.fabric.edition) Object.assign(garment.fabric, garment.fabric.coming);
    }
    Object.assign(garment, {at_rest: at_rest && serial === garment.view.serial, fraction: wanted > 0 ? 1 - missing / wanted : 1});
    // Without room for all images it is as good as it gets.
    if (garment.state === 'waiting' && ((missing === 0 && wanted > 0) || at_rest)) {
      garment.state = 'shown';
      garment.names.forEach((name, i) => garment.geometry.setAttribute(name, garment.attributes[i]));
      for (const material of garment.materials) material.take_garment();
    }
    this.#tell(garment.state === 'waiting' ? 'progress' : 'change');
  }
  /**
   * Lets garments show another LoadedFabric, whose repeat is as large, in place of theirs as soon as its images are there; the
   * other one is then gone.
   */
  replace(fabric, {number: by, has_yarn, has_holes, albedo, variation, levels, recipe}) {
    Object.assign(fabric, {edition: fabric.edition + 1, coming: {has_yarn, has_holes, albedo, variation, levels, recipe}});
    send_to_worker({kind: 'replace', fabric: fabric.number, by, edition: fabric.edition});
    for (const garment of this.#of_number.values()) if (garment.fabric === fabric) garment.at_rest = false;
  }
  /** Whether all garments show the fabric as it is now. */
  shows(fabric) {
    return [...this.#of_number.values()].every(
      (garment) => garment.fabric !== fabric || !garment.view || (garment.state !== 'waiting' && garment.edition === fabric.edition));
  }
  /** Lets images of what rests wait, for what takes their place soon. */
  hold = (held) => send_to_worker({kind: 'hold', held});
  /** 'change': frames that are drawn now show more; 'progress': more has come of what they do not show yet. */
  #tell = (type = 'change') => this.dispatchEvent({type, at_rest: this.at_rest()});
  /** Whether all images are as the frames that were drawn last want them. */
  at_rest() {
    for (const [object, until] of this.#waiting) if (performance.now() > until) this.#waiting.delete(object);
    return this.#waiting.size === 0 && this.#asked === 0 &&
      [...this.#of_number.values()].every(({at_rest, other, view}) => (at_rest && !other) || !view);
  }
  /** Fraction of the patches in sight that have images. */
  share() {
    const all = [...this.#of_number.values()];
    return all.length > 0 ? all.reduce((sum, {fraction}) => sum + fraction, 0) / all.length : 0;
  }
  #start_again() {
    send_to_worker({kind: 'again'});
    for (const garment of this.#of_number.values()) {
      garment.at_rest = false;
      if (garment.view) garment.view.serial = ++this.#views;
      this.#send_view(garment);
    }
  }
  /** Lets a renderer have tiles. */
  #upload(renderer, atlas) {
    if (this.#rows === 0) return;
    const known = this.#renderers.find((each) => each.renderer.deref() === renderer);
    if (known && known.handle === atlas.handle(renderer)) return;
    atlas.begin(renderer, this.#rows);
    if (this.#has_uploads) this.#start_again();
    this.#renderers = this.#renderers.filter((each) => each !== known && each.renderer.deref());
    this.#renderers.push({renderer: new WeakRef(renderer), atlas, handle: atlas.handle(renderer)});
  }
}

export const cell_images = new CellImages();

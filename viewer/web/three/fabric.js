// A fabric file that is loaded beside a scene, for any number of materials.
import {DataTexture, RedIntegerFormat, UnsignedIntType} from 'three';
import {load} from '../background.js';
import {issue_of} from '../load.js';
import {Issue} from '../reader/index.js';

/** Words in a row of the texture (fabric_words_texture.glsl). */
const ROW = 2048;

function texture_of(words) {
  const rows = Math.ceil(words.length / ROW), data = new Uint32Array(ROW * rows);
  data.set(words);
  const texture = new DataTexture(data, ROW, rows, RedIntegerFormat, UnsignedIntType);
  texture.needsUpdate = true;
  return texture;
}

export class LoadedFabric {
  #sky_settled = null;
  /**
   * `source`: an ArrayBuffer, or { url, headers, credentials } as fetch() takes them, or a promise of one, with the place of
   * the url in a garment; `name` is said in messages.
   */
  constructor(source, name) {
    this.name = name;
    /** loading, ready or broken. */
    this.state = 'loading';
    this.issue = null;
    this.texture = null;
    /** Place in the texture of what the fabric makes of light from all around; 0: not there. */
    this.sky = 0;
    this.has_yarn = false;
    /** Levels of the file, and what the file says of its size. */
    this.levels = 0;
    this.mm_per_repeat = null;
    /** Where it was read: 'worker' or 'main thread'. */
    this.read_in = null;
    /** Settled when all of the fabric is ready, or it is broken; it never fails. */
    this.settled = this.#load(source).catch((error) => {
      this.state = 'broken';
      this.issue = issue_of(error);
      const {code, place, message} = this.issue;
      console.warn(`selvedge: ${code}: ${name}${place ? `: ${place}` : ''}: ${message}; the fallback is shown`);
    });
  }
  async #load(source) {
    const found = await source;
    try {
      this.#take(await load(found));
    } catch (error) {
      if (error.code !== 'FILE_MISSING' || !found.place) throw error;
      throw new Issue('GLTF_REFERENCE', found.place, `${error.place}: ${error.message}`);
    }
  }
  #take({words, yarn, levels, mm_per_repeat, read_in}) {
    this.texture = texture_of(words);
    this.has_yarn = yarn;
    this.levels = levels;
    this.mm_per_repeat = mm_per_repeat;
    this.read_in = read_in;
    this.state = 'ready';
  }
  /** Computes `sky` once, which replaces the texture. Settled when that is done; it never fails. */
  async want_sky() {
    if (this.state !== 'ready') return;
    this.#sky_settled ??= this.#add_sky().catch(
      (error) => console.warn(`selvedge: ${this.name}: ${error.message}; light from all around does not reach it`));
    await this.#sky_settled;
  }
  async #add_sky() {
    const words = this.texture.image.data, {sky} = await load({words});
    const all = new Uint32Array(words.length + sky.length);
    all.set(words);
    all.set(sky, words.length);
    this.texture.dispose();
    this.texture = texture_of(all);
    this.sky = words.length;
  }
  dispose() {
    this.texture?.dispose();
  }
}

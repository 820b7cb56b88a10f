// A fabric file that is loaded beside a scene, for any number of materials.
import {ask_worker, send_to_worker} from '../background.js';
import {Issue, issue_of} from '../reader/issue.js';
import {free_noise, noise_of} from './noise.js';

export class LoadedFabric {
  state = 'loading';
  issue = null;
  /** The worker's number, and how often cell_images.replace() has changed it. */
  number = null;
  edition = 0;
  has_yarn = false;
  has_holes = false;
  albedo = [1, 1, 1];
  variation = null;
  levels = 0;
  mm_per_repeat = null;
  /** Repeats of images along u and v in a repeat of the cloth. */
  tiles = [1, 1];
  /** How it was made (`recipe` of spec/fabric.md); null where the file does not say. */
  recipe = null;
  /** The data sheet of the cloth, its accuracy in dB and its fallback (spec/fabric.md), as far as the file has them. */
  sheet = {};
  accuracy = {};
  fallback = {};
  read_in = null;
  /** Names of the meshes that are to show it, for its message. */
  meshes = new Set();
  /**
   * `source`: an ArrayBuffer, or { url, headers, credentials } as fetch() takes them, or a promise of one, with the place of
   * the url in a garment; `name` is said in messages.
   */
  constructor(source, name) {
    this.name = name;
    /** Settled when all of the fabric is ready, or it is broken; it never fails. */
    this.settled = this.#load(source).catch((error) => {
      this.state = 'broken';
      this.issue = issue_of(error);
      const {code, place, message} = this.issue;
      const names = [...this.meshes].join(', ');
      console.warn(`selvedge: ${code}: ${name}${place ? `: ${place}` : ''}: ${message}; the fallback is shown${names && ` by ${names}`}`);
    });
  }
  /** noise_of() the variation between the least and the largest coordinates of garments. */
  #noise = null;
  #ends = [[0, 0], [0, 0]];
  /** Takes the coordinates of a garment, u and v in turns. */
  reach(coordinates) {
    const uvs = coordinates.map((x, i) => x * this.tiles[i % 2]);
    const ends = [Math.min, Math.max].map((of, i) => [0, 1].map((k) => uvs.reduce((end, x, j) => j % 2 === k ? of(end, x) : end, this.#ends[i][k])));
    if (this.#noise && String(ends) !== String(this.#ends)) this.#noise.of = null;
    this.#ends = ends;
  }
  noise() {
    if (this.#noise?.of === this.variation) return this.#noise;
    free_noise(this.#noise);
    return this.#noise = {of: this.variation, ...noise_of(this.variation, this.#ends)};
  }
  /** Frees the fabric, once no garment shows it any more. */
  dispose() {
    if (this.number !== null) send_to_worker({kind: 'remove', fabric: this.number});
    free_noise(this.#noise);
    Object.assign(this, {state: 'broken', number: null});
  }
  async #load(source) {
    const found = await source;
    try {
      const answer = await ask_worker({kind: 'fabric', source: found});
      // Disposed meanwhile.
      if (this.state === 'broken') return send_to_worker({kind: 'remove', fabric: answer.number});
      Object.assign(this, answer, {state: 'ready'});
    } catch (error) {
      if (error.code !== 'FILE_MISSING' || !found.place) throw error;
      throw new Issue('GLTF_REFERENCE', found.place, `${error.place}: ${error.message}`);
    }
  }
}

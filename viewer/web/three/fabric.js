// A fabric file that is loaded beside a scene, for any number of materials.
import {ClampToEdgeWrapping, DataTexture, NearestFilter, RedIntegerFormat, UnsignedIntType} from 'three';
import {pack_fabric} from '../pack.js';
import {Issue, open_fabric} from '../reader/index.js';

/** Words in a row of the texture (fabric_words_texture.glsl). */
const ROW = 2048;

function texture_of(words) {
  const rows = Math.ceil(words.length / ROW), data = new Uint32Array(ROW * rows);
  data.set(words);
  const texture = new DataTexture(
    data, ROW, rows, RedIntegerFormat, UnsignedIntType, undefined, ClampToEdgeWrapping, ClampToEdgeWrapping, NearestFilter,
    NearestFilter);
  texture.internalFormat = 'R32UI';
  texture.unpackAlignment = 4;
  texture.needsUpdate = true;
  return texture;
}

/** What went wrong, as an Issue: of other errors FILE_UNREADABLE. */
export const issue_of = (error) =>
  error instanceof Issue ? error : new Issue('FILE_UNREADABLE', '', error?.message ?? String(error));

export class LoadedFabric {
  /** `bytes`: a promise of an ArrayBuffer; `name` is said in messages. */
  constructor(bytes, name) {
    this.name = name;
    /** loading, ready or broken. */
    this.state = 'loading';
    this.issue = null;
    this.texture = null;
    this.has_yarn = false;
    /** Levels of the file, and what the file says of its size. */
    this.levels = 0;
    this.mm_per_repeat = null;
    /** Settled when the fabric is ready or broken; it never fails. */
    this.settled = Promise.resolve(bytes).then((buffer) => this.#read(new Uint8Array(buffer))).catch((error) => {
      this.state = 'broken';
      this.issue = issue_of(error);
      const {code, place, message} = this.issue;
      console.warn(`selvedge: ${code}: ${name}${place ? `: ${place}` : ''}: ${message}; the fallback is shown`);
    });
  }
  #read(bytes) {
    const fabric = open_fabric(bytes), {words, yarn} = pack_fabric(fabric);
    this.texture = texture_of(words);
    this.has_yarn = yarn;
    this.levels = fabric.levels;
    this.mm_per_repeat = fabric.mmPerRepeat;
    this.state = 'ready';
  }
  dispose() {
    this.texture?.dispose();
  }
}

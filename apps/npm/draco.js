// Draco's decoder, by the module of draco3d.
import create from 'draco3d/draco_decoder_nodejs.js';

const TYPES = { 5120: 'DT_INT8', 5121: 'DT_UINT8', 5122: 'DT_INT16', 5123: 'DT_UINT16', 5125: 'DT_UINT32', 5126: 'DT_FLOAT32' };
const SIZES = { DT_INT8: 1, DT_UINT8: 1, DT_INT16: 2, DT_UINT16: 2, DT_UINT32: 4, DT_FLOAT32: 4 };

/** Holds the mesh that it has decoded last. */
export class DracoDecoder {
  #draco = null;
  #mesh = null;
  /** `load`: gives the bytes of draco_decoder.wasm, as soon as there is a stream. */
  constructor(load) {
    this.load = load;
  }
  #start() {
    const draco = {
      instantiateWasm: (imports, receive) => {
        const instance = new WebAssembly.Instance(new WebAssembly.Module(this.load()), imports);
        receive(instance);
        return instance.exports;
      }
    };
    create(draco);
    this.decoder = new draco.Decoder();
    return draco;
  }
  /** Bytes that `fill` writes to the decoder's memory; undefined if it cannot. */
  #taken(count, fill) {
    const at = this.#draco._malloc(count), is_whole = fill(at), bytes = this.#draco.HEAPU8.slice(at, at + count);
    this.#draco._free(at);
    return is_whole ? bytes : undefined;
  }
  /** { points, indices }, these as bytes. Throws Draco's message. */
  decode(bytes) {
    try {
      const draco = this.#draco ??= this.#start();
      if (this.#mesh) draco.destroy(this.#mesh);
      this.#mesh = new draco.Mesh();
      const status = this.decoder.DecodeArrayToMesh(bytes, bytes.length, this.#mesh);
      if (!status.ok()) throw new Error(status.error_msg());
      const count = 12 * this.#mesh.num_faces();
      const indices = this.#taken(count, (at) => this.decoder.GetTrianglesUInt32Array(this.#mesh, count, at));
      return { points: this.#mesh.num_points(), indices };
    } catch (error) {
      // A decoder that ends in the middle leaves nothing behind.
      if (error instanceof WebAssembly.RuntimeError) this.#draco = this.#mesh = null;
      throw error;
    }
  }
  #attribute(id) {
    const attribute = this.decoder.GetAttributeByUniqueId(this.#mesh, id);
    return this.#draco.getPointer(attribute) ? attribute : undefined;
  }
  /** Components of an attribute; 0: there is no such attribute, or it is boolean. */
  components(id) {
    const attribute = id < 0 ? undefined : this.#attribute(id);
    return attribute && attribute.data_type() !== this.#draco.DT_BOOL ? attribute.num_components() : 0;
  }
  /** The values of all points as a type of glTF; undefined if one does not fit. */
  values(id, component_type) {
    const attribute = this.#attribute(id), type = TYPES[component_type];
    const count = this.#mesh.num_points() * attribute.num_components() * SIZES[type];
    return this.#taken(count, (at) => this.decoder.GetAttributeDataArrayForAllPoints(this.#mesh, attribute, this.#draco[type], count, at));
  }
}

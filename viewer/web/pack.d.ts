import {Fabric} from './reader/index.js';

/** The places of words by their names in word_layout.glsl. */
export const AT: Record<string, number>;

/** The words that the shaders read, and whether the fabric has yarn. Throws an Issue where a layer is broken. */
export function pack_fabric(fabric: Fabric): {words: Uint32Array; yarn: boolean};

import {Fabric} from './reader/index.js';

/** The places of words by their names in word_layout.glsl. */
export const AT: Record<string, number>;

/**
 * The words that the shaders read, of all sides; yarn: whether the fabric has any. From a first level above 0 they are those of a partial
 * fabric, without yarn. Throws an Issue where a layer is broken.
 */
export function pack_fabric(fabric: Fabric, first?: number): {words: Uint32Array; yarn: boolean};

// The layout of what the worker makes and shaders read.
/** Texels of a row of the atlas, of the table and of the tiles. */
export const ATLAS_WIDTH = 2048;

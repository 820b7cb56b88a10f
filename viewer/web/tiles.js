// The layout of what the worker makes and shaders read.
/** Words of a tile in the answers of table(): place and size, CellImage::first, scale, 1 / brightness, relief. */
export const TILE_NUMBERS = 12;
/** Texels of a row of the atlas and of the table, and of the tiles, three texels each. */
export const ATLAS_WIDTH = 2048, TILE_TABLE_WIDTH = 1536;

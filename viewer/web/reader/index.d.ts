/** A fault of a file: a code of spec/issues.md, the place in the file, and a sentence. */
export class Issue extends Error {
  constructor(code: string, place: string, message: string);
  readonly code: string;
  readonly place: string;
}

export interface Grid {
  layout: 'equal-area';
  columns: number;
  rows: number;
}

export type LayerName = 'lobes' | 'frame' | 'table' | 'opacity' | 'light' | 'products' | 'bases' | 'yarns' | 'indirect' | 'map';

export interface Layer {
  /** Levels that have the layer. */
  levels: number[];
}

/** What `selvedge make` was given (spec/fabric.md): `stitch`, `text`, `set` and options. */
export type Recipe = Record<string, unknown>;

/** Headers and attribute text of a fabric file (spec/fabric.md). */
export interface Fabric {
  texels: [number, number];
  levels: number;
  mmPerRepeat: [number, number];
  referenceHeight: number;
  thickness: number;
  radianceScale?: number;
  views: Grid;
  lights?: Grid;
  provenance: object;
  recipe?: Recipe;
  layers: Partial<Record<LayerName, Layer>>;
  /** The other sides of the cloth, as fabrics that read_layer() reads; of the front alone. */
  sides: Partial<Record<'back' | 'through' | 'back.through', Fabric>>;
}

/** Reads headers and text and unpacks the pixels. Throws an Issue. */
export function open_fabric(bytes: Uint8Array): Promise<Fabric>;

/**
 * The numbers of a layer at a level by channel, each in rows from the top; null where the level lacks the layer. Digest and
 * values are verified. Throws an Issue.
 */
export function read_layer(fabric: Fabric, layer: LayerName, level: number): Map<string, Float32Array> | null;

/** The arrangement of a repeat of the yarn's stitches: equal cells, columns along u, rows along v. */
export interface Arrangement {
  /** Columns and rows of stitches of the yarn, each of one texel. */
  kinds: [number, number];
  /** Columns and rows of the cloth's repeat, which mmPerRepeat is the size of. */
  size: [number, number];
  /** The row of stitches that each curve makes, or the column of one whose turns along u are 0. */
  lines: number[];
  /** Row by row, the texel of the stitch of the yarn that is shown. */
  shown: number[];
}

/** The arrangement of a fabric with the layer `map`; null without. Throws an Issue. */
export function read_map(fabric: Fabric): Arrangement | null;

/** Texels and levels of the cloth's repeat: those stored, or of the fabric's map one texel for each stitch. */
export function repeat_size(fabric: Fabric): { texels: [number, number]; levels: number };

/** Texels of such a level of a fabric, or side, with a map; coarser ones are means. Throws an Issue. */
export function read_repeat(
  fabric: Fabric, level: number): Record<'opacity' | 'products', Map<string, Float32Array> | null>;

/** The digest of the header as 32 hexadecimal digits. */
export function header_digest(fabric: Fabric): string;

/** XXH3 of 128 bits as 32 hexadecimal digits. */
export function xxh3_128(bytes: Uint8Array): string;

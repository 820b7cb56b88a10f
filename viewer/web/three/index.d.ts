import {DirectionalLight, EventDispatcher, Material, MeshPhysicalMaterial, Object3D, Scene, Texture, WebGLRenderer} from 'three';
import {GLTFParser} from 'three/addons/loaders/GLTFLoader.js';
import {Issue, Recipe} from '../reader/index.js';

/** A file, or where it is; headers and credentials as fetch() takes them. */
export type Source = ArrayBuffer | {url: string; headers?: Record<string, string>; credentials?: RequestCredentials};

/**
 * How the worker is made, for pages whose modules are no files: it runs worker.js of the package; and the bytes or the
 * address of cells.wasm.
 */
export function use_worker(make: () => Worker, cells?: ArrayBuffer | string): void;
/** Bytes that cell images may take, 4 to 128 MiB, 64 by default; before the first fabric is loaded. */
export function use_memory(bytes: number): void;
/** The images of all fabrics: an event `change` says that a frame would show more of them; `progress`, that more wait to be shown. */
export const cell_images: EventDispatcher<Record<'change' | 'progress', {at_rest: boolean}>> & {
  /** Pixels of a frame along a side of what images are as fine as: 2 for frames that are drawn twice as large. */
  supersample: number;
  /** Whether all images are as the last views want them. */
  at_rest(): boolean;
  /** Fraction of the cloth in sight that has images. */
  share(): number;
};

/** A fabric file that is loaded beside a scene. */
export class LoadedFabric {
  constructor(source: Source | Promise<Source>, name: string);
  readonly name: string;
  readonly state: 'loading' | 'ready' | 'broken';
  readonly issue: Issue | null;
  readonly has_yarn: boolean;
  /** Levels of the file. */
  readonly levels: number;
  readonly mm_per_repeat: [number, number] | null;
  /** Whether one sees through the cloth. */
  readonly has_holes: boolean;
  /** Mean albedo, linear. */
  readonly albedo: [number, number, number];
  /** How it was made (spec/fabric.md); null where the file does not say. */
  readonly recipe: Recipe | null;
  /** Where it was read, once it is. */
  readonly read_in: 'worker' | 'main thread' | null;
  /** Settled when the fabric is ready or broken; it never fails. */
  readonly settled: Promise<void>;
  /** Frees it; materials that show it keep their images. */
  dispose(): void;
}

/** How a fabric lies on a surface: KHR_texture_transform and the set of coordinates, 0 or 1. */
export interface Lay {
  uv_set: 0 | 1;
  offset: [number, number];
  rotation: number;
  scale: [number, number];
}
export const plain_lay: Lay;

/** What a garment brings beside its fabric; colours are linear. */
export interface GarmentParts {
  mask: Texture | null;
  mask_cutoff: number;
  normal: Texture | null;
  normal_scale: number;
  tint: [number, number, number];
  tint_texture: Texture | null;
}

/** Shows a fabric once it is loaded, and its fallback before that, and where it is broken. */
export class FabricMaterial extends MeshPhysicalMaterial {
  constructor(parameters?: {
    fallback?: Material; fabric?: LoadedFabric; lay?: Lay; keeps_opacity?: boolean; parts?: GarmentParts;
  });
  readonly parts: GarmentParts;
  readonly isFabricMaterial: true;
  readonly fabric: LoadedFabric | null;
  readonly lay: Lay;
  readonly shows: 'fabric' | 'fallback';
  /** What is shown once frames show the fabric, or it is known that they will not. */
  readonly ready: Promise<'fabric' | 'fallback'>;
  /** Whether the fabric is to be shown where it can be; else the fallback. */
  shows_fabric: boolean;
  /** The level that is shown everywhere; -1, by default: by the size of a pixel. */
  level: number;
  /** Takes another fabric, as large; `keeps`: what is shown stays until its images are there. */
  set_fabric(fabric: LoadedFabric | null, options?: {keeps?: boolean}): this;
  /** Takes another factor on the fabric alone; `color` changes fabric and fallback. */
  set_tint(tint: [number, number, number]): void;
}

/**
 * An environment of a scene that hides parts of it from itself: lamps with shadow maps for what is bright, the rest by what
 * reaches each vertex of the fabrics.
 */
export class Surroundings {
  /** An equirectangular picture, linear red, green, blue; the top row first, the middle column seen along -z. */
  constructor(scene: Scene, picture: {width: number; height: number; radiance: Float32Array}, options?: {reflects?: boolean});
  readonly lamps: {light: DirectionalLight}[];
  /** Lets a garment cast shadows; again after it has moved. */
  stand(garment: Object3D): void;
  /** Finds what it hides from itself, which takes some seconds. */
  shade(renderer: Pick<WebGLRenderer, 'render'>, garment: Object3D): Promise<void>;
  /** Lights other materials than fabrics, too, if `reflects` is false: in software that takes a second or more. */
  reflect(): void;
  /** Radiance, the mean of all directions without the lamps. */
  readonly mean: [number, number, number];
  /** Shows the environment behind the scene, blurred by 0 to 1. */
  show(blur: number): void;
  /** Degrees, counter-clockwise from above, and a factor on radiance. */
  set(options: {turn?: number; strength?: number}): void;
}

/** The plugin: loader.register((parser) => new SelvedgeFabric(parser)). */
export class SelvedgeFabric {
  constructor(parser: GLTFParser);
  readonly name: 'SELVEDGE_materials_fabric';
}

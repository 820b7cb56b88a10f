/** Files and ears of a run. Paths have slashes. */
export interface Host {
  /** The working folder, and the folder of page.html; '/' without. */
  folder?: string;
  shared?: string;
  exists(path: string): 'file' | 'folder' | 'other' | undefined;
  /** Throws if the file cannot be read. */
  read(path: string): Uint8Array;
  /** Called for each file when the program has ended by itself; at exit 1, too, for those that the native program leaves then. */
  write(path: string, bytes: Uint8Array): void;
  /** Names in a folder. */
  list(path: string): string[];
  /** Opens a file in the user's browser; false if it cannot. Without it `--open` is refused. */
  open?(path: string): boolean;
  /** Why a file cannot be written, as a name of errno ('EACCES'). */
  refusal?(path: string): string | undefined;
  /** A stage ('relax', 'bake', 'fit') and the fraction of it that is done. What it throws ends the run. */
  progress?(stage: string, fraction: number): void;
  stdout?(text: string): void;
  stderr?(text: string): void;
}

/** Runs `selvedge` with these words; the exit status: 0 good, 1 bad input or a failed check, 2 usage. */
export function run(argv: string[], host: Host): Promise<number>;

/** Bytes, or bytes with the name whose ending tells their kind: "moss.txt", "twill.wif", "shirt.obj". */
export type Input = Uint8Array | { name: string; bytes: Uint8Array };
export type Value = string | number | boolean | readonly (string | number)[] | { readonly [name: string]: string | number };
/**
 * Options of the verb by their names, with _ for -: a list of numbers is one value, one of texts the option repeated, an
 * object repeats it as NAME=VALUE. `files`: further files by name, such as the buffers of a .gltf.
 */
export interface Options {
  files?: Record<string, Uint8Array>;
  progress?: Host['progress'];
  [option: string]: Value | Record<string, Uint8Array> | Host['progress'] | undefined;
}
/** As `--json` prints it, and the exit status. */
export interface Report {
  program: string;
  version: string;
  verb: string;
  status: number;
  [member: string]: unknown;
}
export interface Made {
  bytes: Uint8Array;
  report: Report;
  files: Record<string, Uint8Array>;
}

/** The program's refusal. */
export class SelvedgeError extends Error {
  code: string;
  file?: string;
  place?: string;
}

/** A fabric of a built-in stitch ("twill"), a chart or a draft. Throws SelvedgeError, as all of these. */
export function make(stitch: string | Input, options?: Options): Promise<Made>;
/** A garment in a fabric, as .glb. */
export function dress(garment: Input, fabric: Input, options?: Options): Promise<Made>;
export function check(file: Input, options?: Options): Promise<Report>;
export function info(file: Input, options?: Options): Promise<Report>;

// The verbs of selvedge on bytes: fabrics, garments and reports, without files.
import { memory_host } from './host.js';
import { run } from './run.js';

export { run };

/** Options of a verb by their names: { quality: 'draft', set: { radius_mm: 0.5 }, material: ['Cloth'], all: true }. */
const words_of = (options) => Object.entries(options).flatMap(([name, value]) => {
  const option = `--${name.replaceAll('_', '-')}`;
  if (value === true) return [option];
  if (value === false || value === undefined) return [];
  if (Array.isArray(value) && typeof value[0] === 'number') return [option, value.join(',')];
  if (Array.isArray(value)) return value.flatMap((one) => [option, String(one)]);
  if (typeof value === 'object') return Object.entries(value).flatMap(([key, one]) => [option, `${key}=${one}`]);
  return [option, String(value)];
});

/** A refusal: the line of the program, with its code, file and place. */
export class SelvedgeError extends Error {
  constructor({ message, code, file, place }) {
    super([file, place, message].filter(Boolean).join(': '));
    Object.assign(this, { name: 'SelvedgeError', code, file, place });
  }
}

/** Runs a verb on files in memory, a Map of name and bytes; its report. */
async function report_of(verb, words, options, files, progress) {
  const said = { out: '', err: '' };
  const status = await run([verb, ...words, ...words_of(options), '--json'], memory_host(files, said, progress));
  const report = said.out ? JSON.parse(said.out) : { error: { code: 'ENDED', message: said.err.trim() } };
  if (report.error) throw new SelvedgeError(report.error);
  return { ...report, status };
}

/** An input as a name, whose bytes `files` gets: a name is as the program takes it. */
function named(input, name, files) {
  if (typeof input === 'string') return input;
  const { bytes, ...given } = input instanceof Uint8Array ? { bytes: input } : input;
  files.set(given.name ?? name, bytes);
  return given.name ?? name;
}
const files_of = ({ files = {} }) => new Map(Object.entries(files));

async function made(verb, words, output, { files, progress, ...options }, all) {
  const report = await report_of(verb, [...words, '-o', output], options, all, progress);
  return { bytes: all.get(output), report, files: Object.fromEntries(all) };
}

export async function make(stitch, options = {}) {
  const files = files_of(options);
  return made('make', [named(stitch, 'stitch.txt', files)], 'made.fabric.exr', options, files);
}

export async function dress(garment, fabric, options = {}) {
  const files = files_of(options);
  return made('dress', [named(garment, 'garment.glb', files), named(fabric, 'cloth.fabric.exr', files)], 'dressed.glb', options, files);
}

const report_alone = (verb) => async (input, { files, progress, ...options } = {}) => {
  const all = files_of({ files });
  return report_of(verb, [named(input, 'file', all)], options, all, progress);
};
export const check = report_alone('check'), info = report_alone('info');

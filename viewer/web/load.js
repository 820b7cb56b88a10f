// Loads a fabric into words, coarse levels first where its file is large: in a worker (worker.js), on the main thread, and
// in Node.js.
import {pack_fabric} from './pack.js';
import {Issue, bytes_to_fetch, fetch_fabric, fetch_layers, open_fabric} from './reader/index.js';
import {sky_of} from './sky.js';

/** Bytes that the first picture may cost beside those that came with the headers. */
const FIRST_PICTURE = 2 ** 15;

/** What went wrong, as an Issue: of other errors FILE_UNREADABLE. */
export const issue_of = (error) =>
  error instanceof Issue ? error : new Issue('FILE_UNREADABLE', '', error?.message ?? String(error));

/** What pack_fabric() reads from a first level on. */
const layers_from = ({layers}, first) => Object.entries(layers).flatMap(([layer, {levels}]) => {
  if (layer === 'bases') return [[layer, 0]];
  if (layer === 'yarns' || layer === 'indirect') return first === 0 ? [[layer, 0]] : [];
  return levels.filter((level) => level >= first).map((level) => [layer, level]);
});

/** The sides of a fabric, for fetch_layers(): it knows the places of all parts of the file. */
const sides_of = (fabric) => [fabric, ...Object.values(fabric.sides).map((side) => ({...side, file: fabric.file}))];

/**
 * Gives { words, yarn, levels, mm_per_repeat } of a fabric, once or twice: first without yarn and the finest levels where
 * they are many bytes. `source`: an ArrayBuffer, or what fetch_fabric() takes; or { words } of a fabric, of which it gives
 * { sky }, sky_of() them. Throws an Issue.
 */
export async function* load_words(source) {
  if (source.words) {
    yield {sky: sky_of(source.words)};
    return;
  }
  const is_here = source instanceof ArrayBuffer;
  const fabric = is_here ? open_fabric(new Uint8Array(source)) : await fetch_fabric(source);
  const {levels} = fabric, mm_per_repeat = fabric.mmPerRepeat.map(Number);
  const bytes_from = (first) =>
    sides_of(fabric).reduce((sum, side) => sum + bytes_to_fetch(side, layers_from(side, first)), 0);
  let first = 0;
  while (first + 1 < levels && bytes_from(first) > FIRST_PICTURE) ++first;
  for (const from of first > 0 ? [first, 0] : [0]) {
    for (const side of sides_of(fabric)) await fetch_layers(side, layers_from(side, from));
    yield {...pack_fabric(fabric, from), levels, mm_per_repeat};
  }
}

// Loads a fabric into words: in a worker (worker.js), on the main thread, and in Node.js.
import {pack_fabric} from './pack.js';
import {Issue, open_fabric} from './reader/index.js';
import {sky_of} from './sky.js';

/** An error as an Issue; FILE_UNREADABLE if it has no code of its own. */
export const issue_of = (error) =>
  error instanceof Issue ? error : new Issue('FILE_UNREADABLE', '', error?.message ?? String(error));

async function fetched({url, headers, credentials}) {
  const response = await fetch(url, {headers, credentials}).catch((error) => {
    throw new Issue('FILE_UNREADABLE', url, error.message);
  });
  if (response.ok) return response.arrayBuffer();
  await response.body?.cancel();
  const is_missing = response.status === 404 || response.status === 410;
  throw new Issue(is_missing ? 'FILE_MISSING' : 'FILE_UNREADABLE', url, `HTTP ${response.status}`);
}

/**
 * { words, yarn, levels, mm_per_repeat } of a fabric. `source`: an ArrayBuffer, or { url, headers, credentials } as fetch()
 * takes them; or the { words } of a fabric, which give { sky }, the words of sky_of(). Throws an Issue.
 */
export async function load_words(source) {
  if (source.words) return {sky: sky_of(source.words)};
  const bytes = source instanceof ArrayBuffer ? source : await fetched(source);
  const fabric = await open_fabric(new Uint8Array(bytes));
  return {...pack_fabric(fabric), levels: fabric.levels, mm_per_repeat: fabric.mmPerRepeat};
}

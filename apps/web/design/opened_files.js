// Garments that the user opened, which the browser keeps over a reload if it may.
const BYTES = 128e6, STORE = 'garments';
const settled = (request) => new Promise((end, fail) => Object.assign(request, {onsuccess: () => end(request.result), onerror: () => fail(request.error)}));
/** Does work(store) in the browser's database; undefined where it refuses. */
async function in_database(work) {
  try {
    const request = indexedDB.open(`selvedge design ${location.pathname}`, 1);
    request.onupgradeneeded = () => request.result.createObjectStore(STORE);
    return await settled(work((await settled(request)).transaction(STORE, 'readwrite').objectStore(STORE)));
  } catch {}
}
let loaded = null;
/** Bytes by keys, the oldest first. */
const opened = () => loaded ??= in_database((store) => store.get(STORE)).then((found) => found ?? new Map());
/** Keeps bytes by a key; the oldest go where all are too many. */
export async function keep_file(key, bytes) {
  const files = await opened(), size = () => [...files.values()].reduce((sum, {length}) => sum + length, 0);
  files.delete(key);
  files.set(key, bytes);
  while (size() > BYTES) files.delete(files.keys().next().value);
  await in_database((store) => store.put(files, STORE));
}
/** Throws an Error of one line where they are no longer there. */
export async function find_file(key) {
  const bytes = (await opened()).get(key);
  if (!bytes) throw new Error('is no longer kept by the browser: open it again');
  return bytes;
}

// Loads fabrics.
import {Issue, open_fabric} from './reader/index.js';

async function fetched({url, headers, credentials}) {
  const response = await fetch(url, {headers, credentials}).catch((error) => {
    throw new Issue('FILE_UNREADABLE', url, error.message);
  });
  if (response.ok) return response.arrayBuffer();
  await response.body?.cancel();
  const is_missing = response.status === 404 || response.status === 410;
  throw new Issue(is_missing ? 'FILE_MISSING' : 'FILE_UNREADABLE', url, `HTTP ${response.status}`);
}

/** open_fabric() of a source: an ArrayBuffer, or { url, headers, credentials } as fetch() takes them. Throws an Issue. */
export async function fetch_fabric(source) {
  const bytes = source instanceof ArrayBuffer ? source : await fetched(source);
  return open_fabric(new Uint8Array(bytes));
}

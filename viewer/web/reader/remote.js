// Fabric files at an address: the headers first, then the layers that are asked for, by range requests. A server without
// them gives the whole file. Every layer has its digest, so that a file that changes between two requests is found out.
import {place_chunks, read_headers, read_structure} from './exr.js';
import {fabric_of} from './fabric.js';
import {Issue} from './issue.js';
import {level_of_texels} from './layers.js';

/** Usual bytes of the first request, which hold the headers of most fabrics and all of a small one. */
const FIRST = 2 ** 15;
/** Ranges that are not further apart are one. */
const GAP = 2 ** 11;

class RemoteFile {
  constructor({url, headers, credentials}) {
    this.url = url;
    this.headers = headers;
    this.credentials = credentials;
    /** As long as the file; only what was fetched is in it. */
    this.bytes = null;
    /** How many bytes from the beginning are there. */
    this.known = 0;
  }
  async #response(range) {
    const {url, headers, credentials} = this;
    const response = await fetch(url, {headers: {...headers, ...range}, credentials}).catch((error) => {
      throw new Issue('FILE_UNREADABLE', url, error.message);
    });
    if (response.ok) return response;
    await response.body?.cancel();
    const is_missing = response.status === 404 || response.status === 410;
    throw new Issue(is_missing ? 'FILE_MISSING' : 'FILE_UNREADABLE', url, `HTTP ${response.status}`);
  }
  async #fetch_all(response) {
    this.bytes = new Uint8Array(await response.arrayBuffer());
    this.known = this.bytes.length;
  }
  /** Fetches the bytes from `begin` to before `end`, or all. */
  async fetch(begin, end) {
    // Servers may refuse a range, and browsers may not ask another origin for one, nor tell what it says of the size.
    const response = await this.#response({range: `bytes=${begin}-${end - 1}`}).catch((error) => {
      if (error.code === 'FILE_MISSING') throw error;
      return this.#response();
    });
    if (response.status !== 206) return this.#fetch_all(response);
    const [, from, total] = /^bytes (\d+)-\d+\/(\d+)$/.exec(response.headers.get('content-range')) ?? [];
    const part = new Uint8Array(await response.arrayBuffer()), size = this.bytes?.length ?? Number(total);
    if (Number(from) !== begin || size !== Number(total) || part.length !== Math.min(end, total) - begin)
      return this.#fetch_all(await this.#response());
    this.bytes ??= new Uint8Array(Number(total));
    this.bytes.set(part, begin);
    if (begin <= this.known) this.known = Math.max(this.known, begin + part.length);
  }
  is_whole() {
    return this.known === this.bytes.length;
  }
}

/** The structure of a file of which at least the beginning is fetched. */
async function structure_of(remote) {
  for (;;) {
    if (remote.is_whole()) return read_headers(remote.bytes);
    try {
      return {...read_structure(remote.bytes.subarray(0, remote.known)), bytes: remote.bytes, remote};
    } catch (error) {
      // Half a header looks broken.
      if (!(error instanceof Issue)) throw error;
      await remote.fetch(remote.known, 2 * remote.known);
    }
  }
}

/**
 * The fabric at an address, its headers and its text, as open_fabric() gives it: fetch_layers() fetches what read_layer()
 * reads. `source`: { url, headers, credentials, first }, headers and credentials as fetch() takes them, and the bytes that
 * are asked for at first.
 */
export async function fetch_fabric(source) {
  const remote = new RemoteFile(source);
  await remote.fetch(0, source.first ?? FIRST);
  return fabric_of(await structure_of(remote));
}

/** The chunks of [layer, level] in a list that are not there yet, with their ranges: { chunks, ranges }. */
function missing(fabric, wanted) {
  const {file} = fabric, chunks = new Set();
  if (!file.remote) return {chunks, ranges: []};
  for (const [layer, level] of wanted) {
    for (const chunk of fabric.layers[layer]?.part.chunks ?? [])
      if (chunk.level === level_of_texels(fabric, layer, level) && !chunk.packed) chunks.add(chunk);
  }
  // A chunk says its size itself; it ends before the next one begins.
  if (!file.next) {
    const places = [...file.parts.flatMap((part) => part.chunks.map(({offset}) => offset)), file.bytes.length];
    places.sort((a, b) => a - b);
    file.next = new Map(places.map((place, i) => [place, places[i + 1]]));
  }
  const ranges = [];
  for (const {offset} of [...chunks].sort((a, b) => a.offset - b.offset)) {
    const end = file.next.get(offset) ?? 0, last = ranges.at(-1);
    if (end <= file.remote.known) continue;
    if (last && offset <= last[1] + GAP)
      last[1] = end;
    else
      ranges.push([offset, end]);
  }
  return {chunks, ranges};
}

/** How many bytes fetch_layers() would fetch. */
export const bytes_to_fetch = (fabric, wanted) =>
  missing(fabric, wanted).ranges.reduce((sum, [begin, end]) => sum + end - begin, 0);

/** Fetches layers at levels of a fabric of fetch_fabric(). `wanted`: [[layer, level], ...]. */
export async function fetch_layers(fabric, wanted) {
  const {chunks, ranges} = missing(fabric, wanted), {file} = fabric;
  await Promise.all(ranges.map(([begin, end]) => file.remote.fetch(begin, end)));
  if (chunks.size > 0) place_chunks({...file, bytes: file.remote.bytes}, chunks);
}

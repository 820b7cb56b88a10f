// Containers of glTF: GLB chunks, JSON, buffers and the files of URIs (glTF 2.0, chapters 2 to 4).
import {readFileSync} from 'node:fs';
import {dirname, resolve} from 'node:path';
import {Issue, is_object, parse_json} from './reader.mjs';

const MAGIC = 0x46546C67, JSON_CHUNK = 0x4E4F534A, BINARY_CHUNK = 0x004E4942;
const NESTING = 128;

/** The JSON chunk and the binary chunk of a GLB; null where it is broken. */
function split_glb(bytes, report) {
  const wrong = (code, place, message) => {
    report(code, place, message);
    return null;
  };
  if (bytes.length < 20) return wrong('FILE_DAMAGED', 'header', 'the GLB is cut short');
  if (bytes.readUInt32LE(4) !== 2) return wrong('GLTF_UNSUPPORTED', 'header', 'another version of GLB');
  const length = bytes.readUInt32LE(8);
  if (length > bytes.length || length < 20) return wrong('FILE_DAMAGED', 'header', 'the GLB is cut short');
  if (length < bytes.length) report('GLTF_ADVICE', 'header', 'bytes follow the GLB');
  const chunks = [];
  for (let at = 12; at < length;) {
    const place = `byte ${at}`;
    if (at + 8 > length) return wrong('FILE_DAMAGED', place, 'a chunk is cut short');
    const size = bytes.readUInt32LE(at), type = bytes.readUInt32LE(at + 4);
    if (at + 8 + size > length) return wrong('FILE_DAMAGED', place, 'a chunk is cut short');
    if (size % 4 !== 0) return wrong('GLTF_MALFORMED', place, 'the size of a chunk is no multiple of 4');
    const n = chunks.push(bytes.subarray(at + 8, at + 8 + size));
    if ((n === 1) !== (type === JSON_CHUNK))
      return wrong('GLTF_MALFORMED', place, 'the first chunk, and only that, is JSON');
    if (type === BINARY_CHUNK && n !== 2)
      return wrong('GLTF_MALFORMED', place, 'the binary chunk is the second one');
    if (type !== JSON_CHUNK && type !== BINARY_CHUNK) {
      report('GLTF_ADVICE', place, 'a chunk of an unknown type');
      chunks[n - 1] = null;
    }
    at += 8 + size;
  }
  if (chunks[0].length === 0) return wrong('GLTF_MALFORMED', 'byte 12', 'the JSON chunk is empty');
  return {json: chunks[0], binary: chunks[1] ?? null};
}

/** { gltf, binary, is_glb } of a .gltf or .glb file; null where it is broken. */
export function read_container(bytes, report) {
  const is_glb = bytes.length >= 4 && bytes.readUInt32LE(0) === MAGIC;
  const parts = is_glb ? split_glb(bytes, report) : {json: bytes, binary: null};
  if (!parts) return null;
  let gltf;
  try {
    gltf = parse_json(parts.json, NESTING);
  } catch (error) {
    if (!(error instanceof SyntaxError)) throw error;
    report('GLTF_MALFORMED', '', error.message);
    return null;
  }
  if (is_object(gltf)) return {gltf, binary: parts.binary, is_glb};
  report('GLTF_MALFORMED', '', 'the JSON is not an object');
  return null;
}

/** The bytes behind a uri, beside `file`; an Issue if they cannot be read. */
export function resolve_uri(file, uri, place) {
  const fail = (code, message) => {
    throw new Issue(code, place, message);
  };
  if (uri.startsWith('data:')) {
    const [head, data] = [uri.slice(0, uri.indexOf(',')), uri.slice(uri.indexOf(',') + 1)];
    if (
      !head.endsWith(';base64') || !/^[A-Za-z0-9+/]*={0,2}$/.test(data) ||
      data.replace(/=+$/, '').length % 4 === 1)
      fail('GLTF_MALFORMED', 'the data URI is not base64');
    return Buffer.from(data, 'base64');
  }
  try {
    return readFileSync(resolve(dirname(file), decodeURIComponent(uri)));
  } catch (error) { return fail('GLTF_REFERENCE', error.message); }
}

/** The bytes of buffer `i`, as long as the buffer says; null if they are missing. */
function read_buffer(file, {gltf, binary, is_glb}, i, report) {
  const place = `/buffers/${i}`, {uri, byteLength} = gltf.buffers[i];
  let bytes = null;
  if (typeof uri === 'string') {
    try {
      bytes = resolve_uri(file, uri, place);
    } catch (error) {
      if (!(error instanceof Issue)) throw error;
      report(error.code, error.place, error.message);
      return null;
    }
  } else if (i === 0 && is_glb) {
    bytes = binary;
    if (!bytes) report('GLTF_MALFORMED', place, 'neither a uri nor a binary chunk');
  }
  if (bytes && bytes.length < byteLength) {
    report('FILE_DAMAGED', place, `${bytes.length} of ${byteLength} bytes`);
    return null;
  }
  return bytes?.subarray(0, byteLength) ?? null;
}

export const read_buffers = (file, container, report) => Array.isArray(container.gltf.buffers) ?
  container.gltf.buffers.map(
    (buffer, i) => is_object(buffer) ? read_buffer(file, container, i, report) : null) :
  [];

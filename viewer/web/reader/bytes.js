// Bytes of files: numbers, text.

/** A DataView of the bytes of a typed array. */
export const view_of = (bytes) => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);

export const int_at = (bytes, at) => view_of(bytes).getInt32(at, true);

/** The text whose characters have the numbers of the bytes. */
export function latin1(bytes) {
  let text = '';
  for (let at = 0; at < bytes.length; at += 4096)
    text += String.fromCharCode(...bytes.subarray(at, at + 4096));
  return text;
}

/** The bytes of such a text. */
export function latin1_bytes(text) {
  const bytes = new Uint8Array(text.length);
  for (let at = 0; at < text.length; ++at) bytes[at] = text.charCodeAt(at);
  return bytes;
}

/** The text of UTF-8, a byte order mark included; a TypeError for other bytes. */
export const utf8 = (bytes) => new TextDecoder('utf-8', {fatal: true, ignoreBOM: true}).decode(bytes);

/** The bytes of a list of arrays, one after the other. */
export function joined(list) {
  const result = new Uint8Array(list.reduce((sum, bytes) => sum + bytes.length, 0));
  let at = 0;
  for (const bytes of list) {
    result.set(bytes, at);
    at += bytes.length;
  }
  return result;
}

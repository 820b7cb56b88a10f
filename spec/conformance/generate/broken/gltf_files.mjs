// glTF files whose container, JSON, version, extensions, buffers or pictures cannot be read.
import {glb_of, of_glb, of_square} from '../square.mjs';

const DAMAGED = ['FILE_DAMAGED', 'GLTF_MALFORMED'];
const NO_JSON = ['JSON_MALFORMED', 'GLTF_MALFORMED'];
const MALFORMED = 'GLTF_MALFORMED';
const malformed = (what, about, place, change, more) =>
  of_square(MALFORMED, what, about, place, change, more);
const same = () => {};

const chunks = [
  of_glb(
    'GLTF_UNSUPPORTED', 'glb-version-1', 'a GLB of version 1', '',
    (json, bin) => glb_of([['JSON', json], ['BIN\0', bin]], {version: 1})),
  of_glb(
    DAMAGED, 'glb-header-cut', 'a GLB that ends within its header', '',
    (json) => glb_of([['JSON', json]]).subarray(0, 10)),
  of_glb(
    DAMAGED, 'glb-cut', 'a GLB that is shorter than its header says', '',
    (json, bin) => glb_of([['JSON', json], ['BIN\0', bin]]).subarray(0, -4)),
  of_glb(
    DAMAGED, 'glb-chunk-beyond-the-end', 'a chunk that is longer than the GLB', '',
    (json, bin) => {
      const bytes = glb_of([['JSON', json], ['BIN\0', bin]]);
      bytes.writeUInt32LE(bin.length + 4, 12 + 8 + json.length);
      return bytes;
    }),
  of_glb(
    DAMAGED, 'glb-chunk-header-cut', 'four bytes where a chunk should begin', '',
    (json, bin) => {
      const bytes = Buffer.concat([glb_of([['JSON', json], ['BIN\0', bin]]), Buffer.alloc(4)]);
      bytes.writeUInt32LE(bytes.length, 8);
      return bytes;
    }),
  of_glb(
    MALFORMED, 'glb-chunk-not-of-4', 'a JSON chunk whose size is no multiple of 4', '',
    (json, bin) => glb_of([
      ['JSON', Buffer.concat([json, Buffer.from('  ')])], ['BIN\0', Buffer.concat([bin, Buffer.alloc(2)])]
    ])),
  of_glb(
    MALFORMED, 'glb-first-chunk-not-json', 'the binary chunk before the JSON', '',
    (json, bin) => glb_of([['BIN\0', bin], ['JSON', json]])),
  of_glb(
    MALFORMED, 'glb-two-json-chunks', 'a second JSON chunk', '',
    (json, bin) => glb_of([['JSON', json], ['BIN\0', bin], ['JSON', json]])),
  of_glb(
    MALFORMED, 'glb-json-empty', 'a JSON chunk of no bytes', '',
    (json, bin) => glb_of([['JSON', Buffer.alloc(0)], ['BIN\0', bin]])),
  of_glb(
    MALFORMED, 'glb-binary-not-second', 'a binary chunk behind one of another type', '',
    (json, bin) => glb_of([['JSON', json], ['SEAM', Buffer.alloc(4)], ['BIN\0', bin]])),
  of_glb(
    MALFORMED, 'glb-without-binary-chunk', 'a buffer without a uri, and no binary chunk', '/buffers/0',
    (json) => glb_of([['JSON', json]])),
];

const no_json = (what, about, text) => of_square(NO_JSON, what, about, '', same, {text});
const json = [
  no_json('not-json', 'a garment that is not JSON', (text) => text.slice(0, -1)),
  no_json('byte-order-mark', 'a byte order mark before the JSON', (text) => `\uFEFF${text}`),
  no_json('member-twice', 'a member that stands twice', (text) => text.replace('{', '{"scene":0,')),
  malformed('not-an-object', 'JSON that is an array', '', same, {text: (text) => `[${text}]`}),
];

const asset = [
  malformed('asset-missing', 'no asset', '/asset', (s) => delete s.json.asset),
  malformed('version-missing', 'no version', '/asset/version', (s) => delete s.json.asset.version),
  of_square(
    'GLTF_UNSUPPORTED', 'version-3', 'version 3.0 of glTF', '/asset/version',
    (s) => {
      s.json.asset.version = '3.0';
    }),
  of_square(
    'GLTF_UNSUPPORTED', 'version-2-1-at-least', 'at least version 2.1 of glTF', '/asset/minVersion',
    (s) => {
      s.json.asset = {version: '2.1', minVersion: '2.1'};
    }),
];

const extensions = [
  of_square(
    'GLTF_UNSUPPORTED', 'extension-required', 'an extension of somebody is required', '/extensionsRequired',
    (s) => {
      s.json.extensionsUsed = s.json.extensionsRequired = ['EXAMPLE_mesh_of_dreams'];
    }),
];

const buffer = (code, what, about, change, more) => of_square(code, what, about, '/buffers/0', change, more);
const buffer_uri = (uri) => (s) => {
  s.json.buffers[0].uri = uri;
};
const buffers = [
  buffer(
    [...DAMAGED, 'GLTF_ACCESSOR'], 'buffer-shorter-than-it-says',
    'a data URI with fewer bytes than byteLength',
    (s) => {
      s.json.buffers[0].byteLength += 4;
    }),
  buffer(
    ['GLTF_REFERENCE', 'FILE_MISSING'], 'buffer-not-there', 'a buffer in a file that is not there',
    buffer_uri('square.bin')),
  buffer(
    MALFORMED, 'buffer-not-base64', 'a buffer whose data URI is not base64',
    (s) => {
      s.json.buffers[0].uri = `data:application/octet-stream;base64,*${s.bytes.toString('base64')}`;
    }),
];

const images = [
  of_square(
    'IMAGE_UNREADABLE', 'not-there', 'a picture in a file that is not there', '/images/0',
    (s) => {
      s.json.images = [{uri: 'cloth.png'}];
    }),
];

export const broken_gltf_files = [...chunks, ...json, ...asset, ...extensions, ...buffers, ...images];

export const unwise_gltf_files = [
  of_glb(
    'GLTF_ADVICE', 'glb-and-more', 'bytes behind the end of the GLB', '',
    (text, bin) => Buffer.concat([glb_of([['JSON', text], ['BIN\0', bin]]), Buffer.alloc(4)])),
  of_glb(
    'GLTF_ADVICE', 'glb-chunk-of-an-unknown-type', 'a third chunk, of a type that is not known', '',
    (text, bin) => glb_of([['JSON', text], ['BIN\0', bin], ['SEAM', Buffer.alloc(4)]])),
];

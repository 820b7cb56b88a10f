// A garment of one triangle with a fabric, and fixtures made of it.
import {file_of} from './make.mjs';
import {crc32, deflateSync} from 'node:zlib';

export const NAME = 'SELVEDGE_materials_fabric';
const sound = {name: 'cloth', texels: [1, 1], layers: ['lobes'], K: 0, value: {lobes: () => 0.125}};
export const FABRIC = file_of(sound);
const of_opacity = (name, opacity) =>
  file_of({...sound, name, layers: ['lobes', 'opacity'], grid: [1, 1], value: {...sound.value, opacity: () => opacity}});
export const HOLED = of_opacity('holed cloth', 0.25);
/** Open everywhere by more than 1/2000, and by less. */
export const SHEER = of_opacity('sheer cloth', 0.9375);
export const ALMOST_CLOSED = of_opacity('almost closed cloth', 1 - 2 ** -11);
export const BROKEN = file_of({...sound, name: 'broken cloth', value: {lobes: () => -1}});
export const data_uri = (type, bytes) => `data:${type};base64,${bytes.toString('base64')}`;

/** A picture of rows of bytes, so many a pixel. */
export function png_of(rows, channels) {
  const chunk = (type, data) => {
    const body = Buffer.concat([Buffer.from(type), data]), ends = Buffer.alloc(8);
    ends.writeUInt32BE(data.length, 0);
    ends.writeUInt32BE(crc32(body), 4);
    return Buffer.concat([ends.subarray(0, 4), body, ends.subarray(4)]);
  };
  const head = Buffer.from([0, 0, 0, 0, 0, 0, 0, 0, 8, channels === 4 ? 6 : 2, 0, 0, 0]);
  head.writeUInt32BE(rows[0].length / channels, 0);
  head.writeUInt32BE(rows.length, 4);
  const lines = Buffer.from(rows.flatMap((row) => [0, ...row]));
  return Buffer.concat([Buffer.from('\x89PNG\r\n\x1a\n', 'latin1'), chunk('IHDR', head), chunk('IDAT', deflateSync(lines)), chunk('IEND', Buffer.alloc(0))]);
}
/** The fallback's picture, 1 x 1 pixel: the albedo pi rho = 0.39, sRGB-encoded. */
export const png = () => png_of([[168, 168, 168]], 3);

/** A sound garment: a triangle whose material has the fabric and a fallback. */
function garment() {
  const transform = () => ({KHR_texture_transform: {scale: [4, 4]}});
  // Four repeats of 2.5 x 1.25 mm along each side: positions, normals, texture coordinates.
  const vertices =
    Buffer.from(new Float32Array([
                  0, 0, 0, 0.01, 0, 0, 0, 0.005, 0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 1, 1, 0, 0,
                ]).buffer);
  return {
    asset: {version: '2.0'},
    extensionsUsed: [NAME, 'KHR_texture_transform'],
    extensions: {[NAME]: {fabrics: [{name: 'cloth', mimeType: 'image/x-exr', uri: 'cloth.fabric.exr'}]}},
    scene: 0,
    scenes: [{nodes: [0]}],
    nodes: [{mesh: 0}],
    meshes: [{primitives: [{attributes: {POSITION: 0, NORMAL: 1, TEXCOORD_0: 2}, material: 0}]}],
    materials: [{
      doubleSided: true,
      pbrMetallicRoughness: {baseColorTexture: {index: 0, extensions: transform()}, metallicFactor: 0},
      extensions: {[NAME]: {fabric: {index: 0, texCoord: 0, extensions: transform()}}},
    }],
    textures: [{source: 0}],
    images: [{uri: data_uri('image/png', png())}],
    accessors: [
      {
        bufferView: 0,
        componentType: 5126,
        count: 3,
        type: 'VEC3',
        min: [0, 0, 0],
        max: [0.01, 0.005, 0].map(Math.fround)
      },
      {bufferView: 1, componentType: 5126, count: 3, type: 'VEC3'},
      {bufferView: 2, componentType: 5126, count: 3, type: 'VEC2'},
    ],
    bufferViews: [[0, 36], [36, 36], [72, 24]].map(
      ([byteOffset, byteLength]) => ({buffer: 0, byteOffset, byteLength, target: 34962})),
    buffers: [{byteLength: 96, uri: data_uri('application/octet-stream', vertices)}],
  };
}

/** The fabric in a buffer view of the garment instead of a file beside it. */
export function embed(gltf, bytes) {
  gltf.buffers.push({byteLength: bytes.length, uri: data_uri('application/octet-stream', bytes)});
  gltf.bufferViews.push({buffer: 1, byteLength: bytes.length});
  const [item] = gltf.extensions[NAME].fabrics;
  delete item.uri;
  item.bufferView = 3;
  return item;
}

export const root = `/extensions/${NAME}/fabrics`;
export const material = `/materials/0/extensions/${NAME}`;
export const item_of = (gltf) => gltf.extensions[NAME].fabrics[0];
export const reference_of = (gltf) => gltf.materials[0].extensions[NAME].fabric;

const as_gltf = (gltf) => ({'garment.gltf': Buffer.from(JSON.stringify(gltf, null, 1) + '\n')});

/** A fixture: { name, about, issues, others, files }. */
export function fixture(
  code, what, about, place, change, {fabric = FABRIC, others = 'none', write = as_gltf} = {}) {
  const gltf = garment();
  const beside = change(gltf) ?? {'cloth.fabric.exr': fabric};
  return {
    name: `${[code].flat()[0]}-${what}`,
    about,
    issues: code ? [{code, place}] : [],
    others,
    files: {...write(gltf), ...beside},
  };
}
export const nothing = {};  // no file beside the garment

// Garments for tests of their fabrics.
const FABRIC = 'SELVEDGE_materials_fabric', VARIANTS = 'KHR_materials_variants';

/** A square; its coordinates of set 0 are one repeat, coordinates of set 1 are turned and larger. */
const SQUARE = {
  vertices: [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(
    ([x, y]) => [x, y, 0, 0, 0, 1, x + 0.5, 0.5 - y, 3 * y + 0.1, 3 * x + 0.2]),
  corners: [0, 1, 2, 0, 2, 3],
};

/**
 * The text of a .gltf. `fabrics`: the uris of its fabrics; `references`: of its materials, each on a surface of its
 * own, one beside the other; or, as `variants`, on the same one. A vertex has place, normal and both sets of coordinates.
 * `parts`: further members of the extension, whose textures are `pictures`, URIs.
 */
export function garment_of(
  fabrics, { surface: { vertices, corners } = SQUARE, references = [{ index: 0 }], variants = false, material = {}, parts = {}, pictures = [] } = {}) {
  const arrays = [Float32Array.from(vertices.flat()), Uint16Array.from(corners)];
  const bytes = arrays.flatMap(({ buffer }) => [...new Uint8Array(buffer)]), begin = 40 * vertices.length;
  const text = bytes.map((byte) => String.fromCharCode(byte)).join('');
  const attribute = (byteOffset, type) =>
    ({ bufferView: 0, byteOffset, componentType: 5126, count: vertices.length, type });
  const primitive = {
    attributes: { POSITION: 0, NORMAL: 1, TEXCOORD_0: 2, TEXCOORD_1: 3 }, indices: 4, material: 0,
  };
  const mappings = references.map((_, i) => ({ material: i, variants: [i] }));
  const surfaces = variants ? [{ ...primitive, extensions: { [VARIANTS]: { mappings } } }] :
    references.map((_, i) => ({ ...primitive, material: i }));
  return JSON.stringify({
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: surfaces.map((_, i) => i) }],
    nodes: surfaces.map((_, i) => ({ mesh: i, translation: [i, 0, 0] })),
    meshes: surfaces.map((each) => ({ primitives: [each] })),
    accessors: [
      { ...attribute(0, 'VEC3'), min: [-1, -1, -1], max: [1, 1, 1] }, attribute(12, 'VEC3'), attribute(24, 'VEC2'),
      attribute(32, 'VEC2'), { bufferView: 1, componentType: 5123, count: corners.length, type: 'SCALAR' },
    ],
    bufferViews: [
      { buffer: 0, byteLength: begin, byteStride: 40 }, { buffer: 0, byteOffset: begin, byteLength: bytes.length - begin },
    ],
    buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${btoa(text)}` }],
    extensionsUsed: [FABRIC, VARIANTS, 'KHR_texture_transform'],
    extensions: {
      [FABRIC]: { fabrics: fabrics.map((uri) => ({ mimeType: 'image/x-exr', uri })) },
      [VARIANTS]: { variants: mappings.map((_, i) => ({ name: `variant ${i}` })) },
    },
    materials: references.map((fabric) => ({ ...material, extensions: { [FABRIC]: { fabric, ...parts } } })),
    ...pictures.length > 0 && { images: pictures.map((uri) => ({ uri })), textures: pictures.map((_, source) => ({ source })) },
  });
}

/** The JSON of a .glb file. */
export const json_of_glb = (bytes) => JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)));
/** The file with other JSON. */
export function with_json(bytes, json) {
  const text = JSON.stringify(json), padded = Buffer.from(text.padEnd(Math.ceil(Buffer.byteLength(text) / 4) * 4));
  const file = Buffer.concat([bytes.subarray(0, 20), padded, bytes.subarray(20 + bytes.readUInt32LE(12))]);
  file.writeUInt32LE(file.length, 8);
  file.writeUInt32LE(padded.length, 12);
  return file;
}

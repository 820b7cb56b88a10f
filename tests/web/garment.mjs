// Garments for tests of their fabrics.
const FABRIC = 'SELVEDGE_materials_fabric', VARIANTS = 'KHR_materials_variants';

const QUAD = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];

/**
 * The text of a .gltf. `fabrics`: the uris of its fabrics; `references`: those of its materials, each on a quad of its own,
 * one beside the other; or, as `variants`, on the same quad. The coordinates of set 0 are one repeat of the quad, those of
 * set 1 are turned and larger.
 */
export function garment_of(fabrics, { references = [{ index: 0 }], variants = false } = {}) {
  const numbers = QUAD.flatMap(([x, y]) => [x, y, 0, 0, 0, 1, x + 0.5, 0.5 - y, 3 * y + 0.1, 3 * x + 0.2]);
  const corners = Uint16Array.of(0, 1, 2, 0, 2, 3);
  const bytes = [Float32Array.from(numbers), corners].flatMap(({ buffer }) => [...new Uint8Array(buffer)]);
  const attribute = (byteOffset, type) => ({ bufferView: 0, byteOffset, componentType: 5126, count: 4, type });
  const primitive = {
    attributes: { POSITION: 0, NORMAL: 1, TEXCOORD_0: 2, TEXCOORD_1: 3 }, indices: 4, material: 0,
  };
  const mappings = references.map((_, i) => ({ material: i, variants: [i] }));
  const quads = variants ? [{ ...primitive, extensions: { [VARIANTS]: { mappings } } }] :
    references.map((_, i) => ({ ...primitive, material: i }));
  return JSON.stringify({
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: quads.map((_, i) => i) }],
    nodes: quads.map((_, i) => ({ mesh: i, translation: [i, 0, 0] })),
    meshes: quads.map((quad) => ({ primitives: [quad] })),
    accessors: [
      { ...attribute(0, 'VEC3'), min: [-0.5, -0.5, 0], max: [0.5, 0.5, 0] }, attribute(12, 'VEC3'), attribute(24, 'VEC2'),
      attribute(32, 'VEC2'), { bufferView: 1, componentType: 5123, count: 6, type: 'SCALAR' },
    ],
    bufferViews: [{ buffer: 0, byteLength: 160, byteStride: 40 }, { buffer: 0, byteOffset: 160, byteLength: 12 }],
    buffers: [{
      byteLength: bytes.length, uri: `data:application/octet-stream;base64,${btoa(String.fromCharCode(...bytes))}`,
    }],
    extensionsUsed: [FABRIC, VARIANTS],
    extensions: {
      [FABRIC]: { fabrics: fabrics.map((uri) => ({ mimeType: 'image/x-exr', uri })) },
      [VARIANTS]: { variants: mappings.map((_, i) => ({ name: `variant ${i}` })) },
    },
    materials: references.map((fabric) => ({ extensions: { [FABRIC]: { fabric } } })),
  });
}

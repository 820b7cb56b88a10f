// A garment for tests of its fabric.

/** A triangle in a fabric, as a .gltf beside it. */
export function garment_of(fabric) {
  const data = Buffer.alloc(60);
  [[0, 0], [1, 0], [0, 1]].forEach(([x, y], i) => {
    [x, y, 0].forEach((value, k) => data.writeFloatLE(value, 12 * i + 4 * k));
    [x, y].forEach((value, k) => data.writeFloatLE(value, 36 + 8 * i + 4 * k));
  });
  const name = 'SELVEDGE_materials_fabric';
  return JSON.stringify({
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0] }], nodes: [{ mesh: 0 }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, TEXCOORD_0: 1 }, material: 0 }] }],
    accessors: [
      { bufferView: 0, componentType: 5126, count: 3, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 0] },
      { bufferView: 1, componentType: 5126, count: 3, type: 'VEC2' },
    ],
    bufferViews: [{ buffer: 0, byteLength: 36 }, { buffer: 0, byteOffset: 36, byteLength: 24 }],
    buffers: [{ byteLength: 60, uri: `data:application/octet-stream;base64,${data.toString('base64')}` }],
    extensionsUsed: [name], extensions: { [name]: { fabrics: [{ mimeType: 'image/x-exr', uri: fabric }] } },
    materials: [{ extensions: { [name]: { fabric: { index: 0 } } } }],
  });
}

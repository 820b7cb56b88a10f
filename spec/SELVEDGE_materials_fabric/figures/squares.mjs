// Squares of cloth with the axes of the fabric's frame drawn on them, and what else the figures need of glTF.
//
//   node squares.mjs write FILE.gltf          squares of 0.1 m side by side, materials "cloth" and "x", "y" for the axes
//   node squares.mjs turn DRESSED.gltf        gives square i the transform i, fabric and fallback alike
//   node squares.mjs strip DRESSED.gltf FILE  as other viewers see it: without SELVEDGE_materials_fabric
import { readFileSync, writeFileSync } from 'node:fs';

const NAME = 'SELVEDGE_materials_fabric';
const transforms = [
  { scale: [4, 4] },
  { scale: [4, 4], rotation: Math.PI / 6 },
  { scale: [6, 3] },
  { scale: [-4, 4] },
];
const side = 0.1;
const gap = 0.012;

/** dP/du' and -dP/dv' over a square whose texture coordinates are u = x, v = 1 - y (in sides). */
function axes({ scale: [a, b], rotation = 0 }) {
  const [c, s] = [Math.cos(rotation), Math.sin(rotation)];
  const [m00, m01, m10, m11] = [c * a, s * b, -s * a, c * b]; // d(u', v') / d(u, v)
  const det = m00 * m11 - m01 * m10;
  const unit = ([x, y]) => [x / Math.hypot(x, y), y / Math.hypot(x, y)];
  return [unit([m11 / det, m10 / det]), unit([m01 / det, m00 / det])];
}

function write(file) {
  const chunks = [];
  const views = [];
  const accessors = [];
  const add = (array, type, size, target) => {
    views.push({ buffer: 0, byteOffset: chunks.reduce((sum, chunk) => sum + chunk.length, 0), byteLength: array.byteLength, target });
    chunks.push(Buffer.from(array.buffer), Buffer.alloc((4 - (array.byteLength % 4)) % 4));
    const bounds = (pick) => Array.from({ length: size }, (_, k) => pick(...array.filter((_, i) => i % size === k)));
    const more = target === 34962 && size === 3 ? { min: bounds(Math.min), max: bounds(Math.max) } : {};
    accessors.push({ bufferView: views.length - 1, componentType: target === 34963 ? 5123 : 5126, count: array.length / size, type, ...more });
    return accessors.length - 1;
  };
  const primitive = (points, z, uvs, indices, material) => ({
    attributes: {
      POSITION: add(new Float32Array(points.flatMap(([x, y]) => [x, y, z])), 'VEC3', 3, 34962),
      NORMAL: add(new Float32Array(points.flatMap(() => [0, 0, 1])), 'VEC3', 3, 34962),
      ...(uvs ? { TEXCOORD_0: add(new Float32Array(uvs.flat()), 'VEC2', 2, 34962) } : {}),
    },
    indices: add(new Uint16Array(indices), 'SCALAR', 1, 34963),
    material,
  });
  const arrow = ([x, y], [dx, dy], z, material) => {
    const at = (along, across) => [x + along * dx - across * dy, y + along * dy + across * dx];
    const [length, width, head] = [0.034, 0.0011, 0.0036];
    return primitive([at(0, -width), at(length, -width), at(length, width), at(0, width), at(length, -head), at(length + 2.4 * head, 0), at(length, head)],
      z, null, [0, 1, 2, 0, 2, 3, 4, 5, 6], material);
  };
  const primitives = transforms.flatMap((transform, i) => {
    const left = i * (side + gap);
    const [x, y] = axes(transform);
    const middle = [left + side / 2 - 0.2 * side * (x[0] + y[0]), side / 2 - 0.2 * side * (x[1] + y[1])];
    return [
      primitive([[left, 0], [left + side, 0], [left + side, side], [left, side]], 0, [[0, 1], [1, 1], [1, 0], [0, 0]], [0, 1, 2, 0, 2, 3], i),
      arrow(middle, x, 0.002, transforms.length),
      arrow(middle, y, 0.002, transforms.length + 1),
    ];
  });
  const plain = (name, color) => ({ name, doubleSided: true, pbrMetallicRoughness: { baseColorFactor: [...color, 1], metallicFactor: 0 } });
  const bytes = Buffer.concat(chunks);
  writeFileSync(file, JSON.stringify({
    asset: { version: '2.0' },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0 }],
    meshes: [{ name: 'squares', primitives }],
    materials: [...transforms.map(() => plain('cloth', [0.5, 0.5, 0.5])), plain('x', [0.8, 0.02, 0.02]), plain('y', [0.02, 0.5, 0.02])],
    accessors,
    bufferViews: views,
    buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}` }],
  }));
}

function turn(file) {
  const json = JSON.parse(readFileSync(file, 'utf8'));
  transforms.forEach((transform, i) => {
    const material = json.materials[i];
    for (const info of [material.extensions[NAME].fabric, material.pbrMetallicRoughness.baseColorTexture]) {
      info.extensions = { KHR_texture_transform: transform };
    }
  });
  writeFileSync(file, JSON.stringify(json));
}

function strip(input, output) {
  const json = JSON.parse(readFileSync(input, 'utf8'));
  delete json.extensions;
  json.extensionsUsed = json.extensionsUsed.filter((name) => name !== NAME);
  for (const material of json.materials) delete material.extensions?.[NAME];
  writeFileSync(output, JSON.stringify(json));
}

const [verb, ...files] = process.argv.slice(2);
({ write, turn, strip })[verb](...files);

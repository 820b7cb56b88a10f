// three.js reads the garments of others, poses them as they rest (skins, morph targets, instances), and has as many
// triangles as we, within the same bounds.
//
// node rest.mjs BIN_FOLDER DATA. Exit 77 (skipped) without the data or node_modules. Draco is left out: three decodes it
// in web workers.
import { execFileSync } from 'node:child_process';
import { existsSync, readFileSync, readdirSync } from 'node:fs';
import { dirname, join } from 'node:path';

const [bin, data] = process.argv.slice(2);
const modules = new URL('node_modules/', import.meta.url);
if (!existsSync(join(data, 'garments')) || !existsSync(new URL('three', modules))) {
  console.log('skipped: no shared data or no node_modules');
  process.exit(77);
}
globalThis.self = globalThis;
globalThis.ProgressEvent = class extends Event {};
const { Box3, Matrix4, Vector3 } = await import('three');
const { GLTFLoader } = await import('three/examples/jsm/loaders/GLTFLoader.js');
const { MeshoptDecoder } = await import('meshoptimizer');
await MeshoptDecoder.ready;

function files(folder) {
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const name = join(folder, entry.name);
    if (entry.isDirectory()) return files(name);
    return /\.(gltf|glb)$/.test(entry.name) ? [name] : [];
  });
}

/** The file as one JSON text without materials, its buffers as data URIs. */
function self_contained(file) {
  const bytes = readFileSync(file);
  const binary = bytes.toString('latin1', 0, 4) === 'glTF';
  const length = binary ? bytes.readUInt32LE(12) : bytes.length;
  const json = JSON.parse(binary ? bytes.toString('utf8', 20, 20 + length) : bytes.toString('utf8'));
  const chunk = binary ? bytes.subarray(28 + length) : undefined;
  json.buffers?.forEach((buffer, i) => {
    if (buffer.uri?.startsWith('data:')) return;
    if (!buffer.uri && !(binary && i === 0)) return;
    const own = buffer.uri ? readFileSync(join(dirname(file), decodeURIComponent(buffer.uri))) : chunk;
    buffer.uri = `data:application/octet-stream;base64,${own.subarray(0, buffer.byteLength).toString('base64')}`;
  });
  for (const list of ['images', 'textures', 'samplers', 'materials', 'animations']) delete json[list];
  for (const mesh of json.meshes ?? []) {
    for (const primitive of mesh.primitives) {
      delete primitive.material;
      delete primitive.extensions?.KHR_materials_variants;
    }
  }
  return json;
}

function measure(scene) {
  const box = new Box3();
  const [point, place] = [new Vector3(), new Matrix4()];
  let triangles = 0;
  scene.updateMatrixWorld(true);
  scene.traverse((mesh) => {
    if (!mesh.isMesh) return;
    mesh.skeleton?.update();
    const { index, attributes } = mesh.geometry;
    const corners = index ? index.count : attributes.position.count;
    // GLTFLoader has turned strips and fans into lists.
    const copies = mesh.isInstancedMesh ? mesh.count : 1;
    triangles += Math.floor(corners / 3) * copies;
    for (let copy = 0; copy < copies; copy += 1) {
      if (mesh.isInstancedMesh) mesh.getMatrixAt(copy, place);
      for (let i = 0; i < Math.floor(corners / 3) * 3; i += 1) {
        mesh.getVertexPosition(index ? index.getX(i) : i, point);
        if (mesh.isInstancedMesh) point.applyMatrix4(place);
        box.expandByPoint(point.applyMatrix4(mesh.matrixWorld));
      }
    }
  });
  return { triangles, bounds: [box.min.toArray(), box.max.toArray()] };
}

let [compared, failures] = [0, 0];
for (const file of files(join(data, 'garments'))) {
  const json = self_contained(file);
  if (json.extensionsUsed?.includes('KHR_draco_mesh_compression')) continue;
  const loader = new GLTFLoader();
  loader.setMeshoptDecoder(MeshoptDecoder);
  const theirs = measure((await loader.parseAsync(JSON.stringify(json), '')).scene);
  const report = execFileSync(`${bin}/selvedge`, ['info', file, '--json'], { encoding: 'utf8' });
  const ours = JSON.parse(report).content;
  const [low, high] = theirs.bounds;
  const size = Math.max(...high.map((value, c) => value - low[c]));
  // Quaternions of some files are off by up to 3e-4 from unit length, which three leaves so.
  const bound = size * (/Cameras|TextureEncodingTest/.test(file) ? 3e-4 : 2e-6);
  const far = theirs.bounds.flat().map((value, i) => Math.abs(value - ours.bounds.flat()[i]));
  compared += 1;
  if (theirs.triangles === ours.triangles && Math.max(...far) <= bound) continue;
  failures += 1;
  console.log(`does not hold: ${file}`, JSON.stringify({ theirs, ours: [ours.triangles, ours.bounds], bound }));
}
console.log(`${compared} files compared`);
process.exit(failures > 0 || compared < 50 ? 1 : 0);

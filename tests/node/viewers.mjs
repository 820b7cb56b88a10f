// The sample garments, dressed, in viewers that know nothing of fabrics: every one opens without an error and has all
// triangles in the fallback.
//
//   node viewers.mjs BIN_FOLDER OUTPUT_FOLDER babylon|model-viewer|blender
import { execFileSync } from 'node:child_process';
import { existsSync, readFileSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { dress, expect, finish, json_of, make_fabric, make_yarn_fabric, path, run } from './workshop.mjs';

const EXTENSION = 'SELVEDGE_materials_fabric';
const here = (name) => fileURLToPath(new URL(name, import.meta.url));
const model_viewer_folders = {
  made: path('.'), node: here('.'), 'model-viewer': here('node_modules/@google/model-viewer/dist'), meshopt: here('node_modules/meshoptimizer'),
};

function skip(why) {
  console.log(`skipped: ${why}`);
  process.exit(77);
}

/** Triangles and the sheen of the fallback of each dressed material, by its name. */
function fallbacks_of(gltf) {
  const found = {};
  for (const { primitives } of gltf.meshes) {
    for (const { indices, material } of primitives) {
      const { name, extensions = {} } = gltf.materials[material];
      if (!extensions[EXTENSION]) continue;
      found[name] ??= { triangles: 0, sheen: extensions.KHR_materials_sheen?.sheenColorFactor ?? [0, 0, 0] };
      found[name].triangles += gltf.accessors[indices].count / 3;
    }
  }
  return found;
}

/**
 * Each opens .glb files, or .gltf as well: name of the material -> { triangles, picture (whether there is a base colour
 * picture), sheen (where the viewer has it), metallic, roughness }.
 */
const viewers = {
  /** Babylon.js, without a canvas. */
  babylon: async (files) => {
    const { NullEngine } = await import('@babylonjs/core/Engines/nullEngine.js');
    const { Scene } = await import('@babylonjs/core/scene.js');
    const { LoadAssetContainerAsync } = await import('@babylonjs/core/Loading/sceneLoader.js');
    const { Logger } = await import('@babylonjs/core/Misc/logger.js');
    await import('@babylonjs/loaders/glTF/2.0/index.js');
    const scene = new Scene(new NullEngine()), answers = [];
    for (const file of files.filter((name) => name.endsWith('.glb'))) {
      const { meshes } = await LoadAssetContainerAsync(
        new Uint8Array(readFileSync(path(file))), scene, { pluginExtension: '.glb' });
      const answer = {};
      for (const mesh of meshes.filter(({ material }) => material)) {
        const { name, albedoTexture, metallic, roughness, sheen } = mesh.material;
        answer[name] ??= {
          triangles: 0, picture: Boolean(albedoTexture), metallic, roughness,
          sheen: sheen.isEnabled ? sheen.color.asArray() : [0, 0, 0],
        };
        answer[name].triangles += mesh.getTotalIndices() / 3;
      }
      answers.push([file, answer]);
    }
    expect(Logger.errorsCount === 0, 'Babylon.js logs no error', Logger.LogCache);
    return answers;
  },

  /** model-viewer, drawn by Chromium. */
  'model-viewer': async (files) => {
    const { in_browser } = await import('../web/browser.mjs');
    return in_browser(here('../../viewer/web'), model_viewer_folders, async ({ page, errors }) => {
      const answers = [];
      for (const file of files) {
        answers.push([file, await page.evaluate(async (src) => {
          const { shown } = await import('/node/model_viewer_page.js');
          const viewer = await shown(src);
          const answer = {};
          for (const { name, pbrMetallicRoughness: pbr } of viewer.model.materials) {
            answer[name] = {
              picture: Boolean(pbr.baseColorTexture?.texture), metallic: pbr.metallicFactor, roughness: pbr.roughnessFactor,
            };
          }
          // three.js's scene, which model-viewer keeps under a symbol.
          const scene = viewer[Object.getOwnPropertySymbols(viewer).find(({ description }) => description === 'scene')];
          scene.traverse(({ geometry, material }) => {
            const drawn = answer[material?.name];
            if (!drawn || !geometry) return;
            drawn.triangles = (drawn.triangles ?? 0) + geometry.index.count / 3;
            drawn.sheen = material.sheen > 0 ? material.sheenColor.toArray() : [0, 0, 0];
          });
          return answer;
        }, `/made/${file}`)]);
      }
      // That a frame takes long is no fault.
      const faults = errors.filter((message) => !message.startsWith('rAF timed out'));
      expect(faults.length === 0, 'the console shows no error', faults);
      return answers;
    });
  },

  /** Blender's importer. */
  blender: async (files) => {
    if (!existsSync('/usr/bin/blender')) skip("Debian's blender is not installed");
    const text = execFileSync('blender', [
      '--background', '--factory-startup', '--python-exit-code', '3', '--python', here('blender.py'), '--',
      ...files.map(path),
    ], { encoding: 'utf8', stdio: ['ignore', 'pipe', 'inherit'] });
    expect(!/error/i.test(text), 'Blender prints no error', text);
    const line = text.split('\n').find((one) => one.startsWith('answers '));
    return JSON.parse(line.slice('answers '.length)).map((answer, i) => [files[i], answer]);
  },
};

/** Opens an export: triangles of each material, copies counted. */
const export_viewers = {
  babylon: async (file) => {
    const { NullEngine } = await import('@babylonjs/core/Engines/nullEngine.js');
    const { Scene } = await import('@babylonjs/core/scene.js');
    const { LoadAssetContainerAsync } = await import('@babylonjs/core/Loading/sceneLoader.js');
    const { MeshoptCompression } = await import('@babylonjs/core/Meshes/Compression/meshoptCompression.js');
    const { Logger } = await import('@babylonjs/core/Misc/logger.js');
    await import('@babylonjs/core/Meshes/thinInstanceMesh.js');
    await import('@babylonjs/loaders/glTF/2.0/index.js');
    const { MeshoptDecoder } = await import('meshoptimizer');
    await MeshoptDecoder.ready;
    MeshoptCompression._Default = {
      decodeGltfBufferAsync: async (source, count, stride, mode, filter) => {
        const target = new Uint8Array(count * stride);
        MeshoptDecoder.decodeGltfBuffer(target, count, stride, source, mode, filter);
        return target;
      },
    };
    const { meshes } = await LoadAssetContainerAsync(
      new Uint8Array(readFileSync(path(file))), new Scene(new NullEngine()), { pluginExtension: '.glb' });
    expect(Logger.errorsCount === 0, 'Babylon.js logs no error', Logger.LogCache);
    return meshes.filter(({ material }) => material)
      .reduce((sum, mesh) => sum + mesh.getTotalIndices() / 3 * Math.max(1, mesh.thinInstanceCount), 0);
  },

  three: async (file) => {
    const { in_browser } = await import('../web/browser.mjs');
    return in_browser(here('../../viewer/web'), { made: path('.') }, async ({ page, errors }) => {
      const triangles = await page.evaluate(async (src) => {
        const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
        const { MeshoptDecoder } = await import('three/addons/libs/meshopt_decoder.module.js');
        const { scene } = await new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).loadAsync(src);
        let sum = 0;
        scene.traverse(({ geometry, count }) => { if (geometry) sum += geometry.index.count / 3 * (count ?? 1); });
        return sum;
      }, `/made/${file}`);
      expect(errors.length === 0, 'the console shows no error', errors);
      return triangles;
    });
  },

  'model-viewer': async (file) => {
    const { in_browser } = await import('../web/browser.mjs');
    return in_browser(here('../../viewer/web'), model_viewer_folders, async ({ page, errors }) => {
      const triangles = await page.evaluate(async (src) => {
        const { shown } = await import('/node/model_viewer_page.js');
        const viewer = await shown(src);
        let sum = 0;
        const scene = viewer[Object.getOwnPropertySymbols(viewer).find(({ description }) => description === 'scene')];
        scene.traverse(({ geometry, material, count }) => {
          if (geometry?.index && material?.name.endsWith(' yarn')) sum += geometry.index.count / 3 * (count ?? 1);
        });
        return sum;
      }, `/made/${file}`);
      // model-viewer says so of every instanced mesh, also of Khronos' SimpleInstancing.
      const faults = errors.filter((message) =>
        !message.startsWith('rAF timed out') && message !== 'Mesh is missing primitive index association');
      expect(faults.length === 0, 'the console shows no error', faults);
      return triangles;
    });
  },
};

const near = (a, b) => Math.abs(a - b) <= 1e-5;
make_fabric();
const files = [];
for (const form of ['glb', 'gltf']) {
  dress('sweater', form);
  files.push(`sweater.${form}`);
}
for (const [file, answer] of await viewers[process.argv[4]]?.(files) ?? []) {
  const expected = fallbacks_of(json_of(path(file)));
  expect(Object.keys(expected).length > 0, `${file} is dressed`);
  for (const [name, { triangles, sheen }] of Object.entries(expected)) {
    const shown = answer[name] ?? {};
    const good = shown.triangles === triangles && shown.picture && shown.metallic === 0 && shown.roughness === 1 &&
      (!shown.sheen || sheen.every((x, c) => near(x, shown.sheen[c])));
    expect(good, `${file}, ${name}: all triangles in the fallback`, { shown, triangles, sheen });
    console.log(`${file}, ${name}: ${shown.triangles} triangles`);
  }
}
const open = export_viewers[process.argv[4]];
if (open) {
  make_yarn_fabric();
  dress('sweater', 'glb');
  const { triangles } = run('selvedge', 'export', path('sweater.glb'), '-o', path('yarn.glb'), '--triangles', '4000000', '--json', '--quiet');
  const shown = await open('yarn.glb');
  expect(shown === triangles, 'yarn.glb: all triangles of the yarn', { shown, triangles });
}
finish();

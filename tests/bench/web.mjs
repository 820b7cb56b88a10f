// A garment in its fabrics in Chromium, of a package's plugins for WebGLRenderer and, by nodes, for WebGPURenderer with either back
// end; in a room's light with shadow maps, 960 x 540. Without a graphics processor, seconds are of processors: of all of Chromium.
// First the seconds from the start of its script until it is in its fabrics, and until it rests, its worker's apart. Then frames,
// the worker's part included, beside the same garment in three.js's MeshPhysicalMaterial, the fallback with its maps and sheen:
// medians of alternating runs. dB: the last moving frame to the same view at rest. Then the fragments that are shaded for a pixel of
// cloth, and the main thread's part of a frame of skins.
//
//   node web.mjs PACKAGE_FOLDER GARMENT.glb [RUNS] [WAYS]
import { readFileSync, readdirSync } from 'node:fs';
import { basename, dirname } from 'node:path';
import { in_browser } from '../web/browser.mjs';

const [package_folder, garment, runs = '3', ways = 'WebGL, nodes and WebGL, nodes and WebGPU'] = process.argv.slice(2);
const WAYS = { WebGL: 'webgl_way.js', 'nodes and WebGL': 'nodes_way.js?webgl', 'nodes and WebGPU': 'nodes_way.js' };
/** Pixels a repeat, and degrees a frame of an orbit. */
const VIEWS = [['whole', 8, 1], ['15 px', 15, 1], ['30 px', 30, 1], ['120 px', 120, 0.5]];
const SIZE = [960, 540], FRAMES = 6, SKIN_SIZE = [320, 320], SKIN_FRAMES = 60;

const read = (file) => {
  try {
    return readFileSync(`/proc/${file}`, 'utf8');
  } catch {
    return '';  // It has ended.
  }
};
/** This process, what it has started and what that has started. */
function our_processes() {
  const numbers = readdirSync('/proc').filter((id) => /^\d+$/.test(id)).map(Number);
  const fields = new Map(numbers.map((id) => [id, read(`${id}/stat`).replace(/^.*\) /, '').split(' ').map(Number)]));
  const is_ours = (id) => id === process.pid || (fields.has(id) && is_ours(fields.get(id)[1]));
  return numbers.filter(is_ours).map((id) => ({ id, ticks: fields.get(id).slice(11, 15).reduce((sum, x) => sum + x, 0) }));
}
/** ms that all of them have computed. */
const computed = () => 10 * our_processes().reduce((sum, { ticks }) => sum + ticks, 0);
/** ms that threads of the page's process have computed: the first one, or all with a name. */
function of_threads(name) {
  const pages = our_processes().filter(({ id }) => read(`${id}/cmdline`).includes('--type=renderer'));
  const page = pages.reduce((a, b) => a.ticks < b.ticks ? b : a).id;
  const threads = name ? readdirSync(`/proc/${page}/task`).filter((thread) => read(`${page}/task/${thread}/comm`).startsWith(name)) : [page];
  return threads.reduce((sum, thread) => sum + Number(read(`${page}/task/${thread}/schedstat`).split(' ')[0]) / 1e6, 0);
}
const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];

console.log('| | MeshPhysicalMaterial, ms | fabric, moving | times | dB | nothing moving | times |\n|---|---|---|---|---|---|---|');
const told = [];
for (const way of ways.split(', ')) {
  await in_browser(package_folder, { made: dirname(garment), bench: import.meta.dirname }, async ({ page, errors }) => {
    const call = (name, ...args) => page.evaluate(async ([f, a]) => (await import('/bench/web_page.js'))[f](...a), [name, args]);
    const begin = computed(), at = performance.now(), since = () => `${((performance.now() - at) / 1000).toFixed(1)} s, of processors ` +
      `${((computed() - begin) / 1000).toFixed(1)}, of the worker ${(of_threads('DedicatedWorker') / 1000).toFixed(2)}`;
    await call('open', `/made/${basename(garment)}`, ...SIZE);
    const first = since();
    await call('rest');
    told.push(`${way}: in fabrics after ${first}; at rest after ${since()}`);
    for (const [name, pixels, degrees] of VIEWS.slice(0, way === 'WebGL' ? 4 : 2)) {
      const ms = { material: [], moving: [], still: [] }, layers = {};
      let decibels = 0;
      for (let run = 0; run < Number(runs); ++run) {
        for (const [kind, shows, step] of [['material', false, degrees], ['moving', true, degrees], ['still', true, 0]]) {
          await call('prepare', pixels, shows);
          const before = computed();
          await call('draw', FRAMES, step);
          ms[kind].push((computed() - before) / FRAMES);
          if (kind === 'moving') decibels = await call('moving_decibels');
          if (way === 'WebGL') layers[kind] = await call('overdraw');
        }
      }
      const [material, moving, still] = [ms.material, ms.moving, ms.still].map(median);
      console.log(`| ${way === 'WebGL' ? '' : `${way}, `}${name} | ${material.toFixed(0)} | ${moving.toFixed(0)} | ${(moving / material).toFixed(2)} | ` +
        `${decibels.toFixed(1)} | ${still.toFixed(0)} | ${(still / material).toFixed(2)} |`);
      if (way === 'WebGL') told.push(`${name}: ${layers.still.toFixed(2)} fragments a pixel of cloth, of the material ${layers.material.toFixed(2)}`);
    }
    // Images follow a skin, which has another shape in each frame.
    const vertices = await call('skin'), main = [];
    await call('resize', ...SKIN_SIZE);
    for (const shows of [false, true]) {
      await call('prepare', 15, shows);
      const before = of_threads();
      await call('draw', SKIN_FRAMES, 1);
      main.push((of_threads() - before) / SKIN_FRAMES);
    }
    told.push(`${way}: the main thread's part of a frame of skins of ${vertices} vertices: ${main[1].toFixed(1)} ms, in the fallback ${main[0].toFixed(1)} ms`);
    if (errors.length > 0) console.log(errors);
  }, { way: `/test/${WAYS[way]}` });
}
console.log(told.join('\n'));

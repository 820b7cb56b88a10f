// Frames of the sweater in its default fabric in Chromium's software rasteriser: processor ms of all its processes, the
// worker's included, beside the same garment in three.js's MeshPhysicalMaterial, the fallback with its maps and sheen; both in
// the studio's light with a shadow map. Medians of alternating runs; 960 x 540. dB: the last moving frame to the same view at
// rest.
//
//   node web.mjs PACKAGE_FOLDER SWEATER.glb [RUNS]
import { readFileSync, readdirSync } from 'node:fs';
import { basename, dirname } from 'node:path';
import { in_browser } from '../web/browser.mjs';

const [package_folder, garment, runs = '5'] = process.argv.slice(2);
const TICKS = 100;  // a second, of /proc
/** Pixels a repeat, and degrees a frame of an orbit. */
const VIEWS = [['whole', 8, 1], ['15 px', 15, 1], ['30 px', 30, 1], ['120 px', 120, 0.5]];
const FRAMES = 12;

/** Seconds that this process, what it has started and what that has started have computed. */
function computed() {
  const processes = new Map();
  for (const id of readdirSync('/proc').filter((name) => /^\d+$/.test(name))) {
    try {
      const [, parent, ...rest] = readFileSync(`/proc/${id}/stat`, 'utf8').replace(/^.*\) /, '').split(' ').map(Number);
      processes.set(Number(id), { parent, ticks: rest.slice(9, 13).reduce((sum, x) => sum + x, 0) });
    } catch { /* It has ended. */ }
  }
  const is_ours = (id) => id === process.pid || (processes.has(id) && is_ours(processes.get(id).parent));
  return [...processes.keys()].filter(is_ours).reduce((sum, id) => sum + processes.get(id).ticks, 0) / TICKS;
}
const median = (values) => values.sort((a, b) => a - b)[values.length >> 1];

await in_browser(package_folder, { made: dirname(garment), bench: import.meta.dirname }, async ({ page, errors }) => {
  const call = (name, ...args) => page.evaluate(
    async ([f, a]) => (await import('/bench/web_page.js'))[f](...a), [name, args]);
  await call('open', `/made/${basename(garment)}`);
  console.log('| view | MeshPhysicalMaterial, ms | fabric, moving | times | dB | nothing moving | times |\n' +
    '|---|---|---|---|---|---|---|');
  for (const [name, pixels, degrees] of VIEWS) {
    const ms = { material: [], moving: [], still: [] };
    let decibels = 0;
    for (let run = 0; run < Number(runs); ++run) {
      for (const [way, shows, step] of [['material', false, degrees], ['moving', true, degrees], ['still', true, 0]]) {
        await call('prepare', pixels, shows);
        const begin = computed();
        await call('draw', FRAMES, step);
        ms[way].push(1000 * (computed() - begin) / FRAMES);
        if (way === 'moving') decibels = await call('moving_decibels');
      }
    }
    const [material, moving, still] = [ms.material, ms.moving, ms.still].map(median);
    console.log(`| ${name} | ${material.toFixed(0)} | ${moving.toFixed(0)} | ${(moving / material).toFixed(2)} | ` +
      `${decibels.toFixed(1)} | ` +
      `${still.toFixed(0)} | ${(still / material).toFixed(2)} |`);
  }
  // Images follow a skin, which has another shape in each frame.
  await call('skin');
  await call('prepare', 15, true);
  const begin = computed();
  await call('draw', FRAMES, 1);
  console.log(`a skin in motion, 15 px: ${(1000 * (computed() - begin) / FRAMES).toFixed(0)} ms`);
  if (errors.length > 0) console.log(errors);
});

// Processor seconds of a frame of 1920 x 1080 of the whole sweater in Chromium's software rasteriser, and on the shader and
// the hybrid path of selvedge-view, for docs/web.md. Seconds of all cores, so that other work on the machine counts little.
//
//   node web.mjs PACKAGE_FOLDER BIN_FOLDER SCRATCH_FOLDER
import { execFileSync } from 'node:child_process';
import { mkdirSync, readFileSync, readdirSync } from 'node:fs';
import { in_browser } from '../web/browser.mjs';

const [package_folder, bin, folder] = process.argv.slice(2);
const LIGHTS = [[0.3, 0.5, 1, 1], [1, 0.2, 0.4, 0.3]];
const VIEW = { look_at: [0, 0.3, 0], distance: 1.6, azimuth: 20, elevation: 8 };
const TICKS = 100;  // a second, of /proc

mkdirSync(folder, { recursive: true });
const path = (name) => `${folder}/${name}`;
const run = (program, ...options) => execFileSync(`${bin}/${program}`, options, { encoding: 'utf8' });
run('selvedge', 'make', 'plain-knit', '--set', 'yarn=tube', '-o', path('knit.fabric.exr'), '--quiet');
run('selvedge-samples', 'sweater', '-o', path('plain.glb'));
run('selvedge', 'dress', path('plain.glb'), path('knit.fabric.exr'), '-o', path('sweater.glb'), '--all', '--quiet');

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
async function seconds_of(work) {
  const begin = computed(), clock = performance.now();
  await work();
  return `${(computed() - begin).toFixed(1)} s (${((performance.now() - clock) / 1000).toFixed(1)} s by the clock)`;
}

await in_browser(package_folder, { made: folder }, async ({ page }) => {
  const draw = (width, height) => page.evaluate(async (query) => {
    await (await import('/test/scene_page.js')).drawn(...query);
  }, ['/made/sweater.glb', { ...VIEW, fov: 30, width, height }, LIGHTS]);
  // The first frame includes the compiler.
  await draw(16, 9);
  console.log(`Chromium: ${await seconds_of(() => draw(1920, 1080))}`);
});
const { look_at, distance, azimuth, elevation } = VIEW;
for (const drawer of ['shader', 'hybrid']) {
  const told = await seconds_of(() => run('selvedge-view', 'render', path('sweater.glb'), '-o', path('frame.exr'), '--path',
    drawer, '--size', '1920x1080', '--look-at', look_at.join(','), '--distance', distance, '--azimuth', azimuth,
    '--elevation', elevation, ...LIGHTS.flatMap((light) => ['--light', light.join(',')]), '--quiet'));
  console.log(`${drawer} path: ${told}`);
}

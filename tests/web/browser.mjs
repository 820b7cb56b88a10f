// A headless Chromium, and a server of this machine that gives it the package, three.js and files of the tests.
// CHROMIUM_GRAPHICS: flags for a graphics processor, '--use-gl=angle --use-angle=gl-egl --enable-gpu' for NVIDIA's.
// Exit 77 (skipped) where Chromium or playwright-core is not installed.
import { existsSync, readFileSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { dirname, extname, join } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

export const here = dirname(fileURLToPath(import.meta.url));
export const MODULES = join(here, '../node/node_modules');
const CHROMIUM = '/usr/bin/chromium';
const TYPES = { '.js': 'text/javascript', '.mjs': 'text/javascript', '.html': 'text/html', '.json': 'application/json' };

function skip(why) {
  console.log(`skipped: ${why}`);
  process.exit(77);
}

if (!existsSync(CHROMIUM)) skip('Debian\'s chromium is not installed');
const { chromium } = await import('../node/node_modules/playwright-core/index.mjs').catch(
  () => skip('npm ci in tests/node installs playwright-core'));

/** Serves folders by the first part of the path: { address, close() }. */
async function serve(folders) {
  const server = createServer((request, response) => {
    const [, folder, ...rest] = decodeURIComponent(new URL(request.url, 'http://localhost').pathname).split('/');
    const file = folders[folder] && join(folders[folder], ...rest);
    if (!file || !existsSync(file) || !statSync(file).isFile()) return response.writeHead(404).end();
    response.writeHead(200, { 'content-type': TYPES[extname(file)] ?? 'application/octet-stream' }).end(readFileSync(file));
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return { address: `http://127.0.0.1:${server.address().port}`, close: () => server.close() };
}

const IMPORTS = {
  'three': '/three/build/three.module.js',
  'three/webgpu': '/three/build/three.webgpu.js',
  'three/tsl': '/three/build/three.tsl.js',
  'three/addons/': '/three/examples/jsm/',
  'way': '/test/webgl_way.js',
  'selvedge/': '/selvedge/',
  'selvedge/three': '/selvedge/three/index.js',
  'selvedge/three/nodes': '/selvedge/three/nodes.js',
};

const launch = () => chromium.launch({
  executablePath: CHROMIUM,
  args: [
    ...(process.env.CHROMIUM_GRAPHICS ?? '--use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --enable-unsafe-webgpu --use-webgpu-adapter=swiftshader').split(' '),
    '--no-sandbox', '--ignore-gpu-blocklist', '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
  ],
});

/** A list that receives a page's exceptions and its console's errors and warnings. */
function errors_of(page) {
  const errors = [];
  page.on('console', (message) => {
    // Hints about speed are not faults.
    if (['error', 'warning'].includes(message.type()) && !message.text().includes('Performance'))
      errors.push(message.text());
  });
  page.on('pageerror', (error) => errors.push(String(error)));
  return errors;
}

/** Opens a page from its file, in a window of { width, height }; touch(points) draws a finger along, or two: points of two. */
export async function from_file(file, viewport, work) {
  const browser = await launch();
  try {
    const context = await browser.newContext({ viewport, hasTouch: true });
    const page = await context.newPage(), errors = errors_of(page);
    const session = await context.newCDPSession(page);
    const touch = async (points) => {
      const send = (type, touchPoints) => session.send('Input.dispatchTouchEvent', { type, touchPoints });
      const fingers = (point) => (Array.isArray(point[0]) ? point : [point]).map(([x, y], id) => ({ x, y, id }));
      for (const [i, point] of points.entries()) await send(i === 0 ? 'touchStart' : 'touchMove', fingers(point));
      await send('touchEnd', []);
    };
    await page.goto(pathToFileURL(file).href);
    return await work({ page, errors, touch });
  } finally {
    await browser.close();
  }
}

/**
 * Runs work({ page, errors }) on an empty page that can import the package in `package_folder`; errors: errors_of(). `imports`:
 * further ones by their names, 'way' how tests draw.
 */
export async function in_browser(package_folder, folders, work, imports = {}) {
  const server = await serve({ three: process.env.THREE ?? join(MODULES, 'three'), selvedge: package_folder, test: here, examples: join(here, '../../examples'), ...folders });
  const browser = await launch();
  try {
    const page = await browser.newPage();
    const errors = errors_of(page);
    await page.route(`${server.address}/`, (route) => route.fulfill({
      contentType: 'text/html',
      body: `<!doctype html><script type="importmap">${JSON.stringify({ imports: { ...IMPORTS, ...imports } })}</script><body></body>`,
    }));
    await page.goto(`${server.address}/`);
    return await work({ page, errors });
  } finally {
    await browser.close();
    server.close();
  }
}

// A headless Chromium, and a server of this machine that gives it the package, three.js and files of the tests.
//
// Exit 77 (skipped) where Chromium or playwright-core is not installed.
import { existsSync, readFileSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { dirname, extname, join } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

export const here = dirname(fileURLToPath(import.meta.url));
const MODULES = join(here, '../node/node_modules');
const CHROMIUM = '/usr/bin/chromium';
const TYPES = { '.js': 'text/javascript', '.mjs': 'text/javascript', '.html': 'text/html', '.json': 'application/json' };

function skip(why) {
  console.log(`skipped: ${why}`);
  process.exit(77);
}

if (!existsSync(CHROMIUM)) skip('Debian\'s chromium is not installed');
const { chromium } = await import('../node/node_modules/playwright-core/index.mjs').catch(
  () => skip('npm ci in tests/node installs playwright-core'));

/**
 * Serves folders by the first part of the path, ranges of files too, unless the query is "whole"; where it is "untold",
 * nothing is told of their place:
 * { address, sent, close() }. `sent` takes { name, status, bytes } of every answer.
 */
export async function serve(folders) {
  const sent = [];
  const server = createServer((request, response) => {
    const { pathname, search } = new URL(request.url, 'http://localhost');
    const [, folder, ...rest] = decodeURIComponent(pathname).split('/'), name = rest.at(-1);
    const answer = (status, headers, body) => {
      sent.push({ name, status, bytes: body?.length ?? 0 });
      response.writeHead(status, headers).end(body);
    };
    const file = folders[folder] && join(folders[folder], ...rest);
    if (!file || !existsSync(file) || !statSync(file).isFile()) return answer(404);
    const bytes = readFileSync(file), type = { 'content-type': TYPES[extname(file)] ?? 'application/octet-stream' };
    const range = search === '?whole' ? null : /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? '');
    if (!range) return answer(200, type, bytes);
    const [begin, last] = [Number(range[1]), Math.min(Number(range[2]), bytes.length - 1)];
    if (begin > last) return answer(416);
    const place = search === '?untold' ? {} : { 'content-range': `bytes ${begin}-${last}/${bytes.length}` };
    answer(206, { ...type, ...place }, bytes.subarray(begin, last + 1));
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return { address: `http://127.0.0.1:${server.address().port}`, sent, close: () => server.close() };
}

const IMPORTS = {
  imports: {
    'three': '/three/build/three.module.js',
    'three/addons/': '/three/examples/jsm/',
    'selvedge/': '/selvedge/',
  },
};

const launch = () => chromium.launch({
  executablePath: CHROMIUM,
  args: [
    '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist',
    '--disable-quic', '--no-first-run', '--disable-background-networking', '--disable-component-update', '--disable-sync',
  ],
});

/** A list that takes what the console of a page calls errors and warnings, and exceptions. */
function errors_of(page) {
  const errors = [];
  page.on('console', (message) => {
    // Advice about speed is no fault.
    if (['error', 'warning'].includes(message.type()) && !message.text().includes('Performance'))
      errors.push(message.text());
  });
  page.on('pageerror', (error) => errors.push(String(error)));
  return errors;
}

/** Opens a page from its file, in a window of { width, height }; touch(points) draws a finger along. */
export async function from_file(file, viewport, work) {
  const browser = await launch();
  try {
    const context = await browser.newContext({ viewport, hasTouch: true });
    const page = await context.newPage(), errors = errors_of(page);
    const session = await context.newCDPSession(page);
    const touch = async (points) => {
      const send = (type, touchPoints) => session.send('Input.dispatchTouchEvent', { type, touchPoints });
      for (const [i, [x, y]] of points.entries()) await send(i === 0 ? 'touchStart' : 'touchMove', [{ x, y }]);
      await send('touchEnd', []);
    };
    await page.goto(pathToFileURL(file).href);
    return await work({ page, errors, touch });
  } finally {
    await browser.close();
  }
}

/**
 * Opens an empty page with the package in `package_folder` to import, and runs work({ page, errors, sent }) with the list
 * of errors_of() and that of serve().
 */
export async function in_browser(package_folder, folders, work) {
  const server = await serve({ three: join(MODULES, 'three'), selvedge: package_folder, test: here, ...folders });
  const browser = await launch();
  try {
    const page = await browser.newPage();
    const errors = errors_of(page);
    await page.route(`${server.address}/`, (route) => route.fulfill({
      contentType: 'text/html',
      body: `<!doctype html><script type="importmap">${JSON.stringify(IMPORTS)}</script><body></body>`,
    }));
    await page.goto(`${server.address}/`);
    return await work({ page, errors, sent: server.sent });
  } finally {
    await browser.close();
    server.close();
  }
}

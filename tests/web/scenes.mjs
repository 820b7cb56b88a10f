// The demo's sweater in a browser beside `selvedge-view render`, with the same cameras, lights and environments: PSNR as displayed,
// without the 1 % of the pixels that differ most (silhouettes and edges of yarn, where single rays decide) and with them.
//
//   node scenes.mjs PACKAGE_FOLDER BIN_FOLDER OUTPUT_FOLDER [SWEATER.glb]
//
// For a sweater of `./demo` it tells the same at four distances, and the seconds until its images rest; nothing is asserted.
// Nodes draw as WebGLRenderer does with WebGPU and with WebGL 2.
// Then the oldest three.js that works draws the whole sweater as the newest does; VERSIONS=FOLDER: all three-* of an npm folder
// draw every view.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdirSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { basename, dirname, join } from 'node:path';
import { data_uri, png_of } from '../../spec/conformance/generate/garment.mjs';
import { sample_garment } from '../node/sample_garment.mjs';
import { MODULES, in_browser } from './browser.mjs';
import { garment_of } from './garment.mjs';
import { read_picture } from './read_picture.mjs';

const [package_folder, bin, folder, sweater] = process.argv.slice(2);
const LIGHTS = [[0.3, 0.5, 1, 1], [1, 0.2, 0.4, 0.3]];
const BEHIND = [-0.5, 0.2, -0.7, 0.5];
const VIEWS = {
  yarn: { look_at: [0.05, 0.3, 0.12], distance: 0.06, azimuth: 20, elevation: 8, width: 80, height: 60 },
  whole: { look_at: [0, 0.3, 0], distance: 1.6, azimuth: 20, elevation: 8, width: 80, height: 60 },
  // Through holes, and with a mask, normals, a tint and occlusion of the garment's own.
  holes: { file: 'parts.gltf', look_at: [0, 0, -0.03], distance: 0.5, azimuth: 20, elevation: 15, width: 80, height: 80 },
  // The back of cloth, and the light that comes through it.
  'both sides': { file: 'curtain.gltf', look_at: [0, 0, 0], distance: 0.3, azimuth: 20, elevation: 15, width: 80, height: 80, lights: [LIGHTS[0], BEHIND] },
  environment: { look_at: [0.05, 0.3, 0.12], distance: 0.4, azimuth: 20, elevation: 8, width: 80, height: 60, environment: 'sky.hdr', shades: true },
};
/** Shadow maps of three.js have other filters, and nothing to do with the fabric. */
const SHADED = 38;
/** What nodes are to draw as WebGLRenderer does: a mean of frames, since holes are another pattern in each. */
const VIEWS_OF_NODES = {
  yarn: VIEWS.yarn, whole: VIEWS.whole,
  near: { ...VIEWS.yarn, distance: 0.4 },
  back: { ...VIEWS.whole, distance: 0.9, azimuth: 200, lights: [LIGHTS[0], BEHIND] },
  sky: { ...VIEWS.environment, shades: false }, environment: { ...VIEWS.environment, least: SHADED },
  holes: { ...VIEWS.holes, least: 34 }, 'both sides': { ...VIEWS['both sides'], least: 34 },
  tinted: { ...VIEWS.yarn, tint: [0.3, 0.6, 1.4] },
};
const VIEWS_OF_SWEATER = Object.fromEntries([8, 15, 30, 120].map((pixels) => [`${pixels} px a repeat`, {
  // A repeat is 5 mm wide, and the chest lies half as far before the middle.
  file: sweater, look_at: [0, 0.3, 0.12], distance: 540 * 0.005 / (2 * Math.tan(Math.PI / 12) * pixels), azimuth: 20, elevation: 8,
  width: 960, height: 540,
}]));
/** The environment is turned by so many degrees, and so many times as bright. */
const TURN = 40, STRENGTH = 1.5;
/** Images of the page are half as fine as the images of a picture at rest. */
const MOST_LEFT_OUT = 0.01, OFF_EDGES = 33, OVER_ALL = 32;
/** Between versions of three.js. */
const ALIKE = 40;
/** A view whose images come, pixels along a block of it, and by how much its brightness may be off. */
const COMING = { ...VIEWS.whole, distance: 0.9, width: 640, height: 480 }, BLOCK = 24, COARSE = { coming: 0.03, 'without images': 0.15 };
/** Frames of a mean. */
const FRAMES = 16;
const EXPOSURE = Math.PI, BACKGROUND = 0.18;

rmSync(folder, { recursive: true, force: true });
mkdirSync(folder, { recursive: true });
process.on('exit', () => rmSync(folder, { recursive: true, force: true }));
const run = (program, ...options) => execFileSync(`${bin}/${program}`, options, { stdio: ['ignore', 'ignore', 'inherit'] });
const path = (name) => `${folder}/${name}`;

function displayed(radiance, alpha) {
  const x = Math.min(Math.max(radiance * EXPOSURE + BACKGROUND * (1 - alpha), 0), 1);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;
}

/** { off_edges, over_all } in dB. */
function psnr(ours, theirs) {
  const pixels = ours.length / 4, errors = new Float64Array(pixels);
  for (let i = 0; i < pixels; ++i) {
    for (let c = 0; c < 3; ++c)
      errors[i] += (displayed(ours[4 * i + c], ours[4 * i + 3]) - displayed(theirs[4 * i + c], theirs[4 * i + 3])) ** 2 / 3;
  }
  errors.sort();
  const decibels = (list) => -10 * Math.log10(list.reduce((sum, x) => sum + x, 0) / list.length);
  return { off_edges: decibels(errors.subarray(0, Math.ceil((1 - MOST_LEFT_OUT) * pixels))), over_all: decibels(errors) };
}

const RED_TUBE = ['--set', 'yarn=tube', '--set', 'colour=0.5,0.13,0.09'];
run('selvedge', 'make', 'plain-knit', ...RED_TUBE, '-o', path('knit.fabric.exr'), '--quiet');
run('selvedge', 'make', 'plain-knit', ...RED_TUBE, '-o', path('both.fabric.exr'), '--sides', 'both', '--quiet');
run('selvedge', 'dress', sample_garment(bin, 'sweater', folder), path('knit.fabric.exr'), '-o', path('sweater.glb'), '--all', '--quiet');

/** Sheets of cloth at these depths, the nearest first and the second turned over; none reaches as far as the last. */
function sheets(depths) {
  const vertices = [], corners = [], SIDE = 12;
  for (const [n, z] of depths.entries()) {
    const first = vertices.length, side = 0.2 + 0.05 * n;
    for (let i = 0; i <= SIDE; ++i) {
      for (let j = 0; j <= SIDE; ++j) {
        const x = side * (i / SIDE - 0.5), y = side * (j / SIDE - 0.5), slope = 0.2 * Math.cos(20 * x + n);
        const long = Math.hypot(1, slope), normal = [-slope / long, 0, 1 / long].map((c) => n === 1 ? -c : c);
        vertices.push([x, y, z + 0.01 * Math.sin(20 * x + n), ...normal, 60 * x + 0.3 * n, -60 * y + 0.4 * n, 0, 0]);
        if (i === SIDE || j === SIDE) continue;
        const at = (k, l) => first + (i + k) * (SIDE + 1) + j + l;
        const quad = [at(0, 0), at(1, 0), at(1, 1), at(0, 0), at(1, 1), at(0, 1)];
        corners.push(...(n === 1 ? quad.reverse() : quad));
      }
    }
  }
  return { vertices, corners };
}
const see_through = { doubleSided: true, alphaMode: 'BLEND' };
writeFileSync(path('curtain.gltf'), garment_of(['both.fabric.exr'], { surface: sheets([0]), material: see_through }));

/** A picture of 32 x 32 pixels as a data URI. */
function picture_of(texel) {
  const along = Array.from({ length: 32 }, (_, k) => k / 32);
  return data_uri('image/png', png_of(along.map((y) => along.flatMap((x) => texel(x, y))), 4));
}
const wave = (x, y, step) => Math.round(140 + 90 * Math.sin(2 * Math.PI * (x + step)) * Math.cos(2 * Math.PI * (y - step)));
const laid = (index, rotation, scale) =>
  ({ index, extensions: { KHR_texture_transform: { rotation, scale: [scale, scale] } } });
writeFileSync(path('parts.gltf'), garment_of(['knit.fabric.exr'], {
  surface: sheets([0, -0.03]),
  material: { ...see_through, alphaMode: 'MASK', alphaCutoff: 0.4, occlusionTexture: laid(0, 0, 0.05) },
  parts: {
    maskTexture: laid(0, 0.4, 0.1), maskCutoff: 0.4, normalTexture: { ...laid(1, 0.7, 0.2), scale: 0.8 }, tintFactor: [0.9, 1.2, 0.8],
    tintTexture: laid(0, 0, 0.07),
  },
  pictures: [
    picture_of((x, y) => [0, 0.1, 0.2, 0.3].map((step) => wave(x, y, step))),
    picture_of((x, y) => [wave(x, y, 0.5) / 3 + 80, wave(x, y, 0.7) / 3 + 80, 240, 255].map(Math.round)),
  ],
}));

/** A blue sky over a brown ground with a sun, as Radiance has it. */
function write_environment(file, width = 128, height = 64) {
  const bytes = [];
  for (let y = 0; y < height; ++y) {
    for (let x = 0; x < width; ++x) {
      const is_sun = Math.abs(x - 0.55 * width) < 2 && Math.abs(y - 0.3 * height) < 2, up = 1 - 2 * y / height;
      const colour = is_sun ? [60, 55, 45] : up > 0 ? [0.1, 0.15, 0.2 + 0.1 * up] : [0.08, 0.06 + 0.04 * x / width, 0.03];
      const exponent = Math.ceil(Math.log2(Math.max(...colour) * 1.01));
      bytes.push(...colour.map((c) => Math.floor(256 * c / 2 ** exponent)), exponent + 128);
    }
  }
  const header = `#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y ${height} +X ${width}\n`;
  writeFileSync(file, Buffer.concat([Buffer.from(header), Buffer.from(bytes)]));
}
write_environment(path('sky.hdr'));
const floats_of = (pixels) => new Float32Array(Uint8Array.from(Buffer.from(pixels, 'base64')).buffer);
const file_of = (name) => name === sweater ? sweater : path(name), pictures = {};
async function draw(page, { file = 'sweater.glb', environment, shades = false, lights = LIGHTS, least, tint, ...view }, frames = 1) {
  const { pixels, shows, ...told } = await page.evaluate(async (query) => {
    const { drawn } = await import('/test/scene_page.js');
    return drawn(...query);
  }, [file === sweater ? `/demo/${basename(sweater)}` : `/made/${file}`, { ...view, fov: 30 }, environment ? [] : lights,
    environment && { file: `/made/${environment}`, turn: TURN, strength: STRENGTH, shades }, { frames, tint }]);
  assert.deepEqual([...new Set(shows)], ['fabric']);
  return { ...told, floats: floats_of(pixels) };
}
/** The first picture of cloth is as bright as the last one, block by block; so is the first one of places that have no images. */
async function compare_coming(page) {
  const { width, height } = COMING, call = async (query) => (await import('/test/scene_page.js')).coming(...query);
  const pictures = (await page.evaluate(call, ['/made/sweater.glb', { ...COMING, fov: 30 }, [...LIGHTS, BEHIND]])).map(floats_of);
  const mean = (values) => values.reduce((sum, x) => sum + x, 0) / values.length;
  const bright = (picture, block) => mean(block.map((i) => picture[i] + picture[i + 1] + picture[i + 2]));
  for (const [name, first, last] of [['coming', 0, 1], ['without images', 2, 3]].map(([name, ...two]) => [name, ...two.map((k) => pictures[k])])) {
    const cloth = [...Array(width * height).keys()].filter((i) => last[4 * i + 3] > 0.5), blocks = new Map();
    for (const i of cloth) {
      const key = `${Math.floor(i % width / BLOCK)} ${Math.floor(i / width / BLOCK)}`;
      blocks.set(key, [...blocks.get(key) ?? [], 4 * i]);
    }
    const errors = [...blocks.values()].filter(({ length }) => length > 0.9 * BLOCK ** 2).map((block) => bright(first, block) / bright(last, block) - 1);
    const rms = Math.sqrt(mean(errors.map((x) => x * x)));
    console.log(`${name}: ${errors.length} blocks, first to last brightness ${(1 + mean(errors)).toFixed(3)}, RMS ${(100 * rms).toFixed(1)} %`);
    assert.ok(rms <= COARSE[name], name);
  }
}
/** Draws the views by nodes, and compares them with pictures. */
async function compare_nodes(way, beside) {
  await in_browser(package_folder, { made: folder }, async ({ page, errors }) => {
    for (const [name, { least = ALIKE, ...view }] of Object.entries(VIEWS_OF_NODES)) {
      const { over_all } = psnr(beside[name], (await draw(page, view, FRAMES)).floats);
      console.log(`${way} ${name}: ${over_all.toFixed(1)} dB beside WebGLRenderer`);
      assert.ok(over_all >= least, `${way}, ${name}`);
    }
    assert.deepEqual(errors, []);
  }, { way });
}
await in_browser(package_folder, { made: folder, demo: dirname(sweater ?? '') }, async ({ page, errors }) => {
  const beside = {};
  if (!sweater) await compare_coming(page);
  for (const [name, view] of Object.entries(sweater ? {} : VIEWS_OF_NODES)) beside[name] = (await draw(page, view)).floats;
  for (const way of sweater ? [] : ['/test/nodes_way.js', '/test/nodes_way.js?webgl']) await compare_nodes(way, beside);
  for (const [name, { file = 'sweater.glb', environment, shades = false, lights = LIGHTS, ...view }] of Object.entries(sweater ? VIEWS_OF_SWEATER : VIEWS)) {
    const { look_at, distance, azimuth, elevation, width, height } = view;
    const around = environment && ['--environment', path(environment), '--environment-turn', TURN,
      '--environment-strength', STRENGTH];
    run('selvedge-view', 'render', file_of(file), '-o', path(`${name}.exr`), '--size', `${width}x${height}`,
      '--supersample', 1, '--look-at', look_at.join(','), '--distance', distance, '--azimuth', azimuth, '--elevation', elevation,
      ...around ?? lights.flatMap((light) => ['--light', light.join(',')]), ...shades ? [] : ['--shadows', '0'], '--quiet');
    const { floats, ms, rest } = await draw(page, { file, environment, shades, lights, ...view });
    pictures[name] = floats;
    const { off_edges, over_all } = psnr(read_picture(path(`${name}.exr`)), floats);
    console.log(`${name.padEnd(18)} ${off_edges.toFixed(1)} dB, over all ${over_all.toFixed(1)} dB, ${ms.toFixed(0)} ms, ` +
      `at rest after ${rest.toFixed(1)} s`);
    assert.ok(sweater || off_edges >= (shades ? SHADED : OFF_EDGES) && over_all >= (shades ? SHADED : OVER_ALL), name);
  }
  assert.deepEqual(errors, []);
  // The example of docs/web.md: the middle of its first picture is cloth.
  const middle = await page.evaluate(async () => {
    document.body.style.height = '100vh';
    const { renderer, draw } = await (await import('/examples/three.js')).show('/made/sweater.glb', document.body);
    draw();
    const gl = renderer.getContext(), pixel = new Uint8Array(4);
    gl.readPixels(gl.drawingBufferWidth / 2, gl.drawingBufferHeight / 2, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return [...pixel];
  });
  assert.ok(sweater || middle[0] > 2 * middle[2] && middle[2] > 0, `${middle}`);
  assert.deepEqual(errors, []);
});

const { VERSIONS } = process.env, views = VERSIONS ? VIEWS : { whole: VIEWS.whole };
const versions = VERSIONS ? readdirSync(VERSIONS).filter((name) => name.startsWith('three-')) : sweater ? [] : ['three-oldest'];
for (const version of versions) {
  await in_browser(package_folder, { made: folder, three: join(VERSIONS ?? MODULES, version) }, async ({ page, errors }) => {
    for (const [name, view] of Object.entries(views)) {
      const { over_all } = psnr(pictures[name], (await draw(page, view)).floats);
      console.log(`${version.padEnd(18)} ${name}: ${over_all.toFixed(1)} dB beside the newest`);
      assert.ok(over_all >= ALIKE, `${version}, ${name}`);
    }
    assert.deepEqual(errors, []);
  });
}

// Materials without a fabric in environments: `selvedge-view render` beside three.js, and both beside sums over the whole
// environment, in dB of what a display shows at exposure 1. Spheres of metal 0, 0.5, 1 (rows) and roughness 0 to 1
// (columns), and the wood of SheenChair if ../shared/data is there. Markdown on standard output.
//
//   node core_materials.mjs BIN_FOLDER SCRATCH_FOLDER ENVIRONMENT.hdr ...
import { execFileSync } from 'node:child_process';
import { cpSync, existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { basename, dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { FloatType } from '../node/node_modules/three/build/three.module.js';
import { HDRLoader } from '../node/node_modules/three/examples/jsm/loaders/HDRLoader.js';
import { read_picture } from '../web/read_picture.mjs';
import { in_browser } from '../web/browser.mjs';

const { PI, acos, atan2, cos, floor, hypot, log10, max, min, sin, sqrt } = Math;
const [bin, folder, ...environments] = process.argv.slice(2);
const bench = dirname(fileURLToPath(import.meta.url)), chair = join(bench, '../../../shared/data/garments/khronos/SheenChair/glTF');
const METALS = [0, 0.5, 1], ROUGHNESSES = [0, 0.2, 0.4, 0.6, 0.8, 1], COLOUR = [0.8, 0.5, 0.3], RADIUS = 0.46;
const SPHERES = { look_at: [2.5, 1, 0], distance: 11, azimuth: 0, elevation: 0, width: 960, height: 540, fov: 22 };
const WOOD = { look_at: [0, 0.35, 0], distance: 1.7, azimuth: 30, elevation: 15, width: 480, height: 480, fov: 30 };
/** The sums are over every so many pixels, along either side. */
const STEP = 6;
mkdirSync(folder, { recursive: true });

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const plus = (a, b, factor = 1) => a.map((x, i) => x + factor * b[i]);
const unit = (a) => a.map((x) => x / hypot(...a));
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** A ball of so many rows, in floats; the corners of its triangles. */
function ball(rows = 64) {
  const columns = 2 * rows, places = [], corners = [];
  for (let i = 0; i <= rows; ++i)
    for (let j = 0; j <= columns; ++j) {
      const [a, b] = [i / rows * PI, j / columns * 2 * PI], at = (k, l) => (i + k) * (columns + 1) + j + l;
      places.push(sin(a) * sin(b), cos(a), sin(a) * cos(b));
      if (i < rows && j < columns) corners.push(at(0, 0), at(1, 0), at(1, 1), at(0, 0), at(1, 1), at(0, 1));
    }
  return { places: Float32Array.from(places), corners: Uint16Array.from(corners) };
}
function write_spheres(file) {
  const { places, corners } = ball(), bytes = Buffer.concat([places, corners].map(({ buffer }) => Buffer.from(buffer)));
  const each = METALS.flatMap((metallicFactor, row) => ROUGHNESSES.map((roughnessFactor, column) => ({
    translation: [column, METALS.length - 1 - row, 0],
    pbrMetallicRoughness: { baseColorFactor: [...COLOUR, 1], metallicFactor, roughnessFactor },
  })));
  const attributes = { POSITION: 0, NORMAL: 0 }, count = places.length / 3;
  writeFileSync(file, JSON.stringify({
    asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: each.map((_, i) => i) }],
    nodes: each.map(({ translation }, mesh) => ({ mesh, translation, scale: [RADIUS, RADIUS, RADIUS] })),
    materials: each.map(({ pbrMetallicRoughness }) => ({ pbrMetallicRoughness })),
    meshes: each.map((_, material) => ({ primitives: [{ attributes, indices: 1, material }] })),
    accessors: [
      { bufferView: 0, componentType: 5126, count, type: 'VEC3', min: [-1, -1, -1], max: [1, 1, 1] },
      { bufferView: 1, componentType: 5123, count: corners.length, type: 'SCALAR' },
    ],
    bufferViews: [
      { buffer: 0, byteLength: places.byteLength },
      { buffer: 0, byteOffset: places.byteLength, byteLength: corners.byteLength },
    ],
    buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString('base64')}` }],
  }));
}
function write_wood(file) {
  cpSync(chair, folder, { recursive: true });
  const scene = JSON.parse(readFileSync(join(folder, 'SheenChair.gltf')));
  scene.scenes = [{ nodes: [scene.nodes.findIndex(({ name }) => name === 'SheenChair_wood')] }];
  writeFileSync(file, JSON.stringify({ ...scene, scene: 0 }));
}

/** A picture as [radiance of pixels], the top row first; at() as Environment::at(). */
class Picture {
  constructor(width, height, radiance) {
    Object.assign(this, { width, height, radiance });
  }
  at([x, y, z]) {
    const { width, height, radiance } = this, sum = [0, 0, 0];
    const across = (atan2(x, -z) / (2 * PI) + 0.5) * width - 0.5, down = acos(min(max(y, -1), 1)) / PI * height - 0.5;
    const [left, top] = [floor(across), floor(down)];
    for (let k = 0; k < 4; ++k) {
      const column = (left + k % 2 + width) % width, row = min(max(top + (k >> 1), 0), height - 1);
      const weight = (k % 2 ? across - left : left + 1 - across) * (k > 1 ? down - top : top + 1 - down);
      for (let c = 0; c < 3; ++c) sum[c] += weight * radiance[3 * (row * width + column) + c];
    }
    return sum;
  }
  /** Its pixels as lamps in floats: direction, irradiance; the mean of squares of so many pixels each. */
  lamps(square) {
    const lamps = [], { width, height, radiance } = this;
    for (let y = 0; y < height; y += square)
      for (let x = 0; x < width; x += square) {
        const [a, b] = [(y + square / 2) / height * PI, ((x + square / 2) / width - 0.5) * 2 * PI], sum = [0, 0, 0];
        for (let i = y; i < y + square; ++i) {
          const angle = 2 * PI / width * (cos(i * PI / height) - cos((i + 1) * PI / height));
          for (let j = x; j < x + square; ++j)
            for (let c = 0; c < 3; ++c) sum[c] += angle * radiance[3 * (i * width + j) + c];
        }
        lamps.push(sin(b) * sin(a), cos(a), -cos(b) * sin(a), ...sum);
      }
    return Float64Array.from(lamps);
  }
}
function read_environment(file) {
  const { width, height, data } = new HDRLoader().setDataType(FloatType).parse(readFileSync(file).buffer);
  return new Picture(width, height, Float32Array.from({ length: 3 * width * height }, (_, i) => data[4 * floor(i / 3) + i % 3]));
}

/** glTF's specular layer without Fresnel's term, by the cosines; min_alpha2 of pbr_brdf.h. */
const alpha2_of = (roughness) => max(roughness ** 4, 1e-6);
const side = (a2, cosine) => cosine + sqrt(a2 + (1 - a2) * cosine * cosine);
/** Calls body(light, weight, cosine from half to view) for directions as often as GGX has them. */
function sample(a2, view, samples, body) {
  const nv = max(view[2], 1e-4);
  for (let k = 0; k < samples * samples; ++k) {
    const u = (floor(k / samples) + 0.5) / samples, angle = (k % samples + 0.5 * (floor(k / samples) % 2)) / samples * 2 * PI;
    const nh = sqrt((1 - u) / (1 + (a2 - 1) * u)), planar = sqrt(1 - nh * nh), h = [planar * cos(angle), planar * sin(angle), nh];
    const vh = dot(view, h), light = plus(view.map((x) => -x), h, 2 * vh);
    if (vh > 0 && light[2] > 0) body(light, 4 * light[2] * vh / (nh * side(a2, light[2]) * side(a2, nv)) / samples ** 2, vh);
  }
}
/** Fractions of even light that a mirror of all light reflects, by the cosine to the viewer; their mean. */
const albedos = new Map(ROUGHNESSES.map((roughness) => {
  const of = Array.from({ length: 65 }, (_, i) => {
    const z = max(i / 64, 1e-3);
    let sum = 0;
    sample(alpha2_of(roughness), [sqrt(1 - z * z), 0, z], 32, (_light, weight) => { sum += weight; });
    return min(sum, 1);
  });
  return [roughness, { of, mean: of.reduce((sum, x, i) => sum + 2 * x * i / 64 * (i % 64 === 0 ? 0.5 : 1) / 64, 0) }];
}));
const albedo = ({ of }, cosine) => {
  const place = min(max(cosine, 0), 1) * 64, low = min(floor(place), 63);
  return of[low] * (low + 1 - place) + of[low + 1] * (place - low);
};

/** What a surface shows: the specification's formula, and what it loses between facets (Kulla and Conty 2017). */
function summed(picture, lamps, normal, view, metal, roughness) {
  const a2 = alpha2_of(roughness), nv = max(dot(normal, view), 1e-4), of = albedos.get(roughness);
  const f0 = COLOUR.map((x) => 0.04 + (x - 0.04) * metal), lost = (1 - albedo(of, nv)) / (PI * max(1 - of.mean, 1e-6));
  const more = (x, even = x + (1 - x) / 21) => even * even * of.mean / (1 - even * (1 - of.mean)) * lost;
  const back = COLOUR.map((x) => more(0.04) + (more(x) - more(0.04)) * metal);
  const base = COLOUR.map((x) => x * (1 - metal) / PI), sum = [0, 0, 0], sharp = roughness < 0.1;
  for (let i = 0; i < lamps.length; i += 6) {
    const nl = normal[0] * lamps[i] + normal[1] * lamps[i + 1] + normal[2] * lamps[i + 2];
    if (!(nl > 0)) continue;
    const h = [view[0] + lamps[i], view[1] + lamps[i + 1], view[2] + lamps[i + 2]], long = 1 / sqrt(dot(h, h));
    const schlick = (1 - dot(h, view) * long) ** 5, nh = dot(h, normal) * long, d = nh * nh * (a2 - 1) + 1;
    const facets = sharp ? 0 : a2 / (PI * d * d * side(a2, nl) * side(a2, nv)), again = 1 - albedo(of, nl);
    for (let c = 0; c < 3; ++c) {
      const f = f0[c] + (1 - f0[c]) * schlick;
      sum[c] += (0.96 * (1 - schlick) * base[c] + f * facets + back[c] * again) * nl * lamps[i + 3 + c];
    }
  }
  if (!sharp) return sum;
  const z = normal, x = unit(cross(Math.abs(z[1]) < 0.9 ? [0, 1, 0] : [1, 0, 0], z)), y = cross(z, x);
  sample(a2, [dot(view, x), dot(view, y), nv], 48, (light, weight, vh) => {
    const seen = picture.at([0, 1, 2].map((c) => x[c] * light[0] + y[c] * light[1] + z[c] * light[2]));
    for (let c = 0; c < 3; ++c) sum[c] += seen[c] * weight * (f0[c] + (1 - f0[c]) * (1 - vh) ** 5);
  });
  return sum;
}

function displayed(radiance) {
  const x = min(max(radiance, 0), 1);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055;
}
/** Sums of squares, and their dB. */
class Difference {
  sum = 0;
  count = 0;
  add(a, b) {
    for (let c = 0; c < 3; ++c) this.sum += (displayed(a[c]) - displayed(b[c])) ** 2;
    this.count += 3;
  }
  toString() { return this.count === 0 ? '' : (-10 * log10(this.sum / this.count)).toFixed(1); }
}

const path = (name) => join(folder, name);
function ours(file, { look_at, distance, azimuth, elevation, width, height, fov }, environment) {
  execFileSync(join(bin, 'selvedge-view'), ['render', path(file), '-o', path('ours.exr'), '--size', `${width}x${height}`, '--fov', fov,
    '--look-at', look_at.join(','), '--distance', distance, '--azimuth', azimuth, '--elevation', elevation,
    '--environment', environment, '--shadows', '0', '--supersample', '2', '--quiet'], { stdio: ['ignore', 'ignore', 'inherit'] });
  return read_picture(path('ours.exr'));
}
const pixel = (pixels, at) => pixels.subarray(4 * at, 4 * at + 4);
/** Pixels that both pictures cover. */
const covered = (...pictures) => [...Array(pictures[0].length / 4).keys()].filter((at) => pictures.every((of) => of[4 * at + 3] > 0.999));
function compared(a, b, places = covered(a, b)) {
  const all = new Difference();
  for (const at of places) all.add(pixel(a, at), pixel(b, at));
  return all;
}

/** { metal, roughness, places: [{ at, normal, view }] } of each sphere: every so many pixels well inside of it. */
function places_on_spheres({ look_at, distance, width, height, fov }) {
  const eye = plus(look_at, [0, 0, distance]), scale = 2 * Math.tan(fov * PI / 360) / height;
  return METALS.flatMap((metal, row) => ROUGHNESSES.map((roughness, column) => {
    const centre = [column, METALS.length - 1 - row, 0], places = [];
    for (let y = 0; y < height; y += STEP)
      for (let x = 0; x < width; x += STEP) {
        const ray = unit([(x + 0.5 - width / 2) * scale, (height / 2 - y - 0.5) * scale, -1]), to = plus(eye, centre, -1);
        const along = dot(to, ray), root = along * along - dot(to, to) + RADIUS * RADIUS;
        if (root < 0.02 * RADIUS * RADIUS) continue;
        const normal = unit(plus(to, ray, -along - sqrt(root)));
        places.push({ at: y * width + x, normal, view: ray.map((c) => -c) });
      }
    return { metal, roughness, places };
  }));
}

const scenes = { 'spheres.gltf': SPHERES };
write_spheres(path('spheres.gltf'));
if (existsSync(chair)) {
  write_wood(path('wood.gltf'));
  scenes['wood.gltf'] = WOOD;
}
const spheres = places_on_spheres(SPHERES), tables = [];
await in_browser(folder, { made: folder, bench, environments: dirname(environments[0]) }, async ({ page }) => {
  console.log('| environment | scene | three.js from ours | with our roughness | ours from sums | three.js from sums |\n' +
    '|---|---|---|---|---|---|');
  for (const environment of environments) {
    const picture = read_environment(environment), lamps = picture.lamps(picture.width / 512);
    for (const [file, view] of Object.entries(scenes)) {
      const mine = ours(file, view, environment);
      const [theirs, plain] = (await page.evaluate(async (query) => (await import('/bench/core_page.js')).drawn(...query),
        [`/made/${file}`, view, `/environments/${basename(environment)}`])).map(
        (text) => new Float32Array(Uint8Array.from(Buffer.from(text, 'base64')).buffer));
      const true_of = [new Difference(), new Difference()], cells = [];
      for (const { metal, roughness, places } of file === 'spheres.gltf' ? spheres : []) {
        const [a, b, both] = [new Difference(), new Difference(), new Difference()];
        for (const { at, normal, view: towards } of places) {
          const truth = summed(picture, lamps, normal, towards, metal, roughness);
          [[mine, a, 0], [theirs, b, 1]].forEach(([of, own, which]) => {
            own.add(pixel(of, at), truth);
            true_of[which].add(pixel(of, at), truth);
          });
          both.add(pixel(mine, at), pixel(plain, at));
        }
        cells.push(`${both} ${a} ${b}`);
      }
      console.log(`| ${basename(environment, '.hdr')} | ${basename(file, '.gltf')} | ${compared(mine, theirs)} | ${compared(mine, plain)} | ${true_of[0]} | ` +
        `${true_of[1]} |`);
      if (cells.length > 0) tables.push([basename(environment, '.hdr'), cells]);
    }
  }
});
for (const [name, cells] of tables) {
  console.log(`\n${name}: three.js with our roughness from ours, ours from sums, three.js from sums\n\n| metal | ${ROUGHNESSES.join(' | ')} |\n|---|${ROUGHNESSES.map(() => '---|').join('')}`);
  METALS.forEach((metal, row) => {
    console.log(`| ${metal} | ${cells.slice(row * ROUGHNESSES.length, (row + 1) * ROUGHNESSES.length).join(' | ')} |`);
  });
}

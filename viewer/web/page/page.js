// The page that `selvedge-view page` writes: garments side by side, one camera, two lights that a finger can move, or an
// environment that it turns.
import {
  AmbientLight, Box3, Color, DataTexture, DirectionalLight, LinearFilter, LinearSRGBColorSpace, Mesh, MeshBasicMaterial,
  NeutralToneMapping, PerspectiveCamera, PlaneGeometry, Scene, Vector3, WebGLRenderer
} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {MeshoptDecoder} from 'three/addons/libs/meshopt_decoder.module.js';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {LoadedFabric, SelvedgeFabric, Surroundings, cell_images, use_worker} from '../three/index.js';
import {Clips} from './clips.js';
import {Stage} from './stage.js';

/** The lights of selvedge-view: the other light has this fraction, from the right. */
const OTHER_LIGHT = 0.3, OTHER_PLACE = new Vector3(1, 0.2, 0.7), AMBIENT = 0.1, BACKGROUND = 0.18, BACKDROP = 0.8, DARK = 0.06;
/**
 * While something moves, pixels are twice as wide where a frame takes longer than SLOW ms (--fps); FINEST times finer when all has
 * rested for REST ms and such a frame is expected within LONG ms. Images that come in are shown every SHOW ms.
 */
const FINEST = 2, SLOW = 1000 / Number(document.querySelector('[data-fps]')?.dataset.fps ?? 30), REST = 250, LONG = 2500, SHOW = 250;

const by_id = (id) => document.getElementById(id);
/** The bytes that a text or an element holds by zlib and base64. */
function bytes_of(element) {
  const text = atob((element.textContent ?? element).trim()), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'))).arrayBuffer();
}
const note = (text) => void (by_id('note').textContent += `${text}\n`);

// Edges are smoothed by finer pixels at rest: rasterisers in software shade every sample of a smoothed canvas.
const renderer = new WebGLRenderer({canvas: by_id('view')});
const scene = new Scene(), camera = new PerspectiveCamera(30, 1, 0.01, 100);
const controls = new OrbitControls(camera, renderer.domElement);
const key = new DirectionalLight(), other = new DirectionalLight(), ambient = new AmbientLight();
camera.add(key, key.target, other, other.target);
scene.add(camera, ambient);
ambient.userData.spares_fabrics = true;
scene.background = new Color().setRGB(BACKGROUND, BACKGROUND, BACKGROUND, LinearSRGBColorSpace);
other.position.copy(OTHER_PLACE);

const state = {light: [-0.4, 0.5], turn: 0, fallback: false, level: -1, exposure: 0, ms: Infinity, frames: 0, at_rest: false};
const materials = new Set(), size = {x: 0, y: 0}, drawn_ends = [], loader = new GLTFLoader();
loader.setMeshoptDecoder(MeshoptDecoder);
/** Garments load no fabric of their own where all wear a cloth. */
loader.register((parser) => new class extends SelvedgeFabric {
  fabric(index) {
    return stage.cloth ?? super.fabric(index);
  }
}(parser));
const stage = new Stage({materials, restage, moved});
scene.add(stage.group);
let due = false, drawing = false, keeps_images = false, is_held = false, shade_due = null, rest = 0, shown_at = 0, fine = 1, surroundings = null, compiled = null;

/** Calls end() once all that was drawn is there; the page stays live meanwhile. */
function when_drawn(end) {
  const gl = renderer.getContext(), sync = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  const look = () => {
    if (sync && gl.clientWaitSync(sync, 0, 0) === gl.TIMEOUT_EXPIRED) return setTimeout(look, 4);
    gl.deleteSync(sync);
    end();
  };
  setTimeout(look);
}
function draw() {
  due = false;
  drawing = true;
  const {clientWidth: width, clientHeight: height} = renderer.domElement, ratio = Math.min(devicePixelRatio, 2) * fine;
  // Images are as fine as pixels, of which finer ones smooth edges alone.
  cell_images.supersample = keeps_images ? fine : Math.max(fine, 1);
  // A canvas of another size is another canvas to browsers.
  if (renderer.getPixelRatio() !== ratio) renderer.setPixelRatio(ratio);
  if (size.x !== width || size.y !== height) {
    renderer.setSize(size.x = width, size.y = height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
  }
  const begin = performance.now(), was = fine, ends = drawn_ends.splice(0);
  renderer.render(scene, camera);
  when_drawn(() => {
    drawing = false;
    const ms = performance.now() - begin;
    state.ms = ms / was ** 2;
    ++state.frames;
    for (const end of ends) end();
    by_id('time').textContent = `${ms.toFixed(ms < 10 ? 1 : 0)} ms`;
    if (due) return requestAnimationFrame(draw);
    // While a frame is drawn, its first program would wait for that.
    if (!shade_due || !state.at_rest) return;
    surroundings.shade(renderer, shade_due).then(moved);
    shade_due = null;
  });
}
function redraw() {
  if (!due && !drawing) requestAnimationFrame(draw);
  due = true;
}
/** Draws pixels as fine as time allows at rest. */
function refine() {
  const wanted = FINEST ** 2 * state.ms > LONG ? 1 : FINEST;
  if (fine === wanted) return;
  fine = wanted;
  redraw();
}
/** Lets all that makes the view finer wait for another fabric, whose frames have larger pixels where they take long. */
function hold(held) {
  cell_images.hold(is_held = held);
  clearTimeout(rest);
  by_id('progress').textContent = '';
  if (held) return keeps_images = true;
  fine = 1;
  rest = setTimeout(redraw, REST);
}
/** Asks for images that a frame would ask for. */
function prepare() {
  scene.traverseVisible((object) => {
    if (materials.has(object.material)) object.material.prepare(renderer, scene, camera, object.geometry, object);
  });
}
/** Draws a frame; settled when it is drawn. */
function drawn() {
  if (is_held) fine = Math.min(fine, state.ms > SLOW ? 0.5 : 1);
  redraw();
  return new Promise((end) => drawn_ends.push(end));
}
/** Redraws while something moves. */
function moved() {
  keeps_images = false;
  fine = state.ms > SLOW ? 0.5 : 1;
  clearTimeout(rest);
  rest = setTimeout(() => {
    // The fabric comes first.
    if (state.ms > SLOW && compiled !== true && !state.at_rest) return;
    fine = 1;
    redraw();
    if (state.at_rest) rest = setTimeout(refine, REST);
  }, REST);
  redraw();
}
/** Settled when drawing does not wait for shaders, where the browser reports it. */
async function compile() {
  if (renderer.extensions.has('KHR_parallel_shader_compile')) await renderer.compileAsync(scene, camera);
}
/** Shows how much of the cloth in sight has its images, and draws them. */
function progress({at_rest = false}) {
  state.at_rest = at_rest;
  const is_shown = ({shows, fabric, garment}) => shows === 'fabric' || !fabric || fabric.issue || garment?.state === 'ended' ||
      (at_rest && !garment);
  if (is_held) return;
  const shown = [...materials].every(is_shown), now = performance.now();
  by_id('progress').textContent = shown || state.fallback ? '' : `drawing the yarns: ${Math.round(100 * cell_images.share())} %`;
  if (!at_rest && shown && now < shown_at + SHOW) return;
  if (!shown && !at_rest && materials.size > 0 && state.frames > 0) return;
  compiled ??= shown ? compile().then(() => {
    compiled = true;
    progress({at_rest: cell_images.at_rest()});
  }) : null;
  if (shown && compiled !== true) return;
  shown_at = now;
  redraw();
  if (!at_rest) return;
  clearTimeout(rest);
  rest = setTimeout(refine, REST);
}

/** The environment that the page holds, if any: it takes the place of the lights. */
async function take_environment() {
  const element = document.querySelector('script[data-environment]');
  if (!element) return;
  const width = Number(element.dataset.environment), radiance = new Float32Array(await bytes_of(element));
  surroundings = new Surroundings(scene, {width, height: width / 2, radiance}, {reflects: false});
  ambient.color.setRGB(...surroundings.mean);
  if (element.dataset.backdrop) surroundings.show(Number(element.dataset.backdrop));
  else {
    const dark = matchMedia('(prefers-color-scheme: dark)');
    const paint = () => scene.background.setRGB(...Array(3).fill(dark.matches ? DARK : BACKDROP), LinearSRGBColorSpace);
    dark.addEventListener('change', () => moved(paint()));
    paint();
  }
  renderer.toneMapping = NeutralToneMapping;
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.autoUpdate = false;
  state.turn = Number(element.dataset.turn);
  state.light = [0, 0];
}
/** The shade of the floor under a garment, as `render` has it; seen from above. */
async function floor_of({dataset}) {
  const [x, y, z, width] = dataset.floor.split(',').map(Number), bytes = new Uint8Array(await bytes_of(dataset.shade));
  const side = Math.sqrt(bytes.length), texels = Uint8Array.from({length: 4 * side * side}, (_, k) => bytes[k >> 2]);
  const shade = new DataTexture(texels, side, side);
  shade.minFilter = shade.magFilter = LinearFilter;
  // Its first row lies in the back.
  shade.repeat.set(1, -1);
  shade.offset.set(0, 1);
  shade.needsUpdate = true;
  const black = new MeshBasicMaterial({color: 0, alphaMap: shade, transparent: true, depthWrite: false});
  const floor = new Mesh(new PlaneGeometry(width, width), black);
  floor.rotation.x = -Math.PI / 2;
  floor.position.set(x, y, z);
  floor.userData.x = x;
  floor.renderOrder = -1;
  return floor;
}
/** The garment of an element that selvedge-view writes: { scene, parser, animations, dataset, floor, element }. */
async function load_garment(element) {
  const {dataset} = element, loaded = await loader.parseAsync(await bytes_of(element), '');
  return {...loaded, dataset, floor: dataset.floor && await floor_of(element), element};
}
function dispose_garment({scene: garment, floor}) {
  const free = ({geometry, material}) => [geometry, material, ...Object.values(material ?? {}).filter((value) => value?.isTexture)].forEach((each) => each?.dispose?.());
  garment.traverse(free);
  floor?.traverse(free);
}
function set_light() {
  const [x, y] = state.light, z = Math.sqrt(Math.max(0, 1 - x * x - y * y));
  key.position.set(x, y, z);
  const factor = (surroundings ? 1 : Math.PI) * 2 ** state.exposure;
  key.visible = other.visible = !surroundings;
  ambient.visible = !scene.environment;
  key.intensity = factor;
  other.intensity = OTHER_LIGHT * factor;
  ambient.intensity = (surroundings ? Math.PI : AMBIENT) * factor;
  surroundings?.set({turn: state.turn + 180 * x, strength: factor});
  renderer.shadowMap.needsUpdate = true;
  const [right, up] = state.light.map((fraction) => Math.round(100 * fraction));
  Object.assign(by_id('light'), {ariaValueNow: right, ariaValueText: `${right} % to the right, ${up} % up`});
  by_id('light').style.background = `radial-gradient(circle at ${50 + 48 * x}% ${50 - 48 * y}%, #fff, #222)`;
}
const point_light = ({offsetX, offsetY, target: {clientWidth, clientHeight}}) => turn_light(2 * offsetX / clientWidth - 1, 1 - 2 * offsetY / clientHeight);
function turn_light(x, y) {
  const far = Math.max(1, Math.hypot(x, y));
  state.light = [x / far, y / far];
  set_light();
  moved();
}

/** Lights what is no fabric by all of the environment: three.js prepares it for a second or more. */
function reflect() {
  surroundings?.reflect();
  set_light();
}
/** Shows the fallback or the fabric, and a level of that, as the bar says. */
function show_as_asked() {
  if (state.fallback) reflect();
  for (const material of materials) Object.assign(material, {level: state.level, shows_fabric: !state.fallback});
  by_id('fallback').ariaPressed = state.fallback;
  moved();
}
const turn_fallback = () => show_as_asked(state.fallback = !state.fallback);

/** What is shown of a garment: all, or its element's box, without strays. */
function box_of(garment, {box: held}) {
  const corners = held?.split(',').map(Number);
  if (!corners) return new Box3().setFromObject(garment);
  return new Box3(new Vector3(...corners), new Vector3(...corners.slice(3))).translate(garment.position);
}
/** Puts what is on the stage side by side and the camera before all of it, or where an element says that cloth is not seen edge-on. */
function arrange(moves) {
  let right = 0, side = null;
  for (const {scene, floor} of stage.garments) if (floor) floor.visible = scene.parent === stage.group;
  const shown = stage.group.children.map((garment) => [garment, stage.garments.find(({scene}) => scene === garment) ?? {dataset: {}}]);
  for (const [garment, {dataset, floor}] of shown) {
    const box = box_of(garment, dataset), gap = (box.max.x - box.min.x) * 0.1;
    garment.position.x += right - box.min.x;
    if (floor) floor.position.x = floor.userData.x + garment.position.x;
    right += box.max.x - box.min.x + gap;
    if (dataset.side) side = dataset.side.split(',').map(Number);
  }
  if (!moves) return;
  const all = new Box3();
  for (const [garment, {dataset}] of shown) all.union(box_of(garment, dataset));
  const centre = all.getCenter(new Vector3()), size = all.getSize(new Vector3());
  const aspect = renderer.domElement.clientWidth / renderer.domElement.clientHeight;
  const half = Math.max(size.y, (side ? Math.max(size.x, size.z) : size.x) / aspect, side ? size.z : 0, 1e-6) / 2;
  const distance = half / Math.tan(camera.fov * Math.PI / 360) + size.z / 2;
  camera.position.copy(centre).add(new Vector3(...side ?? [0.3, 0.12, 1]).setLength(1.15 * distance));
  camera.near = distance / 1000;
  camera.far = 20 * distance;
  controls.target.copy(centre);
  controls.minDistance = distance / 200;
  controls.maxDistance = 8 * distance;
  controls.update();
}

async function start() {
  await take_environment();
  set_light();
  const worker = URL.createObjectURL(new Blob([by_id('worker').textContent], {type: 'text/javascript'}));
  use_worker(() => new Worker(worker), await bytes_of(by_id('cells')));
  for (const type of ['change', 'progress']) cell_images.addEventListener(type, progress);
  for (const element of document.querySelectorAll('script[data-garment]')) {
    try {
      const garment = await load_garment(element);
      if (garment.floor) scene.add(garment.floor);
      stage.garments.push(garment);
    } catch (error) {
      note(`${element.dataset.garment}: ${error.message}`);
    }
  }
  for (const element of document.querySelectorAll('script[data-fabric]')) stage.fabrics.push(new LoadedFabric(await bytes_of(element), element.dataset.fabric));
  if (stage.garments.length === 0) await Promise.all(stage.fabrics.map(({settled}) => settled));
  stage.show_all();
  stage.clips = new Clips(stage.garments, () => moved(renderer.shadowMap.needsUpdate = true), drawn);
  await compile();
  moved();
  progress({});
  for (const {fabric} of materials) {
    await fabric.settled;
    if (fabric.issue) note(`${fabric.issue.code}: ${fabric.name}: the fallback is shown`);
  }
  stage.group.traverse(({material}) => material && !(material.fabric && !material.fabric.issue) && reflect());
  progress({});
  const levels = Math.max(0, ...[...materials].map(({fabric}) => fabric.levels));
  by_id('level').replaceChildren(new Option('by distance', '-1'), ...Array.from({length: levels}, (_, k) => new Option(k, k)));

  controls.addEventListener('change', moved);
  addEventListener('resize', moved);
  const pad = by_id('light');
  pad.addEventListener('pointerdown', (event) => point_light(event, pad.setPointerCapture(event.pointerId)));
  pad.addEventListener('pointermove', (event) => event.buttons && point_light(event));
  pad.addEventListener('keydown', ({key}) => {
    const [right, up] = {ArrowRight: [0.1, 0], ArrowLeft: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1]}[key] ?? [0, 0];
    if (right || up) turn_light(state.light[0] + right, state.light[1] + up);
  });
  by_id('fallback').addEventListener('click', turn_fallback);
  by_id('level').addEventListener('change', ({target: {value}}) => show_as_asked(state.level = Number(value)));
  by_id('exposure').addEventListener('input', ({target: {value}}) => {
    state.exposure = Number(value);
    turn_light(...state.light);
  });
  by_id('full').addEventListener('click', () => document.fullscreenElement ? document.exitFullscreen() : document.body.requestFullscreen());
  addEventListener('keydown', ({key, target}) => key === 'f' && !target.closest('input, textarea, select') && turn_fallback());
  moved();
}
/** Shows what stands on the stage now, from before. */
function restage(moves = true) {
  materials.clear();
  stage.group.traverse(({material}) => material?.isFabricMaterial && material.fabric && materials.add(material));
  arrange(moves);
  surroundings?.stand(stage.group);
  renderer.shadowMap.needsUpdate = true;
  shade_due = surroundings ? stage.group : null;
  show_as_asked();
}
/** Draws now, and returns a promise of the picture, a PNG. */
function picture() {
  renderer.render(scene, camera);
  return new Promise((end) => renderer.domElement.toBlob(end));
}
const started = start();
// For tests, for who opens the console, and for pages with more to them.
globalThis.selvedge = {
  state, camera, controls, materials, stage, loader, moved, hold, prepare, drawn, reflect, picture, bytes_of, load_garment, dispose_garment, started
};

// The page that `selvedge-view page` writes: garments side by side, one camera, two lights that a finger can move, or an
// environment that it turns.
import {
  AmbientLight, Box3, Color, DirectionalLight, Group, LinearSRGBColorSpace, PerspectiveCamera, Scene, Vector3,
  WebGLRenderer
} from 'three';
import {OrbitControls} from 'three/addons/controls/OrbitControls.js';
import {MeshoptDecoder} from 'three/addons/libs/meshopt_decoder.module.js';
import {GLTFLoader} from 'three/addons/loaders/GLTFLoader.js';
import {LoadedFabric, SelvedgeFabric, Surroundings, use_worker} from '../three/index.js';

/** The lights of selvedge-view: the other light has this share, from the right. */
const OTHER_LIGHT = 0.3, OTHER_PLACE = new Vector3(1, 0.2, 0.7), AMBIENT = 0.1, BACKGROUND = 0.18;
/**
 * Pixels are so many times wider where a frame takes longer than SLOW ms while something moves. When all has rested for
 * REST ms they are halved, as long as a frame of four times as many is expected within LONG ms.
 */
const FINEST = 0.5, COARSEST = 8, SLOW = 60, REST = 200, LONG = 4000;

const by_id = (id) => document.getElementById(id);
const bytes_of = (element) => Uint8Array.from(atob(element.textContent.trim()), (c) => c.charCodeAt(0)).buffer;
const note = by_id('note');
const tell = (text) => {
  note.textContent += `${text}\n`;
};

// Edges are smoothed by finer pixels at rest: rasterisers in software shade every sample of a smoothed canvas.
const renderer = new WebGLRenderer({canvas: by_id('view')});
const scene = new Scene(), camera = new PerspectiveCamera(30, 1, 0.01, 100);
const controls = new OrbitControls(camera, renderer.domElement);
const key = new DirectionalLight(), other = new DirectionalLight(), ambient = new AmbientLight();
camera.add(key, key.target, other, other.target);
scene.add(camera, ambient);
scene.background = new Color().setRGB(BACKGROUND, BACKGROUND, BACKGROUND, LinearSRGBColorSpace);
other.position.copy(OTHER_PLACE);

const state = {light: [-0.4, 0.5], turn: 0, fallback: false, level: -1, exposure: 0, ms: 0, frames: 0, coarse: COARSEST / 2};
const materials = new Set(), size = {x: 0, y: 0};
let due = false, measured_again = false, rest = 0, surroundings = null;
/** ms that a pixel of the fabric took where it was dearest: by distance, not at a level. */
let cost = Infinity;

function draw() {
  due = false;
  const {clientWidth: width, clientHeight: height} = renderer.domElement;
  const ratio = Math.min(devicePixelRatio, 2) / state.coarse;
  // A canvas of another size is another canvas to browsers.
  if (renderer.getPixelRatio() !== ratio) renderer.setPixelRatio(ratio);
  if (size.x !== width || size.y !== height) {
    renderer.setSize(size.x = width, size.y = height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
  }
  const begin = performance.now();
  renderer.render(scene, camera);
  // The time of a frame ends when its pixels are drawn.
  const gl = renderer.getContext();
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  state.ms = performance.now() - begin;
  if (!state.fallback && state.level < 0) cost = state.ms / (width * height * ratio * ratio);
  ++state.frames;
  by_id('time').textContent = `${state.ms.toFixed(state.ms < 10 ? 1 : 0)} ms`;
}
function next_frame() {
  if (!due) requestAnimationFrame(draw);
  due = true;
  clearTimeout(rest);
  rest = setTimeout(refine, REST);
}
function redraw() {
  measured_again = false;
  next_frame();
}
function refine() {
  const is_slow = 4 * state.ms > LONG;
  // The first frame with a shader includes the time of its compiler.
  if (due || (is_slow && measured_again) || (!is_slow && state.coarse <= FINEST)) return;
  if (is_slow)
    measured_again = true;
  else
    state.coarse /= 2;
  next_frame();
}
/** Redraws while something moves. */
function moved() {
  if (state.ms > SLOW && state.coarse < COARSEST) state.coarse *= 2;
  redraw();
}

/** Redraws a fabric after what was cheaper to draw, in pixels wide enough. */
function redraw_dearer() {
  const {clientWidth: width, clientHeight: height} = renderer.domElement, ratio = Math.min(devicePixelRatio, 2);
  while (state.coarse < COARSEST && cost * width * height * (ratio / state.coarse) ** 2 > LONG) state.coarse *= 2;
  redraw();
}

/** The environment that the page holds, if any: it takes the place of the lights. */
function take_environment() {
  const element = document.querySelector('script[data-environment]');
  if (!element) return;
  const width = Number(element.dataset.environment), radiance = new Float32Array(bytes_of(element));
  surroundings = new Surroundings(scene, {width, height: width / 2, radiance});
  if (element.dataset.backdrop) surroundings.show(Number(element.dataset.backdrop));
  renderer.shadowMap.enabled = true;
  renderer.shadowMap.autoUpdate = false;
  state.turn = Number(element.dataset.turn);
  state.light = [0, 0];
}
function set_light() {
  const [x, y] = state.light, z = Math.sqrt(Math.max(0, 1 - x * x - y * y));
  key.position.set(x, y, z);
  const factor = (surroundings ? 1 : Math.PI) * 2 ** state.exposure;
  key.visible = other.visible = ambient.visible = !surroundings;
  key.intensity = factor;
  other.intensity = OTHER_LIGHT * factor;
  ambient.intensity = AMBIENT * factor;
  surroundings?.set({turn: state.turn + 180 * x, strength: factor});
  renderer.shadowMap.needsUpdate = true;
  const pad = by_id('light').getContext('2d'), shade = pad.createRadialGradient(48 + 46 * x, 48 - 46 * y, 2, 48, 48, 48);
  shade.addColorStop(0, '#fff');
  shade.addColorStop(1, '#222');
  pad.clearRect(0, 0, 96, 96);
  pad.fillStyle = shade;
  pad.arc(48, 48, 47, 0, 2 * Math.PI);
  pad.fill();
}
function point_light(event) {
  const box = by_id('light').getBoundingClientRect();
  const x = (event.clientX - box.left) / box.width * 2 - 1, y = 1 - (event.clientY - box.top) / box.height * 2;
  const far = Math.max(1, Math.hypot(x, y));
  state.light = [x / far, y / far];
  set_light();
  moved();
}

function set_fallback(fallback) {
  state.fallback = fallback;
  for (const material of materials) material.shows_fabric = !fallback;
  by_id('fallback').textContent = fallback ? 'Fallback' : 'Fabric';
  redraw_dearer();
}
function set_level(level) {
  state.level = level;
  by_id('level').value = level;
  for (const material of materials) material.level = level;
  redraw_dearer();
}

/** Puts garments side by side and the camera before all of them. */
function arrange(garments) {
  let right = 0;
  for (const garment of garments) {
    const box = new Box3().setFromObject(garment), gap = (box.max.x - box.min.x) * 0.1;
    garment.position.x += right - box.min.x;
    right += box.max.x - box.min.x + gap;
  }
  const all = new Box3();
  for (const garment of garments) all.expandByObject(garment);
  const centre = all.getCenter(new Vector3()), size = all.getSize(new Vector3());
  const aspect = renderer.domElement.clientWidth / renderer.domElement.clientHeight;
  const half = Math.max(size.y, size.x / aspect, 1e-6) / 2;
  const distance = half / Math.tan(camera.fov * Math.PI / 360) + size.z / 2;
  camera.position.copy(centre).add(new Vector3(0.3, 0.12, 1).setLength(1.15 * distance));
  camera.near = distance / 1000;
  camera.far = 20 * distance;
  controls.target.copy(centre);
  controls.minDistance = distance / 200;
  controls.maxDistance = 8 * distance;
  controls.update();
}

/** Fabrics that all garments can be shown in, beside their own. */
function offer_fabrics(own) {
  const select = by_id('fabric'), elements = [...document.querySelectorAll('script[data-fabric]')];
  if (elements.length === 0) return by_id('of_fabric').remove();
  const others = [null, ...elements.map((element) => new LoadedFabric(bytes_of(element), element.dataset.fabric))];
  for (const fabric of others) select.add(new Option(fabric ? fabric.name : 'its own', String(select.length)));
  select.addEventListener('change', async () => {
    const fabric = others[Number(select.value)];
    await fabric?.settled;
    if (surroundings) await fabric?.want_sky();
    for (const material of materials) material.set_fabric(fabric ?? own.get(material));
    cost = Infinity;
    redraw_dearer();
  });
}

async function start() {
  take_environment();
  set_light();
  const worker = URL.createObjectURL(new Blob([by_id('worker').textContent], {type: 'text/javascript'}));
  use_worker(() => new Worker(worker));
  const loader = new GLTFLoader();
  loader.setMeshoptDecoder(MeshoptDecoder);
  loader.register((parser) => new SelvedgeFabric(parser));
  const garments = [];
  for (const element of document.querySelectorAll('script[data-garment]')) {
    try {
      garments.push((await loader.parseAsync(bytes_of(element), '')).scene);
    } catch (error) {
      tell(`${element.dataset.garment}: ${error.message}`);
    }
  }
  for (const garment of garments)
    garment.traverse(({material}) => material?.isFabricMaterial && materials.add(material));
  const all = new Group().add(...garments);
  scene.add(all);
  arrange(garments);
  surroundings?.stand(renderer, all);
  renderer.shadowMap.needsUpdate = true;
  const own = new Map([...materials].map((material) => [material, material.fabric]));
  for (const {fabric} of materials) {
    await fabric?.settled;
    if (surroundings) await fabric?.want_sky();
    if (fabric?.issue) tell(`${fabric.issue.code}: ${fabric.name}: the fallback is shown`);
  }
  const levels = Math.max(0, ...[...materials].map(({fabric}) => fabric?.levels ?? 0));
  by_id('level').add(new Option('by distance', '-1'));
  for (let k = 0; k < levels; ++k) by_id('level').add(new Option(k, k));
  offer_fabrics(own);

  controls.addEventListener('change', moved);
  addEventListener('resize', redraw);
  const pad = by_id('light');
  pad.addEventListener('pointerdown', (event) => {
    pad.setPointerCapture(event.pointerId);
    point_light(event);
  });
  pad.addEventListener('pointermove', (event) => event.buttons && point_light(event));
  by_id('fallback').addEventListener('click', () => set_fallback(!state.fallback));
  by_id('level').addEventListener('change', (event) => set_level(Number(event.target.value)));
  by_id('exposure').addEventListener('input', (event) => {
    state.exposure = Number(event.target.value);
    set_light();
    redraw();
  });
  by_id('full').addEventListener('click', () =>
    document.fullscreenElement ? document.exitFullscreen() : document.body.requestFullscreen());
  addEventListener('keydown', (event) => {
    if (event.key === 'f') set_fallback(!state.fallback);
  });
  redraw();
}
// For tests, and for who opens the console.
globalThis.selvedge = {state, camera, controls, materials, started: start()};

// The page of `selvedge-view design`: the page of `selvedge-view page`, and a panel with the recipe of its cloth. The cloth is
// made in a worker, by the module of `selvedge make`; the last good one stays until the next is there.
import 'selvedge/page/page.js';
import {LoadedFabric, cell_images} from 'selvedge/three/index.js';
import {element} from './element.js';
import {data_sheet_lines} from './fabric_file.js';
import {build_fields, refuse_value, show_values} from './fields.js';
import {GarmentEditor} from './garment_editor.js';
import {Maker} from './maker.js';
import {
  can_step_history, choose_stitch, command_line, file_name, is_start_recipe, offered_recipes, on_recipe_change, recipe, set_description, set_recipe, set_recipe_of_fabric,
  shell_line, step_history
} from './recipe.js';
import {TextEditor} from './text_editor.js';

const view = globalThis.selvedge, {stage} = view, by_id = (id) => document.getElementById(id);
const STAGES = {relax: 'yarns come to rest', bake: 'light', fit: 'fit'};
/** Bytes that a text and a fabric have at most. */
const TEXT = 16e6, FABRIC = 64e6;
/** Pictures of the list by the names of their stitches, seven in a row. */
const TILED = JSON.parse(by_id('tiled').textContent), TILE = 48;

const state = {making: false, shown: 0, preview_ms: null, made_ms: 0, shown_ms: 0, relaxed: 0, bytes: null, refusal: ''};
/** The bytes of the cloth that is made, or of the last whole one. */
let making = null, last_fabric = null, resolve_current = null, garment = null, fabrics = [];

/** The commands that make the cloth, and dress a garment of the user in it. */
function command() {
  return command_line() + (garment?.file_name ? `\n${shell_line(['selvedge', ...garment.words()])}` : '');
}
function show_recipe() {
  const offer = offered_recipes.find(({stitch, text}) => stitch === recipe.stitch && (text === undefined) === (recipe.text === undefined));
  for (const input of by_id('stitches').querySelectorAll('input')) input.checked = input.value === offer?.stitch;
  const chosen = by_id('stitches').querySelector('label:has(:checked)'), {scrollTop, clientHeight, offsetTop} = by_id('stitches');
  const below = chosen && chosen.offsetTop - offsetTop;
  if (chosen && (below < scrollTop || below + chosen.clientHeight > scrollTop + clientHeight)) by_id('stitches').scrollTop = below - clientHeight / 2;
  by_id('name').textContent = file_name();
  by_id('about').textContent = offer?.description ?? '';
  editor.show(recipe);
  show_values();
  by_id('undo').disabled = !can_step_history(-1);
  by_id('redo').disabled = !can_step_history(1);
  by_id('command').value = command();
}
/** Shows a line of the module where the control is that it speaks of. */
function refuse(line) {
  state.refusal = line;
  const is_shown = [editor.refuse(line), refuse_value(line)].some(Boolean);
  by_id('refusal').textContent = is_shown ? '' : line;
}

const show_progress = (text) => by_id('made').textContent = text;
const maker = new Maker({
  describe: set_description, progress: (stage, fraction) => state.making && show_progress(`making: ${STAGES[stage]}, ${Math.round(100 * fraction)} %`),
  relaxed: () => ++state.relaxed, bytes_of: (id) => view.bytes_of(by_id(id))
});
/** The bytes of the cloth, once they are made. */
const made_bytes = () => state.bytes ?? (state.making ? making : making = make());
/** Makes the cloth of the recipe and shows it, a preview first; a promise of the bytes of its file, null where it was refused or another began. */
function make() {
  resolve_current?.(null);
  const begin = performance.now();
  Object.assign(state, {making: true, bytes: null, preview_ms: null});
  refuse('');
  show_progress('making …');
  view.hold(true);
  return new Promise(async (end) => {
    resolve_current = end;
    const is_over = () => resolve_current !== end;
    const preview = await maker.ask({recipe, whole: false});
    if (is_over()) return;
    if (preview.bytes && await show(preview.bytes, is_over, false)) state.preview_ms = performance.now() - begin;
    if (is_over()) return;
    const {refusal, bytes} = await maker.ask({recipe, whole: true});
    if (is_over()) return;
    if (refusal !== undefined) {
      if (last_fabric && preview.bytes) await show(last_fabric, is_over);
      state.making = false;
      view.hold(false);
      show_progress('');
      refuse(refusal);
      return end(null);
    }
    Object.assign(state, {bytes, made_ms: performance.now() - begin});
    end(last_fabric = bytes);
    if (!await show(bytes, is_over)) return;
    view.hold(false);
    ++state.shown;
    Object.assign(state, {making: false, shown_ms: performance.now() - begin});
    show_progress(`made in ${(state.made_ms / 1000).toFixed(1)} s, ${Math.round(bytes.length / 1000)} KB`);
  });
}
const show_sheet = (fabric, bytes) => by_id('sheet').replaceChildren(
  ...data_sheet_lines(fabric, bytes.length).flatMap(([name, value]) => [element('dt', {textContent: name}), element('dd', {textContent: value})]));
/** Shows a fabric, a preview or whole; whether it was seen before is_over(). */
async function show(bytes, is_over, is_whole = true) {
  await view.started;
  const fabric = new LoadedFabric(bytes.slice().buffer, recipe.stitch), last = fabrics.at(-1);
  await fabric.settled;
  if (is_over() || fabric.issue) return fabric.dispose();
  const is_as_large = String(last.mm_per_repeat) === String(fabric.mm_per_repeat) && [...view.materials].every((material) => material.fabric === last);
  const shown = stage.cloth = is_as_large ? last : fabric;
  if (is_whole) show_sheet(fabric, bytes);
  for (const material of view.materials) {
    if (!is_as_large) material.set_fabric(fabric, {keeps: true});
    if (is_whole) stage.fit_material(material, fabric);
  }
  if (is_as_large) cell_images.replace(last, fabric);
  else {
    fabrics.push(fabric);
    view.prepare();
  }
  const is_shown = () => cell_images.shows(shown) &&
      [...view.materials].every(({garment}) => garment?.fabric === shown && ['shown', 'ended'].includes(garment.state));
  return new Promise((end) => {
    const look = () => {
      if (!is_over() && !is_shown()) {
        if (!is_as_large) view.prepare();
        if (!is_shown()) return;
      }
      cell_images.removeEventListener('change', look);
      // Images of a fabric may be shown until the one after the next asks for its own.
      if (fabrics.length > 2) fabrics.shift().dispose();
      if (is_over()) return end(false);
      view.drawn().then(() => end(!is_over()));
    };
    cell_images.addEventListener('change', look);
  });
}

function save(blob, name) {
  const link = element('a', {href: URL.createObjectURL(blob), download: name});
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}
/** A tile of the list: a picture and a name. */
function tile_of(offer) {
  const {stitch, description} = offer, name = stitch.replace(/\.\w+$/, ''), number = TILED.indexOf(name);
  const input = element('input', {type: 'radio', name: 'stitch', value: stitch, onchange: () => choose_stitch(offer)});
  const picture = element('span', {className: 'picture'});
  picture.style.backgroundPosition = `${-TILE * (number % 7)}px ${-TILE * Math.floor(number / 7)}px`;
  if (number < 0) picture.style.backgroundImage = 'none';
  return element('label', {title: description}, input, picture, name);
}
by_id('stitches').append(...offered_recipes.map(tile_of));
const on_click = (id, act) => by_id(id).addEventListener('click', act);
on_click('undo', () => step_history(-1));
on_click('redo', () => step_history(1));
addEventListener('keydown', (event) => {
  if (!(event.ctrlKey || event.metaKey)) return;
  const by = {z: event.shiftKey ? 1 : -1, y: 1}[event.key.toLowerCase()];
  if (!by) return;
  event.preventDefault();
  step_history(by);
});
on_click('save_fabric', async () => {
  const name = file_name(), bytes = await made_bytes();
  if (bytes) save(new Blob([bytes], {type: 'image/x-exr'}), `${name}.fabric.exr`);
});
on_click('save_garment', async () => {
  const name = file_name(), bytes = await made_bytes();
  if (bytes) save(new Blob([await garment.dressed_glb(bytes)], {type: 'model/gltf-binary'}), `${garment.name}.${name}.glb`);
});
/** Shows a line that is not about the recipe. */
const show_message = (line) => by_id('refusal').textContent = line;
/** Takes a fabric, a garment, a chart, draft or description that the user opens or drops. */
async function open(file) {
  const ending = file.name.toLowerCase().match(/\.\w+$/)?.[0];
  try {
    if (ending === '.exr') await open_fabric(file);
    else if (ending === '.glb') {
      await dress(file.name, (cloth) => garment.open_file(file, cloth));
      by_id('parts').parentElement.open = true;
    } else if (['.txt', '.wif', '.json'].includes(ending)) {
      if (file.size > TEXT) throw new Error(`has ${file.size} bytes, a chart or draft here has at most ${TEXT}`);
      set_recipe({stitch: file.name, text: (await file.text()).replaceAll('\r\n', '\n'), set: {}});
    } else throw new Error('is no fabric (.exr), garment (.glb), chart (.txt), draft (.wif) or description (.json)');
  } catch ({message}) {
    show_message(`${file.name}: ${message}`);
  }
}
async function open_fabric(file) {
  if (file.size > FABRIC) throw new Error(`has ${Math.round(file.size / 1e6)} MB, a fabric here has at most ${FABRIC / 1e6} MB`);
  const fabric = new LoadedFabric(await file.arrayBuffer(), file.name);
  await fabric.settled;
  const {issue, recipe: found} = fabric;
  fabric.dispose();
  if (issue) throw new Error(`${issue.place ? `${issue.place}: ` : ''}${issue.message} [${issue.code}]`);
  set_recipe_of_fabric(found);
}
/** Lets change(bytes) dress the garment in the cloth, and shows the report. */
async function dress(name, change) {
  show_message(`dressing ${name} …`);
  const refusal = await change(await made_bytes() ?? last_fabric).then(() => null, ({message}) => `${name}: ${message}`);
  show_parts();
  show_message(refusal ?? '');
}
/** Checkboxes of the garment's materials, with what `dress` says of them. */
function show_parts() {
  const remarks = garment.remarks.map((textContent) => element('small', {textContent})), parts = garment.parts.map((part) => {
    const input = element('input', {type: 'checkbox', checked: part.wears});
    input.onchange = () => dress(part.name, (cloth) => garment.set_wears(part, input.checked, cloth));
    return element('p', {}, element('label', {}, input, part.name), element('small', {textContent: part.about}));
  });
  by_id('parts').replaceChildren(...parts, ...remarks);
  by_id('command').value = command();
}
by_id('tint').addEventListener('change', () => garment?.file_name && dress(garment.file_name, garment.dress_again));
on_click('open', () => by_id('file').click());
by_id('file').addEventListener('change', async ({target}) => {
  for (const file of target.files) await open(file);
  target.value = '';
});
addEventListener('dragover', (event) => event.preventDefault());
addEventListener('drop', async (event) => {
  event.preventDefault();
  for (const file of event.dataTransfer.files) await open(file);
});
on_click('save_picture', async () => save(await view.picture(), `${file_name()}.png`));
on_click('copy', async () => {
  by_id('command').select();
  await navigator.clipboard?.writeText(command()).catch(() => {});
});
const editor = new TextEditor((text) => set_recipe({...recipe, text}));
on_recipe_change((is_other, makes = true) => {
  if (is_other) build_fields();
  show_recipe();
  if (makes) making = make();
});
build_fields();
show_recipe();
view.started.then(async () => {
  garment = new GarmentEditor(view, new Maker({bytes_of: (id) => view.bytes_of(by_id(id))}));
  [{fabric: stage.cloth}] = view.materials;
  show_parts();
  const bytes = await garment.first_fabric();
  if (bytes && state.bytes === null && !state.making) show_sheet(stage.cloth, state.bytes = bytes);
  last_fabric = state.bytes;
  fabrics = [stage.cloth];
  if (!is_start_recipe()) making = make();
  else if (!state.making) maker.ask({recipe, whole: false});
});
view.design = {state, recipe: () => recipe, open};

// The page of `selvedge-view design`: the page of `selvedge-view page`, and a panel with the recipe of its cloth. The cloth is
// made in a worker, by the command that the page shows; the last good one stays until the next is there.
import {Color} from 'three';
import 'selvedge/page/page.js';
import {LoadedFabric, cell_images} from 'selvedge/three/index.js';
import {element} from './element.js';
import {build_fields, refuse_value, show_values} from './fields.js';
import {GarmentEditor} from './garment_editor.js';
import {Maker} from './maker.js';
import {keep_file} from './opened_files.js';
import {
  can_step_history, choose_stitch, command_line, file_name, garment_name, is_start_recipe, make_run, names, offered_recipes, on_change, own_name, recipe, set_description, set_recipe, set_recipe_of_fabric,
  set_worn, shell_line, step_history, worn
} from './recipe.js';
import {TextEditor} from './text_editor.js';

const view = globalThis.selvedge, {stage} = view, by_id = (id) => document.getElementById(id);
/** Stages of a make, and the milliseconds that each took last. */
const STAGES = {relax: ['yarns come to rest', 500], bake: ['light falls on them', 1000], fit: ['written as a fabric', 300]}, WHITE = '#ffffff';
const HELD_OUT = 'How well it tells light that it was not made from: by size, the finest first, then the yarn close by; 30 dB is well';
/** Milliseconds of a make before which an edit of the last cloth, or its new colours, are shown whole. */
const LONG = 15000;
/** Bytes that files of each kind have at most. */
const LARGEST = {exr: 64e6, glb: 128e6, txt: 16e6, wif: 16e6, json: 16e6, png: 16e6};
/** Pictures of the list by the names of their stitches, seven in a row. */
const TILED = JSON.parse(by_id('tiled').textContent), TILE = 48;

const state = {making: false, stage: '', stage_began: 0, shown: 0, preview_ms: null, made_ms: 0, shown_ms: 0, relaxed: 0, bytes: null, refusal: ''};
/** The bytes of the cloth that is made, or of the last whole one. */
let making = null, last_fabric = null, last_recipe = recipe, resolve_current = null, garment = null, fabrics = [];

/** The commands that make the cloth, and dress a garment of the user in it. */
function command() {
  return command_line() + (garment && worn.file ? `\n${shell_line(['selvedge', ...garment.words()])}` : '');
}
function show_recipe(is_other = true) {
  const offer = offered_recipes.find(({stitch, text}) => stitch === recipe.stitch && (text === undefined) === (recipe.text === undefined));
  for (const input of by_id('stitches').querySelectorAll('input')) input.checked = input.value === offer?.stitch;
  const list = by_id('stitches'), tile = list.querySelector('label:has(:checked)');
  // The list alone: a page that scrolls moves buttons from under a finger.
  if (is_other && tile) list.scrollTop = Math.max(tile.offsetTop + tile.offsetHeight - list.clientHeight, Math.min(list.scrollTop, tile.offsetTop));
  by_id('name').textContent = own_name();
  by_id('sides').checked = recipe.sides === 'both';
  by_id('about').textContent = offer?.description ?? '';
  editor.show(recipe);
  show_values();
  by_id('undo').disabled = !can_step_history(-1);
  by_id('redo').disabled = !can_step_history(1);
  by_id('command').value = command();
}
/** A line of the program; its code, by which the documentation explains it, is a title. */
function show_message(line) {
  const [, text, code] = line.match(/^([^]*?)(?: \[([A-Z_]+)\])?$/);
  Object.assign(by_id('refusal'), {textContent: text, title: code ? `${code} in the documentation` : ''});
}
/** Shows a line of the program where the control is that it speaks of. */
function refuse(line) {
  state.refusal = line;
  const short = line.replace(/ \[[A-Z_]+\]$/, ''), is_shown = [editor.refuse(short), refuse_value(short)].some(Boolean);
  show_message(is_shown ? '' : line);
}

const show_progress = (text) => by_id('made').textContent = text;
/** Shows a stage, and how long the rest takes if what follows it takes as long as last. */
function progress(stage, fraction) {
  const now = performance.now(), [name] = STAGES[stage], later = Object.keys(STAGES).slice(Object.keys(STAGES).indexOf(stage) + 1);
  if (state.stage !== stage) Object.assign(state, {stage, stage_began: now});
  if (fraction > 0.05) STAGES[stage][1] = (now - state.stage_began) / fraction;
  const left = later.reduce((sum, next) => sum + STAGES[next][1], (1 - fraction) * STAGES[stage][1]);
  if (state.making) show_progress(`making: ${name}, ${Math.round(100 * fraction)} %, about ${Math.ceil(left / 1000)} s left`);
}
const page = {progress, relaxed: () => ++state.relaxed, bytes_of: (id) => view.bytes_of(by_id(id))};
/** Programs that make, dress and read: none waits for another. */
const [maker, dresser, reader] = [1, 2, 3].map(() => new Maker(page));
/** A promise of the bytes that a make_run() makes, or of null and the line of the refusal. */
const made_by = ({argv, files}, entry) => maker.run(argv, files, entry).then(({files: made}) => [made.get(argv.at(-1))], ({message}) => [null, `${argv[1]}: ${message}`]);
/** The parts of a recipe by which its yarn comes to rest: all but colours. */
const shape_of = ({text, set, ...rest}) => JSON.stringify([rest, text?.replace(/albedo=\S+/g, ''), Object.entries(set).filter(([name]) => !/colour$|albedo$/.test(name))]);
/** How the cloth of a recipe comes from another's: 'recolour' in other colours, 'edit' of few rows; null anew. */
function way_from(last, next) {
  if (shape_of(last) === shape_of(next)) return 'recolour';
  const [rows, others] = [last, next].map(({text}) => text?.split('\n') ?? []), other = rows.filter((row, i) => row !== others[i]).length;
  return rows.length === others.length && 4 * other <= rows.length && shape_of({...last, text: ''}) === shape_of({...next, text: ''}) ? 'edit' : null;
}
/** The bytes of the cloth, once they are made. */
const made_bytes = () => state.bytes ?? (state.making ? making : making = make());
/** Makes the cloth of the recipe and shows it, a preview first; a promise of the bytes of its file, null where it was refused or another began. */
function make() {
  resolve_current?.(null);
  const begin = performance.now(), run = make_run(), made_recipe = recipe, {argv, files} = run;
  const way = last_fabric && way_from(last_recipe, recipe);
  const from_last = way && {argv: [...argv.slice(0, 2), '--recolour', 'last.fabric.exr', ...argv.slice(2)], files: {...files, 'last.fabric.exr': last_fabric}};
  Object.assign(state, {making: true, stage: '', bytes: null, preview_ms: null});
  refuse('');
  show_progress('making …');
  view.hold(true);
  return new Promise(async (end) => {
    resolve_current = end;
    const is_over = () => resolve_current !== end;
    const [preview] = await made_by(from_last || run, way === 'recolour' ? 'tint' : 'preview');
    if (is_over()) return;
    let is_made = false;
    const seen = preview && show(preview, () => is_over() || is_made, false).then((was_seen) => {
      if (was_seen) state.preview_ms = performance.now() - begin;
    });
    // A preview whose images are long in coming does not keep the whole waiting.
    await Promise.race([seen, new Promise((later) => setTimeout(later, 2000))]);
    if (is_over()) return;
    state.stage = '';
    if (way && state.made_ms > LONG) {
      const [edited] = await made_by(from_last, way);
      if (is_over()) return;
      if (edited) await show(edited, is_over, false);
      if (is_over()) return;
      state.stage = '';
    }
    const [bytes, refusal] = await made_by(run);
    is_made = true;
    if (is_over()) return;
    if (!bytes) {
      if (last_fabric && preview) await show(last_fabric, is_over);
      state.making = false;
      view.hold(false);
      show_progress('');
      refuse(refusal);
      return end(null);
    }
    Object.assign(state, {bytes, made_ms: performance.now() - begin});
    last_recipe = made_recipe;
    end(last_fabric = bytes);
    if (!await show(bytes, is_over)) return;
    view.hold(false);
    ++state.shown;
    Object.assign(state, {making: false, shown_ms: performance.now() - begin});
    show_progress(`made in ${(state.made_ms / 1000).toFixed(1)} s, ${Math.round(bytes.length / 1000)} KB`);
  });
}
/** Shows what the fabric says of itself: members of its `sheet` (spec/fabric.md), its repeat and accuracy. */
function show_sheet({sheet, mm_per_repeat, accuracy: {front, yarn}}, {length}) {
  const number = (x) => typeof x === 'number' ? String(Number(x.toPrecision(3))) : String(x), words = (name) => name.replace(/[A-Z]/g, (c) => ` ${c.toLowerCase()}`).replace(' db', ', dB');
  const lines = {...sheet, repeatMm: mm_per_repeat, accuracyDb: [front, yarn ?? []].flat().filter(Number.isFinite), kilobytes: length / 1000};
  by_id('sheet').replaceChildren(...Object.entries(lines).flatMap(([name, value]) =>
    [element('dt', {textContent: words(name), title: name === 'accuracyDb' ? HELD_OUT : ''}), element('dd', {textContent: [value ?? 'unknown'].flat().map(number).join(', ')})]));
}
/** Shows a fabric, a preview or whole; whether it was seen before is_over(). */
async function show(bytes, is_over, is_whole = true) {
  await view.started;
  const fabric = new LoadedFabric(bytes.slice().buffer, recipe.stitch), last = fabrics.at(-1);
  await fabric.settled;
  if (is_over() || fabric.issue) return fabric.dispose();
  const is_as_large = String([last.mm_per_repeat, last.tiles]) === String([fabric.mm_per_repeat, fabric.tiles]) && [...view.materials].every((material) => material.fabric === last);
  const shown = stage.cloth = is_as_large ? last : fabric;
  if (is_whole) show_sheet(fabric, bytes);
  for (const material of view.materials) {
    if (!is_as_large) material.set_fabric(fabric, {keeps: true});
    if (is_whole) stage.fit_material(material, fabric);
  }
  if (is_as_large) cell_images.replace(last, fabric);
  else {
    // Previews that were not seen would take the room of its images.
    const seen = [...view.materials].map(({garment}) => garment?.fabric);
    fabrics = [...fabrics.filter((other) => seen.includes(other) || other.dispose()), fabric];
    view.prepare();
  }
  const is_shown = () => cell_images.shows(shown) &&
      [...view.materials].every(({garment}) => garment?.fabric === shown && ['shown', 'ended'].includes(garment.state));
  return new Promise((end) => {
    const look = () => {
      if (!is_over() && !is_shown()) {
        // Garments of a preview that was not seen are not ready to be drawn yet, though the fabric is as large.
        view.prepare();
        if (!is_shown()) return;
      }
      clearInterval(timer);
      cell_images.removeEventListener('change', look);
      if (is_over()) return end(false);
      view.drawn().then(() => end(!is_over()));
    };
    cell_images.addEventListener('change', look);
    // A garment that is prepared late tells of no change.
    const timer = setInterval(look, 200);
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
  return element('label', {title: description}, input, picture, name);
}
by_id('stitches').append(...offered_recipes.map(tile_of));
const on_click = (id, act) => by_id(id).addEventListener('click', act);
on_click('undo', () => step_history(-1));
on_click('redo', () => step_history(1));
addEventListener('keydown', (event) => {
  const by = (event.ctrlKey || event.metaKey) && {z: event.shiftKey ? 1 : -1, y: 1}[event.key.toLowerCase()];
  if (by) event.preventDefault(), step_history(by);
});
/** Lets a button save what file_of(name, bytes) makes of the cloth's bytes. */
const saves = (id, file_of) => on_click(id, async () => {
  const name = file_name(), bytes = await made_bytes();
  if (bytes) await file_of(name, bytes).then((made) => save(...made), ({message}) => show_message(message));
});
saves('save_fabric', async (name, bytes) => [new Blob([bytes], {type: 'image/x-exr'}), `${name}.fabric.exr`]);
saves('save_garment', async (name, bytes) => [new Blob([await garment.dressed_glb(bytes)], {type: 'model/gltf-binary'}), `${garment_name()}.${name}.glb`]);
/** Takes a fabric, a garment, a chart, draft, picture or description that the user opens or drops. */
async function open(file) {
  const {name, size} = file, [, ending] = name.toLowerCase().match(/\.(\w+)$/) ?? [], bytes = async () => new Uint8Array(await file.arrayBuffer());
  const report_of = async (...words) => (await reader.run_next([...words, name], {[name]: await bytes()})).report;
  try {
    if (!LARGEST[ending]) throw new Error('is no fabric (.exr), garment (.glb), chart or instructions (.txt, .png), draft (.wif) or description (.json)');
    const megabytes = (count) => `${Math.round(count / 1e6)} MB`, by_program = ending === 'glb' ? `: selvedge dress '${name}' dresses it` : '';
    if (size > LARGEST[ending]) throw new Error(`has ${megabytes(size)}, this page takes ${megabytes(LARGEST[ending])}${by_program}`);
    if (ending === 'exr') set_recipe_of_fabric((await report_of('info')).content.recipe);
    else if (ending === 'png') set_recipe({stitch: name.replace(/\.\w+$/, '.txt'), text: (await report_of('stitch', '--list')).cells.chart, set: {}});
    else if (ending === 'glb') {
      const key = [name, size, file.lastModified].join();
      await keep_file(key, await bytes());
      if (await dress({key, file: name, tint: worn.tint})) by_id('garment').open = true;
    } else set_recipe({stitch: name, text: (await file.text()).replaceAll('\r\n', '\n'), set: {}});
  } catch ({message}) {
    show_message(`${name}: ${message}`);
  }
}
async function open_all(files) {
  for (const file of files) await open(file);
}
let dressing = Promise.resolve();
/** Dresses a garment in the cloth after what is dressed yet, and shows the report; whether that went well. `takes`: it is a change. */
const dress = (next, takes = true) => dressing = dressing.catch(() => {}).then(async () => {
  const name = next.file ?? 'garment';
  show_message(`dressing ${name} …`);
  const refusal = await garment.show(next, await made_bytes() ?? last_fabric).then(() => null, ({message}) => `${name}: ${message}`);
  if (refusal === null && takes) set_worn(next);
  show_worn();
  show_message(refusal ?? '');
  return refusal === null;
});
/** Shows the tint, and check boxes of the garment's materials with what `dress` says of them. */
function show_worn() {
  const remarks = garment.remarks.map((textContent) => element('small', {textContent})), parts = garment.parts.map(({index, name, wears, about}) => {
    const input = element('input', {type: 'checkbox', checked: wears});
    input.onchange = () => dress({...worn, choices: {...worn.choices, [index]: input.checked}});
    return element('p', {}, element('label', {}, input, name), element('small', {textContent: about}));
  });
  by_id('parts').replaceChildren(...parts, ...remarks);
  by_id('command').value = command();
  by_id('tint').value = worn.tint ?? WHITE;
  const tint = worn.tint ? new Color(worn.tint).toArray() : null;
  if (String(tint) === String(stage.tint_colour)) return;
  stage.tint_colour = tint;
  stage.put_on_cloth();
}
by_id('tint').addEventListener('change', ({target: {value}}) => dress({...worn, tint: value === WHITE ? undefined : value}));
by_id('sides').addEventListener('change', ({target: {checked}}) => set_recipe({...recipe, sides: checked ? 'both' : undefined}));
by_id('all').addEventListener('change', ({target: {checked}}) => document.body.classList.toggle('all', checked));
by_id('search').addEventListener('input', ({target: {value}}) => {
  const words = value.toLowerCase().split(/\s+/);
  for (const tile of by_id('stitches').children) tile.hidden = !words.every((word) => `${tile.textContent} ${tile.title}`.toLowerCase().includes(word));
});
on_click('open', () => by_id('file').click());
by_id('file').addEventListener('change', ({target}) => open_all([...target.files]).then(() => target.value = ''));
addEventListener('dragover', (event) => event.preventDefault());
addEventListener('drop', (event) => {
  event.preventDefault();
  open_all([...event.dataTransfer.files]);
});
on_click('save_picture', async () => save(await view.picture(), `${file_name()}.png`));
on_click('copy', async () => {
  by_id('command').select();
  await navigator.clipboard?.writeText(command()).catch(() => {});
});
const editor = new TextEditor(
  (text) => set_recipe({...recipe, text}),
  (name, text) => reader.run_next(['stitch', name, '--list'], {[name]: new TextEncoder().encode(text)}).catch((error) => error).then(({report}) => {
    const {stitch, description, parameters, cells} = report ?? {};
    names.set(name, description ?? cells?.name);
    if (name === recipe.stitch) by_id('name').textContent = own_name();
    if (parameters && name === recipe.stitch && text === recipe.text) set_description({stitch, description, parameters});
    return cells;
  }));
on_change(({is_other, makes}) => {
  if (is_other) build_fields();
  show_recipe(is_other);
  if (makes) making = make();
  if (garment && !garment.shows(worn)) dress(worn, false);
  else if (garment) show_worn();
});
build_fields();
show_recipe();
view.started.then(async () => {
  garment = new GarmentEditor(view, dresser);
  [{fabric: stage.cloth}] = view.materials;
  show_worn();
  const bytes = await garment.first_fabric();
  if (bytes && state.bytes === null && !state.making) show_sheet(stage.cloth, state.bytes = bytes);
  [last_fabric, last_recipe] = [state.bytes, recipe];
  fabrics = [stage.cloth];
  if (!is_start_recipe()) making = make();
  else if (!state.making) made_by(make_run(), 'preview');
  if (!garment.shows(worn)) dress(worn, false);
});
view.design = {state, recipe: () => recipe, open};

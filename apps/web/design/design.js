// The page of `selvedge-view design`: the page of `selvedge-view page`, and a panel with the recipe of its cloth. The cloth is
// made in a worker, by the module of `selvedge make`; the last good one stays until the next is there.
import 'selvedge/page/page.js';
import {LoadedFabric, cell_images} from 'selvedge/three/index.js';
import {MAX_SHAPES} from '../../../converter/web/make.mjs';
import {element} from './element.js';
import {make_editor} from './text_editor.js';

const view = globalThis.selvedge, by_id = (id) => document.getElementById(id);
const {first, described, kinds, stitches: list} = JSON.parse(by_id('recipes').textContent);
/** Recipes that the list offers: built-in stitches, and texts with the remarks that they begin with. */
const offers = [...list.map(({stitch, description}) => ({stitch, description}))];
for (const [stitch, text] of Object.entries(JSON.parse(by_id('samples').textContent)))
  offers.push({stitch, text, description: text.match(/^([#;].*\n)+/)?.[0].replace(/^[#;]\s*/gm, '').replaceAll('\n', ' ') ?? ''});
/** Stitches with their parameters: built in, and texts once the module has told theirs. */
const stitches = new Map([...list, described].map((stitch) => [stitch.stitch, stitch]));
/** Parameters are in the first group whose pattern their name has. */
const GROUPS = [
  ['Colours', /colour$|albedo|melange|marl/], ['Gauge', /wale|course|spacing|slack|tightness|repeats/],
  ['Fibre', /yarn$|fibre|hair|irregularity|packing|transmission/], ['Finish', /gloss|roughness|lustre|flattening|seed/], ['Yarn', /./]
];
const OPEN = new Set(['Colours', 'Gauge']);
const UNITS = [[/twist_per_mm$/, 'turns/mm'], [/_mm$/, 'mm'], [/_degrees$/, 'degrees'], [/tex$/, 'g/km'], [/hairiness$/, 'mm/mm']];
const STAGES = ['yarns come to rest', 'light', 'fit'];
/** Ranges up to this wide have a slider. */
const SLIDER = 100;
const STORE = `selvedge design ${location.pathname}`;

const is_colour = ({value}) => value.length === 3, is_kind = ({name}) => name.endsWith('yarn');
const all_parameters = () => stitches.get(recipe.stitch)?.parameters ?? [];
/** The colours of a stitch's yarns; where it has one yarn, the colour of all is the same and stands for it. */
const colours = () => all_parameters().filter(({name}) => name.endsWith('albedo'));
const parameters = () => all_parameters().filter(({name}) => name !== 'albedo' || colours().length > 1);
const hex_of = (linear) => '#' + linear.map((x) => Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055))
  .toString(16).padStart(2, '0')).join('');
/** A default as text; empty where it follows the kind of yarn, which is set. */
function default_of(parameter) {
  const {name, value: [value], byKind: by_kind} = parameter;
  if (is_kind(parameter)) return kinds[value];
  if (name === 'colour') return hex_of(colours()[0]?.value ?? parameter.value);
  if (is_colour(parameter)) return recipe.set.colour ?? hex_of(parameter.value);
  const follows = by_kind && Object.keys(recipe.set).some((set) => set.endsWith('yarn'));
  return follows ? '' : String(Number(value.toPrecision(4)));
}

/** A recipe that the page has kept, where the browser lets it. */
function kept() {
  try {
    const found = JSON.parse(localStorage.getItem(STORE));
    const is_known = typeof found?.text === 'string' || stitches.has(found?.stitch);
    return is_known && typeof found.set === 'object' ? found : null;
  } catch {
    return null;
  }
}
function keep() {
  try {
    localStorage.setItem(STORE, JSON.stringify(recipe));
  } catch {
    // Forbidden: nothing is kept.
  }
}

const start = {set: {}, ...first}, state = {making: false, shown: 0, preview_ms: null, made_ms: 0, shown_ms: 0, bytes: null, refusal: ''};
let recipe = kept() ?? start, history = [JSON.stringify(recipe)], now = 0;

/** The name of the files of a cloth. */
const file_name = () => recipe.stitch.replace(/\.\w+$/, '');
/** The words of `selvedge make` that make this cloth, after the text that it is made of. */
function command() {
  const quoted = (word) => /^[\w.,=+-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
  const words = Object.entries(recipe.set).flatMap(([name, value]) => ['--set', `${name}=${value}`]);
  const line = ['selvedge', 'make', recipe.stitch, ...words, '-o', `${file_name()}.fabric.exr`].map(quoted).join(' ');
  if (recipe.text === undefined) return line;
  return `cat > ${quoted(recipe.stitch)} << 'END_OF_TEXT'\n${recipe.text}${recipe.text.endsWith('\n') ? '' : '\n'}END_OF_TEXT\n${line}`;
}

/** Takes another recipe, which can be undone. */
function change(next) {
  if (JSON.stringify(next) === history[now]) return;
  history.splice(++now, Infinity, JSON.stringify(next));
  take(next);
}
function step(by) {
  if (!history[now + by]) return;
  take(JSON.parse(history[now += by]));
}
function take(next) {
  const is_other = next.stitch !== recipe.stitch;
  recipe = next;
  keep();
  if (is_other) build();
  show_recipe();
  make();
}
function set(name, value) {
  const {[name]: before, ...rest} = recipe.set;
  change({...recipe, set: value === null ? rest : {...rest, [name]: value}});
}

/** Rows of the panel, by the name of their parameter. */
const rows = new Map();

function kind_buttons(name) {
  const buttons = kinds.map((kind) => element('button', {textContent: kind, onclick: () => set(name, kind)}));
  return {
    field: element('div', {className: 'kinds', role: 'group', ariaLabel: name.replaceAll('_', ' ')}, ...buttons),
    show: (value) => buttons.forEach((button) => button.ariaPressed = String(button.textContent === value)),
  };
}
function number_fields({name, range: [min, max]}, id, help) {
  const has_slider = max - min <= SLIDER;
  const take = (text) => set(name, text === '' || !Number.isFinite(Number(text)) ? null : Number(text));
  const field = element('input', {id, type: 'text', inputMode: 'decimal', onchange: () => take(field.value)});
  const step = max - min <= 1 ? 0.01 : max - min <= 10 ? 0.1 : 1, ariaLabel = `${name.replaceAll('_', ' ')}, slider`;
  const slider = has_slider && element('input', {
    type: 'range', min: Math.floor(min), max, step, ariaLabel, oninput: () => field.value = slider.value, onchange: () => take(slider.value)
  });
  field.setAttribute('aria-describedby', help);
  field.addEventListener('keydown', (event) => {
    const by = {ArrowUp: 1, ArrowDown: -1}[event.key];
    const from = Number(field.value || field.placeholder);
    if (!by || !Number.isFinite(from)) return;
    event.preventDefault();
    const far = name.endsWith('_mm') ? Math.max(Math.abs(from) / 20, 0.01) : step;
    take(String(Number(Math.min(max, Math.max(min, from + by * far)).toPrecision(4))));
  });
  return {
    field, slider, show: (value, usual) => {
      Object.assign(field, {value: value ?? '', placeholder: usual || 'by kind'});
      if (slider) slider.value = value ?? usual;
    }
  };
}
function colour_field({name}, id, help) {
  const field = element('input', {id, type: 'color', onchange: () => set(name, field.value)});
  field.setAttribute('aria-describedby', help);
  return {field, show: (value, usual) => field.value = value ?? usual};
}
/** How people call a parameter. */
function title_of(name) {
  const title = name.replace(/_mm$|_degrees$/, '').replace('albedo', 'colour').replaceAll('_', ' ');
  return colours().length < 2 ? title : name === 'albedo' ? 'first colour' : name === 'colour' ? 'colour of all' : title;
}
/** A row: name, field, unit, reset, slider, a line of help and of refusal. */
function row_of(parameter) {
  const {name, meaning, range} = parameter, id = `set_${name}`, help = `help_${name}`;
  const unit = UNITS.find(([pattern]) => pattern.test(name))?.[1] ?? '', title = title_of(name);
  const {field, slider, show} = is_kind(parameter) ? kind_buttons(name) :
      is_colour(parameter) ? colour_field(parameter, id, help) : number_fields(parameter, id, help);
  const reset = element('button', {className: 'reset', textContent: '↺', ariaLabel: `Reset ${title}`, title: 'Reset', onclick: () => set(name, null)});
  const refusal = element('p', {className: 'refusal', role: 'alert'});
  const label = element(is_kind(parameter) ? 'span' : 'label', {textContent: title, htmlFor: id});
  const ends = is_kind(parameter) || is_colour(parameter) ? '' : ` (${range.map((x) => Number(x.toPrecision(4))).join(' to ')})`;
  const parts = is_kind(parameter) ? [label, reset, field] : [label, field, element('span', {className: 'unit', textContent: unit}), reset];
  const text = is_kind(parameter) ? meaning.replace(/:.*/, '') : meaning;
  const small = element('small', {id: help, textContent: text + ends});
  return {
    refusal, show: () => {
      reset.disabled = !(name in recipe.set);
      show(recipe.set[name], default_of(parameter));
    },
    row: element('div', {className: 'row'}, ...parts, ...slider ? [slider] : [], small, refusal),
  };
}
/** Makes the controls of the stitch. */
function build() {
  const open = new Set([...by_id('groups').children].filter((group) => group.open).map(({dataset}) => dataset.name));
  const was_built = by_id('groups').children.length > 0;
  rows.clear();
  const groups = new Map(GROUPS.map(([name]) => {
    const group = element('details', {open: (was_built ? open : OPEN).has(name)}, element('summary', {textContent: name}));
    group.dataset.name = name;
    return [name, group];
  }));
  for (const parameter of parameters()) {
    const row = row_of(parameter), [group] = GROUPS.find(([, pattern]) => pattern.test(parameter.name));
    rows.set(parameter.name, row);
    groups.get(group).append(row.row);
  }
  by_id('groups').replaceChildren(...groups.values());
}
function show_recipe() {
  const offer = offers.find(({stitch, text}) => stitch === recipe.stitch && (text === undefined) === (recipe.text === undefined));
  for (const input of by_id('stitches').querySelectorAll('input')) input.checked = input.value === offer?.stitch;
  by_id('name').textContent = file_name();
  by_id('about').textContent = offer?.description ?? '';
  editor.show(recipe);
  for (const {show} of rows.values()) show();
  by_id('undo').disabled = now === 0;
  by_id('redo').disabled = now === history.length - 1;
  by_id('command').value = command();
}
/** Shows a line of the module where the control is that it speaks of. */
function refuse(line) {
  state.refusal = line;
  for (const {refusal} of rows.values()) refusal.textContent = '';
  const [, name] = line.match(/--set (\w+)/) ?? [], row = rows.get(name);
  by_id('refusal').textContent = editor.refuse(line) || row ? '' : line;
  if (!row) return;
  row.refusal.textContent = line.replace(/^.*?--set \w+[^:]*: /, '');
  row.row.closest('details').open = true;
}

let module = null, worker = null, is_busy = false, ending = null, fabrics = [];
const maker = URL.createObjectURL(new Blob([by_id('maker').textContent], {type: 'text/javascript'}));
/** Shapes of yarn at rest, for another worker. */
const shapes = [];

/** Sends the worker work, and returns its answer. A worker that is busy with other work ends. */
async function ask_maker(message) {
  module ??= WebAssembly.compile(await view.bytes_of(by_id('make')));
  const ready = await module;
  if (is_busy) worker.terminate();
  if (is_busy || !worker) {
    worker = new Worker(maker);
    worker.postMessage({module: ready, shapes});
  }
  is_busy = true;
  return new Promise((end) => {
    const answer = (found) => {
      is_busy = false;
      end(found);
    };
    worker.onmessage = ({data: {stitch, stage, fraction, shape, ...found}}) => {
      if (stitch) return describe(stitch);
      if (shape) return shapes.splice(0, shapes.push(shape) - MAX_SHAPES);
      if (stage === undefined) return answer(found);
      by_id('made').textContent = `making: ${STAGES[stage]}, ${Math.round(100 * fraction)} %`;
    };
    worker.onerror = ({message}) => {
      worker = null;
      answer({refusal: message || 'the worker ended'});
    };
    worker.postMessage(message);
  });
}
/** Makes the cloth of the recipe and shows it, a preview first; a promise of the bytes of its file, null where it was refused or another began. */
function make() {
  ending?.(null);
  const begin = performance.now(), tell = (text) => by_id('made').textContent = text;
  Object.assign(state, {making: true, bytes: null, preview_ms: null});
  refuse('');
  tell('making …');
  view.hold(true);
  return new Promise(async (end) => {
    ending = end;
    const is_over = () => ending !== end;
    const preview = await ask_maker({recipe, whole: false});
    if (is_over()) return;
    if (preview.bytes && await show(preview.bytes, is_over)) state.preview_ms = performance.now() - begin;
    if (is_over()) return;
    const {refusal, bytes} = await ask_maker({recipe, whole: true});
    if (is_over()) return;
    if (refusal !== undefined) {
      good ??= (await ask_maker({recipe: start, whole: true})).bytes;
      if (preview.bytes) await show(good, is_over);
      state.making = false;
      view.hold(false);
      tell('');
      refuse(refusal);
      return end(null);
    }
    Object.assign(state, {bytes, made_ms: performance.now() - begin});
    end(good = bytes);
    if (!await show(bytes, is_over)) return;
    view.hold(false);
    ++state.shown;
    Object.assign(state, {making: false, shown_ms: performance.now() - begin});
    const [width, height] = fabrics.at(-1).mm_per_repeat.map((mm) => mm.toPrecision(3));
    tell(`repeat ${width} x ${height} mm, ${Math.round(bytes.length / 1000)} KB, made in ${(state.made_ms / 1000).toFixed(1)} s`);
  });
}
/** Metres of cloth in a unit of the texture coordinates, of each material. */
const metres = new Map();
/** The file of the last cloth that was not refused. */
let good = null;
/** Shows a fabric; whether it was seen before is_over(). */
async function show(bytes, is_over) {
  await view.started;
  const fabric = new LoadedFabric(bytes.slice().buffer, recipe.stitch), last = fabrics.at(-1);
  await fabric.settled;
  if (is_over() || fabric.issue) return fabric.dispose();
  const is_as_large = last && String(last.mm_per_repeat) === String(fabric.mm_per_repeat);
  const shown = is_as_large ? last : fabric;
  if (is_as_large) cell_images.replace(last, fabric);
  else {
    for (const material of view.materials) {
      const scale = metres.get(material).map((size, k) => size / fabric.mm_per_repeat[k]);
      material.set_fabric(fabric, {lay: {...material.lay, scale}, keeps: true});
    }
    fabrics.push(fabric);
    view.prepare();
  }
  const is_shown = () => cell_images.shows(shown) &&
      [...view.materials].every(({garment}) => garment?.fabric === shown && ['shown', 'ended'].includes(garment.state));
  return new Promise((end) => {
    const look = () => {
      if (!is_over() && !is_shown()) return is_as_large || view.prepare();
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
/** Takes what the module tells of a text's stitch: its parameters. Settings that it has not are left out. */
function describe(stitch) {
  if (JSON.stringify(stitches.get(stitch.stitch)) === JSON.stringify(stitch)) return;
  stitches.set(stitch.stitch, stitch);
  build();
  show_recipe();
  const set = kept_settings(recipe.set);
  if (Object.keys(set).length === Object.keys(recipe.set).length) return;
  recipe = {...recipe, set};
  history[now] = JSON.stringify(recipe);
  take(recipe);
}
const kept_settings = (set) => {
  const known = new Set(all_parameters().map(({name}) => name));
  return Object.fromEntries(Object.entries(set).filter(([name]) => known.has(name)));
};
/** A tile of the list: a picture and a name. */
function tile_of({stitch, text, description}) {
  const input = element('input', {type: 'radio', name: 'stitch', value: stitch});
  input.addEventListener('change', () => {
    const known = stitches.get(stitch)?.parameters.map(({name}) => name) ?? ['colour', 'yarn'];
    const set = Object.fromEntries(Object.entries(recipe.set).filter(([name]) => known.includes(name)));
    change(text === undefined ? {stitch, set} : {stitch, text, set});
  });
  return element('label', {title: description}, input, element('span', {className: 'picture'}), stitch.replace(/\.\w+$/, ''));
}
by_id('stitches').append(...offers.map(tile_of));
by_id('undo').addEventListener('click', () => step(-1));
by_id('redo').addEventListener('click', () => step(1));
addEventListener('keydown', (event) => {
  if (!(event.ctrlKey || event.metaKey)) return;
  const by = {z: event.shiftKey ? 1 : -1, y: 1}[event.key.toLowerCase()];
  if (!by) return;
  event.preventDefault();
  step(by);
});
by_id('save_fabric').addEventListener('click', async () => {
  const name = file_name(), bytes = state.bytes ?? await make();
  if (bytes) save(new Blob([bytes], {type: 'image/x-exr'}), `${name}.fabric.exr`);
});
by_id('save_picture').addEventListener('click', async () => save(await view.picture(), `${file_name()}.png`));
by_id('copy').addEventListener('click', async () => {
  by_id('command').select();
  await navigator.clipboard?.writeText(command()).catch(() => {});
});
const editor = make_editor((text) => change({...recipe, text}));
build();
show_recipe();
view.started.then(() => {
  for (const material of view.materials)
    metres.set(material, material.lay.scale.map((repeats, k) => repeats * material.fabric.mm_per_repeat[k]));
  fabrics = [...new Set([...view.materials].map(({fabric}) => fabric))];
  if (JSON.stringify(recipe) !== JSON.stringify(start)) make();
  else ask_maker({recipe, whole: false});
});
view.design = {state, recipe: () => recipe};

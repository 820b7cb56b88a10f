// The page of `selvedge-view design`: the page of `selvedge-view page`, and a panel with the recipe of its cloth. The cloth is
// made in a worker, by the module of `selvedge make`; the last good one stays until the next is there.
import 'selvedge/page/page.js';
import {LoadedFabric, cell_images} from 'selvedge/three/index.js';
import {MAX_SHAPES} from '../../../converter/web/make.mjs';
import {element} from './element.js';
import {sheet_of, srgb, text_of} from './fabric_file.js';
import {make_editor} from './text_editor.js';
import {Wardrobe} from './wardrobe.js';

const view = globalThis.selvedge, {clothes} = view, by_id = (id) => document.getElementById(id);
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
/** Bytes that a text and a fabric have at most. */
const TEXT = 16e6, FABRIC = 64e6;
const STORE = `selvedge design ${location.pathname}`;

const is_colour = ({value}) => value.length === 3, is_kind = ({name}) => name.endsWith('yarn');
const all_parameters = () => stitches.get(recipe.stitch)?.parameters ?? [];
/** The colours of a stitch's yarns; where it has one yarn, the colour of all is the same and stands for it. */
const colours = () => all_parameters().filter(({name}) => name.endsWith('albedo'));
const parameters = () => all_parameters().filter(({name}) => name !== 'albedo' || colours().length > 1);
const hex_of = (linear) => '#' + linear.map((x) => Math.round(255 * srgb(x)).toString(16).padStart(2, '0')).join('');
/** A default as text; empty where it follows the kind of yarn, which is set. */
function default_of(parameter) {
  const {name, value: [value], byKind: by_kind} = parameter;
  if (is_kind(parameter)) return kinds[value];
  if (name === 'colour') return hex_of(colours()[0]?.value ?? parameter.value);
  if (is_colour(parameter)) return recipe.set.colour ?? hex_of(parameter.value);
  const follows = by_kind && Object.keys(recipe.set).some((set) => set.endsWith('yarn'));
  return follows ? '' : String(Number(value.toPrecision(4)));
}

/** Does what the browser may forbid; null then. */
function tried(work) {
  try {
    return work();
  } catch {
    return null;
  }
}
const keep = () => tried(() => localStorage.setItem(STORE, JSON.stringify(recipe)));
const is_recipe = (found) => (typeof found?.text === 'string' || stitches.has(found?.stitch)) && typeof found.set === 'object';
const kept = [tried(() => JSON.parse(localStorage.getItem(STORE)))].find(is_recipe);

const start = {set: {}, ...first}, state = {making: false, shown: 0, preview_ms: null, made_ms: 0, shown_ms: 0, relaxed: 0, bytes: null, refusal: ''};
let recipe = kept ?? start, history = [JSON.stringify(recipe)], now = 0;

/** The name of the files of a cloth. */
const file_name = () => recipe.stitch.replace(/\.\w+$/, '');
/** The words of `selvedge make` that make this cloth, after the text that it is made of. */
function command() {
  const quoted = (word) => /^[\w.,=+-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
  const {stitch, text, set, ...options} = recipe, words = Object.entries(set).flatMap(([name, value]) => ['--set', `${name}=${value}`]);
  for (const [name, value] of Object.entries(options)) words.push(`--${name}`, String(value));
  const line = ['selvedge', 'make', stitch, ...words, '-o', `${file_name()}.fabric.exr`].map(quoted).join(' ');
  if (text === undefined) return line;
  return `cat > ${quoted(stitch)} << 'END_OF_TEXT'\n${text}${text.endsWith('\n') ? '' : '\n'}END_OF_TEXT\n${line}`;
}

/** Takes another recipe, which can be undone. */
function change(next) {
  if (JSON.stringify(next) === history[now]) return;
  history.splice(++now, Infinity, JSON.stringify(next));
  take(next);
}
const step = (by) => history[now + by] && take(JSON.parse(history[now += by]));
function take(next) {
  const is_other = next.stitch !== recipe.stitch;
  recipe = next;
  keep();
  if (is_other) build();
  show_recipe();
  making = make();
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
  const hex = element('input', {className: 'hex', maxLength: 7, spellcheck: false, ariaLabel: `${title_of(name)}, #rrggbb`, onfocus: () => hex.select()});
  hex.addEventListener('change', () => {
    const [, digits] = hex.value.match(/^\s*#?([\da-f]{6})\s*$/i) ?? [];
    set(name, digits ? `#${digits.toLowerCase()}` : null);
    show_recipe();
  });
  field.setAttribute('aria-describedby', help);
  return {field, hex, show: (value, usual) => field.value = hex.value = value ?? usual};
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
  const {field, slider, hex, show} = is_kind(parameter) ? kind_buttons(name) :
      is_colour(parameter) ? colour_field(parameter, id, help) : number_fields(parameter, id, help);
  const reset = element('button', {className: 'reset', textContent: '↺', ariaLabel: `Reset ${title}`, title: 'Reset', onclick: () => set(name, null)});
  const refusal = element('p', {className: 'refusal', role: 'alert'});
  const label = element(is_kind(parameter) ? 'span' : 'label', {textContent: title, htmlFor: id});
  const ends = is_kind(parameter) || is_colour(parameter) ? '' : ` (${range.map((x) => Number(x.toPrecision(4))).join(' to ')})`;
  const parts = is_kind(parameter) ? [label, reset, field] : [label, field, hex ?? element('span', {className: 'unit', textContent: unit}), reset];
  const text = meaning.replace(is_kind(parameter) ? /:.*/ : /:? ?#rrggbb.*/, '');
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
  const chosen = by_id('stitches').querySelector('label:has(:checked)'), {scrollTop, clientHeight, offsetTop} = by_id('stitches');
  const below = chosen && chosen.offsetTop - offsetTop;
  if (chosen && (below < scrollTop || below + chosen.clientHeight > scrollTop + clientHeight)) by_id('stitches').scrollTop = below - clientHeight / 2;
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

/** The bytes of the cloth, once they are made. */
const made_bytes = () => state.bytes ?? (state.making ? making : making = make());
let making = null, module = null, worker = null, is_busy = false, ending = null, fabrics = [];
const maker = URL.createObjectURL(new Blob([by_id('maker').textContent], {type: 'text/javascript'}));
/** Shapes of yarn at rest, for another worker: those that the page brings, each after its length, and others. */
const shapes = [], brought = [];
async function load_maker() {
  const bytes = await view.bytes_of(by_id('shapes')), numbers = new DataView(bytes);
  for (let at = 0, count; at < bytes.byteLength; at += 4 + count) brought.push(new Uint8Array(bytes, at + 4, count = numbers.getUint32(at, true)));
  return WebAssembly.compile(await view.bytes_of(by_id('make')));
}

/** Sends the worker work, and returns its answer. A worker that is busy with other work ends. */
async function ask_maker(message) {
  const ready = await (module ??= load_maker());
  if (is_busy) worker.terminate();
  if (is_busy || !worker) {
    worker = new Worker(maker);
    worker.postMessage({module: ready, shapes: [...brought, ...shapes]});
  }
  is_busy = true;
  return new Promise((end) => {
    const answer = (found) => {
      is_busy = false;
      end(found);
    };
    worker.onmessage = ({data: {stitch, stage, fraction, shape, ...found}}) => {
      if (stitch) return describe(stitch);
      if (shape) return ++state.relaxed, shapes.splice(0, shapes.push(shape) - MAX_SHAPES);
      if (stage === undefined) return answer(found);
      if (state.making) by_id('made').textContent = `making: ${STAGES[stage]}, ${Math.round(100 * fraction)} %`;
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
    if (preview.bytes && await show(preview.bytes, is_over, false)) state.preview_ms = performance.now() - begin;
    if (is_over()) return;
    const {refusal, bytes} = await ask_maker({recipe, whole: true});
    if (is_over()) return;
    if (refusal !== undefined) {
      if (good && preview.bytes) await show(good, is_over);
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
    tell(`made in ${(state.made_ms / 1000).toFixed(1)} s, ${Math.round(bytes.length / 1000)} KB`);
  });
}
/** The garment; the file of the last whole cloth. */
let wardrobe = null, good = null;
const show_sheet = (bytes) => by_id('sheet').replaceChildren(
  ...sheet_of(bytes).flatMap(([name, value]) => [element('dt', {textContent: name}), element('dd', {textContent: value})]));
/** Shows a fabric, a preview or whole; whether it was seen before is_over(). */
async function show(bytes, is_over, is_whole = true) {
  await view.started;
  const fabric = new LoadedFabric(bytes.slice().buffer, recipe.stitch), last = fabrics.at(-1);
  await fabric.settled;
  if (is_over() || fabric.issue) return fabric.dispose();
  const is_as_large = String(last.mm_per_repeat) === String(fabric.mm_per_repeat) && clothes.worn().every((material) => material.fabric === last);
  const shown = clothes.cloth = is_as_large ? last : fabric;
  if (is_whole) show_sheet(bytes);
  for (const material of clothes.worn()) {
    if (!is_as_large) material.set_fabric(fabric, {keeps: true});
    if (is_whole) clothes.fit(material, fabric);
  }
  if (is_as_large) cell_images.replace(last, fabric);
  else {
    fabrics.push(fabric);
    view.prepare();
  }
  const is_shown = () => cell_images.shows(shown) &&
      clothes.worn().every(({garment}) => garment?.fabric === shown && ['shown', 'ended'].includes(garment.state));
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
/** Takes what the module tells of a text's stitch: its parameters. Settings that it has not are left out. */
function describe(stitch) {
  if (JSON.stringify(stitches.get(stitch.stitch)) === JSON.stringify(stitch)) return;
  stitches.set(stitch.stitch, stitch);
  build();
  show_recipe();
  const set = settings_of(recipe.stitch);
  if (Object.keys(set).length === Object.keys(recipe.set).length) return;
  recipe = {...recipe, set};
  history[now] = JSON.stringify(recipe);
  take(recipe);
}
/** The settings that another stitch has, too; `known`: names, where its parameters are not known. */
function settings_of(stitch, known) {
  const names = stitches.get(stitch)?.parameters.map(({name}) => name) ?? known;
  return Object.fromEntries(Object.entries(recipe.set).filter(([name]) => names.includes(name)));
}
/** A tile of the list: a picture and a name. */
function tile_of({stitch, text, description}, number) {
  const input = element('input', {type: 'radio', name: 'stitch', value: stitch});
  input.addEventListener('change', () => change({stitch, ...text !== undefined && {text}, set: settings_of(stitch, ['colour', 'yarn'])}));
  const picture = element('span', {className: 'picture'});
  picture.style.backgroundPosition = `${-48 * (number % 7)}px ${-48 * Math.floor(number / 7)}px`;
  return element('label', {title: description}, input, picture, stitch.replace(/\.\w+$/, ''));
}
by_id('stitches').append(...offers.map(tile_of));
const on_click = (id, act) => by_id(id).addEventListener('click', act);
on_click('undo', () => step(-1));
on_click('redo', () => step(1));
addEventListener('keydown', (event) => {
  if (!(event.ctrlKey || event.metaKey)) return;
  const by = {z: event.shiftKey ? 1 : -1, y: 1}[event.key.toLowerCase()];
  if (!by) return;
  event.preventDefault();
  step(by);
});
on_click('save_fabric', async () => {
  const name = file_name(), bytes = await made_bytes();
  if (bytes) save(new Blob([bytes], {type: 'image/x-exr'}), `${name}.fabric.exr`);
});
on_click('save_garment', async () => {
  const name = file_name(), bytes = await made_bytes();
  if (bytes) save(new Blob([await wardrobe.save(bytes, name)], {type: 'model/gltf-binary'}), `${wardrobe.name}.${name}.glb`);
});
/** Tells a line that is not about the recipe; what was there stays. */
const tell = (line) => by_id('refusal').textContent = line;
/** Takes a fabric, a garment, a chart, draft or description that the user opens or drops. */
async function open(file) {
  const ending = file.name.toLowerCase().match(/\.\w+$/)?.[0];
  try {
    if (ending === '.exr') await open_fabric(file);
    else if (ending === '.glb') {
      const remarks = await wardrobe.take(file, clothes.cloth);
      tell(remarks.join('; '));
      show_parts();
      by_id('parts').parentElement.open = true;
    } else if (['.txt', '.wif', '.json'].includes(ending)) {
      if (file.size > TEXT) throw new Error(`has ${file.size} bytes, a chart or draft here has at most ${TEXT}`);
      change({stitch: file.name, text: (await file.text()).replaceAll('\r\n', '\n'), set: {}});
    } else throw new Error('is no fabric (.exr), garment (.glb), chart (.txt), draft (.wif) or description (.json)');
  } catch ({message}) {
    tell(`${file.name}: ${message}`);
  }
}
async function open_fabric(file) {
  if (file.size > FABRIC) throw new Error(`has ${Math.round(file.size / 1e6)} MB, a fabric here has at most ${FABRIC / 1e6} MB`);
  const fabric = new LoadedFabric(await file.arrayBuffer(), file.name);
  await fabric.settled;
  const {issue, recipe: found} = fabric;
  fabric.dispose();
  if (issue) throw new Error(`${issue.place ? `${issue.place}: ` : ''}${issue.message} [${issue.code}]`);
  if (typeof found?.stitch !== 'string') throw new Error('has no recipe by which it can be edited');
  if (found.text === undefined && !stitches.get(found.stitch)?.description)
    throw new Error(`its recipe names ${found.stitch} without its text`);
  const set = Object.fromEntries(Object.entries(found.set ?? {}).map(([name, value]) => [name, Array.isArray(value) ? value.join(',') : value]));
  change({...found, set});
}
/** Checkboxes of the materials of the garment that can wear the cloth. */
function show_parts() {
  by_id('parts').replaceChildren(...wardrobe.parts.map((part) => {
    const input = element('input', {type: 'checkbox', checked: part.wears, onchange: () => wardrobe.set_wears(part, input.checked)});
    return element('label', {}, input, part.name);
  }));
}
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
const editor = make_editor((text) => change({...recipe, text}));
build();
show_recipe();
view.started.then(async () => {
  wardrobe = new Wardrobe(view);
  [{fabric: clothes.cloth}] = view.materials;
  await wardrobe.fit(clothes.garments[0], clothes.cloth);
  clothes.changed = async () => {
    await wardrobe.fit(clothes.garments[0], clothes.cloth);
    show_parts();
  };
  show_parts();
  const bytes = await wardrobe.first_fabric();
  if (bytes && state.bytes === null && !state.making) show_sheet(state.bytes = bytes);
  good = state.bytes;
  fabrics = [clothes.cloth];
  if (JSON.stringify(recipe) !== JSON.stringify(start)) making = make();
  else if (!state.making) ask_maker({recipe, whole: false});
});
view.design = {state, recipe: () => recipe, open};

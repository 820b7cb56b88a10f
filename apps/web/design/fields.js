// The controls of the parameters of a stitch.
import {element} from './element.js';
import {colour_parameters, default_text, is_colour_parameter, is_yarn_kind, kinds, parameters, recipe, set_parameter} from './recipe.js';

/** Parameters are in the first group whose pattern their name has. */
const GROUPS = [
  ['Colours', /colour$|albedo|melange|marl/], ['Gauge', /wale|course|spacing|slack|tightness|repeats|width|height/],
  ['Fibre', /yarn$|fibre|hair|irregularity|packing|transmission/], ['Finish', /gloss|roughness|lustre|flattening|seed/], ['Yarn', /./]
];
const OPEN = new Set(['Colours', 'Gauge', 'Fibre']);
const UNITS = [[/twist_per_mm$/, 'turns/mm'], [/_mm$/, 'mm'], [/_degrees$/, 'degrees'], [/tex$/, 'g/km'], [/hairiness$/, 'mm/mm']];
/** Ranges up to this wide have a slider. */
const SLIDER = 100;
/** Rows of the panel, by the name of their parameter. */
const rows = new Map(), panel = document.getElementById('groups');

function kind_menu({name}, id, help) {
  const field = element('select', {id, onchange: () => set_parameter(name, field.value)}, ...kinds.map((kind) => element('option', {textContent: kind})));
  field.setAttribute('aria-describedby', help);
  return {field, show: (value, usual) => field.value = value ?? usual};
}
function number_fields({name, range: [min, max], value: [usual]}, id, help) {
  const take = (text) => set_parameter(name, text === '' ? null : Number(text)), ariaLabel = `${name.replaceAll('_', ' ')}, slider`;
  const step = name.endsWith('_mm') ? Number((usual / 20 || 0.01).toPrecision(1)) : max - min <= 1 ? 0.01 : max - min <= 10 ? 0.1 : 1;
  const field = element('input', {id, type: 'number', min: Math.floor(min), max, step, onchange: () => take(field.value)});
  const slider = max - min <= SLIDER && element('input', {
    type: 'range', min: Math.floor(min), max, step, ariaLabel, oninput: () => field.value = slider.value, onchange: () => take(slider.value)
  });
  field.setAttribute('aria-describedby', help);
  // Arrow keys change what is there now.
  field.addEventListener('keydown', ({key}) => key.startsWith('Arrow') && (field.value ||= field.placeholder));
  return {
    field, slider, show: (value, usual) => {
      Object.assign(field, {value: value ?? '', placeholder: usual || 'by kind'});
      if (slider) slider.value = value ?? usual;
    }
  };
}
/** A colour of CSS, or rrggbb, as #rrggbb; null: it is no colour. */
function css_colour(text) {
  const colour = /^\s*[\da-f]{6}\s*$/i.test(text) ? `#${text.trim()}` : text, pen = document.createElement('canvas').getContext('2d');
  if (CSS.supports('color', colour)) pen.fillStyle = colour;
  return CSS.supports('color', colour) && pen.fillStyle.startsWith('#') ? pen.fillStyle : null;
}
function colour_field({name}, id, help) {
  const field = element('input', {id, type: 'color', onchange: () => set_parameter(name, field.value)});
  const hex = element('input', {className: 'hex', spellcheck: false, ariaLabel: `${title_of(name)}, by name or #rrggbb`, onfocus: () => hex.select()});
  hex.addEventListener('change', () => {
    const colour = hex.value.trim() && css_colour(hex.value);
    if (colour === null) return refuse_value(`--set ${name}: "${hex.value}" is no colour: a name, as tomato, or #rrggbb`);
    set_parameter(name, colour || null);
    show_values();
  });
  field.setAttribute('aria-describedby', help);
  return {field, hex, show: (value, usual) => field.value = hex.value = value ?? usual};
}
/** How people call a parameter. */
function title_of(name) {
  const title = name.replace(/_mm$|_degrees$/, '').replace('albedo', 'colour').replaceAll('_', ' ');
  return colour_parameters().length < 2 ? title : name === 'albedo' ? 'first colour' : name === 'colour' ? 'colour of all' : title;
}
/** A row: name, field, unit, reset, slider, a line of help and of refusal. */
function row_of(parameter) {
  const {name, meaning, range} = parameter, id = `set_${name}`, help = `help_${name}`;
  const unit = UNITS.find(([pattern]) => pattern.test(name))?.[1] ?? '', title = title_of(name);
  const {field, slider, hex, show} = is_yarn_kind(parameter) ? kind_menu(parameter, id, help) :
      is_colour_parameter(parameter) ? colour_field(parameter, id, help) : number_fields(parameter, id, help);
  const reset = element('button', {className: 'reset', textContent: '↺', ariaLabel: `Reset ${title}`, title: 'Reset', onclick: () => set_parameter(name, null)});
  const refusal = element('p', {className: 'refusal', role: 'alert'});
  const label = element('label', {textContent: title, htmlFor: id});
  const ends = is_yarn_kind(parameter) || is_colour_parameter(parameter) ? '' : ` (${range.map((x) => Number(x.toPrecision(4))).join(' to ')})`;
  const text = meaning.replace(is_yarn_kind(parameter) ? /:.*/ : /:? ?#rrggbb.*/, '');
  const small = element('small', {id: help, textContent: text + ends});
  return {
    refusal, show: () => {
      reset.disabled = !(name in recipe.set);
      show(recipe.set[name], default_text(parameter));
    },
    row: element('div', {className: `row${is_yarn_kind(parameter) || /colour$|albedo$/.test(name) ? '' : ' more'}`}, label, field, hex ?? element('span', {className: 'unit', textContent: unit}), reset, ...slider ? [slider] : [], small, refusal),
  };
}
/** Makes the controls of the stitch. */
export function build_fields() {
  const open = panel.children.length === 0 ? OPEN : new Set([...panel.children].filter((group) => group.open).map(({dataset}) => dataset.name));
  rows.clear();
  const groups = new Map(GROUPS.map(([name]) => {
    const group = element('details', {open: open.has(name)}, element('summary', {textContent: name}));
    group.dataset.name = name;
    return [name, group];
  }));
  for (const parameter of parameters()) {
    const row = row_of(parameter), [group] = GROUPS.find(([, pattern]) => pattern.test(parameter.name));
    rows.set(parameter.name, row);
    groups.get(group).append(row.row);
  }
  panel.replaceChildren(...groups.values());
}
export function show_values() {
  for (const {show} of rows.values()) show();
}
/** Shows a refusal at the parameter that it names; whether it is seen there. */
export function refuse_value(line) {
  for (const {refusal} of rows.values()) refusal.textContent = '';
  const [, name] = line.match(/--set (\w+)/) ?? [], row = rows.get(name);
  if (!row) return false;
  row.refusal.textContent = line.replace(/^.*?--set \w+[^:]*: /, '');
  row.row.closest('details').open = true;
  return row.row.checkVisibility();
}

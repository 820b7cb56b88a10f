// The controls of the parameters of a stitch.
import {element} from './element.js';
import {colour_parameters, default_text, is_colour_parameter, is_yarn_kind, kinds, parameters, recipe, set_parameter} from './recipe.js';

/** Parameters are in the first group whose pattern their name has. */
const GROUPS = [
  ['Colours', /colour$|albedo|melange|marl/], ['Gauge', /wale|course|spacing|slack|tightness|repeats|width|height/],
  ['Fibre', /yarn$|fibre|hair|irregularity|packing|transmission/], ['Finish', /gloss|roughness|lustre|flattening|seed/], ['Yarn', /./]
];
const OPEN = new Set(['Colours', 'Gauge']);
const UNITS = [[/twist_per_mm$/, 'turns/mm'], [/_mm$/, 'mm'], [/_degrees$/, 'degrees'], [/tex$/, 'g/km'], [/hairiness$/, 'mm/mm']];
/** Ranges up to this wide have a slider. */
const SLIDER = 100;
/** Rows of the panel, by the name of their parameter. */
const rows = new Map(), panel = document.getElementById('groups');

function kind_buttons(name) {
  const buttons = kinds.map((kind) => element('button', {textContent: kind, onclick: () => set_parameter(name, kind)}));
  return {
    field: element('div', {className: 'kinds', role: 'group', ariaLabel: name.replaceAll('_', ' ')}, ...buttons),
    show: (value) => buttons.forEach((button) => button.ariaPressed = String(button.textContent === value)),
  };
}
function number_fields({name, range: [min, max]}, id, help) {
  const has_slider = max - min <= SLIDER;
  const take = (text) => set_parameter(name, text === '' || !Number.isFinite(Number(text)) ? null : Number(text));
  const field = element('input', {id, type: 'text', inputMode: 'decimal', onchange: () => take(field.value)});
  const step = max - min <= 1 ? 0.01 : max - min <= 10 ? 0.1 : 1, ariaLabel = `${name.replaceAll('_', ' ')}, slider`;
  const slider = has_slider && element('input', {
    type: 'range', min: Math.floor(min), max, step, ariaLabel, oninput: () => field.value = slider.value, onchange: () => take(slider.value)
  });
  field.setAttribute('aria-describedby', help);
  field.addEventListener('keydown', (event) => {
    const sign = {ArrowUp: 1, ArrowDown: -1}[event.key], value = Number(field.value || field.placeholder);
    if (!sign || !Number.isFinite(value)) return;
    event.preventDefault();
    const far = name.endsWith('_mm') ? Math.max(Math.abs(value) / 20, 0.01) : step;
    take(String(Number(Math.min(max, Math.max(min, value + sign * far)).toPrecision(4))));
  });
  return {
    field, slider, show: (value, usual) => {
      Object.assign(field, {value: value ?? '', placeholder: usual || 'by kind'});
      if (slider) slider.value = value ?? usual;
    }
  };
}
function colour_field({name}, id, help) {
  const field = element('input', {id, type: 'color', onchange: () => set_parameter(name, field.value)});
  const hex = element('input', {className: 'hex', maxLength: 7, spellcheck: false, ariaLabel: `${title_of(name)}, #rrggbb`, onfocus: () => hex.select()});
  hex.addEventListener('change', () => {
    const [, digits] = hex.value.match(/^\s*#?([\da-f]{6})\s*$/i) ?? [];
    set_parameter(name, digits ? `#${digits.toLowerCase()}` : null);
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
  const {field, slider, hex, show} = is_yarn_kind(parameter) ? kind_buttons(name) :
      is_colour_parameter(parameter) ? colour_field(parameter, id, help) : number_fields(parameter, id, help);
  const reset = element('button', {className: 'reset', textContent: '↺', ariaLabel: `Reset ${title}`, title: 'Reset', onclick: () => set_parameter(name, null)});
  const refusal = element('p', {className: 'refusal', role: 'alert'});
  const label = element(is_yarn_kind(parameter) ? 'span' : 'label', {textContent: title, htmlFor: id});
  const ends = is_yarn_kind(parameter) || is_colour_parameter(parameter) ? '' : ` (${range.map((x) => Number(x.toPrecision(4))).join(' to ')})`;
  const parts = is_yarn_kind(parameter) ? [label, reset, field] : [label, field, hex ?? element('span', {className: 'unit', textContent: unit}), reset];
  const text = meaning.replace(is_yarn_kind(parameter) ? /:.*/ : /:? ?#rrggbb.*/, '');
  const small = element('small', {id: help, textContent: text + ends});
  return {
    refusal, show: () => {
      reset.disabled = !(name in recipe.set);
      show(recipe.set[name], default_text(parameter));
    },
    row: element('div', {className: 'row'}, ...parts, ...slider ? [slider] : [], small, refusal),
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
/** Shows a refusal at the parameter that it names; whether it names one. */
export function refuse_value(line) {
  for (const {refusal} of rows.values()) refusal.textContent = '';
  const [, name] = line.match(/--set (\w+)/) ?? [], row = rows.get(name);
  if (!row) return false;
  row.refusal.textContent = line.replace(/^.*?--set \w+[^:]*: /, '');
  row.row.closest('details').open = true;
  return true;
}

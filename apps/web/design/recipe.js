// The recipe of the cloth, a stitch with its settings: what it may be, its changes, and the command that makes the same.
import {linear_to_srgb} from './fabric_file.js';

const {first, described, kinds, stitches: list} = JSON.parse(document.getElementById('recipes').textContent);
/** Recipes that the list offers: built-in stitches, and texts with the remarks that they begin with. */
export const offered_recipes = list.map(({stitch, description}) => ({stitch, description}));
for (const [stitch, text] of Object.entries(JSON.parse(document.getElementById('samples').textContent)))
  offered_recipes.push({stitch, text, description: text.match(/^([#;].*\n)+/)?.[0].replace(/^[#;]\s*/gm, '').replaceAll('\n', ' ') ?? ''});
/** Stitches with their parameters: built in, and texts once the module has described theirs. */
const stitches = new Map([...list, described].map((stitch) => [stitch.stitch, stitch]));
const STORE = `selvedge design ${location.pathname}`;

/** Does what the browser may forbid; null then. */
function try_or_null(work) {
  try {
    return work();
  } catch {
    return null;
  }
}
const is_recipe = (found) => (typeof found?.text === 'string' || stitches.has(found?.stitch)) && typeof found.set === 'object';
const saved_recipe = [try_or_null(() => JSON.parse(localStorage.getItem(STORE)))].find(is_recipe), start = {set: {}, ...first};
export let recipe = saved_recipe ?? start;
const history = [JSON.stringify(recipe)];
let now = 0, taken = () => {};

/** Calls taken(is_other) when the recipe changes; `is_other`: it has other parameters. */
export const on_recipe_change = (call) => taken = call;
function take(next, is_other = next.stitch !== recipe.stitch) {
  recipe = next;
  try_or_null(() => localStorage.setItem(STORE, JSON.stringify(recipe)));
  taken(is_other);
}
/** Takes another recipe, which can be undone. */
export function set_recipe(next) {
  if (JSON.stringify(next) === history[now]) return;
  history.splice(++now, Infinity, JSON.stringify(next));
  take(next);
}
export const can_step_history = (by) => history[now + by] !== undefined;
export const step_history = (by) => can_step_history(by) && take(JSON.parse(history[now += by]));
export const is_start_recipe = () => JSON.stringify(recipe) === JSON.stringify(start);
/** Gives a parameter a value; null: its default. */
export function set_parameter(name, value) {
  const {[name]: before, ...rest} = recipe.set;
  set_recipe({...recipe, set: value === null ? rest : {...rest, [name]: value}});
}
/** The settings that another stitch has, too; `known`: names, where its parameters are not known; without those `left_out`. */
function settings_of(stitch, known, left_out = /^$/) {
  const names = stitches.get(stitch)?.parameters.map(({name}) => name) ?? known;
  return Object.fromEntries(Object.entries(recipe.set).filter(([name]) => names.includes(name) && !left_out.test(name)));
}
export const choose_stitch = ({stitch, text}) => set_recipe({stitch, ...text !== undefined && {text}, set: settings_of(stitch, ['yarn'], /colour$|albedo$/)});
/** Takes the parameters of a text's stitch. Settings that it lacks are left out; whether it has others than were known. */
export function set_description(stitch) {
  if (JSON.stringify(stitches.get(stitch.stitch)) === JSON.stringify(stitch)) return;
  stitches.set(stitch.stitch, stitch);
  const left = settings_of(recipe.stitch), is_less = Object.keys(left).length < Object.keys(recipe.set).length;
  if (!is_less) return taken(true, false);
  history[now] = JSON.stringify({...recipe, set: left});
  take(JSON.parse(history[now]), true);
}
/** Takes the recipe that a fabric says it was made by. */
export function set_recipe_of_fabric(found) {
  if (typeof found?.stitch !== 'string') throw new Error('has no recipe by which it can be edited');
  if (found.text === undefined && !stitches.get(found.stitch)?.description)
    throw new Error(`its recipe names ${found.stitch} without its text`);
  const set = Object.fromEntries(Object.entries(found.set ?? {}).map(([name, value]) => [name, Array.isArray(value) ? value.join(',') : value]));
  set_recipe({...found, set});
}

export const is_colour_parameter = ({value}) => value.length === 3, is_yarn_kind = ({name}) => name.endsWith('yarn');
const all_parameters = () => stitches.get(recipe.stitch)?.parameters ?? [];
/** The colours of a stitch's yarns; where it has one yarn, the colour of all is the same and stands for it. */
export const colour_parameters = () => all_parameters().filter(({name}) => name.endsWith('albedo'));
export const parameters = () => all_parameters().filter(({name}) => name !== 'albedo' || colour_parameters().length > 1);
const hex_of = (linear) => '#' + linear.map((x) => Math.round(255 * linear_to_srgb(x)).toString(16).padStart(2, '0')).join('');
/** A default as text; empty where it follows the kind of yarn, which is set. */
export function default_text(parameter) {
  const {name, value: [value], byKind: by_kind} = parameter;
  if (is_yarn_kind(parameter)) return kinds[value];
  if (name === 'colour') return hex_of(colour_parameters()[0]?.value ?? parameter.value);
  if (is_colour_parameter(parameter)) return recipe.set.colour ?? hex_of(parameter.value);
  const follows = by_kind && Object.keys(recipe.set).some((set) => set.endsWith('yarn'));
  return follows ? '' : String(Number(value.toPrecision(4)));
}
/** The name of the files of a cloth. */
export const file_name = () => recipe.stitch.replace(/\.\w+$/, '');
/** Words as a shell takes them. */
export function shell_line(words) {
  const quoted = (word) => /^[\w.,=+-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
  return words.map(quoted).join(' ');
}
/** The words of `selvedge make` that make this cloth, after the text that it is made of. */
export function command_line() {
  const {stitch, text, set, ...options} = recipe, words = Object.entries(set).flatMap(([name, value]) => ['--set', `${name}=${value}`]);
  for (const [name, value] of Object.entries(options)) words.push(`--${name}`, String(value));
  const line = shell_line(['selvedge', 'make', stitch, ...words, '-o', `${file_name()}.fabric.exr`]);
  if (text === undefined) return line;
  return `cat > ${shell_line([stitch])} << 'END_OF_TEXT'\n${text}${text.endsWith('\n') ? '' : '\n'}END_OF_TEXT\n${line}`;
}
export {kinds};

// State of the page, with its history: the recipe of the cloth, a stitch with its settings, and the garment that wears it;
// and the command that makes the same.
import {Color} from 'three';

export const {first, kinds, options, stitches: list} = JSON.parse(document.getElementById('recipes').textContent);
/** Recipes that the list offers: built-in stitches, and texts with the remarks that they begin with. */
export const offered_recipes = list.map(({stitch, description}) => ({stitch, description}));
for (const [stitch, text] of Object.entries(JSON.parse(document.getElementById('samples').textContent)))
  offered_recipes.push({stitch, text, description: text.match(/^([#;].*\n)+/)?.[0].replace(/^[#;]\s*/gm, '').replaceAll('\n', ' ') ?? ''});
/** Stitches with their parameters: built in, and texts once the program has described theirs. */
const stitches = new Map(list.map((stitch) => [stitch.stitch, stitch]));
/** The browser keeps so many characters and steps of the history. */
const STORE = `selvedge design ${location.pathname}`, CHARACTERS = 2e6, STEPS = 200;

/** Does what the browser may forbid; null then. */
function try_or_null(work) {
  try {
    return work();
  } catch {
    return null;
  }
}
const is_recipe = (found) => (typeof found?.text === 'string' || stitches.has(found?.stitch)) && typeof found.set === 'object';
/** What is `make`'s of a recipe, which may be a stranger's. */
function own_recipe(found) {
  const {stitch, text = '', set = {}} = found ?? {};
  if (typeof stitch !== 'string' || typeof text !== 'string' || /^-|[/\\]/.test(stitch)) throw new Error('has no recipe by which it can be edited');
  if (found.text === undefined && !list.some((each) => each.stitch === stitch)) throw new Error(`its recipe names ${stitch} without its text`);
  const own = Object.entries(found).filter(([name]) => ['stitch', 'text', ...options].includes(name));
  return {...Object.fromEntries(own), set: Object.fromEntries(Object.entries(set).map(([name, value]) => [name, Array.isArray(value) ? value.join(',') : value]))};
}
const start = own_recipe(first), known = try_or_null(() => JSON.parse(localStorage.getItem(STORE)));
/** States as JSON, and the number of the one that is shown. */
let history = [JSON.stringify({recipe: start, worn: {}})], now = 0, taken = () => {};
if (try_or_null(() => known.history.every((state) => is_recipe(JSON.parse(state).recipe)) && known.history[known.now])) ({history, now} = known);
/** `worn`: { key, file, choices, tint }: a garment of the user, what wears the cloth otherwise than `dress --all` has it, a colour. */
export let {recipe, worn} = JSON.parse(history[now]);

/** Calls taken({ is_other, makes }) when the state changes: the recipe has other parameters, or is another. */
export const on_change = (call) => taken = call;
function take(state, is_other = state.recipe.stitch !== recipe.stitch) {
  const makes = JSON.stringify(recipe) !== JSON.stringify(state.recipe);
  ({recipe, worn} = state);
  while (history.length > STEPS || (history.length > 1 && now > 0 && history.join().length > CHARACTERS)) history.shift(), --now;
  try_or_null(() => localStorage.setItem(STORE, JSON.stringify({history, now})));
  taken({is_other, makes});
}
function push(state) {
  if (JSON.stringify(state) === history[now]) return;
  history.splice(++now, Infinity, JSON.stringify(state));
  take(JSON.parse(history[now]));
}
/** Takes another recipe, or garment, which can be undone. */
export const set_recipe = (next) => push({recipe: next, worn});
export const set_worn = (next) => push({recipe, worn: next});
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
export const choose_stitch = ({stitch, text}) => set_recipe(
  {stitch, text, set: settings_of(stitch, ['yarn'], /colour$|albedo$/), sides: recipe.sides});
/** Names that texts give themselves, by names of files. */
export const names = new Map();
/** Takes the parameters of a text's stitch. Settings that it lacks are left out; whether it has others than were known. */
export function set_description(stitch) {
  if (JSON.stringify(stitches.get(stitch.stitch)) === JSON.stringify(stitch)) return;
  stitches.set(stitch.stitch, stitch);
  const left = settings_of(recipe.stitch), is_less = Object.keys(left).length < Object.keys(recipe.set).length;
  if (!is_less) return taken({is_other: true, makes: false});
  const state = {recipe: {...recipe, set: left}, worn};
  history[now] = JSON.stringify(state);
  take(state, true);
}
/** Takes the recipe that a fabric says it was made by. */
export const set_recipe_of_fabric = (found) => set_recipe(own_recipe(found));

export const is_colour_parameter = ({value}) => value.length === 3, is_yarn_kind = ({name}) => name.endsWith('yarn');
const all_parameters = () => stitches.get(recipe.stitch)?.parameters ?? [];
/** The colours of a stitch's yarns; where it has one yarn, the colour of all is the same and stands for it. */
export const colour_parameters = () => all_parameters().filter(({name}) => name.endsWith('albedo'));
export const parameters = () => all_parameters().filter(({name}) => name !== 'albedo' || colour_parameters().length > 1);
const hex_of = (linear) => `#${new Color(...linear).getHexString()}`;
/** A default as text; empty where it follows the kind of yarn, which is set. */
export function default_text(parameter) {
  const {name, value: [value], byKind: by_kind} = parameter;
  if (is_yarn_kind(parameter)) return kinds[value];
  if (name === 'colour') return hex_of(colour_parameters()[0]?.value ?? parameter.value);
  if (is_colour_parameter(parameter)) return recipe.set.colour ?? hex_of(parameter.value);
  const follows = by_kind && Object.keys(recipe.set).some((set) => set.endsWith('yarn'));
  return follows ? '' : String(Number(value.toPrecision(4)));
}
/** The name of the files of a cloth; the name that its text gives it, or else its file. */
export const file_name = () => recipe.stitch.replace(/\.\w+$/, '');
export const garment_name = () => worn.file?.replace(/\.glb$/i, '') ?? 'garment';
export const own_name = () => (recipe.text !== undefined && names.get(recipe.stitch)) || file_name();
/** Words as a shell takes them. */
export function shell_line(words) {
  const quoted = (word) => /^[\w.,=+-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
  return words.map(quoted).join(' ');
}
/** The words of `selvedge` that make this cloth, and the files that they are about. */
export function make_run() {
  const {stitch, text, set, ...options} = recipe, words = Object.entries(set).flatMap(([name, value]) => ['--set', `${name}=${value}`]);
  for (const [name, value] of Object.entries(options)) words.push(`--${name}`, ...value === 'true' ? [] : [String(value)]);
  return {argv: ['make', stitch, ...words, '-o', `${file_name()}.fabric.exr`], files: text === undefined ? {} : {[stitch]: new TextEncoder().encode(text)}};
}
/** The command line of the same, after the text that it is made of. */
export function command_line() {
  const {stitch, text} = recipe, line = shell_line(['selvedge', ...make_run().argv]);
  if (text === undefined) return line;
  let end = 'END_OF_TEXT';
  while (text.includes(end)) end += '_';
  return `cat > ${shell_line([stitch])} << '${end}'\n${text}${text.endsWith('\n') ? '' : '\n'}${end}\n${line}`;
}

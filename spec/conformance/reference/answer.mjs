// Answers the query protocol (../README.md): one JSON object per line in, one per line out.
import {readFileSync} from 'node:fs';
import {createInterface} from 'node:readline';
import {evaluate_texel, evaluate_uv} from './brdf.mjs';
import {check_fabric} from './check.mjs';
import {in_frame, shown} from './environment.mjs';
import {check_gltf} from './gltf.mjs';
import {Issue, open_fabric} from './reader.mjs';
import {in_sight, seen_from} from './sides.mjs';
import {dot} from './vector.mjs';

const opened = new Map();

function read_bytes(file) {
  try {
    return readFileSync(file);
  } catch (error) {
    throw new Issue(error.code === 'ENOENT' ? 'FILE_MISSING' : 'FILE_UNREADABLE', '', error.message);
  }
}

/** seen_from() of a file's fabric, cached. */
async function open(file, behind) {
  if (!opened.has(file)) {
    const fabric = await open_fabric(read_bytes(file));
    opened.set(file, [seen_from(fabric, false), seen_from(fabric, true)]);
  }
  return opened.get(file)[behind ? 1 : 0];
}

const refuse = (message) => {
  throw new Issue('OPTION_OUT_OF_RANGE', '', message);
};
const numbers = (x, n) => Array.isArray(x) && x.length === n && x.every((a) => Number.isFinite(a));

/** f and alpha at a query's place, a function of light and view. */
async function place_of({file, level: wanted, texel, uv, behind = false}) {
  if (!Number.isFinite(wanted)) refuse('level is a number');
  if ((texel === undefined) === (uv === undefined)) refuse('one of texel and uv');
  if (typeof behind !== 'boolean') refuse('behind is a boolean');
  const seen = await open(file, behind);
  if (uv !== undefined) {
    if (!numbers(uv, 2)) refuse('uv is two numbers');
    return (light, view) => {
      const {level, light: above} = in_sight(seen, light);
      return evaluate_uv(level, seen.levels, wanted, uv, above, view);
    };
  }
  if (!Number.isInteger(wanted) || wanted < 0 || wanted >= seen.levels) refuse('no such level');
  const {width, height} = seen.level(wanted);
  if (!numbers(texel, 2) || !texel.every((x, i) => Number.isInteger(x) && x >= 0 && x < [width, height][i]))
    refuse('no such texel');
  return (light, view) => {
    const {level, light: above} = in_sight(seen, light);
    return evaluate_texel(level(wanted), texel, above, view);
  };
}

async function evaluate({light, view, ...place}) {
  if (!numbers(light, 3) || !numbers(view, 3)) refuse('light and view are three numbers each');
  return (await place_of(place))(light, view);
}

const is_unit = (d) => numbers(d, 3) && Math.abs(Math.hypot(...d) - 1) < 0.01;

const is_frame = (axes) => Array.isArray(axes) && axes.length === 3 && axes.every(is_unit) &&
  [[0, 1], [0, 2], [1, 2]].every(([i, k]) => Math.abs(dot(axes[i], axes[k])) < 0.01);

async function environment({view, environment: given, frame, background, ...place}) {
  const {kind, a, b, axis, exponent, degrees} = given ?? {};
  if (!is_unit(view)) refuse('view is a unit vector');
  if (!['constant', 'cosine', 'lobe', 'disc'].includes(kind)) refuse('an environment is of one of four kinds');
  const shape = kind === 'constant' ? [0, 0, 0] : b;
  if (!numbers(a, 3) || !numbers(shape, 3)) refuse('radiance is three numbers');
  const opposite = (x) => kind === 'cosine' ? -x : 0;
  if (!a.every((x, c) => x + shape[c] >= 0 && x + opposite(shape[c]) >= 0)) refuse('radiance is negative somewhere');
  if (kind !== 'constant' && !is_unit(axis)) refuse('axis is a unit vector');
  if (kind === 'lobe' && !(Number.isFinite(exponent) && exponent >= 0)) refuse('exponent is a number from 0');
  if (kind === 'disc' && !(degrees > 0 && degrees <= 180)) refuse('degrees are above 0 and up to 180');
  if (background !== undefined && !numbers(background, 3)) refuse('background is three numbers');
  if (frame !== undefined && !is_frame(frame)) refuse('frame is three directions at right angles');
  const turn = (d) => d && frame ? in_frame(frame, d) : d;
  const at = await place_of(place), towards = turn(view), both = (await open(place.file, place.behind)).through !== null;
  return shown((light) => at(light, towards), towards, {...given, axis: turn(axis)}, background, {both});
}

async function check(file) {
  try {
    const bytes = read_bytes(file);
    return await (/\.gl(tf|b)$/.test(file) ? check_gltf(file, bytes) : check_fabric(bytes));
  } catch (error) {
    if (!(error instanceof Issue)) throw error;
    return [{code: error.code, severity: 'error', place: error.place, message: error.message}];
  }
}

async function answer(line) {
  let query;
  try {
    query = JSON.parse(line);
  } catch (error) { return {error: 'JSON_MALFORMED', message: error.message}; }
  try {
    if (query?.op === 'evaluate') return await evaluate(query);
    if (query?.op === 'environment') return await environment(query);
    if (query?.op === 'check') return {issues: await check(query.file)};
    return refuse('op is evaluate, environment or check');
  } catch (error) {
    if (!(error instanceof Issue)) throw error;
    return {error: error.code, message: error.message};
  }
}

for await (const line of createInterface({input: process.stdin, crlfDelay: Infinity}))
  process.stdout.write(JSON.stringify(await answer(line)) + '\n');

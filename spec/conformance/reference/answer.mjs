// Answers the query protocol (../README.md): one JSON object per line in, one per line out.
import {readFileSync} from 'node:fs';
import {createInterface} from 'node:readline';
import {evaluate_texel, evaluate_uv} from './brdf.mjs';
import {check_fabric} from './check.mjs';
import {in_frame, shown} from './environment.mjs';
import {read_fabric_level} from './level.mjs';
import {Issue, dot, open_fabric} from './reader.mjs';
import {check_gltf} from './gltf.mjs';

const opened = new Map();

function read_bytes(file) {
  try {
    return readFileSync(file);
  } catch (error) {
    throw new Issue(error.code === 'ENOENT' ? 'FILE_MISSING' : 'FILE_UNREADABLE', '', error.message);
  }
}

/** { fabric, level(k) } of a file; what was read is kept. */
function open(file) {
  if (!opened.has(file)) {
    const fabric = open_fabric(read_bytes(file));
    const levels = new Map();
    const level = (k) => {
      if (!levels.has(k)) levels.set(k, read_fabric_level(fabric, k));
      return levels.get(k);
    };
    opened.set(file, {fabric, level});
  }
  return opened.get(file);
}

const refuse = (message) => {
  throw new Issue('OPTION_OUT_OF_RANGE', '', message);
};
const numbers = (x, n) => Array.isArray(x) && x.length === n && x.every((a) => Number.isFinite(a));

/** f and alpha at a query's place, a function of light and view. */
function place_of({file, level: wanted, texel, uv}) {
  if (!Number.isFinite(wanted)) refuse('level is a number');
  if ((texel === undefined) === (uv === undefined)) refuse('one of texel and uv');
  const {fabric, level} = open(file);
  if (uv !== undefined) {
    if (!numbers(uv, 2)) refuse('uv is two numbers');
    return (light, view) => evaluate_uv(level, fabric.levels, wanted, uv, light, view);
  }
  if (!Number.isInteger(wanted) || wanted < 0 || wanted >= fabric.levels) refuse('no such level');
  const {width, height} = level(wanted);
  if (!numbers(texel, 2) || !texel.every((x, i) => Number.isInteger(x) && x >= 0 && x < [width, height][i]))
    refuse('no such texel');
  return (light, view) => evaluate_texel(level(wanted), texel, light, view);
}

function evaluate({light, view, ...place}) {
  if (!numbers(light, 3) || !numbers(view, 3)) refuse('light and view are three numbers each');
  return place_of(place)(light, view);
}

const is_unit = (d) => numbers(d, 3) && Math.abs(Math.hypot(...d) - 1) < 0.01;

const is_frame = (axes) => Array.isArray(axes) && axes.length === 3 && axes.every(is_unit) &&
  [[0, 1], [0, 2], [1, 2]].every(([i, k]) => Math.abs(dot(axes[i], axes[k])) < 0.01);

function environment({view, environment: given, frame, background, ...place}) {
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
  const at = place_of(place), seen_from = turn(view);
  return shown((light) => at(light, seen_from), seen_from, {...given, axis: turn(axis)}, background);
}

function check(file) {
  try {
    const bytes = read_bytes(file);
    return /\.gl(tf|b)$/.test(file) ? check_gltf(file, bytes) : check_fabric(bytes);
  } catch (error) {
    if (!(error instanceof Issue)) throw error;
    return [{code: error.code, severity: 'error', place: error.place, message: error.message}];
  }
}

function answer(line) {
  let query;
  try {
    query = JSON.parse(line);
  } catch (error) { return {error: 'JSON_MALFORMED', message: error.message}; }
  try {
    if (query?.op === 'evaluate') return evaluate(query);
    if (query?.op === 'environment') return environment(query);
    if (query?.op === 'check') return {issues: check(query.file)};
    return refuse('op is evaluate, environment or check');
  } catch (error) {
    if (!(error instanceof Issue)) throw error;
    return {error: error.code, message: error.message};
  }
}

createInterface({input: process.stdin, crlfDelay: Infinity}).on('line', (line) => {
  process.stdout.write(JSON.stringify(answer(line)) + '\n');
});

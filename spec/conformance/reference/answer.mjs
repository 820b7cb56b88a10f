// Answers the query protocol (../README.md): one JSON object per line in, one per line out.
import {readFileSync} from 'node:fs';
import {createInterface} from 'node:readline';
import {evaluate_texel, evaluate_uv} from './brdf.mjs';
import {check_fabric} from './check.mjs';
import {read_fabric_level} from './level.mjs';
import {Issue, open_fabric} from './reader.mjs';
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

function evaluate({file, level: wanted, texel, uv, light, view}) {
  if (!numbers(light, 3) || !numbers(view, 3)) refuse('light and view are three numbers each');
  if (!Number.isFinite(wanted)) refuse('level is a number');
  if ((texel === undefined) === (uv === undefined)) refuse('one of texel and uv');
  const {fabric, level} = open(file);
  if (uv !== undefined) {
    if (!numbers(uv, 2)) refuse('uv is two numbers');
    return evaluate_uv(level, fabric.levels, wanted, uv, light, view);
  }
  if (!Number.isInteger(wanted) || wanted < 0 || wanted >= fabric.levels) refuse('no such level');
  const {width, height} = level(wanted);
  if (!numbers(texel, 2) || !texel.every((x, i) => Number.isInteger(x) && x >= 0 && x < [width, height][i]))
    refuse('no such texel');
  return evaluate_texel(level(wanted), texel, light, view);
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
    if (query?.op === 'check') return {issues: check(query.file)};
    return refuse('op is evaluate or check');
  } catch (error) {
    if (!(error instanceof Issue)) throw error;
    return {error: error.code, message: error.message};
  }
}

createInterface({input: process.stdin, crlfDelay: Infinity}).on('line', (line) => {
  process.stdout.write(JSON.stringify(answer(line)) + '\n');
});

// All faults of a fabric file, and warnings about its levels, lobes and energy (codes of spec/issues.md).
import {evaluate_texel} from './brdf.mjs';
import {yarns_of} from './curves.mjs';
import {cell_direction} from './directions.mjs';
import {make_level} from './level.mjs';
import {Issue, LAYERS, SPREAD, chain_length, level_of_texels, open_fabric, read_layer} from './reader.mjs';

const LARGE_EXPONENT = 102.4;  // from here on halves cost a lobe's peak some per cent
const LARGEST_HALF = 65504;
const ENERGY_LIMIT = 1.01;
const ENERGY_TEXELS = 4096;  // looked at in a level
const ENERGY_VIEWS = Array.from({length: 256}, (_, k) => cell_direction({columns: 16, rows: 16}, k));
const LOW = Math.sqrt(0.75);
const ENERGY_LIGHTS = [[0, 0, 1], [LOW, 0, 0.5], [-LOW, 0, 0.5], [0, LOW, 0.5], [0, -LOW, 0.5]];

const has_error = (issues) => issues.some(({severity}) => severity === 'error');

/** Runs `work`; an Issue that it throws is added to the list. */
function collect(issues, work) {
  try {
    work();
  } catch (error) {
    if (!(error instanceof Issue)) throw error;
    issues.push({code: error.code, severity: 'error', place: error.place, message: error.message});
  }
}

function check_levels(fabric, warn) {
  const chain = fabric.texels ? chain_length(...fabric.texels) : 0;
  if (fabric.levels < chain) warn('FABRIC_LEVELS', '/levels', `${fabric.levels} of ${chain} levels`);
  for (const [side, {layers, shown}] of [['', fabric], ...Object.entries(fabric.sides)]) {
    for (const [name, {levels}] of Object.entries(layers)) {
      if (['products', ...SPREAD].includes(name)) continue;
      const left_out = shown?.filter((from, k) => from !== k).length ?? 0;
      const counts = new Set([...levels, ...(layers.products?.levels ?? [])]).size + left_out;
      const at = `${side && `/sides/${side}`}/layers/${name}/levels`;
      if (counts < fabric.levels) warn('FABRIC_LEVELS', at, 'only some of the levels');
    }
  }
}

/** The fraction of the light from `light` that a texel sends to all views: the integral of alpha f v_z, per channel. */
function reflected(level, texel, light) {
  const sums = [0, 0, 0];
  for (const view of ENERGY_VIEWS) {
    const {rgb, alpha} = evaluate_texel(level, texel, light, view);
    rgb.forEach((f, c) => {
      sums[c] += alpha * f * view[2] * 2 * Math.PI / ENERGY_VIEWS.length;
    });
  }
  return sums;
}

/** `other` sends light on to the other side of the cloth; null where none comes through. */
function check_energy(level, other, at, warn) {
  const all = level.width * level.height;
  const step = Math.ceil(all / ENERGY_TEXELS) | 1;  // odd: so that no column of a power of two is left out
  const count = Math.ceil(all / step);
  for (const light of ENERGY_LIGHTS) {
    const mean = [0, 0, 0];
    for (let t = 0; t < all; t += step) {
      const i = t % level.width, j = Math.floor(t / level.width);
      const on = other ? reflected(other, [i, j], light) : [0, 0, 0];
      const sums = reflected(level, [i, j], light).map((sum, c) => sum + on[c]);
      sums.forEach((sum, c) => {
        mean[c] += sum / count;
      });
      const most = Math.max(...sums);
      if (most > ENERGY_LIMIT)
        return warn(
          'FABRIC_ENERGY', `${at}/${i},${j}`, `sends ${most.toPrecision(3)} of its light back`);
    }
    const most = Math.max(...mean);
    if (most > ENERGY_LIMIT * light[2])
      return warn(
        'FABRIC_ENERGY', at, `sends ${(most / light[2]).toPrecision(3)} of its light back`);
  }
}

function check_lobes(level, at, half, warn) {
  let peak = 0, exponent = 0;
  for (let t = 0; t < level.width * level.height; ++t) {
    for (const {lobes} of level.lobes(t)) {
      for (const {cx, cy, cz, n} of lobes) {
        peak = Math.max(peak, Math.max(Math.abs(cx), Math.abs(cy), cz) ** n);
        exponent = Math.max(exponent, n);
      }
    }
  }
  if (peak > LARGEST_HALF) warn('FABRIC_PEAK', at, `a peak of ${peak.toPrecision(3)}`);
  if (half && exponent > LARGE_EXPONENT)
    warn('FABRIC_PEAK', at, `an exponent of ${exponent} in half precision`);
}

/** Warns of lobes and energy of level k. `numbers`: of the layers, by side. */
function check_light(fabric, numbers, k, warn) {
  const fabrics = {front: fabric, ...fabric.sides}, levels = {};
  for (const [side, of] of Object.entries(fabrics)) {
    // The opacity of light through the back is the back's.
    if ([of, ...(side === 'back.through' ? [fabric.sides.back] : [])].some((of) => level_of_texels(of, 'lobes', k) !== k)) continue;
    const own = {...numbers[side]};
    if (side !== 'front' && side !== 'back') own.opacity = numbers[side === 'through' ? 'front' : 'back'].opacity;
    delete own.yarns;
    levels[side] = make_level(of, k, own);
    const place = `${side === 'front' ? '' : `${side}.`}lobes/level ${k}`;
    const half = of.layers.lobes?.part.channels.some(({type}) => type === 'half');
    if (levels[side].lobes) check_lobes(levels[side], place, half, warn);
  }
  const {front, back, through, 'back.through': back_through} = levels;
  const {views} = fabric.sides.back ?? fabric, same = views.columns === fabric.views.columns && views.rows === fabric.views.rows;
  const of_through = through && same ? {...through, opacity: (back ?? front).opacity} : undefined;
  const behind = fabric.sides['back.through'] ? back_through : of_through;
  check_energy(front, behind, `level ${k}`, warn);
  if (back) check_energy(back, through, `back level ${k}`, warn);
}

/** The issues of the bytes of a fabric file: { code, severity, place, message }. */
export async function check_fabric(bytes) {
  const issues = [];
  const note = (severity) => (code, place, message) => {
    issues.push({code, severity, place, message});
  };
  const report = note('error'), warn = note('warning');
  let fabric;
  try {
    fabric = await open_fabric(bytes, report);
  } catch (error) {
    collect(issues, () => {
      throw error;
    });
    return issues;
  }
  check_levels(fabric, warn);
  const whole = !has_error(issues);
  const bases = {};  // stored at level 0, for all levels
  for (let k = 0; k < (fabric.levels ?? 0); ++k) {
    const before = issues.length, numbers = {};
    for (const [side, of] of Object.entries({front: fabric, ...fabric.sides})) {
      const own = numbers[side] = {}, prefix = side === 'front' ? '' : `${side}.`;
      for (const name of LAYERS) {
        if (side !== 'front' && name === 'yarns') continue;
        if (level_of_texels(of, name, k) === k)
          collect(issues, () => {
            own[name] = read_layer(of, name, k, (code, place, message) => report(code, prefix + place, message));
          });
      }
      if (k === 0) bases[side] = own.bases;
      if (side === 'front' && own.yarns && own.indirect && issues.length === before)
        collect(issues, () => yarns_of(fabric, own));
      own.bases = bases[side];
    }
    // The energy of a faulty fabric says nothing.
    if (whole && !has_error(issues.slice(before))) check_light(fabric, numbers, k, warn);
  }
  return issues;
}

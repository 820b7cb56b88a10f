// Every broken rule of a fabric file, and what is legal but unwise (codes of spec/issues.md).
import {evaluate_texel} from './brdf.mjs';
import {cell_direction} from './directions.mjs';
import {make_level} from './level.mjs';
import {
  Issue,
  LAYERS,
  LOSSY,
  SIDES,
  SPREAD,
  chain_length,
  check_windows,
  float_at,
  is_laid_out,
  latin1,
  layer_channels,
  level_of_texels,
  open_fabric,
  read_layer,
  read_level,
  yarns_of
} from './reader.mjs';

const MEMBERS = [
  'version', 'model', 'texels', 'levels', 'mmPerRepeat', 'referenceHeight', 'thickness', 'radianceScale',
  'views', 'lights', 'layers', 'digests', 'provenance', 'whole', 'sides'
];
const LAYER_MEMBERS = ['levels', 'precision', 'optional'];
const OWN_MEMBERS = {
  lobes: ['lobes'],
  products: ['pairs'],
  bases: ['functions'],
  yarns: ['curves', 'nodes', 'stations', 'fields']
};
const SIDE_MEMBERS = ['radianceScale', 'views', 'lights', 'layers', 'digests', 'provenance'];
const MINOR_VERSION = 3;
const PREVIEW_CHANNELS = ['R', 'G', 'B', 'A'];
const LARGE_EXPONENT = 102.4;  // from here on halves cost a lobe's peak some per cent
const LARGEST_HALF = 65504;
const ENERGY_LIMIT = 1.01;
const ENERGY_TEXELS = 4096;  // looked at in a level
const ENERGY_VIEWS = Array.from({length: 256}, (_, k) => cell_direction({columns: 16, rows: 16}, k));
const LOW = Math.sqrt(0.75);
const ENERGY_LIGHTS = [[0, 0, 1], [LOW, 0, 0.5], [-LOW, 0, 0.5], [0, LOW, 0.5], [0, -LOW, 0.5]];

const has_error = (issues) => issues.some(({severity}) => severity === 'error');

/** Runs `work`; an Issue that it throws becomes one of the list. */
function collect(issues, work) {
  try {
    work();
  } catch (error) {
    if (!(error instanceof Issue)) throw error;
    issues.push({code: error.code, severity: 'error', place: error.place, message: error.message});
  }
}

function check_text(fabric, advise) {
  const {raw, file} = fabric;
  const unknown = (object, known, at) => {
    for (const name of Object.keys(object ?? {}))
      if (!known.includes(name)) advise(`${at}/${name}`, 'is not known');
  };
  unknown(raw.sides, SIDES, '/sides');
  if (raw.version[1] > MINOR_VERSION) advise('/version/1', 'is newer than what is known here');
  if (typeof raw.model !== 'string') advise('/model', 'is missing or not a string');
  unknown(raw, MEMBERS, '');
  const check_side = (own, at, prefix) => {
    for (const grid of ['views', 'lights']) unknown(own[grid], ['layout', 'columns', 'rows'], `${at}/${grid}`);
    unknown(own.digests, Object.keys(own.layers), `${at}/digests`);
    for (const [name, layer] of Object.entries(own.layers)) {
      const place = `${at}/layers/${name}`;
      if (!LAYERS.includes(name)) {
        advise(place, 'is not known');
        continue;
      }
      unknown(layer, [...LAYER_MEMBERS, ...(OWN_MEMBERS[name] ?? [])], place);
      const part = file.parts.find((p) => p.name === prefix + name);
      if (part.channels.some(({type}) => type !== layer.precision))
        advise(`${place}/precision`, 'is not that of the channels');
    }
  };
  check_side(raw, '', '');
  for (const side of Object.keys(fabric.sides)) {
    unknown(raw.sides[side], SIDE_MEMBERS, `/sides/${side}`);
    check_side(raw.sides[side], `/sides/${side}`, `${side}.`);
  }
  const mirror = (name, type, same) => {
    const attribute = file.parts[0].attributes.get(`selvedge.${name}`);
    if (attribute?.type !== type || !same(attribute.value))
      advise(`selvedge.${name}`, 'differs from the attribute text');
  };
  const single = Math.fround;
  mirror('version', 'string', (v) => latin1(v) === raw.version?.join('.'));
  mirror('model', 'string', (v) => new TextDecoder().decode(v) === raw.model);
  mirror(
    'mmPerRepeat', 'v2f', (v) => [0, 1].every((i) => float_at(v, 4 * i) === single(raw.mmPerRepeat?.[i])));
  mirror('referenceHeight', 'float', (v) => float_at(v, 0) === single(raw.referenceHeight));
}

/** Which side's layer a part is: { of, layer, prefix }, `of` being the side's fabric. */
function side_of_part(fabric, name) {
  const side = [...SIDES].reverse().find((s) => name.startsWith(`${s}.`));
  if (!side) return {of: fabric, layer: name, prefix: ''};
  return {of: fabric.sides[side], layer: name.slice(side.length + 1), prefix: `${side}.`};
}

/** What a part SHOULD have, and what of it is not known. */
function advise_on_part(part, fabric, advise) {
  const {name, attributes, channels, tile, compression} = part;
  if (!attributes.has('wrapmodes') || latin1(attributes.get('wrapmodes').value) !== 'periodic,periodic')
    advise(`${name}/wrapmodes`, 'is not periodic,periodic');
  const has = channels.map((channel) => channel.name);
  if (name === 'preview') {
    if (tile) advise(name, 'is tiled');
    if (LOSSY.includes(compression)) advise(name, `compression ${compression}`);
    for (const channel of PREVIEW_CHANNELS)
      if (!has.includes(channel)) advise(`${name}/${channel}`, 'is missing');
    return;
  }
  const {of, layer, prefix} = side_of_part(fabric, name);
  if (!of?.layers[layer] || !is_laid_out(layer, of)) return;
  const known = layer_channels(layer, of).map((channel) => prefix + channel);
  for (const channel of has)
    if (!known.includes(channel)) advise(`${name}/${channel}`, 'is not known');
}

/** What does not keep a reader from reading right: parts of no listed layer, names of channels. */
function check_surroundings(fabric, report, advise) {
  const {file: {parts}, texels, raw} = fabric;
  if (!parts.some(({name}) => name === 'preview'))
    report('FABRIC_PART', 'preview', 'the part is missing');
  else if (parts[0].name !== 'preview')
    advise(parts[0].name, 'the first part is not the preview');
  const owner = new Map();
  const is_listed = (name) => {
    const {of, layer} = side_of_part(fabric, name);
    return LAYERS.includes(layer) && (of === fabric ? raw : of?.raw)?.layers?.[layer];
  };
  for (const part of parts) {
    advise_on_part(part, fabric, advise);
    if (part.name === 'preview')
      check_windows(part, texels, report);
    else if (!is_listed(part.name)) {
      check_windows(part, texels, report);
      advise(part.name, 'the part is of no known layer');
    }
    for (const {name} of part.channels) {
      const place = `${part.name}/${name}`;
      if (owner.has(name)) report('FABRIC_CHANNEL', place, `also in part ${owner.get(name)}`);
      owner.set(name, part.name);
      if (part.name !== 'preview' && /[RGBAY]$/.test(name))
        report('FABRIC_CHANNEL', place, 'a name that tools take for a colour');
    }
  }
}

function check_levels(fabric, warn) {
  const chain = fabric.texels ? chain_length(...fabric.texels) : 0;
  const {whole} = fabric;
  const beyond = (whole?.level ?? 0) + fabric.levels, all = whole?.levels ?? beyond;
  if (fabric.levels < chain && all === beyond) warn('FABRIC_LEVELS', '/levels', `${fabric.levels} of ${chain} levels`);
  if (whole) {
    const missing = Array.from({length: all}, (_, k) => k).filter((k) => k < whole.level || k >= beyond);
    warn('FABRIC_LEVELS', '/whole', `the levels ${missing.join(', ')} of ${all} are missing`);
  }
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

/** What of the light from `light` a texel sends to all views: the integral of alpha f v_z, per channel. */
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

/** Warns of lobes and energy of level k. `numbers`: by side, those of its layers. */
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
export function check_fabric(bytes) {
  const issues = [];
  const warn = (code, place, message) => issues.push({code, severity: 'warning', place, message});
  const advise = (place, message) => warn('FABRIC_ADVICE', place, message);
  const report = (code, place, message) => {
    issues.push({code, severity: 'error', place, message});
  };
  let fabric;
  collect(issues, () => {
    fabric = open_fabric(bytes, report);
  });
  if (!fabric) return issues;
  check_surroundings(fabric, report, advise);
  for (const part of fabric.file.parts) {
    if (LOSSY.includes(part.compression)) continue;
    part.levels.forEach((_, k) => {
      const {of, layer} = side_of_part(fabric, part.name);
      if (of?.layers[layer]?.levels.includes(k)) return;
      collect(issues, () => {
        const zero = [...read_level(part, k).values()].every(({bytes: data}) => data.every((b) => b === 0));
        if (!zero && of?.layers[layer])
          advise(`${part.name}/level ${k}`, 'is not listed, but not zero');
      });
    });
  }
  check_levels(fabric, warn);
  const whole = !has_error(issues);
  const bases = {};  // they stand at level 0 and belong to all
  if (whole) check_text(fabric, advise);
  for (let k = 0; k < (fabric.levels ?? 0); ++k) {
    const before = issues.length, numbers = {};
    for (const [side, of] of Object.entries({front: fabric, ...fabric.sides})) {
      const own = numbers[side] = {}, prefix = side === 'front' ? '' : `${side}.`;
      const note = (code, place, message) => report(code, prefix + place, message);
      for (const name of LAYERS) {
        if (side !== 'front' && name === 'yarns') continue;
        if (level_of_texels(of, name, k) === k)
          collect(issues, () => {
            own[name] = read_layer(of, name, k, note);
          });
      }
      if (k === 0) bases[side] = own.bases;
      if (side === 'front' && own.yarns && own.indirect && issues.length === before)
        collect(issues, () => yarns_of(fabric, own));
      own.bases = bases[side];
    }
    // Of a fabric that is not whole the light says nothing.
    if (whole && !has_error(issues.slice(before))) check_light(fabric, numbers, k, warn);
  }
  return issues;
}

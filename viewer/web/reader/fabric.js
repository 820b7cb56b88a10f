// Reads fabric files (spec/fabric.md): headers and attribute text first, then one level of one layer at a
// time.
//
// Every function that finds fault calls `report(code, place, message)`. A reader throws there; a checker
// takes a note and goes on.
import {joined, latin1, latin1_bytes} from './bytes.js';
import {LIMITS as EXR_LIMITS, LOSSY, chain_length, level_size, read_headers} from './exr.js';
import {channel_values, read_level} from './exr_level.js';
import {Issue} from './issue.js';
import {is_number, is_object, parse_json} from './json.js';
import {
  LAYERS,
  SPREAD,
  channel_count,
  layer_channels,
  level_of_texels,
  needs_lights,
  needs_views,
  used_count
} from './layers.js';
import {xxh3_128} from './xxh3.js';

export const LIMITS = {
  texels: 4096,
  directions: 4096,
  lobes: 16,
  products: 256,
  functions: 256,
  curves: 2 ** 16,
  nodes: 2 ** 20,
  stations: 2 ** 18,
  fields: 64,
  nesting: 64
};
const LARGEST_INTEGER = 2 ** 31 - 1;

export function throw_issue(code, place, message) {
  throw new Issue(code, place, message);
}

const is_integer = Number.isInteger;
const fits_single = (x) => is_number(x) && Number.isFinite(Math.fround(x));
const pair_of = (test) => (x) => Array.isArray(x) && x.length === 2 && x.every(test);
const in_range = (low, high) => (x) => is_integer(x) && x >= low && x <= high;

/** The digest of the pixels of read_level. */
export const pixel_digest = (channels) =>
  xxh3_128(joined([...channels.values()].map((channel) => channel.bytes)));

/** The header digest of a file of read_headers. */
export function header_digest(file) {
  const names = file.parts.map(
    (part) => `\n${part.name}` + part.channels.map(({name, type}) => `\n${name} ${type}`).join(''));
  return xxh3_128(
    joined([file.parts[0].attributes.get('selvedge.fabric').value, latin1_bytes(names.join(''))]));
}

function parse_text(file) {
  const attribute = file.parts[0].attributes.get('selvedge.fabric');
  const fail = (message) => throw_issue('FABRIC_MALFORMED', 'selvedge.fabric', message);
  if (attribute?.type !== 'string') fail('part 0 has no attribute text');
  let text;
  try {
    text = parse_json(attribute.value, LIMITS.nesting);
  } catch (error) {
    if (!(error instanceof SyntaxError)) throw error;
    fail(`the attribute text is not JSON: ${error.message}`);
  }
  if (!is_object(text)) fail('the attribute text is not an object');
  return text;
}

/** A list of products at each of `levels` levels; any number of them where that is null. */
const are_pairs = (levels) => (lists) => Array.isArray(lists) &&
  (levels === null || lists.length === levels) &&
  lists.every(
    (list) => Array.isArray(list) && list.length >= 1 && list.length <= LIMITS.products &&
      list.every(
        (pair) => Array.isArray(pair) && pair.length === 2 && in_range(0, LIMITS.functions)(pair[0]) &&
          in_range(0, LIMITS.functions - 1)(pair[1])));
const are_functions = (x) =>
  is_object(x) && in_range(0, LIMITS.functions)(x.views) && in_range(1, LIMITS.functions)(x.lights);
const integer_of = (name, low, high) => [name, in_range(low, high), `an integer of ${low} to ${high}`];

/** What layers have besides levels and precision: [name, test, what it has to be]. */
const OWN_MEMBERS = {
  lobes: () => [integer_of('lobes', 0, LIMITS.lobes)],
  products: (levels) => [['pairs', are_pairs(levels), 'a list of pairs for each level of the layer']],
  bases: () => [['functions', are_functions, 'two numbers of functions, views and lights']],
  yarns: () =>
    [integer_of('curves', 1, LIMITS.curves), integer_of('nodes', 2, LIMITS.nodes),
     integer_of('stations', 1, LIMITS.stations)],
};
/** Those of them that may be missing. */
const OPTIONAL_MEMBERS = {yarns: [integer_of('fields', 11, LIMITS.fields)]};

/** The members of the text: types and ranges. The result has only members that were good. */
function check_members(text, report) {
  const good = {layers: {}};
  const member = (holder, at, name, test, what) => {
    if (!Object.hasOwn(holder, name)) return report('FABRIC_MEMBER', `${at}/${name}`, 'is missing');
    if (!test(holder[name])) return report('FABRIC_MEMBER', `${at}/${name}`, `is not ${what}`);
    return true;
  };
  const take = (name, test, what) => {
    if (member(text, '', name, test, what)) good[name] = text[name];
  };

  take('version', pair_of(in_range(0, LARGEST_INTEGER)), 'two integers');
  take('texels', pair_of(in_range(1, LIMITS.texels)), `two integers of 1 to ${LIMITS.texels}`);
  const chain = good.texels ? chain_length(...good.texels) : 13;
  take('levels', in_range(1, chain), `an integer of 1 to ${chain}`);
  take('mmPerRepeat', pair_of((x) => fits_single(x) && Math.fround(x) > 0), 'two positive numbers');
  take('referenceHeight', fits_single, 'a number');
  take('thickness', (x) => fits_single(x) && x >= 0, 'a number from 0 up');
  if (Object.hasOwn(text, 'radianceScale'))
    take('radianceScale', (x) => fits_single(x) && Math.fround(x) > 0, 'a positive number');
  if (Object.hasOwn(text, 'whole') && good.texels) {
    take('whole', is_object, 'an object');
    const at = '/whole', {whole} = good;
    const fine = whole &&
      member(whole, at, 'texels', pair_of(in_range(1, LIMITS.texels)), `two integers of 1 to ${LIMITS.texels}`) &&
      member(whole, at, 'level', in_range(0, chain_length(...whole.texels) - 1), 'one of its levels');
    const size = (side) => Math.max(1, whole.texels[side] >> whole.level);
    if (fine && !(size(0) === good.texels[0] && size(1) === good.texels[1]))
      report('FABRIC_MEMBER', at, 'the level has another size');
    else if (fine && good.levels) {
      const all = Object.hasOwn(whole, 'levels') ? whole.levels : whole.level + good.levels;
      const has_all = in_range(whole.level + good.levels, chain_length(...whole.texels))(all);
      if (!has_all) report('FABRIC_MEMBER', `${at}/levels`, 'is not the number of levels of the whole');
      else if (all === good.levels) report('FABRIC_MEMBER', `${at}/level`, 'no level is missing');
    }
  }
  take('provenance', is_object, 'an object');
  take('digests', is_object, 'an object');

  const grid = (name) => {
    take(name, is_object, 'an object');
    const at = `/${name}`, members = good[name];
    if (!members) return;
    let fine = member(members, at, 'layout', (x) => typeof x === 'string', 'a string');
    if (fine && members.layout !== 'equal-area')
      fine = report('FABRIC_UNSUPPORTED', `${at}/layout`, members.layout);
    for (const side of ['columns', 'rows'])
      fine = member(members, at, side, in_range(1, LIMITS.directions), 'an integer of 1 to 4,096') && fine;
    if (fine && members.columns * members.rows > LIMITS.directions)
      fine = report('FABRIC_MEMBER', at, 'more than 4,096 directions');
    if (!fine) delete good[name];
  };
  grid('views');

  if (!member(text, '', 'layers', is_object, 'an object')) return good;
  for (const [name, layer] of Object.entries(text.layers)) {
    const at = `/layers/${name}`;
    if (!LAYERS.includes(name)) {
      if (!is_object(layer) || layer.optional !== true)
        report('FABRIC_UNSUPPORTED', at, 'a layer that is not known');
      continue;
    }
    if (!is_object(layer)) {
      report('FABRIC_MEMBER', at, 'is not an object');
      continue;
    }
    const levels = (x) => Array.isArray(x) && x.length > 0 &&
      x.every((k, i) => in_range(i ? x[i - 1] + 1 : 0, (good.levels ?? chain) - 1)(k));
    let fine = member(layer, at, 'levels', levels, 'a rising list of the fabric\'s levels');
    if (Object.hasOwn(layer, 'optional'))
      fine = member(layer, at, 'optional', (x) => typeof x === 'boolean', 'a boolean') && fine;
    for (const [own, test, what] of OWN_MEMBERS[name]?.(fine ? layer.levels.length : null) ?? [])
      fine = member(layer, at, own, test, what) && fine;
    for (const [own, test, what] of OPTIONAL_MEMBERS[name] ?? [])
      if (Object.hasOwn(layer, own)) fine = member(layer, at, own, test, what) && fine;
    if (SPREAD.includes(name) && fine && String(layer.levels) !== '0')
      fine = report('FABRIC_MEMBER', `${at}/levels`, 'is not level 0 alone');
    const digests = (x) => Array.isArray(x) &&
      x.every((d) => typeof d === 'string' && /^[0-9a-f]{32}$/.test(d)) &&
      (!fine || x.length === layer.levels.length);
    if (good.digests)
      fine = member(good.digests, '/digests', name, digests, 'a digest for each level of the layer') && fine;
    if (fine && good.digests) good.layers[name] = {...layer, digests: good.digests[name]};
  }
  if (Object.keys(text.layers).some(needs_lights)) grid('lights');
  const {products, bases} = good.layers;
  const bad = (at, message) => {
    report('FABRIC_MEMBER', at, message);
    delete good.layers.products;
  };
  if (products && !text.layers.bases) bad('/layers/products', 'there are no bases');
  const within = ([a, b]) => a <= bases.functions.views && b < bases.functions.lights;
  if (products && bases && !products.pairs.flat().every(within))
    bad('/layers/products/pairs', 'not all are pairs of the bases\' functions');
  const lacking = {yarns: 'indirect', indirect: 'yarns'};
  for (const [one, other] of Object.entries(lacking)) {
    const is_half = text.layers[one] && !text.layers[other];
    if (is_half) report('FABRIC_MEMBER', `/layers/${one}`, `there is no layer ${other}`);
  }
  drop_half_of_yarn(good.layers);
  return good;
}

/** How a data part has to be laid out; whether it is. `texels` may be missing where the text was wrong. */
export function check_layout(part, texels, report) {
  const {name, tile, lineOrder, compression} = part;
  let fine = true;
  if (tile?.mode !== 1) fine = report('FABRIC_PART', name, 'is not tiled with mip levels');
  if (lineOrder !== 'increasing') fine = report('FABRIC_PART', name, 'the line order is not INCREASING_Y');
  if (LOSSY.includes(compression)) fine = report('FABRIC_LOSSY', name, `compression ${compression}`);
  return check_windows(part, texels, report) && fine;
}

/** Whether data window and display window of a part are the texels of level 0. */
export function check_windows(part, texels, report) {
  if (!texels) return false;
  const expected = [0, 0, texels[0] - 1, texels[1] - 1];
  let fine = true;
  for (const name of ['dataWindow', 'displayWindow']) {
    if (part[name].some((x, i) => x !== expected[i]))
      fine = report('FABRIC_PART', part.name, `the ${name} is not that of the texels`);
  }
  return fine;
}

/** Whether all is known that the channels of a layer follow from. */
export const is_laid_out = (name, {texels, views, lights, layers}) => texels && (views || !needs_views(name)) &&
  (lights || !needs_lights(name)) && (layers.yarns || name !== 'indirect');

/** Takes the layers of yarn out where one is missing or not fine. */
function drop_half_of_yarn(layers) {
  if (layers.yarns && layers.indirect) return;
  delete layers.yarns;
  delete layers.indirect;
}

/** Whether a part has all channels of its layer. */
function check_channels(name, part, text, report) {
  const has = new Set(part.channels.map((channel) => channel.name));
  // Counted before they are named: a text of some bytes can ask for millions.
  const count = channel_count(name, text);
  if (count > EXR_LIMITS.channels) return report('FABRIC_CHANNEL', name, `${count} channels are needed`);
  const missing = layer_channels(name, text).filter((channel) => !has.has(channel));
  for (const channel of missing) report('FABRIC_CHANNEL', `${name}/${channel}`, 'is missing');
  return missing.length === 0;
}

/** The parts of the listed layers. A layer whose part is not fine is taken out of `text.layers`. */
function check_parts(file, text, report) {
  for (const [name, layer] of Object.entries(text.layers)) {
    layer.part = file.parts.find((part) => part.name === name);
    let fine = layer.part ? check_layout(layer.part, text.texels, report) :
                            report('FABRIC_PART', name, 'the part is missing');
    if (layer.part && is_laid_out(name, text)) fine = check_channels(name, layer.part, text, report) && fine;
    if (!fine) delete text.layers[name];
  }
  drop_half_of_yarn(text.layers);
}

/** The sides of the cloth besides the front (spec/fabric.md, Other sides), and the layers that they do not have. */
export const SIDES = ['back', 'through', 'back.through'];
const NOT_OF = {
  'back': ['yarns', 'indirect'],
  'through': ['yarns', 'opacity'],
  'back.through': ['yarns', 'indirect', 'opacity']
};

/**
 * Adds another side to the sides of a fabric: a fabric of its own, whose parts and channels have their names without
 * that of the side. The light of yarn that comes through has the front's yarn beside it.
 */
function add_side(front, name, report) {
  const at = `/sides/${name}`, own = front.raw.sides[name], prefix = `${name}.`;
  const note = (code, place, message) =>
    report(code, place.startsWith('/') ? at + place : prefix + place, message);
  const refuse = (place, message) => report('FABRIC_MEMBER', at + place, message);
  if (!is_object(own)) return refuse('', 'is not an object');
  const forbidden = NOT_OF[name].find((layer) => Object.hasOwn(own.layers ?? {}, layer));
  if (forbidden) return refuse(`/layers/${forbidden}`, 'is not a layer of this side');
  const cut = (x) => x.startsWith(prefix) ? x.slice(prefix.length) : x;
  const parts = front.file.parts.filter((part) => part.name.startsWith(prefix)).map((part) => ({
    ...part,
    name: cut(part.name),
    channels: part.channels.map((channel) => ({...channel, name: cut(channel.name)})),
  }));
  const {version, texels, levels, mmPerRepeat, referenceHeight, thickness, whole} = front.raw;
  const shared = {version, texels, levels, mmPerRepeat, referenceHeight, thickness};
  const raw = {...shared, ...whole === undefined ? {} : {whole}, ...own};
  const lit = is_object(own.layers) && Object.hasOwn(own.layers, 'indirect');
  if (lit && !front.layers.yarns) return refuse('/layers/indirect', 'there is no layer yarns');
  if (lit && is_object(own.digests)) {
    raw.layers = {...own.layers, yarns: front.raw.layers.yarns};
    raw.digests = {...own.digests, yarns: front.raw.digests.yarns};
    parts.push(front.layers.yarns.part);
  }
  const text = check_members(raw, note);
  check_parts({...front.file, parts}, text, note);
  const seen = name === 'back.through' ? front.sides.back : front;
  const same = (a, b) => a && b && a.columns === b.columns && a.rows === b.rows;
  if (!seen || (name !== 'back' && !same(text.views, seen.views)))
    return refuse('', 'the views are not those of the side that is seen');
  const has = (k) => ['lobes', 'table', 'light', 'products'].some((layer) => text.layers[layer]?.levels.includes(k));
  const shown = Array.from({length: text.levels ?? 0}, (_, k) => k);
  for (const k of [...shown].reverse()) {
    if (has(k)) continue;
    if (k === shown.length - 1) return refuse('', `level ${k} has no layer of it, nor has a coarser one`);
    if (['frame', 'opacity'].some((layer) => text.layers[layer]?.levels.includes(k)))
      return refuse('', `level ${k} has a layer of it, but no reflectance`);
    shown[k] = shown[k + 1];
  }
  front.sides[name] = {file: {...front.file, parts}, raw, ...text, shown};
}

/** Headers and text of a fabric file (a Uint8Array); the pixels are not touched. */
export function open_fabric(bytes, report = throw_issue) {
  const file = read_headers(bytes);
  const raw = parse_text(file);
  const version = raw.version;
  if (Array.isArray(version) && is_integer(version[0]) && version[0] !== 3) {
    throw_issue('FABRIC_VERSION', '/version', `major version ${version[0]}, not 3`);
  }
  const digest = file.parts[0].attributes.get('selvedge.digest');
  if (digest?.type !== 'string' || latin1(digest.value) !== header_digest(file)) {
    report('FABRIC_DIGEST', 'selvedge.digest', 'is not the digest of the header');
  }
  const text = check_members(raw, report);
  check_parts(file, text, report);
  const fabric = {file, raw, ...text, sides: {}};
  if (!Object.hasOwn(raw, 'sides')) return fabric;
  if (!is_object(raw.sides))
    report('FABRIC_MEMBER', '/sides', 'is not an object');
  else
    for (const name of SIDES.filter((side) => Object.hasOwn(raw.sides, side))) add_side(fabric, name, report);
  return fabric;
}

/** A stored value must be finite and within its range; `values` is what read_layer gives. */
function check_values(fabric, layer, level, values, report) {
  const {width} = fabric.layers[layer].part.levels[level];
  const bad = (t, channel, message) => report(
    'FABRIC_NOT_FINITE', `${layer}/level ${level}${channel}/${t % width},${Math.floor(t / width)}`, message);
  const length = ([x, y, z]) => Math.hypot(x, y, z);
  for (const [name, numbers] of values) {
    const unsigned = ['table', 'opacity', 'light'].includes(layer) || /^lobes\.(diffuse|\d+\.n)\./.test(name);
    const largest = layer === 'opacity' ? 1 : Infinity;
    const least = unsigned ? 0 : -Infinity;
    for (let t = 0, end = Math.min(numbers.length, used_count(layer, fabric, level, name)); t < end; ++t) {
      const x = numbers[t];
      // The difference of a number from itself is 0, of what is none NaN.
      if (!(x >= least && x <= largest && x - x === 0)) return bad(t, `/${name}`, `is ${x}`);
    }
  }
  if (layer !== 'frame') return true;
  const at = (t, names) => names.map((name) => values.get(`frame.${name}`)[t]);
  for (let t = 0; t < values.get('frame.nx').length; ++t) {
    const n = at(t, ['nx', 'ny', 'nz']), d = at(t, ['tx', 'ty', 'tz']);
    if (
      Math.abs(length(n) - 1) > 0.01 || Math.abs(length(d) - 1) > 0.01 ||
      Math.abs(n[0] * d[0] + n[1] * d[1] + n[2] * d[2]) > 0.01) {
      return bad(t, '', 'normal and tangent are not unit and perpendicular');
    }
  }
  return true;
}

/** The values of a coarser level, each for the texels of a level that lie on its own. */
function finer({texels}, values, level, coarser) {
  if (!values) return null;
  const size = (k) => texels.map((n) => level_size(n, k)), [width, height] = size(level), [w, h] = size(coarser);
  if (4 * values.size * width * height > EXR_LIMITS.level_bytes)
    throw_issue('FILE_TOO_LARGE', `level ${level}`, 'has too many numbers, those of a coarser one');
  const from = Array.from({length: width * height}, (_, t) => {
    const [x, y] = [t % width, Math.floor(t / width)].map((place) => place >> (coarser - level));
    return Math.min(y, h - 1) * w + Math.min(x, w - 1);
  });
  return new Map([...values].map(([name, list]) => [name, Float32Array.from(from, (at) => list[at])]));
}

/**
 * The numbers of a layer at a level, a Map from channel names to Float32Array, after the digest and the
 * values have been checked; null where the level lacks the layer.
 */
export function read_layer(fabric, layer, level, report = throw_issue) {
  const shown = level_of_texels(fabric, layer, level);
  if (shown !== level) return finer(fabric, read_layer(fabric, layer, shown, report), level, shown);
  const entry = fabric.layers[layer]?.levels.indexOf(level) ?? -1;
  if (entry < 0) return null;
  const {part, digests} = fabric.layers[layer];
  const place = `${layer}/level ${level}`;
  const channels = read_level(part, level);
  if (pixel_digest(channels) !== digests[entry])
    report('FABRIC_DIGEST', place, 'the pixels do not have the stored digest');
  const values =
    new Map(layer_channels(layer, fabric).map((name) => [name, channel_values(channels.get(name))]));
  check_values(fabric, layer, level, values, report);
  return values;
}

// Reads fabric files (spec/fabric.md): headers, attribute text and the pixels of the listed levels first, then the values of
// one layer at one level at a time.
//
// Every function that finds a fault calls `report(code, place, message)`. A reader throws there; a checker takes a note and
// goes on.
import {joined, latin1, latin1_bytes} from './bytes.js';
import {LIMITS as EXR_LIMITS, chain_length, channel_values, level_size, read_headers, read_level, unpack} from './exr.js';
import {throw_issue} from './issue.js';
import {is_object, parse_json} from './json.js';
import {
  LAYERS, SPREAD, TRANSFER_VALUES, channel_count, layer_channels, level_of_texels, needs_lights, needs_views, used_count
} from './layers.js';
import {xxh3_128} from './xxh3.js';

/** Major versions that are read; files of packed yarn and maps have the second. */
export const VERSIONS = [4, 5];
export const LIMITS = {
  texels: 4096, directions: 4096, lobes: 16, products: 256, functions: 256, curves: 2 ** 16, nodes: 2 ** 20,
  stations: 2 ** 18, fields: 64, values: 256, stitches: 2 ** 20, nesting: 64
};
const LARGEST_INTEGER = 2 ** 31 - 1;

const fits_single = (x) => typeof x === 'number' && Number.isFinite(Math.fround(x));
const is_positive = (x) => fits_single(x) && Math.fround(x) > 0;
const pair_of = (test) => (x) => Array.isArray(x) && x.length === 2 && x.every(test);
const in_range = (low, high) => (x) => Number.isInteger(x) && x >= low && x <= high;

/** The digest of the pixels of read_level. */
export const pixel_digest = (channels) => xxh3_128(joined([...channels.values()].map(({bytes}) => bytes)));

/** The header digest of a file of read_headers. */
export function header_digest({parts}) {
  const names = parts.map(({name, channels}) => `\n${name}` + channels.map((c) => `\n${c.name} ${c.type}`).join(''));
  return xxh3_128(joined([parts[0].attributes.get('selvedge.fabric').value, latin1_bytes(names.join(''))]));
}

function parse_text({parts: [{attributes}]}) {
  const attribute = attributes.get('selvedge.fabric');
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

const integer = (low, high) => [in_range(low, high), `an integer of ${low} to ${high}`];
const integers = (low, high) => [pair_of(in_range(low, high)), `two integers of ${low} to ${high}`];
const object = [is_object, 'an object'];
/** Members of the text: name, test, what it has to be. */
const MEMBERS = [
  ['version', ...integers(0, LARGEST_INTEGER)],
  ['texels', ...integers(1, LIMITS.texels)],
  ['mmPerRepeat', pair_of(is_positive), 'two positive numbers'],
  ['referenceHeight', fits_single, 'a number'],
  ['thickness', (x) => fits_single(x) && x >= 0, 'a number from 0 up'],
  ['provenance', ...object],
  ['digests', ...object],
];
const OPTIONAL = [
  ['radianceScale', is_positive, 'a positive number'],
  ...['variation', 'recipe', 'accuracy', 'sheet', 'fallback'].map((name) => [name, ...object]),
  ['colourways', Array.isArray, 'an array'],
];

/** A list of products for each of `levels` levels; for any number of levels where that is null. */
const are_pairs = (levels) => (lists) => Array.isArray(lists) && (levels === null || lists.length === levels) &&
  lists.every(
    (list) => Array.isArray(list) && list.length >= 1 && list.length <= LIMITS.products &&
      list.every(
        (pair) => Array.isArray(pair) && pair.length === 2 && in_range(0, LIMITS.functions)(pair[0]) &&
          in_range(0, LIMITS.functions - 1)(pair[1])));
const are_functions = (x) =>
  is_object(x) && in_range(0, LIMITS.functions)(x.views) && in_range(1, LIMITS.functions)(x.lights);

const is_map_size = (x) => pair_of(in_range(1, LIMITS.stitches))(x) && x[0] * x[1] <= LIMITS.stitches;
const is_packing = (x) => is_object(x) && in_range(1, LIMITS.functions)(x.functions) && is_positive(x.step);

/** Members of layers besides levels and optional; `levels`: the number of the layer's levels, null if that is unknown. */
const OWN_MEMBERS = {
  lobes: () => [['lobes', ...integer(0, LIMITS.lobes)]],
  products: (levels) => [['pairs', are_pairs(levels), 'a list of pairs for each level of the layer']],
  bases: () => [['functions', are_functions, 'two numbers of functions, views and lights']],
  yarns: (_, layer) =>
    [['curves', ...integer(1, LIMITS.curves)], ['nodes', ...integer(2, LIMITS.nodes)],
     ['stations', ...integer(1, LIMITS.stations)], ['fields', ...integer(11, LIMITS.fields)],
     ...Object.hasOwn(layer, 'packed') ? [['packed', is_packing, 'a number of functions and a step']] : [],
     ...Object.hasOwn(layer, 'valuesPerStation') ? [['valuesPerStation', ...integer(TRANSFER_VALUES, LIMITS.values)]] : []],
  map: () => [['size', is_map_size, `two integers from 1 whose product is at most ${LIMITS.stitches}`]],
};

/** Layers that a fabric with a map cannot have. */
const NOT_MAPPED = ['lobes', 'frame', 'table', 'light'];

/** The members of the text: types and ranges. The result has only the members that are good. */
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
  for (const row of MEMBERS) take(...row);
  for (const row of OPTIONAL) if (Object.hasOwn(text, row[0])) take(...row);
  for (const i of (good.colourways ?? []).keys()) member(good.colourways, '/colourways', i, ...object);
  const chain = good.texels ? chain_length(...good.texels) : 13;
  take('levels', ...integer(1, chain));

  const grid = (name) => {
    take(name, ...object);
    const at = `/${name}`, members = good[name];
    if (!members) return;
    let fine = member(members, at, 'layout', (x) => typeof x === 'string', 'a string');
    if (fine && members.layout !== 'equal-area') fine = report('FABRIC_UNSUPPORTED', `${at}/layout`, members.layout);
    for (const side of ['columns', 'rows']) fine = member(members, at, side, ...integer(1, LIMITS.directions)) && fine;
    if (fine && members.columns * members.rows > LIMITS.directions)
      fine = report('FABRIC_MEMBER', at, `more than ${LIMITS.directions} directions`);
    if (!fine) delete good[name];
  };
  grid('views');

  if (!member(text, '', 'layers', ...object)) return good;
  for (const [name, layer] of Object.entries(text.layers)) {
    const at = `/layers/${name}`;
    if (!LAYERS.includes(name)) {
      if (!is_object(layer) || layer.optional !== true) report('FABRIC_UNSUPPORTED', at, 'an unknown layer');
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
    for (const row of OWN_MEMBERS[name]?.(fine ? layer.levels.length : null, layer) ?? []) fine = member(layer, at, ...row) && fine;
    if (SPREAD.includes(name) && fine && String(layer.levels) !== '0')
      fine = report('FABRIC_MEMBER', `${at}/levels`, 'is not level 0 alone');
    const digests = (x) => Array.isArray(x) && x.every((d) => typeof d === 'string' && /^[0-9a-f]{32}$/.test(d)) &&
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
  for (const [one, other] of [['yarns', 'indirect'], ['indirect', 'yarns']])
    if (text.layers[one] && !text.layers[other]) report('FABRIC_MEMBER', `/layers/${one}`, `there is no layer ${other}`);
  if (text.layers.map) {
    for (const other of ['yarns', 'products'])
      if (!text.layers[other]) report('FABRIC_MEMBER', '/layers/map', `there is no layer ${other}`);
    for (const other of NOT_MAPPED) if (text.layers[other]) report('FABRIC_MEMBER', `/layers/${other}`, 'is beside a map');
  }
  drop_half_of_yarn(good.layers);
  return good;
}

/** Removes the layers of yarn if one of them is missing or not good. */
function drop_half_of_yarn(layers) {
  if (layers.yarns && layers.indirect) return;
  for (const name of ['yarns', 'indirect', 'map']) delete layers[name];
}

/** Whether a part is tiled or not and has the texels of level 0. `texels` may be missing where the text is wrong. */
function check_layout({name, tile, levels: [{width, height}]}, tiled, texels, report) {
  if ((tile !== null) !== tiled) return report('FABRIC_PART', name, tiled ? 'is not tiled' : 'is tiled');
  if (texels && (width !== texels[0] || height !== texels[1]))
    return report('FABRIC_PART', name, `has ${width} x ${height} pixels, not the texels of level 0`);
  return true;
}

/** Whether everything is known that the channels of a layer follow from. */
const is_laid_out = (name, {texels, views, lights, layers}) => texels && (views || !needs_views(name)) &&
  (lights || !needs_lights(name)) && (layers.yarns || !['indirect', 'map'].includes(name));

/** Whether a part has all channels of its layer. */
function check_channels(name, part, text, report) {
  const has = new Set(part.channels.map((channel) => channel.name));
  // Counted before they are named: a short text can ask for millions.
  const count = channel_count(name, text);
  if (count > EXR_LIMITS.channels) return report('FABRIC_CHANNEL', name, `${count} channels are needed`);
  const missing = layer_channels(name, text).filter((channel) => !has.has(channel));
  for (const channel of missing) report('FABRIC_CHANNEL', `${name}/${channel}`, 'is missing');
  return missing.length === 0;
}

/** The parts of the listed layers. A layer whose part is not good is removed from `text.layers`. */
function check_parts(parts, text, report) {
  for (const [name, layer] of Object.entries(text.layers)) {
    layer.part = parts.find((part) => part.name === name);
    let fine = layer.part ? check_layout(layer.part, true, text.texels, report) :
                            report('FABRIC_PART', name, 'the part is missing');
    if (layer.part && is_laid_out(name, text)) fine = check_channels(name, layer.part, text, report) && fine;
    if (!fine) delete text.layers[name];
  }
  drop_half_of_yarn(text.layers);
}

/** The sides of the cloth besides the front (spec/fabric.md, Other sides), and the layers that they cannot have. */
export const SIDES = ['back', 'through', 'back.through'];
const NOT_OF =
  {back: ['yarns', 'indirect', 'map'], through: ['yarns', 'opacity', 'map'], 'back.through': ['yarns', 'indirect', 'opacity', 'map']};

/**
 * Adds another side to a fabric: a fabric of its own, whose parts and channels have their names without the side's prefix.
 * The light of yarn that comes through has the front's yarn beside it.
 */
function add_side(front, name, report) {
  const at = `/sides/${name}`, own = front.raw.sides[name], prefix = `${name}.`;
  const note = (code, place, message) => report(code, place.startsWith('/') ? at + place : prefix + place, message);
  const refuse = (place, message) => report('FABRIC_MEMBER', at + place, message);
  if (!is_object(own)) return refuse('', 'is not an object');
  const forbidden = [...NOT_OF[name], ...front.layers.map ? NOT_MAPPED : []].find((layer) => Object.hasOwn(own.layers ?? {}, layer));
  if (forbidden) return refuse(`/layers/${forbidden}`, 'is not a layer of this side');
  const cut = (x) => x.startsWith(prefix) ? x.slice(prefix.length) : x;
  const parts = front.parts.filter((part) => part.name.startsWith(prefix)).map((part) => ({
    ...part,
    name: cut(part.name),
    channels: part.channels.map((channel) => ({...channel, name: cut(channel.name)})),
  }));
  const {version, texels, levels, mmPerRepeat, referenceHeight, thickness} = front.raw;
  const raw = {version, texels, levels, mmPerRepeat, referenceHeight, thickness, ...own};
  const lit = is_object(own.layers) && Object.hasOwn(own.layers, 'indirect');
  if (lit && !front.layers.yarns) return refuse('/layers/indirect', 'there is no layer yarns');
  if (lit && is_object(own.digests)) {
    raw.layers = {...own.layers, yarns: front.raw.layers.yarns};
    raw.digests = {...own.digests, yarns: front.raw.digests.yarns};
    parts.push(front.layers.yarns.part);
  }
  const text = check_members(raw, note);
  check_parts(parts, text, note);
  const seen = name === 'back.through' ? front.sides.back : front;
  const same = (a, b) => a && b && a.columns === b.columns && a.rows === b.rows;
  if (!seen || (name !== 'back' && !same(text.views, seen.views)))
    return refuse('', 'has other views than the visible side');
  const has = (k) => ['lobes', 'table', 'light', 'products'].some((layer) => text.layers[layer]?.levels.includes(k));
  const shown = Array.from({length: text.levels ?? 0}, (_, k) => k);
  for (const k of [...shown].reverse()) {
    if (has(k)) continue;
    if (k === shown.length - 1) return refuse('', `neither level ${k} nor a coarser one has a layer of this side`);
    if (['frame', 'opacity'].some((layer) => text.layers[layer]?.levels.includes(k)))
      return refuse('', `level ${k} has a layer of this side, but no reflectance`);
    shown[k] = shown[k + 1];
  }
  front.sides[name] = {raw, ...text, shown, front, ...name !== 'back' && {visible: seen}};
}

/**
 * A fabric: headers and text of a file (a Uint8Array), the pixels of all listed levels unpacked, but neither their digests
 * nor their values checked.
 */
export async function open_fabric(bytes, report = throw_issue) {
  const {parts} = read_headers(bytes), raw = parse_text({parts}), {version} = raw;
  if (Array.isArray(version) && Number.isInteger(version[0]) && !VERSIONS.includes(version[0])) {
    throw_issue(
      'FABRIC_VERSION', '/version',
      `fabric version ${version.join('.')} is not read, only ${VERSIONS.join(' and ')}: make the fabric again with 'selvedge make'`);
  }
  const digest = parts[0].attributes.get('selvedge.digest');
  if (digest?.type !== 'string' || latin1(digest.value) !== header_digest({parts}))
    report('FABRIC_DIGEST', 'selvedge.digest', 'is not the digest of the header');
  const text = check_members(raw, report);
  if (parts[0].name === 'preview')
    check_layout(parts[0], false, text.texels, report);
  else
    report('FABRIC_PART', 'preview', 'part 0 is not the preview');
  check_parts(parts, text, report);
  const fabric = {parts, raw, ...text, sides: {}};
  if (Object.hasOwn(raw, 'sides')) {
    if (!is_object(raw.sides))
      report('FABRIC_MEMBER', '/sides', 'is not an object');
    else
      for (const name of SIDES.filter((side) => Object.hasOwn(raw.sides, side))) add_side(fabric, name, report);
  }
  for (const {layers} of [fabric, ...Object.values(fabric.sides)])
    for (const {part, levels} of Object.values(layers)) await unpack(part, levels);
  return fabric;
}

/** A stored value must be finite and within its range; `values` is the result of read_layer. */
function check_values(fabric, layer, level, values, report) {
  const {width} = fabric.layers[layer].part.levels[level];
  const bad = (t, channel, message) => report(
    'FABRIC_NOT_FINITE', `${layer}/level ${level}${channel}/${t % width},${Math.floor(t / width)}`, message);
  for (const [name, numbers] of values) {
    const unsigned = ['table', 'opacity', 'light'].includes(layer) || /^lobes\.(diffuse|\d+\.n)\./.test(name);
    const least = unsigned ? 0 : -Infinity, largest = layer === 'opacity' ? 1 : Infinity;
    for (let t = 0, end = Math.min(numbers.length, used_count(layer, fabric, level, name)); t < end; ++t) {
      const x = numbers[t];
      if (!(x >= least && x <= largest && Number.isFinite(x))) return bad(t, `/${name}`, `is ${x}`);
    }
  }
  if (layer !== 'frame') return true;
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  for (let t = 0; t < values.get('frame.nx').length; ++t) {
    const [n, d] = ['n', 't'].map((of) => ['x', 'y', 'z'].map((axis) => values.get(`frame.${of}${axis}`)[t]));
    if (Math.abs(Math.hypot(...n) - 1) > 0.01 || Math.abs(Math.hypot(...d) - 1) > 0.01 || Math.abs(dot(n, d)) > 0.01)
      return bad(t, '', 'normal and tangent are not unit and perpendicular');
  }
  return true;
}

/** The values of a coarser level, copied to the texels of a level that lie in its texels. */
function finer({texels}, values, level, coarser) {
  if (!values) return null;
  const size = (k) => texels.map((n) => level_size(n, k)), [width, height] = size(level), [w, h] = size(coarser);
  if (4 * values.size * width * height > EXR_LIMITS.level_bytes)
    throw_issue('FILE_TOO_LARGE', `level ${level}`, 'has too many numbers of a coarser level');
  const from = Array.from({length: width * height}, (_, t) => {
    const [x, y] = [t % width, Math.floor(t / width)].map((place) => place >> (coarser - level));
    return Math.min(y, h - 1) * w + Math.min(x, w - 1);
  });
  return new Map([...values].map(([name, list]) => [name, Float32Array.from(from, (at) => list[at])]));
}

/**
 * The numbers of a layer at a level, a Map from channel names to Float32Array, digest and values checked; null if the level
 * lacks the layer.
 */
export function read_layer(fabric, layer, level, report = throw_issue) {
  const shown = level_of_texels(fabric, layer, level);
  if (shown !== level) return finer(fabric, read_layer(fabric, layer, shown, report), level, shown);
  const entry = fabric.layers[layer]?.levels.indexOf(level) ?? -1;
  if (entry < 0) return null;
  const {part, digests} = fabric.layers[layer], channels = read_level(part, level);
  if (pixel_digest(channels) !== digests[entry])
    report('FABRIC_DIGEST', `${layer}/level ${level}`, 'the pixels do not have the stored digest');
  const values = new Map(layer_channels(layer, fabric).map((name) => [name, channel_values(channels.get(name))]));
  check_values(fabric, layer, level, values, report);
  return values;
}

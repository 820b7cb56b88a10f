// Reads fabric files (spec/fabric.md): headers and attribute text first, then one level of one layer at a
// time.
//
// Every function that finds fault calls `report(code, place, message)`. A reader throws there; a checker
// takes a note and goes on.
import {chain_length, channel_values, level_size, read_headers, read_level} from './exr.mjs';
import {Issue} from './issue.mjs';
import {is_number, is_object, parse_json} from './json.mjs';
import {xxh3_128} from './xxh3.mjs';

export const LAYERS = ['lobes', 'frame', 'table', 'opacity'];
export const LIMITS = {
  texels: 4096,
  views: 4096,
  lobes: 16,
  nesting: 64
};
const LARGEST_INTEGER = 2 ** 31 - 1;
export const LOSSY = ['pxr24', 'b44', 'b44a', 'dwaa', 'dwab'];
const COLOURS = ['red', 'green', 'blue'];

export function throw_issue(code, place, message) {
  throw new Issue(code, place, message);
}

const is_integer = Number.isInteger;
const fits_single = (x) => is_number(x) && Number.isFinite(Math.fround(x));
const pair_of = (test) => (x) => Array.isArray(x) && x.length === 2 && x.every(test);
const in_range = (low, high) => (x) => is_integer(x) && x >= low && x <= high;
const view_name = (layer, k, suffix = '') => `${layer}.${String(k).padStart(4, '0')}${suffix}`;

/** The channels that a layer needs. */
export function layer_channels(layer, K, V) {
  const each = (n, names) => Array.from({length: n}, (_, i) => names(i)).flat();
  switch (layer) {
    case 'lobes':
      return [
        'lobes.diffuse', ...each(K, (j) => ['cx', 'cy', 'cz', 'n'].map((p) => `lobes.${j}.${p}`))
      ].flatMap((name) => COLOURS.map((c) => `${name}.${c}`));
    case 'frame':
      return ['nx', 'ny', 'nz', 'tx', 'ty', 'tz'].map((name) => `frame.${name}`);
    case 'table':
      return each(V, (k) => COLOURS.map((c) => view_name('table', k, `.${c}`)));
    case 'opacity':
      return each(V, (k) => view_name('opacity', k));
  }
}

/** The digest of the pixels of read_level. */
export const pixel_digest = (channels) =>
  xxh3_128(Buffer.concat([...channels.values()].map((channel) => channel.bytes)));

/** The header digest of a file of read_headers. */
export function header_digest(file) {
  const names = file.parts.map(
    (part) => `\n${part.name}` + part.channels.map(({name, type}) => `\n${name} ${type}`).join(''));
  return xxh3_128(Buffer.concat(
    [file.parts[0].attributes.get('selvedge.fabric').value, Buffer.from(names.join(''), 'latin1')]));
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
  take('provenance', is_object, 'an object');
  take('views', is_object, 'an object');
  take('digests', is_object, 'an object');

  if (good.views) {
    const {views} = good;
    const count = in_range(1, LIMITS.views);
    let fine = member(views, '/views', 'layout', (x) => typeof x === 'string', 'a string');
    if (fine && views.layout !== 'equal-area')
      fine = report('FABRIC_UNSUPPORTED', '/views/layout', views.layout);
    for (const name of ['columns', 'rows'])
      fine = member(views, '/views', name, count, 'an integer of 1 to 4,096') && fine;
    if (fine && views.columns * views.rows > LIMITS.views)
      fine = report('FABRIC_MEMBER', '/views', 'more than 4,096 views');
    if (!fine) delete good.views;
  }

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
    if (name === 'lobes') {
      fine =
        member(layer, at, 'lobes', in_range(0, LIMITS.lobes), `an integer of 0 to ${LIMITS.lobes}`) && fine;
    }
    const digests = (x) => Array.isArray(x) &&
      x.every((d) => typeof d === 'string' && /^[0-9a-f]{32}$/.test(d)) &&
      (!fine || x.length === layer.levels.length);
    if (good.digests)
      fine = member(good.digests, '/digests', name, digests, 'a digest for each level of the layer') && fine;
    if (fine && good.digests)
      good.layers[name] = {levels: layer.levels, digests: good.digests[name], lobes: layer.lobes};
  }
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

/** The parts of the listed layers. A layer whose part is not fine is taken out of `text.layers`. */
function check_parts(file, text, report) {
  for (const [name, layer] of Object.entries(text.layers)) {
    layer.part = file.parts.find((part) => part.name === name);
    let fine = layer.part ? check_layout(layer.part, text.texels, report) :
                            report('FABRIC_PART', name, 'the part is missing');
    if (layer.part && (name === 'lobes' || name === 'frame' || text.views)) {
      const has = new Set(layer.part.channels.map((channel) => channel.name));
      const V = text.views ? text.views.columns * text.views.rows : 0;
      for (const channel of layer_channels(name, layer.lobes, V)) {
        if (!has.has(channel)) fine = report('FABRIC_CHANNEL', `${name}/${channel}`, 'is missing');
      }
    }
    if (!fine) delete text.layers[name];
  }
}

/** Headers and text of a fabric file (a Buffer); the pixels are not touched. */
export function open_fabric(bytes, report = throw_issue) {
  const file = read_headers(bytes);
  const raw = parse_text(file);
  const version = raw.version;
  if (Array.isArray(version) && is_integer(version[0]) && version[0] !== 1) {
    throw_issue('FABRIC_VERSION', '/version', `major version ${version[0]}`);
  }
  const digest = file.parts[0].attributes.get('selvedge.digest');
  if (digest?.type !== 'string' || digest.value.toString('latin1') !== header_digest(file)) {
    report('FABRIC_DIGEST', 'selvedge.digest', 'is not the digest of the header');
  }
  const text = check_members(raw, report);
  check_parts(file, text, report);
  return {file, raw, ...text};
}

/** A stored value must be finite and within its range; `values` is what fabric_layer gives. */
function check_values(layer, values, width, place, report) {
  const bad = (t, channel, message) =>
    report('FABRIC_NOT_FINITE', `${place}${channel}/${t % width},${Math.floor(t / width)}`, message);
  const length = ([x, y, z]) => Math.hypot(x, y, z);
  for (const [name, numbers] of values) {
    const unsigned = layer === 'table' || layer === 'opacity' || /^lobes\.(diffuse|\d+\.n)\./.test(name);
    const largest = layer === 'opacity' ? 1 : Infinity;
    const t = numbers.findIndex((x) => !Number.isFinite(x) || (unsigned && x < 0) || x > largest);
    if (t >= 0) return bad(t, `/${name}`, `is ${numbers[t]}`);
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

/**
 * The numbers of a layer at a level, a Map from channel names to Float64Array, after the digest and the
 * values have been checked; null where the level lacks the layer.
 */
export function read_layer(fabric, layer, level, report = throw_issue) {
  const entry = fabric.layers[layer]?.levels.indexOf(level) ?? -1;
  if (entry < 0) return null;
  const {part, digests, lobes} = fabric.layers[layer];
  const place = `${layer}/level ${level}`;
  const channels = read_level(part, level);
  if (pixel_digest(channels) !== digests[entry])
    report('FABRIC_DIGEST', place, 'the pixels do not have the stored digest');
  const V = fabric.views ? fabric.views.columns * fabric.views.rows : 0;
  const values =
    new Map(layer_channels(layer, lobes, V).map((name) => [name, channel_values(channels.get(name))]));
  check_values(layer, values, part.levels[level].width, place, report);
  return values;
}

/**
 * A level as brdf.mjs wants it, from the numbers of its layers: { lobes, frame, table, opacity }, null where
 * absent.
 */
export function make_level({texels, views, K}, level, {lobes, frame, table, opacity}) {
  const of = (values, ...names) => names.map((name) => values.get(name));
  const rgb = (values, name) => of(values, ...COLOURS.map((c) => `${name}.${c}`));
  const each_view = Array.from({length: views.columns * views.rows}, (_, k) => k);
  const result = {
    width: level_size(texels[0], level),
    height: level_size(texels[1], level),
    views,
    lobes: null,
    frame: null,
    table: null,
    opacity: null,
  };
  if (lobes) {
    const rho = rgb(lobes, 'lobes.diffuse');
    const lists = Array.from(
      {length: K},
      (_, j) => Object.fromEntries(['cx', 'cy', 'cz', 'n'].map((p) => [p, rgb(lobes, `lobes.${j}.${p}`)])));
    result.lobes = (t) => COLOURS.map(
      (_, c) => ({
        rho: rho[c][t],
        lobes: lists.map(({cx, cy, cz, n}) => ({cx: cx[c][t], cy: cy[c][t], cz: cz[c][t], n: n[c][t]})),
      }));
  }
  if (frame) {
    const normal = of(frame, 'frame.nx', 'frame.ny', 'frame.nz'),
          tangent = of(frame, 'frame.tx', 'frame.ty', 'frame.tz');
    result.frame = (t) => ({normal: normal.map((x) => x[t]), tangent: tangent.map((x) => x[t])});
  }
  if (table) {
    const lists = each_view.map((k) => rgb(table, view_name('table', k)));
    result.table = (t, k) => lists[k].map((x) => x[t]);
  }
  if (opacity) {
    const lists = each_view.map((k) => opacity.get(view_name('opacity', k)));
    result.opacity = (t, k) => lists[k][t];
  }
  return result;
}

/** Level `level` of a fabric of open_fabric, as brdf.mjs wants it. */
export function read_fabric_level(fabric, level) {
  const layers = Object.fromEntries(LAYERS.map((layer) => [layer, read_layer(fabric, layer, level)]));
  return make_level(
    {texels: fabric.texels, views: fabric.views, K: fabric.layers.lobes?.lobes}, level, layers);
}

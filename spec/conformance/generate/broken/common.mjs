// Functions for broken files. A fixture: { name: 'CODE-what', about, issues, others, evaluate } besides the members that
// make.mjs takes.
//
//   issues    the issues that a checker must find: { code or [codes of which one fits], place }
//   others    'none' or 'allowed': whether further errors may be reported
//   evaluate  the query that a reader must refuse
import {read_headers} from '../../reference/reader.mjs';

const UP = [0, 0, 1];
export const ask = (level, texel = [0, 0]) => ({level, texel, light: UP, view: UP});
export const everywhere = (value) => () => value;

/** Values of lobes of C = (xy, xy, z) for every colour. */
export const lobe = ({rho, xy = 0, z, n}) => (level, channel) => {
  if (channel.startsWith('lobes.diffuse')) return rho;
  return {cx: xy, cy: xy, cz: z, n}[channel.split('.')[2]];
};

/** The file that the rules are broken in: sound in all else, and no reason for a warning. */
export const base = {
  layers: ['lobes', 'opacity'], K: 0, grid: [2, 1],
  value: {lobes: lobe({rho: 0.1, xy: -0.25, z: 0.5, n: 2})},
};
export const all_layers = {...base, K: 1, layers: ['lobes', 'frame', 'table', 'opacity']};
export const opacity_on_0 = {layers: {lobes: {}, opacity: {levels: [0]}}};

export const broken = (code, what, about, place, changes, from = base) => ({
  ...from,
  name: `${[code].flat()[0]}-${what}`,
  about,
  issues: [{code, place}],
  others: 'none', evaluate: ask(0),
  ...changes,
});
export const others = {others: 'allowed'};
export const MALFORMED_OR_DAMAGED = ['EXR_MALFORMED', 'FILE_DAMAGED'];

/** Sets the member of an object that a JSON pointer names; undefined removes it. */
export const set = (pointer, value) => (object) => {
  const names = pointer.split('/').slice(1);
  const last = names.pop();
  const holder = names.reduce((part, name) => part[name], object);
  if (value === undefined)
    delete holder[last];
  else
    holder[last] = value;
};

/** Several changes one after the other. */
export const all = (...changes) => (object) => changes.forEach((change) => change(object));

/**
 * Fixtures of members of the text, from rows [what, pointer, value, more]: the member is `value`, or missing where that is
 * undefined, or `value` is a function that changes the text. `more`: of the fixture, others 'allowed' by default.
 */
export const members_of = (sound, rows) => rows.map(([what, pointer, value, more = others]) => broken(
  'FABRIC_MEMBER', what, `${pointer}: ${what.replaceAll('-', ' ')}`, pointer,
  {text: typeof value === 'function' ? value : set(pointer, value), ...more}, sound));
/** For rows: no other error follows. */
export const alone = {};

/** Removes a channel of a part. */
export const drop_channel = (name) => (parts) => {
  const part = parts.find((p) => p.name === name.split('.')[0]);
  part.channels = part.channels.filter((channel) => channel.name !== name);
  part.levels.forEach(({values}) => values.delete(name));
};

/** Where the value of an attribute of a part begins, and its size. */
export function find_attribute(bytes, part, name) {
  const {value} = read_headers(bytes).parts[part].attributes.get(name);
  return {at: value.byteOffset - bytes.byteOffset, size: value.length};
}

/** The bytes with the first `from` (of one byte per character) replaced by `to`, which is as long. */
export const renamed = (from, to) => (bytes) =>
  with_bytes(bytes, bytes.indexOf(from, 0, 'latin1'), ...Buffer.from(to, 'latin1'));

/** Adds a channel of zeros, in half precision, to a part. */
export const add_channel = (name) => ({channels, levels}) => {
  channels.push({name, type: 'half'});
  levels.forEach(({width, height, values}) => values.set(name, Buffer.alloc(2 * width * height)));
};

/** Where the first chunk of a level of a part begins. */
export const chunk_at = (bytes, part, level = 0) =>
  read_headers(bytes).parts[part].chunks.find((chunk) => chunk.level === level).offset;

/** The bytes with others from `at` on. */
export function with_bytes(bytes, at, ...values) {
  const copy = Buffer.from(bytes);
  copy.set(values, at);
  return copy;
}

/** The bytes with another 32-bit integer at `at`. */
export function with_i32(bytes, at, value) {
  const copy = Buffer.from(bytes);
  copy.writeInt32LE(value, at);
  return copy;
}

// A chunk of a tiled part: the part's number, four coordinates, the size, the data.
export const TILE_LEVEL = 12, TILE_SIZE = 20, TILE_DATA = 24;

/** The bytes of zeros for all channels of a part. */
export const zeros = (channels, width, height) => ({
  width,
  height,
  values:
    new Map(channels.map(({name, type}) => [name, Buffer.alloc(width * height * (type === 'half' ? 2 : 4))]))
});

/** An unknown part, laid out as the data parts of a fabric of 3 x 2 texels. */
export function unknown_part(name, channel, level_count = 2) {
  const channels = [{name: channel, type: 'half'}];
  const levels = [zeros(channels, 3, 2), zeros(channels, 1, 1)].slice(0, level_count);
  return {name, compression: 'none', tile: {width: 32, height: 32}, attributes: {}, channels, levels};
}

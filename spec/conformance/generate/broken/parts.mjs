// Parts and channels laid out against the rules, values out of range, wrong digests.
import {attribute, pack_values} from '../../reference/exr_write.mjs';
import {framed, part_of} from '../make.mjs';
import {
  add_channel, all, all_layers, ask, base, broken, drop_channel, everywhere, find_attribute, opacity_on_0, others,
  set, unknown_part, with_bytes, zeros
} from './common.mjs';

const part_fault = (what, about, place, change, more) => broken('FABRIC_PART', what, about, place, {before: change, ...more});
/** All parts share their display window; a part of another size has another data window only. */
const DISPLAY = {displayWindow: attribute.box2i(0, 0, 2, 1)};

const layouts = [
  broken('FABRIC_PART', 'missing', 'a layer is listed but its part is missing', 'frame', {
    text: all(set('/layers/frame', {levels: [0]}), set('/digests/frame', ['0'.repeat(32)])),
  }),
  part_fault('preview-missing', 'no preview', 'preview', (parts) => parts.shift()),
  part_fault('preview-not-first', 'the preview is the last part', 'preview', (parts) => parts.push(parts.shift())),
  part_fault('preview-tiled', 'a preview in tiles', 'preview', ([preview]) => {
    preview.tile = {width: 32, height: 32};
    preview.levels.push(zeros(preview.channels, 1, 1));
  }),
  part_fault('preview-of-another-size', 'the preview is larger than the data', 'preview', ([preview]) => {
    Object.assign(preview.attributes, DISPLAY);
    preview.levels = [zeros(preview.channels, 4, 4)];
  }, others),
  part_fault('scan-lines', 'a data part of scan lines', 'opacity', (parts) => {
    const part = part_of(parts, 'opacity');
    part.tile = null;
    part.levels.length = 1;
  }, opacity_on_0),
  part_fault('of-another-size', 'a data part is smaller than the others', 'opacity', (parts) => {
    const part = part_of(parts, 'opacity');
    Object.assign(part.attributes, DISPLAY);
    part.levels = [zeros(part.channels, 2, 2), zeros(part.channels, 1, 1)];
  }, others),
  broken('FABRIC_PART', 'texels-of-the-text', 'the text has more texels than the parts', '', {
    text: all(set('/texels', [4, 2]), set('/levels', 2)),
    ...others,
  }),
];

const channels = [
  ...['lobes.0.n.green', 'lobes.diffuse.red', 'frame.ty', 'table.0001.blue', 'opacity.0001'].map(
    (name) => broken(
      'FABRIC_CHANNEL', `missing-${name.replaceAll('.', '-')}`, `the channel ${name} is missing`, name,
      {before: drop_channel(name)}, all_layers)),
  broken('FABRIC_CHANNEL', 'more-lobes-than-channels', 'K = 1, channels for rho alone', 'lobes.0', {
    text: set('/layers/lobes/lobes', 1),
    ...others,
  }),
  broken('FABRIC_CHANNEL', 'more-views-than-channels', '2 x 2 views, channels for two', 'opacity.0002', {
    text: set('/views/rows', 2),
    ...others,
  }),
];

/** One number of a channel at texel (1, 0) of level 0. */
const not_finite = ([what, channel, number]) => {
  const layer = channel.split('.')[0];
  const value = (k, c, t) => k === 0 && c === channel && t === 1 ? number : base.value[layer]?.(k, c, t);
  return broken('FABRIC_NOT_FINITE', what, `${channel} is ${number} at a texel`, `${layer}/level 0`, {
    value: {...base.value, [layer]: value},
    evaluate: ask(0, [1, 0]),
  }, all_layers);
};
const bad_frame = ([what, about, frame]) => broken('FABRIC_NOT_FINITE', `frame-${what}`, about, 'frame/level 0', {
  value: {...base.value, frame: framed((k, t) => k === 0 && t === 1 ? frame : {n: [0, 0, 1], t: [1, 0, 0]})},
  evaluate: ask(0, [1, 0]),
}, all_layers);

const values = [
  ...[
    ['rho-nan', 'lobes.diffuse.red', NaN],
    ['rho-infinite', 'lobes.diffuse.green', Infinity],
    ['rho-negative', 'lobes.diffuse.blue', -0.125],
    ['exponent-nan', 'lobes.0.n.red', NaN],
    ['exponent-negative', 'lobes.0.n.green', -1],
    ['exponent-infinite', 'lobes.0.n.blue', Infinity],
    ['coefficient-nan', 'lobes.0.cx.red', NaN],
    ['coefficient-infinite', 'lobes.0.cz.green', -Infinity],
    ['table-negative', 'table.0001.red', -0.5],
    ['table-nan', 'table.0000.blue', NaN],
    ['table-infinite', 'table.0001.green', Infinity],
    ['opacity-above-1', 'opacity.0001', 1.5],
    ['opacity-negative', 'opacity.0001', -0.125],
    ['opacity-nan', 'opacity.0000', NaN],
  ].map(not_finite),
  ...[
    ['zero', 'a normal of length 0', {n: [0, 0, 0], t: [1, 0, 0]}],
    ['not-unit', 'a tangent of length 0.5', {n: [0, 0, 1], t: [0.5, 0, 0]}],
    ['not-perpendicular', 'a tangent at 60 degrees to the normal', {n: [0, 0, 1], t: [0.75 ** 0.5, 0, 0.5]}],
    ['nan', 'a normal of NaN', {n: [NaN, 0, 1], t: [1, 0, 0]}],
  ].map(bad_frame),
  broken('FABRIC_NOT_FINITE', 'at-a-coarse-level', 'a negative opacity at level 1', 'opacity/level 1', {
    value: {...base.value, opacity: (k) => k === 1 ? -1 : undefined},
    evaluate: ask(1),
  }),
];

const after = (what, about, change, more) => broken('FABRIC_DIGEST', what, about, 'selvedge.digest', {after: change, ...more});
const channel_of = (parts, level, name) => part_of(parts, 'opacity').levels[level].values.get(name);
const unchanged = () => {};
const digests = [
  ...[0, 1].map((level) => broken(
    'FABRIC_DIGEST', `pixels-of-level-${level}`, `a value of level ${level} was changed after the digest was made`,
    `opacity/level ${level}`, {
      after: (parts) => pack_values([0.625], 'half').copy(channel_of(parts, level, 'opacity.0001')),
      evaluate: ask(level),
    })),
  broken('FABRIC_DIGEST', 'levels-swapped', 'the digests of two levels are swapped', '', {
    text: (text) => text.digests.lobes.reverse(),
    issues: [0, 1].map((level) => ({code: 'FABRIC_DIGEST', place: `lobes/level ${level}`})),
  }),
  broken('FABRIC_DIGEST', 'negative-zero', 'one 0 is stored as -0: other bytes', 'opacity/level 0', {
    value: {...base.value, opacity: everywhere(0)},
    after: (parts) => channel_of(parts, 0, 'opacity.0000').writeUInt16LE(0x8000, 0),
  }),
  after('text-changed', 'one byte of the attribute text was changed', unchanged, {
    bytes: (b) => with_bytes(b, b.indexOf('conformance kit', find_attribute(b, 0, 'selvedge.fabric').at), 0x43),
  }),
  after('header-digest-missing', 'no attribute selvedge.digest', ([first]) => {
    first.attributes['selvedge.digest'] = null;
  }, {issues: [{code: ['FABRIC_DIGEST', 'FABRIC_MALFORMED'], place: ''}]}),
  after('channel-renamed', 'an unknown channel was renamed after the digest was made', unchanged, {
    before: (parts) => add_channel('opacity.mean')(part_of(parts, 'opacity')),
    bytes: (b) => with_bytes(b, b.indexOf('opacity.mean\0') + 11, 0x74),
  }),
  after('part-renamed', 'an unknown part was renamed after the digest was made', (parts) => {
    parts.at(-1).name = 'sewed';
  }, {before: (parts) => parts.push(unknown_part('seams', 'seams.depth'))}),
  after('part-order', 'two parts were swapped after the digest was made', (parts) => parts.push(parts.splice(1, 1)[0])),
];

export const broken_parts = [...layouts, ...channels, ...values, ...digests];

// Parts and channels laid out against the rules, values out of range, digests that do not fit.
import {attribute, pack_values} from '../../reference/exr_write.mjs';
import {framed, part_of} from '../make.mjs';
import {
  add_channel,
  all,
  all_layers,
  ask,
  base,
  broken,
  everywhere,
  find_attribute,
  opacity_on_0,
  others,
  set,
  unknown_part,
  unread,
  with_bytes,
  zeros,
} from './common.mjs';

/** A change of one part, before digests are made. */
const data_part = (name, change, extra) => ({before: (parts) => change(part_of(parts, name)), ...extra});
const on_opacity = (what, about, change, extra) =>
  broken('FABRIC_PART', what, about, 'opacity', data_part('opacity', change, extra));

/** All parts share their display window; a part of another size has another data window only. */
const DISPLAY = {
  displayWindow: attribute.box2i(0, 0, 2, 1)
};
const line_order = (n) => (part) => {
  part.attributes.lineOrder = ['lineOrder', Buffer.from([n])];
};

const layouts = [
  broken('FABRIC_PART', 'missing', 'a layer is listed but its part is not there', 'frame', {
    text:
      all(set('/layers/frame', {levels: [0], precision: 'half'}), set('/digests/frame', ['0'.repeat(32)])),
  }),
  broken(
    'FABRIC_PART', 'preview-missing', 'no preview', 'preview', {before: (parts) => parts.shift(), ...unread}),
  broken(
    'FABRIC_PART', 'plain-without-a-name', 'a file in the plain form whose only part has no name', 'preview',
    {
      layers: [],
      plain: true,
      after: ([first]) => {
        first.attributes.name = null;
      },
      ...others,
      ...unread,
    }),
  on_opacity(
    'scan-lines', 'a data part of scan lines',
    (part) => {
      part.tile = null;
      part.levels.length = 1;
    },
    opacity_on_0),
  on_opacity(
    'one-level', 'a tiled data part without mip levels',
    (part) => {
      part.mipmap = false;
      part.levels.length = 1;
    },
    opacity_on_0),
  on_opacity('lines-decreasing', 'a data part with decreasing lines', line_order(1)),
  on_opacity('lines-random', 'a data part with lines in random order', line_order(2)),
  broken('FABRIC_PART', 'texels-of-the-text', 'the text has more texels than the parts', '', {
    text: all(set('/texels', [4, 2]), set('/levels', 2)),
    ...others,
  }),
  broken(
    'FABRIC_PART', 'preview-of-another-size', 'the preview is larger than the data', 'preview',
    data_part(
      'preview',
      (part) => {
        Object.assign(part.attributes, DISPLAY);
        part.levels = [zeros(part.channels, 4, 4)];
      },
      {...others, ...unread})),
  on_opacity(
    'part-of-another-size', 'a data part is smaller than the others',
    (part) => {
      Object.assign(part.attributes, DISPLAY);
      part.levels = [zeros(part.channels, 2, 2), zeros(part.channels, 1, 1)];
    },
    others),
  broken(
    'FABRIC_PART', 'unknown-part-of-another-size', 'a part that is not known has another data window',
    'seams', {
      before: (parts) => {
        const channels = [{name: 'seams.depth', type: 'half'}];
        parts.push({
          name: 'seams',
          compression: 'none',
          tile: null,
          attributes: DISPLAY,
          channels,
          levels: [zeros(channels, 5, 5)]
        });
      },
      ...others,
      ...unread,
    }),
  broken('FABRIC_PART', 'display-window', 'display windows that are not the data windows', '', {
    before: (parts) => parts.forEach(({attributes}) => {
      attributes.displayWindow = attribute.box2i(0, 0, 7, 7);
    }),
    ...others,
  }),
  broken(['FABRIC_PART', 'EXR_UNSUPPORTED'], 'window-not-at-the-origin', 'windows that begin at (1, 1)', '', {
    before: (parts) => parts.forEach(({attributes}) => {
      attributes.displayWindow = attributes.dataWindow = attribute.box2i(1, 1, 3, 2);
    }),
    ...others,
  }),
];

const drop_channel = (name) => (part) => {
  part.channels = part.channels.filter((channel) => channel.name !== name);
  part.levels.forEach(({values}) => values.delete(name));
};
const NEEDED = ['lobes.0.n.green', 'lobes.diffuse.red', 'frame.ty', 'table.0001.blue', 'opacity.0001'];

const channels = [
  ...NEEDED.map(
    (name) => broken(
      'FABRIC_CHANNEL', `missing-${name.replaceAll('.', '-')}`, `the channel ${name} is missing`, name,
      data_part(name.split('.')[0], drop_channel(name)), all_layers)),
  broken('FABRIC_CHANNEL', 'more-lobes-than-channels', 'K = 1, channels for rho alone', 'lobes.0', {
    text: set('/layers/lobes/lobes', 1),
    ...others,
  }),
  broken('FABRIC_CHANNEL', 'more-views-than-channels', '2 x 2 views, channels for two', 'opacity.0002', {
    text: set('/views/rows', 2),
    ...others,
  }),
  ...['R', 'G', 'B', 'A', 'Y'].map(
    (letter) => broken(
      'FABRIC_CHANNEL', `named-${letter}`, `a data channel whose name ends in ${letter}`, `opacity.${letter}`,
      data_part('opacity', add_channel(`opacity.${letter}`), unread))),
  broken('FABRIC_CHANNEL', 'name-in-two-parts', 'a channel name in two parts', 'opacity.0000', {
    before: (parts) => parts.push(unknown_part('seams', 'opacity.0000')),
    ...unread,
  }),
  // The chunks are too small to shrink, so they are stored as they are: the pixels are right, the codec is
  // not.
  ...['pxr24', 'b44', 'b44a', 'dwaa', 'dwab'].map(
    (compression) => broken(
      'FABRIC_LOSSY', compression, `lobes with compression ${compression.toUpperCase()}`, 'lobes',
      data_part(
        'lobes',
        (part) => {
          part.compression = compression;
        }))),
];

/** One number of a channel at texel (1, 0) of level 0. */
const not_finite = (what, channel, number) => {
  const layer = channel.split('.')[0];
  const value = (k, c, t) => k === 0 && c === channel && t === 1 ? number : base.value[layer]?.(k, c, t);
  return broken(
    'FABRIC_NOT_FINITE', what, `${channel} is ${number} at a texel`, `${layer}/level 0`, {
      value: {...base.value, [layer]: value},
      evaluate: ask(0, [1, 0]),
    },
    all_layers);
};
const bad_frame =
  (what, about, frame) =>
    broken(
      'FABRIC_NOT_FINITE', what, about, 'frame/level 0', {
        value:
          {...base.value, frame: framed((k, t) => k === 0 && t === 1 ? frame : {n: [0, 0, 1], t: [1, 0, 0]})},
        evaluate: ask(0, [1, 0]),
      },
      all_layers);

const values = [
  not_finite('rho-nan', 'lobes.diffuse.red', NaN),
  not_finite('rho-infinite', 'lobes.diffuse.green', Infinity),
  not_finite('rho-negative', 'lobes.diffuse.blue', -0.125),
  not_finite('exponent-nan', 'lobes.0.n.red', NaN),
  not_finite('exponent-negative', 'lobes.0.n.green', -1),
  not_finite('exponent-infinite', 'lobes.0.n.blue', Infinity),
  not_finite('coefficient-nan', 'lobes.0.cx.red', NaN),
  not_finite('coefficient-infinite', 'lobes.0.cz.green', -Infinity),
  not_finite('table-negative', 'table.0001.red', -0.5),
  not_finite('table-nan', 'table.0000.blue', NaN),
  not_finite('table-infinite', 'table.0001.green', Infinity),
  not_finite('opacity-above-1', 'opacity.0001', 1.5),
  not_finite('opacity-negative', 'opacity.0001', -0.125),
  not_finite('opacity-nan', 'opacity.0000', NaN),
  bad_frame('frame-zero', 'a normal of length 0', {n: [0, 0, 0], t: [1, 0, 0]}),
  bad_frame('frame-not-unit', 'a tangent of length 0.5', {n: [0, 0, 1], t: [0.5, 0, 0]}),
  bad_frame(
    'frame-not-perpendicular', 'a tangent at 60 degrees to the normal',
    {n: [0, 0, 1], t: [0.75 ** 0.5, 0, 0.5]}),
  bad_frame('frame-nan', 'a normal of NaN', {n: [NaN, 0, 1], t: [1, 0, 0]}),
  broken('FABRIC_NOT_FINITE', 'at-a-coarse-level', 'a negative opacity at level 1', 'opacity/level 1', {
    value: {...base.value, opacity: (k) => k === 1 ? -1 : undefined},
    evaluate: ask(1),
  }),
];

const after = (what, about, change, more) =>
  broken('FABRIC_DIGEST', what, about, 'selvedge.digest', {after: change, ...more});
const channel_of = (parts, level, name) => part_of(parts, 'opacity').levels[level].values.get(name);

const pixels_of = (level) => broken(
  'FABRIC_DIGEST', `pixels-of-level-${level}`,
  `a value of level ${level} is not the one that the digest was made of`, `opacity/level ${level}`, {
    after: (parts) => pack_values([0.625], 'half').copy(channel_of(parts, level, 'opacity.0001')),
    evaluate: ask(level),
  });

const digests = [
  pixels_of(0),
  pixels_of(1),
  broken('FABRIC_DIGEST', 'levels-swapped', 'the digests of two levels are swapped', '', {
    text: (text) => text.digests.lobes.reverse(),
    issues: [0, 1].map((level) => ({code: 'FABRIC_DIGEST', place: `lobes/level ${level}`})),
  }),
  broken('FABRIC_DIGEST', 'negative-zero', 'one 0 is stored as -0: other bytes', 'opacity/level 0', {
    value: {...base.value, opacity: everywhere(0)},
    after: (parts) => channel_of(parts, 0, 'opacity.0000').writeUInt16LE(0x8000, 0),
  }),
  after('text-changed', 'one byte of the attribute text was changed', () => {}, {
    bytes: (b) => {
      const {at} = find_attribute(b, 0, 'selvedge.fabric');
      return with_bytes(b, b.indexOf('conformance kit', at), 0x43);
    },
  }),
  after('header-digest-missing', 'no attribute selvedge.digest', ([first]) => {
    first.attributes['selvedge.digest'] = null;
  }, {issues: [{code: ['FABRIC_DIGEST', 'FABRIC_MALFORMED'], place: ''}]}),
  after('channel-renamed', 'an unknown channel was renamed after the digest was made', () => {}, {
    before: (parts) => add_channel('opacity.mean')(part_of(parts, 'opacity')),
    bytes: (b) => with_bytes(b, b.indexOf('opacity.mean\0') + 11, 0x74),
  }),
  after('part-renamed', 'an unknown part was renamed after the digest was made', (parts) => {
    parts.at(-1).name = 'sewed';
  }, {before: (parts) => parts.push(unknown_part('seams', 'seams.depth'))}),
  after('part-order', 'two parts changed their places after the digest was made', (parts) => {
    parts.push(parts.splice(1, 1)[0]);
  }),
];

export const broken_parts = [...layouts, ...channels, ...values, ...digests];

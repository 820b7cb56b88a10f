// The valid fabric files: { name, about, ... } as make.mjs takes them, and `queries` beside those that all
// files get.
import {attribute, pack_values} from '../reference/exr_write.mjs';
import {examples} from './examples.mjs';
import {extremes} from './extremes.mjs';
import {unknown_part} from './broken/common.mjs';
import {mix_precisions, part_of} from './make.mjs';
import {maps} from './maps.mjs';
import {lights_and_products} from './products.mjs';
import {sides} from './sides.mjs';
import {yarns} from './yarns.mjs';

const byte_order = (a, b) => Buffer.compare(Buffer.from(a.name), Buffer.from(b.name));

/** Every combination of the paper's layers; products.mjs has those with the others. */
const combinations = Array.from({length: 16}, (_, bits) => {
  const layers = ['lobes', 'frame', 'table', 'opacity'].filter((_, i) => bits >> i & 1);
  return {
    name: `layers-${layers.join('-') || 'none'}`,
    layers,
    about: layers.length ? `has the layers ${layers.join(', ')}` : 'has no layer: f = l_z and alpha = 1',
  };
});

const lobes = [0, 2, 3, 16].map((K) => ({name: `lobes-${K}`, about: `${K} lobes`, K, texels: [2, 2], layers: ['lobes']}));

const precisions = [
  ...[['lobes', 'half'], ['frame', 'float'], ['table', 'float'], ['opacity', 'float']].map(([layer, precision]) => ({
    name: `precision-${precision}-${layer}`,
    about: `${layer} in ${precision} precision`,
    layers: {lobes: {}, [layer]: {precision}},
  })),
  {
    name: 'precision-mixed',
    about: 'every second channel of each part in the other precision: each channel says its own',
    layers: ['lobes', 'frame', 'table', 'opacity'], texels: [2, 2],
    before: mix_precisions,
  },
];

const levels = [
  {
    name: 'levels-lobes-on-0',
    about: 'lobes at level 0 only; g = max(0, l\'_z) elsewhere',
    texels: [4, 4],
    layers: {lobes: {levels: [0]}}
  },
  {
    name: 'levels-lobes-gap',
    about: 'lobes at levels 0 and 2, not at 1',
    texels: [4, 4],
    layers: {lobes: {levels: [0, 2]}}
  },
  {
    name: 'levels-each-its-own',
    about: 'every layer on levels of its own',
    texels: [8, 4],
    layers:
      {lobes: {levels: [0, 2]}, frame: {levels: [1, 2]}, table: {levels: [0, 3]}, opacity: {levels: [0, 1]}},
  },
  {
    name: 'levels-fewer-than-the-chain',
    about: '2 levels of a chain of 4; the stored rest is zeros and no level',
    texels: [8, 8], levels: 2, layers: ['lobes', 'opacity'],
  },
  {
    name: 'levels-unlisted-not-zero',
    about: 'levels that are not listed hold numbers; no reader may use them',
    texels: [8, 4], layers: ['lobes', 'table'],
    text: (text) => {
      text.levels = 3;
      text.layers.lobes.levels = [0, 1];
      text.layers.table.levels = [0, 2];
      text.digests.lobes.splice(2);
      text.digests.table = [0, 2].map((k) => text.digests.table[k]);
    },
  },
  {name: 'levels-one', about: 'level 0 alone, of 8 x 2', texels: [8, 2], levels: 1, layers: ['lobes', 'frame']},
];

const sizes = [[1, 1], [2, 1], [1, 2], [3, 5], [7, 4], [33, 1], [65, 2]].map(
  ([w, h]) => ({
    name: `size-${w}x${h}`,
    about: `${w} x ${h} texels${w > 64 ? ', two tiles side by side at level 0' : ''}`,
    texels: [w, h], layers: ['lobes', 'opacity'], grid: [1, 1],
  }));

const grids = [[1, 1], [1, 7], [2, 2], [3, 2], [8, 8], [8, 16]].map(
  ([columns, rows]) => ({
    name: `grid-${columns}x${rows}`,
    about: `views in a grid of ${columns} x ${rows}`,
    grid: [columns, rows], texels: columns * rows > 64 ? [1, 1] : [2, 1], K: 0, layers: ['lobes', 'table', 'opacity'],
    many_views: true,
    // Few different values, so that the files stay small.
    value: {
      table: (level, channel, t) =>
        (Number(channel.slice(6, 10)) * 7 + t * 3 + channel.length) % 13 / 8 + 0.25,
      opacity: (level, channel, t) => (Number(channel.slice(8, 12)) * 5 + t) % 9 / 8,
    },
  }));

const unknowns = [
  {
    name: 'unknown-members',
    about: 'members of the text that a reader does not know, everywhere',
    layers: ['lobes', 'opacity'],
    text: (text) => {
      text.colour = {primaries: [1, 2, 3]};
      text.views.origin = 'top';
      text.layers.lobes.basis = [0, 1];
      text.digests.seams = ['not a digest'];
      text['\u0000'] = null;
    },
  },
  {
    name: 'unknown-layer-optional',
    about: 'a layer that a reader does not know, marked as optional',
    layers: ['lobes'],
    text: (text) => {
      text.layers['back.lobes'] = {levels: [0], optional: true, precision: 'double'};
    },
  },
  {
    name: 'unknown-attributes',
    about: 'attributes that a reader does not know, in every part',
    layers: ['lobes', 'table'],
    before: (parts) => parts.forEach((part) => Object.assign(part.attributes, {
      'selvedge.seam': attribute.string('x'),
      'maker.blob': ['maker-type', Buffer.from([1, 2, 3])],
      empty: ['string', Buffer.alloc(0)],
      aNameOfAnAttributeThatIsLongerThan31Bytes: attribute.int(-1),
    })),
  },
  {
    name: 'unknown-part',
    about: 'a part that a reader does not know, between those that it does; the header digest has it',
    layers: ['lobes'],
    before: (parts) => parts.splice(1, 0, unknown_part('seams', 'seams.depth')),
  },
  {
    name: 'unknown-channels',
    about: 'channels that a reader does not know in known parts; all digests have them',
    layers: ['lobes', 'opacity'],
    before: (parts) => {
      for (const [part, name] of [['lobes', 'lobes.gloss'], ['opacity', 'opacity.mean']]) {
        const {channels, levels: all} = part_of(parts, part);
        channels.push({name, type: 'half'});
        channels.sort(byte_order);
        all.forEach(
          ({width, height, values}) => values.set(name, pack_values(Array(width * height).fill(-3), 'half')));
      }
    },
  },
  {
    name: 'unknown-minor-version',
    about: 'version 4.9',
    layers: ['lobes'],
    text: (text) => { text.version = [4, 9]; }
  },
  {
    name: 'reserved-names',
    about: 'members and optional layers that version 4.0 reserves',
    layers: ['lobes'],
    text: (text) => {
      Object.assign(text, {
        variation: {seed: 1},
        recipe: {stitch: 'rib.txt', set: {yarn: 'wool'}, text: 'k2 p2'},
        sheet: {composition: 'wool', gramsPerSquareMetre: 180},
        fallback: {metallicFactor: 0},
        colourways: [{name: 'red'}, {}],
      });
      for (const layer of ['squash', 'back.squash']) text.layers[layer] = {levels: [0], optional: true};
    },
  },
];

const layouts = [
  {
    name: 'layout-parts-reversed',
    about: 'data parts in the reverse order',
    layers: ['lobes', 'frame', 'table', 'opacity'],
    before: (parts) => parts.push(...parts.splice(1).reverse()),
  },
  {
    name: 'layout-chunks-reversed',
    about: 'chunks in the reverse order; the chunk tables find them',
    texels: [5, 6], layers: ['lobes', 'opacity'],
    order: (chunks) => chunks.toReversed()
  },
  ...[[1, 1], [5, 3], [16, 2], [4096, 4096]].map(([width, height]) => ({
    name: `layout-tiles-${width}x${height}`,
    about: `tiles of ${width} x ${height}`,
    texels: [7, 4], layers: ['lobes', 'opacity'],
    before: (parts) => parts.slice(1).forEach((part) => {
      part.tile = {width, height};
    }),
  })),
  ...['none', 'zip'].map((compression) => ({
    name: `layout-compression-${compression}`,
    about: `compression ${compression} in all parts, chunks of several lines`,
    texels: [3, 20], layers: ['lobes', 'opacity'], grid: [1, 1],
    value: {lobes: (level, channel) => channel.includes('.n.') ? 2 : undefined},
    before: (parts) => parts.forEach((part) => { part.compression = compression; }),
  })),
  {
    name: 'layout-gaps',
    about: 'bytes that belong to no chunk, before, between and behind the chunks; a reader ignores them',
    layers: ['lobes', 'opacity'],
    gap: 7,
  },
  {
    name: 'layout-64-parts',
    about: 'as many parts as there may be',
    layers: ['lobes'],
    before: (parts) => {
      while (parts.length < 64) parts.push(unknown_part(`part${parts.length}`, `part${parts.length}.depth`));
    },
  },
  {
    name: 'layout-long-names',
    about: 'an attribute, a channel and a part with names of 255 bytes',
    layers: ['lobes'],
    before: (parts) => {
      parts.push(unknown_part('seams.'.padEnd(255, 'm'), 'seams.'.padEnd(255, 'z')));
      parts[0].attributes['maker'.padEnd(255, '.')] = attribute.int(1);
    },
  },
  {
    name: 'layout-4096x1',
    about: 'as many texels along a side as there may be',
    texels: [4096, 1], levels: 1, layers: ['opacity'], grid: [1, 1],
    value: {opacity: (level, channel, t) => t % 2},
  },
];

const texts = [
  {
    name: 'text-unicode',
    about: 'a long provenance with characters of one to four bytes',
    layers: ['lobes'],
    provenance: {
      maker: 'Gewebe & Söhne, Łódź',
      cloth: '平織り',
      yarn: '🧶'.repeat(200),
      quotes: '"\\/\b\f\n\r\t',
      steps:
        Array.from({length: 100}, (_, i) => ({step: i, temperature: i / 7, note: null, done: i % 2 === 0})),
    },
  },
  {
    name: 'text-nested-64-deep',
    about: 'brackets of the text that nest 64 deep',
    layers: ['lobes'],
    provenance: {deep: Array.from({length: 61}).reduce((list) => [list], [])},
  },
  {
    name: 'text-layers-marked',
    about: 'optional is true or false on layers that a reader knows: it says nothing to it',
    layers: ['lobes', 'opacity'],
    text: (text) => {
      text.layers.lobes.optional = true;
      text.layers.opacity.optional = false;
    },
  },
  {
    name: 'text-escapes',
    about: 'indented text, escaped characters, numbers with exponents',
    layers: ['lobes'],
    text: (text) => {
      text.provenance = {yarn: 'wool 🧶'};
    },
    string: (text) => JSON.stringify(text, null, '\t')
                        .replace(/[^\0-~]/g, (c) => `\\u${c.charCodeAt(0).toString(16)}`)
                        .replace('"thickness": 0.75', '"thickness" :\r\n 7.5E-1')
                        .replace('"texels"', '"t\\u0065xels"'),
  },
];

/** A program only has to show that it reads these. */
const brief = [...unknowns, ...layouts, ...texts].map((fixture) => ({...fixture, brief: true}));

export const valid = [
  ...examples, ...combinations, ...lobes, ...precisions, ...levels, ...sizes, ...grids, ...extremes, ...lights_and_products,
  ...yarns, ...maps, ...sides, ...brief
];

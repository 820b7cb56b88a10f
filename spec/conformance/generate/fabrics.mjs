// The valid fabric files: { name, about, ... } as make.mjs takes them, and `queries` beside those that all files get.
import { attribute, pack_values } from '../reference/exr_write.mjs';
import { LAYERS } from '../reference/fabric.mjs';
import { frame_of, framed, part_of } from './make.mjs';
import { unit } from './random.mjs';

const UP = [0, 0, 1];
const OBLIQUE = unit([0.3, 0.4, 0.8]);
const byte_order = (a, b) => Buffer.compare(Buffer.from(a.name), Buffer.from(b.name));

/** Every combination of the four layers. */
const combinations = Array.from({ length: 16 }, (_, bits) => {
  const layers = LAYERS.filter((_, i) => bits >> i & 1);
  return {
    name: layers.length ? `layers-${layers.join('-')}` : 'layers-none', layers, plain: layers.length === 0,
    about: layers.length ? `has the layers ${layers.join(', ')}` :
      'has no layer: f = 1 and alpha = 1; the only part is stored in the plain form of OpenEXR',
  };
});

const lobes = [0, 2, 3, 16].map((K) => ({
  name: `lobes-${K}`, about: `${K} lobes`, K, texels: [2, 2], layers: ['lobes'],
}));

const precisions = [
  { name: 'precision-half-lobes', about: 'lobes in half precision', layers: { lobes: { precision: 'half' } } },
  { name: 'precision-float-frame', about: 'frame in single precision', layers: { lobes: {}, frame: { precision: 'float' } } },
  { name: 'precision-float-table', about: 'view table in single precision', layers: { lobes: {}, table: { precision: 'float' } } },
  { name: 'precision-float-opacity', about: 'opacity in single precision', layers: { lobes: {}, opacity: { precision: 'float' } } },
  {
    name: 'precision-mixed', about: 'every second channel of each part in the other precision: each channel says its own',
    layers: ['lobes', 'frame', 'table', 'opacity'], texels: [2, 2],
    before: (parts, fabric) => {
      for (const part of parts.slice(1)) {
        part.channels.forEach((channel, i) => {
          if (i % 2 === 0) return;
          channel.type = channel.type === 'half' ? 'float' : 'half';
          part.levels.forEach(({ width, height, values }, k) => values.set(channel.name,
            pack_values(fabric.layers[part.name].values(k, channel.name, { width, height }), channel.type)));
        });
      }
    },
  },
];

const levels = [
  { name: 'levels-lobes-on-0', about: 'lobes at level 0 only; g = 1 elsewhere', texels: [4, 4], layers: { lobes: { levels: [0] } } },
  { name: 'levels-lobes-gap', about: 'lobes at levels 0 and 2, not at 1', texels: [4, 4], layers: { lobes: { levels: [0, 2] } } },
  {
    name: 'levels-each-its-own', about: 'every layer on levels of its own', texels: [8, 4],
    layers: { lobes: { levels: [0, 2] }, frame: { levels: [1, 2] }, table: { levels: [0, 3] }, opacity: { levels: [0, 1] } },
  },
  {
    name: 'levels-fewer-than-the-chain', about: '2 levels of a chain of 4; the stored rest is zeros and no level',
    texels: [8, 8], levels: 2, layers: ['lobes', 'opacity'],
  },
  {
    name: 'levels-unlisted-not-zero', about: 'levels that are not listed hold numbers; no reader may use them', texels: [8, 4],
    layers: ['lobes', 'table'],
    text: (text) => {
      text.levels = 3;
      text.layers.lobes.levels = [0, 1];
      text.layers.table.levels = [0, 2];
      text.digests.lobes.splice(2);
      text.digests.table = [0, 2].map((k) => text.digests.table[k]);
    },
  },
  { name: 'levels-one', about: 'level 0 alone, of 8 x 2', texels: [8, 2], levels: 1, layers: ['lobes', 'frame'] },
];

const sizes = [[1, 1], [2, 1], [1, 2], [3, 5], [7, 4], [33, 1], [65, 2]].map(([w, h]) => ({
  name: `size-${w}x${h}`, about: `${w} x ${h} texels${w > 64 ? ', two tiles side by side at level 0' : ''}`,
  texels: [w, h], layers: ['lobes', 'opacity'], grid: [1, 1],
}));

const grids = [[1, 1], [1, 7], [2, 2], [3, 2], [8, 8], [8, 16], [16, 16]].map(([columns, rows]) => ({
  name: `grid-${columns}x${rows}`, about: `views in a grid of ${columns} x ${rows}`, grid: [columns, rows],
  texels: columns * rows > 64 ? [1, 1] : [2, 1], K: 0, layers: ['lobes', 'table', 'opacity'], many_views: true,
  // Few different values, so that the files stay small.
  value: {
    table: (level, channel, t) => (Number(channel.slice(6, 10)) * 7 + t * 3 + channel.length) % 13 / 8 + 0.25,
    opacity: (level, channel, t) => (Number(channel.slice(8, 12)) * 5 + t) % 9 / 8,
  },
}));

/** Values of lobe channels by texel: lobe(t) gives { rho, cx, cy, cz, n }, the same for all colours and lobes. */
const by_texel = (lobe) => (level, channel, t) => {
  const values = lobe(t, Number(channel.split('.')[1]));
  return channel.startsWith('lobes.diffuse') ? values.rho : values[channel.split('.')[2]];
};

const BACK = unit([-0.3, -0.4, 0.8]);
const ask = (texel, light, view, why) => ({ level: 0, texel, light, view, why });
const LARGEST = 3.4028234663852886e38;

const extremes = [
  {
    name: 'extreme-rho', about: 'rho of 0, subnormal, huge and the largest number', texels: [5, 1], levels: 1, K: 0,
    layers: ['lobes', 'table'],
    value: {
      lobes: by_texel((t) => ({ rho: [0, 1e-40, 1e30, LARGEST, 3e38][t] })),
      table: (level, channel) => channel.endsWith('red') ? 4 : channel.endsWith('green') ? 0.25 : 0,
    },
    queries: [
      ask([0, 0], OBLIQUE, UP, 'rho = 0 without lobes: f = 0'),
      ask([1, 0], OBLIQUE, UP, 'a subnormal rho: may count as 0'),
      ask([2, 0], OBLIQUE, UP, 'a huge rho that fits'),
      ask([3, 0], UP, UP, 'rho is the largest number: T = 4 overflows and is held; T = 0.25 is a quarter of it; T = 0 gives 0'),
      ask([4, 0], UP, UP, 'f overflows after the multiplication by T and is held'),
    ],
  },
  {
    name: 'extreme-exponents', about: 'exponents 0, 0.001, 1, 200 and 5,000 with bases below, at and above 1', texels: [5, 3], levels: 1,
    layers: ['lobes'],
    value: {
      lobes: by_texel((t) => ({
        rho: 0.125, cx: 0, cy: 0, cz: [0.75, 1, 1.015625][Math.floor(t / 5)], n: [0, 0.0010000000474974513, 1, 200, 5000][t % 5],
      })),
    },
    queries: [0, 1, 2].flatMap((j) => [0, 1, 2, 3, 4].flatMap((i) => {
      const what = `n = ${[0, 0.001, 1, 200, 5000][i]}, cz = ${[0.75, 1, 1.015625][j]}`;
      return [ask([i, j], UP, UP, `${what}: the base is exact`), ask([i, j], unit([0.0625, 0, 1]), UP, `${what}: a base beside it`)];
    })),
  },
  {
    name: 'extreme-coefficients', about: 'coefficients 0, negative and huge', texels: [6, 1], levels: 1, K: 2, layers: ['lobes'],
    value: {
      lobes: by_texel((t, j) => ({
        rho: 0.25,
        cx: [0, -1, 1, 0, -1000, 1e-20][t], cy: [0, -1, 1, 0, -1000, 1e-20][t],
        cz: [0, -1, 0.5, -0.5, j ? 1000 : -1000, 1e-20][t], n: [0, 3, 2, 0, 2, 0.5][t],
      })),
    },
    queries: [
      ask([0, 0], OBLIQUE, BACK, 'C = 0: the base is 0 and the lobe adds 0, although n = 0'),
      ask([0, 0], UP, UP, 'C = 0 along the normal: the lobe adds 0'),
      ask([1, 0], OBLIQUE, OBLIQUE, 'all coefficients negative: the base is negative'),
      ask([1, 0], OBLIQUE, BACK, 'all coefficients negative, mirrored directions'),
      ask([2, 0], OBLIQUE, BACK, 'the base is positive although cx and cy pull it down'),
      ask([2, 0], unit([0.7, 0.1, 0.2]), unit([-0.7, 0.1, 0.2]), 'the base is negative although cz is positive'),
      ask([3, 0], UP, UP, 'a negative base with n = 0: the lobe adds 0'),
      ask([4, 0], OBLIQUE, BACK, 'huge coefficients of both signs'),
      ask([5, 0], OBLIQUE, OBLIQUE, 'tiny coefficients under a square root'),
    ],
  },
  {
    name: 'extreme-overflow', about: 'powers beyond the largest number are held there, before T and after it', texels: [3, 1],
    levels: 1, layers: ['lobes', 'table', 'opacity'], grid: [2, 1],
    value: {
      lobes: by_texel((t) => ({ rho: 1, cx: 0, cy: 0, cz: [100, 100, 10][t], n: [200, 5000, 30][t] })),
      table: (level, channel) => channel.endsWith('red') ? 0.5 : channel.endsWith('green') ? 2 : 0,
      opacity: () => 1,
    },
    queries: [
      ask([0, 0], UP, UP, 'g is held before T: half of the largest number, the largest number, and 0'),
      ask([1, 0], OBLIQUE, UP, 'the same, still farther beyond'),
      ask([2, 0], UP, UP, 'large, but nothing overflows'),
      ask([0, 0], unit([0, 0, -1]), UP, 'light from below: 0, not NaN'),
      { level: 0.5, uv: [0.1, 0.5], light: UP, view: UP, why: 'a level beyond the last: held values stay' },
    ],
  },
  {
    name: 'extreme-overflow-levels', about: 'held values in both blended levels', texels: [2, 1], layers: ['lobes'],
    value: { lobes: by_texel(() => ({ rho: 1, cx: 0, cy: 0, cz: 100, n: 200 })) },
    queries: [{ level: 0.5, uv: [0.25, 0.5], light: UP, view: UP, why: 'half of the largest number twice, alpha = 1: the largest number' }],
  },
  {
    name: 'extreme-alpha-0', about: 'alpha 0 at all views, at some, and nearly', texels: [4, 1], layers: ['lobes', 'table', 'opacity'],
    value: {
      opacity: (level, channel, t) => {
        const k = Number(channel.slice(8));
        if (level === 1) return t === 0 ? 0 : [1, 0, 0.5, 0][k];
        if (level === 2) return 0.5;
        return [0, [1, 0, 0, 0][k], [0, 0.5, 0.5, 0][k], 2 ** -24][t];
      },
    },
    queries: [
      ask([0, 0], OBLIQUE, UP, 'alpha = 0 at all views: with a table f = 0'),
      ask([1, 0], OBLIQUE, UP, 'the three views with alpha = 0 count for nothing: T is that of view 0'),
      ask([1, 0], OBLIQUE, unit([0.5, 0.5, 0.2]), 'only views with alpha = 0: f = 0'),
      ask([2, 0], OBLIQUE, UP, 'T is the mean of views 1 and 2'),
      ask([3, 0], OBLIQUE, UP, 'alpha of the smallest half: T is not disturbed'),
      { level: 0.5, uv: [0.1, 0.5], light: OBLIQUE, view: UP, why: 'alpha = 0 in both levels: f = 0' },
      { level: 1.5, uv: [0.1, 0.5], light: OBLIQUE, view: UP, why: 'alpha = 0 at the finer level: f is that of the coarser' },
      { level: 1, uv: [0.1, 0.5], light: OBLIQUE, view: UP, why: 'a whole level counts alone' },
    ],
  },
  {
    name: 'extreme-alpha-0-no-table', about: 'alpha 0 without a table: f is that of the lobes', texels: [2, 1],
    layers: ['lobes', 'opacity'], value: { opacity: (level) => level === 0 ? 0 : 1 },
    queries: [
      ask([0, 0], OBLIQUE, UP, 'alpha = 0 without a table: f is not 0'),
      { level: 0, uv: [0.1, 0.5], light: OBLIQUE, view: UP, why: 'a whole level by uv: f is not 0 although alpha is' },
      { level: 0.5, uv: [0.1, 0.5], light: OBLIQUE, view: UP, why: 'f is that of level 1, which alone can be seen' },
    ],
  },
  {
    name: 'extreme-frames', about: 'normals tilted to the horizon and below it, tangents that are not the usual ones', texels: [4, 1],
    levels: 1, layers: { lobes: {}, frame: { precision: 'float' } },
    value: {
      frame: framed((level, t) => [
        frame_of([0.96, 0, 0.28]), frame_of([0.6, 0.6, -0.3]), { n: [0, 0, 1], t: [0, -1, 0] }, { n: [0, 0, -1], t: [1, 0, 0] },
      ][t]),
    },
    queries: [
      ask([0, 0], unit([-0.6, 0, 0.5]), UP, 'light above the cloth, below the texel\'s horizon'),
      ask([0, 0], unit([0.6, 0.1, 0.5]), unit([-0.6, 0.1, 0.5]), 'view below the texel\'s horizon: the formula as it stands'),
      ask([1, 0], unit([0.6, 0.6, 0.2]), unit([0.6, 0.5, 0.2]), 'a normal that points into the cloth'),
      ask([1, 0], UP, UP, 'a normal that points into the cloth, light from above: 0'),
      ask([2, 0], OBLIQUE, BACK, 'the tangent is -y, the binormal x'),
      ask([3, 0], OBLIQUE, BACK, 'the normal is straight down: 0'),
    ],
  },
  {
    name: 'frame-not-quite-unit', about: 'frames 0.4 % from unit and perpendicular count as stored', texels: [2, 1], levels: 1,
    layers: { lobes: {}, frame: { precision: 'float' } },
    value: { frame: framed((level, t) => t ? { n: [0, 0, 1.00390625], t: [0.99609375, 0, 0] } : { n: [0.00390625, 0, 1], t: [1, 0, 0] }) },
  },
  {
    name: 'extreme-halves', about: 'the smallest, the largest and subnormal halves', texels: [3, 1], levels: 1,
    layers: { lobes: { precision: 'half' }, table: {}, opacity: {} },
    value: {
      lobes: by_texel((t) => ({ rho: [2 ** -24, 65504, 2 ** -15][t], cx: 0, cy: 0, cz: [1, 2 ** -14, 0.5][t], n: [65504, 1, 2 ** -20][t] })),
      table: (level, channel, t) => [2 ** -24, 65504, 2 ** -16][t],
      opacity: (level, channel, t) => [2 ** -24, 1, 1 - 2 ** -11][t],
    },
    queries: [
      ask([0, 0], UP, UP, 'n = 65,504 with a base of exactly 1'), ask([1, 0], UP, UP, 'the largest half twice'),
      ask([2, 0], OBLIQUE, UP, 'subnormal halves'),
    ],
  },
];

/** Another part that a reader does not know. */
const unknown_part = ([w, h]) => ({
  name: 'seams', compression: 'zip', tile: null, attributes: {}, channels: [{ name: 'seams.depth', type: 'float' }],
  levels: [{ width: w, height: h, values: new Map([['seams.depth', pack_values(Array(w * h).fill(NaN), 'float')]]) }],
});

const unknowns = [
  {
    name: 'unknown-members', about: 'members of the text that a reader does not know, everywhere', layers: ['lobes', 'opacity'],
    text: (text) => {
      text.colour = { primaries: [1, 2, 3] };
      text.views.origin = 'top';
      text.layers.lobes.basis = [0, 1];
      text.digests.seams = ['not a digest'];
      text['\u0000'] = null;
    },
  },
  {
    name: 'unknown-layer-optional', about: 'a layer that a reader does not know, marked as optional', layers: ['lobes'],
    text: (text) => { text.layers.heights = { levels: [0], optional: true, precision: 'double' }; },
  },
  {
    name: 'unknown-attributes', about: 'attributes that a reader does not know, in every part', layers: ['lobes', 'table'],
    before: (parts) => parts.forEach((part) => Object.assign(part.attributes, {
      'selvedge.seam': attribute.string('x'), 'maker.blob': ['maker-type', Buffer.from([1, 2, 3])], empty: ['string', Buffer.alloc(0)],
      aNameOfAnAttributeThatIsLongerThan31Bytes: attribute.int(-1),
    })),
  },
  {
    name: 'unknown-part', about: 'a part that a reader does not know, its pixels NaN; the header digest has it', layers: ['lobes'],
    before: (parts, { texels }) => parts.splice(1, 0, unknown_part(texels)),
  },
  {
    name: 'unknown-channels', about: 'channels that a reader does not know in known parts; all digests have them',
    layers: ['lobes', 'opacity'],
    before: (parts) => {
      for (const [part, name] of [['lobes', 'lobes.gloss'], ['opacity', 'opacity.mean']]) {
        const { channels, levels: all } = part_of(parts, part);
        channels.push({ name, type: 'half' });
        channels.sort(byte_order);
        all.forEach(({ width, height, values }) => values.set(name, pack_values(Array(width * height).fill(-3), 'half')));
      }
    },
  },
  { name: 'unknown-minor-version', about: 'version 1.9', layers: ['lobes'], text: (text) => { text.version = [1, 9]; } },
];

const layouts = [
  {
    name: 'layout-parts-reversed', about: 'parts in the reverse order, the attributes in part 0 all the same',
    layers: ['lobes', 'frame', 'table', 'opacity'], before: (parts) => parts.reverse(),
  },
  { name: 'layout-chunks-reversed', about: 'chunks in the reverse order; the chunk tables find them', texels: [5, 6], layers: ['lobes', 'opacity'], order: (chunks) => chunks.toReversed() },
  ...[[1, 1], [5, 3], [16, 2], [4096, 4096]].map(([width, height]) => ({
    name: `layout-tiles-${width}x${height}`, about: `tiles of ${width} x ${height}`, texels: [7, 4], layers: ['lobes', 'opacity'],
    before: (parts) => parts.slice(1).forEach((part) => { part.tile = { width, height }; }),
  })),
  ...['none', 'rle', 'zips'].map((compression) => ({
    name: `layout-compression-${compression}`, about: `compression ${compression.toUpperCase()} in all parts`, texels: [3, 20],
    layers: ['lobes', 'opacity'], grid: [1, 1],
    value: { lobes: (level, channel) => channel.includes('.n.') ? 2 : undefined },
    before: (parts) => parts.forEach((part) => { part.compression = compression; }),
  })),
  {
    name: 'layout-multi-part-of-one', about: 'no layer, the only part in the multi-part form', layers: [],
  },
];

const texts = [
  {
    name: 'text-unicode', about: 'a long provenance with characters of one to four bytes', layers: ['lobes'],
    provenance: {
      maker: 'Gewebe & Söhne, Łódź', cloth: '平織り', yarn: '🧶'.repeat(200), quotes: '"\\/\b\f\n\r\t',
      steps: Array.from({ length: 100 }, (_, i) => ({ step: i, temperature: i / 7, note: null, done: i % 2 === 0 })),
    },
  },
  {
    name: 'text-escapes', about: 'indented text, escaped characters, numbers with exponents', layers: ['lobes'],
    text: (text) => { text.provenance = { yarn: 'wool 🧶' }; },
    string: (text) => JSON.stringify(text, null, '\t').replace(/[^\0-~]/g, (c) => `\\u${c.charCodeAt(0).toString(16)}`)
      .replace('"thickness": 0.75', '"thickness" :\r\n 7.5E-1').replace('"texels"', '"t\\u0065xels"'),
  },
];

/** JSON as the example of fabric.md has it: names sorted, no spaces, numbers that need not be whole with a point. */
const as_on_the_page = (text) => JSON.stringify(text, (name, x) => typeof x === 'object' && x !== null && !Array.isArray(x) ?
  Object.fromEntries(Object.keys(x).sort().map((key) => [key, x[key]])) : x).replace('"mmPerRepeat":[2,1]', '"mmPerRepeat":[2.0,1.0]');

const examples = [
  {
    name: 'example-fabric', about: 'the example of fabric.md; its digests are those of the page', texels: [2, 1], grid: [1, 2],
    layers: { lobes: {}, opacity: { levels: [0] } }, mmPerRepeat: [2, 1], provenance: { software: 'example' },
    value: {
      lobes: by_texel(() => ({ rho: 0.25, cx: -0.5, cy: -0.5, cz: 0.5, n: 4 })),
      opacity: (level, channel, t) => channel.endsWith('0') ? [1, 0.25][t] : [0.5, 0][t],
    },
    string: as_on_the_page,
    digests: ['d4440200340cdb644791e7382d3c1984', '997649a0a42a3c632677d4728a15dcce', 'fec8acf204b4fab47a5f85b8bd066c58', 'eb42b3d18423dad1e0ef8970900ced8a'],
  },
  {
    name: 'example-brdf', about: 'the example of brdf.md; the first answer is that of the page', texels: [1, 1],
    layers: { lobes: {}, frame: { precision: 'float' }, table: {}, opacity: {} },
    value: {
      lobes: (level, channel) => channel.startsWith('lobes.diffuse') ? { red: 0.1, green: 0.2, blue: 0.3 }[channel.slice(14)] :
        { cx: -0.9, cy: 0.8, cz: 0.9, n: 2 }[channel.split('.')[2]],
      frame: framed(() => ({ n: [0, 0.6, 0.8], t: [1, 0, 0] })),
      table: (level, channel) => [[1, 1, 1], [1.5, 1.25, 1], [0.5, 0.75, 1], [2, 2, 2]][Number(channel.slice(6, 10))][['red', 'green', 'blue'].indexOf(channel.slice(11))],
      opacity: (level, channel) => [1, 1, 0.5, 0][Number(channel.slice(8))],
    },
    queries: [{ ...ask([0, 0], [-0.6, 0, 0.8], [0.36, -0.48, 0.8], 'the example of the page'), page: { rgb: [0.577697, 0.568628, 0.532055], alpha: 0.950739 } }],
  },
];

/** Of these a program only has to show that it reads them. */
const brief = [...unknowns, ...layouts, ...texts].map((fixture) => ({ ...fixture, brief: true }));

export const valid = [...examples, ...combinations, ...lobes, ...precisions, ...levels, ...sizes, ...grids, ...extremes, ...brief];

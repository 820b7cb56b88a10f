// The examples of the pages, with the digests and answers on the pages.
import {ask, by_texel} from './extremes.mjs';
import {framed} from './make.mjs';

/**
 * JSON as the example of fabric.md has it: names sorted, no spaces, numbers that need not be whole with a
 * point.
 */
const as_on_the_page = (text) => JSON
                                   .stringify(
                                     text,
                                     (name, x) => typeof x === 'object' && x !== null && !Array.isArray(x) ?
                                       Object.fromEntries(Object.keys(x).sort().map((key) => [key, x[key]])) :
                                       x)
                                   .replace('"mmPerRepeat":[2,1]', '"mmPerRepeat":[2.0,1.0]');

export const examples = [
  {
    name: 'example-fabric',
    about: 'the example of fabric.md with the digests of the page',
    texels: [2, 1], grid: [1, 2], layers: {lobes: {}, opacity: {levels: [0]}},
    mmPerRepeat: [2, 1],
    provenance: {software: 'example'},
    value: {
      lobes: by_texel(() => ({rho: 0.25, cx: -0.5, cy: -0.5, cz: 0.5, n: 4})),
      opacity: (level, channel, t) => channel.endsWith('0') ? [1, 0.25][t] : [0.5, 0][t],
    },
    string: as_on_the_page,
    digests: [
      '44eb11e9c4ef48672cff13faf364d0eb', '997649a0a42a3c632677d4728a15dcce',
      'fec8acf204b4fab47a5f85b8bd066c58', 'eb42b3d18423dad1e0ef8970900ced8a'
    ],
  },
  {
    name: 'example-brdf',
    about: 'the example of brdf.md; the page has the first answer',
    texels: [1, 1], layers: {lobes: {}, frame: {precision: 'float'}, table: {}, opacity: {}},
    value: {
      lobes: (level, channel) => channel.startsWith('lobes.diffuse') ?
        {red: 0.1, green: 0.2, blue: 0.3}[channel.slice(14)] :
        {cx: -0.9, cy: 0.8, cz: 0.9, n: 2}[channel.split('.')[2]],
      frame: framed(() => ({n: [0, 0.6, 0.8], t: [1, 0, 0]})),
      table: (level, channel) => [[1, 1, 1], [1.5, 1.25, 1], [0.5, 0.75, 1], [2, 2, 2]][Number(
        channel.slice(6, 10))][['red', 'green', 'blue'].indexOf(channel.slice(11))],
      opacity: (level, channel) => [1, 1, 0.5, 0][Number(channel.slice(8))],
    },
    queries: [{
      ...ask([0, 0], [-0.6, 0, 0.8], [0.36, -0.48, 0.8], 'the example of the page'),
      page: {rgb: [0.577697, 0.568628, 0.532055], alpha: 0.950739}
    }],
  },
];

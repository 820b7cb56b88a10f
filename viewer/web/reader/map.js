// Repeats that arrange the stitches of a smaller one (spec/fabric.md, Map).
import {chain_length, level_size} from './exr.js';
import {read_layer} from './fabric.js';
import {throw_issue} from './issue.js';

/** { texels, levels } of the cloth's repeat: of a map, or as stored. */
export function repeat_size({texels, levels, layers: {map}}) {
  return map ? {texels: map.size, levels: chain_length(...map.size)} : {texels, levels};
}

/** { kinds, size, lines, shown } of a fabric with a map, checked; null without. */
export function read_map(fabric, report = throw_issue) {
  const {texels: kinds, layers: {map, yarns}} = fabric;
  if (!map) return null;
  const [numbers, of_yarns] = ['map', 'yarns'].map((layer) => {
    const values = [...read_layer(fabric, layer, 0, report).values()];
    return (i) => values[Math.floor(i / values[0].length)][i % values[0].length];
  });
  const stitches = kinds[0] * kinds[1], is_below = (end) => (x) => Number.isInteger(x) && x >= 0 && x < end;
  const lines = Array.from({length: yarns.curves}, (_, c) => numbers(c));
  const shown = Array.from({length: map.size[0] * map.size[1]}, (_, i) => numbers(yarns.curves + i));
  // Field 2 of a curve: its turns along x.
  if (!shown.every(is_below(stitches)) || !lines.every((line, c) => is_below(kinds[of_yarns(2 * yarns.curves + c) === 0 ? 0 : 1])(line)))
    report('FABRIC_MALFORMED', 'yarns/map', 'names a stitch or a line that is not there');
  return {kinds, size: map.size, lines, shown};
}

/** Means of the texels of the next coarser level than one of w x h, with their weights. */
function coarser(values, [w, h], weights) {
  const [W, H] = [w, h].map((n) => level_size(n, 1)), ends = (i, size, finer) => [i, i + 1].map((k) => Math.floor(k * finer / size));
  return new Map([...values].map(([name, list]) => [name, Float32Array.from({length: W * H}, (_, texel) => {
    const [left, right] = ends(texel % W, W, w), [top, bottom] = ends(Math.floor(texel / W), H, h);
    let sum = 0, all = 0;
    for (let y = top; y < bottom; ++y)
      for (let t = y * w + left; t < y * w + right; ++t) {
        sum += weights[t] * list[t];
        all += weights[t];
      }
    return sum / all;
  })]));
}

/** { opacity, products } of a level of repeat_size() of a fabric, or side, with a map, as read_layer() gives them. */
export function read_repeat(fabric, level, report = throw_issue) {
  const names = ['opacity', 'products'], {front = fabric, visible} = fabric;
  if (level === 0) {
    const {shown} = read_map(front, report), picked = (list) => Float32Array.from(shown, (at) => list[at]);
    return Object.fromEntries(names.map((layer) => {
      const values = read_layer(fabric, layer, 0, report);
      return [layer, values && new Map([...values].map(([name, list]) => [name, picked(list)]))];
    }));
  }
  const {opacity, products} = read_repeat(fabric, level - 1, report);
  // Light that comes through has the opacity of the side that is seen.
  const views = [...(visible ? read_repeat(visible, level - 1, report).opacity : opacity)?.values() ?? []];
  const size = front.layers.map.size.map((n) => level_size(n, level - 1)), even = new Float32Array(size[0] * size[1]).fill(1);
  const mean = (t) => views.reduce((sum, list) => sum + list[t], 0) / views.length;
  const weights = views.length > 0 ? even.map((_, t) => Math.max(mean(t), 1e-6)) : even;
  return {opacity: opacity && coarser(opacity, size, even), products: products && coarser(products, size, weights)};
}

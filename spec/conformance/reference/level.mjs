// The levels of a fabric as brdf.mjs wants them.
import {yarns_of} from './curves.mjs';
import {unpacked} from './packed.mjs';
import {
  COLOURS, LAYERS, PARAMETERS, SPREAD, base_count, direction_name, grid_size, level_size, pairs_at, read_layer, read_map,
  read_repeat
} from './reader.mjs';

const each = (n, make) => Array.from({length: n}, (_, i) => make(i));

/**
 * A level as brdf.mjs wants it, from the numbers of its layers, Maps from channels to arrays, null where
 * absent; `bases` of level 0. `text` has the members of the attribute text. `map`: of read_map(), whose repeat is shown.
 */
export function make_level(text, level, numbers, map = null) {
  const {views, lights, layers, radianceScale = 1} = text, texels = map?.size ?? text.texels;
  const {lobes, frame, table, opacity, light, products, bases, yarns, indirect} = numbers;
  const of = (values, ...names) => names.map((name) => values.get(name));
  const rgb = (values, name) => of(values, ...COLOURS.map((c) => `${name}.${c}`));
  const colours = (values, layer, grid) => {
    const lists = each(grid_size(grid), (k) => rgb(values, direction_name(layer, k)));
    return (t, k) => lists[k].map((x) => x[t]);
  };
  const result = {
    width: level_size(texels[0], level),
    height: level_size(texels[1], level),
    scale: Math.fround(radianceScale),
    views,
    lights,
    lobes: null,
    frame: null,
    table: table ? colours(table, 'table', views) : null,
    opacity: null,
    light: light ? colours(light, 'light', lights) : null,
    products: null,
    /** How many means of means texels are. */
    means: map ? level : 0,
    yarns: level === 0 && yarns && indirect ? yarns_of(...unpacked(text, {yarns, indirect}), map) : null,
  };
  if (lobes) {
    const rho = rgb(lobes, 'lobes.diffuse');
    const lists = each(
      layers.lobes.lobes,
      (j) => Object.fromEntries(PARAMETERS.map((p) => [p, rgb(lobes, `lobes.${j}.${p}`)])));
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
  if (opacity) {
    const lists = each(grid_size(views), (k) => opacity.get(direction_name('opacity', k)));
    result.opacity = (t, k) => lists[k][t];
  }
  if (products) {
    const channels = each(bases.size, (n) => bases.get(`bases.${n}`)), {length} = channels[0], {of_views} = base_count(text);
    const base = (i) => channels[Math.floor(i / length)][i % length];
    const V = grid_size(views), L = grid_size(lights);
    const pairs = pairs_at(text, map ? 0 : level);
    result.products = {
      pairs,
      coefficient: (t, m) => products.get(`products.${m}`)[t],
      phi: (a, k) => a === 0 ? 1 : base((a - 1) * V + k),
      psi: (b, k) => COLOURS.map((_, c) => base(of_views + 3 * (b * L + k) + c)),
    };
  }
  return result;
}

/** Level `level` of a fabric of open_fabric. */
export function read_fabric_level(fabric, level) {
  const map = read_map(fabric.front ?? fabric), read = (layer) => map && !SPREAD.includes(layer) ? null : read_layer(fabric, layer, level);
  const numbers = {...Object.fromEntries(LAYERS.map((layer) => [layer, read(layer)])), ...map && read_repeat(fabric, level)};
  // They stand at level 0 and belong to all.
  if (numbers.products) numbers.bases ??= read_layer(fabric, 'bases', 0);
  return make_level(fabric, level, numbers, map);
}

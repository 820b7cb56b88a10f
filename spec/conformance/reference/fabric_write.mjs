// The parts of fabric files (spec/fabric.md), which write_exr() writes.
import {make_level} from './level.mjs';
import {
  LAYERS, chain_length, channel_values, header_digest, layer_channels, level_size, needs_lights, pixel_digest
} from './reader.mjs';
import {attribute, pack_values} from './exr_write.mjs';
import {evaluate_texel} from './brdf.mjs';

const byte_order = (a, b) => Buffer.compare(Buffer.from(a.name), Buffer.from(b.name));

/** The part of a layer: all levels of the chain, zeros where the layer is not listed. */
function layer_part(fabric, name) {
  const {texels: [w, h], layers} = fabric;
  const layer = layers[name];
  const channels =
    layer_channels(name, fabric).map((channel) => ({name: channel, type: layer.precision})).sort(byte_order);
  const side = Math.max(w, h) > 32 ? 64 : 32;
  return {
    name,
    channels,
    compression: 'zip',
    tile: {width: side, height: side},
    attributes: {wrapmodes: attribute.string('periodic,periodic')},
    levels: Array.from(
      {length: chain_length(w, h)},
      (_, k) => {
        const size = {width: level_size(w, k), height: level_size(h, k)};
        const zeros = new Float64Array(size.width * size.height);
        const values = new Map(channels.map(
          (channel) =>
            [channel.name,
             pack_values(
               layer.levels.includes(k) ? layer.values(k, channel.name, size) : zeros, channel.type)]));
        return {...size, values};
      }),
  };
}

/** The texels of level `k` as a reader will see them: the stored numbers. */
function stored_level(fabric, parts, k) {
  const layers = Object.fromEntries(LAYERS.map((name) => {
    if (['yarns', 'indirect', 'map'].includes(name)) return [name, null];
    const at = name === 'bases' ? 0 : k;
    const part = fabric.layers[name]?.levels.includes(at) ? parts.find((p) => p.name === name) : null;
    const numbers = part &&
      new Map(part.channels.map(
        ({name: channel,
          type}) => [channel, channel_values({type, bytes: part.levels[at].values.get(channel)})]));
    return [name, numbers];
  }));
  return make_level(fabric, k, layers);
}

function preview_part(fabric, parts) {
  const level = stored_level(fabric, parts, 0);
  const {width, height} = level;
  const length = Math.hypot(-0.4, 0.5, 0.8);
  const pixels = Array.from(
    {length: width * height},
    (_, t) => evaluate_texel(
      level, [t % width, Math.floor(t / width)], [-0.4 / length, 0.5 / length, 0.8 / length], [0, 0, 1]));
  const channels = ['A', 'B', 'G', 'R'].map((name) => ({name, type: 'half'}));
  const colour = (c) =>
    pack_values(pixels.map(({rgb, alpha}) => Math.min(1000, Math.PI * alpha * rgb[c])), 'half');
  const values = new Map([
    ['A', pack_values(pixels.map(({alpha}) => alpha), 'half')], ['B', colour(2)], ['G', colour(1)],
    ['R', colour(0)]
  ]);
  return {
    name: 'preview',
    channels,
    compression: 'zip',
    tile: null,
    levels: [{width, height, values}],
    attributes: {wrapmodes: attribute.string('periodic,periodic')},
  };
}

/**
 * The parts of a fabric file without the attributes of part 0 (seal()).
 *
 * A fabric: { texels, levels, mmPerRepeat, referenceHeight, thickness, views: { columns, rows }, lights, provenance, layers }
 * with layers: { name: { levels, precision, values(level, channel, { width, height }) } } and the layer's other members of
 * the attribute text, values giving the numbers of a channel row by row. `lights` may be missing without a layer over lights.
 */
export function fabric_parts(fabric) {
  const parts = LAYERS.filter((name) => fabric.layers[name]).map((name) => layer_part(fabric, name));
  return [preview_part(fabric, parts), ...parts];
}

/** The attribute text as an object, with the digests of the parts. */
export function fabric_text(fabric, parts) {
  const {texels, levels, mmPerRepeat, referenceHeight, thickness, radianceScale, views, lights, provenance} = fabric;
  const grid = ({columns, rows}) => ({layout: 'equal-area', columns, rows});
  const used = LAYERS.filter((name) => fabric.layers[name]);
  const entries = (make) => Object.fromEntries(
    used.map((name) => [name, make(fabric.layers[name], parts.find((p) => p.name === name))]));
  return {
    version: fabric.layers.map ? [5, 1] : [fabric.layers.yarns?.packed ? 5 : 4, 0],
    texels,
    levels,
    mmPerRepeat,
    referenceHeight,
    thickness,
    ...(radianceScale === undefined ? {} : {radianceScale}),
    views: grid(views),
    ...(used.some(needs_lights) ? {lights: grid(lights)} : {}),
    layers: entries(({levels: listed, values, precision, ...members}) => ({levels: listed, ...members})),
    digests: entries(
      (layer, part) => layer.levels.map(
        (k) => pixel_digest(
          new Map(part.channels.map(({name}) => [name, {bytes: part.levels[k].values.get(name)}]))))),
    provenance,
  };
}

/** { parts, text } of another side of a fabric, for its file. The yarn and its members are the front's. */
export function add_side(fabric, side) {
  const own = LAYERS.filter((name) => fabric.layers[name] && name !== 'yarns').map((name) => layer_part(fabric, name));
  const all = fabric_text({...fabric, layers: {...fabric.layers, yarns: undefined}}, own);
  const {layers, digests, views, lights, radianceScale, provenance} = all;
  const text = {layers, digests, views, provenance};
  if (lights) text.lights = lights;
  if (radianceScale !== undefined) text.radianceScale = radianceScale;
  const parts = own.map((part) => ({
    ...part,
    name: `${side}.${part.name}`,
    channels: part.channels.map((channel) => ({...channel, name: `${side}.${channel.name}`})),
    levels: part.levels.map((level) => ({
      ...level,
      values: new Map([...level.values].map(([name, values]) => [`${side}.${name}`, values])),
    })),
  }));
  return {parts, text};
}

/** Gives part 0 its attributes: the text (a string) and the header digest. */
export function seal(parts, text) {
  const value = attribute.string(text);
  const digest = header_digest({
    parts: [{...parts[0], attributes: new Map([['selvedge.fabric', {value: value[1]}]])}, ...parts.slice(1)]
  });
  Object.assign(parts[0].attributes, {'selvedge.fabric': value, 'selvedge.digest': attribute.string(digest)});
}

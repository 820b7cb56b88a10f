// Unpacks the yarn of a fabric file (spec/fabric.md, "Packed yarn").
import {TRANSFER_VALUES} from './reader.mjs';

/** The numbers of a spread layer one after the other, and back. */
export const flat = (values, layer) => Array.from({length: values.size}, (_, i) => [...values.get(`${layer}.${i}`)]).flat();
export function spread(list, layer, texels) {
  const length = Math.ceil(list.length / texels);
  return new Map(Array.from({length}, (_, i) => {
    const own = list.slice(i * texels, (i + 1) * texels);
    return [`${layer}.${i}`, own.concat(Array(texels - own.length).fill(0))];
  }));
}

/** Fields of a curve: how many nodes it has, and whether as many squeezes follow them. */
const NODES = 0, SQUASHED = 30, SQUEEZE_STEP = 1 / 64;

/** [text, layer]: of a file without packed yarn; as given where it has none. */
export function unpacked(text, layer) {
  const {packed, ...counts} = text.layers.yarns, {curves, fields, nodes, stations, valuesPerStation = TRANSFER_VALUES} = counts;
  if (!packed) return [text, layer];
  const {functions} = packed, step = Math.fround(packed.step), texels = text.texels[0] * text.texels[1];
  const numbers = flat(layer.yarns, 'yarns'), factors = flat(layer.indirect, 'indirect'), begin = fields * curves;
  for (let axis = 0; axis < 3; ++axis) {
    let next = begin + axis * nodes;
    const take = (count, unit, is_node) => {
      let place = 0, slope = 0;
      for (let i = 0; i < count && next < begin + (axis + 1) * nodes; ++i, ++next) {
        slope = (is_node && i > 1 ? slope : 0) + numbers[next];
        place += slope;
        numbers[next] = Math.fround(place * unit);
      }
    };
    for (let c = 0; c < curves; ++c) {
      const count = numbers[NODES * curves + c];
      take(count, step, true);
      if (fields > SQUASHED && numbers[SQUASHED * curves + c] === 1) take(count, SQUEEZE_STEP, false);
    }
  }
  const all = numbers.slice(begin + 3 * nodes), light = Array.from({length: valuesPerStation * stations}, (_, i) => {
    const value = Math.floor(i / stations);
    let sum = 0;
    for (let f = 0; f < functions; ++f) sum += factors[f * stations + i % stations] * all[value * functions + f];
    return sum;
  });
  return [
    {...text, layers: {...text.layers, yarns: counts}},
    {yarns: spread(numbers.slice(0, begin + 3 * nodes), 'yarns', texels), indirect: spread(light, 'indirect', texels)},
  ];
}

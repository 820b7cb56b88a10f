// Yarn in pieces (spec/fabric.md, Pieces) as yarn without them.
import {axis_of, curves_of, direction_of_angles} from './curves.mjs';
import {ANGLES, Issue, LIGHTS, TRANSFER_VALUES} from './reader.mjs';
import {cross, dot, minus, plus} from './vector.mjs';

const {atan2, cos, floor, fround, sin} = Math;

/** The numbers of a spread layer one after the other, and back. */
export const flat = (values, layer) => Array.from({length: values.size}, (_, i) => [...values.get(`${layer}.${i}`)]).flat();
export function spread(list, layer, texels) {
  const length = Math.ceil(list.length / texels);
  return new Map(Array.from({length}, (_, i) => {
    const own = list.slice(i * texels, (i + 1) * texels);
    return [`${layer}.${i}`, own.concat(Array(texels - own.length).fill(0))];
  }));
}

/** The values of a station that change with the angle by pairs, once or twice about: [first, second, times]. */
function turning(valuesPerStation, sides) {
  const pairs = [], at = (j, count) => [[1, 2, 1], [3, 4, sides ? 1 : 2]].map(([a, b, times]) => [j + a * count, j + b * count, times]);
  for (let i = 0; i < 3 * LIGHTS; ++i) pairs.push(...at(i, 3 * LIGHTS));
  for (let value = TRANSFER_VALUES; value + ANGLES <= Math.min(valuesPerStation, TRANSFER_VALUES + 2 * ANGLES); value += ANGLES)
    pairs.push(...at(value, 1));
  return pairs;
}

/** [text, layer]: of a file without pieces; as given where it has none. */
export function placed(text, layer) {
  const {pieces, ...counts} = text.layers.yarns, {curves: C, fields, nodes: n, stations: S, valuesPerStation = TRANSFER_VALUES} = counts;
  if (!pieces) return [text, layer];
  const refuse = (place) => {
    throw new Issue('FABRIC_MALFORMED', `yarns/${place}`, 'pieces and curves do not agree');
  };
  const period = text.mmPerRepeat.map(fround), texels = text.texels[0] * text.texels[1];
  const numbers = flat(layer.yarns, 'yarns'), light = flat(layer.indirect, 'indirect');
  const vector = (i) => [0, 1, 2].map((axis) => numbers[fields * C + axis * n + i]);
  const kinds = numbers.slice(fields * C + 3 * n).slice(0, pieces.count);
  const bad = kinds.findIndex((kind) => !(Number.isInteger(kind) && kind >= 0 && kind < pieces.kinds));
  if (bad >= 0) refuse(`piece ${bad}`);
  const K = pieces.nodes, given = curves_of({...counts, nodes: 0}, (i) => numbers[i], vector);
  const wrong = given.findIndex(({nodes, stations}) => !(Number.isInteger(nodes / K) && nodes > 0 && stations >= 1));
  if (wrong >= 0) refuse(`curve ${wrong}`);
  const all = given.reduce((sum, {nodes}) => sum + nodes, 0), all_stations = given.reduce((sum, {stations}) => sum + stations, 0);
  if (all !== pieces.count * K || all > 2 ** 20 || all_stations > 2 ** 18) refuse('pieces');
  const squashed = given.some((curve) => curve.squashed === 1), shapes = pieces.kinds * K;
  if (n !== pieces.count + shapes * (squashed ? 2 : 1)) refuse('pieces');
  const vectors = [], values = Array.from({length: valuesPerStation}, () => []);
  let first = 0;
  for (const curve of given) {
    const count = curve.nodes / K, own = kinds.slice(first, first + count), starts = own.map((_, p) => vector(first + p));
    const turns = [fround(curve.turns[0] * period[0]), fround(curve.turns[1] * period[1]), 0];
    curve.points = starts.flatMap((start, p) => {
      const way = minus(starts[p + 1] ?? plus(starts[0], turns), start);
      return Array.from({length: K}, (_, i) => plus(plus(start, way, i / K), vector(pieces.count + own[p] * K + i)).map((x) => fround(x)));
    });
    for (const point of curve.points) vectors.push(point);
    if (curve.squashed === 1)
      for (const kind of own) for (let i = 0; i < K; ++i) vectors.push(vector(pieces.count + shapes + kind * K + i));
    const axis = axis_of(curve, period), pairs = turning(valuesPerStation, curve.plies.sides);
    // From the direction of a piece to the chain's, where the chain has come so far.
    const angle = (piece, fraction) => {
      const {tangent, across: chain, fraction: begin} = axis[piece * K], up = direction_of_angles(tangent);
      return atan2(dot(cross(up, chain), tangent), dot(up, chain)) - curve.turned * (fraction - begin);
    };
    for (let s = 0; s < curve.stations; ++s) {
      const fraction = s / curve.stations;
      let node = 0;
      while (node + 1 < curve.nodes && axis[node + 1].fraction <= fraction) ++node;
      const {fraction: from} = axis[node], to = axis[node + 1].fraction;
      const place = (node + (fraction - from) / (to - from)) * pieces.stations / K;
      const sum = Array(valuesPerStation).fill(0);
      for (const station of [floor(place), floor(place) + 1]) {
        const piece = floor(station / pieces.stations), kind = own[piece % count], weight = 1 - Math.abs(place - station);
        const stored = (value) => weight * light[value * S + kind * pieces.stations + station % pieces.stations];
        const a = angle(piece % count, fraction - floor(piece / count)), changed = new Set();
        for (const [one, other, times] of pairs) {
          const [x, y] = [stored(one), stored(other)];
          sum[one] += cos(times * a) * x + sin(times * a) * y;
          sum[other] += cos(times * a) * y - sin(times * a) * x;
          changed.add(one).add(other);
        }
        for (let value = 0; value < valuesPerStation; ++value) if (!changed.has(value)) sum[value] += stored(value);
      }
      sum.forEach((x, value) => values[value].push(x));
    }
    first += count;
  }
  const list = [numbers.slice(0, fields * C), ...[0, 1, 2].map((axis) => vectors.map((v) => v[axis]))].flat();
  return [
    {...text, layers: {...text.layers, yarns: {...counts, nodes: vectors.length, stations: all_stations}}},
    {yarns: spread(list, 'yarns', texels), indirect: spread(values.flat(), 'indirect', texels)},
  ];
}

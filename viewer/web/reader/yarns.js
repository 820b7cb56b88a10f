// The yarn itself (spec/brdf.md, Yarn; spec/fabric.md, Yarn) from its layers.
//
// Yarns, as yarns_of gives them: { period, plane, curves, segments, top, bottom, thinnest, stations,
// light(station, j, k, colour) }; lengths in mm. A segment: { curve, start, along, length, tangents: [t_i, t_(i+1)],
// across: [A_i, A_(i+1)], before }, before being the length of its chain up to its start.
import {Issue} from './issue.js';
import {across, cross, dot, minus, plus, times, unit} from './vector.js';

const {abs, atan2, cos, floor, hypot, max, min, sin} = Math;
/** Numbers of a curve before the nodes, those that may follow the nodes (where they do not: these), and of a node. */
const FIELDS = 11, LATER_FIELDS = [1, 1, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 1], AXES = 3;
/** Functions of the angle, and of the light, that indirect light has coefficients of. */
export const ANGLES = 5, LIGHTS = 9;
/** Limits of the values: turns, and nodes in periods; a radius in periods; a segment in radii. */
const REACH = 64, MOST_RADIUS = 2, LEAST_LENGTH = 1e-3;
/** Limits of plies: their number, the parts of a segment, and the shift of one over the chain. */
const MOST_PLIES = 8, MOST_DIVISIONS = 64, MOST_SHIFT = 4096;

/** The field that has the number of strands; limits of it, of pieces, shift and swells. */
export const STRANDS = 18;
const MOST_STRANDS = 1024, MOST_PIECES = 32768;

const reflected = (a, n) => minus(a, times(n, 2 * dot(n, a) / dot(n, n)));
const turned = (a, axis, angle) => plus(times(a, cos(angle)), cross(axis, a), sin(angle));

/** How many numbers the layers have. */
export const yarn_count = ({curves, nodes, fields = FIELDS}) => fields * curves + AXES * nodes;
/** Where a number of curve 0 is: of a field, and of an axis of a node. */
export const field_place = ({curves, nodes}, field) => field * curves + (field < FIELDS ? 0 : AXES * nodes);
export const axis_place = ({curves, nodes}, axis) => FIELDS * curves + axis * nodes;
export const indirect_count = ({stations}) => 3 * ANGLES * LIGHTS * stations;

function curves_of(counts, number, point) {
  const {curves, nodes, fields = FIELDS} = counts;
  let first = 0;
  return Array.from({length: curves}, (_, c) => {
    const field = (f) => f < fields ? number(field_place(counts, f) + c) : LATER_FIELDS[f - FIELDS];
    const [own, stations, X, Y, radius, red, green, blue, gloss, roughness, slope, ...later] =
      Array.from({length: FIELDS + LATER_FIELDS.length}, (__, f) => field(f));
    const [count, divisions, shift, phase, r, g, b, ...of_strands] = later, groove = [r, g, b];
    const strands = strands_of(of_strands);
    const points = Array.from({length: max(0, min(own, nodes - first)) | 0}, (__, n) => point(first + n));
    first += own;
    const albedo = [red, green, blue], turns = [X, Y];
    const plies = {count, divisions, shift, phase, groove};
    return {nodes: own, first: first - own, points, stations, turns, radius, albedo, gloss, roughness, slope, plies, strands};
  });
}

const is_whole = (x, low, high) => Number.isInteger(x) && x >= low && x <= high;
const are_plies = ({count, divisions, shift, phase, groove}) => is_whole(count, 1, MOST_PLIES) &&
  is_whole(divisions, 1, count > 1 ? MOST_DIVISIONS : 1) && is_whole(shift, -MOST_SHIFT, MOST_SHIFT) &&
  abs(phase) <= Math.fround(Math.PI) && groove.every((x) => abs(x) <= 1);

const strands_of = ([count, pieces, shift, seed, irregularity, swells]) =>
  ({count, pieces, shift, seed, irregularity, swells});
const are_strands = ({count, pieces, shift, seed, irregularity, swells}) =>
  is_whole(count, -MOST_STRANDS, MOST_STRANDS) && is_whole(pieces, 2, MOST_PIECES) &&
  is_whole(shift, -MOST_PIECES, MOST_PIECES) && is_whole(seed, 0, 2 ** 24 - 1) && irregularity >= 0 &&
  irregularity <= Math.fround(0.3) && is_whole(swells, 1, MOST_PIECES);

/** The place of the first curve, node or count that a reader must refuse, and why; null where there is none. */
function fault_of({period, curves, counts, point}) {
  const reach = [...period, max(...period)].map((side) => REACH * side);
  for (let n = 0; n < counts.nodes; ++n)
    if (!point(n).every((x, axis) => abs(x) <= reach[axis])) return [`node ${n}`, 'lies too far away'];
  const share = (x) => x >= 0 && x <= 1;
  let end = 0, stations = 0;
  for (const [c, curve] of curves.entries()) {
    const {nodes, first, points, turns, radius, roughness} = curve;
    const good = Number.isInteger(nodes) && nodes >= 2 && Number.isInteger(curve.stations) && curve.stations >= 1 &&
      radius > 0 && radius <= MOST_RADIUS * min(...period) && [...curve.albedo, curve.gloss, roughness].every(share) &&
      roughness > 0 && are_plies(curve.plies) && are_strands(curve.strands) &&
      turns.every((x) => Number.isInteger(x) && abs(x) <= REACH);
    if (!good) return [`curve ${c}`, 'has a value out of range'];
    if (points.length < nodes) return [`curve ${c}`, 'has nodes beyond the last'];
    const short = ways_of(curve, period).findIndex((way) => hypot(...way) < LEAST_LENGTH * radius);
    if (short >= 0) return [`node ${first + short}`, 'lies where the next does'];
    end += nodes;
    stations += curve.stations;
  }
  if (end !== counts.nodes) return ['nodes', 'there are more than the curves have'];
  return stations === counts.stations ? null : ['light', 'the stations are not those of the curves'];
}

/** From each node of a curve to the next. */
function ways_of({points, turns: [X, Y]}, [P_x, P_y]) {
  return points.map((p, i) => minus(points[i + 1] ?? plus(points[0], [X * P_x, Y * P_y, 0]), p));
}

/** The segments of a curve. */
function segments_of(curve, period) {
  const ways = ways_of(curve, period), n = ways.length, lengths = ways.map((way) => hypot(...way));
  const tangents = ways.map((way, i) => {
    const last = (i + n - 1) % n;
    const sum = plus(times(ways[last], lengths[i] ** 2), times(way, lengths[last] ** 2));
    return unit(hypot(...sum) > 0 ? sum : way);
  });
  tangents.push(tangents[0]);
  const frames = [unit(across(abs(tangents[0][2]) >= 0.9 ? [1, 0, 0] : [0, 0, 1], tangents[0]))];
  ways.forEach((way, i) => {
    const turn = minus(tangents[i + 1], reflected(tangents[i], way)), first = reflected(frames[i], way);
    frames.push(dot(turn, turn) > 0 ? reflected(first, turn) : first);
  });
  const before = [0];
  for (const length of lengths) before.push(before.at(-1) + length);
  const g = atan2(dot(cross(frames[0], frames[n]), tangents[0]), dot(frames[0], frames[n]));
  const angles = frames.map((A, i) => turned(A, tangents[i], -g * before[i] / before[n]));
  curve.length = before[n];
  curve.tangent = tangents[0];
  return ways.map(
    (along, i) => ({
      curve,
      start: curve.points[i],
      along,
      length: lengths[i],
      tangents: [tangents[i], tangents[i + 1]],
      across: [angles[i], angles[i + 1]],
      before: before[i],
    }));
}

/**
 * The yarns of a fabric from the numbers of its layers, Maps from channels to arrays. `text` has the members of
 * the attribute text. An Issue where they are none.
 */
export function yarns_of({texels: [w, h], layers, mmPerRepeat, referenceHeight}, layer) {
  const counts = layers.yarns, period = mmPerRepeat.map(Math.fround);
  const number = (name) => {
    const channels = Array.from({length: layer[name].size}, (_, i) => layer[name].get(`${name}.${i}`));
    return (i) => channels[floor(i / (w * h))][i % (w * h)];
  };
  const of_yarns = number('yarns'), of_light = number('indirect');
  const point = (n) => [0, 1, 2].map((axis) => of_yarns(axis_place(counts, axis) + n));
  const curves = curves_of(counts, of_yarns, point);
  const fault = fault_of({period, curves, counts, point});
  if (fault) throw new Issue('FABRIC_MALFORMED', `yarns/${fault[0]}`, fault[1]);
  let first_station = 0;
  for (const curve of curves) {
    curve.first_station = first_station;
    first_station += curve.stations;
  }
  const segments = curves.flatMap((curve) => segments_of(curve, period));
  const end_of = (sign) => segments.map(({start, curve}) => start[2] + sign * curve.radius);
  return {
    period,
    plane: Math.fround(referenceHeight),
    curves,
    segments,
    stations: counts.stations,
    top: end_of(1).reduce((a, b) => max(a, b)),
    bottom: end_of(-1).reduce((a, b) => min(a, b)),
    thinnest: curves.reduce((least, {radius}) => min(least, radius), Infinity),
    light: (station, j, k, c) => of_light(((j * LIGHTS + k) * 3 + c) * counts.stations + station),
  };
}

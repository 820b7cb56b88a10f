// The yarn itself (spec/brdf.md, Yarn; spec/fabric.md, Yarn) from its layers.
//
// Yarns, as yarns_of gives them: { period, map, repeat of the cloth, plane, curves, segments, top, bottom, thinnest, stations,
// light(station, j, k, colour), moment(station, n, j) }; lengths in mm. A segment: { curve, radius, start, along, length, tangents: [t_i,
// t_(i+1)], and of both ends across: A, out: E, and stations: the place along the curve; rows: of the noise of strands;
// ball: radius of that about its start; rank: of hairs, else 0; reach: the largest radius; squeeze: g of flat yarn }. Its
// radii, length, tangents and `round`, which is along, belong to the round section. Of a hair, across[0] has cos a,
// sin a and u of its root.
import {hairs_of} from './hairs.mjs';
import {ANGLES, Issue, LIGHTS, TRANSFER_VALUES} from './reader.mjs';
import {swell} from './swells.mjs';
import {across, between, cross, dot, minus, plus, squeeze_of, squeezed, stretched, thin, times, unit} from './vector.mjs';

const {abs, atan2, cos, floor, fround, hypot, max, min, sin} = Math;
/** Values of the fields from 11 on of files that have fewer. */
const DEFAULTS = [1, 1, 0, 0, 0, 0, 0, 0, 2, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, fround(0.12), 0, 0, 0, 0];
/** Limits of the values: turns, and nodes in periods; a radius in periods; a segment in radii. */
const REACH = 64, MOST_RADIUS = 2, LEAST_LENGTH = 1e-3;
/** Limits of plies: their number, the parts of a segment, the shift of one over the chain, the nodes of all, the groove. */
const MOST_PLIES = 8, MOST_DIVISIONS = 64, MOST_SHIFT = 4096, MOST_NODES = 2 ** 20, MOST_GROOVE = 4;

/** Limits of strands, and of their pieces, shift and swells. */
const MOST_STRANDS = 1024, MOST_PIECES = 32768;
/** Hairs of a curve, points of each. */
const MOST_HAIRS = 100000, HAIR_POINTS = 8;
/** Times that all yarn covers the cell; thickness over width. */
const MOST_COVERED = 1024, LEAST_FLATTENING = fround(0.3);

const reflected = (a, n) => minus(a, times(n, 2 * dot(n, a) / dot(n, n)));
const turned = (a, axis, angle) => plus(times(a, cos(angle)), cross(axis, a), sin(angle));

function curves_of(counts, number, point) {
  const {curves, nodes, fields} = counts;
  let first = 0, next = 0;
  return Array.from({length: curves}, (_, c) => {
    const field = (f) => f < fields ? number(f * curves + c) : DEFAULTS[f - 11];
    const [own, stations, X, Y, radius, red, green, blue, gloss, roughness, slope, ...later] =
      Array.from({length: 11 + DEFAULTS.length}, (__, f) => field(f));
    const [count, divisions, shift, phase, r, g, b, ...of_strands] = later, groove = [r, g, b];
    const strands = {...strands_of(of_strands), contrast: of_strands[13], change: of_strands[14], marl: of_strands[17]}, flattening = of_strands[6], hairs = hairs_from(of_strands.slice(7)), squashed = of_strands[12];
    const take = (count) => {
      const taken = Array.from({length: max(0, min(count, nodes - next)) | 0}, (__, n) => point(next + n));
      next += count;
      return taken;
    };
    const points = take(own), squeezes = squashed === 1 ? take(own) : [];
    first += own;
    const albedo = [red, green, blue], turns = [X, Y];
    const plies = {count, divisions, shift, phase, groove, sides: of_strands[15]};
    const light = {albedo, gloss, roughness, slope, lustre: of_strands[16]};
    return {nodes: own, first: first - own, points, squashed, squeezes, stations, turns, radius, flattening, ...light, plies, strands, hairs};
  });
}

const is_whole = (x, low, high) => Number.isInteger(x) && x >= low && x <= high;
const are_plies = ({count, divisions, shift, phase, groove, sides}) => is_whole(count, 1, MOST_PLIES) &&
  is_whole(divisions, 1, count > 1 ? MOST_DIVISIONS : 1) && is_whole(shift, -MOST_SHIFT, MOST_SHIFT) &&
  abs(phase) <= fround(Math.PI) && groove.every((x) => abs(x) <= MOST_GROOVE) &&
  is_whole(sides, 0, 1);

const strands_of = ([count, pieces, shift, seed, irregularity, swells]) =>
  ({count, pieces, shift, seed, irregularity, swells});
const are_strands = ({count, pieces, shift, seed, irregularity, swells, contrast, change, marl}) =>
  is_whole(count, -MOST_STRANDS, MOST_STRANDS) && is_whole(pieces, 2, MOST_PIECES) &&
  is_whole(shift, -MOST_PIECES, MOST_PIECES) && is_whole(seed, 0, 2 ** 24 - 1) && irregularity >= 0 &&
  irregularity <= fround(0.3) && is_whole(swells, 1, MOST_PIECES) && contrast >= 0 && contrast <= fround(0.4) &&
  change >= 0 && change <= fround(0.6) && marl >= 0 && marl <= fround(0.9);

const hairs_from = ([count, length, loops, radius, kept]) => ({count, length, loops, radius, kept});
const are_hairs = ({count, length, loops, radius, kept}, longest) => is_whole(count, -MOST_HAIRS, MOST_HAIRS) &&
  [length, radius].every((x) => x >= 0 && x <= longest) && [loops, kept].every((x) => x >= 0 && x <= 1) &&
  (count === 0 || (length > 0 && fround(radius * kept) > 0));

/** The place of the first curve, node or count that a reader must refuse, and why; null if there is no fault. */
function fault_of({period, curves, counts, point}) {
  const reach = [...period, max(...period)].map((side) => REACH * side);
  const fraction = (x) => x >= 0 && x <= 1;
  let end = 0, stations = 0;
  for (const [c, curve] of curves.entries()) {
    const {nodes, first, points, squashed, squeezes, turns, radius, roughness} = curve;
    const far = points.findIndex((p) => !p.every((x, axis) => abs(x) <= reach[axis]));
    if (far >= 0) return [`node ${first + far}`, 'lies too far away'];
    const good = Number.isInteger(nodes) && nodes >= 2 && Number.isInteger(curve.stations) && curve.stations >= 1 &&
      radius > 0 && radius <= MOST_RADIUS * min(...period) && [...curve.albedo, curve.gloss, roughness].every(fraction) &&
      roughness > 0 && curve.lustre >= 0 && curve.lustre <= fround(0.9) && are_plies(curve.plies) && are_strands(curve.strands) &&
      curve.flattening >= LEAST_FLATTENING && curve.flattening <= 1 && (squashed === 0 || squashed === 1) &&
      squeezes.every((g) => dot(g, g) <= 1 - LEAST_FLATTENING) && are_hairs(curve.hairs, MOST_RADIUS * min(...period)) &&
      turns.every((x) => Number.isInteger(x) && abs(x) <= REACH);
    if (!good) return [`curve ${c}`, 'has a value out of range'];
    if (points.length < nodes || (squashed && squeezes.length < nodes)) return [`curve ${c}`, 'has nodes beyond the last'];
    const short = ways_of(curve, period).findIndex((way) => hypot(...way) < LEAST_LENGTH * radius);
    if (short >= 0) return [`node ${first + short}`, 'lies where the next does'];
    end += nodes * (1 + squashed);
    stations += curve.stations;
  }
  if (end !== counts.nodes) return ['nodes', 'there are more than the curves have'];
  const size = ({nodes, plies, hairs}) => nodes * plies.count * plies.divisions + HAIR_POINTS * abs(hairs.count);
  if (curves.reduce((sum, curve) => sum + size(curve), 0) > MOST_NODES)
    return ['nodes', 'plies and hairs have too many'];
  let covered = 0;
  const area = (radius, length, count) => 2 * radius * (length + count * radius);
  for (const [c, curve] of curves.entries()) {
    const segments = segments_of(curve, period), {count, length, radius} = curve.hairs;
    if (segments.some((s) => hypot(...s.along) < LEAST_LENGTH * s.radius))
      return [`curve ${c}`, 'has a ply of which a node lies where the next does'];
    covered += area(curve.ply_radius, segments.reduce((sum, {along}) => sum + hypot(...along), 0), segments.length) +
      8 * abs(count) * area(max(radius, curve.radius / 8), length, HAIR_POINTS - 1);
    if (covered > MOST_COVERED * period[0] * period[1]) return [`curve ${c}`, 'covers the cell too often'];
  }
  return stations === counts.stations ? null : ['light', 'the curves have another number of stations'];
}

/** From each node of a curve to the next. */
function ways_of({points, turns: [X, Y]}, [P_x, P_y]) {
  return points.map((p, i) => minus(points[i + 1] ?? plus(points[0], [X * P_x, Y * P_y, 0]), p));
}

/** The directions at nodes 0 to n of nodes -1 to n + 1. */
function tangents_at(nodes) {
  return nodes.slice(2).map((next, i) => {
    const back = minus(nodes[i + 1], nodes[i]), way = minus(next, nodes[i + 1]);
    const sum = plus(times(back, dot(way, way)), times(way, dot(back, back)));
    return unit(hypot(...sum) > 0 ? sum : way);
  });
}

/** g of squashed yarn, so far behind node i; none of round yarn. */
const squeeze_at = ({squeezes, nodes}, i, s) => squeezes.length > 0 ? between(squeezes[i], squeezes[(i + 1) % nodes], s) : null;

/** Per node of a curve, and for where it begins again: { p, tangent, across, fraction }, fraction: of the chain before it. */
function axis_of(curve, period) {
  const ways = ways_of(curve, period), n = ways.length, lengths = ways.map((way) => hypot(...way));
  const end = plus(curve.points[n - 1], ways[n - 1]), nodes = [...curve.points, end];
  const tangents = tangents_at([minus(nodes[0], ways[n - 1]), ...nodes, plus(end, ways[0])]);
  const frames = [unit(across(abs(tangents[0][2]) >= 0.9 ? [1, 0, 0] : [0, 0, 1], tangents[0]))];
  ways.forEach((way, i) => {
    const turn = minus(tangents[i + 1], reflected(tangents[i], way)), first = reflected(frames[i], way);
    frames.push(dot(turn, turn) > 0 ? reflected(first, turn) : first);
  });
  const before = [0];
  for (const length of lengths) before.push(before.at(-1) + length);
  const g = atan2(dot(cross(frames[0], frames[n]), tangents[0]), dot(frames[0], frames[n]));
  curve.tangent = tangents[0];
  return nodes.map((p, i) => {
    const fraction = before[i] / before[n];
    return {p, tangent: tangents[i], across: turned(frames[i], tangents[i], -g * fraction), fraction};
  });
}

/**
 * The segments of a chain: of nodes -1 to n + 1, and what nodes 0 to n have, `middle` being a place on the yarn's axis;
 * rows: of the noise, for its first strand, and for the first strand of the chain that follows it.
 */
function chained(curve, nodes, ends, radius, rows = [0, 0]) {
  const tangents = tangents_at(nodes);
  const squeezes = ends.slice(1).map(({middle, squeeze}, i) => curve.squeezes.length > 0 ?
    between(ends[i].squeeze, squeeze, 0.5) : squeeze_of(curve, minus(middle, ends[i].middle)));
  const radii = ends.slice(1).map(({fraction}, i) => radius * swell(curve.strands, (ends[i].fraction + fraction) / 2));
  return ends.slice(1).map((end, i) => {
    const along = minus(nodes[i + 2], nodes[i + 1]), both = [ends[i], end], g = squeezes[i], round = squeezed(along, g);
    const ball = thin(max(radii[i], radii.at(i - 1)), g);
    return {
      curve,
      radius: thin(radii[i], g),
      ball,
      reach: ball,
      rank: 0,
      squeeze: g,
      start: nodes[i + 1],
      along,
      round,
      length: hypot(...round),
      tangents: [tangents[i], tangents[i + 1]].map((t) => squeezed(t, g)),
      across: both.map((of) => of.across),
      out: both.map((of) => of.out),
      stations: both.map(({fraction}) => curve.stations * fraction),
      rows,
    };
  });
}

/** Where the plies of an axis have nodes, up to its end: { p, squeeze, across, beside, fraction }. */
function places_on(axis, curve) {
  const {divisions} = curve.plies;
  return axis.slice(1).flatMap((next, i) => Array.from({length: divisions}, (_, k) => {
    const s = k / divisions, {p, tangent, across: A, fraction} = axis[i], d = minus(next.p, p), length = hypot(...d);
    const cubic = (of_d, of_first, of_second) =>
      plus(times(d, of_d), plus(times(tangent, of_first), next.tangent, of_second), length);
    const way = cubic(6 * s - 6 * s * s, 1 - 4 * s + 3 * s * s, 3 * s * s - 2 * s);
    const T = hypot(...way) > 0 ? unit(way) : tangent, own = unit(across(plus(times(A, 1 - s), next.across, s), T));
    return {
      p: plus(p, cubic(3 * s * s - 2 * s ** 3, s - 2 * s * s + s ** 3, s ** 3 - s * s)),
      squeeze: squeeze_at(curve, i, s) ?? squeeze_of(curve, T),
      across: own,
      beside: cross(T, own),
      fraction: fraction + s * (next.fraction - fraction),
    };
  }));
}

/** The segments of a curve, or of its plies one after the other. */
function segments_of(curve, period) {
  const {radius, plies: {count, shift, phase}, turns: [X, Y]} = curve, axis = axis_of(curve, period);
  const repeat = [X * period[0], Y * period[1], 0], none = [0, 0, 0];
  curve.ply_radius = radius;
  if (count === 1) {
    const nodes = axis.map(({p}) => p);
    return chained(
      curve, [minus(nodes.at(-2), repeat), ...nodes, plus(nodes[1], repeat)],
      axis.map((node, i) => ({...node, middle: node.p, out: none, squeeze: curve.squeezes[i % curve.nodes]})), radius);
  }
  const own = radius * sin(Math.PI / count) / (1 + sin(Math.PI / count));
  curve.ply_radius = own;
  const places = places_on(axis, curve), n = places.length;
  // Yarn turned over counts its plies the other way round; its strands know what it was.
  const strands = abs(curve.strands.count), sense = curve.strands.count < 0 ? -1 : 1;
  const row = (ply) => strands * ((sense * ply % count + count) % count);
  return Array.from({length: count}, (_, ply) => {
    const ends = Array.from({length: n + 3}, (__, i) => {
      const times_round = floor((i - 1) / n), place = places[i - 1 - times_round * n], fraction = place.fraction + times_round;
      const angle = phase + 2 * Math.PI * (ply + shift * fraction) / count;
      const out = plus(times(place.across, cos(angle)), place.beside, sin(angle));
      const middle = plus(place.p, repeat, times_round), g = place.squeeze;
      const p = plus(middle, stretched(out, g), thin((radius - own) * swell(curve.strands, fraction), g));
      return {middle, p, across: place.across, out, fraction, squeeze: g};
    });
    return chained(curve, ends.map(({p}) => p), ends.slice(1, -1), own, [row(ply), row(ply + shift)]);
  }).flat();
}

/**
 * The stitches of a map, columns and rows from v = 0 on of any repeat, that segments of a curve in this line belong to (brdf.md,
 * Map).
 */
function stitches_of(segments, {turns: [X, Y], points, plies: {divisions}}, {kinds}, line, period) {
  const along = X === 0 ? 1 : 0, sense = Math.sign(X === 0 ? -Y : X), is_near = (x, border) => abs(x - border) < 1e-3;
  const place = ([x, y]) => [x * kinds[0] / period[0], -y * kinds[1] / period[1]];
  const ways = points.map((p) => sense * place(p)[along]), first = ways.findIndex((x) => is_near(x, Math.round(x)));
  let border = Math.round(ways[first]);
  const of_nodes = ways.map((x, i) => {
    if (i >= first && is_near(x, border)) ++border;
    return sense > 0 ? border - 1 : -border;
  });
  return segments.map(({start, along: way, rank}, i) => place(plus(start, way, 1 / 2)).map((middle, axis) => {
    if (rank > 0 || sense === 0) return floor(middle);
    const own = axis === along ? of_nodes[floor(i / divisions) % points.length] : line;
    return own + kinds[axis] * Math.round((middle - 0.5 - own) / kinds[axis]);
  }));
}

/** The curve turned over (brdf.md, Sides). */
function turn_over(curve, period, thickness) {
  const {count, phase} = curve.plies, sideways = abs(axis_of(curve, period)[0].tangent[2]) >= 0.9;
  const points = curve.points.map(([x, y, z]) => [x, y, fround(thickness - z)]);
  const own = sideways ? -phase : (phase < 0 ? -Math.PI : Math.PI) - phase;
  const plies = {...curve.plies, shift: -curve.plies.shift, phase: count > 1 ? fround(own) : phase};
  const strands = {...curve.strands, count: -curve.strands.count};
  const hairs = {...curve.hairs, count: -curve.hairs.count};
  const squeezes = curve.squeezes.map(([x, y, z]) => [x, y, -z]);
  return {...curve, points, squeezes, slope: -curve.slope, plies, strands, hairs, sideways};
}

/**
 * The yarns of a fabric from its attribute text and the numbers of its layers, Maps from channels to arrays. Throws an
 * Issue where they are out of range. `over`: turned over, but for the light; `sideways` of a curve says whether its angles
 * then count from the x axis. `map`: of read_map().
 */
export function yarns_of({texels: [w, h], layers, mmPerRepeat, referenceHeight, thickness}, layer, map = null, over = false) {
  const counts = layers.yarns, repeat = mmPerRepeat.map(fround);
  const period = map ? repeat.map((mm, axis) => fround(mm * map.kinds[axis] / map.size[axis])) : repeat;
  const number = (name) => {
    const channels = Array.from({length: layer[name].size}, (_, i) => layer[name].get(`${name}.${i}`));
    return (i) => channels[floor(i / (w * h))][i % (w * h)];
  };
  const of_yarns = number('yarns'), of_light = number('indirect');
  const point = (n) => [0, 1, 2].map((axis) => of_yarns(counts.fields * counts.curves + axis * counts.nodes + n));
  const given = curves_of(counts, of_yarns, point);
  const fault = fault_of({period, curves: given, counts, point});
  if (fault) throw new Issue('FABRIC_MALFORMED', `yarns/${fault[0]}`, fault[1]);
  const curves = over ? given.map((curve) => turn_over(curve, period, fround(thickness))) : given;
  let first_station = 0;
  for (const curve of curves) {
    curve.first_station = first_station;
    first_station += curve.stations;
  }
  const chains = curves.map((curve) => segments_of(curve, period));
  const segments = curves.flatMap((curve, c) => {
    const hairs = hairs_of(curve, chains[c], abs(curve.tangent[2]) >= 0.9);
    const own = hairs.length > 0 ? chains[c].concat(hairs) : chains[c];
    if (!map) return own;
    const stitches = stitches_of(own, curve, map, map.lines[c], period);
    return own.map((segment, i) => ({...segment, stitch: stitches[i]}));
  });
  // Chains end where others begin, hairs do not.
  const end_of = (sign) => segments.flatMap(({start, along, rank, reach, squeeze}) => {
    const tall = reach * hypot(...stretched([0, 0, 1], squeeze));
    return [start[2], start[2] + (rank > 0 ? along[2] : 0)].map((z) => z + sign * tall);
  });
  return {
    period,
    map,
    repeat,
    plane: fround(referenceHeight),
    curves,
    segments,
    stations: counts.stations,
    top: end_of(1).reduce((a, b) => max(a, b)),
    bottom: end_of(-1).reduce((a, b) => min(a, b)),
    thinnest: chains.flat().reduce((least, {radius}) => min(least, radius), Infinity),
    light: (station, j, k, c) => of_light(((j * LIGHTS + k) * 3 + c) * counts.stations + station),
    moment: (station, n, j) => {
      const value = TRANSFER_VALUES + ANGLES * (n - 1) + j;
      return value < (counts.valuesPerStation ?? 0) ? of_light(value * counts.stations + station) : 0;
    },
  };
}

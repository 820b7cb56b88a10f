// The cloth as it is seen from one side, with the light that comes through to it (spec/brdf.md, Sides).
import {yarns_of} from './curves.mjs';
import {read_fabric_level} from './level.mjs';
import {flat, spread, unpacked} from './packed.mjs';
import {ANGLES, LIGHTS, read_layer, read_map, repeat_size, TRANSFER_VALUES} from './reader.mjs';

/** The yarn turned over; `light_through` are the numbers of through.indirect, or null. */
function turned_yarns(given, light_through) {
  const yarns = read_layer(given, 'yarns', 0), [fabric, own] = unpacked(given, {yarns, indirect: read_layer(given, 'indirect', 0)});
  const through = light_through && unpacked(given, {yarns, indirect: light_through})[1].indirect;
  const {stations, valuesPerStation = 0} = fabric.layers.yarns, texels = fabric.texels[0] * fabric.texels[1];
  const map = read_map(given), over = yarns_of(fabric, own, map, true);
  const turned = (numbers) => {
    const light = flat(numbers, 'indirect');
    for (const curve of over.curves) {
      const one = curve.sideways ? 2 : 1, odd = [one, curve.plies.sides ? one + 2 : 4];
      for (const j of odd)
        for (let k = 0; k < 3 * LIGHTS; ++k)
          for (let s = 0; s < curve.stations; ++s)
            light[(j * 3 * LIGHTS + k) * stations + curve.first_station + s] *= -1;
      for (const j of odd)
        for (let value = TRANSFER_VALUES + j; value < Math.min(valuesPerStation, TRANSFER_VALUES + 2 * ANGLES); value += ANGLES)
          for (let s = 0; s < curve.stations; ++s) light[value * stations + curve.first_station + s] *= -1;
    }
    return spread(light, 'indirect', texels);
  };
  const of = (indirect) => yarns_of(fabric, {yarns: own.yarns, indirect}, map, true);
  return {front: of(through ? turned(through) : own.indirect), through: through && of(turned(own.indirect))};
}

/**
 * A fabric of open_fabric as it is seen: { levels, level(k), through(k) }, the last null where no light comes through.
 * What was read is kept.
 */
export function seen_from(fabric, behind) {
  const {back, through, 'back.through': back_through} = fabric.sides;
  const same = (a, b) => a.columns === b.columns && a.rows === b.rows;
  const from_front = back && through && same(back.views, fabric.views) ? through : undefined;
  const seen = behind && back ? back : fabric, other = behind && back ? back_through ?? from_front : through;
  const kept = new Map();
  const keep = (name, k, make) => {
    const key = `${name} ${k}`;
    if (!kept.has(key)) kept.set(key, make());
    return kept.get(key);
  };
  const turned = () => keep(
    'turned', 0,
    () => turned_yarns(fabric, through?.layers.indirect ? read_layer(through, 'indirect', 0) : null));
  const turns = behind && back && fabric.layers.yarns;
  const level = (k) => keep('seen', k, () => {
    const made = read_fabric_level(seen, k);
    return k === 0 && turns ? {...made, yarns: turned().front} : made;
  });
  const of_through = (k) => keep('through', k, () => {
    const made = read_fabric_level(other, k), {opacity} = level(k);
    const lit = k > 0 ? null : turns ? turned().through : made.yarns;
    // The yarn is there even if no light is known to come through it.
    const yarns = lit ? {...lit, by_light: true} : level(k).yarns && {...level(k).yarns, dark: true};
    return {...made, opacity, yarns};
  });
  return {levels: repeat_size(fabric).levels, level, through: other ? of_through : null};
}

/** { level(k), light }: the levels that answer for a light, and the light in their upper half. */
export function in_sight({level, through}, light) {
  return light[2] < 0 && through ? {level: through, light: [light[0], light[1], -light[2]]} : {level, light};
}

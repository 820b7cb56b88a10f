// All faults of a fabric file (codes of spec/issues.md).
import {yarns_of} from './curves.mjs';
import {unpacked} from './packed.mjs';
import {Issue, LAYERS, level_of_texels, open_fabric, read_layer, read_map} from './reader.mjs';

/** Runs `work`; an Issue that it throws is added to the list. */
function collect(issues, work) {
  try {
    work();
  } catch (error) {
    if (!(error instanceof Issue)) throw error;
    issues.push({code: error.code, severity: 'error', place: error.place, message: error.message});
  }
}

/** The issues of the bytes of a fabric file: { code, severity, place, message }. */
export async function check_fabric(bytes) {
  const issues = [];
  const report = (code, place, message) => {
    issues.push({code, severity: 'error', place, message});
  };
  let fabric;
  try {
    fabric = await open_fabric(bytes, report);
  } catch (error) {
    collect(issues, () => {
      throw error;
    });
    return issues;
  }
  for (let k = 0; k < (fabric.levels ?? 0); ++k) {
    const before = issues.length;
    for (const [side, of] of Object.entries({front: fabric, ...fabric.sides})) {
      const own = {}, prefix = side === 'front' ? '' : `${side}.`;
      for (const name of LAYERS) {
        if (side !== 'front' && name === 'yarns') continue;
        if (level_of_texels(of, name, k) === k)
          collect(issues, () => {
            own[name] = read_layer(of, name, k, (code, place, message) => report(code, prefix + place, message));
          });
      }
      if (side === 'front' && own.yarns && own.indirect && issues.length === before)
        collect(issues, () => yarns_of(...unpacked(fabric, own), read_map(fabric)));
    }
  }
  return issues;
}

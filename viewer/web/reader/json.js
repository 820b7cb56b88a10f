// JSON as spec/fabric.md wants it: JSON.parse also accepts duplicate members, half a surrogate pair and any nesting.
import {utf8} from './bytes.js';

export const is_object = (x) => typeof x === 'object' && x !== null && !Array.isArray(x);

/** The first such fault of a JSON text that JSON.parse accepts; undefined if it has none. */
function fault_of(text, depth) {
  const open = [];  // the names of the members of objects, null for arrays
  let string = '';
  for (const [token] of text.matchAll(/"(?:[^"\\]|\\.)*"|[{}[\]:]/g)) {
    if (token === '{' || token === '[') {
      if (open.push(token === '{' ? new Set() : null) > depth) return `brackets nest more than ${depth} deep`;
    } else if (token === '}' || token === ']') {
      open.pop();
    } else if (token === ':') {
      if (open.at(-1).has(string)) return `duplicate member ${string}`;
      open.at(-1).add(string);
    } else {
      string = JSON.parse(token);
      if (/[\uD800-\uDFFF]/u.test(string)) return 'half a surrogate pair';
    }
  }
  return undefined;
}

/** The value of a JSON text in UTF-8 (a Uint8Array) whose brackets nest at most `depth` deep; else a SyntaxError. */
export function parse_json(bytes, depth) {
  let text;
  try {
    text = utf8(bytes);
  } catch { throw new SyntaxError('not UTF-8'); }
  const value = JSON.parse(text), fault = fault_of(text, depth);
  if (fault) throw new SyntaxError(fault);
  return value;
}

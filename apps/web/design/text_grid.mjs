// Texts of charts and drafts after a change of their cells: these are as `selvedge stitch --list FILE --json` has them, and change, too.
/** Columns that a stitch takes. */
export const width_of = (stitch) => /^[ct]\d[fb]$|\//.test(stitch) ? stitch.match(/\d/g).reduce((sum, digit) => sum + Number(digit), 0) : 1;

/** "k2 p": each word with how often it follows itself; what has a digit, as cables, is said one by one. */
const runs_of = (words) => words.reduce((runs, word) => {
  if (runs.at(-1)?.[0] === word && (word.endsWith('tog') || !/[\d/]/.test(word))) ++runs.at(-1)[1];
  else runs.push([word, 1]);
  return runs;
}, []).map(([word, count]) => word + (count > 1 ? count : '')).join(' ');

/** A row with a stitch that has no name stays as it is written. */
function with_row(text, {yarns: [{name: first}]}, row, names, yarns) {
  if (names.includes('')) return text;
  const lines = text.split('\n'), line = lines[row.line - 1], has_letters = line.includes('[') || [...yarns].some((letter) => letter !== first);
  Object.assign(row, {stitches: names.map((name) => [name, width_of(name)]), yarns});
  lines[row.line - 1] = `${line.match(/^[^:]*:/)[0]} ${runs_of(names)}${has_letters ? ` [${runs_of([...yarns])}]` : ''}`;
  return lines.join('\n');
}
/** The text with another stitch from a column of row y (from the top) on; what that cuts off of a cable is knit. */
export function with_stitch(text, cells, y, column, stitch) {
  const row = cells.rows[y], width = width_of(stitch), names = [];
  const columns = row.stitches.flatMap(([name, count]) => Array.from({length: count}, (_, k) => [name, k, count]));
  const begin = Math.min(column, columns.length - width);
  if (begin < 0 || columns[column][0] === stitch) return text;
  for (let at = 0; at < columns.length;) {
    const [name, k, count] = columns[at], end = at + count, is_whole = k === 0 && (end <= begin || at >= begin + width);
    names.push(at === begin ? stitch : is_whole ? name : 'k');
    at = at === begin ? at + width : is_whole ? end : at + 1;
  }
  return with_row(text, cells, row, names, row.yarns);
}
const names_of = ({stitches}) => stitches.map(([name]) => name);
export function with_letter(text, cells, y, column, letter) {
  const row = cells.rows[y];
  return with_row(text, cells, row, names_of(row), row.yarns.slice(0, column) + letter + row.yarns.slice(column + 1));
}
/** The text with a row more on top, or one less. */
export function with_rows(text, {rows}, more) {
  const lines = text.split('\n'), [top, next] = rows, is_upwards = next && next.line < top.line;
  if (!top || (!more && !next)) return text;
  if (more) lines.splice(top.line - 1 + (is_upwards ? 1 : 0), 0, lines[top.line - 1].replace(/\d+/, top.number + 1));
  else lines.splice(top.line - 1, 1);
  return lines.join('\n');
}
/** The text with a column more on the right, as the last one, or one less. */
export function with_columns(text, cells, more) {
  if (cells.rows.some(({stitches}) => stitches.length === 0 || (!more && stitches.length === 1 && stitches[0][1] === 1))) return text;
  for (const row of cells.rows) {
    const names = names_of(row), last = names.pop(), width = width_of(last);
    const end = more ? [last, width > 1 ? 'k' : last] : Array(width - 1).fill('k');
    text = with_row(text, cells, row, [...names, ...end], more ? row.yarns + row.yarns.at(-1) : row.yarns.slice(0, -1));
  }
  return text;
}
/** The text with one number more or less in an entry of a draft's section; `alone`: it is the only one. */
export function with_number(text, cells, section, key, number, alone) {
  const place = `[${section.toUpperCase()}]`, name = `${place} ${key}`, written = text.split('\n'), {lines} = cells;
  const before = cells[section][key - 1], without = before.filter((n) => n !== number);
  const numbers = cells[section][key - 1] = alone ? [number] : without.length < before.length ? without : [...before, number].sort((a, b) => a - b);
  if (!lines[name]) {
    const last = Math.max(...Object.keys(lines).map((known) => known.startsWith(place) ? lines[known] : 0));
    for (const known in lines) if (lines[known] > last) ++lines[known];
    written.splice(lines[name] = last, 0, '');
    ++lines[name];
  }
  written[lines[name] - 1] = `${key}=${numbers}`;
  return written.join('\n');
}

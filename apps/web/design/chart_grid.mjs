// A knitting chart (spec/chart.md) as cells, and back. The module of make says what is wrong with it; what is read here is all
// that can be shown.
const ROW = /^(\s*(\d+)\s*:)([^[\]]*)(?:\[([^\]]*)\]\s*)?$/;
export const STITCHES = ['k', 'p', 'yo', 'k2tog', 'ssk', 'c2f', 'c2b', 'c4f', 'c4b', 'c6f', 'c6b', 'c8f', 'c8b'];
/** Columns that a stitch takes. */
export const width_of = (stitch) => Number(stitch.match(/^c(\d)[fb]$/)?.[1] ?? 1);

/** The words "k2 p 3" one by one. */
function words_of(text, is_whole) {
  const words = [];
  for (const word of text.split(/[\s,]+/).filter(Boolean)) {
    const [, name, count] = is_whole(word) ? [null, word, ''] : word.match(/^(.*?)(\d*)$/);
    const last = words.at(-1);
    for (let k = name === '' ? 1 : 0; k < Math.min(Number(count || 1), 1024) && (name || last); ++k) words.push(name || last);
  }
  return words;
}
const runs_of = (words) => words.reduce((runs, word) => {
  if (runs.at(-1)?.[0] === word) ++runs.at(-1)[1];
  else runs.push([word, 1]);
  return runs;
}, []).map(([word, count]) => word + (count > 1 ? count : '')).join(' ');

/** { yarns: [[letter, colour]], rows: [{ line, number, stitches, letters }] }; rows from the top of the cloth, lines from 0. */
export function read_chart(text) {
  const yarns = [], rows = [];
  for (const [line, whole] of text.split('\n').entries()) {
    const [, letter, colour] = whole.match(/^\s*yarn ([a-z])\s*:(?:.*albedo=(#[\da-f]{6}))?/i) ?? [];
    if (letter) yarns.push([letter, colour]);
    const [, , number, stitches, letters] = whole.trimEnd().match(ROW) ?? [];
    if (!number) continue;
    const row = {line, number: Number(number), stitches: words_of(stitches.toLowerCase(), (word) => STITCHES.includes(word))};
    row.letters = words_of(letters ?? '', () => false);
    const count = row.stitches.reduce((sum, stitch) => sum + width_of(stitch), 0);
    if (row.letters.length === 1) row.letters = Array(count).fill(row.letters[0]);
    rows.push(row);
  }
  if (yarns.length === 0) yarns.push(['A']);
  return {yarns, rows: rows.sort((a, b) => b.number - a.number)};
}
function with_row(text, {line, stitches, letters}) {
  const lines = text.split('\n'), [, head] = lines[line].trimEnd().match(ROW);
  lines[line] = `${head} ${runs_of(stitches)}${letters.length > 0 ? ` [${runs_of(letters)}]` : ''}`;
  return lines.join('\n');
}
/** The text with another stitch from a column of a row on; what that cuts off of a cable is knit. */
export function with_stitch(text, row, column, stitch) {
  const columns = row.stitches.flatMap((word) => Array.from({length: width_of(word)}, (_, k) => [word, k])), width = width_of(stitch);
  const begin = Math.min(column, columns.length - width), stitches = [];
  if (begin < 0 || columns[column][0] === stitch) return text;
  for (let at = 0; at < columns.length;) {
    const [word, k] = columns[at], end = at + width_of(word);
    const is_whole = k === 0 && (end <= begin || at >= begin + width);
    stitches.push(at === begin ? stitch : is_whole ? word : 'k');
    at = at === begin ? at + width : is_whole ? end : at + 1;
  }
  return with_row(text, {...row, stitches});
}
export function with_letter(text, row, column, letter, first) {
  const count = row.stitches.reduce((sum, stitch) => sum + width_of(stitch), 0);
  const letters = Array.from({length: count}, (_, k) => k === column ? letter : row.letters[k] ?? first);
  return with_row(text, {...row, letters});
}
/** The text with a row more on top, or one less. */
export function with_rows(text, {rows: [top, next]}, more) {
  const lines = text.split('\n'), is_upwards = next && next.line < top.line;
  if (!more && !next) return text;
  if (more) lines.splice(top.line + (is_upwards ? 1 : 0), 0, lines[top.line].replace(/\d+/, top.number + 1));
  else lines.splice(top.line, 1);
  return lines.join('\n');
}
/** The text with a column more on the right, as the last one, or one less. */
export function with_columns(text, {rows}, more) {
  for (const row of rows) {
    const last = row.stitches.at(-1), width = width_of(last);
    if (!more && row.stitches.length === 1 && width === 1) return text;
    const end = more ? [last, width > 1 ? 'k' : last] : Array(width - 1).fill('k');
    const letters = row.letters.length === 0 ? [] : more ? [...row.letters, row.letters.at(-1)] : row.letters.slice(0, -1);
    text = with_row(text, {...row, stitches: [...row.stitches.slice(0, -1), ...end], letters});
  }
  return text;
}

// A weaving draft (spec/wif.md) as threading, tie-up, treadling or lift plan, and back. The module of make says what is wrong
// with it.

/** Sections by name: { begin, end, entries }: lines from 0; an entry by its key: { line, value }. The first of a name counts. */
export function sections_of(text) {
  const sections = new Map();
  let current = null;
  for (const [line, whole] of text.split('\n').entries()) {
    const name = whole.match(/^\s*\[([^\]]*)\]/)?.[1].trim().toUpperCase();
    if (name !== undefined) {
      current = {begin: line, end: line, entries: new Map()};
      if (!sections.has(name)) sections.set(name, current);
      continue;
    }
    const [, key, value] = whole.match(/^\s*([^;=][^=]*?)\s*=\s*([^;]*)/) ?? [];
    if (!current || key === undefined) continue;
    current.end = line;
    if (!current.entries.has(key.toUpperCase())) current.entries.set(key.toUpperCase(), {line, value: value.trim()});
  }
  return sections;
}
/** Numbers of an entry. */
const numbers_in = ({value} = {value: ''}) => value.split(',').map(Number).filter((n) => n > 0);

/**
 * { ends, picks, shafts, treadles, lifts, sets(section, n), over(end, pick) }: numbers from 1; lifts: without treadles, by
 * [LIFTPLAN]. Null where the numbers of yarns are not there.
 */
export function read_draft(text) {
  const sections = sections_of(text), entries = (name) => sections.get(name)?.entries ?? new Map();
  const number = (section, key) => Math.floor(Number(entries(section).get(key)?.value)) || 0;
  const ends = number('WARP', 'THREADS'), picks = number('WEFT', 'THREADS');
  if (ends < 1 || picks < 1) return null;
  const sets = (section, n) => numbers_in(entries(section).get(String(n)));
  const largest = (section) => [...entries(section).values()].reduce((most, entry) => Math.max(most, ...numbers_in(entry)), 0);
  const lifts = sections.has('LIFTPLAN') && !(entries('TREADLING').size > 0 && largest('LIFTPLAN') === 0);
  const shafts = Math.max(number('WEAVING', 'SHAFTS'), largest('THREADING'), largest(lifts ? 'LIFTPLAN' : 'TIEUP'));
  const treadles = lifts ? 0 : Math.max(number('WEAVING', 'TREADLES'), largest('TREADLING'));
  const rising = !/^(false|no|off|0)$/i.test(entries('WEAVING').get('RISING SHED')?.value ?? '');
  const lifted = (pick) => lifts ? sets('LIFTPLAN', pick) : sets('TREADLING', pick).flatMap((treadle) => sets('TIEUP', treadle));
  const over = (end, pick) => sets('THREADING', end).some((shaft) => lifted(pick).includes(shaft)) === rising;
  return {ends, picks, shafts, treadles, lifts, sets, over};
}
/** The text with one number more or less in an entry; `alone`: it is the only one. */
export function with_number(text, section, key, number, alone) {
  const lines = text.split('\n'), found = sections_of(text).get(section), entry = found?.entries.get(String(key));
  const before = numbers_in(entry), without = before.filter((n) => n !== number);
  const value = `${key}=${(alone ? [number] : without.length < before.length ? without : [...before, number].sort((a, b) => a - b)).join(',')}`;
  const cr = lines[0].endsWith('\r') ? '\r' : '';
  if (entry) lines[entry.line] = value + cr;
  else lines.splice((found?.end ?? lines.length - 1) + 1, 0, ...found ? [value + cr] : [`[${section}]${cr}`, value + cr]);
  return lines.join('\n');
}

// JSON as the pages want it, which JSON.parse does not tell apart: no member stands twice in an object, no
// string holds half a surrogate pair, brackets do not nest too deeply, and 4.0 or 4e0 is no integer.
import {utf8} from './bytes.js';

/** A number that is written with a fraction or an exponent; of no use where an integer is due. */
export class Decimal extends Number {}

export const is_number = (x) => typeof x === 'number' || x instanceof Decimal;
export const is_object = (x) =>
  typeof x === 'object' && x !== null && !Array.isArray(x) && !(x instanceof Decimal);

const ESCAPES = {
  '"': '"',
  '\\': '\\',
  '/': '/',
  b: '\b',
  f: '\f',
  n: '\n',
  r: '\r',
  t: '\t'
};

class Parser {
  constructor(text, depth) {
    this.text = text;
    this.at = 0;
    this.depth = depth;
  }
  fail(message) {
    throw new SyntaxError(`${message} at character ${this.at}`);
  }
  /** What the pattern, a sticky one, finds here. */
  take(pattern) {
    pattern.lastIndex = this.at;
    const found = pattern.exec(this.text)?.[0] ?? '';
    this.at += found.length;
    return found;
  }
  /** The next character that is no space. */
  next() {
    this.take(/[ \t\r\n]*/y);
    return this.text[this.at];
  }
  expect(character) {
    if (this.next() !== character) this.fail(`no ${character}`);
    ++this.at;
  }
  value() {
    const first = this.next();
    if (first === '{' || first === '[') {
      if (this.depth-- === 0) this.fail('nested too deeply');
      const result = first === '{' ? this.object() : this.array();
      ++this.depth;
      return result;
    }
    if (first === '"') return this.string();
    const word = this.take(/true|false|null/y);
    if (word) return {true: true, false: false, null: null}[word];
    const number = this.take(/-?(0|[1-9][0-9]*)(\.[0-9]+)?([eE][+-]?[0-9]+)?/y);
    if (!number) this.fail('no value');
    return /[.eE]/.test(number) ? new Decimal(number) : Number(number);
  }
  /** The items of an object or an array, up to its closing bracket. */
  items(closing, take_item) {
    ++this.at;
    if (this.next() !== closing) {
      take_item();
      while (this.next() === ',') {
        ++this.at;
        take_item();
      }
    }
    this.expect(closing);
  }
  array() {
    const result = [];
    this.items(']', () => result.push(this.value()));
    return result;
  }
  object() {
    const members = new Map();
    this.items('}', () => {
      if (this.next() !== '"') this.fail('no name of a member');
      const name = this.string();
      if (members.has(name)) this.fail(`the member ${name} stands twice`);
      this.expect(':');
      members.set(name, this.value());
    });
    return Object.fromEntries(members);
  }
  string() {
    let result = '';
    for (++this.at; this.text[this.at] !== '"';) {
      const plain = this.take(/[^"\\\0-\x1F]+/y);
      result += plain;
      if (plain) continue;
      if (this.text[this.at++] !== '\\') this.fail('a control character, or no end of a string');
      const code = this.take(/u[0-9a-fA-F]{4}/y);
      const escape = code ? String.fromCharCode(parseInt(code.slice(1), 16)) : ESCAPES[this.text[this.at++]];
      if (escape === undefined) this.fail('an unknown escape');
      result += escape;
    }
    ++this.at;
    if (/[\uD800-\uDFFF]/u.test(result)) this.fail('half a surrogate pair');
    return result;
  }
}

/**
 * The value of a JSON text in UTF-8 (a Uint8Array) whose brackets nest `depth` deep at most; else a SyntaxError.
 */
export function parse_json(bytes, depth) {
  let text;
  try {
    text = utf8(bytes);
  } catch { throw new SyntaxError('not UTF-8'); }
  const parser = new Parser(text, depth);
  const value = parser.value();
  if (parser.next() !== undefined) parser.fail('more than one value');
  return value;
}

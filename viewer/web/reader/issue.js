/** A fault of a file: a code of spec/issues.md, the place in the file, and a sentence. */
export class Issue extends Error {
  constructor(code, place, message) {
    super(message);
    this.code = code;
    this.place = place;
  }
}

export function throw_issue(code, place, message) {
  throw new Issue(code, place, message);
}

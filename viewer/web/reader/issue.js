/** What is wrong with a file: a code of spec/issues.md, where in the file, and a sentence. */
export class Issue extends Error {
  constructor(code, place, message) {
    super(message);
    this.code = code;
    this.place = place;
  }
}

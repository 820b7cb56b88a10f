/** A fault of a file: a code of spec/issues.md, the place in the file, and a sentence. */
export class Issue extends Error {
  constructor(code, place, message) {
    super(message);
    this.code = code;
    this.place = place;
  }
}

/** An error as an Issue; FILE_UNREADABLE if it has no code of its own. */
export const issue_of = (error) =>
  error instanceof Issue ? error : new Issue('FILE_UNREADABLE', '', error?.message ?? String(error));

export function throw_issue(code, place, message) {
  throw new Issue(code, place, message);
}

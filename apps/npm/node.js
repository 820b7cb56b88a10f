// Files of Node.js for run().
import { accessSync, constants, readdirSync, readFileSync, renameSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { dirname } from 'node:path';
import { fileURLToPath } from 'node:url';

/** A name as the program takes it: a file: address as a path; of Windows with slashes. */
export function plain_word(word, windows = process.platform === 'win32') {
  const name = /^file:\/\//.test(word) ? fileURLToPath(word, { windows }) : word;
  return windows ? name.replaceAll('\\', '/') : name;
}

/** The host of a process: its files, its standard output and error. */
export const node_host = () => ({
  folder: plain_word(process.cwd()),
  shared: plain_word(new URL('.', import.meta.url).href.replace(/\/$/, '')),
  exists: (path) => {
    const status = statSync(path, { throwIfNoEntry: false });
    return status && (status.isDirectory() ? 'folder' : status.isFile() ? 'file' : 'other');
  },
  read: (path) => readFileSync(path),
  list: (path) => readdirSync(path),
  refusal: (path) => {
    try {
      accessSync(dirname(path), constants.W_OK);
    } catch (error) {
      return error.code;
    }
  },
  write: (path, bytes) => {
    const part = `${path}.part-${process.pid}`;
    try {
      writeFileSync(part, bytes);
      renameSync(part, path);
    } catch (error) {
      rmSync(part, { force: true });
      throw error;
    }
  },
  stdout: (text) => process.stdout.write(text),
  stderr: (text) => process.stderr.write(text)
});
